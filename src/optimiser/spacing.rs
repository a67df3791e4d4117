//! Reach of a hop. The closed forms of the paper's `d_1`, `d_k` and `d_max` are one numerically stable rule.
//!
//! With the sender at (x0, y0, h0), the receiver at (x0 + d, y, h), the interferer at (X, Y, 0), u = X - x0 and A the sender's
//! gain, SIR >= gamma is
//!
//! ```text
//! f(d) = -e d^2 - 2 u d + C >= 0,    e = gamma / A - 1,    C = u^2 + H,
//! H = (Y - y0) (Y + y0 - 2y) + h0 (2h - h0) - e ((y - y0)^2 + (h - h0)^2)
//! ```
//!
//! The reach is the largest d in `[0, end - x0]` with f(d) >= 0. It is `end` if f is not negative there, and otherwise the
//! largest root inside, which depends on the signs of e, u and C:
//!
//! | C | u | largest root below `end` |
//! | --- | --- | --- |
//! | >= 0 | >= 0 | C / (u + r) |
//! | >= 0 | < 0 | (r - u) / e, and e > 0 follows from f(end) < 0 |
//! | < 0 | < 0 and e > 0 | (r - u) / e, if inside |
//! | < 0 | otherwise | none: the target is infeasible |
//!
//! with r = sqrt((gamma / A) u^2 + e H). The discriminant u^2 + e C is the same number, but cancels, and so does 1 + e for small
//! targets. e is computed from a gain of twice f32's width, so targets close to A lose no digits. The printed case distinction
//! selects wrong roots once the chain has passed the interferer.
//!
//! If the sender may be anywhere in [0, x0], only the position closest to the receiver matters: it is received best,
//! and the interference at the receiver does not depend on it. For a receiver at x up to x0 plus the minimum step s,
//! that sender is s before it, and the target is met if
//! ```text
//! (X - x)^2 + (Y - y)^2 + h^2 >= (gamma / A) (s^2 + (y - y0)^2 + (h - h0)^2):
//! ```
//!
//! which is true except within w of the interferer. So if the target cannot be met from x0, the sender may *hold back* for a
//! receiver at X - w: to climb before it comes near, or to leave the minimum step. `near_optimal_at_mixed_altitudes` and
//! `near_optimal_with_a_separation` in `host-tests/tests/exact.rs` compare this with a search over all positions.
//!
//! For the joint method `Hop::stretched` is the reach as a differentiable function.
//!
//! With receiver noise the reach has no closed form: [`noisy_hop`](super::noisy_hop) searches it, starting from this one.
//!
//! Accuracy: asserted by `reaches_agree_with_the_reference` in `host-tests/tests/placement/main.rs` against a bisection in f64.

use super::noisy_hop::{HALVINGS, MOST_RATIO, NoisyHop, before, closest};
use super::reverse::{Back, zone};
use crate::features::{NOISE, REVERSE};
use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Station};
use crate::root::{bisected, sqrt, sqrt_in_place};
use crate::sir::{Sender, in_noise, square};

/// Position that a relay must take so that the next hop of the pass meets the target SIR.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RequiredPosition {
    /// Farthest x of the relay in the direction of the pass that still meets the target SIR. This value is also used
    /// for Tx and Rx, which cannot move.
    AtReach,
    /// Given x of the relay, m. It differs from the farthest x that meets the target SIR.
    At(f32),
}

impl RequiredPosition {
    /// Returns the required x of the relay, m. `reach_m` is the relay's farthest x that meets the target SIR.
    pub(crate) const fn or_reach(self, reach_m: f32) -> f32 {
        match self {
            Self::AtReach => reach_m,
            Self::At(x_m) => x_m,
        }
    }
}

