//! Relays in a row on wires, with ground stations at one end or both.

use std::cell::Cell;
use std::rc::Rc;

use chacha20::ChaCha8Rng;
use host_tests::bench::Bench;
use host_tests::make;
use rand::{RngExt as _, SeedableRng as _};
use uav_relay::ground::Progress;
use uav_relay::{Auth, Duration, Event, FlownMission, Identity, Placement, Relay, Settings};

use super::*;

/// Interval at which all main loops run. Frames arrive one interval after they are sent.
const TURN: Duration = Duration::from_millis(5);

/// Largest distance that a drone flies along each axis in one interval (`TURN`), m.
const MOST_M: f32 = 0.05;

const AUTH: Auth = make::auth([7; 32], 1);

/// Chain of relays on lossy wires, with ground stations.
pub(crate) struct Wires {
    pub(crate) bench: Bench,
    loss: Rc<Cell<f64>>,
    /// Positions of the drones of relays with a motion guard.
    places: Vec<Placement>,
}

impl Wires {
    /// Creates relays with a key that have the mission `base` before flight. Each has its own `settings`.
    pub(crate) fn new(base: Mission, seed: u64, settings: impl Fn(u16) -> Settings) -> Self {
        let relay = |index| {
            let identity = Identity { network: 7, index };
            let settings = Settings {
                auth: Some(AUTH),
                ..settings(index)
            };
            let seed = seed as u32 ^ u32::from(index) << 16;
            Relay::new(base, identity, settings, seed, Instant::ZERO).unwrap()
        };
        let relays = (1..=base.relays()).map(relay).collect();
        let mut bench = Bench::new(relays, Instant::ZERO);
        bench.latency = TURN;
        let (loss, mut rng) = (Rc::new(Cell::new(0.0)), ChaCha8Rng::seed_from_u64(seed));
        let lost = Rc::clone(&loss);
        bench.fate = Box::new(move |_| !rng.random_bool(lost.get()));
        Self {
            bench,
            loss,
            places: Vec::new(),
        }
    }

    pub(crate) fn lose(&self, loss: f64) {
        self.loss.set(loss);
    }

    /// Starts an upload from the ground station at `end`. The relays' mission before flight is `base`.
    pub(crate) fn upload(&mut self, base: &Mission, end: Side, upload: Upload) {
        let now = self.bench.now;
        self.bench
            .ground(base, end, AUTH)
            .upload(now, upload)
            .unwrap();
    }

    /// Makes the ground station at `end` request the mission that the relays fly. Their mission before flight is
    /// `base`.
    pub(crate) fn request_flown(&mut self, base: &Mission, end: Side) {
        let now = self.bench.now;
        self.bench.ground(base, end, AUTH).request_flown(now);
    }

    pub(crate) fn flown(&self, end: Side) -> Option<FlownMission> {
        self.bench.grounds[end as usize].as_ref()?.flown().copied()
    }

    pub(crate) fn progress(&self, end: Side) -> Progress {
        let ground = self.bench.grounds[end as usize].as_ref();
        ground.map_or(Progress::Idle, |ground| ground.progress())
    }

    pub(crate) fn versions(&self) -> Vec<u16> {
        self.bench.relays.iter().map(Relay::version).collect()
    }

    pub(crate) fn relay(&self, index: usize) -> &Relay {
        &self.bench.relays[index - 1]
    }

    /// Places the drones by relay index. The drones follow their setpoints from then on.
    pub(crate) fn place_drones(&mut self, place: impl Fn(u16) -> Placement) {
        self.places = (1..)
            .zip(&self.bench.relays)
            .map(|(index, _)| place(index))
            .collect();
    }

    /// Returns true if every relay has agreed on a position at least once.
    pub(crate) fn has_converged(&self) -> bool {
        let all = 0..self.bench.relays.len();
        all.into_iter()
            .all(|at| self.bench.has_raised(at, Event::Converged))
    }

    /// Runs the chain for one interval (`TURN`), after which the drones move.
    pub(crate) fn turn(&mut self) {
        self.bench.run_for(TURN);
        let now = self.bench.now;
        for (relay, place) in self.bench.relays.iter_mut().zip(&mut self.places) {
            let to = relay.setpoint().unwrap_or(*place);
            let step = |is: f32, to: f32| is + (to - is).clamp(-MOST_M, MOST_M);
            *place = make::placement(
                step(place.x_m, to.x_m),
                step(place.y_m, to.y_m),
                step(place.altitude_m, to.altitude_m),
            );
            relay.handle_position(now, *place, now);
        }
    }

    /// Runs the chain until `over` is true, for at most `most_s` seconds. Returns true if `over` has become true.
    pub(crate) fn until(&mut self, most_s: u64, mut over: impl FnMut(&Self) -> bool) -> bool {
        let end = self.bench.now + Duration::from_millis(1_000 * most_s);
        while self.bench.now < end {
            self.turn();
            if over(self) {
                return true;
            }
        }
        false
    }
}
