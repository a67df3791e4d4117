//! Where an ascent begins: chains that pass the interferer low, in an arch over it, beside it on either hand, or beyond it.
//!
//! The chain is a shortest way in a metric in which a metre near the interferer counts for more, and there is a locally shortest way on
//! each side of it. Which of them is the best depends on the room, on the power and on the number of relays; each is tried.

use crate::mission::Interferer;
use crate::root::sqrt;
use crate::sir::{CrossSection, Placement, square};

use super::axis::Triple;
use super::link::{Room, minus, triple};

/// One of them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Start {
    /// A parabola over the line: so much to the side and upward in the middle, in halves of D.
    Arch { aside: f32, up: f32 },
    /// A spiral about the interferer: toward a place right above it or beside it, and from there to Rx.
    Around { aside: f32, up: f32, far: f32 },
    /// Low, from a target so high that no hop leaps to the far side of the interferer.
    Near,
    /// Relay 1 right above Rx, as high or far aside as pays, the others on the way down from there.
    Far,
}

/// The shapes of arches: aside, up.
const ARCHES: [(f32, f32); 7] = [
    (0.0, 0.0),
    (0.0, 1.0),
    (0.0, 0.25),
    (-1.0, 0.0),
    (1.0, 0.0),
    (-0.25, 0.0),
    (0.25, 0.0),
];

/// Spirals.
const SPIRALS: [(f32, f32, f32); 9] = [
    (0.0, 1.0, 1.0),
    (1.0, 0.0, 1.0),
    (-1.0, 0.0, 1.0),
    (0.7, 0.7, 1.0),
    (-0.7, 0.7, 1.0),
    (0.0, 1.0, 0.3),
    (1.0, 0.0, 0.3),
    (-1.0, 0.0, 0.3),
    (0.0, 1.0, 2.0),
];

impl Start {
    /// Where a relay flies across the line that comes after one at `from`, by a spiral.
    pub(super) fn around(
        self,
        distance_m: f32,
        interferer: &Interferer,
        from: Placement,
        c: f32,
        room: Room,
    ) -> CrossSection {
        let Self::Around { aside, up, far } = self else {
            return room.nearest(from.cross_section());
        };
        let m = [interferer.x_m, interferer.y_m, 0.0];
        let length =
            |[x, y, z]: Triple| sqrt(square(x) + square(y) + square(z)).max(1e-9 * distance_m);
        let here = minus(triple(from), m);
        let end = minus([distance_m, 0.0, 0.0], m);
        let r = length(here);
        let step = 1.0 / sqrt(c);
        let toward = |to: Triple| {
            let t = length(to);
            let [dx, dy, dz] = minus(here.map(|v| v / r), to.map(|v| v / t));
            let chord = square(dx) + square(dy) + square(dz);
            let angle = sqrt(chord) * (1.0 + chord * (1.0 / 24.0 + chord * (3.0 / 640.0)));
            let rise = libm::logf(t / r);
            (angle, rise, sqrt(square(angle) + square(rise)))
        };
        let between = far * sqrt(length(end) * length([m[0], m[1], 0.0]));
        let middle = [0.0, aside * between, up * between];
        let (mut to, mut way) = (end, toward(end));
        if here[0] < 0.0 && m[0] < distance_m {
            let via = toward(middle);
            if via.2 > step {
                (to, way) = (middle, via);
            }
        }
        let (angle, rise, whole) = way;
        let step =
            (step * libm::expf((0.5 * step * rise / whole.max(1e-6)).clamp(-1.0, 1.0))).min(whole);
        let share = step / whole.max(1e-6);
        let (turn, grow) = ((share * angle).min(1.5), libm::expf(share * rise));
        // e: across, of length one.
        let t = length(to);
        let u = here.map(|v| v / r);
        let v = to.map(|v| v / t);
        let cos = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
        let e = [v[0] - cos * u[0], v[1] - cos * u[1], v[2] - cos * u[2]];
        let sin = length(e).max(1e-6);
        let d = [
            u[0] + turn * e[0] / sin,
            u[1] + turn * e[1] / sin,
            u[2] + turn * e[2] / sin,
        ];
        let norm = length(d);
        room.nearest(CrossSection {
            y_m: m[1] + r * grow * d[1] / norm,
            altitude_m: r * grow * d[2] / norm,
        })
    }

    /// Start `number` for relays with that `room`; `None` after the last, `Some(None)` where it is no use.
    pub(super) fn number(number: u8, room: Room) -> Option<Option<Self>> {
        let Room { lateral, band } = room;
        let fits = |(aside, up): (f32, f32)| {
            let sideways = if aside < 0.0 {
                lateral.least_m < 0.0
            } else if aside > 0.0 {
                lateral.most_m > 0.0
            } else {
                true
            };
            sideways && (!(up > 0.0) || !band.is_single())
        };
        let free = !(band.is_single() && lateral.is_single());
        let number = usize::from(number);
        if let Some(&(aside, up)) = ARCHES.get(number) {
            return Some(fits((aside, up)).then_some(Self::Arch { aside, up }));
        }
        let number = number.checked_sub(ARCHES.len())?;
        if let Some(&(aside, up, far)) = SPIRALS.get(number) {
            let fits = free && fits((aside, up));
            return Some(fits.then_some(Self::Around { aside, up, far }));
        }
        match number.checked_sub(SPIRALS.len())? {
            0 => Some(free.then_some(Self::Far)),
            1 => Some(free.then_some(Self::Near)),
            _ => None,
        }
    }

    /// Where a relay flies across the line that comes after one at `x_m`, of a chain `distance_m` long.
    pub(super) fn across(self, distance_m: f32, x_m: f32, room: Room) -> CrossSection {
        let (aside, up) = match self {
            Self::Arch { aside, up } => (aside, up),
            Self::Near | Self::Far | Self::Around { .. } => (0.0, 0.0),
        };
        let t = (x_m / distance_m).clamp(0.0, 1.0);
        let rise = 2.0 * distance_m * t * (1.0 - t);
        room.nearest(CrossSection {
            y_m: aside * rise,
            altitude_m: up * rise,
        })
    }
}
