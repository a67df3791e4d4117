//! Relay of a trial chain: its position, given the hop to it, and its backward pass.
//!
//! A lateral offset and altitude are stored in six bytes, and are limited to the relay's room. The first and the last
//! hop have a maximum SIR, and the last one a slack at Rx.
//!
//! The backward pass computes the derivatives of the slack by the position of the relay before it.

use super::hop::{Bend, Coordinate, Reach, Tangent, Triple, minus, triple};
use super::outlook::{Outlook, Policy};
use crate::mission::{Band, Interferer, Mission};
use crate::optimiser::spacing::Hop;
use crate::place::{CrossSection, Placement};
use crate::root::{bisected, sqrt};
use crate::sir::{Sender, in_noise, square};

/// Fraction of a hop's squared maximum length that the joint method uses. The unused 1e-5 is a margin for rounding
/// errors.
const RIM: f32 = 0.999_99;

/// Factor on the minimum separation in the joint method. It is a margin, so that rounding errors do not bring relays
/// closer than the mission's separation.
pub(super) const MARGIN: f32 = 1.0005;

/// Number of Newton steps in the computation of a hop with noise. Each step linearises the hop's condition at the
/// result of the previous step (see [`Tangent`]).
const TANGENTS: u8 = 3;

/// Number of bisection steps of [`Site::halved`]. This function searches along a line for the farthest
/// position at which a hop meets its target.
const HALVINGS: u8 = 12;

/// Relay to be placed by the joint method, with the sender of the hop to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Site<'a> {
    pub(super) interferer: &'a Interferer,
    /// Receiver noise divided by the interferer's power received at 1 m (nu), 1/m^2; 0 without noise.
    pub(super) noise: f32,
    pub(super) sender: Sender,
    pub(super) room: Room,
    pub(super) distance_m: f32,
    pub(super) apart_m: f32,
    pub(super) most: f32,
}

impl<'a> Site<'a> {
    /// Creates the relay to be placed, which receives from `sender`. `first` is true if this sender is Tx. `room` has
    /// the permitted lateral offsets and altitudes of the relay.
    pub(crate) fn new(
        mission: &'a Mission,
        interferer: &'a Interferer,
        sender: Sender,
        first: bool,
        room: Room,
    ) -> Self {
        let config = mission.config();
        Self {
            interferer,
            noise: mission.noise_at_a_metre(),
            sender,
            room,
            distance_m: config.distance_m,
            apart_m: if first {
                0.0
            } else {
                MARGIN * config.min_separation_m
            },
            most: if first {
                first_most(mission, interferer, room)
            } else {
                f32::INFINITY
            },
        }
    }

    /// Returns the position of largest x that meets `target` with the lateral offset and altitude `wanted`.
    ///
    /// The sender is at x = `from_m`. If the hop cannot reach the lateral offset and altitude `wanted`, the closest
    /// ones that it can reach are used. `None` if no hop meets the target. The x is at most the x of Rx.
    pub(crate) fn at(&self, target: f32, from_m: f32, wanted: CrossSection) -> Option<Placement> {
        let target = target.min(self.most);
        let at = self.within_reach(target, from_m, wanted)?;
        let place = self.stretched(target, from_m, at);
        if place.is_none() && self.noise > 0.0 {
            return self.halved(target, from_m, at);
        }
        place
    }

    /// Returns the position of largest x that meets `target` at the lateral offset and altitude `at`. `None` if there
    /// is none. The sender is at x = `from_m`.
    fn stretched(&self, target: f32, from_m: f32, at: CrossSection) -> Option<Placement> {
        let hop = Hop::free(
            self.interferer,
            self.noise,
            self.sender,
            at,
            self.distance_m,
        );
        Some(at.at(hop.stretched(target, from_m)?))
    }

    /// Returns the lateral offset and altitude closest to `wanted` at which the hop can meet `target`.
    ///
    /// The x of the hop's end must not be smaller than the x of the sender. If the hop cannot reach `wanted`, the
    /// search goes along a straight line to `wanted`. The line starts at the permitted position closest to the centre
    /// of all positions that the hop can reach. `None` if the hop reaches no permitted position. With the sender at p,
    /// the interferer at m and c = target / gain > 1 the reachable positions form a ball: its centre is p + (p - m) /
    /// (c - 1), its radius sqrt(c) |p - m| / (c - 1).
    fn within_reach(&self, target: f32, from_m: f32, wanted: CrossSection) -> Option<CrossSection> {
        let wanted = self.room.nearest(wanted);
        let Some((middle, rim)) = self.disk(target, from_m, from_m, wanted) else {
            return Some(wanted);
        };
        if wanted.apart_squared(middle) <= rim {
            return Some(wanted);
        }
        let best = self.room.nearest(middle);
        toward(best, wanted, middle, rim).map(|at| self.room.nearest(at))
    }

