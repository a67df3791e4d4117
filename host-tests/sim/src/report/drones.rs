//! Where drones with an autopilot are in the end.

use serde::Serialize;
use uav_relay::Placement;

use crate::simulator::drones::{Point, apart};
use crate::simulator::outcome::{Outcome, RelayEnd};

/// One drone at the end of a run.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct DroneReport {
    /// Its relay's number in the mission, from 1.
    pub index: u16,
    /// Where it truly is, m.
    pub x_m: f64,
    /// To the right of the line, m.
    pub y_m: f64,
    /// Above the ground, m.
    pub h_m: f64,
    /// Whether its autopilot flies to the relay's setpoints.
    pub flown: bool,
    /// How far it is from its relay's place, m, where that has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off_m: Option<f64>,
}

/// All of them; none where no autopilots were flown.
pub(super) fn drones(outcome: &Outcome) -> Vec<DroneReport> {
    let ends = (1..).zip(outcome.fleet.iter().zip(&outcome.relays));
    ends.map(|(index, (&(at, flown), relay))| one(index, at, flown, relay))
        .collect()
}

fn one(index: u16, at: Point, flown: bool, relay: &RelayEnd) -> DroneReport {
    let [x_m, y_m, h_m] = at;
    let point = |place: Placement| [place.x_m, place.y_m, place.altitude_m].map(f64::from);
    DroneReport {
        index,
        x_m,
        y_m,
        h_m,
        flown,
        off_m: relay.setpoint.map(|place| apart(point(place), at)),
    }
}
