//! Main loop on polled ports: serves the relay, its ports and the autopilot, then sleeps.

use embedded_hal::digital::OutputPin;
#[cfg(feature = "upload")]
use uav_relay::Event;
use uav_relay::serial::{Pair, SerialLink, SerialPort, Shared};
use uav_relay::{Instant, Sample};

use crate::firmware::chip;
use crate::firmware::clock::Clock;
use crate::firmware::drone::Drone;
use crate::firmware::log;
#[cfg(feature = "upload")]
use crate::firmware::persistent;

pub(crate) trait Links {
    /// Exchanges bytes between ports and relay. Returns the time by which the next call is due.
    ///
    /// Changed votes on the chain's members are stored after receiving and before sending.
    fn poll(&mut self, now: Instant, drone: &mut Drone) -> Option<Instant>;

    fn log_counters(&self);
}

impl<U: SerialPort, D: SerialPort> Links for Pair<U, D> {
    fn poll(&mut self, now: Instant, drone: &mut Drone) -> Option<Instant> {
        let Drone { relay, views, .. } = drone;
        Self::poll(self, now, relay, |record| views.store(record))
    }

    fn log_counters(&self) {
        log::link_counters(SerialLink::stats(&self.upstream));
        log::link_counters(SerialLink::stats(&self.downstream));
    }
}

impl<P: SerialPort, Pin: OutputPin> Links for Shared<P, Pin> {
    fn poll(&mut self, now: Instant, drone: &mut Drone) -> Option<Instant> {
        let Drone { relay, views, .. } = drone;
        Self::poll(self, now, relay, |record| views.store(record))
    }

    fn log_counters(&self) {
        log::link_counters(self.channel.stats());
    }
}

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
            // This panic tests the proof that no panic is reachable: with it the image must not link.
            #[cfg(panic_on_purpose)]
            assert!(
                relay.setpoint().is_none_or(|place| place.x_m < 1e6),
                "deliberate panic of the check: it must not link"
            );
            if let Some(autopilot) = &mut drone.autopilot {
                autopilot.handle_event(event);
            }
            #[cfg(feature = "upload")]
            if event == Event::Uploaded {
                persistent::store_upload(relay);
            }
        }
        if log::counters_requested() {
            log::counters(relay);
            links.log_counters();
        }
        // This comes after the links are served, so that the state of the neighbours is the newest.
        let soon = drone.autopilot.as_mut();
        let soon = soon.map(|autopilot| autopilot.fly(now, relay));
        let now = clock.now();
        chip::end_turn(relay, now);
        let wake = wake.into_iter().chain(soon).min();
        clock.sleep(Some(chip::latest(now, wake)));
    }
}

/// Returns no measurement. Replace this function by one that returns the newest measurement of your receiver.
///
/// To estimate the interferer, the relay also needs the drone's position. If the mission has the interference as a
/// function of x, call `Relay::restart` at the leader after enough samples. The chain then agrees on positions for
/// the measured interference.
const fn measured() -> Option<Sample> {
    None
}
