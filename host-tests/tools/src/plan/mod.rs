//! Planner: number of relays for a target, or positions of a given number, without messages.
//!
//! | interference | file |
//! | --- | --- |
//! | one interferer | `one`, `source`: Theorems 1 to 3 for one relay, Algorithm 1 and eq. (Opt) for more |
//! | a field | `field`: Algorithm 3 for one relay; Algorithm 4 and Problem 1, exact for equal relays, for more |
//! | several interferers | `several`: the hypothetical interferer, or the true sum where that is not good enough |
//!
//! Positions are found by the crate's on-board code where it has a method. [`Plan::proven`] is true if the result is proven
//! optimal.

mod altitude;
mod cases;
mod field;
pub mod flown;
mod found;
pub mod map;
mod multi_interferer;
pub mod noise;
mod one;
mod profiles;
pub mod rate;
pub mod report;
mod request;
mod source;
pub mod stored_plan;
mod unit;

use uav_relay_scenario::{Interference, Scenario};

pub use altitude::solved;
pub use found::{Fitted, LOSS, NoPlan, Plan, Theorem, Why};
pub use request::{Number, PlanRequest};
pub use unit::Unit;

/// Plans `ask` in `scenario`.
///
/// Work: some milliseconds; with free altitudes up to some seconds for fifty relays or more.
///
/// # Errors
/// [`NoPlan`]: an invalid request, or the best SIR that can be had.
pub fn plan(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    check(scenario, ask)?;
    match &scenario.interference {
        Interference::Field(_) => field::plan(scenario, ask),
        Interference::Sources(sources) if sources.len() > 1 => {
            multi_interferer::plan(scenario, ask)
        }
        Interference::Sources(_) => one::plan(scenario, ask),
    }
}

/// Checks that the options of the request are compatible.
fn check(scenario: &Scenario, ask: &PlanRequest) -> Result<(), NoPlan> {
    let Some(x_m) = ask.x_m else { return Ok(()) };
    let d = scenario.distance_m;
    let wrong = if !(0.0..=d).contains(&x_m) {
        format!("--x-m {x_m:?}: must be within 0.0 to {d:?} (geometry.distance_m)")
    } else if ask.number != Number::Of(1) {
        "--x-m is for one relay: it needs --uavs 1".to_owned()
    } else if matches!(scenario.interference, Interference::Field(_)) {
        "--x-m needs an [[interferer]]: in a [field] the altitude does not change what is heard"
            .to_owned()
    } else {
        return Ok(());
    };
    Err(NoPlan::Wrong(wrong))
}
