//! Data rates of a chain over the number of relays.
//!
//! The paper assumes one frequency, so each hop sends in one of N + 1 slots: more relays raise the SIR of the worst hop but shorten
//! the slots. With a frequency for each hop only the SIR counts. Slots fitted to the hops change the rate, not the positions: these
//! are those of the largest SIR of the worst hop. Frequencies that several hops use at the same time are not modelled.

use serde::Serialize;
use uav_relay_scenario::link::{Access, Radio, RateModel};
use uav_relay_scenario::{Interference, Scenario};

use super::{NoPlan, Number, Plan, PlanRequest};

/// Largest number of relays tried where a plan takes milliseconds.
const MOST_FAST: u16 = 200;

/// Largest number of relays tried where a plan takes seconds.
const MOST_SLOW: u16 = 20;

/// Data rate of one number of relays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RateOf {
    /// Number of relays.
    pub uavs: u16,
    /// Data rate of the chain, bit/s.
    pub rate_bps: f64,
}

/// The number of relays with the largest data rate among those tried.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct BestRate {
    /// Number of relays.
    pub best_uavs: u16,
    /// Data rate, bit/s.
    pub best_rate_bps: f64,
    /// Numbers tried: 1 to this one.
    pub tried_uavs: u16,
    /// True if a larger number of relays is proven not to carry more.
    pub best_is_proven: bool,
}

/// Data rates of a scenario's chains over one bandwidth.
#[derive(Clone, PartialEq, Debug)]
pub struct Rates {
    /// The number of relays with the largest data rate.
    pub best: BestRate,
    /// Data rates of all numbers tried.
    pub all: Vec<RateOf>,
    /// Plan with the fewest relays that carry the target, if one is given and can be met.
    pub meeting: Option<Plan>,
}

impl Rates {
    /// Plans 1, 2, 3 and more relays. It ends when no larger number can carry more, or at the limit for a few seconds.
    ///
    /// `target_bps` is the wanted rate.
    pub fn new(
        scenario: &Scenario,
        ask: &PlanRequest,
        radio: &Radio,
        target_bps: Option<f64>,
    ) -> Result<Self, NoPlan> {
        let most = most_tried(scenario, ask);
        let mut best: Option<BestRate> = None;
        let mut all = Vec::new();
        let mut meeting = None;
        let mut refused = None;
        let mut receiver_bps = f64::INFINITY;
        for relays in 1..=most {
            if let Some(best) = &mut best {
                best.best_is_proven = most_bps(radio, relays, receiver_bps) <= best.best_rate_bps;
                if best.best_is_proven {
                    break;
                }
            }
            let one = PlanRequest {
                number: Number::Of(relays),
                ..*ask
            };
            let plan = match super::plan(scenario, &one) {
                Ok(plan) => plan,
                // More relays need more room.
                Err(none) => {
                    refused = Some(none);
                    break;
                }
            };
            if relays == 1 {
                receiver_bps = radio.hop_bps(most_at_receiver(scenario, &plan));
            }
            let rate_bps = radio.chain_bps(&plan.sirs);
            all.push(RateOf {
                uavs: relays,
                rate_bps,
            });
            if best.is_none_or(|best| rate_bps > best.best_rate_bps) {
                best = Some(BestRate {
                    best_uavs: relays,
                    best_rate_bps: rate_bps,
                    ..BestRate::default()
                });
            }
            if let Some(best) = &mut best {
                best.tried_uavs = relays;
            }
            if meeting.is_none() && target_bps.is_some_and(|target| rate_bps >= target) {
                meeting = Some(plan);
            }
        }
        match (best, refused) {
            (Some(best), _) => Ok(Self { best, all, meeting }),
            (None, Some(none)) => Err(none),
            (None, None) => Err(NoPlan::Unmet(super::Why::default(), None)),
        }
    }
}

/// Returns the largest number of relays for which the planner computes the data rate.
fn most_tried(scenario: &Scenario, ask: &PlanRequest) -> u16 {
    let is_several =
        matches!(&scenario.interference, Interference::Sources(sources) if sources.len() > 1);
    if ask.x_m.is_some() {
        1
    } else if ask.free_altitude || is_several {
        MOST_SLOW
    } else {
        MOST_FAST
    }
}

/// Returns an upper bound on the data rate of `relays` relays and more, bit/s.
///
/// `receiver_bps` is that on the rate of the hop to Rx.
///
/// Fitted slots have one below that only if the steps of the radio limit the rates of the other hops.
fn most_bps(radio: &Radio, relays: u16, receiver_bps: f64) -> f64 {
    let relays = f64::from(relays);
    match (radio.link.access, &radio.link.model) {
        (Access::Slots, _) => receiver_bps / (relays + 1.0),
        (Access::Channels, _) | (Access::Fitted, RateModel::Shannon { .. }) => receiver_bps,
        (Access::Fitted, RateModel::Steps(_)) => {
            1.0 / (relays / radio.hop_bps(f64::INFINITY) + 1.0 / receiver_bps)
        }
    }
}

/// Returns an upper bound on the SIR (linear) at Rx for any number of relays, from that of `plan`.
///
/// The interference at Rx does not depend on the relays; the signal is largest from right above, at the lowest altitude and with
/// the largest power.
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
