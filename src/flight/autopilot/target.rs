//! What the autopilot is told to fly to: when it is told, and whether it flies there.

use super::carrot::Carrot;
use super::vehicle::Kind;
use crate::flight::axis::Axis;
use crate::place::Placement;
use crate::time::{Duration, Instant};

/// From one target to the next while it moves, and while it stands. A PX4 leaves its mode when it hears none for a second.
const MOVING: Duration = Duration::from_millis(100);
const STANDING: Duration = Duration::from_millis(200);

/// An ArduCopter is told a place again until it has said that it flies there: repetition makes it wobble.
const AGAIN: Duration = Duration::from_millis(1_000);

/// So often it is told before that is an event.
const REFUSED_AFTER: u8 = 5;

/// How far what an ArduCopter says it flies to may be from what it was told, 1e-7 degrees.
const TAKEN_WITHIN: u32 = 20;

/// What the autopilot is given to fly to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    pub(super) carrot: Carrot,
    pub(super) due: Instant,
    /// How often it has been told the place where it ends, and whether it has said that it flies there.
    told: u8,
    is_taken: bool,
}

impl Target {
    /// One that stands there, and has not been told.
    pub(super) const fn at(place: Placement, now: Instant) -> Self {
        Self {
            carrot: Carrot::at(place, now),
            due: now,
            told: 0,
            is_taken: false,
        }
    }

    /// It is to end elsewhere, which has not been told.
    pub(super) const fn renew(&mut self, now: Instant) {
        self.due = now;
        self.told = 0;
        self.is_taken = false;
    }

    /// The autopilot says that it flies to that latitude and longitude. While the target moves that says nothing: it still has to be
    /// told to stop.
    pub(super) fn compare(&mut self, axis: &Axis, lat_e7: i32, lon_e7: i32) {
        if self.told > 0
            && let Some(point) = axis.point(self.carrot.place)
        {
            let near = |a: i32, b: i32| a.abs_diff(b) <= TAKEN_WITHIN;
            self.is_taken = near(point.lat_e7, lat_e7) && near(point.lon_e7, lon_e7);
        }
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
        let is_told = !stands || kind == Kind::Px4 || !self.is_taken;
        if !stands {
            (self.told, self.is_taken) = (0, false);
        } else if is_told && kind == Kind::ArduCopter {
            self.told = self.told.saturating_add(1);
        }
        is_told
    }

    /// Whether it was just told once more than an autopilot needs.
    pub(super) const fn is_refused(&self) -> bool {
        self.told == REFUSED_AFTER + 1
    }
}

/// The same angle from -π to π.
pub(super) fn turned(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}