/// Hop toward Rx, with the terms of the equations that are the same for all target SIRs. The maximum length of the hop
/// for one target then takes three divisions and a square root.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hop {
    sender: Sender,
    /// Coordinate X of the interferer along the line from Tx to Rx, m.
    interferer_x_m: f32,
    /// Squared distance of the receiver from the interferer perpendicular to x, m^2.
    aside_squared: f32,
    /// Difference a^2 - b^2 of two squared distances perpendicular to x, m^2. a is the receiver's distance from the
    /// interferer, b its distance from the sender.
    ///
    /// The difference is a term of the equation for the hop's maximum length; it does not depend on the target. It is
    /// computed without cancellation as (Y - y0) (Y + y0 - 2y) + h0 (2h - h0). The interferer is at the lateral
    /// offset Y on the ground, the sender at the lateral offset y0 and altitude h0, the receiver at y and h.
    base: f32,
    /// Squared distance of receiver and sender perpendicular to x, m^2.
    across_squared: f32,
    /// Receiver noise divided by the interferer's power received at 1 m (nu), 1/m^2; 0 without noise.
    noise: f32,
    least_step: f32,
    /// True if the sender is Tx, which cannot move closer to the receiver.
    from_tx: bool,
    /// Largest permitted x of this hop's receiver, m; Tx is at x = 0.
    end_m: f32,
    /// Largest x of the receiver, and largest x of the sender, m, in this order. Beyond these limits, the relays nearer
    /// to Rx would have too little space for their minimum separation.
    gathered_m: [f32; 2],
    /// Same hop in the direction from Rx to Tx; `None` for a mission without data from Rx to Tx.
    back: Option<Back>,
}

impl Hop {
    /// Creates the hop from `sender` to relay `index`, which has the lateral offset and altitude `at`.
    ///
    /// `spread_squared`, m^2, is the largest squared distance, perpendicular to x, between two neighbours among the
    /// relays nearer to Rx than relay `index`.
    pub fn new(
        mission: &Mission,
        interferer: &Interferer,
        sender: Sender,
        index: u16,
        at: CrossSection,
        spread_squared: f32,
    ) -> Self {
        let end_m = mission.end_for(index, spread_squared);
        let noise = mission.noise_at_a_metre();
        let hop = Self::free(interferer, noise, sender, at, end_m);
        let before = mission.end_for(index.saturating_sub(1), spread_squared);
        Self {
            from_tx: index <= 1,
            // The transmitter is on the ground, so altitude alone separates the first relay from it.
            least_step: if index <= 1 {
                0.0
            } else {
                mission.least_step(hop.across_squared)
            },
            gathered_m: [end_m, before],
            ..hop
        }
    }

    /// Creates the hop from `sender` to a receiver whose x is at most `end_m`. The hop has no minimum length. `at` is
    /// the receiver's lateral offset and altitude. `noise` is the noise divided by the interferer's power received at
    /// one metre, 1/m^2.
    pub(crate) fn free(
        interferer: &Interferer,
        noise: f32,
        sender: Sender,
        at: CrossSection,
        end_m: f32,
    ) -> Self {
        let (from, aside) = (sender.cross_section, interferer.y_m);
        let climb = at.altitude_m - from.altitude_m;
        Self {
            sender,
            interferer_x_m: interferer.x_m,
            aside_squared: square(aside - at.y_m) + square(at.altitude_m),
            base: (aside - from.y_m) * (aside + from.y_m - 2.0 * at.y_m)
                + from.altitude_m * (at.altitude_m + climb),
            across_squared: at.apart_squared(from),
            noise,
            from_tx: true,
            least_step: 0.0,
            end_m,
            gathered_m: [end_m; 2],
            back: None,
        }
    }

    fn back(&self) -> Option<&Back> {
        if REVERSE { self.back.as_ref() } else { None }
    }

    /// Returns this hop and, if the mission has data from Rx to Tx, also the backward hop. `power_w` is the transmit
    /// power, W, of the relay that receives the forward hop (toward Rx) and sends the backward hop.
    #[inline]
    pub(super) fn both_ways(mut self, mission: &Mission, power_w: f32) -> Self {
        if mission.reverse() > 0.0 {
            self.back = Back::new(mission, self.sender.cross_section, power_w, self.from_tx);
        }
        self
    }

    /// Returns this hop with the x of Rx as the limit of the receiver's x. This limit leaves no space along x for the
    /// relays nearer to Rx.
    pub(super) fn to_the_end(self, mission: &Mission, index: u16) -> Self {
        Self {
            end_m: mission.end_freely(index),
            ..self
        }
    }

    pub(crate) fn ending(self, end_m: f32) -> Self {
        Self { end_m, ..self }
    }

