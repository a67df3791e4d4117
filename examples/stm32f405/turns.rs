//! The main loop on polled ports: the relay, its ports and the autopilot in turn, then sleep.

use embedded_hal::digital::OutputPin;
#[cfg(feature = "upload")]
use uav_relay::Event;
use uav_relay::serial::{Pair, SerialLink, SerialPort, Shared};
use uav_relay::{Instant, Sample};

use super::chip;
use super::clock::Clock;
use super::drone::Drone;
#[cfg(feature = "upload")]
use super::kept;
use super::log;

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
        let now = clock.now();
        chip::end_turn(relay, now);
        let wake = wake.into_iter().chain(soon).min();
        clock.sleep(Some(chip::latest(now, wake)));
    }
}

/// Replace this by what your receiver has measured since it was asked last, if the configuration has the relay measure, or listen: then with
/// where the drone was. Of a field, once that says enough, `Relay::restart` at the leader has the chain agree again.
const fn measured() -> Option<Sample> {
    None
}
