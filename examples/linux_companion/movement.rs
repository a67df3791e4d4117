//! Log lines about the flight to the agreed position: setpoints and arrival.
//!
//! With an autopilot the guard moves the setpoint several times a second. A line is then written every 0.5 m and at
//! the end of each move. Without an autopilot another program may fly the drone by these lines, so every change is
//! logged.

use serde_json::json;
use uav_relay::{Duration, Instant, Placement, Relay};

use crate::status::at;
use uav_relay_linux::log::Log;

const STEP_M: f32 = 0.5;

/// Maximum distance of an arrived drone from its agreed position, m.
///
/// Autopilots hover up to 0.9 m away from their target.
const NEAR_M: f32 = 1.0;

/// Time without a change of the setpoint after which a move has ended.
///
/// A drone counts as arrived only after it was near its agreed position for the same time, because it may first fly
/// past the position.
const SETTLES: Duration = Duration::from_millis(2_000);

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Step {
    Setpoint(Placement),
    /// Arrival of the drone: agreed position, and distance from it, m.
    Arrived(Placement, f32),
}

/// Log of a drone's moves: logged setpoint, newest setpoint, and progress.
#[derive(Debug)]
pub(crate) struct Movement {
    /// True if only setpoint changes above [`STEP_M`] and the end of each move are logged.
    is_sparse: bool,
    logged: Option<Placement>,
    newest: Option<Placement>,
    changed_at: Instant,
    /// True from a setpoint change above [`STEP_M`] until the setpoint has stopped changing.
    is_moving: bool,
    /// True from a setpoint change above [`STEP_M`] until the drone's arrival is logged.
    is_on_its_way: bool,
    near_since: Option<Instant>,
}

impl Movement {
    pub(crate) const fn new(is_sparse: bool) -> Self {
        Self {
            is_sparse,
            logged: None,
            newest: None,
            changed_at: Instant::ZERO,
            is_moving: false,
            is_on_its_way: false,
            near_since: None,
        }
    }

    /// Handles a changed setpoint; returns the line to log, if any.
    pub(crate) fn setpoint_changed(&mut self, now: Instant, relay: &Relay) -> Option<Step> {
        if self.is_sparse {
            return self.next(now, relay.setpoint(), relay.agreed_place());
        }
        let setpoint = relay.setpoint()?;
        self.set_logged(setpoint);
        Some(Step::Setpoint(setpoint))
    }

    /// Returns the setpoint or arrival to log, if any, and the time by which the next call is due.
    ///
    /// `drone` is the drone's position.
    pub(crate) fn poll(
        &mut self,
        now: Instant,
        relay: &Relay,
        drone: Option<Placement>,
    ) -> (Option<Step>, Option<Instant>) {
        let (setpoint, agreed) = (relay.setpoint(), relay.agreed_place());
        if self.is_sparse
            && let Some(step) = self.next(now, setpoint, agreed)
        {
            return (Some(step), Some(now));
        }
        let step = self.arrival(now, drone, setpoint.filter(|it| Some(*it) == agreed));
        let end = self.changed_at + SETTLES;
        let end = (self.is_sparse && self.is_moving).then_some(end);
        let near = self.near_since.map(|since| since + SETTLES);
        let near = near.filter(|_| self.is_on_its_way);
        (step, end.into_iter().chain(near).min())
    }

    /// Returns the setpoint if it must be logged now, otherwise `None`.
    fn next(
        &mut self,
        now: Instant,
        setpoint: Option<Placement>,
        agreed: Option<Placement>,
    ) -> Option<Step> {
        if self.newest != setpoint {
            (self.newest, self.changed_at) = (setpoint, now);
        }
        let Some(place) = setpoint else {
            *self = Self::new(self.is_sparse);
            return None;
        };
        if self.logged.is_none_or(|it| apart_m(it, place) > STEP_M) {
            self.set_logged(place);
            return Some(Step::Setpoint(place));
        }
        let is_end = setpoint == agreed || now.since(self.changed_at) >= SETTLES;
        if self.is_moving && is_end {
            self.is_moving = false;
            if self.logged != setpoint {
                self.logged = setpoint;
                return Some(Step::Setpoint(place));
            }
        }
        None
    }

    fn set_logged(&mut self, place: Placement) {
        self.logged = Some(place);
        (self.is_moving, self.is_on_its_way) = (true, true);
        self.near_since = None;
    }

