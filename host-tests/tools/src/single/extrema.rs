//! Extrema of SIR_1, the SIR of the first hop, along a straight line.
//!
//! [`first_hop_turn`] returns them for x >= 0 at one altitude. This is the paper's Lemma 2, for any interferer position
//! and with noise.
//!
//! With s = (X - x)^2 + Y^2 + h^2 and q = X^2 + Y^2 the slope of SIR_1 = A s / ((x^2 + h^2)(1 + nu s)) has the sign of
//!
//! ```text
//! X x^2 - q x - X h^2 - nu x s^2
//! ```
//!
//! Without noise this is a quadratic with the roots (q +- sqrt(q^2 + 4 X^2 h^2)) / 2X, one of which is beyond Tx. With noise:
//!
//! - X < 0: the expression falls with x from -X h^2 > 0 at Tx, so SIR_1 still has a single maximum, closer to Tx.
//! - X = 0: the expression is negative.
//! - X > 0: divided by x it is phi = X x - q - X h^2 / x - nu s^2. This is concave, because s is convex and not
//!   negative, so that s^2 is convex, too. So SIR_1 falls to a minimum, rises to a maximum and then falls, or it only
//!   falls. No root is before the noise-free minimum, where the sum of the first three terms is negative.

use std::ops::{Add, Div, Mul, Sub};

use uav_relay::root::sqrt;
use uav_relay::sir::square;
use uav_relay::{Interferer, Mission};

/// Number type for the search of a root: f32 as on board, or f64.
pub trait Real:
    Copy
    + PartialOrd
    + From<f32>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
}

impl Real for f32 {}
impl Real for f64 {}

/// Halves the interval from `low` to `high` `steps` times, and returns its ends.
///
/// `holds` should return true for `low` and false for `high`. Its value changes between the returned ends.
pub(super) fn bisected<T: Real>(
    low: T,
    high: T,
    steps: u8,
    mut holds: impl FnMut(T) -> bool,
) -> (T, T) {
    let (mut low, mut high) = (low, high);
    for _ in 0..steps {
        let middle = T::from(0.5) * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low, high)
}

/// Number of bisection steps for the x of an extremum of the first hop's SIR.
const HALVINGS: u8 = 32;

/// Largest number of doublings of x in the search for an x beyond an extremum.
const DOUBLINGS: u8 = 64;

/// Shape of SIR_1, the SIR of the first hop, along x >= 0 at one altitude.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Extremum {
    /// First hop's SIR falls up to this x, m (the paper's Psi^x), and rises beyond.
    ///
    /// The interferer is ahead of Tx (X > 0).
    Valley(f32),
    /// First hop's SIR falls up to the first x, m, rises up to the second x, and falls beyond.
    ///
    /// The interferer is ahead of Tx (X > 0), with noise.
    ValleyAndHill(f32, f32),
    /// First hop's SIR rises up to this x, m, and falls beyond. The interferer is behind Tx (X < 0).
    Hill(f32),
    /// First hop's SIR falls with x.
    ///
    /// The interferer is at X = 0, or it is ahead of Tx and the noise exceeds the interference.
    Falls,
    /// First hop's SIR is the same at every x: the interferer is at Tx, and there is no noise.
    Level,
}

