//! Flight parameters of drones with autopilots, and pilots' actions.

use uav_relay::Geodetic;
use uav_relay::Instant;
use uav_relay::flight::autopilot::Kind;
use uav_relay::flight::axis::Axis;

use crate::simulator::drones::Point;

/// Takeover of a drone by its pilot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Takeover {
    /// Relay number of the drone, from 1.
    pub relay: u16,
    /// Start time.
    pub from: Instant,
    /// End time, if any: the pilot then hands the drone over once it hovers without traffic.
    pub until: Option<Instant>,
    /// Position to which the pilot flies, m along the run's line, to its right and up. `None` to climb in place.
    pub to: Option<Point>,
}

/// Parameters of all drones of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct FleetSpec {
    /// Line on earth along which they fly.
    pub axis: Axis,
    /// Position of each drone's first hand-over, m along the line, to its right and up; it takes off below.
    pub start: Vec<Point>,
    /// Takeovers by pilots.
    pub takeovers: Vec<Takeover>,
    /// Restarts of autopilots in the air: relay number from 1, and time.
    pub restarts: Vec<(u16, Instant)>,
    /// Standard deviation of the gusts, m/s.
    pub gust_mps: f64,
    /// Bound on each drone's constant position error per axis, m.
    pub bias_m: f64,
    /// Bound on the additional error of each position report per axis, m.
    pub noise_m: f64,
}

impl FleetSpec {
    /// Returns PX4 and ArduCopter for alternate drones.
    pub(super) const fn kind(index: usize) -> Kind {
        if index.is_multiple_of(2) {
            Kind::Px4
        } else {
            Kind::ArduCopter
        }
    }
}

/// Returns a line of the given length eastward from 47.4 N, 8.54 E, for scenarios without sites. `None` for an invalid length.
pub fn somewhere(distance_m: f64) -> Option<Axis> {
    const TX: [f64; 2] = [47.4, 8.54];
    let tx = Geodetic::from_degrees(TX[0], TX[1], 420.0)?;
    let line = |east_deg: f64| {
        let rx = Geodetic::from_degrees(TX[0], TX[1] + east_deg, 420.0)?;
        Axis::try_new(tx, rx).ok()
    };
    // A degree of longitude is about 75 km there; two iterations reach the resolution of the coordinates.
    let mut east_deg = distance_m / 75_000.0;
    for _ in 0..3 {
        east_deg *= distance_m / line(east_deg)?.distance_m();
    }
    line(east_deg)
}
