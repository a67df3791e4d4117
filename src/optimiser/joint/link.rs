//! One relay of a chain under trial, with the hop into it: where it goes, and what that is worth to the relay before.

use super::axis::{Coordinate, Triple};
use super::hop::Reach;
use super::outlook::Outlook;
use super::policy::Policy;
use crate::mission::{Band, Interferer, Mission};
use crate::optimiser::spacing::Hop;
use crate::place::{CrossSection, Placement};
use crate::root::sqrt;
use crate::sir::{Sender, square};

/// Where a relay may fly across the line.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Room {
    /// Distances to the side, m.
    pub lateral: Band,
    /// Altitudes, m.
    pub band: Band,
}

impl Room {
    /// All that the mission leaves.
    pub const fn of(mission: &Mission) -> Self {
        let config = mission.config();
        Self {
            lateral: config.lateral,
            band: config.band,
        }
    }

    /// The same for a relay that keeps to one altitude.
    pub const fn at_altitude(self, altitude_m: f32) -> Self {
        Self {
            band: Band::at(altitude_m),
            ..self
        }
    }

    /// What of it is nearest to `at`.
    pub const fn nearest(self, at: CrossSection) -> CrossSection {
        CrossSection {
            y_m: self.lateral.nearest(at.y_m),
            altitude_m: self.band.nearest(at.altitude_m),
        }
    }
}

/// How near the rim of what a hop reaches a relay goes, in squares.
const RIM: f32 = 0.999_99;

/// What one part of the least separation that is missing costs, in parts of D: a slope that no gain of slack outweighs.
const STIFFNESS: f32 = 100.0;

/// The least separation is taken for that much larger, so that what is left missing is none.
pub(super) const MARGIN: f32 = 1.0005;

/// A relay, as its place is chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Site<'a> {
    interferer: &'a Interferer,
    sender: Sender,
    room: Room,
    distance_m: f32,
    /// The least distance to the sender, m.
    apart_m: f32,
    /// No hop meets more.
    most: f32,
}

impl<'a> Site<'a> {
    /// The relay that `sender` feeds and `room` is left to; `first` if that is Tx, from which it may stand as near as it likes.
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

    /// The same as near to its sender as it likes, too.
    pub(crate) fn unparted(self) -> Self {
        Self {
            apart_m: 0.0,
            ..self
        }
    }

    /// The place at `wanted`, or as far toward it as the hop goes, for `target`, with the sender at `from_m` along x; `None` where no
    /// hop meets it. Beyond Rx nobody goes.
    pub(crate) fn at(&self, target: f32, from_m: f32, wanted: CrossSection) -> Option<Placement> {
        let target = target.min(self.most);
        let at = self.within_reach(target, from_m, wanted)?;
        let hop = Hop::free(self.interferer, self.sender, at, self.distance_m);
        Some(at.at(hop.stretched(target, from_m)?))
    }

    /// `wanted`, or what of the room lies on the way there, from where a hop gets on best, and is reached without going back along x;
    /// `None` where there is none.
    ///
    /// What a hop reaches for c > 1 is a ball: its middle is (p - m) / (c - 1) beyond the sender's place p, its radius sqrt(c) |p - m| /
    /// (c - 1).
    fn within_reach(&self, target: f32, from_m: f32, wanted: CrossSection) -> Option<CrossSection> {
        let wanted = self.room.nearest(wanted);
        let Some((middle, rim)) = self.disk(target, from_m, from_m) else {
            return Some(wanted);
        };
        if wanted.apart_squared(middle) <= rim {
            return Some(wanted);
        }
        let best = self.room.nearest(middle);
        toward(best, wanted, middle, rim).map(|at| self.room.nearest(at))
    }

    /// The middle and the squared radius of what a hop reaches for c > 1 at `x_m` or beyond.
    fn disk(&self, target: f32, from_m: f32, x_m: f32) -> Option<(CrossSection, f32)> {
        let Sender { at: from, gain } = self.sender;
        let e = gain.excess(target);
        if !(e > 0.0) {
            return None;
        }
        let m = self.interferer;
        let (ahead, aside, above) = (m.x_m - from_m, from.y_m - m.y_m, from.altitude_m);
        let squared = square(ahead) + square(aside) + square(above);
        // By how much the middle is before that, or beyond Rx.
        let before = e * (x_m - from_m) + ahead;
        let beyond = -(e * (self.distance_m - from_m) + ahead);
        let off = before.max(beyond).max(0.0);
        let rim = (RIM * gain.ratio(target) * squared - square(off)) / square(e);
        let middle = CrossSection {
            y_m: from.y_m + aside / e,
            altitude_m: from.altitude_m + above / e,
        };
        Some((middle, rim))
    }