/// Returns the extrema of SIR_1, the first hop's SIR, along x for a relay at `altitude_m`.
///
/// Without noise they are roots of a quadratic. With noise they take at most 190 evaluations of the slope. Accuracy:
/// `turns_agree_with_a_scan` in `host-tests/tests/theorems/`.
pub fn first_hop_turn(mission: &Mission, interferer: &Interferer, altitude_m: f32) -> Extremum {
    let x = interferer.x_m;
    let q = square(x) + square(interferer.y_m);
    let root = sqrt(square(q) + square(2.0 * x * altitude_m));
    let noise = mission.noise_at_a_metre();
    let slope = Slope {
        p: x,
        q,
        a: square(interferer.y_m) + square(altitude_m),
        b: square(altitude_m),
        noise,
        halvings: HALVINGS,
    };
    if x > 0.0 {
        let bottom = (q + root) / (2.0 * x);
        if !(noise > 0.0) {
            return Extremum::Valley(bottom);
        }
        slope
            .valley_and_hill(bottom)
            .map_or(Extremum::Falls, |[valley, hill]| {
                Extremum::ValleyAndHill(valley, hill)
            })
    } else if x < 0.0 {
        let peak = -2.0 * x * square(altitude_m) / (q + root);
        Extremum::Hill(if noise > 0.0 { slope.hill(peak) } else { peak })
    } else if q > 0.0 || noise > 0.0 {
        Extremum::Falls
    } else {
        Extremum::Level
    }
}

/// Function phi(t) with the sign of the slope of the first hop's SIR at t on a straight line.
///
/// phi(t) = p t - q - p b / t - nu ((t - p)^2 + a)^2, with the fields p, q, a, b and nu (`noise`). On a line along x, p
/// is the interferer's x.
#[derive(Debug)]
pub(super) struct Slope<T> {
    /// t of the point closest to the interferer, m. The point closest to Tx has t = 0.
    pub(super) p: T,
    /// Term p^2 + a - b of phi, m^2, from the fields p, a and b.
    pub(super) q: T,
    /// Squared distance of the line from the interferer, m^2.
    pub(super) a: T,
    /// Squared distance of the line from Tx, m^2.
    pub(super) b: T,
    /// Receiver noise divided by the interferer's power received at 1 m: nu, 1/m^2.
    pub(super) noise: T,
    /// Number of bisection steps for each extremum.
    pub(super) halvings: u8,
}

impl<T: Real> Slope<T> {
    fn rises(&self, t: T) -> bool {
        let Self { p, q, a, b, .. } = *self;
        let s = (t - p) * (t - p) + a;
        p * t - q - p * (b / t) - self.noise * s * s > T::from(0.0)
    }

    /// Returns true if the function phi rises at `t`, m. The field p must be above 0.
    ///
    /// For t above p the derivative of phi falls with t, so phi has at most one maximum there.
    fn bends_up(&self, t: T) -> bool {
        let Self { p, a, b, .. } = *self;
        let s = (t - p) * (t - p) + a;
        let half = T::from(0.5) * (p + p * (b / (t * t)));
        half - T::from(2.0) * self.noise * s * (t - p) > T::from(0.0)
    }

    /// Returns the t, m, of the only maximum of the first hop's SIR. The field p must be below 0.
    ///
    /// `peak` is the t of the maximum without noise.
    pub(super) fn hill(&self, peak: T) -> T {
        bisected(T::from(0.0), peak, self.halvings, |t| self.rises(t)).0
    }

    /// Returns the t, m, of the minimum and maximum of the first hop's SIR; `None` if the SIR only falls.
    ///
    /// The field p must be above 0. `bottom` is the t of the minimum without noise.
    pub(super) fn valley_and_hill(&self, bottom: T) -> Option<[T; 2]> {
        let bends_up = |t: T| self.bends_up(t);
        if !bends_up(bottom) {
            return None;
        }
        let (top, _) = bisected(bottom, beyond(bottom, bends_up), self.halvings, bends_up);
        let rises = |t: T| self.rises(t);
        if !rises(top) {
            return None;
        }
        let (valley, _) = bisected(bottom, top, self.halvings, |t| !rises(t));
        let (hill, _) = bisected(top, beyond(top, rises), self.halvings, rises);
        Some([valley, hill])
    }
}

fn beyond<T: Real>(from: T, holds: impl Fn(T) -> bool) -> T {
    let mut at = T::from(2.0) * from;
    for _ in 0..DOUBLINGS {
        if !holds(at) {
            break;
        }
        at = T::from(2.0) * at;
    }
    at
}
