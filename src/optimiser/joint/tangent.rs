//! With noise, a hop that looks like one without: as it is next to one distance from the interferer.
//!
//! q(s) = s / (1 + nu s) is concave, so with w = 1 + nu t its tangent at s = t lies above it: q(s) <= (s + nu t^2) / w^2. By it
//!
//! ```text
//! q(s) >= c l   =>   s + nu t^2 >= c w^2 l
//! ```
//!
//! and the right side is a hop without noise for the target c' = c w^2, with nu t^2 to spare: what it reaches is a ball for c' > 1, and a
//! coordinate of its end follows from the other two by a square root. The ball holds all that is met, and touches its surface where
//! s = t; found there again, it is Newton's rule in s.

/// A hop as a quadratic: s + spare >= c l.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tangent {
    pub(super) c: f32,
    /// c - 1.
    pub(super) e: f32,
    /// m^2.
    pub(super) spare: f32,
}

impl Tangent {
    /// Without noise.
    pub(super) const fn free(c: f32, e: f32) -> Self {
        Self { c, e, spare: 0.0 }
    }

    /// With noise of nu = `noise`, 1/m^2, at `s` m^2 from the interferer.
    pub(super) fn new(noise: f32, c: f32, e: f32, s: f32) -> Self {
        let nus = noise * s;
        let w = 1.0 + nus;
        Self {
            c: c * w * w,
            e: e + c * nus * (2.0 + nus),
            spare: nus * s,
        }
    }
}
