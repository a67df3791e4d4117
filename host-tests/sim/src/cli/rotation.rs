//! Options for a fleet that is larger than its chain.

use clap::Args;
use uav_relay::GuardConfig;

use crate::command::{Failure, number, whole};
use crate::simulator::drones::{BIAS_M, HOVER_M, NOISE_M};
use crate::simulator::rotation::{RotationSpec, duration};
use crate::simulator::setup::Setup;

/// Command-line options for drones that are replaced when their batteries run low.
#[derive(Args, Debug)]
pub struct Rotation {
    /// Number of drones, 2 to 1000, of which `--flying` are meant to fly. Tired drones announce that they leave, and fresh ones join
    /// first. Replaces --uavs; the drones have no autopilots
    #[arg(long, value_name = "N", requires = "fly", requires = "soak", conflicts_with_all = ["takeover", "start", "wires", "uavs", "kill", "boot"], value_parser = whole(2_u16, 1000))]
    pub fleet: Option<u16>,
    /// Number of drones that are meant to fly, more than half of the fleet. Default fleet.flying of the scenario,
    /// or the fleet
    #[arg(long, value_name = "N", requires = "fleet", value_parser = whole(1_u16, 1000))]
    pub flying: Option<u16>,
    /// Time that a full battery lasts in hover, s, 300 to 1e5; default 1500. Each battery differs by up to 5 %
    #[arg(long, value_name = "S", requires = "fleet", value_parser = |text: &str| number(text, 300.0, 1e5))]
    endurance: Option<f64>,
    /// Time on the ground until the battery is full again, s, 0 to 1e5; default 180
    #[arg(long, value_name = "S", requires = "fleet", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.0, 1e5))]
    ground_time: Option<f64>,
    /// Simulate K runs with announced departures only, 1 to 10000, and print a line a run, and the totals.
    /// The seeds are --seed and the numbers that follow
    #[arg(long, value_name = "K", requires = "fleet", conflicts_with_all = ["svg", "capture", "address"], value_parser = whole(1_u64, 10_000))]
    pub seeds: Option<u64>,
}

/// Largest relative difference of a battery's capacity from the average.
const SPREAD: f64 = 0.05;

/// Average speed, m/s, of a relay that flies the distance between two relays to its new position.
///
/// A relay flies at most about nine tenths of this distance. Its top speed is at most 1.5 times its own average: 10
/// m/s, the top speed of the drones.
const SPACING_MPS: f64 = 7.5;

impl Rotation {
    /// Gives `setup` a fleet of drones with batteries. `--flying` of them are meant to be in the chain.
    pub(super) fn prepare(&self, setup: &mut Setup) -> Result<(), Failure> {
        let config = setup.mission.config();
        let all = config.relays;
        let flying = self.flying.unwrap_or(all);
        if flying > all || 2 * flying <= all {
            return Err(Failure::input(format!(
                "--flying {flying}: must be within {} to {all}: the first view needs the votes of more than half of the fleet",
                all / 2 + 1
            )));
        }
        if !setup.profiles.is_empty() {
            let line = "--fleet: the scenario's [[relay]] tables give relays their own altitudes or powers; all drones of a fleet must be identical";
            return Err(Failure::input(line.to_owned()));
        }
        let mut guard = GuardConfig::of(&setup.mission, config.common);
        guard.hover_m = HOVER_M;
        setup.settings.guard = Some(guard);
        let respacing_s =
            (f64::from(config.distance_m) / f64::from(flying + 1) / SPACING_MPS).clamp(15.0, 60.0);
        setup.settings.respacing = duration(respacing_s);
        setup.settings.flying = flying;
        setup.rotation = Some(RotationSpec {
            flying,
            endurance_s: self.endurance.unwrap_or(1_500.0),
            spread: SPREAD,
            ground_s: self.ground_time.unwrap_or(180.0),
            announced: true,
            bias_m: BIAS_M,
            noise_m: NOISE_M,
        });
        Ok(())
    }
}
