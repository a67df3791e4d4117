//! Drone as defined by its configuration block, with wires or a radio.

use uav_relay::Auth;
use uav_relay::GuardConfig;
#[cfg(feature = "auth")]
use uav_relay::Key;
#[cfg(not(feature = "departures"))]
use uav_relay::SetupError;
use uav_relay::{Instant, Relay, Settings, Wiring};
#[cfg(feature = "auth")]
use uav_relay_kept::{epoch, journal::Journal};

#[cfg(feature = "auth")]
use super::flash;
use super::{board, config, log, persistent};
use crate::autopilot::{Autopilot, Uart};

/// Relay, storage of its votes (on the chain's members), and autopilot link, if any. All are in static RAM.
pub(crate) struct Drone {
    pub(crate) relay: &'static mut Relay,
    pub(crate) views: &'static mut persistent::Views,
    pub(crate) autopilot: Option<&'static mut Autopilot>,
}

/// Creates relay and autopilot link from the configuration block; `None` if the drone cannot fly.
///
/// This function and [`switch_on`] are not inlined, so that their stack frames are freed when they return.
#[inline(never)]
pub(crate) fn begin(wiring: Wiring, uart: Uart, now: Instant) -> Option<Drone> {
    let field = cortex_m::singleton!(FIELD: config::FieldStorage = config::EMPTY)?;
    match config::read(board::block(), field) {
        Ok(config) => {
            log::begins(&config);
            let auth = sign().ok()?;
            let autopilot = if let Some(sites) = &config.sites {
                Some(Autopilot::begin(uart, sites, &config.mission, now)?)
            } else {
                log::unguarded();
                None
            };
            let relay = switch_on(&config, auth, wiring, now)?;
            #[cfg(feature = "upload")]
            if auth.is_some() {
                persistent::resume_upload(relay);
            }
            let views = cortex_m::singleton!(VIEWS: persistent::Views = persistent::Views::resume(relay, now))?;
            // After the votes are loaded, as `wait_as_spare` requires.
            #[cfg(feature = "departures")]
            if config.spare {
                relay.wait_as_spare(now);
            }
            Some(Drone {
                relay,
                views,
                autopilot,
            })
        }
        Err(error) => {
            log::refused(error);
            None
        }
    }
}

/// Creates the relay in static RAM, to save stack; `None` if the relay rejects the configuration.
///
/// The relay rejects a setting that needs a feature missing in this image. It also rejects the joint method for more
/// than 100 relays.
#[inline(never)]
fn switch_on(
    config: &config::Config,
    auth: Option<Auth>,
    wiring: Wiring,
    now: Instant,
) -> Option<&'static mut Relay> {
    #[cfg(not(feature = "departures"))]
    if config.flying > 0 {
        log::cannot_fly(SetupError::Flying);
        return None;
    }
    let settings = Settings {
        auth,
        #[cfg(feature = "departures")]
        flying: config.flying,
        guard: config.sites.as_ref().and_then(|sites| {
            Autopilot::guard(sites, GuardConfig::of(&config.mission, config.profile))
        }),
        ..config.settings(wiring)
    };
    // The check of the configuration has ruled out most other errors.
    let slot = cortex_m::singleton!(RELAY: Option<Relay> = None)?;
    let seed = board::seed();
    Relay::new_in(slot, &config.mission, config.identity, &settings, seed, now)
        .map_err(log::cannot_fly)
        .ok()
}

/// Error: the configuration block has a signing key, but frames cannot be signed.
struct CannotSign;

/// Returns the signing key and this start's epoch; `None` if the configuration block has no key.
///
/// If the flash cannot be written, as in an emulator, the epoch is still larger than all stored epochs, and at least
/// the epoch in the block. The next start may then use the same epoch again.
#[cfg(feature = "auth")]
#[inline(never)]
fn sign() -> Result<Option<Auth>, CannotSign> {
    let config::Secret { key, epoch: floor } = match config::secret(board::block()) {
        Ok(Some(secret)) => secret,
        Ok(None) => {
            log::unsigned();
            return Ok(None);
        }
        Err(error) => {
            log::refused(error);
            return Err(CannotSign);
        }
    };
    let mut entries = Journal::new(flash::EPOCHS, epoch::WORDS, epoch::KEY);
    let Some((epoch, kept)) = epoch::begin(&mut entries, floor) else {
        log::no_epoch();
        return Err(CannotSign);
    };
    log::signs(epoch, kept);
    Ok(Some(Auth {
        key: Key::new(key),
        epoch,
    }))
}

/// Returns an error if the block has a signing key, because this image has no feature `auth`.
#[cfg(not(feature = "auth"))]
fn sign() -> Result<Option<Auth>, CannotSign> {
    if config::secret(board::block()) == Ok(None) {
        return Ok(None);
    }
    log::cannot_sign();
    Err(CannotSign)
}
