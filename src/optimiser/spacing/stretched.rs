//! Reach as a differentiable function for the joint method.

use super::Hop;
use super::MOST_RATIO;
use crate::root::sqrt_in_place;
use crate::sir::square;

impl Hop {
    /// Returns the reach without a minimum step, as a smooth function of all parameters; `None` if there is none. It is before
    /// `from_m` if the distance across the line is longer than the hop may be.
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
        // Below A the target may be met on two intervals, the one before the sender being no hop; above A on one.
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
