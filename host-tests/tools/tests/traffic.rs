//! Planned data rates are delivered: packets are sent through simulated chains.
//!
//! `COUNT` and `SEED` in the environment set the number of scenes and the first seed.
#![cfg(test)]

use std::fmt::Write as _;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::link::{Access, Link, Radio, RateModel, RateStep};
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Noise, RelayOverride, Scenario, Source, mission};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::route::{DataLink, TrueHops};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::traffic::{Flow, Traffic, TrafficSpec, traffic};
use uav_relay_tools::plan::carried::Carried;
use uav_relay_tools::plan::rate::{Rate, Rates};
use uav_relay_tools::plan::{Number, Plan, PlanRequest, plan};

/// Relative tolerance of the chain's SIR, for planned and for simulated positions.
const TOLERANCE: f64 = 1e-4;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// Random test case: scenario, data link and number of relays.
struct Case {
    scenario: Scenario,
    radio: Radio,
    relays: u16,
}

impl Case {
    fn draw(seed: u64, access: Access, has_steps: bool) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let relays = rng.random_range(1..=20);
        let [tx_w, rx_w] = [[80.0, 80.0], [1.0, 1.0], [80.0, 1.0]][rng.random_range(0..3)];
        let side = if rng.random() { 1.0 } else { -1.0 };
        let source = Source {
            power_w: rng.random_range(0.0_f64..2.0).exp2().powi(3).min(100.0),
            x_m: rng.random_range(-200.0..1200.0),
            y_m: side * rng.random_range(50.0..800.0),
        };
        let bandwidth_hz = 10_f64.powf(rng.random_range(4.0..8.0));
        let mut scenario = Scenario {
            tx_w,
            rx_w,
            interference: Interference::Sources(vec![source]),
            ..Scenario::default()
        };
        if rng.random() {
            scenario.noise = Noise {
                bandwidth_hz,
                figure_db: 6.0,
                ..Noise::default()
            };
        }
        if rng.random_bool(0.3) {
            let own = RelayOverride {
                altitude_m: None,
                power_w: Some(rng.random_range(0.2..3.0)),
            };
            scenario.relays.insert(rng.random_range(1..=relays), own);
        }
        let model = if has_steps {
            let mut sinr_db = rng.random_range(-25.0..-5.0);
            let mut bits_per_hz = 0.1;
            let steps = (0..8).map(|_| {
                let step = RateStep {
                    sinr_db,
                    bits_per_hz,
                };
                sinr_db += rng.random_range(1.0..6.0);
                bits_per_hz += rng.random_range(0.1..1.0);
                step
            });
            RateModel::Steps(steps.collect())
        } else {
            RateModel::Shannon {
                gap_db: rng.random_range(0.0..6.0),
            }
        };
        let radio = Radio {
            link: Link {
                access,
                bandwidth_hz: None,
                model,
            },
            bandwidth_hz,
        };
        Self {
            scenario,
            radio,
            relays,
        }
    }

    fn request(&self, number: Number) -> PlanRequest {
        let _ = self;
        PlanRequest {
            number,
            free_altitude: false,
            x_m: None,
            tolerance: TOLERANCE,
        }
    }

    /// Returns the planner's data rates toward Rx and toward Tx, bit/s. Each direction has half of the time.
    fn both_bps(&self, plan: &Plan) -> [f64; 2] {
        let relays = u16::try_from(plan.places.len()).unwrap();
        let scene = Scene::new(&self.scenario, relays).unwrap();
        let places: Vec<Place> = plan.places.iter().map(|(at, _)| (*at).into()).collect();
        let back = scene.hop_sirs_back(&places);
        [&plan.sirs, &back].map(|sirs| self.radio.chain_bps(sirs) / 2.0)
    }

    /// Returns the plan with the largest data rate for this case.
    fn planned(&self) -> Plan {
        let ask = self.request(Number::Of(self.relays));
        match Carried::new(&self.scenario, &ask, &self.radio, self.relays) {
            Some(carried) => carried.plan(self.relays).unwrap(),
            None => plan(&self.scenario, &ask).unwrap(),
        }
    }

    /// Sends packets through a chain whose relays are at the planned positions.
    fn send_as_planned(
        &self,
        planned: &Plan,
        both: bool,
        offered_bps: Option<[f64; 2]>,
    ) -> Traffic {
        let (mission, profiles) = mission::mission(&self.scenario, self.relays, TOLERANCE).unwrap();
        let setup = Setup {
            profiles,
            track: true,
            ..Setup::new(mission)
        };
        let hops = TrueHops::new(&self.scenario, &setup, &mission);
        let mut outcome = run(setup).unwrap();
        let places: Vec<[f64; 3]> = planned
            .places
            .iter()
            .map(|(at, _)| [at.x_m, at.y_m, at.altitude_m].map(f64::from))
            .collect();
        outcome.track = outcome.track.map(|track| track.moved_to(&places));
        let rate = Rate::of(planned, &self.scenario, &self.radio);
        let slowest = match rate {
            Rate::There(rate_bps) => rate_bps,
            Rate::Both([there_bps, back_bps]) => there_bps.min(back_bps),
        };
        let spec = TrafficSpec {
            link: DataLink {
                radio: self.radio.clone(),
                packet_bits: if slowest > 0.0 {
                    (10.0 * slowest).min(12_000.0)
                } else {
                    10.0
                },
                both,
                reverse: self.scenario.reverse,
            },
            queue_packets: 50,
            offered_bps,
        };
        traffic(&spec, &hops, &outcome, self.relays.into())
            .unwrap()
            .unwrap()
    }

    /// Simulates a chain of `relays` relays that carries packets, to Rx or in `both` directions.
    ///
    /// `offered_bps` are the offered data rates; `None` for the rates that the chain can carry.
    fn send(&self, relays: u16, both: bool, offered_bps: Option<[f64; 2]>) -> Traffic {
        let (mission, profiles) = mission::mission(&self.scenario, relays, TOLERANCE).unwrap();
        let setup = Setup {
            profiles,
            track: true,
            ..Setup::new(mission)
        };
        let hops = TrueHops::new(&self.scenario, &setup, &mission);
        // Slow chains send small packets, so that the simulation takes less time.
        let places = plan(&self.scenario, &self.request(Number::Of(relays))).unwrap();
        let rates = self
            .both_bps(&places)
            .into_iter()
            .filter(|rate| *rate > 0.0);
        let slowest = rates.reduce(f64::min).unwrap_or(1.0);
        let outcome = run(setup).unwrap();
        let spec = TrafficSpec {
            link: DataLink {
                radio: self.radio.clone(),
                packet_bits: (10.0 * slowest).min(12_000.0),
                both,
                reverse: 0.0,
            },
            queue_packets: 50,
            offered_bps,
        };
        traffic(&spec, &hops, &outcome, relays.into())
            .unwrap()
            .unwrap()
    }
}