    /// Returns the circle of lateral offsets and altitudes at which the hop can meet `target`. The x of the hop's end
    /// is at least `x_m`. The result is the circle's centre and squared radius, m^2. `None` if c = target / gain is at
    /// most 1: the hop then reaches any lateral offset and altitude.
    fn disk(
        &self,
        target: f32,
        from_m: f32,
        x_m: f32,
        wanted: CrossSection,
    ) -> Option<(CrossSection, f32)> {
        let gain = self.sender.gain;
        let (c, e) = (gain.ratio(target), gain.excess(target));
        if !(self.noise > 0.0) {
            return self.disk_by(&Tangent::free(c, e), from_m, x_m);
        }
        let [sx, sy, _] = self.source();
        let from = self.sender.cross_section;
        let mut s = square(sx - from_m) + square(from.y_m - sy) + square(from.altitude_m);
        let mut disk = None;
        for _ in 0..TANGENTS {
            let tangent = Tangent::new(self.noise, c, e, s);
            disk = self.disk_by(&tangent, from_m, x_m);
            let (middle, rim) = disk?;
            // End of the reach in the direction of `wanted`.
            let share = sqrt(rim / wanted.apart_squared(middle).max(1e-9)).min(1.0);
            let y = middle.y_m + share * (wanted.y_m - middle.y_m);
            let h = middle.altitude_m + share * (wanted.altitude_m - middle.altitude_m);
            let x = x_m.max(from_m + (from_m - sx) / tangent.e);
            s = square(x.min(self.distance_m) - sx) + square(y - sy) + square(h);
        }
        disk
    }

    fn disk_by(&self, tangent: &Tangent, from_m: f32, x_m: f32) -> Option<(CrossSection, f32)> {
        let Tangent { c, e, spare } = *tangent;
        if !(e > 0.0) {
            return None;
        }
        let (m, from) = (self.interferer, self.sender.cross_section);
        let (ahead, aside, above) = (m.x_m - from_m, from.y_m - m.y_m, from.altitude_m);
        let squared = square(ahead) + square(aside) + square(above);
        // Distance by which the centre is before `x_m`, or beyond Rx.
        let before = e * (x_m - from_m) + ahead;
        let beyond = -(e * (self.distance_m - from_m) + ahead);
        let off = before.max(beyond).max(0.0);
        let rim = (RIM * c * squared + RIM * e * spare - square(off)) / square(e);
        let middle = CrossSection {
            y_m: from.y_m + aside / e,
            altitude_m: from.altitude_m + above / e,
        };
        Some((middle, rim))
    }

    /// Returns the position nearest to `wanted` at which the hop meets `target`, found by bisection. The bisection goes
    /// along a straight line in lateral offset and altitude, from the sender's lateral offset and altitude to `wanted`.
    fn halved(&self, target: f32, from_m: f32, wanted: CrossSection) -> Option<Placement> {
        let near = self.room.nearest(self.sender.cross_section);
        let way = |share: f32| CrossSection {
            y_m: near.y_m + share * (wanted.y_m - near.y_m),
            altitude_m: near.altitude_m + share * (wanted.altitude_m - near.altitude_m),
        };
        let mut found = self.stretched(target, from_m, near)?;
        bisected(0.0, 1.0, HALVINGS, |share: f32| {
            let place = self.stretched(target, from_m, self.room.nearest(way(share)));
            found = place.unwrap_or(found);
            place.is_some()
        });
        Some(found)
    }

