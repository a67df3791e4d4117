//! Data rates of a chain over the number of relays.
//!
//! The paper assumes one frequency, so each hop sends in one of N + 1 slots. More relays raise the SIR of the worst
//! hop, but shorten the slots. With a frequency for each hop only the SIR counts. The positions have the largest rate
//! if the planner can find them (`carried`), otherwise the largest SIR of the worst hop. Frequencies that several hops
//! use at the same time are not modelled.
//!
//! In a chain for both directions, the smaller of two rates counts: the rate to Rx, and the rate back divided by r.

use serde::Serialize;
use uav_relay_scenario::link::{Access, Radio, worse_bps};
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Scenario};
use uav_relay_sim::report::HopSlots;

use super::carried::{Carried, carries_no};
use super::{NoPlan, Number, Plan, PlanRequest, source};

/// Largest number of relays that is tried if a plan takes only milliseconds.
const MOST_FAST: u16 = 200;

/// Largest number of relays that is tried if a plan takes seconds.
const MOST_SLOW: u16 = 20;

/// Largest number of relays that is tried if positions are optimised for the data rate.
const MOST_SEARCHED: u16 = 60;

/// Number of relays up to which rates are always computed with fitted time slots.
///
/// A fitted slot is as long as its hop needs. The list of rates is shorter only if fewer relays fit between Tx and Rx,
/// or if more relays provably do not increase the rate.
const LEAST_LISTED: u16 = 10;

/// Data rate of a chain, bit/s.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
#[serde(untagged)]
pub enum Rate {
    /// Rate from Tx to Rx, bit/s, of a chain for this direction only.
    There(f64),
    /// Rates to Rx and to Tx, bit/s, of a chain for data in both directions.
    Both([f64; 2]),
}

impl Rate {
    /// Returns the data rate of the chain in `plan` over the data link `radio`.
    pub fn of(plan: &Plan, scenario: &Scenario, radio: &Radio) -> Self {
        match Self::both_sirs(plan, scenario) {
            Some([there, back]) => Self::Both(radio.both_bps(&there, &back, scenario.reverse)),
            None => Self::There(radio.chain_bps(&plan.sirs)),
        }
    }

    /// Returns the data rate of the worst hop in `plan` during its time slot.
    pub fn of_hop(plan: &Plan, scenario: &Scenario, radio: &Radio) -> Self {
        let worst = |sirs: &[f64]| {
            let worst = sirs.iter().copied().reduce(f64::min);
            radio.hop_bps(worst.unwrap_or(0.0))
        };
        match Self::both_sirs(plan, scenario) {
            Some(sirs) => Self::Both(sirs.map(|sirs| worst(&sirs))),
            None => Self::There(worst(&plan.sirs)),
        }
    }

    /// Returns the linear SIRs of all hops: for data toward Rx, and for data toward Tx.
    ///
    /// `None` in a plan for data toward Rx only.
    fn both_sirs(plan: &Plan, scenario: &Scenario) -> Option<[Vec<f64>; 2]> {
        plan.back?;
        let relays = u16::try_from(plan.places.len()).ok()?;
        let places: Vec<Place> = plan.places.iter().map(|(at, _)| (*at).into()).collect();
        let there = match Scene::new(scenario, relays) {
            Some(scene) => scene.hop_sirs(&places),
            None => plan.sirs.clone(),
        };
        Some([there, plan.sirs_back(scenario)])
    }

    /// Returns the time slots of the hops in `plan`.
    ///
    /// Empty if the chain carries no data, or if all slots are equally long.
    pub fn hop_slots(plan: &Plan, scenario: &Scenario, radio: &Radio) -> Vec<HopSlots> {
        if radio.link.access != Access::Fitted {
            return Vec::new();
        }
        let both = Self::both_sirs(plan, scenario);
        let [there, back] = both.unwrap_or_else(|| [plan.sirs.clone(), Vec::new()]);
        let times = |sirs: &[f64], bits: f64| -> Vec<f64> {
            sirs.iter().map(|sir| bits / radio.hop_bps(*sir)).collect()
        };
        HopSlots::of(&times(&there, 1.0), &times(&back, scenario.reverse))
    }

    /// Returns the smaller of two rates, bit/s: to Rx, and back to Tx divided by `reverse`.
    pub fn worse(self, reverse: f64) -> f64 {
        match self {
            Self::There(rate_bps) => rate_bps,
            Self::Both(rates_bps) => worse_bps(rates_bps, reverse),
        }
    }
}

/// Data rate of a chain, with the number of relays in the chain.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RateOf {
    /// Number of relays in the chain.
    pub uavs: u16,
    /// Data rate of the chain, bit/s.
    pub rate_bps: Rate,
}

/// Number of relays with the largest data rate, and this rate.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct BestRate {
    /// Number of relays with the largest data rate.
    pub best_uavs: u16,
    /// Largest data rate, bit/s.
    ///
    /// For data in both directions it is the smaller of two values: the rate to Rx, and the rate to Tx divided by the
    /// required fraction.
    pub best_rate_bps: f64,
    /// Largest number of relays tried. All numbers from 1 on were tried.
    pub tried_uavs: u16,
    /// True if it is proven that no other number of relays carries more; false if unknown.
    pub best_is_proven: bool,
}

