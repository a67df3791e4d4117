//! The drone, whatever its links are: it reads its configuration, runs its relay, and flies where that says.

use embedded_hal::digital::OutputPin;
#[cfg(feature = "upload")]
use uav_relay::Event;
use uav_relay::guard::config::GuardConfig;
use uav_relay::serial::{Pair, SerialLink, SerialPort, Shared};
use uav_relay::wire::auth::Auth;
#[cfg(feature = "auth")]
use uav_relay::wire::auth::Key;
use uav_relay::{Instant, Relay, Sample, Settings, Wiring};

use super::autopilot::{Autopilot, Uart};
use super::clock::Clock;
#[cfg(feature = "auth")]
use super::journal::Journal;
use super::{board, config, kept, log};
#[cfg(feature = "auth")]
use super::{epoch, flash};

/// What the links of both variants have in common.
pub(crate) trait Links {
    /// Moves bytes between the ports and the relay, and says when to be called again. What the relay has said is kept between what
    /// comes in and what is sent.
    fn poll(&mut self, now: Instant, drone: &mut Drone) -> Option<Instant>;

    /// Logs the counters of each link.
    fn log_counters(&self);
}

impl<U: SerialPort, D: SerialPort> Links for Pair<U, D> {
    fn poll(&mut self, now: Instant, drone: &mut Drone) -> Option<Instant> {
        let Drone { relay, views, .. } = drone;
        self.poll_keeping(now, relay, &mut |relay| views.keep(relay))
    }

    fn log_counters(&self) {
        log::link_counters(SerialLink::stats(&self.upstream));
        log::link_counters(SerialLink::stats(&self.downstream));
    }
}

impl<P: SerialPort, Pin: OutputPin> Links for Shared<P, Pin> {
    fn poll(&mut self, now: Instant, drone: &mut Drone) -> Option<Instant> {
        let Drone { relay, views, .. } = drone;
        self.poll_keeping(now, relay, &mut |relay| views.keep(relay))
    }

    fn log_counters(&self) {
        log::link_counters(self.channel.stats());
    }
}

/// The relay, what it has said, and the autopilot, if it is told where to fly; in places of their own in RAM, since the stack would
/// have to hold them.
pub(crate) struct Drone {
    relay: &'static mut Relay,
    views: &'static mut kept::Views,
    autopilot: Option<&'static mut Autopilot>,
}

/// Flies for good.
pub(crate) fn fly<L: Links>(mut clock: Clock, links: &mut L, mut drone: Drone) -> ! {
    loop {
        let now = clock.now();
        let relay = &mut *drone.relay;
        while let Some(sample) = measured() {
            relay.handle_sample(now, sample);
        }
        if let Some(autopilot) = &mut drone.autopilot {
            autopilot.listen(now, relay);
        }
        let wake = links.poll(clock.now(), &mut drone);
        let relay = &mut *drone.relay;
        while let Some(event) = relay.poll_event() {
            log::event(event, relay);
            // The control of the proof that no panic is reachable: with this one the image must not link.
            #[cfg(panic_on_purpose)]
            assert!(
                relay.setpoint().is_none_or(|place| place.x_m < 1e6),
                "put there on purpose"
            );
            if let Some(autopilot) = &mut drone.autopilot {
                autopilot.tell(event);
            }
            #[cfg(feature = "upload")]
            if event == Event::Uploaded {
                kept::keep_upload(relay);
            }
        }
        if log::asked() {
            log::counters(relay);
            links.log_counters();
        }
        // With what the neighbours have just changed.
        let soon = drone.autopilot.as_mut();
        let soon = soon.map(|autopilot| autopilot.fly(now, relay));
        clock.sleep(wake.into_iter().chain(soon).min());
    }
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
        guard: (Autopilot::FLIES && config.sites.is_some()).then(|| GuardConfig {
            hover_m: Autopilot::POSITION_ERROR_M,
            ..GuardConfig::of(&config.mission, config.profile)
        }),
        sited: config.sites.is_some(),
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

/// Replace this by what your receiver has measured since it was asked last, if the configuration has the relay measure, or listen: then with
/// where the drone was. Of a field, once that says enough, `Relay::restart` at the leader has the chain agree again.
const fn measured() -> Option<Sample> {
    None
}
