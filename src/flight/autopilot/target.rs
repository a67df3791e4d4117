//! Target of the autopilot: the times at which it is sent, and the comparison with the reported target.

use super::carrot::Carrot;
use super::kind::Kind;
use crate::flight::axis::Axis;
use crate::geodetic::Geodetic;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// Intervals between two targets, while it moves and while it stands. A PX4 leaves its mode after a second without a target.
const MOVING: Duration = Duration::from_millis(100);
const STANDING: Duration = Duration::from_millis(200);

/// Interval between repetitions to an ArduCopter until it has reported the target. More frequent repetition makes it wobble.
const AGAIN: Duration = Duration::from_millis(1_000);

/// Consecutive reports of another target before an event is raised. An ArduCopter reports its target twice a second; the target
/// must also have been sent for as long.
const REFUSED_AFTER: u8 = 6;
const TOLD_FOR: Duration = Duration::from_millis(3_000);

/// Tolerance between the reported target of an ArduCopter and the carrot. Standing: 1e-7 degrees; moving: m, and s at the carrot's
/// speed.
const TAKEN_WITHIN: u32 = 20;
const NEAR_M: f32 = 3.0;
const NEAR_S: f32 = 1.0;

/// Number of repetitions of a standing target to an autopilot that never reports its target.
const UNCONFIRMED: u8 = 10;

/// Target that is sent to the autopilot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) carrot: Carrot,
    pub(super) due: Instant,
    /// Number of times that the final position has been sent.
    told: u8,
    /// True once the autopilot has reported this target.
    is_taken: bool,
    /// Time since which targets are sent.
    since: Instant,
    /// Number of consecutive reports of another target.
    elsewhere: u8,
    /// True once the autopilot has reported any target.
    is_said: bool,
}

impl Target {
    /// Creates a standing target that has not been sent.
    pub(super) const fn at(place: Placement, now: Instant) -> Self {
        Self {
            carrot: Carrot::at(place, now),
            due: now,
            told: 0,
            is_taken: false,
            since: now,
            elsewhere: 0,
            is_said: false,
        }
    }

    /// Restarts the counts after a change of the final position, which has not been sent.
    pub(super) const fn renew(&mut self, now: Instant) {
        self.due = now;
        self.told = 0;
        self.is_taken = false;
    }

    /// Compares the autopilot's reported target. Returns true, once, if it differs although the target was sent long enough.
    ///
    /// While the target moves, the report may lag behind it by the time between two messages.
    pub(super) fn compare(&mut self, now: Instant, axis: &Axis, lat_e7: i32, lon_e7: i32) -> bool {
        self.is_said = true;
        let Some(point) = axis.point(self.carrot.place) else {
            return false;
        };
        let near = |a: i32, b: i32| a.abs_diff(b) <= TAKEN_WITHIN;
        let is_there = near(point.lat_e7, lat_e7) && near(point.lon_e7, lon_e7);
        if self.told > 0 {
            self.is_taken = is_there;
        }
        let amsl_mm = point.amsl_mm;
        let said = axis.place(Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        });
        let is_near = said.is_some_and(|said| {
            let [x, y, _] = self.carrot.velocity_m_s;
            let within = NEAR_M + NEAR_S * (x.abs() + y.abs());
            let off = |a: f32, b: f32| (a - b).abs() <= within;
            off(said.x_m, self.carrot.place.x_m) && off(said.y_m, self.carrot.place.y_m)
        });
        // A standing target is reported exactly, or not at all.
        if is_there || is_near && self.told == 0 {
            self.elsewhere = 0;
            return false;
        }
        if now.since(self.since) < TOLD_FOR {
            return false;
        }
        let before = self.elsewhere;
        self.elsewhere = before.saturating_add(1);
        before < REFUSED_AFTER && self.elsewhere >= REFUSED_AFTER
    }

    /// Records that the drone's own position was sent as the target.
    pub(super) fn tell_own_place(&mut self, now: Instant) {
        self.due = now + STANDING;
    }

    /// Returns true if the due target has to be sent now. The next time depends on whether it stands.
    pub(super) fn tell(&mut self, now: Instant, kind: Kind) -> bool {
        let stands = self.carrot.stands();
        self.due = now
            + match kind {
                _ if !stands => MOVING,
                Kind::Px4 => STANDING,
                Kind::ArduCopter => AGAIN,
            };
        let is_known = self.is_taken || !self.is_said && self.told >= UNCONFIRMED;
        let is_told = !stands || kind == Kind::Px4 || !is_known;
        if !stands {
            (self.told, self.is_taken) = (0, false);
        } else if is_told && kind == Kind::ArduCopter {
            self.told = self.told.saturating_add(1);
        }
        is_told
    }
}
