//! What planning comes to.

use uav_relay::mission::MAX_RELAYS;
use uav_relay::{Mission, Placement, Profile};
use uav_relay_scenario::hypothetical::Hypothetical;
use uav_relay_scenario::mission::Refusal;

use super::unit::Unit;

/// By how much places may fall short of the best, as a part of its SIR, and still be good enough.
pub const LOSS: f64 = 0.01;

/// Which of the paper's theorems, or what stands in for one, placed the only relay, and by which of its cases.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Theorem {
    /// 1 to 3; 4 for one relay aside, which is not in the paper.
    pub number: u8,
    /// The number of the case there; 0 for one that the paper leaves out.
    pub case: u8,
    /// What the case means for the drone.
    pub words: String,
}

/// What became of several interferers.
#[derive(Clone, PartialEq, Debug)]
pub struct Fitted {
    /// The one interferer that stands for all.
    pub hypothetical: Hypothetical,
    /// SIR (linear) against all of them of the places that are best against that one; `None` where there are none.
    pub sir: Option<f64>,
    /// Whether those places were good enough to keep; if not, the plan's are the best against all interferers.
    pub kept: bool,
}

/// Where the relays go.
#[derive(Clone, PartialEq, Debug)]
pub struct Plan {
    /// The relays' mission.
    pub mission: Mission,
    /// Their places and what they hold, relay 1 first.
    pub places: Vec<(Placement, Profile)>,
    /// SIR (linear) of hops 1 to N + 1.
    pub sirs: Vec<f64>,
    /// How they were found.
    pub how: &'static str,
    /// Whether it is certain that no places are better, or that no fewer relays do.
    pub proven: bool,
    /// Where one of the theorems placed the only relay.
    pub theorem: Option<Theorem>,
    /// For a target: the most that so many relays can have, linear SIR, where that is known.
    pub most: Option<f64>,
    /// Where there are several interferers.
    pub fitted: Option<Fitted>,
}

/// Why no placement meets what was asked.
#[derive(Clone, PartialEq, Debug)]
pub enum Why {
    /// In words.
    Plain(String),
    /// No number of relays gives every hop the target.
    Short {
        /// The SIR that was asked for, linear.
        target: f64,
        /// The most that was found, linear.
        most: f64,
        /// How many relays have it, where no number has more.
        relays: Option<u16>,
    },
}

impl Why {
    /// In one line, with SIRs in `unit`.
    pub fn say(&self, unit: Unit) -> String {
        match self {
            Self::Plain(line) => line.clone(),
            Self::Short {
                target,
                most,
                relays,
            } => {
                let (target, most) = (unit.asked(*target), unit.say(*most));
                match relays {
                    Some(relays) => format!(
                        "no number of relays, up to {MAX_RELAYS}, gives every hop an SIR of {target}: the most is {most}, with {relays}"
                    ),
                    None => format!(
                        "no number of relays that was tried, up to {MAX_RELAYS}, gives every hop an SIR of {target}: the most found is {most}"
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

/// Why there is no plan.
#[derive(Clone, PartialEq, Debug)]
pub enum NoPlan {
    /// The scenario is no mission, or what is asked for does not go with it.
    Wrong(String),
    /// No placement meets what was asked, and the most that was found (linear SIR).
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
    /// SIR (linear) of the worst hop.
    pub fn sir(&self) -> f64 {
        self.sirs.iter().copied().reduce(f64::min).unwrap_or(0.0)
    }

    /// The places alone.
    pub(super) fn chain(&self) -> Vec<Placement> {
        self.places.iter().map(|(place, _)| *place).collect()
    }
}
