//! What relays that are given a scenario will fly by themselves, and what that loses to the best there is.
//!
//! On board there is one interferer, or a field: one that stands for several is a stand-in, and in an uneven field Algorithm 4 falls short.
//! What their places are worth is judged against all that is there.

use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, PlannedMethod, Scenario, mission};

use super::ask::{Ask, Number};
use super::found::{LOSS, NoPlan, Plan};
use super::several::with_one;
use super::{altitude, source};

/// A chain as it settles by itself.
#[derive(Clone, PartialEq, Debug)]
pub struct Flown {
    /// Its places, with their SIRs against all that is there.
    pub plan: Plan,
    /// The best SIR (linear) of the worst hop that the planner knows of for as many relays.
    pub best_sir: f64,
    /// Whether one interferer stands for several on board.
    pub stand_in: bool,
}

impl Flown {
    /// What is lost, as a part of the best SIR: 0 for nothing.
    pub fn loss(&self) -> f64 {
        (1.0 - self.plan.sir() / self.best_sir).max(0.0)
    }

    /// Whether that is too much to fly without a word.
    pub fn is_poor(&self) -> bool {
        self.loss() > LOSS
    }

    /// How much is lost, and what can be done about it, in one line.
    pub fn describe(&self) -> String {
        let [reach, best] = [self.plan.sir(), self.best_sir].map(|sir| 10.0 * sir.log10());
        let (why, remedy) = if self.stand_in {
            (
                "one interferer stands for all on board",
                "have them find their own and fly that in simulation (`cargo chain --listen`, [listen]), or plan other altitudes or more \
                 relays against the true sum (`cargo plan`)",
            )
        } else {
            (
                "the field is too uneven for Algorithm 4",
                "plan another geometry.altitude_m or another number of relays (`cargo plan`)",
            )
        };
        format!(
            "relays by themselves reach {reach:.2} dB of {best:.2} dB, {:.1} % less than the best places: {why}; {remedy}",
            100.0 * self.loss()
        )
    }
}

/// What `relays` relays in `scenario` settle on by `method`.
///
/// Work: that of [`super::plan`] twice.
///
/// # Errors
/// [`NoPlan`] where there is nothing to settle on.
pub fn flown(
    scenario: &Scenario,
    relays: u16,
    method: PlannedMethod,
    tolerance: f64,
) -> Result<Flown, NoPlan> {
    let plan = alone(scenario, relays, method, tolerance)?;
    let ask = Ask {
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

/// The places by themselves, and their SIRs against all.
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