    /// Where the relay goes across the line for `share` of its `policy`, when the sender is at `from` instead of `change` before that.
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
        let [_, a, b] = policy.axis.first(triple(nominal));
        let (a, b) = (a + by[0], b + by[1]);
        match policy.axis {
            Coordinate::X => {
                let wanted = self.room.nearest(CrossSection {
                    y_m: a,
                    altitude_m: b,
                });
                // What was right above Rx stays there.
                let there = nominal.x_m >= self.distance_m;
                let disk = self.disk(target, from.x_m, self.distance_m);
                match disk.filter(|_| there) {
                    Some((middle, rim)) if wanted.apart_squared(middle) > rim => {
                        toward(nominal.cross_section(), wanted, middle, rim).unwrap_or(wanted)
                    }
                    _ => wanted,
                }
            }
            Coordinate::Y => {
                let b = self.room.band.nearest(b);
                let y = self.along(
                    policy,
                    target,
                    from,
                    [a.max(from.x_m).min(self.distance_m), b],
                );
                CrossSection {
                    y_m: y.unwrap_or(nominal.y_m),
                    altitude_m: b,
                }
            }
            Coordinate::H => {
                let b = self.room.lateral.nearest(b);
                let h = self.along(
                    policy,
                    target,
                    from,
                    [a.max(from.x_m).min(self.distance_m), b],
                );
                CrossSection {
                    y_m: b,
                    altitude_m: h.unwrap_or(nominal.altitude_m),
                }
            }
        }
    }

    /// The coordinate that follows from the other two, `at`, by the hop `from` the sender.
    fn along(&self, policy: &Policy, target: f32, from: Placement, at: [f32; 2]) -> Option<f32> {
        let gain = self.sender.gain;
        let target = if gain.excess(target) > 0.0 {
            target
        } else {
            target * (2.0 - RIM)
        };
        let (e, c) = (gain.excess(target), gain.ratio(target));
        let [m, m1, m2] = policy.axis.first(self.source());
        let [p, p1, p2] = policy.axis.first(triple(from));
        let [a, b] = at;
        let u = if policy.rising { m - p } else { p - m };
        let rest = square(m1 - a) + square(m2 - b) - c * (square(a - p1) + square(b - p2));
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
        Some(if policy.rising { p + d } else { p - d })
    }

    const fn source(&self) -> Triple {
        [self.interferer.x_m, self.interferer.y_m, 0.0]
    }

    /// By how much the relay at `to` is nearer to the interferer than a hop of the least separation allows, in squares, m^2, and the
    /// weight of that: |p' - p|^2 = |p' - m|^2 / c is then less than d_min^2.
    fn near(&self, c: f32, to: Placement) -> (f32, f32) {
        if !(self.apart_m > 0.0) {
            return (0.0, 0.0);
        }
        let m = self.interferer;
        let least = c * square(self.apart_m);
        let squared = square(m.x_m - to.x_m) + square(m.y_m - to.y_m) + square(to.altitude_m);
        let weight = STIFFNESS * self.distance_m / square(least);
        ((least - squared).max(0.0), weight)
    }

    /// What the relay at `to` takes off the slack for being there, m.
    pub(crate) fn penalty(&self, target: f32, to: Placement) -> f32 {
        let (near, weight) = self.near(self.sender.gain.ratio(target), to);
        0.5 * weight * square(near)
    }

    /// The policy of the relay at `to`, which moves by up to `trust` of its distance from the interferer. `outlook` is what it sees,
    /// and becomes what the relay before, at `from`, sees of the slack through it.
    ///
    /// Work: some 400 multiplications and two square roots.
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
        let (near, weight) = self.near(c, to);
        let [dx, dy, dh] = minus(source, place);
        if near > 0.0 {
            let slope = [2.0 * dx, 2.0 * dy, 2.0 * dh];
            outlook.penalise(weight, near, slope, c * square(self.apart_m));
        }
        let Room { lateral, band } = self.room;
        let low = [from.x_m, lateral.least_m, band.least_m];
        let high = [self.distance_m, lateral.most_m, band.most_m];
        let (low, high) = (minus(low, place), minus(high, place));
        let at_end = to.x_m >= self.distance_m - EDGE * self.distance_m;
        let [hx, hy, hh] = minus(place, triple(from));
        let reached = c * (square(hx) + square(hy) + square(hh));
        let spare = square(dx) + square(dy) + square(dh) - reached;
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
            let hop = Reach::new(c, source, from, place);
            Reach {
                by_target: if capped { 0.0 } else { hop.by_target },
                ..hop
            }
        };
        let far = trust * sqrt(square(dx) + square(dy) + square(dh));
        let [_, l1, l2] = axis.first(low.map(|low| low.max(-far).min(0.0)));
        let [_, h1, h2] = axis.first(high.map(|high| high.min(far).max(0.0)));
        let policy = outlook.pass(axis, &hop, [l1, l2], [h1, h2]);
        Policy {
            rising: (normal < 0.0) == (c > 1.0),
            ..policy
        }
    }

    /// The coordinate that is to follow, one that is not at an end of its room `low` to `high`, and the slope of F by it: the steeper,
    /// the better.
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
        let [nx, ny, nh] = [dx - c * hx, dy - c * hy, dh - c * hh];
        let ([lx, ly, lh], [ux, uy, uh]) = (low, high);
        let mut best = (Coordinate::X, nx);
        // Rather x, by which the chain gets on.
        let mut steepest = if lx >= -rounding || ux <= rounding {
            0.0
        } else {
            1.5 * nx.abs()
        };
        for (axis, normal, low, high) in [(Coordinate::Y, ny, ly, uy), (Coordinate::H, nh, lh, uh)]
        {
            // What a leap does not reach is within a ball, and a relay at its foot may rise from there.
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

/// The most that a first hop into `room` meets, but for a little that leaves the relay its choice.
pub(super) fn first_most(mission: &Mission, interferer: &Interferer, room: Room) -> f32 {
    let m = interferer;
    let squared = square(room.band.least_m);
    let behind = m.x_m.min(0.0);
    let sum = square(m.x_m) + square(m.y_m) + 2.0 * squared;
    let across = square(m.x_m - behind) + squared;
    let most = (sum + sqrt((square(sum) - 4.0 * squared * across).max(0.0))) / (2.0 * squared);
    let far = -1.0 / (most - 1.0).max(1e-6);
    let at = room.nearest(CrossSection {
        y_m: far * m.y_m,
        altitude_m: 0.0,
    });
    let at = at.at((far * behind).min(mission.config().distance_m));
    LITTLE * Sender::transmitter(mission).sir_at(mission, 0.0, at)
}

/// The most that the hop from a relay of `power_w` in `room` to Rx meets, but for a little.
pub(super) fn last_most(mission: &Mission, power_w: f32, room: Room) -> f32 {
    let across = room
        .nearest(CrossSection::default())
        .apart_squared(CrossSection::default());
    LITTLE * mission.receiver_gain(power_w) / across
}

/// The slack of a last relay of `power_w` in `room`, which is `at`, for `target`, and its outlook.
pub(super) fn tail(
    mission: &Mission,
    power_w: f32,
    room: Room,
    target: f32,
    at: Placement,
) -> (f32, Outlook) {
    let most = last_most(mission, power_w, room);
    let reach_m = sqrt(mission.receiver_gain(power_w) / target.min(most));
    let (slack, outlook) = Outlook::tail(reach_m, mission.config().distance_m, at);
    if target > most {
        return (
            slack,
            Outlook {
                by_target: 0.0,
                ..outlook
            },
        );
    }
    (slack, outlook)
}

/// What of a ceiling is aimed at.
const LITTLE: f32 = 0.999_97;

/// What lies on the way from `best` to `wanted` within a circle; `None` if nothing does.
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

/// How near an end of its room a relay is at it, in parts of D.
const EDGE: f32 = 2e-6;

/// How much of its length a hop may leave and still be as long as it may be.
const TIGHT: f32 = 1e-3;

/// The coordinates of a place.
pub(super) const fn triple(place: Placement) -> Triple {
    [place.x_m, place.y_m, place.altitude_m]
}

/// One place as seen from another.
pub(super) fn minus([a, b, c]: Triple, [x, y, z]: Triple) -> Triple {
    [a - x, b - y, c - z]
}
