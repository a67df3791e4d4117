//! Performance of positions planned for one equivalent interferer against all actual interferers.

use serde::Serialize;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;
use uav_relay_scenario::scene::{Place, Scene};

use super::hops::{RelayReport, db};

/// SIR of the chain against all interferers, if its relays assumed a single one.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct AllInterferersReport {
    /// SIR of the worst hop against all interferers, linear.
    pub all_sir: f64,
    /// SIR of the worst hop against all interferers, dB.
    pub all_sir_db: f64,
    /// Relative loss from the SIR that the relays assume; negative for a gain.
    pub all_loss: f64,
}

impl AllInterferersReport {
    /// Evaluates `relays`, which assume `sir`; `None` if there is a single interferer or a field.
    pub fn of(scenario: &Scenario, relays: &[RelayReport], sir: f64) -> Option<Self> {
        mission::hypothetical(scenario)?;
        let last = relays.last()?.index;
        let mut scene = Scene::new(scenario, last)?;
        // Remaining relays, in order.
        let all = std::mem::take(&mut scene.relays);
        let of = |relay: &RelayReport| all.get(usize::from(relay.index) - 1).copied();
        scene.relays = relays.iter().filter_map(of).collect();
        let places: Vec<Place> = relays
            .iter()
            .map(|relay| Place {
                x: relay.x_m,
                y: relay.y_m,
                h: relay.h_m,
            })
            .collect();
        let all_sir = scene.chain_sir(&places);
        Some(Self {
            all_sir,
            all_sir_db: db(all_sir),
            all_loss: 1.0 - all_sir / sir,
        })
    }

    /// Formats the result as a line of text.
    pub fn text(&self) -> String {
        let Self {
            all_sir,
            all_sir_db,
            all_loss,
        } = self;
        let part = 100.0 * all_loss.abs();
        let side = if *all_loss < 0.0 { "above" } else { "below" };
        format!(
            "against all interferers: SIR {all_sir:.6} ({all_sir_db:.3} dB), {part:.1} % {side} the relays' estimate; `cargo plan` has the \
             best positions against all\n"
        )
    }
}
