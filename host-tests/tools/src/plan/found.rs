//! Results of planning.

use uav_relay::{Mission, Placement, Profile};
use uav_relay_scenario::hypothetical::Hypothetical;
use uav_relay_scenario::mission::Refusal;

use super::unit::Unit;

/// Tolerated loss of positions against the best ones, as a fraction of the SIR.
pub const LOSS: f64 = 0.01;

/// The theorem and case that placed the only relay.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Theorem {
    /// 1 to 3; 4 for one relay beside the line, which is not in the paper.
    pub number: u8,
    /// Number of the case in the paper; 0 for a case that the paper omits.
    pub case: u8,
    /// Explanation of the case for the user.
    pub words: String,
}

/// The hypothetical interferer that replaces several.
#[derive(Clone, PartialEq, Debug)]
pub struct Fitted {
    /// Power, position and error of the hypothetical interferer.
    pub hypothetical: Hypothetical,
    /// SIR (linear) against all interferers of the positions that are best against it. `None` if there are none.
    pub sir: Option<f64>,
    /// True if those positions are the plan's. Otherwise the plan's are the best found against all interferers.
    pub kept: bool,
}

/// A plan: positions of the relays and their SIRs.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// Mission of the relays.
    pub mission: Mission,
    /// Positions and profiles, relay 1 first.
    pub places: Vec<(Placement, Profile)>,
    /// SIR (linear) of hops 1 to N + 1.
    pub sirs: Vec<f64>,
    /// Name of the algorithm that found the positions.
    pub how: &'static str,
    /// True if it is proven that no positions are better, or that no fewer relays suffice.
    pub proven: bool,
    /// Theorem that placed the only relay, if one did.
    pub theorem: Option<Theorem>,
    /// Best SIR (linear) of as many relays, if known; only for a target.
    pub most: Option<f64>,
    /// Present with several interferers.
    pub fitted: Option<Fitted>,
}

/// Reason for which the request cannot be met.
#[derive(Clone, PartialEq, Debug)]
pub enum Why {
    /// An explanation.
    Plain(String),
    /// The target cannot be met by any number of relays.
    Short {
        /// Requested SIR, linear.
        target: f64,
        /// Best SIR found, linear.
        most: f64,
        /// Number of relays with the best SIR; `None` if more might do better.
        relays: Option<u16>,
    },
}

impl Why {
    /// Returns the reason in one line, with SIRs in `unit`.
    pub fn say(&self, unit: Unit) -> String {
        match self {
            Self::Plain(line) => line.clone(),
            Self::Short {
                target,
                most,
                relays,
            } => {
                let limit = Mission::MAX_RELAYS;
                let (target, most) = (unit.asked(*target), unit.say(*most));
                match relays {
                    Some(relays) => format!(
                        "no number of relays, up to {limit}, gives every hop an SIR of {target}: the most is {most}, with {relays}"
                    ),
                    None => format!(
                        "no number of relays that was tried, up to {limit}, gives every hop an SIR of {target}: the most found is {most}"
                    ),
                }
            }
        }
    }
}

impl Default for Why {
    fn default() -> Self {
        Self::Plain(String::new())
    }
}

/// Reason for which there is no plan.
#[derive(Clone, PartialEq, Debug)]
pub enum NoPlan {
    /// The scenario is not a valid mission, or the request does not fit it.
    Wrong(String),
    /// The request cannot be met; with the best SIR found (linear).
    Unmet(Why, Option<f64>),
}

impl From<Refusal> for NoPlan {
    fn from(refusal: Refusal) -> Self {
        match refusal {
            Refusal::NoRoom { .. } => Self::Unmet(Why::Plain(refusal.to_string()), None),
            other => Self::Wrong(other.to_string()),
        }
    }
}

impl Plan {
    /// Returns the SIR (linear) of the worst hop.
    pub fn sir(&self) -> f64 {
        self.sirs.iter().copied().reduce(f64::min).unwrap_or(0.0)
    }

    pub(super) fn chain(&self) -> Vec<Placement> {
        self.places.iter().map(|(place, _)| *place).collect()
    }
}
