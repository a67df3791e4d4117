//! The paper's scenarios, as missions: what its table of parameters says, and nothing that it leaves out.

use uav_relay::Mission;

use super::trouble::Trouble;
use uav_relay_scenario::mission;
use uav_relay_scenario::{Interference, Scenario, Source};

/// Relative tolerance on the target of a chain without messages: ten times what an f32 can tell.
pub(super) const FINE: f64 = 1e-6;

/// That of a chain that is flown, as `cargo chain` has it.
const FLOWN: f64 = 1e-4;

/// The multi-hop scenario (fourth and fifth sub-table): D = 1 km, Tx 80 W, interferer 80 W at (500, 400) m, relays of 1 W at
/// 20 m.
///
/// The least separation of 4 m is left out: Algorithms 1 and 4 as printed do not look at it, and at none of the optima it
/// would bind.
pub fn multi_hop() -> Scenario {
    Scenario {
        min_separation_m: 0.0,
        ..Scenario::default()
    }
}

/// The scenario of the section about altitudes: the interferer at (500, `y_m`) m, altitudes of 20 m to 300 m, 4 m apart.
pub fn altitudes(y_m: f64, altitude_m: f64) -> Scenario {
    Scenario {
        altitude_m,
        altitude_min_m: 20_f64.min(altitude_m),
        altitude_max_m: 300_f64.max(altitude_m),
        ..with_interferer(Scenario::default(), 500.0, y_m)
    }
}

/// `scenario` with its interferer, of 80 W, elsewhere.
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

/// The mission of `relays` relays in `scenario`, for a chain without messages.
///
/// # Errors
/// [`Trouble::Mission`].
pub fn mission(scenario: &Scenario, relays: u16) -> Result<Mission, Trouble> {
    Ok(mission::mission(scenario, relays, FINE)?.0)
}

/// The same for a chain that is flown.
///
/// # Errors
/// [`Trouble::Mission`].
pub fn flown(scenario: &Scenario, relays: u16) -> Result<Mission, Trouble> {
    Ok(mission::mission(scenario, relays, FLOWN)?.0)
}
