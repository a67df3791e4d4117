//! Test chain with the paper's link, in virtual time. Its relays can reboot.

use host_tests::bench::{Bench, Frame};
use host_tests::make;
use uav_relay::wire::message::{AdjustStep, Message};
use uav_relay::{Band, Duration, Instant, Mission, MissionConfig, Relay, Settings};
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{self, Place};

/// Returns true for a frame with the message that ends Algorithm 2 after its last round.
pub(crate) fn is_stop(frame: &Frame) -> bool {
    frame.is(|message| matches!(message, Message::Token(token) if token.turn == AdjustStep::Stop))
}

pub(crate) struct Chain {
    link: Link,
    mission: Mission,
    settings: Settings,
    pub(crate) bench: Bench,
}

impl Chain {
    /// Creates the paper's chain with the interferer at y = 150 m. Altitudes are within `band` and start at
    /// `altitude_m`.
    pub(crate) fn new(relays: usize, altitude_m: f64, band: Band, settings: Settings) -> Self {
        let mut link = Link {
            y_i: 150.0,
            min_separation_m: 4.0,
            ..Link::paper(relays)
        };
        for relay in &mut link.relays {
            relay.altitude_m = altitude_m;
        }
        let (mission, _) = of_link(&link, 1e-4).unwrap();
        let config = MissionConfig {
            band,
            ..*mission.config()
        };
        let mission = Mission::try_new(config).unwrap();
        Self {
            link,
            mission,
            settings,
            bench: Bench::of(mission, |_| settings),
        }
    }

    pub(crate) fn reboot(&mut self, at: usize, seed: u32) {
        let identity = make::identity(u16::try_from(at).unwrap() + 1);
        let now = self.bench.now;
        let relay = Relay::new(self.mission, identity, self.settings, seed, now);
        self.bench.relays[at] = relay.unwrap();
    }

    /// Delivers the next frame, or advances to the next timer if no frame is in transit.
    pub(crate) fn step(&mut self) {
        self.bench.step(Instant::from_micros(u64::MAX));
    }

    /// Runs the chain until `done` is true. Returns the time taken, ms; `None` if it takes longer than `limit_ms`.
    pub(crate) fn until(&mut self, limit_ms: u64, done: impl Fn(&Bench) -> bool) -> Option<u64> {
        let took = self
            .bench
            .run_until(Duration::from_millis(limit_ms), done)?;
        Some(took.as_micros().div_ceil(1000))
    }

    /// Returns by which fraction the SIR exceeds its target, and the least distance of relays, m.
    pub(crate) fn margin(&self) -> (f64, f64) {
        let at = |relay: &Relay| relay.setpoint().unwrap();
        let places: Vec<Place> = self
            .bench
            .relays
            .iter()
            .map(at)
            .map(|at| Place::in_plane(f64::from(at.x_m), f64::from(at.altitude_m)))
            .collect();
        let apart = |pair: &[Place]| pair[0].distance_m(&pair[1]);
        let nearest = places.windows(2).map(apart).fold(f64::INFINITY, f64::min);
        let targets = self
            .bench
            .relays
            .iter()
            .map(|relay| relay.target().unwrap());
        let most = f64::from(targets.fold(0.0, f32::max));
        (
            joint::sir(&self.link, &places).unwrap() / most - 1.0,
            nearest,
        )
    }
}

/// Altitude range that permits only 20 m.
pub(crate) const LOW: Band = Band::at(20.0);
/// Altitude range from 20 m to 300 m.
pub(crate) const WIDE: Band = make::band(20.0, 300.0);
