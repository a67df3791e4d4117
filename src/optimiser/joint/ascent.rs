//! Step control of an ascent: the target's increase, the fraction of the step, and the trust region.
//!
//! A backward pass gives the slack's derivative by ln gamma and the expected gain of the steps. A forward pass tries the steps
//! with the target that they should just allow. The trial is accepted if its zero-slack target is higher than before. Otherwise a
//! smaller fraction of the step is tried, and after the last one a smaller trust region.

use super::outlook::Outlook;

/// Fractions of the step, in the order in which they are tried.
const SHARES: [f32; 3] = [1.0, 0.3, 0.09];

/// Initial trust region, relative to a relay's distance from the interferer, and in ln gamma.
const TRUST: f32 = 0.5;

/// Trust region below which a step does not predict the result of the ascent.
const RESTRAINED: f32 = 0.05;

/// Trust region below which the ascent ends.
const LEAST_TRUST: f32 = 1e-4;

/// Minimum slope of the slack by ln gamma, in units of D. Hops of a total length D lose half of it per e-fold of the target.
const LEAST_SLOPE: f32 = 0.3;

/// Initial distance of the target above the ceiling for a repeated probe, in ln gamma.
const EXCESS: f32 = 0.03;

/// First cap on the slack that counts, in units of D. Without a cap, slack would outweigh a penalty.
const SPARE: f32 = 3e-3;
/// Cap below which it is not lowered further, in units of D.
const LEAST_SPARE: f32 = 4e-5;

/// Weight of negative slack relative to positive slack.
const SHORT: f32 = 2.0;

/// Convergence tolerance, in ln gamma.
const CLOSE: f32 = 3e-6;

/// Expected gain below which an ascent ends, in ln gamma.
const SETTLED: f32 = 0.3 * CLOSE;

/// Expected gain below which the ascent's result is predictable, in ln gamma.
const FORESEEN: f32 = 1e-4;

/// Iterations after which a negative slack below `ASTRAY`, in units of D, ends an ascent.
const ASTRAY_AFTER: u8 = 12;
const ASTRAY: f32 = 0.3;

/// Limit of the negative slack at the end of an ascent, in units of D: the judge makes up for less.
const ASTRAY_AT_END: f32 = 0.1;