/// Data rates of a scenario's chains with 1, 2, 3 and more relays, over one data link.
#[derive(Clone, PartialEq, Debug)]
pub struct Rates {
    /// Number of relays with the largest data rate, and this rate.
    pub best: BestRate,
    /// Data rate for each number of relays tried, from 1.
    pub all: Vec<RateOf>,
    /// Plan with the fewest relays that carry the target rate; `None` without a target or such a plan.
    pub meeting: Option<Plan>,
}

impl Rates {
    /// Plans 1, 2, 3 and more relays, and computes their data rates over `radio`.
    ///
    /// The list ends where more relays are proven to carry no more data, or at a limit of some seconds. `target_bps` is
    /// the wanted rate to Rx. For data in both directions, the rate to Tx must be at least `target_bps` times the
    /// scenario's `reverse`.
    pub fn new(
        scenario: &Scenario,
        ask: &PlanRequest,
        radio: &Radio,
        target_bps: Option<f64>,
    ) -> Result<Self, NoPlan> {
        let most = most_tried(scenario, ask);
        let searched = Carried::new(scenario, ask, radio, most.min(MOST_SEARCHED));
        let fits = searched.is_some() && radio.link.access == Access::Fitted;
        let most = match &searched {
            Some(searched) if fits => searched.most_worth().clamp(LEAST_LISTED, MOST_SEARCHED),
            Some(_) => most.min(MOST_SEARCHED),
            None => most,
        };
        let reverse = scenario.reverse;
        let mut best: Option<BestRate> = None;
        let mut all = Vec::new();
        let mut meeting = None;
        let mut refused = None;
        let mut most_bps = MostRate::default();
        for relays in 1..=most {
            if let Some(best) = &mut best {
                best.best_is_proven = most_bps.of(radio, relays) <= best.best_rate_bps;
                if best.best_is_proven {
                    break;
                }
            }
            let one = PlanRequest {
                number: Number::Of(relays),
                ..*ask
            };
            let plan = match &searched {
                Some(searched) => searched.plan(relays),
                // This plan has no proof that its positions are best.
                None if reverse > 0.0 && is_single(scenario) && !ask.free_altitude => {
                    source::best(scenario, relays, ask.tolerance)
                }
                None => super::plan(scenario, &one),
            };
            let plan = match plan {
                Ok(plan) => plan,
                // More relays do not fit either.
                Err(none) => {
                    refused = Some(none);
                    break;
                }
            };
            if relays == 1 {
                most_bps = MostRate::new(scenario, radio, &plan);
            }
            let rate_bps = Rate::of(&plan, scenario, radio);
            all.push(RateOf {
                uavs: relays,
                rate_bps,
            });
            let worse_bps = rate_bps.worse(reverse);
            if best.is_none_or(|best| worse_bps > best.best_rate_bps * (1.0 + RISE)) {
                best = Some(BestRate {
                    best_uavs: relays,
                    best_rate_bps: worse_bps,
                    ..BestRate::default()
                });
            }
            if let Some(best) = &mut best {
                best.tried_uavs = relays;
            }
            if meeting.is_none() && target_bps.is_some_and(|target| worse_bps >= target) {
                meeting = Some(match &searched {
                    Some(searched) => searched.proven(plan),
                    None => plan,
                });
            }
        }
        if let Some(best) = &mut best {
            let is_one_way = !(reverse > 0.0);
            best.best_is_proven &= match radio.link.access {
                Access::Fitted => !fits && !ask.free_altitude,
                // The proof for both directions requires that all relays keep their altitude, with y = 0.
                _ if ask.free_altitude => is_one_way,
                _ => is_one_way || carry_no_more(scenario, radio, *best, ask.tolerance),
            };
        }
        match (best, refused) {
            (Some(best), _) => Ok(Self { best, all, meeting }),
            (None, Some(none)) => Err(none),
            (None, None) => Err(NoPlan::Unmet(super::Why::default(), None)),
        }
    }
}

fn is_single(scenario: &Scenario) -> bool {
    matches!(&scenario.interference, Interference::Sources(sources) if sources.len() == 1)
}

/// Returns the largest number of relays that the planner tries.
fn most_tried(scenario: &Scenario, ask: &PlanRequest) -> u16 {
    let is_several =
        matches!(scenario.interference, Interference::Sources(_)) && !is_single(scenario);
    if ask.x_m.is_some() {
        1
    } else if ask.free_altitude || is_several {
        MOST_SLOW
    } else {
        MOST_FAST
    }
}

/// Relative increase of the rate at which a larger number of relays counts as better.
const RISE: f64 = 1e-4;

/// Largest number of relays in a proof by [`carry_no_more`].
const MOST_PROVEN: u16 = MOST_FAST;

