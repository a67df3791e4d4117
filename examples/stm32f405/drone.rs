//! The drone, whatever its links are: it reads its configuration, runs its relay, and flies where that says.

use embedded_hal::digital::OutputPin;
use uav_relay::serial::{Pair, SerialLink, SerialPort, Shared};
use uav_relay::{Event, Instant, Placement, Relay, Settings, Wiring};

use super::clock::Clock;
use super::{board, config, log};

/// What the links of both variants have in common.
pub(crate) trait Links {
    /// How the relay is connected by them.
    const WIRING: Wiring;

    /// Moves bytes between the ports and the relay, and says when to be called again.
    fn poll(&mut self, now: Instant, relay: &mut Relay) -> Option<Instant>;

    /// Logs the counters of each link.
    fn log_counters(&self);
}

impl<U: SerialPort, D: SerialPort> Links for Pair<U, D> {
    const WIRING: Wiring = Wiring::Pair;

    fn poll(&mut self, now: Instant, relay: &mut Relay) -> Option<Instant> {
        Self::poll(self, now, relay)
    }

    fn log_counters(&self) {
        log::link_counters(SerialLink::stats(&self.upstream));
        log::link_counters(SerialLink::stats(&self.downstream));
    }
}

impl<P: SerialPort, Pin: OutputPin> Links for Shared<P, Pin> {
    const WIRING: Wiring = Wiring::Shared;

    fn poll(&mut self, now: Instant, relay: &mut Relay) -> Option<Instant> {
        Self::poll(self, now, relay)
    }

    fn log_counters(&self) {
        log::link_counters(self.channel.stats());
    }
}

/// Flies for good, or sleeps for good where there is no configuration to fly by.
pub(crate) fn fly<L: Links>(mut clock: Clock, mut links: L) -> ! {
    let config = match config::read(&board::block()) {
        Ok(config) => config,
        Err(error) => {
            log::refused(error);
            board::stop();
        }
    };
    let settings = Settings {
        wiring: L::WIRING,
        profile: Some(config.profile),
        ..Settings::default()
    };
    let relay = Relay::new(
        config.mission,
        config.identity,
        settings,
        board::seed(),
        clock.now(),
    );
    // What could be refused here has been checked with the configuration.
    let Ok(mut relay) = relay else { board::stop() };
    log::begins(&config);
    loop {
        let wake = links.poll(clock.now(), &mut relay);
        while let Some(event) = relay.poll_event() {
            log::event(event, &relay);
            if event == Event::SetpointChanged
                && let Some(place) = relay.setpoint()
            {
                fly_to(place);
            }
        }
        if log::asked() {
            log::counters(&relay);
            links.log_counters();
        }
        clock.sleep(wake);
    }
}

/// Replace this by what your autopilot wants to hear: `place.x_m` metres from the transmitter toward the receiver, at
/// `place.altitude_m` above the ground.
fn fly_to(place: Placement) {
    core::hint::black_box(place);
    // The control of the proof that no panic is reachable: with this one the image must not link.
    #[cfg(panic_on_purpose)]
    assert!(place.x_m < 1e6, "put there on purpose");
}
