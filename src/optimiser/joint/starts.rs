//! Initial chains of the ascents. They pass the interferer low, in an arch over it, on either side, or beyond it.
//!
//! A chain is a shortest path in a metric in which a metre weighs more near the interferer. So there is a local optimum
//! on each side of the interferer. The best one depends on the room, the power and the number of relays; all are tried.
//!
//! An ascent starts at the highest target that its unchanged chain meets.

use super::hop::{Triple, minus, triple};
use super::site::Room;
use crate::mission::Interferer;
use crate::place::{CrossSection, Placement};
use crate::root::sqrt;
use crate::sir::square;

#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Start {
    /// Initial chain on a parabola from Tx to Rx. `aside` and `up` are the lateral offset and the height of the
    /// parabola's middle, in units of half the distance from Tx to Rx.
    Arch { aside: f32, up: f32 },
    /// Initial chain on a spiral about the interferer. The spiral leads from Tx to Rx through a position P exactly
    /// above or beside the interferer.
    ///
    /// `aside` and `up` are the direction from the interferer to P. `far` is the distance of P from the interferer,
    /// divided by the geometric mean of the distances of Tx and Rx from the interferer.
    Around { aside: f32, up: f32, far: f32 },
    /// Initial chain on a parabola as for `Arch`, with the same fields, but without a minimum separation. The solver
    /// then searches the highest target of this chain, with the hops computed exactly as in flight. A relay is allowed
    /// to stay closer to Tx than the largest x at which its hop meets the target.
    Through { aside: f32, up: f32 },
    /// Initial chain for a mission in which some relays have a fixed altitude. Seen from above, the chain is a
    /// parabola; `aside` is the lateral offset of its middle, in units of half the distance from Tx to Rx. The
    /// altitudes of all other relays are interpolated between the fixed altitudes.
    ///
    /// If `level` is true, the altitude stays constant from the outermost fixed relay to Tx or Rx. If it is false,
    /// the altitude falls to the lowest permitted altitude at Tx and at Rx.
    FixedAltitudes { aside: f32, level: bool },
    /// Initial chain in a zigzag, for relays that do not fit between Tx and Rx in one line.
    ///
    /// The permitted lateral offsets and altitudes form a rectangle. Every second relay is in one corner of it, and the
    /// relays between are beside this corner, at the minimum separation. The corner is at the highest altitude, on the
    /// side of the line Tx-Rx opposite the interferer.
    Turns,
    /// Initial chain at the lowest altitude, for a target just above `Chain::floor`, the lowest target. Used only if no
    /// earlier initial chain has led to a higher target.
    Near,
    /// Initial chain with relay 1 at the x of Rx, high above Rx or beside Rx at the largest lateral offset. From relay
    /// to relay, the lateral offset and the altitude change in equal steps. The last relay has the lateral offset 0 and
    /// the lowest altitude.
    Far,
}

/// Parabolas that are tried as initial chains: `aside` and `up` of each, as in [`Start::Arch`].
const ARCHES: [(f32, f32); 7] = [
    (0.0, 0.0),
    (0.0, 1.0),
    (0.0, 0.25),
    (-1.0, 0.0),
    (1.0, 0.0),
    (-0.25, 0.0),
    (0.25, 0.0),
];

/// Number of parabolas, from the start of [`ARCHES`], that are also tried as [`Start::Through`].
const THROUGH: usize = 3;

/// Initial chains for missions with fixed altitudes; the fields are those of [`Start::FixedAltitudes`].
const HELD: [(f32, bool); 6] = [
    (0.0, true),
    (0.0, false),
    (-1.0, true),
    (1.0, true),
    (-0.25, true),
    (0.25, true),
];

/// Spiral initial chains: `aside`, `up` and `far` of each, as in [`Start::Around`].
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

/// Logarithmic spiral about the interferer: ln(distance from it) changes linearly with the angle.
struct Way {
    to: Triple,
    angle: f32,
    /// Logarithm of the distance from the interferer at the spiral's end, minus that at its start.
    rise: f32,
    length: f32,
}