/// Returns true if it is proven that no number of relays up to `tried_uavs` carries more than `best`.
///
/// The data are for both directions, in equal slots or with a frequency for each hop.
fn carry_no_more(scenario: &Scenario, radio: &Radio, best: BestRate, tolerance: f64) -> bool {
    let more_bps = best.best_rate_bps * (1.0 + 2.0 * tolerance);
    best.tried_uavs <= MOST_PROVEN
        && (1..=best.tried_uavs).all(|relays| {
            let slots = f64::from(radio.link.access.slots(relays, true));
            let bits_per_hz = more_bps * slots / radio.bandwidth_hz;
            Scene::new(scenario, relays)
                .is_some_and(|scene| carries_no(&scene, radio, scenario.reverse, bits_per_hz))
        })
}

/// Upper bounds on the data rates of hops, bit/s, for any number and positions of relays.
#[derive(Clone, Copy, Default)]
struct MostRate {
    /// Upper bound on the rate of the hop to Rx, bit/s.
    receiver_bps: f64,
    /// Upper bound on the rate of the hop from Tx, bit/s.
    first_bps: f64,
    /// Upper bound on the rate of a hop between two relays at their minimum separation, bit/s.
    relay_bps: f64,
    /// Number of directions of the data: 1.0 for data to Rx only, 2.0 for data to Rx and to Tx.
    ways: f64,
}

impl MostRate {
    /// Computes the bounds on the rates of hops. `plan` is any plan with one relay.
    fn new(scenario: &Scenario, radio: &Radio, plan: &Plan) -> Self {
        let [first, relay] = most_between(scenario);
        Self {
            receiver_bps: radio.hop_bps(most_at_receiver(scenario, plan)),
            first_bps: radio.hop_bps(first),
            relay_bps: radio.hop_bps(relay),
            ways: if scenario.reverse > 0.0 { 2.0 } else { 1.0 },
        }
    }

    /// Returns an upper bound on the data rate of all chains with `relays` relays or more, bit/s.
    ///
    /// For data in both directions, the rate of a chain is the smaller of two values: the rate to Rx, and the rate to
    /// Tx divided by the required fraction.
    fn of(&self, radio: &Radio, relays: u16) -> f64 {
        let relays = f64::from(relays);
        match radio.link.access {
            Access::Slots => self.receiver_bps.min(self.first_bps) / (relays + 1.0) / self.ways,
            Access::Channels => self.receiver_bps.min(self.first_bps) / self.ways,
            Access::Fitted => {
                let between = (relays - 1.0) / self.relay_bps;
                1.0 / (1.0 / self.receiver_bps + 1.0 / self.first_bps + between)
            }
        }
    }
}

/// Returns upper bounds on the linear SIRs of the first hop and of a hop between relays.
///
/// They assume the shortest permitted hop, and each interferer at its largest possible distance. Infinite if the
/// interference is known only along the line Tx-Rx.
fn most_between(scenario: &Scenario) -> [f64; 2] {
    let Some(scene) = Scene::new(scenario, 1) else {
        return [f64::INFINITY; 2];
    };
    let own = scenario.relays.values();
    let altitudes = own.clone().filter_map(|own| own.altitude_m);
    let altitudes = altitudes.chain([scenario.altitude_m]);
    let lowest = altitudes.clone().fold(scenario.altitude_min_m, f64::min);
    let highest = altitudes.fold(scenario.altitude_max_m, f64::max);
    let aside = scenario.lateral_max_m.max(-scenario.lateral_min_m);
    let least_w: f64 = scene
        .sources
        .iter()
        .map(|source| {
            let along = source.x_m.abs().max((scene.distance_m - source.x_m).abs());
            let across = source.y_m.abs() + aside;
            let squared = along * along + across * across + highest * highest;
            source.power_w / (scene.eta * squared)
        })
        .sum();
    let disturbance_w = least_w + scene.noise_w;
    let most_w = own
        .filter_map(|own| own.power_w)
        .fold(scenario.uav_w, f64::max);
    let apart = scene.min_separation_m;
    [
        scene.tx_w / (scene.eta * lowest * lowest) / disturbance_w,
        most_w / (scene.mu_los * apart * apart) / disturbance_w,
    ]
}

/// Returns an upper bound on the linear SIR at Rx for any number of relays, from the SIR in `plan`.
///
/// The interference at Rx does not depend on the relays. The signal is largest from a relay vertically above Rx, at the
/// lowest altitude and with the largest power.
fn most_at_receiver(scenario: &Scenario, plan: &Plan) -> f64 {
    let (Some((last, profile)), Some(sir)) = (plan.places.last(), plan.sirs.last()) else {
        return f64::INFINITY;
    };
    let [x, y, h] = [last.x_m, last.y_m, last.altitude_m].map(f64::from);
    let along = scenario.distance_m - x;
    let squared = along * along + y * y + h * h;
    let own = scenario.relays.values();
    let lowest = own
        .clone()
        .filter_map(|own| own.altitude_m)
        .fold(scenario.altitude_min_m.min(scenario.altitude_m), f64::min);
    let largest_w = own
        .filter_map(|own| own.power_w)
        .fold(scenario.uav_w, f64::max);
    sir * squared / (lowest * lowest) * largest_w / f64::from(profile.power_w)
}
