//! The reach as the joint method differentiates it.

use super::Hop;
use super::MOST_RATIO;
use crate::root::sqrt_in_place;
use crate::sir::square;

impl Hop {
    /// The reach as a smooth function of everything: without a least step, and behind `from_m` where the hop across takes more than
    /// there is. `None` where there is none at all.
    pub(crate) fn stretched(&self, target: f32, from_m: f32) -> Option<f32> {
        let place = self.stretched_freely(target, from_m)?;
        if !(self.noise > 0.0) {
            return Some(place);
        }
        let hop = self.noisy(target, from_m);
        let most = place - from_m;
        if place >= self.end_m && hop.is_met(most) {
            return Some(place);
        }
        let heard = hop.through_noise()?;
        // Below A what is met may have two parts, of which the one before Tx is no hop; above it there is one.
        let least = if hop.excess > 0.0 { -heard } else { 0.0 };
        Some(from_m + hop.last(least, heard.min(most))?)
    }

    fn stretched_freely(&self, target: f32, from_m: f32) -> Option<f32> {
        let ratio = self.sender.gain.ratio(target);
        if !(ratio <= MOST_RATIO) {
            return None;
        }
        let u = self.interferer_x_m - from_m;
        let e = self.sender.gain.excess(target);
        let h = self.base - e * self.across_squared;
        let discriminant = ratio * square(u) + e * h;
        if !(e > 0.0) {
            let room = self.end_m - from_m;
            let all = square(u - room) + self.aside_squared
                >= ratio * (square(room) + self.across_squared);
            if all || (discriminant < 0.0 && u >= 0.0) {
                return Some(self.end_m.max(from_m));
            }
            if !(u >= 0.0 && square(u) + h >= 0.0) {
                return None;
            }
        }
        if discriminant < 0.0 {
            return None;
        }
        let r = sqrt_in_place(discriminant);
        let d = if u >= 0.0 {
            (square(u) + h) / (u + r)
        } else {
            (r - u) / e
        };
        Some((from_m + d).min(self.end_m.max(from_m)))
    }
}