impl Way {
    fn new(here: Triple, to: Triple) -> Self {
        let (r, t) = (length(here), length(to));
        let (here, to) = (here.map(|v| v / r), to.map(|v| v / t));
        let chord = square(length(minus(here, to)));
        // 2 asin(chord / 2) / chord
        let angle = sqrt(chord) * (1.0 + chord * (1.0 / 24.0 + chord * (3.0 / 640.0)));
        let rise = libm::logf(t / r);
        let length = sqrt(square(angle) + square(rise)).max(SHORTEST);
        Self {
            to,
            angle,
            rise,
            length,
        }
    }

    /// Returns the end of a hop along the spiral from `here`; both points are relative to the interferer. The hop's
    /// length is `step` times the distance of its end from the interferer.
    fn after(&self, here: Triple, step: f32) -> Triple {
        let bend = 0.5 * step * self.rise / self.length;
        let share = (step * libm::expf(bend.clamp(-1.0, 1.0)) / self.length).min(1.0);
        let r = length(here);
        let unit = here.map(|v| v / r);
        let cos: f32 = unit.iter().zip(self.to).map(|(a, b)| a * b).sum();
        let aside = minus(self.to, unit.map(|v| cos * v));
        let turn = (share * self.angle).min(MOST_TURN) / length(aside).max(SHORTEST);
        let direction = minus(unit, aside.map(|v| -turn * v));
        let scale = r * libm::expf(share * self.rise) / length(direction);
        direction.map(|v| scale * v)
    }
}

/// Minimum divisor in the computation of a spiral, which prevents a division by 0.
const SHORTEST: f32 = 1e-6;

/// Maximum tangent of the angle by which one hop of a spiral turns about the interferer.
const MOST_TURN: f32 = 1.5;

fn length([x, y, z]: Triple) -> f32 {
    sqrt(square(x) + square(y) + square(z)).max(f32::MIN_POSITIVE)
}

impl Start {
    /// Returns the lateral offset and altitude of a relay on a spiral about the interferer.
    ///
    /// The hop to this relay comes from `from`. `c` is the target SIR divided by the sender's gain; it determines the
    /// length of the hop. `room` has the permitted ranges.
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
        let here = minus(triple(from), m);
        let end = minus([distance_m, 0.0, 0.0], m);
        let between = far * sqrt(length(end) * length(m));
        let middle = [0.0, aside * between, up * between];
        let step = 1.0 / sqrt(c);
        let [before, ..] = here;
        let mut way = Way::new(here, end);
        if before < 0.0 && interferer.x_m < distance_m {
            let first = Way::new(here, middle);
            if first.length > step {
                way = first;
            }
        }
        let [_, y, h] = way.after(here, step);
        room.nearest(CrossSection {
            y_m: interferer.y_m + y,
            altitude_m: h,
        })
    }

    /// Returns the lateral offset and altitude of relay `index` in a zigzag chain. Neighbours differ by `apart_m` in
    /// the lateral offset; `room` has the allowed ranges.
    pub(super) fn in_turn(
        index: u16,
        interferer: &Interferer,
        room: Room,
        apart_m: f32,
    ) -> CrossSection {
        let Room { lateral, band } = room;
        let left =
            (interferer.y_m - lateral.least_m).abs() > (interferer.y_m - lateral.most_m).abs();
        let off = if index.is_multiple_of(2) {
            0.0
        } else {
            apart_m
        };
        room.nearest(CrossSection {
            y_m: if left {
                lateral.least_m + off
            } else {
                lateral.most_m - off
            },
            altitude_m: band.most_m,
        })
    }

    /// Returns the initial chain `number`; `room` has the permitted lateral offsets and altitudes. `None` if there is
    /// no chain with this number; `Some(None)` if the chain does not fit into `room`.
    #[expect(
        clippy::option_option,
        reason = "past the end, of no use, and a start are three things"
    )]
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
            2 => Some((!lateral.is_single()).then_some(Self::Turns)),
            past => {
                let past = past - 3;
                if let Some(&(aside, up)) = ARCHES.get(past).filter(|_| past < THROUGH) {
                    return Some(fits((aside, up)).then_some(Self::Through { aside, up }));
                }
                let &(aside, level) = HELD.get(past - THROUGH)?;
                Some(fits((aside, 0.0)).then_some(Self::FixedAltitudes { aside, level }))
            }
        }
    }

    /// Returns the lateral offset and altitude of a relay in this initial chain. The previous relay is at x = `x_m`;
    /// `distance_m` is the distance from Tx to Rx, and `room` has the allowed ranges.
    pub(super) fn across(self, distance_m: f32, x_m: f32, room: Room) -> CrossSection {
        let (aside, up) = match self {
            Self::Arch { aside, up } | Self::Through { aside, up } => (aside, up),
            Self::FixedAltitudes { aside, .. } => (aside, 0.0),
            Self::Near | Self::Far | Self::Turns | Self::Around { .. } => (0.0, 0.0),
        };
        let t = (x_m / distance_m).clamp(0.0, 1.0);
        let rise = 2.0 * distance_m * t * (1.0 - t);
        room.nearest(CrossSection {
            y_m: aside * rise,
            altitude_m: up * rise,
        })
    }
}

