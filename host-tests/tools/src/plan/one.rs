//! Plans against one interferer: which rule places the relays.

use uav_relay_scenario::Scenario;

use super::found::{NoPlan, Plan};
use super::request::{Number, PlanRequest};
use super::{altitude, source};

pub(super) fn plan(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    match ask.number {
        Number::Of(1) => source::alone(scenario, ask),
        Number::Of(relays) if ask.free_altitude => altitude::best(scenario, relays, ask.tolerance),
        Number::Of(relays) => source::best(scenario, relays, ask.tolerance),
        Number::Meeting(target) if ask.free_altitude => {
            altitude::fewest(scenario, target, ask.tolerance)
        }
        Number::Meeting(target) => source::level(scenario, target, ask.tolerance),
    }
}
