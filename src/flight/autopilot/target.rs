//! What the autopilot is told to fly to: when it is told, and whether it flies there.

use super::carrot::Carrot;
use super::kind::Kind;
use crate::flight::axis::Axis;
use crate::geodetic::Geodetic;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// From one target to the next while it moves, and while it stands. A PX4 leaves its mode when it hears none for a second.
const MOVING: Duration = Duration::from_millis(100);
const STANDING: Duration = Duration::from_millis(200);

/// An ArduCopter is told a place again until it has said that it flies there: repetition makes it wobble.
const AGAIN: Duration = Duration::from_millis(1_000);

/// An ArduCopter says twice a second what it flies to. As many times in a row elsewhere, and it was told for as long: that is an event.
const REFUSED_AFTER: u8 = 6;
const TOLD_FOR: Duration = Duration::from_millis(3_000);

/// How far what an ArduCopter says it flies to may be from the carrot: standing, 1e-7 degrees; moving, m, and s at the carrot's speed.
const TAKEN_WITHIN: u32 = 20;
const NEAR_M: f32 = 3.0;
const NEAR_S: f32 = 1.0;

/// A place is told so often to an autopilot that never says what it flies to.
const UNCONFIRMED: u8 = 10;

/// What the autopilot is given to fly to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) carrot: Carrot,
    pub(super) due: Instant,
    /// How often it has been told the place where it ends.
    told: u8,
    /// True once the autopilot has said that it flies there.
    is_taken: bool,
    /// Since when targets are told.
    since: Instant,
    /// How often in a row the autopilot has said that it flies elsewhere.
    elsewhere: u8,
    /// True once the autopilot has said where it flies to.
    is_said: bool,
}

impl Target {
    /// One that stands there, and has not been told.
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

    /// It is to end elsewhere, which has not been told.
    pub(super) const fn renew(&mut self, now: Instant) {
        self.due = now;
        self.told = 0;
        self.is_taken = false;
    }

    /// Takes what the autopilot says it flies to. Returns true where it has been told long enough and flies elsewhere, once.
    ///
    /// While the target moves, what the autopilot flies to may be behind it by the time between two messages.
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
        // A standing target is taken exactly, or not.
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

    /// It is told, as the drone's own place.
    pub(super) fn tell_own_place(&mut self, now: Instant) {
        self.due = now + STANDING;
    }

    /// It is due: whether it is told now. The next time follows from whether it stands.
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