    /// Returns the relay's new lateral offset and altitude after a fraction of its computed move.
    ///
    /// `policy` gives the move, and `share` the fraction. `from` is the sender's position after its move by `change`,
    /// and `nominal` the relay's position before its move. The hop has to meet `target`.
    pub(crate) fn wanted(
        &self,
        target: f32,
        from: Placement,
        nominal: Placement,
        policy: &Policy,
        share: f32,
        change: Triple,
    ) -> CrossSection {
        let target = target.min(self.most);
        let by = policy.apply(share, change);
        let [own, a, b] = policy.axis.first(triple(nominal));
        let (a, b) = (a + by[0], b + by[1]);
        match policy.axis {
            Coordinate::X => {
                let wanted = self.room.nearest(CrossSection {
                    y_m: a,
                    altitude_m: b,
                });
                // A relay right above Rx stays there.
                let there = nominal.x_m >= self.distance_m;
                let disk = || self.disk(target, from.x_m, self.distance_m, wanted);
                match there.then(disk).flatten() {
                    Some((middle, rim)) if wanted.apart_squared(middle) > rim => {
                        toward(nominal.cross_section(), wanted, middle, rim).unwrap_or(wanted)
                    }
                    _ => wanted,
                }
            }
            axis => {
                let limits = if axis == Coordinate::Y {
                    self.room.band
                } else {
                    self.room.lateral
                };
                let free = [a.max(from.x_m).min(self.distance_m), limits.nearest(b)];
                let found = self.along(policy, target, from, free);
                let [a, b] = free;
                let [_, y_m, altitude_m] = axis.back([found.unwrap_or(own), a, b]);
                CrossSection { y_m, altitude_m }
            }
        }
    }

    /// Returns the third coordinate of the relay, m, at which the hop from `from` just meets `target`.
    ///
    /// `at` are the relay's two free coordinates, m; `policy` states which two. `None` if no position with these two
    /// coordinates just meets the target.
    fn along(&self, policy: &Policy, target: f32, from: Placement, at: [f32; 2]) -> Option<f32> {
        let gain = self.sender.gain;
        let target = if gain.excess(target) > 0.0 {
            target
        } else {
            target * (2.0 - RIM)
        };
        let source = policy.axis.first(self.source());
        let from = policy.axis.first(triple(from));
        let mut tangent = Tangent::free(gain.ratio(target), gain.excess(target));
        let mut found = follows(&tangent, policy.rising, source, from, at);
        if self.noise > 0.0 {
            let [m, m1, m2] = source;
            let [a, b] = at;
            for _ in 0..TANGENTS {
                let s = square(found? - m) + square(a - m1) + square(b - m2);
                tangent = Tangent::new(self.noise, gain.ratio(target), gain.excess(target), s);
                found = follows(&tangent, policy.rising, source, from, at);
            }
        }
        found
    }

    pub(super) const fn source(&self) -> Triple {
        [self.interferer.x_m, self.interferer.y_m, 0.0]
    }
}

/// Returns the coordinate of a hop's end at which the hop just meets its target, m. The triples have this coordinate
/// first; `a` and `b` are the two known coordinates of the hop's end. If there are two solutions, `rising` selects the
/// larger solution. `None` if there is no solution.
fn follows(
    tangent: &Tangent,
    rising: bool,
    [m, m1, m2]: Triple,
    [p, p1, p2]: Triple,
    [a, b]: [f32; 2],
) -> Option<f32> {
    let Tangent { c, e, spare } = *tangent;
    let u = if rising { m - p } else { p - m };
    let rest = square(m1 - a) + square(m2 - b) - c * (square(a - p1) + square(b - p2)) + spare;
    let root = c * square(u) + e * rest;
    if !(root >= 0.0) {
        return None;
    }
    let r = sqrt(root);
    let d = if !(e > 0.0) {
        (u + r) / -e.min(-1e-6)
    } else if u >= 0.0 {
        (square(u) + rest) / (u + r)
    } else {
        (r - u) / e
    };
    Some(if rising { p + d } else { p - d })
}

/// Returns the point at which the line from `best` to `wanted` leaves a circle. `None` if its start `best` is outside
/// of the circle. All points are lateral offsets and altitudes. `middle` is the circle's centre, and `rim` its squared
/// radius, m^2.
fn toward(
    best: CrossSection,
    wanted: CrossSection,
    middle: CrossSection,
    rim: f32,
) -> Option<CrossSection> {
    // |best + share w - middle|^2 = rim
    let left = rim - best.apart_squared(middle);
    let (wy, wh) = (wanted.y_m - best.y_m, wanted.altitude_m - best.altitude_m);
    let (cy, ch) = (best.y_m - middle.y_m, best.altitude_m - middle.altitude_m);
    let (a, b) = (square(wy) + square(wh), wy * cy + wh * ch);
    if !(left >= 0.0 && a > 0.0) {
        return None;
    }
    let share = left / (b + sqrt(square(b) + a * left));
    Some(CrossSection {
        y_m: best.y_m + share * wy,
        altitude_m: best.altitude_m + share * wh,
    })
}

