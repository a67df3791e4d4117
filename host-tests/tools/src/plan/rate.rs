//! Data rates of a chain over the number of relays.
//!
//! The paper assumes one frequency, so each hop sends in one of N + 1 slots: more relays raise the SIR of the worst hop but shorten
//! the slots. With a frequency for each hop only the SIR counts. Slots fitted to the hops, and frequencies that several hops use at
//! the same time, are not modelled.

use serde::Serialize;
use uav_relay_scenario::link::Link;
use uav_relay_scenario::{Interference, Scenario};

use super::{NoPlan, Number, Plan, PlanRequest};

/// Largest number of relays tried where a plan takes milliseconds.
const MOST_FAST: u16 = 200;

/// Largest number of relays tried where a plan takes seconds.
const MOST_SLOW: u16 = 20;

/// Data link of a chain and the bandwidth of one frequency.
#[derive(Clone, PartialEq, Debug)]
pub struct Radio {
    /// Access and spectral efficiency.
    pub link: Link,
    /// Bandwidth, Hz.
    pub bandwidth_hz: f64,
}

impl Radio {
    /// Returns the number of time slots of a chain of `relays` relays.
    pub const fn slots(&self, relays: u16) -> u32 {
        self.link.access.slots(relays)
    }

    /// Returns the data rate of a hop while it sends, bit/s; the interference counts as noise. `sir` is linear.
    pub fn hop_bps(&self, sir: f64) -> f64 {
        self.bandwidth_hz * self.link.model.bits_per_hz(sir)
    }

    /// Returns the data rate of a chain of `relays` relays, bit/s; `sir` is that of the worst hop, linear.
    pub fn chain_bps(&self, relays: u16, sir: f64) -> f64 {
        self.hop_bps(sir) / f64::from(self.slots(relays))
    }

    /// Returns the SIR (linear) that every hop of `relays` relays needs for a data rate.
    ///
    /// `None` if no step carries it.
    pub fn sir_for(&self, relays: u16, rate_bps: f64) -> Option<f64> {
        let hop_bps = rate_bps * f64::from(self.slots(relays));
        self.link.model.sinr_for(hop_bps / self.bandwidth_hz)
    }
}

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
        let mut bound_bps = f64::INFINITY;
        for relays in 1..=most {
            if let Some(best) = &mut best {
                best.best_is_proven =
                    bound_bps / f64::from(radio.slots(relays)) <= best.best_rate_bps;
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
                bound_bps = radio.hop_bps(most_at_receiver(scenario, &plan));
            }
            let rate_bps = radio.chain_bps(relays, plan.sir());
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

#[cfg(test)]
mod tests {
    use uav_relay_scenario::link::{Access, Link, RateModel, RateStep};

    use super::Radio;

    #[test]
    fn hops_with_frequencies_of_their_own_share_no_time() {
        let steps = [(0.0, 0.5), (10.0, 2.0)].map(|(sinr_db, bits_per_hz)| RateStep {
            sinr_db,
            bits_per_hz,
        });
        let radio = |access| Radio {
            link: Link {
                access,
                bandwidth_hz: None,
                model: RateModel::Steps(steps.to_vec()),
            },
            bandwidth_hz: 1e6,
        };
        let rate = |access| radio(access).chain_bps(4, 20.0);
        assert!((rate(Access::Slots) - 4e5).abs() < 1e-6);
        assert!((rate(Access::Channels) - 2e6).abs() < 1e-6);
        assert_eq!(radio(Access::Slots).sir_for(4, 4e5), Some(10.0));
        assert_eq!(radio(Access::Slots).sir_for(4, 4.1e5), None);
    }
}