/// Checks a flow's delivered data rate, and returns it as a fraction of `promised_bps`.
///
/// Every offered packet must be delivered, dropped, lost or queued. The delivered rate must not exceed the rate at the
/// agreed positions. It may exceed the planner's rate `promised_bps` by the fraction `most`, because the agreed
/// positions differ slightly from the planned ones.
fn share(flow: &Flow, promised_bps: f64, most: f64, what: &str) -> f64 {
    let packets = flow.packets;
    let gone = packets.delivered + packets.dropped + packets.lost + flow.queued;
    assert_eq!(packets.offered, gone, "{what}");
    if promised_bps == 0.0 {
        assert_eq!(packets.delivered, 0, "{what}");
        return 1.0;
    }
    let share = flow.delivered_bps / promised_bps;
    let own = flow.delivered_bps / flow.promised_bps;
    assert!(
        own <= 1.0 + 1e-12 && (0.95..=1.0 + most).contains(&share),
        "{what}: {share} of {promised_bps} bit/s"
    );
    share
}

fn every_promise_is_kept(access: Access, has_steps: bool) {
    let first = number("SEED", 1);
    let (mut worst, mut carried) = (1.0_f64, 0);
    for seed in first..first + number("COUNT", 25) {
        let case = Case::draw(seed, access, has_steps);
        let mut what = format!("SEED={seed} COUNT=1, {access:?}");
        _ = write!(what, ", steps {has_steps}, {} relays", case.relays);
        let best = plan(&case.scenario, &case.request(Number::Of(case.relays))).unwrap();
        let promised_bps = case.radio.chain_bps(&best.sirs);
        carried += u32::from(promised_bps > 0.0);
        let sent = case.send(case.relays, false, None);
        worst = worst.min(share(&sent.flows[0], promised_bps, TOLERANCE, &what));
        // More is offered than the chain can carry. The delivered rate stays the same.
        let sent = case.send(case.relays, false, Some([1.5 * promised_bps; 2]));
        if promised_bps > 0.0 {
            worst = worst.min(share(&sent.flows[0], promised_bps, TOLERANCE, &what));
        }
        let promised = case.both_bps(&best);
        let sent = case.send(case.relays, true, None);
        assert_eq!(sent.flows.len(), 2);
        let ways = sent.flows.iter().zip(promised).zip([TOLERANCE, 0.01]);
        for ((flow, promised_bps), most) in ways {
            let what = format!("{what}, both ways");
            worst = worst.min(share(flow, promised_bps, most, &what));
        }
        // The number of relays that the planner names carries the target rate.
        if seed % 5 == 0 && promised_bps > 0.0 && case.scenario.relays.is_empty() {
            let target_bps = 0.9 * promised_bps;
            let ask = case.request(Number::Of(1));
            let rates = Rates::new(&case.scenario, &ask, &case.radio, Some(target_bps)).unwrap();
            let meeting = rates.meeting.unwrap();
            let relays = u16::try_from(meeting.places.len()).unwrap();
            assert!(relays <= case.relays, "{what}");
            let sent = case.send(relays, false, Some([target_bps; 2]));
            assert!(
                sent.flows[0].delivered_bps >= 0.95 * target_bps,
                "{what}: {relays} relays for {target_bps} bit/s: {}",
                sent.flows[0].delivered_bps
            );
        }
    }
    println!("{access:?}, steps {has_steps}: at least {worst:.4} delivered, {carried} carry data");
    assert!(carried > 0);
}

