//! Report of the terrain below a chain: its hops, and the heights of its relays.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::Placement;

use crate::diffraction::{LIGHT_M_S, loss_db};
use crate::profile::{Ground, Node, Profile, State};

/// Terrain below one hop.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct HopReport {
    /// True if the ground is below the line of sight by at least 60 % of the first Fresnel zone's radius.
    pub clear: bool,
    /// State of the line of sight: `clear`, `grazing` or `blocked`.
    pub state: State,
    /// Height of the line of sight above the worst obstacle, m; negative if the hop is blocked.
    pub clearance_m: f64,
    /// Clearance that a clear hop needs at the worst obstacle, m.
    pub required_m: f64,
    /// Distance of the worst obstacle from Tx toward Rx, m.
    pub obstacle_x_m: f64,
    /// Lateral position of the worst obstacle, m.
    pub obstacle_y_m: f64,
    /// Latitude of the worst obstacle, degrees.
    pub obstacle_lat_deg: f64,
    /// Longitude of the worst obstacle, degrees.
    pub obstacle_lon_deg: f64,
    /// Diffraction loss of the hop by Recommendation ITU-R P.526, dB; it is equal in both directions.
    pub diffraction_db: f64,
    /// SIR of the hop in the direction to Rx with its diffraction loss, dB.
    ///
    /// The interference is computed without diffraction loss.
    pub sir_db: f64,
    /// SIR of the hop in the direction to Tx with its diffraction loss, dB; absent if the SIR is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir_back_db: Option<f64>,
}

/// Height of one relay above the terrain.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct RelayHeight {
    /// Number of the relay; 1 is next to Tx.
    pub index: usize,
    /// Height of the relay above the mean sea level, m.
    pub amsl_m: f64,
    /// Height of the relay above the ground below it, m.
    pub above_ground_m: f64,
    /// Height of the relay above the highest ground within its position error, m.
    pub above_obstacle_m: f64,
}

/// Altitude of an interferer on the ground.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct InterfererHeight {
    /// Number of the interferer in the scenario file, from 1.
    pub index: usize,
    /// Least and greatest altitude of the interferer's antenna above the straight line Tx-Rx, m.
    ///
    /// Absent if the elevation files do not cover the interferer. The two values differ if the interferer is somewhere
    /// in an area, and not at one point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub altitude_m: Option<[f64; 2]>,
}

/// Terrain below a chain.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TerrainReport {
    /// Terrain below the hops, from Tx to Rx.
    pub hops: Vec<HopReport>,
    /// Heights of the relays above the terrain, from Tx to Rx.
    pub heights: Vec<RelayHeight>,
    /// Altitudes of the interferers, as used for the SIRs of the hops.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub interferers: Vec<InterfererHeight>,
    /// Position error of the relays, m. An obstacle within this distance of a relay counts as below the relay.
    pub position_error_m: f64,
    /// SIR of the worst hop with the diffraction losses, linear. The plan's `sir` is without these losses.
    pub terrain_sir: f64,
    /// SIR of the worst hop with the diffraction losses, dB.
    pub terrain_sir_db: f64,
    /// Terrain profiles of the hops, for drawing pictures.
    #[serde(skip)]
    pub profiles: Vec<Profile>,
}

/// Linear SIRs of the hops in free space, without diffraction losses.
#[derive(Clone, Copy, Debug)]
pub struct FreeSpace<'a> {
    /// SIRs of the hops in the direction to Rx, linear.
    pub sirs: &'a [f64],
    /// SIRs in the direction to Tx; empty if the SIRs are unknown.
    pub sirs_back: &'a [f64],
    /// Required SIR toward Tx as a fraction of the SIR toward Rx; 0 without traffic toward Tx.
    pub reverse: f64,
}

impl TerrainReport {
    /// Creates the report of a chain with relays at `places`.
    ///
    /// # Errors
    /// A text that names the position: the elevation files do not cover it, or have no height there.
    pub fn new(
        ground: &Ground<'_>,
        places: &[Placement],
        free: FreeSpace<'_>,
        carrier_hz: f64,
        position_error_m: f64,
    ) -> Result<Self, String> {
        let wavelength_m = LIGHT_M_S / carrier_hz;
        let relays = places.iter().map(|place| ground.relay(*place));
        let relays = relays.collect::<Result<Vec<Node>, _>>()?;
        let [tx, rx] = ground.ends;
        let nodes = [&[tx], relays.as_slice(), &[rx]].concat();
        let mut profiles = Vec::new();
        let mut hops = Vec::new();
        let mut terrain_sir = f64::INFINITY;
        for (hop, (from, to)) in nodes.iter().zip(nodes.iter().skip(1)).enumerate() {
            let profile = ground.profile([*from, *to])?;
            let worst = profile.clearance(wavelength_m);
            let diffraction_db = loss_db(&profile.points, [from.amsl_m, to.amsl_m], wavelength_m);
            let gain = 10_f64.powf(-diffraction_db / 10.0);
            let share = worst.along_m / profile.length_m().max(f64::MIN_POSITIVE);
            let between = |from: f64, to: f64| from + share * (to - from);
            let [obstacle_x_m, obstacle_y_m] =
                [between(from.x_m, to.x_m), between(from.y_m, to.y_m)];
            let obstacle = ground.point(obstacle_x_m, obstacle_y_m)?;
            let sir = free.sirs.get(hop).copied().unwrap_or_default() * gain;
            let back = free.sirs_back.get(hop).map(|sir| sir * gain);
            terrain_sir = terrain_sir.min(sir);
            if let Some(back) = back.filter(|_| free.reverse > 0.0) {
                terrain_sir = terrain_sir.min(back / free.reverse);
            }
            hops.push(HopReport {
                clear: worst.state == State::Clear,
                state: worst.state,
                clearance_m: worst.clearance_m,
                required_m: worst.required_m,
                obstacle_x_m,
                obstacle_y_m,
                obstacle_lat_deg: f64::from(obstacle.lat_e7) / 1e7,
                obstacle_lon_deg: f64::from(obstacle.lon_e7) / 1e7,
                diffraction_db,
                sir_db: 10.0 * sir.log10(),
                sir_back_db: back.map(|back| 10.0 * back.log10()),
            });
            profiles.push(profile);
        }
        let heights = (1..).zip(&relays).map(|(index, relay)| {
            Ok(RelayHeight {
                index,
                amsl_m: relay.amsl_m,
                above_ground_m: relay.amsl_m - ground.height_m(relay.x_m, relay.y_m)?,
                above_obstacle_m: relay.amsl_m - ground.highest_m(*relay, position_error_m)?,
            })
        });
        Ok(Self {
            hops,
            heights: heights.collect::<Result<_, String>>()?,
            interferers: Vec::new(),
            position_error_m,
            terrain_sir,
            terrain_sir_db: 10.0 * terrain_sir.log10(),
            profiles,
        })
    }

