//! Positions on which relays with a scenario agree, and their loss against the best known ones.
//!
//! On board there is a single interferer or a field. A hypothetical interferer in place of several is an approximation, and
//! Algorithm 4 falls short in an uneven field, so the positions are judged against the full interference.

use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, PlannedMethod, Scenario, mission};

use super::found::{LOSS, NoPlan, Plan};
use super::multi_interferer::with_one;
use super::request::{Number, PlanRequest};
use super::{altitude, source};

/// Chain at the positions that the on-board code finds.
#[derive(Clone, PartialEq, Debug)]
pub struct Flown {
    /// Positions, with SIRs against the full interference.
    pub plan: Plan,
    /// Best SIR (linear) of the worst hop that the planner finds for the same number of relays.
    pub best_sir: f64,
    /// True if a hypothetical interferer replaces several on board.
    pub stand_in: bool,
}

impl Flown {
    /// Returns the loss as a fraction of the best SIR; 0 for none.
    pub fn loss(&self) -> f64 {
        (1.0 - self.plan.sir() / self.best_sir).max(0.0)
    }

    /// Returns true if the loss exceeds [`LOSS`].
    pub fn is_poor(&self) -> bool {
        self.loss() > LOSS
    }

    /// Returns a line with the loss, its cause and the remedy.
    pub fn describe(&self) -> String {
        let [reach, best] = [self.plan.sir(), self.best_sir].map(|sir| 10.0 * sir.log10());
        let (why, remedy) = if self.stand_in {
            (
                "on board one hypothetical interferer replaces all",
                "let the relays estimate the interferer, and simulate that (`cargo chain --listen`, [listen]), or plan other altitudes or more \
                 relays against the true sum (`cargo plan`)",
            )
        } else {
            (
                "the field is too uneven for Algorithm 4",
                "plan another geometry.altitude_m or another number of relays (`cargo plan`)",
            )
        };
        format!(
            "the relays reach {reach:.2} dB of {best:.2} dB, {:.1} % less than the best positions: {why}; {remedy}",
            100.0 * self.loss()
        )
    }
}

/// Returns the chain that `relays` relays in `scenario` settle on by `method`.
///
/// Work: that of [`super::plan`] twice.
///
/// # Errors
/// [`NoPlan`] if the relays settle on nothing.
pub fn flown(
    scenario: &Scenario,
    relays: u16,
    method: PlannedMethod,
    tolerance: f64,
) -> Result<Flown, NoPlan> {
    let plan = alone(scenario, relays, method, tolerance)?;
    let ask = PlanRequest {
        number: Number::Of(relays),
        free_altitude: method == PlannedMethod::Joint,
        x_m: None,
        tolerance,
    };
    let best = super::plan(scenario, &ask)?;
    let best_sir = best.sir().max(plan.sir());
    Ok(Flown {
        plan,
        best_sir,
        stand_in: mission::hypothetical(scenario).is_some(),
    })
}

/// Returns the plan of the relays by themselves, with SIRs against the full interference.
fn alone(
    scenario: &Scenario,
    relays: u16,
    method: PlannedMethod,
    tolerance: f64,
) -> Result<Plan, NoPlan> {
    let by_method = |scenario: &Scenario| match method {
        PlannedMethod::Joint => altitude::best(scenario, relays, tolerance),
        PlannedMethod::Align => source::best(scenario, relays, tolerance),
    };
    let Some(one) = mission::hypothetical(scenario) else {
        let plan = by_method(scenario)?;
        let is_field = matches!(scenario.interference, Interference::Field(_));
        return Ok(Plan {
            how: if is_field { "Algorithm 4" } else { plan.how },
            ..plan
        });
    };
    let plan = by_method(&with_one(scenario, &one))?;
    let scene = Scene::new(scenario, relays).ok_or_else(source::nothing)?;
    let sirs = scene.hop_sirs(&plan.chain());
    Ok(Plan {
        sirs: sirs
            .into_iter()
            .map(|sir| sir.min(f64::from(f32::MAX)))
            .collect(),
        ..plan
    })
}