/// Checks that simulated chains at the planned positions deliver the planned data rates.
///
/// The chains are planned for both directions, or for fitted time slots (as long as each hop needs).
fn every_plan_is_kept(access: Access, has_steps: bool) {
    let first = number("SEED", 1);
    let (mut worst, mut carried) = (1.0_f64, 0);
    for seed in first..first + number("COUNT", 25) {
        let mut case = Case::draw(seed, access, has_steps);
        let reverses = [1.0, 0.02 + 0.98 * (0.618 * seed as f64).fract(), 0.0];
        let fitted_one_way = usize::from(access == Access::Fitted);
        for &reverse in &reverses[..2 + fitted_one_way] {
            case.scenario.reverse = reverse;
            let what = format!(
                "SEED={seed} COUNT=1, {access:?}, steps {has_steps}, r = {reverse}, {} relays",
                case.relays
            );
            let planned = case.planned();
            let promised: Vec<f64> = match Rate::of(&planned, &case.scenario, &case.radio) {
                Rate::There(rate_bps) => vec![rate_bps],
                Rate::Both(rates_bps) => rates_bps.to_vec(),
            };
            carried += u32::from(promised.iter().all(|rate| *rate > 0.0));
            let more = [promised[0], *promised.last().unwrap()].map(|rate| 1.5 * rate);
            for offered in [None, Some(more)] {
                if offered.is_some() && promised.contains(&0.0) {
                    continue;
                }
                let sent = case.send_as_planned(&planned, reverse > 0.0, offered);
                assert_eq!(sent.flows.len(), promised.len(), "{what}");
                for (flow, promised_bps) in sent.flows.iter().zip(&promised) {
                    worst = worst.min(share(flow, *promised_bps, 1e-12, &what));
                }
            }
        }
    }
    println!(
        "{access:?}, steps {has_steps}: at least {worst:.4} of the plan delivered, {carried} carry data"
    );
    assert!(carried > 0);
}

#[test]
fn plans_in_equal_slots() {
    every_plan_is_kept(Access::Slots, false);
    every_plan_is_kept(Access::Slots, true);
}

#[test]
fn plans_in_channels() {
    every_plan_is_kept(Access::Channels, false);
    every_plan_is_kept(Access::Channels, true);
}

#[test]
fn plans_in_fitted_slots() {
    every_plan_is_kept(Access::Fitted, false);
    every_plan_is_kept(Access::Fitted, true);
}

#[test]
fn equal_slots_by_shannon() {
    every_promise_is_kept(Access::Slots, false);
}

#[test]
fn equal_slots_by_steps() {
    every_promise_is_kept(Access::Slots, true);
}

#[test]
fn channels_by_shannon() {
    every_promise_is_kept(Access::Channels, false);
}

#[test]
fn channels_by_steps() {
    every_promise_is_kept(Access::Channels, true);
}

#[test]
fn fitted_slots_by_shannon() {
    every_promise_is_kept(Access::Fitted, false);
}

#[test]
fn fitted_slots_by_steps() {
    every_promise_is_kept(Access::Fitted, true);
}