    /// Returns the largest x, m, at which the receiver meets `target`; `None` if there is no such x.
    ///
    /// `target` is a linear SIR above zero, `from_m` the sender's x, from 0 to the x of Rx. The result is between
    /// `from_m` and the largest permitted x of the receiver. It is rounded toward the sender, so it meets the target as
    /// an f32. Constant work; with noise at most 96 evaluations of the SIR, usually five.
    pub fn reach(&self, target: f32, from_m: f32) -> Option<f32> {
        if self.is_simple() {
            self.in_silence(target, from_m)
        } else {
            self.in_noise_or_both_ways(target, from_m)
        }
    }

    #[inline(never)] // keeps the reach of a simple hop small
    fn in_noise_or_both_ways(&self, target: f32, from_m: f32) -> Option<f32> {
        let Some(back) = self.back() else {
            return self.onward(target, from_m);
        };
        let longest = back.reach(target, from_m, self.across_squared)?;
        let place = rounded(from_m, longest)?.min(self.end_m);
        self.ending(place).onward(target, from_m)
    }

    /// Returns the largest x at which the receiver meets `target`, m, for data toward Rx only. The sender is at x =
    /// `from_m`. `None` if no x meets `target`.
    fn onward(&self, target: f32, from_m: f32) -> Option<f32> {
        if self.is_silent() {
            self.in_silence(target, from_m)
        } else {
            self.in_noise(target, from_m)
        }
    }

