//! How drones with autopilots fly, and what their pilots do.

use uav_relay::Geodetic;
use uav_relay::Instant;
use uav_relay::flight::autopilot::Kind;
use uav_relay::flight::axis::Axis;

use crate::simulator::drones::Point;

/// The pilot of a drone has the sticks for a time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Takeover {
    /// Whose, from 1.
    pub relay: u16,
    /// From when on.
    pub from: Instant,
    /// When the pilot gives it back, if that is ever: from then on once it hovers and no other drone flies past.
    pub until: Option<Instant>,
    /// Place that the pilot flies it to, m along the line of the run, to its right and up; `None` to climb where it is.
    pub to: Option<Point>,
}

/// All drones of a run.
#[derive(Clone, PartialEq, Debug)]
pub struct FleetSpec {
    /// The line on earth that they fly along.
    pub axis: Axis,
    /// Place in the air at which each is handed over first, m along the line, to its right and up. It takes off below it.
    pub start: Vec<Point>,
    /// Pilots who take over.
    pub takeovers: Vec<Takeover>,
    /// Autopilots that are switched off and on in the air: whose, from 1, and when.
    pub restarts: Vec<(u16, Instant)>,
    /// How much gusts move a drone, m/s (standard deviation).
    pub gust_mps: f64,
    /// A drone takes itself to be so far off where it is at most, along each axis and for the whole run, m.
    pub bias_m: f64,
    /// It says so far off where it takes itself to be at most, along each axis and each time anew, m.
    pub noise_m: f64,
}

impl FleetSpec {
    /// Of every other drone PX4 is the autopilot.
    pub(super) const fn kind(index: usize) -> Kind {
        if index.is_multiple_of(2) {
            Kind::Px4
        } else {
            Kind::ArduCopter
        }
    }
}

/// A line of that length somewhere on earth, for a scenario that does not say where it is: eastward from 47.4 N, 8.54 E; `None` for a
/// length that no line may have.
pub fn somewhere(distance_m: f64) -> Option<Axis> {
    const TX: [f64; 2] = [47.4, 8.54];
    let tx = Geodetic::from_degrees(TX[0], TX[1], 420.0)?;
    let line = |east_deg: f64| {
        let rx = Geodetic::from_degrees(TX[0], TX[1] + east_deg, 420.0)?;
        Axis::try_new(tx, rx).ok()
    };
    // A degree is some 75 km there; two steps come as near as its units allow.
    let mut east_deg = distance_m / 75_000.0;
    for _ in 0..3 {
        east_deg *= distance_m / line(east_deg)?.distance_m();
    }
    line(east_deg)
}
