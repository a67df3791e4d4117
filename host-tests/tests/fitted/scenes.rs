//! Random chains with fitted slots.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::optimiser::joint::Seat;
use uav_relay::{Mission, Placement};
use uav_relay_scenario::link::{Access, Link, Radio, RateModel};
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Noise, Scenario, Source, mission};

/// Relative tolerance of the SIR of all missions.
pub(crate) const TOLERANCE: f64 = 1e-4;

pub(crate) fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// Random test case: scenario, data link with fitted slots, and number of relays.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) scenario: Scenario,
    pub(crate) radio: Radio,
    pub(crate) relays: u16,
}

impl Case {
    /// Draws a chain of 1 to 20 relays: one way or both, with noise or without. In a fifth of the cases the interferer
    /// is on the line, else up to 800 m beside it.
    pub(crate) fn draw(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let relays = rng.random_range(1..=20_u16);
        let [tx_w, rx_w] = [[80.0, 80.0], [1.0, 1.0], [80.0, 1.0]][rng.random_range(0..3)];
        let side = if rng.random() { 1.0 } else { -1.0 };
        let source = Source {
            power_w: 10_f64.powf(rng.random_range(0.0..2.0)),
            x_m: rng.random_range(-200.0..1200.0),
            y_m: if rng.random_bool(0.2) {
                0.0
            } else {
                side * rng.random_range(20.0..800.0)
            },
        };
        let reverse = [0.0, 1.0, rng.random_range(0.02..1.0)][rng.random_range(0..3)];
        let gap_db = rng.random_range(0.0..6.0);
        let link = Link {
            access: Access::Fitted,
            bandwidth_hz: None,
            model: RateModel::Shannon { gap_db },
        };
        let mut scenario = Scenario {
            tx_w,
            rx_w,
            reverse,
            min_separation_m: if rng.random() {
                4.0
            } else {
                rng.random_range(1.0..30.0)
            },
            interference: Interference::Sources(vec![source]),
            link: Some(link.clone()),
            ..Scenario::default()
        };
        if rng.random() {
            scenario.noise = Noise {
                power_dbm: Some(rng.random_range(-120.0..-60.0)),
                ..Noise::default()
            };
        }
        if rng.random_bool(0.3) {
            let own = make::relay_override(None, Some(rng.random_range(0.2..3.0)));
            scenario.relays.insert(rng.random_range(1..=relays), own);
        }
        Self {
            scenario,
            radio: Radio {
                link,
                bandwidth_hz: 1e6,
            },
            relays,
        }
    }

    /// Returns the mission with fitted slots.
    pub(crate) fn mission(&self) -> Mission {
        let (mission, _) = mission::mission(&self.scenario, self.relays, TOLERANCE).unwrap();
        mission::with_access(&self.scenario, &mission).unwrap()
    }

    /// Returns the profiles of the relays in `mission`.
    pub(crate) fn seats(&self, mission: &Mission) -> impl Fn(u16) -> Seat + use<> {
        let common = Seat::common(mission);
        let own = self.scenario.relays.clone();
        move |index| Seat {
            power_w: own
                .get(&index)
                .and_then(|own| own.power_w)
                .map_or(common.power_w, |power_w| power_w as f32),
            ..common
        }
    }

    /// Returns the time that each hop needs for one bit to Rx, and for `reverse` bits to Tx.
    ///
    /// Times are in units of 1 / bandwidth. The second list is empty if the chain has only the direction to Rx.
    pub(crate) fn times(&self, places: &[Placement]) -> [Vec<f64>; 2] {
        let scene = Scene::new(&self.scenario, self.relays).unwrap();
        let places: Vec<Place> = places.iter().map(|at| (*at).into()).collect();
        let reverse = self.scenario.reverse;
        let time = |sirs: Vec<f64>, bits: f64| -> Vec<f64> {
            let model = &self.radio.link.model;
            sirs.iter()
                .map(|sir| bits / model.bits_per_hz(*sir))
                .collect()
        };
        let there = time(scene.hop_sirs(&places), 1.0);
        if reverse > 0.0 {
            return [there, time(scene.hop_sirs_back(&places), reverse)];
        }
        [there, Vec::new()]
    }

    /// Returns the sum of the times of all hops, see [`times`](Self::times), with the relays at `places`.
    pub(crate) fn time(&self, places: &[Placement]) -> f64 {
        self.times(places).iter().flatten().sum()
    }
}