    #[expect(
        clippy::inline_always,
        reason = "a call would cost a sweep a hundred instructions"
    )]
    #[inline(always)]
    fn in_silence(&self, target: f32, from_m: f32) -> Option<f32> {
        let room = self.end_m - from_m;
        if room < self.least_step {
            return None;
        }
        let ratio = self.sender.gain.ratio(target);
        if !(ratio <= MOST_RATIO) {
            return None;
        }
        let u = self.interferer_x_m - from_m;
        // f(end) as the two terms of the SIR; expanded, they would cancel close to the interferer.
        if square(u - room) + self.aside_squared >= ratio * (square(room) + self.across_squared) {
            return Some(self.end_m);
        }
        let e = self.sender.gain.excess(target);
        let h = self.base - e * self.across_squared;
        let c = square(u) + h;
        let ahead = u >= 0.0;
        if c < 0.0 && (ahead || e <= 0.0) {
            return None;
        }
        let discriminant = ratio * square(u) + e * h;
        if discriminant < 0.0 && c < 0.0 {
            return None;
        }
        let r = sqrt_in_place(discriminant);
        let d = if ahead { c / (u + r) } else { (r - u) / e };
        if !(d >= self.least_step) {
            return None;
        }
        if d >= room {
            // With C < 0 the feasible interval is entirely beyond the end; otherwise rounding has put the root on the
            // end.
            return if c < 0.0 { None } else { Some(self.end_m) };
        }
        rounded(from_m, d)
    }

    /// Returns the largest x, m, at which the receiver meets `target` with any sender in [0, `from_m`]. `None` if no x
    /// meets `target`.
    ///
    /// If the hop can meet `target` with the sender at `from_m`, the result is [`Hop::reach`] for this sender, or more
    /// for data in both directions. Otherwise the sender is before the receiver by their minimum distance along x.
    /// Constant work.
    pub fn outermost(&self, target: f32, from_m: f32) -> Option<f32> {
        let place = self
            .reach(target, from_m)
            .or_else(|| self.held_back(target, from_m))?;
        Some(match self.back() {
            Some(back) if !self.from_tx => self.beyond(back, target, from_m, place),
            _ => place,
        })
    }

    /// Returns the receiver's largest x, m, at which the hop meets `target` in both directions of data. The sender is
    /// at any x from 0 to `from_m`. `back` is the hop from the receiver back to it. `place` is the receiver's largest x
    /// for a sender at `from_m`. The result is larger if a smaller x of the sender gives the backward hop a better SIR.
    #[inline(never)] // keeps a sweep without a way back small
    fn beyond(&self, back: &Back, target: f32, from_m: f32, place: f32) -> f32 {
        let end_m = self.end_m;
        let limit = back
            .reach(target, from_m, self.across_squared)
            .map_or(0.0, |d| from_m + d);
        // A sender beyond its receiver is no hop.
        let nearest = |x: f32| from_m.min(self.before(x));
        let is_met = |x: f32| self.sender(back, target, nearest(x), x).is_some();
        if place >= end_m || place < limit.next_down().next_down() || !is_met(place + 1e-5 * end_m)
        {
            return place;
        }
        if is_met(end_m) {
            return end_m;
        }
        bisected(place, end_m, HALVINGS, is_met).0
    }

    /// Returns the sender's largest x, m, at which the hop meets `target` in both directions of data. Only x up to
    /// `near` are considered; `None` if no such x meets `target`. The receiver is at x = `place`. `back` is the hop
    /// from the receiver back to the sender.
    fn sender(&self, back: &Back, target: f32, near: f32, place: f32) -> Option<f32> {
        let hop = back.from(target, place, self.across_squared);
        let least = place - near;
        let from = if hop.is_met(least) {
            near
        } else {
            before(place, closest(&hop, least, place)?)
        };
        let heard = square(self.interferer_x_m - place) + self.aside_squared;
        let squared = square(place - from) + self.across_squared;
        let needed = self.sender.gain.ratio(target) * squared * (1.0 - ROUNDING);
        // The relays before the sender need an x of their own, which x = 0 would not leave them.
        let room = ROUNDING * self.end_m;
        (from >= room && in_noise(heard, self.nu()) >= needed).then_some(from)
    }

    pub(super) fn outermost_in_silence(&self, target: f32, from_m: f32) -> Option<f32> {
        self.in_silence(target, from_m)
            .or_else(|| self.held_back(target, from_m))
    }

    #[inline(never)] // keeps a sweep in which no relay holds back small
    fn held_back(&self, target: f32, from_m: f32) -> Option<f32> {
        let ratio = self.sender.gain.ratio(target);
        if self.from_tx || !(ratio <= MOST_RATIO) {
            return None;
        }
        let near = (from_m + self.least_step).min(self.end_m);
        // Within this distance of the interferer even the closest sender is too weak; both positions are rounded.
        let nearest = self.least_step + 2.0 * f32::EPSILON * near;
        let needed = ratio * (square(nearest) + self.across_squared);
        let zone = zone(needed, self.nu(), self.aside_squared)?;
        let before_zone = |place: f32| {
            if (place - self.interferer_x_m).abs() < zone {
                (self.interferer_x_m - zone).next_down()
            } else {
                place
            }
        };
        let mut place = before_zone(near);
        if let Some(back) = self.back() {
            let zone = back.zone(target, square(nearest) + self.across_squared)?;
            if (self.before(place) - self.interferer_x_m).abs() < zone {
                place = before_zone((self.interferer_x_m - zone + self.least_step).next_down());
            }
        }
        (self.before(place) >= 0.0).then_some(place)
    }

    /// Returns the largest x, m, at which a sender keeps the minimum separation from a receiver at `place`.
    fn before(&self, place: f32) -> f32 {
        let from = place - self.least_step;
        if place - from < self.least_step || from >= place {
            from.next_down()
        } else {
            from
        }
    }

    /// Returns the position that the sender must take if the receiver is at x = `place`. `None` if no permitted
    /// position of the sender meets `target`.
    ///
    /// `from_m` is the farthest x at which the sender itself, as a receiver, meets `target`. The required position is
    /// the permitted position closest to the receiver, because the hop from there has the best SIR.
    pub fn required_position(
        &self,
        target: f32,
        from_m: f32,
        place: f32,
    ) -> Option<RequiredPosition> {
        if self
            .reach(target, from_m)
            .is_some_and(|reach| place >= reach && (place <= reach || self.back().is_none()))
        {
            return Some(RequiredPosition::AtReach);
        }
        let heard = square(self.interferer_x_m - place) + self.aside_squared;
        let heard = in_noise(heard, self.nu());
        let ratio = self.sender.gain.ratio(target);
        let at = |from: f32| {
            let squared = square(place - from) + self.across_squared;
            let allowed = 1.0 - ROUNDING;
            let met = from >= 0.0
                && heard >= ratio * squared * allowed
                && self
                    .back()
                    .is_none_or(|back| back.hears(from) >= target * squared * allowed);
            met.then_some(if from < from_m {
                RequiredPosition::At(from)
            } else {
                RequiredPosition::AtReach
            })
        };
        if self.from_tx {
            return at(from_m);
        }
        let near = from_m.min(self.before(place));
        // If all relays gather at the end, they are spaced as evenly as by a pass that plans room for them from the
        // start.
        let [own, sender] = self.gathered_m;
        let gathered = (place >= own && !(self.across_squared > 0.0)).then(|| at(near.min(sender)));
        let required = gathered.flatten().or_else(|| at(near));
        required.or_else(|| {
            let from = self.sender(self.back()?, target, near, place)?;
            Some(RequiredPosition::At(from))
        })
    }

    /// Returns the receiver's largest x, m, that meets `target` if no minimum separation is required. Without a minimum
    /// separation the result is a smooth function of the arguments, as the joint method requires.
    ///
    /// `None` if there is no such x. The result is less than `from_m`, the sender's x, if the distance perpendicular to
    /// x alone exceeds the hop's maximum length.
    pub(crate) fn stretched(&self, target: f32, from_m: f32) -> Option<f32> {
        let place = self.stretched_freely(target, from_m)?;
        if self.is_silent() {
            return Some(place);
        }
        let hop = self.noisy(target, from_m);
        let most = place - from_m;
        if place >= self.end_m && hop.is_met(most) {
            return Some(place);
        }
        let heard = hop.through_noise()?;
        // Below A the target may be met on two intervals, but the one before the sender is no hop. Above A it is met on
        // one.
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

/// Relative tolerance for rounding errors in the comparison of a hop's SIR with its target.
const ROUNDING: f32 = 4e-6;

/// Returns `from_m` + `d`, m, rounded toward `from_m`. `None` if the result equals `from_m`: two relays must not have
/// the same x.
#[expect(
    clippy::inline_always,
    reason = "a call would cost a sweep a hundred instructions"
)]
#[inline(always)]
fn rounded(from_m: f32, d: f32) -> Option<f32> {
    let place = from_m + d;
    let place = if place - from_m > d {
        place.next_down()
    } else {
        place
    };
    (place > from_m).then_some(place)
}