    /// Returns a text that names every blocked hop with its worst obstacle; `None` if no hop is blocked.
    pub fn blocked(&self) -> Option<String> {
        let blocked = self
            .hops
            .iter()
            .enumerate()
            .filter(|(_, hop)| hop.state == State::Blocked);
        let lines = blocked.map(|(at, hop)| {
            format!(
                "{} is blocked: the ground at x = {:.0} m, y = {:.0} m (latitude {:.6}, longitude {:.6}) is {:.1} m above the line of sight",
                self.name(at),
                hop.obstacle_x_m,
                hop.obstacle_y_m,
                hop.obstacle_lat_deg,
                hop.obstacle_lon_deg,
                -hop.clearance_m
            )
        });
        let lines: Vec<String> = lines.collect();
        (!lines.is_empty()).then(|| lines.join("; "))
    }

    /// Returns a text that names the relays less than `least_m` above the highest ground.
    ///
    /// `None` if no relay is too low.
    pub fn too_low(&self, least_m: f64) -> Option<String> {
        let low = self
            .heights
            .iter()
            .filter(|relay| relay.above_obstacle_m < least_m - 0.01);
        let low =
            low.map(|relay| format!("relay {} is {:.1} m", relay.index, relay.above_obstacle_m));
        let low: Vec<String> = low.collect();
        (!low.is_empty()).then(|| {
            format!("{} above the highest ground below it; allowed: at least {least_m} m (terrain.above_ground_m)", low.join(", "))
        })
    }

    /// Returns a text that names the relays more than `most_m` above the ground.
    ///
    /// `None` if no relay is too high.
    pub fn too_high(&self, most_m: f64) -> Option<String> {
        let high = self
            .heights
            .iter()
            .filter(|relay| relay.above_ground_m > most_m + 0.01);
        let high =
            high.map(|relay| format!("relay {} is {:.1} m", relay.index, relay.above_ground_m));
        let high: Vec<String> = high.collect();
        (!high.is_empty()).then(|| {
            format!(
                "{} above the ground; allowed: at most {most_m} m (terrain.above_ground_max_m)",
                high.join(", ")
            )
        })
    }

    /// Returns the name of the hop with index `hop` (from 0), with its two ends.
    fn name(&self, hop: usize) -> String {
        let node = |at: usize| match at {
            0 => "Tx".to_owned(),
            at => self
                .heights
                .get(at - 1)
                .map_or("Rx".to_owned(), |relay| format!("relay {}", relay.index)),
        };
        format!("hop {} ({} to {})", hop + 1, node(hop), node(hop + 1))
    }

    /// Returns the report as a table for the terminal.
    pub fn table(&self) -> String {
        let mut text = String::from(
            "terrain:  hop    state  clearance (m)  needed (m)    at x (m)  loss (dB)  SIR (dB)\n",
        );
        for (number, hop) in (1..).zip(&self.hops) {
            let state = match hop.state {
                State::Clear => "clear",
                State::Grazing => "grazing",
                State::Blocked => "BLOCKED",
            };
            _ = writeln!(
                text,
                "{number:>13}  {state:>7}  {:>13.1}  {:>10.1}  {:>10.1}  {:>9.2}  {:>8.3}",
                hop.clearance_m, hop.required_m, hop.obstacle_x_m, hop.diffraction_db, hop.sir_db
            );
        }
        let error = self.position_error_m;
        _ = writeln!(
            text,
            "heights: relay  above sea (m)  above ground (m)  lowest above ground within {error} m (m)"
        );
        for relay in &self.heights {
            _ = writeln!(
                text,
                "{:>14}  {:>13.1}  {:>16.1}  {:>34.1}",
                relay.index, relay.amsl_m, relay.above_ground_m, relay.above_obstacle_m
            );
        }
        for InterfererHeight { index, altitude_m } in &self.interferers {
            _ = match altitude_m {
                Some([low, high]) if high > low => writeln!(
                    text,
                    "interferer {index}: {low:.1} to {high:.1} m above the straight line between the sites"
                ),
                Some([low, _]) => writeln!(
                    text,
                    "interferer {index}: {low:.1} m above the straight line between the sites"
                ),
                None => writeln!(
                    text,
                    "interferer {index}: not covered by the elevation files, counts at the height of the line between the sites"
                ),
            };
        }
        _ = writeln!(
            text,
            "worst hop with terrain: {:.3} dB (diffraction by ITU-R P.526 on the hops, not on the paths of the interference)",
            self.terrain_sir_db
        );
        text
    }
}
