//! Relays on instantaneous wires, on which a test can inspect, delay and drop every frame.

use std::collections::VecDeque;

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{self, MAX_FRAME};
use uav_relay::wire::message::{AdjustStep, Message};
use uav_relay::{Band, Identity, Instant, Mission, MissionConfig, Phase, Port, Relay, Settings};
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{self, Place};

/// Frame in transit: receiver counted from 0, its port, and the bytes.
pub(crate) struct Flying {
    pub(crate) to: usize,
    pub(crate) port: Port,
    pub(crate) bytes: Vec<u8>,
}

impl Flying {
    /// Returns true for a message of Algorithm 2's last round.
    pub(crate) fn is_stop(&self) -> bool {
        self.is(
            |message| matches!(message, Message::Token(token) if token.turn == AdjustStep::Stop),
        )
    }

    pub(crate) fn is(&self, what: impl Fn(&Message) -> bool) -> bool {
        let mut deframer = Deframer::new();
        self.bytes.iter().any(|&byte| match deframer.push(byte) {
            Some(Ok(plain)) => what(&frame::decode(plain).unwrap().1),
            _ => false,
        })
    }
}

pub(crate) struct Chain {
    link: Link,
    mission: Mission,
    settings: Settings,
    pub(crate) relays: Vec<Relay>,
    pub(crate) now: Instant,
    pub(crate) flying: VecDeque<Flying>,
}

impl Chain {
    /// Creates the paper's link, with altitudes within `band` that start at `altitude_m`.
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
        let mut chain = Self {
            link,
            mission: Mission::try_new(config).unwrap(),
            settings,
            relays: Vec::new(),
            now: Instant::ZERO,
            flying: VecDeque::new(),
        };
        for (at, seed) in (0..relays).zip(0..) {
            let relay = chain.switched_on(at, seed);
            chain.relays.push(relay);
        }
        chain
    }

    fn switched_on(&self, at: usize, seed: u32) -> Relay {
        let index = u16::try_from(at).unwrap() + 1;
        let identity = Identity { network: 1, index };
        Relay::new(self.mission, identity, self.settings, seed, self.now).unwrap()
    }

    pub(crate) fn reboot(&mut self, at: usize, seed: u32) {
        self.relays[at] = self.switched_on(at, seed);
    }

    /// Delivers the next frame, or else advances to the next timer.
    pub(crate) fn step(&mut self) {
        if let Some(Flying { to, port, bytes }) = self.flying.pop_front() {
            self.relays[to].handle_bytes(self.now, port, &bytes);
        } else {
            let next = self.relays.iter().filter_map(Relay::poll_timeout).min();
            self.now = next.unwrap().max(self.now);
        }
        for (at, relay) in self.relays.iter_mut().enumerate() {
            relay.handle_timeout(self.now);
            let mut frame = [0; MAX_FRAME];
            relay.persist(|_| true);
            while let Some(transmit) = relay.poll_transmit(self.now, &mut frame) {
                let (to, port) = match transmit.port {
                    Port::Downstream => (at + 1, Port::Upstream),
                    _ => (at - 1, Port::Downstream),
                };
                let bytes = frame[..transmit.len].to_vec();
                self.flying.push_back(Flying { to, port, bytes });
            }
        }
    }

    /// Steps until `done`, for at most `limit_ms` of virtual time. Returns the time taken, ms.
    pub(crate) fn until(&mut self, limit_ms: u64, done: impl Fn(&Self) -> bool) -> Option<u64> {
        let begun = self.now;
        let took = |chain: &Self| chain.now.since(begun).as_micros().div_ceil(1000);
        while !done(self) {
            self.step();
            if took(self) > limit_ms {
                return None;
            }
        }
        Some(took(self))
    }

    /// Returns true if all relays hold positions in the same view and no frame is in transit.
    pub(crate) fn holds(&self) -> bool {
        let view = self.relays[0].view();
        let holds = |relay: &Relay| relay.phase() == Phase::Holding && relay.view() == view;
        self.relays.iter().all(holds)
    }

    /// Returns the relative margin of the chain's SIR over its target, and the smallest distance, m.
    pub(crate) fn margin(&self) -> (f64, f64) {
        let at = |relay: &Relay| relay.setpoint().unwrap();
        let places: Vec<Place> = self
            .relays
            .iter()
            .map(at)
            .map(|at| Place::in_plane(f64::from(at.x_m), f64::from(at.altitude_m)))
            .collect();
        let apart = |pair: &[Place]| pair[0].distance_m(&pair[1]);
        let nearest = places.windows(2).map(apart).fold(f64::INFINITY, f64::min);
        let targets = self.relays.iter().map(|relay| relay.target().unwrap());
        let most = f64::from(targets.fold(0.0, f32::max));
        (
            joint::sir(&self.link, &places).unwrap() / most - 1.0,
            nearest,
        )
    }
}

/// Bands of one altitude and of many.
pub(crate) const LOW: Band = Band::at(20.0);
pub(crate) const WIDE: Band = Band {
    least_m: 20.0,
    most_m: 300.0,
};
