//! The drone, whatever its links are: what it is by its configuration.

use uav_relay::Auth;
use uav_relay::GuardConfig;
#[cfg(feature = "auth")]
use uav_relay::Key;
use uav_relay::{Instant, Relay, Settings, Wiring};
#[cfg(feature = "auth")]
use uav_relay_kept::{epoch, journal::Journal};

use super::autopilot::{Autopilot, Uart};
#[cfg(feature = "auth")]
use super::flash;
use super::{board, config, kept, log};

/// The relay, what it has said, and the autopilot, if it is told where to fly; in places of their own in RAM, since the stack would
/// have to hold them.
pub(crate) struct Drone {
    pub(crate) relay: &'static mut Relay,
    pub(crate) views: &'static mut kept::Views,
    pub(crate) autopilot: Option<&'static mut Autopilot>,
}

/// The drone by its configuration; `None` where there is none to fly by.
///
/// This and [`switch_on`] are functions of their own so that the stack they need is given back.
#[inline(never)]
pub(crate) fn begin(wiring: Wiring, uart: Uart, now: Instant) -> Option<Drone> {
    let field = cortex_m::singleton!(FIELD: config::Room = config::EMPTY)?;
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
                kept::resume_upload(relay);
            }
            let views = cortex_m::singleton!(VIEWS: kept::Views = kept::Views::resume(relay, now))?;
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

/// The relay, unless this image was built without what it is asked for. It is made in a place of its own in RAM: the stack would have to
/// hold it.
#[inline(never)]
fn switch_on(
    config: &config::Config,
    auth: Option<Auth>,
    wiring: Wiring,
    now: Instant,
) -> Option<&'static mut Relay> {
    let common = config.mission.config().common;
    let [probe_after, dead_after] = config.silence();
    let settings = Settings {
        auth,
        // What it has in common with the others may change with an upload.
        profile: Some(config.profile)
            .filter(|own| !cfg!(feature = "upload") || config.hold_altitude || *own != common),
        hold_altitude: config.hold_altitude,
        method: config.method,
        measure: config.measure,
        listen: config.listen,
        wiring,
        guard: config.sites.as_ref().and_then(|sites| {
            Autopilot::guard(sites, GuardConfig::of(&config.mission, config.profile))
        }),
        sited: config.sites.is_some(),
        probe_after,
        dead_after,
        ..Settings::default()
    };
    // All else has been checked with the configuration.
    let slot = cortex_m::singleton!(RELAY: Option<Relay> = None)?;
    let seed = board::seed();
    Relay::new_in(slot, &config.mission, config.identity, &settings, seed, now)
        .map_err(log::cannot_fly)
        .ok()
}

/// Frames are to be signed, and cannot be.
struct CannotSign;

/// What frames are signed with in this start, if they are.
///
/// Where the flash cannot be written, as in an emulator, the epoch is still above all that stand there, and at least the configuration's:
/// but it may not rise from this start to the next.
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

/// An image built without the feature `auth` does not fly where frames are to be signed.
#[cfg(not(feature = "auth"))]
fn sign() -> Result<Option<Auth>, CannotSign> {
    if config::secret(board::block()) == Ok(None) {
        return Ok(None);
    }
    log::cannot_sign();
    Err(CannotSign)
}