/// Bisection for the highest feasible target SIR of a chain, in ln(SIR).
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Seek {
    /// Highest target found feasible, in ln(SIR); `None` until a target is found. The `bool` is true if some relays
    /// must stay closer to Tx than the largest x at which their hops meet this target.
    low: Option<(f32, bool)>,
    high: Option<f32>,
    pub(super) sigma: f32,
    step: f32,
    growth: f32,
    width: f32,
}

impl Seek {
    /// Creates a search downward from the target `sigma`, in ln(SIR), to the precision `width`. The first step is
    /// `step`; each further step is `growth` times the previous one.
    pub(super) const fn down(sigma: f32, step: f32, growth: f32, width: f32) -> Self {
        Self {
            low: None,
            high: None,
            sigma,
            step,
            growth,
            width,
        }
    }

    /// Creates a search upward from the feasible target `sigma`, in ln(SIR), to the precision `width`. The first step
    /// is `step`; each further step is three times the previous one. `holds_back` is true if some relays must stay
    /// closer to Tx than the largest x at which their hops meet `sigma`.
    pub(super) const fn up(sigma: f32, holds_back: bool, step: f32, width: f32) -> Self {
        Self {
            low: Some((sigma, holds_back)),
            high: None,
            sigma: sigma + step,
            step,
            growth: 3.0,
            width,
        }
    }

    /// Records if the chain meets the target that was tried. Returns true if there is a further target to try.
    ///
    /// `met` is `None` if the target is infeasible. Otherwise `met` is true if some relays must stay closer to Tx than
    /// the largest x at which their hops meet the target.
    pub(super) fn tried(&mut self, met: Option<bool>) -> bool {
        match met {
            Some(holds_back) => self.low = Some((self.sigma, holds_back)),
            None => self.high = Some(self.sigma),
        }
        self.sigma = match (self.low, self.high) {
            (Some((low, _)), Some(high)) => {
                let middle = 0.5 * (low + high);
                if high - low <= self.width || middle <= low || middle >= high {
                    return false;
                }
                middle
            }
            (low, _) => {
                let step = if low.is_some() { self.step } else { -self.step };
                self.step *= self.growth;
                if self.step > MOST_STEP {
                    return false;
                }
                self.sigma + step
            }
        };
        true
    }

    /// Returns the highest feasible target found, in ln(SIR); `None` if no target is feasible. The `bool` is true if
    /// some relays must stay closer to Tx than the largest x at which their hops meet this target.
    pub(super) const fn found(&self) -> Option<(f32, bool)> {
        self.low
    }
}

/// Maximum step between two targets, in ln(SIR). The search ends when the next step would be longer.
const MOST_STEP: f32 = 40.0;