const LAST: f32 = 16_777_215.0;

/// Stored lateral offset and altitude of one relay. Each of the two takes three bytes, and is a fraction of its allowed
/// range.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Cell([u8; 6]);

impl Cell {
    pub(super) const NONE: Self = Self([0; 6]);

    /// Encodes the lateral offset and altitude `at` for storage, limited to `room`, the allowed ranges.
    pub(super) fn of(at: CrossSection, room: Room) -> Self {
        let [a, b, c, _] = code(at.y_m, room.lateral).to_le_bytes();
        let [d, e, f, _] = code(at.altitude_m, room.band).to_le_bytes();
        Self([a, b, c, d, e, f])
    }

    pub(super) fn place(self, room: Room) -> CrossSection {
        let Self([a, b, c, d, e, f]) = self;
        CrossSection {
            y_m: value([a, b, c, 0], room.lateral),
            altitude_m: value([d, e, f, 0], room.band),
        }
    }
}

/// Stored lateral offsets and altitudes of the relays of a chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cells<const RELAYS: usize>([Cell; RELAYS]);

impl<const RELAYS: usize> Cells<RELAYS> {
    pub(super) const NEW: Self = Self([Cell::NONE; RELAYS]);

    /// Returns the stored lateral offset and altitude of relay `index`.
    #[inline(never)] // called from many places
    pub(super) fn get(&self, index: u16) -> Cell {
        let at = usize::from(index).wrapping_sub(1);
        self.0.get(at).copied().unwrap_or_default()
    }

    pub(super) fn set(&mut self, index: u16, cell: Cell) {
        let at = usize::from(index).wrapping_sub(1);
        if let Some(kept) = self.0.get_mut(at) {
            *kept = cell;
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and LAST; the cast saturates"
)]
fn code(at: f32, band: Band) -> u32 {
    if band.is_single() {
        return 0;
    }
    ((at - band.least_m) / band.span_m() * LAST + 0.5).clamp(0.0, LAST) as u32
}

#[expect(clippy::cast_precision_loss, reason = "24 bits fit an f32")]
fn value(bytes: [u8; 4], band: Band) -> f32 {
    let code = u32::from_le_bytes(bytes) as f32;
    if code >= LAST {
        return band.most_m;
    }
    band.nearest(band.least_m + code * (band.span_m() / LAST))
}

/// Permitted lateral offsets and altitudes of a relay.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Room {
    /// Range of the permitted lateral offsets, m.
    pub lateral: Band,
    /// Range of the permitted altitudes, m.
    pub band: Band,
}

impl Room {
    /// Returns the lateral offsets and altitudes that the mission allows.
    pub const fn of(mission: &Mission) -> Self {
        let config = mission.config();
        Self {
            lateral: config.lateral,
            band: config.band,
        }
    }

    /// Returns the same lateral offsets, with `altitude_m` as the only allowed altitude.
    pub const fn at_altitude(self, altitude_m: f32) -> Self {
        Self {
            band: Band::at(altitude_m),
            ..self
        }
    }

    /// Returns the limit of the lateral offset, m, that is farther from the interferer.
    pub(super) fn away_m(self, interferer: &Interferer) -> f32 {
        let Band { least_m, most_m } = self.lateral;
        if interferer.y_m > 0.5 * (least_m + most_m) {
            least_m
        } else {
            most_m
        }
    }

    /// Returns the allowed lateral offset and altitude that are nearest to `at`.
    #[inline(never)] // called from many places
    pub const fn nearest(self, at: CrossSection) -> CrossSection {
        CrossSection {
            y_m: self.lateral.nearest(at.y_m),
            altitude_m: self.band.nearest(at.altitude_m),
        }
    }
}

/// Factor on the maximum SIR of the first or the last hop, for the upper bound of the chain's SIR. At exactly this
/// maximum, the first or the last relay could be at a single position only.
const LITTLE: f32 = 0.999_97;

/// Number of bisection steps for the position with the largest SIR of a first hop with noise.
const END_HALVINGS: u8 = 24;

