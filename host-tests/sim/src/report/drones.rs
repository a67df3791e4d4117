//! Final positions of drones with autopilots.

use serde::Serialize;
use uav_relay::Placement;

use crate::simulator::drones::{Point, apart};
use crate::simulator::outcome::{Outcome, RelayEnd};

/// Final state of a drone.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct DroneReport {
    /// Relay number in the mission, from 1.
    pub index: u16,
    /// True position along the line, m.
    pub x_m: f64,
    /// True position to the right of the line, m.
    pub y_m: f64,
    /// True height above the ground, m.
    pub h_m: f64,
    /// True if the relay controls the drone.
    pub flown: bool,
    /// Distance from the relay's setpoint, m, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off_m: Option<f64>,
}

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
