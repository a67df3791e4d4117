//! The paper's scenarios as missions, with the parameters of its table.

use uav_relay::Mission;

use super::sheet::FigureError;
use uav_relay_scenario::{Interference, Scenario, Source, mission};

/// Relative tolerance of the target SIR for chains computed without messages.
///
/// It is some ten times the relative spacing of f32 numbers.
pub(super) const FINE: f64 = 1e-6;

/// Relative tolerance of the target SIR for simulated chains: the default of `cargo chain`.
const FLOWN: f64 = 1e-4;

/// Returns the paper's multi-hop scenario, the fourth and fifth part of the paper's parameter table.
///
/// D = 1 km, Tx 80 W, interferer 80 W at (500, 400) m, relays of 1 W at 20 m. There is no minimum separation, because
/// Algorithms 1 and 4 in the paper have none. A separation of 4 m would not change any of the optima.
pub fn multi_hop() -> Scenario {
    Scenario {
        min_separation_m: 0.0,
        ..Scenario::default()
    }
}

/// Returns the scenario of the paper's section on altitudes, with relays at `altitude_m`.
///
/// The interferer is at (500, `y_m`) m, altitudes are 20 m to 300 m, and relays are at least 4 m apart.
pub fn altitudes(y_m: f64, altitude_m: f64) -> Scenario {
    Scenario {
        altitude_m,
        altitude_min_m: 20_f64.min(altitude_m),
        altitude_max_m: 300_f64.max(altitude_m),
        ..with_interferer(Scenario::default(), 500.0, y_m)
    }
}

/// Returns `scenario` with a single interferer of 80 W at (`x_m`, `y_m`), m.
pub fn with_interferer(scenario: Scenario, x_m: f64, y_m: f64) -> Scenario {
    Scenario {
        interference: Interference::Sources(vec![Source {
            power_w: 80.0,
            x_m,
            y_m,
        }]),
        ..scenario
    }
}

/// Returns the mission of `relays` relays in `scenario`, for a chain computed without messages.
///
/// The relative tolerance of its target SIR is 1e-6.
pub fn mission(scenario: &Scenario, relays: u16) -> Result<Mission, FigureError> {
    Ok(mission::mission(scenario, relays, FINE)?.0)
}

/// Returns the mission of `relays` relays in `scenario`, for a simulated chain.
///
/// The relative tolerance of its target SIR is 1e-4, the default of `cargo chain`.
pub fn flown(scenario: &Scenario, relays: u16) -> Result<Mission, FigureError> {
    Ok(mission::mission(scenario, relays, FLOWN)?.0)
}