/// Returns the maximum SIR of the first hop, times the factor [`LITTLE`]. `room` has the allowed lateral offsets and
/// altitudes.
///
/// The best position is on the side of Tx opposite the interferer, t times as far from Tx as the interferer. U and B
/// are the squared distances from Tx to the interferer along that direction and perpendicular to it; h is the altitude,
/// and nu the noise. With s = B + (1 + t)^2 U + h^2 the slope of the SIR has the sign of h^2 - t (B + U) - t^2 U - nu t
/// s^2, which falls with t. So with noise there is one optimum, closer to Tx.
pub(super) fn first_most(mission: &Mission, interferer: &Interferer, room: Room) -> f32 {
    let m = interferer;
    let squared = square(room.band.least_m);
    let behind = m.x_m.min(0.0);
    let sum = square(m.x_m) + square(m.y_m) + 2.0 * squared;
    let across = square(m.x_m - behind) + squared;
    let most = (sum + sqrt((square(sum) - 4.0 * squared * across).max(0.0))) / (2.0 * squared);
    let mut far = -1.0 / (most - 1.0).max(1e-6);
    let noise = mission.noise_at_a_metre();
    if noise > 0.0 {
        let along = square(behind) + square(m.y_m);
        let rises = |t: f32| {
            let s = across + square(1.0 + t) * along;
            squared - t * (across - squared + along) - square(t) * along > noise * t * s * s
        };
        far = -bisected(0.0, -far, END_HALVINGS, rises).0;
    }
    let at = room.nearest(CrossSection {
        y_m: far * m.y_m,
        altitude_m: 0.0,
    });
    let at = at.at((far * behind).min(mission.config().distance_m));
    LITTLE * Sender::transmitter(mission).sir_at(mission, 0.0, at)
}

/// Returns the maximum SIR of the hop to Rx from a relay of `power_w` watts, times [`LITTLE`]. `room` has the permitted
/// lateral offsets and altitudes of the relay.
pub(super) fn last_most(mission: &Mission, power_w: f32, room: Room) -> f32 {
    let across = room
        .nearest(CrossSection::default())
        .apart_squared(CrossSection::default());
    LITTLE * mission.receiver_gain(power_w) / across
}

/// Weight of the penalty for a hop that is shorter than the minimum separation of two relays. The unit is the distance
/// from Tx to Rx. The weight is so large that such a hop never improves a chain.
const STIFFNESS: f32 = 100.0;

/// Maximum distance from a limit of a coordinate at which a relay counts as being at this limit. The unit is the
/// distance from Tx to Rx.
const EDGE: f32 = 2e-6;

/// Relative margin to its target, up to which a hop that ends at the x of Rx has maximum length. A hop with a larger
/// margin counts as shorter than its maximum, and does not restrict the move of its receiver.
const TIGHT: f32 = 1e-3;