/// Returns the paper's `d_max`, m: the largest distance along x at which a relay meets `target` at Rx.
///
/// It is sqrt(K / gamma - y^2 - h^2), at most 1e9. K is the factor of the last hop (SIR at Rx times squared distance),
/// gamma is `target`, y the relay's lateral offset and h its altitude. `None` if even a relay vertically above Rx does
/// not meet `target`. The result can exceed the distance from Tx to Rx, so that it is a smooth function of the target,
/// as the root search requires.
pub fn receiver_reach(mission: &Mission, relay: Station, target: f32) -> Option<f32> {
    let across = square(relay.cross_section.y_m) + square(relay.cross_section.altitude_m);
    let squared = mission.receiver_gain(relay.power_w) / target - across;
    (squared >= 0.0).then(|| sqrt(squared).min(1e9))
}

impl Hop {
    /// Returns true for a hop without noise in a chain that carries data toward Rx only.
    pub(super) fn is_simple(&self) -> bool {
        self.is_silent() && self.back().is_none()
    }

    pub(in crate::optimiser) fn is_silent(&self) -> bool {
        !(self.nu() > 0.0)
    }

    /// Returns the receiver noise divided by the interferer's power received at 1 m: nu, 1/m^2. It is the constant 0
    /// without the feature `noise`, so that the compiler drops the code for hops with noise.
    fn nu(&self) -> f32 {
        if NOISE { self.noise } else { 0.0 }
    }

    /// Returns the largest x, m, at which the receiver meets `target`, for a hop with receiver noise. `None` if no x
    /// meets `target`.
    #[inline(never)] // keeps a sweep without noise small
    pub(super) fn in_noise(&self, target: f32, from_m: f32) -> Option<f32> {
        let place = self.in_silence(target, from_m)?;
        let hop = self.noisy(target, from_m);
        let most = place - from_m;
        if place >= self.end_m && hop.is_met(most) {
            return Some(place);
        }
        let d = hop.last(self.least_step, hop.through_noise()?.min(most))?;
        rounded(from_m, d)
    }

    pub(super) fn noisy(&self, target: f32, from_m: f32) -> NoisyHop {
        NoisyHop {
            ratio: self.sender.gain.ratio(target),
            excess: self.sender.gain.excess(target),
            ahead: self.interferer_x_m - from_m,
            aside_squared: self.aside_squared,
            across_squared: self.across_squared,
            base: self.base,
            noise: self.nu(),
        }
    }
}