    /// Returns the drone's arrival at `goal` once it has stayed there for [`SETTLES`]; otherwise `None`.
    ///
    /// `goal` is the agreed position once the setpoint has reached it; before that it is `None`.
    fn arrival(
        &mut self,
        now: Instant,
        drone: Option<Placement>,
        goal: Option<Placement>,
    ) -> Option<Step> {
        let near = drone.zip(goal);
        let near = near.map(|(drone, goal)| (goal, apart_m(drone, goal)));
        let Some((goal, off_m)) = near.filter(|(_, off_m)| *off_m <= NEAR_M) else {
            self.near_since = None;
            return None;
        };
        let since = *self.near_since.get_or_insert(now);
        if !self.is_on_its_way || now.since(since) < SETTLES {
            return None;
        }
        self.is_on_its_way = false;
        Some(Step::Arrived(goal, off_m))
    }
}

impl Step {
    /// Logs this setpoint or arrival. Each coordinate of a setpoint is also logged as the bits of an f32.
    ///
    /// The position is in the mission's coordinates. `x_m` is the distance from the transmitter toward the receiver,
    /// `y_m` the distance to the right when facing the receiver, `altitude_m` the height above the ground.
    pub(crate) fn log(self, now: Instant, log: &Log) {
        match self {
            Self::Setpoint(place) => {
                let [x, y, altitude] = [place.x_m, place.y_m, place.altitude_m]
                    .map(|number| format!("{number:.3} (0x{:08x})", number.to_bits()));
                log.event(
                    now,
                    "setpoint",
                    at(place),
                    format_args!("x {x} m, y {y} m, altitude {altitude} m"),
                );
            }
            Self::Arrived(place, off_m) => {
                let Placement {
                    x_m,
                    y_m,
                    altitude_m,
                } = place;
                let fields =
                    json!({ "x_m": x_m, "y_m": y_m, "altitude_m": altitude_m, "off_m": off_m });
                log.event(
                    now,
                    "arrived",
                    fields,
                    format_args!(
                        "the drone is {off_m:.1} m from its agreed position: x {x_m:.1} m, y {y_m:.1} m, altitude {altitude_m:.1} m"
                    ),
                );
            }
        }
    }
}

fn apart_m(a: Placement, b: Placement) -> f32 {
    (a.x_m - b.x_m)
        .hypot(a.y_m - b.y_m)
        .hypot(a.altitude_m - b.altitude_m)
}

#[cfg(test)]
mod tests {
    use super::{Movement, Step};
    use uav_relay::{Instant, Placement};

    const fn along(x_m: f32) -> Placement {
        Placement {
            x_m,
            y_m: 0.0,
            altitude_m: 20.0,
        }
    }

    /// Checks the lines of a setpoint that moves by 0.1 m every 0.2 s: one every 0.6 m, and one at the end.
    ///
    /// A small later change is not logged.
    #[test]
    fn a_line_for_each_half_metre_and_the_exact_end() {
        let mut movement = Movement::new(true);
        let mut logged = Vec::new();
        let mut steps = (0_u16..).map(|i| (Instant::from_millis(200 * u64::from(i)), i));
        for (now, i) in steps.by_ref().take(24) {
            let place = along(10.0 + 0.1 * f32::from(i.min(13)));
            let step = movement.next(now, Some(place), Some(along(90.0)));
            logged.extend(step);
        }
        let expected = [10.0, 10.6, 11.2, 10.0 + 0.1 * 13.0].map(|x_m| Step::Setpoint(along(x_m)));
        assert_eq!(logged.len(), expected.len(), "{logged:?}");
        assert_eq!(logged.last(), expected.last(), "the end is exact");
        for (now, _) in steps.take(50) {
            let step = movement.next(now, Some(along(11.6)), Some(along(11.6)));
            assert_eq!(step, None);
        }
    }

    /// Checks that a drone that flies past its goal and back is logged as arrived only once.
    ///
    /// A stay near the goal of less than 2 s does not count as arrival.
    #[test]
    fn a_drone_that_stays_has_arrived_once() {
        let mut movement = Movement::new(true);
        let goal = Some(along(50.0));
        movement.next(Instant::ZERO, goal, goal);
        let mut arrivals = Vec::new();
        for i in 0..100_u64 {
            let now = Instant::from_millis(100 * i);
            let drone = along(match i {
                10..20 => 50.4,
                20..30 => 52.0,
                30.. => 49.7,
                _ => 40.0,
            });
            let step = movement.arrival(now, Some(drone), goal);
            arrivals.extend(step.map(|step| (i, step)));
        }
        let [(50, Step::Arrived(place, off_m))] = arrivals[..] else {
            panic!("{arrivals:?}");
        };
        assert_eq!(place, along(50.0));
        assert!((off_m - 0.3).abs() < 1e-3, "{off_m}");
    }
}