const ITERATIONS: u8 = 40;

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum AscentStep {
    /// Try this fraction of the step with this target, in ln gamma.
    Try { share: f32, sigma: f32 },
    /// Raise the target as far as the unchanged chain allows.
    Raise,
    /// Compute the steps again.
    Again,
    /// End the ascent.
    Over,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ascent {
    /// Target of the nominal chain, in ln gamma, and its slack, m.
    pub(crate) sigma: f32,
    pub(crate) slack: f32,
    floor: f32,
    /// Maximum target until the chain is probed, in ln gamma, and its next increase.
    limit: f32,
    excess: f32,
    /// Cap on the slack that counts, in units of D; lowered where slack would outweigh a penalty.
    spare: f32,
    /// Penalty of the nominal chain for relays too near the interferer, in metres of slack.
    pub(crate) penalty: f32,
    distance_m: f32,
    /// Derivative of the slack by ln gamma, m.
    pub(crate) slope: f32,
    linear: f32,
    square: f32,
    pub(crate) trust: f32,
    share: u8,
    iterations: u8,
    idle: u8,
}

impl Ascent {
    /// Creates an ascent of a chain that has `slack` for the target `sigma`.
    pub(crate) const fn new(distance_m: f32, sigma: f32, slack: f32, floor: f32) -> Self {
        Self {
            sigma,
            slack,
            floor,
            limit: f32::INFINITY,
            excess: 0.0,
            spare: f32::INFINITY,
            penalty: 0.0,
            distance_m,
            slope: -1.0,
            linear: 0.0,
            square: 0.0,
            trust: TRUST,
            share: 0,
            iterations: 0,
            idle: 0,
        }
    }

    /// Returns the ascent with `limit`, in ln gamma, as the maximum target until its first probe.
    pub(crate) const fn probed_at(self, limit: f32) -> Self {
        Self {
            limit,
            excess: EXCESS,
            ..self
        }
    }

    pub(crate) const fn limit(&self) -> f32 {
        self.limit
    }

    /// Returns the cap on the slack, m: more slack than that has no additional value.
    pub(crate) fn spare_m(&self) -> f32 {
        self.spare * self.distance_m
    }

    /// Returns true if [`tighten`](Self::tighten) would lower the cap on the slack.
    pub(crate) fn may_tighten(&self) -> bool {
        !(self.spare < LEAST_SPARE || self.penalty <= LEAST_SPARE * self.distance_m)
    }

    /// Lowers the cap on the slack if a penalty applies; returns true if it was lowered.
    pub(crate) fn tighten(&mut self) -> bool {
        if !self.may_tighten() {
            return false;
        }
        self.spare = (0.1 * self.spare).min(SPARE);
        true
    }

    /// Continues with `slack`, m, the nominal chain's slack under the lowered cap.
    pub(crate) const fn tightened(&mut self, slack: f32) -> AscentStep {
        self.slack = slack;
        self.trust = TRUST;
        (self.idle, self.iterations) = (0, 0);
        AscentStep::Again
    }

    /// Returns true if the nominal chain meets the current maximum target.
    pub(crate) fn at_limit(&self) -> bool {
        self.slack >= 0.0 && self.sigma >= self.limit
    }

    /// Raises the maximum target after a failed probe: the chain needs more spare slack.
    pub(crate) fn probed(&mut self) -> AscentStep {
        self.limit += self.excess;
        self.excess *= 4.0;
        self.trust = TRUST;
        AscentStep::Again
    }

    pub(crate) const fn look_back(&mut self) {
        (self.slope, self.linear, self.square) = (0.0, 0.0, 0.0);
    }

    /// Adds the value function of a segment to the totals of the backward pass.
    pub(crate) fn add(&mut self, outlook: &Outlook) {
        self.slope += outlook.by_target;
        self.linear += outlook.linear;
        self.square += outlook.square;
    }

    /// Returns the next step after a complete backward pass.
    pub(crate) fn weighed(&mut self) -> AscentStep {
        self.slope = self.slope.min(-LEAST_SLOPE * self.distance_m);
        self.share = 0;
        self.iterations = self.iterations.saturating_add(1);
        if self.iterations > ITERATIONS || !(self.linear + self.square).is_finite() {
            return AscentStep::Over;
        }
        if self.at_limit() {
            return AscentStep::Raise;
        }
        if self.is_within(SETTLED) {
            return AscentStep::Over;
        }
        // Slack that can only be used by a higher target.
        if self.slack > 1e-4 * self.distance_m && self.linear + self.square < 0.1 * self.slack {
            return AscentStep::Raise;
        }
        self.attempt()
    }

    /// Returns true if neither the slack nor the step is worth more than `by`, in ln gamma.
    fn is_within(&self, by: f32) -> bool {
        let least = by * -self.slope;
        self.slack.abs() < least && (self.linear + self.square).abs() < least
    }

    /// Returns true if the ascent diverges: the target rises and the chain does not follow.
    pub(crate) fn is_astray(&self) -> bool {
        self.iterations >= ASTRAY_AFTER && self.slack < -ASTRAY * self.distance_m
    }

    /// Returns true while the real chain, after its last step, may still meet the nominal target.
    pub(crate) fn is_kept_up_with(&self) -> bool {
        self.slack > -ASTRAY_AT_END * self.distance_m
    }

    /// Returns true if the ascent, with `turn` next, will end no higher than `sigma`. False if there is a penalty.
    pub(crate) fn ends_below(&self, turn: AscentStep, sigma: f32) -> bool {
        let gain = (self.linear + self.square).max(0.0);
        let end = self.sigma + (self.slack + gain).max(self.slack.min(0.0)) / -self.slope;
        matches!(turn, AscentStep::Try { .. })
            && self.penalty <= 0.0
            && self.is_within(FORESEEN)
            && self.trust >= RESTRAINED
            && end < sigma + SETTLED
    }

    /// Returns the target for a fraction of the step.
    pub(crate) fn sigma_for(&self, share: f32) -> f32 {
        let gain = (self.linear + self.square * share) * share;
        let by = (self.slack + gain.max(0.0)) / -self.slope;
        (self.sigma + by.max(-self.trust).min(self.trust))
            .min(self.limit)
            .max(self.floor)
    }

    fn attempt(&self) -> AscentStep {
        match SHARES.get(usize::from(self.share)) {
            Some(&share) => AscentStep::Try {
                share,
                sigma: self.sigma_for(share),
            },
            None => AscentStep::Again,
        }
    }

    /// Returns the value of a chain that has `slack` for `sigma`. Negative slack has a higher weight than positive slack.
    fn merit(&self, sigma: f32, slack: f32) -> f32 {
        sigma - slack.min(SHORT * slack) / self.slope
    }

    /// Returns true if a trial that has `slack` for `sigma` is better than the nominal chain.
    pub(crate) fn is_gain(&self, sigma: f32, slack: f32) -> bool {
        if sigma >= self.limit && slack >= 0.0 && self.sigma < self.limit {
            return true;
        }
        let by = self.merit(sigma, slack) - self.merit(self.sigma, self.slack);
        by > 0.0 || (by >= -1e-7 && slack.abs() < self.slack.abs())
    }

    /// Returns the next step after a failed trial: the next fraction, or a smaller trust region.
    pub(crate) fn failed(&mut self) -> AscentStep {
        self.share = self.share.saturating_add(1);
        let turn = self.attempt();
        if turn == AscentStep::Again {
            self.trust *= 0.2;
            if self.trust < LEAST_TRUST {
                return AscentStep::Over;
            }
        }
        turn
    }

    /// Makes the trial with `share` the nominal chain.
    pub(crate) fn taken(&mut self, share: f32, sigma: f32, slack: f32) -> AscentStep {
        let before = self.merit(self.sigma, self.slack);
        (self.sigma, self.slack) = (sigma, slack);
        self.idle = if self.merit(sigma, slack) - before < CLOSE {
            self.idle + 1
        } else {
            0
        };
        if share >= 1.0 {
            self.trust = (2.0 * self.trust).min(1.0);
        }
        if self.idle >= 2 {
            AscentStep::Over
        } else {
            AscentStep::Again
        }
    }

    /// Continues after the target has been raised as far as the unchanged chain allows.
    pub(crate) fn raised(&mut self, sigma: f32, slack: f32) -> AscentStep {
        let gained = sigma - self.sigma > 1e-5;
        (self.sigma, self.slack) = (sigma, slack);
        self.trust = TRUST;
        if gained {
            AscentStep::Again
        } else {
            AscentStep::Over
        }
    }
}
