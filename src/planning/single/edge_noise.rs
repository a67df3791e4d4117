//! Extrema of SIR_1 on an edge with noise.
//!
//! In the notation of [`edge`](super::edge), s = (t - P)^2 + a, the slope of SIR_1 has the sign of
//!
//! ```text
//! P t^2 - (P^2 + a - b) t - P b - nu t s^2
//! ```
//!
//! For P > 0 (otherwise everything is mirrored) this over t, phi, is concave for t > 0, since s is convex and not negative, and
//! so is s^2. So there are at most two extrema, a minimum and a maximum, none before the noise-free minimum. For t < 0 phi falls
//! with |t| from a positive value: one extremum, closer than the noise-free one. For P = 0 the sign is that of -t (a - b + nu
//! (t^2 + a)^2).

const HALVINGS: u8 = 60;

/// Doublings of t at most until a falling function is below 0.
const DOUBLINGS: u8 = 100;

/// Returns the extrema, m; missing ones are NaN.
pub(super) fn turns(p: f64, a: f64, b: f64, noise: f64) -> [f64; 3] {
    if !(libm::fabs(p) > 0.0) {
        let squared = libm::sqrt((b - a) / noise) - a;
        let t = if squared > 0.0 {
            libm::sqrt(squared)
        } else {
            f64::NAN
        };
        return [-t, 0.0, t];
    }
    let slope = Slope {
        p: libm::fabs(p),
        a,
        b,
        noise,
    };
    slope.turns().map(|t| libm::copysign(1.0, p) * t)
}

/// phi for P > 0.
struct Slope {
    p: f64,
    a: f64,
    b: f64,
    noise: f64,
}

impl Slope {
    fn phi(&self, t: f64) -> f64 {
        let Self { p, a, b, noise } = *self;
        let s = (t - p) * (t - p) + a;
        p * t - (p * p + a - b) - p * b / t - noise * s * s
    }

    fn bend(&self, t: f64) -> f64 {
        let Self { p, a, b, noise } = *self;
        let s = (t - p) * (t - p) + a;
        p + p * b / (t * t) - 4.0 * noise * s * (t - p)
    }

    fn turns(&self) -> [f64; 3] {
        let Self { p, a, b, .. } = *self;
        let half = 0.5 * (p * p + a - b);
        let root = libm::sqrt(half * half + p * p * b);
        // Extrema without noise; neither cancels.
        let (valley, before) = if half > 0.0 {
            ((half + root) / p, p * b / (half + root))
        } else {
            (p * b / (root - half), (root - half) / p)
        };
        let behind = -last(0.0, before, |t| self.phi(-t) > 0.0);
        let rises = |t: f64| self.bend(t) > 0.0;
        let none = [behind, f64::NAN, f64::NAN];
        if !rises(valley) {
            return none;
        }
        let top = last(valley, beyond(valley, rises), rises);
        let above = |t: f64| self.phi(t) > 0.0;
        if !above(top) {
            return none;
        }
        let low = last(valley, top, |t| !above(t));
        [behind, low, last(top, beyond(top, above), above)]
    }
}

/// Returns the last t in [`low`, `high`] at which `holds` is true; it is true at `low` and changes once.
fn last(low: f64, high: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

fn beyond(from: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let mut at = 2.0 * from;
    for _ in 0..DOUBLINGS {
        if !holds(at) {
            break;
        }
        at *= 2.0;
    }
    at
}
