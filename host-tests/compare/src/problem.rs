//! Problems: relays at one altitude, with free altitudes, and also with free lateral positions.

use std::fmt;

use serde::{Deserialize, Serialize};
use uav_relay_oracle::reference::joint::Corridor;
use uav_relay_oracle::reference::{Link, Relay, path_loss_factor};
use uav_relay_scenario::{Interference, Scenario};

/// Coordinates that a solver may choose for each relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Choice {
    /// Distance x along the line from transmitter to receiver. All relays have the same altitude.
    Places,
    Altitudes,
    Sides,
}

/// Placement problem: find the best positions of a number of relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct Problem {
    pub(crate) choice: Choice,
    pub(crate) relays: u16,
}

/// Best possible SIR (linear) for each kind of problem and number of relays, to nine or ten digits.
///
/// An independent program has computed these optima.
const OPTIMA: [(Choice, &[(u16, f64)]); 3] = [
    (
        Choice::Places,
        &[
            (1, 1.490_121_510),
            (2, 1.616_583_018),
            (8, 2.465_535_745),
            (50, 13.859_132_9),
        ],
    ),
    (
        Choice::Altitudes,
        &[
            (2, 0.881_533_886_7),
            (5, 1.047_463_457_8),
            (8, 1.235_783_782_6),
            (50, 6.498_377_624_8),
        ],
    ),
    (Choice::Sides, &[(8, 1.543_032_046), (50, 9.002_614_360)]),
];

pub(crate) fn all() -> Vec<Problem> {
    let of = |(choice, optima): (Choice, &[(u16, f64)])| {
        let relays = optima.iter().map(|(relays, _)| *relays);
        relays
            .map(|relays| Problem { choice, relays })
            .collect::<Vec<_>>()
    };
    OPTIMA.into_iter().flat_map(of).collect()
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.choice {
            Choice::Places => "places",
            Choice::Altitudes => "places and altitudes",
            Choice::Sides => "places, sides and altitudes",
        };
        write!(f, "{what} of {}", self.relays)
    }
}

impl Problem {
    /// Returns the best possible SIR (linear) of this problem; `None` if the problem is not in [`all`].
    pub(crate) fn optimum(self) -> Option<f64> {
        let (_, optima) = OPTIMA.iter().find(|(choice, _)| *choice == self.choice)?;
        let known = optima.iter().find(|(relays, _)| *relays == self.relays)?;
        Some(known.1)
    }

    pub(crate) fn scenario(self) -> Result<Scenario, String> {
        match self.choice {
            Choice::Places => Ok(Scenario::default()),
            Choice::Altitudes => {
                let text = include_str!("../../../examples/altitudes.toml");
                Scenario::parse("altitudes.toml", text).map_err(|error| error.to_string())
            }
            Choice::Sides => {
                let text = include_str!("../../../examples/side.toml");
                Scenario::parse("side.toml", text).map_err(|error| error.to_string())
            }
        }
    }

    /// Returns the link of the problem, and the limits of altitude and lateral position, for other solvers.
    pub(crate) fn link(self) -> Result<(Link, Corridor), String> {
        let scenario = self.scenario()?;
        let Interference::Sources(sources) = &scenario.interference else {
            return Err("a scenario without an interferer".to_owned());
        };
        let source = sources.first().ok_or("a scenario without an interferer")?;
        let channel = &scenario.channel;
        let factor =
            |loss_db: f64| path_loss_factor(channel.carrier_hz, 10_f64.powf(loss_db / 10.0));
        let mu_los = factor(channel.excess_loss_los_db);
        let station = Relay {
            altitude_m: scenario.altitude_m,
            power_w: scenario.uav_w,
        };
        let link = Link {
            distance_m: scenario.distance_m,
            min_separation_m: scenario.min_separation_m,
            tx_w: scenario.tx_w,
            interferer_w: source.power_w,
            x_i: source.x_m,
            y_i: source.y_m,
            mu_los,
            mu_nlos: factor(channel.excess_loss_nlos_db),
            // Line of sight between ground and air, as in all scenarios.
            eta: mu_los,
            // No noise, as in the other solvers.
            noise_w: 0.0,
            relays: vec![station; usize::from(self.relays)],
        };
        let corridor = match self.choice {
            Choice::Places => Corridor::plane(scenario.altitude_m, scenario.altitude_m),
            Choice::Altitudes | Choice::Sides => Corridor {
                least_m: scenario.altitude_min_m,
                most_m: scenario.altitude_max_m,
                left_m: scenario.lateral_min_m,
                right_m: scenario.lateral_max_m,
            },
        };
        Ok((link, corridor))
    }
}
