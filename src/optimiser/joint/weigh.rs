//! Backward pass of one relay: derivatives of the slack by the position of the relay before it.

use super::hop::{Bend, Reach};
use super::hop::{Coordinate, Triple, minus, triple};
use super::outlook::Outlook;
use super::policy::Policy;
use super::site::Room;
use super::site::Site;
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::{in_noise, square};

/// Cost of a violation of the minimum separation, in units of D; it outweighs any gain of slack.
const STIFFNESS: f32 = 100.0;

/// Distance from an end of the room at which a relay counts as at the end, in units of D.
const EDGE: f32 = 2e-6;

/// Relative spare length up to which a hop counts as fully stretched.
const TIGHT: f32 = 1e-3;

impl Site<'_> {
    /// Returns the violation of the minimum separation at `to` in squares, m^2, its weight, and its slope by ln gamma. A full hop
    /// shorter than d_min ends too close to the interferer: |p' - p|^2 = q(|p' - m|^2) / c < d_min^2. With noise this is |p' -
    /// m|^2 < L / (1 - nu L) for L = c d_min^2.
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

    /// Returns the penalty of the relay at `to`, m of slack.
    pub(crate) fn penalty(&self, target: f32, to: Placement) -> f32 {
        let (near, weight, _) = self.near(self.sender.gain.ratio(target), to);
        0.5 * weight * square(near)
    }

    /// Returns the policy of the relay at `to`, and propagates `outlook` to the relay before, at `from`. The step is limited to
    /// `trust` times the distance from the interferer. Work: some 400 multiplications and two square roots.
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

    /// Returns the dependent coordinate and the slope of F by it. It has the steepest slope and is not at an end of its room
    /// `low` to `high`.
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