impl Site<'_> {
    /// Returns the penalty terms of a relay at `to` that may be too near the interferer.
    ///
    /// The first number is the squared minimum distance minus the squared actual distance, m^2; 0 if the relay is far
    /// enough away. The second is the weight of the penalty. The third is the derivative of the first by ln(target
    /// SIR).
    ///
    /// `c` is the target SIR divided by the sender's gain. A hop of maximum length from p to p' that ends near the
    /// interferer at m is short. It violates the minimum separation d_min if |p' - p|^2 = q(|p' - m|^2) / c < d_min^2,
    /// with the inverse q of interference plus noise. With the noise nu that is so if |p' - m|^2 < L / (1 - nu L) for L
    /// = c d_min^2.
    fn near(&self, c: f32, to: Placement) -> (f32, f32, f32) {
        if !(self.apart_m > 0.0) {
            return (0.0, 0.0, 0.0);
        }
        let m = self.interferer;
        let quiet = c * square(self.apart_m);
        // If noise alone prevents such a hop, no distance is sufficient; 1000 L is used then.
        let left = (1.0 - self.noise * quiet).max(1e-3);
        let least = quiet / left;
        let squared = square(m.x_m - to.x_m) + square(m.y_m - to.y_m) + square(to.altitude_m);
        let weight = STIFFNESS * self.distance_m / square(least);
        ((least - squared).max(0.0), weight, least / left)
    }

    /// Returns the penalty for a relay at `to` too near the interferer, m; 0 if it is far enough away. The penalty is
    /// subtracted from the chain's slack, the length by which the chain overshoots Rx.
    pub(crate) fn penalty(&self, target: f32, to: Placement) -> f32 {
        let (near, weight, _) = self.near(self.sender.gain.ratio(target), to);
        0.5 * weight * square(near)
    }

    /// Computes the policy (the move) of the relay at `to`, and the value function of its sender at `from`.
    ///
    /// `outlook` is the value function of the relay, and becomes the value function of the sender. The move is
    /// limited to `trust` times the relay's distance from the interferer. Work: some 400 multiplications and two
    /// square roots.
    pub(crate) fn weigh(
        &self,
        target: f32,
        trust: f32,
        from: Placement,
        to: Placement,
        outlook: &mut Outlook,
    ) -> Policy {
        let capped = target > self.most;
        let c = self.sender.gain.ratio(target.min(self.most));
        let source = self.source();
        let place = triple(to);
        let (near, weight, by_target) = self.near(c, to);
        let [dx, dy, dh] = minus(source, place);
        if near > 0.0 {
            let slope = [2.0 * dx, 2.0 * dy, 2.0 * dh];
            outlook.penalise(weight, near, slope, by_target);
        }
        let Room { lateral, band } = self.room;
        let low = [from.x_m, lateral.least_m, band.least_m];
        let high = [self.distance_m, lateral.most_m, band.most_m];
        let (low, high) = (minus(low, place), minus(high, place));
        let at_end = to.x_m >= self.distance_m - EDGE * self.distance_m;
        let [hx, hy, hh] = minus(place, triple(from));
        let reached = c * (square(hx) + square(hy) + square(hh));
        let heard = square(dx) + square(dy) + square(dh);
        let spare = in_noise(heard, self.noise) - reached;
        let loose = at_end && spare > TIGHT * reached;
        let (axis, normal) = if loose {
            (Coordinate::X, 0.0)
        } else {
            self.axis(c, from, to, low, high)
        };
        let hop = if at_end && axis == Coordinate::X {
            Reach::FIXED
        } else {
            let [source, from, place] = [source, triple(from), place].map(|p| axis.first(p));
            let hop = Reach::new(c, self.noise, source, from, place);
            Reach {
                by_target: if capped { 0.0 } else { hop.by_target },
                ..hop
            }
        };
        let far = trust * sqrt(heard);
        let [_, l1, l2] = axis.first(low.map(|low| low.max(-far).min(0.0)));
        let [_, h1, h2] = axis.first(high.map(|high| high.min(far).max(0.0)));
        let policy = outlook.pass(axis, &hop, [l1, l2], [h1, h2]);
        Policy {
            rising: (normal < 0.0) == (c > 1.0),
            ..policy
        }
    }

    /// Selects the coordinate of the hop's end that is computed from the other two.
    ///
    /// It is the coordinate with the largest derivative of F among those that are not at a limit; x is preferred. `low`
    /// and `high` are the limits minus the coordinates of the hop's end, m. F is half the margin of the hop to its
    /// target: 0 for a hop of maximum length (see `hop`). The second result is the derivative of F by the selected
    /// coordinate.
    fn axis(
        &self,
        c: f32,
        from: Placement,
        to: Placement,
        low: Triple,
        high: Triple,
    ) -> (Coordinate, f32) {
        let rounding = EDGE * self.distance_m;
        let [dx, dy, dh] = minus(triple(to), self.source());
        let [hx, hy, hh] = minus(triple(to), triple(from));
        let Bend { q, .. } = Bend::new(self.noise, square(dx) + square(dy) + square(dh));
        let [nx, ny, nh] = [q * dx - c * hx, q * dy - c * hy, q * dh - c * hh];
        let ([lx, ly, lh], [ux, uy, uh]) = (low, high);
        let mut best = (Coordinate::X, nx);
        // x is preferred, since it moves the chain forward.
        let mut steepest = if lx >= -rounding || ux <= rounding {
            0.0
        } else {
            1.5 * nx.abs()
        };
        for (axis, normal, low, high) in [(Coordinate::Y, ny, ly, uy), (Coordinate::H, nh, lh, uh)]
        {
            // For c <= 1 the points out of reach form a ball; a relay at its foot may rise from there.
            let rises = c <= 1.0 && ux <= rounding;
            let free = (low < -rounding || rises) && high > rounding;
            if (c > 1.0 || rises) && free && normal.abs() > steepest {
                steepest = normal.abs();
                best = (axis, normal);
            }
        }
        best
    }
}
