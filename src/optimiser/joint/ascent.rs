//! Step control of an ascent: the target's increase, the fraction of the step, and the trust region.
//!
//! A backward pass gives the slack's derivative by ln gamma and the expected gain of the steps. A forward pass tries the steps
//! with the target that they should just allow. The trial is accepted if its zero-slack target is higher than before. Otherwise a
//! smaller fraction of the step is tried, and after the last one a smaller trust region.

use super::outlook::Outlook;

/// Fractions of the relays' computed steps that an ascent of the joint method tries, in this order.
const SHARES: [f32; 3] = [1.0, 0.3, 0.09];

/// Initial trust region: limit of a relay's step, as a fraction of its distance from the interferer. It also limits
/// the change of ln gamma, the logarithm of the target SIR.
const TRUST: f32 = 0.5;

/// Trust region (limit of the steps) below which the result of an ascent is not predicted.
const RESTRAINED: f32 = 0.05;

/// Trust region (limit of the steps) below which the ascent ends; a fraction like [`TRUST`].
const LEAST_TRUST: f32 = 1e-4;

/// Minimum fall of the slack (spare length at Rx) per unit of ln gamma, in units of the distance D. gamma is the
/// target SIR. Hops of a total length D lose half of it when the target rises by a factor of e.
const LEAST_SLOPE: f32 = 0.3;

/// First increase of the maximum target SIR, in ln gamma, after the chain failed at its upper bound.
const EXCESS: f32 = 0.03;

/// First cap on the slack (spare length of the chain at Rx), in units of D. More slack has no value, or it would
/// outweigh a penalty.
const SPARE: f32 = 3e-3;
/// Smallest cap on the slack (spare length of the chain at Rx), in units of D. It is not lowered further.
const LEAST_SPARE: f32 = 4e-5;

/// Weight of a length that is missing at Rx, relative to spare length, when two chains are compared.
const SHORT: f32 = 2.0;

/// Gain of the target SIR, in ln gamma, below which a step counts as idle. Two idle steps in a row end the ascent.
const CLOSE: f32 = 3e-6;

/// Expected gain of the target SIR below which an ascent ends, in ln gamma.
const SETTLED: f32 = 0.3 * CLOSE;

/// Expected gain of the target SIR below which the end of an ascent can be predicted, in ln gamma.
const FORESEEN: f32 = 1e-4;

/// Number of iterations after which an ascent has diverged if its chain is too short by `ASTRAY` D. D is the distance
/// from Tx to Rx.
const ASTRAY_AFTER: u8 = 12;
const ASTRAY: f32 = 0.3;

/// Length by which a chain may fall short of Rx at the end of an ascent, in units of D. The search for the highest
/// target after the ascent makes up for it.
const ASTRAY_AT_END: f32 = 0.1;

const ITERATIONS: u8 = 40;

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum AscentStep {
    /// Try `share`, a fraction of the relays' steps, with the target `sigma`, in ln gamma.
    Try { share: f32, sigma: f32 },
    /// Raise the target SIR as far as the unchanged chain allows.
    Raise,
    /// Compute the relays' steps again, by a backward pass.
    Again,
    /// End the ascent.
    Over,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ascent {
    /// Target SIR of the current chain, as ln gamma. The next field is the slack, the chain's spare length at Rx for
    /// it, m.
    pub(crate) sigma: f32,
    pub(crate) slack: f32,
    floor: f32,
    /// Maximum target SIR until the chain is checked at its upper bound, in ln gamma. The next field is its next
    /// increase.
    limit: f32,
    excess: f32,
    /// Cap on the slack (spare length of the chain at Rx), in units of D. It is lowered where slack would outweigh a
    /// penalty.
    spare: f32,
    /// Penalty of the current chain for relays too near the interferer, in metres of length at Rx.
    pub(crate) penalty: f32,
    distance_m: f32,
    /// Derivative of the slack (spare length at Rx) by ln gamma, the logarithm of the target SIR, m.
    pub(crate) slope: f32,
    linear: f32,
    square: f32,
    pub(crate) trust: f32,
    share: u8,
    iterations: u8,
    idle: u8,
}

impl Ascent {
    /// Creates an ascent of a chain with `slack`, its spare length at Rx, m, for the target `sigma`. Targets are in
    /// ln gamma, and never fall below `floor`.
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

    /// Returns the ascent with a maximum target of `limit`, in ln gamma, until the chain is checked there.
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

    /// Returns the cap on the slack (spare length at Rx), m: a chain with more is no better.
    pub(crate) fn spare_m(&self) -> f32 {
        self.spare * self.distance_m
    }

    /// Returns true if [`tighten`](Self::tighten) would lower the cap on the slack (spare length at Rx).
    pub(crate) fn may_tighten(&self) -> bool {
        !(self.spare < LEAST_SPARE || self.penalty <= LEAST_SPARE * self.distance_m)
    }

    /// Lowers the cap on the slack (spare length at Rx) if a penalty applies; returns true if it did.
    pub(crate) fn tighten(&mut self) -> bool {
        if !self.may_tighten() {
            return false;
        }
        self.spare = (0.1 * self.spare).min(SPARE);
        true
    }

    /// Continues with `slack`, the chain's spare length at Rx under the lowered cap, m. Returns the next action.
    pub(crate) const fn tightened(&mut self, slack: f32) -> AscentStep {
        self.slack = slack;
        self.trust = TRUST;
        (self.idle, self.iterations) = (0, 0);
        AscentStep::Again
    }

    /// Returns true if the current chain meets the maximum target.
    pub(crate) fn at_limit(&self) -> bool {
        self.slack >= 0.0 && self.sigma >= self.limit
    }

    /// Raises the maximum target after the chain failed at it; it needs more spare length. Returns the next action.
    pub(crate) fn probed(&mut self) -> AscentStep {
        self.limit += self.excess;
        self.excess *= 4.0;
        self.trust = TRUST;
        AscentStep::Again
    }

    pub(crate) const fn look_back(&mut self) {
        (self.slope, self.linear, self.square) = (0.0, 0.0, 0.0);
    }

    /// Adds a segment's derivative by the target, and its expected gains, to the backward pass's totals.
    pub(crate) fn add(&mut self, outlook: &Outlook) {
        self.slope += outlook.by_target;
        self.linear += outlook.linear;
        self.square += outlook.square;
    }

    /// Returns the action that follows a complete backward pass.
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

    /// Returns true if spare length and expected gain are each worth less than `by`, in ln gamma.
    fn is_within(&self, by: f32) -> bool {
        let least = by * -self.slope;
        self.slack.abs() < least && (self.linear + self.square).abs() < least
    }

    /// Returns true if the ascent diverges: the target rises, and the chain falls far short of Rx.
    pub(crate) fn is_astray(&self) -> bool {
        self.iterations >= ASTRAY_AFTER && self.slack < -ASTRAY * self.distance_m
    }

    /// Returns true while the chain falls short of Rx so little that it may still meet its target.
    pub(crate) fn is_kept_up_with(&self) -> bool {
        self.slack > -ASTRAY_AT_END * self.distance_m
    }

    /// Returns true if the ascent, with the action `turn` next, will end no higher than the target `sigma`. False if
    /// there is a penalty.
    pub(crate) fn ends_below(&self, turn: AscentStep, sigma: f32) -> bool {
        let gain = (self.linear + self.square).max(0.0);
        let end = self.sigma + (self.slack + gain).max(self.slack.min(0.0)) / -self.slope;
        matches!(turn, AscentStep::Try { .. })
            && self.penalty <= 0.0
            && self.is_within(FORESEEN)
            && self.trust >= RESTRAINED
            && end < sigma + SETTLED
    }

    /// Returns the target, in ln gamma, that the chain should just meet with `share` of the steps. `share` is a
    /// fraction.
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

    /// Returns the value of a chain with `slack` (spare length at Rx, m) for the target `sigma`. Both are combined in
    /// ln gamma. A missing length has a higher weight than a spare one.
    fn merit(&self, sigma: f32, slack: f32) -> f32 {
        sigma - slack.min(SHORT * slack) / self.slope
    }

    /// Returns true if a trial is better than the current chain: `slack`, m, for the target `sigma`. `slack` is its
    /// spare length at Rx, and `sigma` is in ln gamma.
    pub(crate) fn is_gain(&self, sigma: f32, slack: f32) -> bool {
        if sigma >= self.limit && slack >= 0.0 && self.sigma < self.limit {
            return true;
        }
        let by = self.merit(sigma, slack) - self.merit(self.sigma, self.slack);
        by > 0.0 || (by >= -1e-7 && slack.abs() < self.slack.abs())
    }

    /// Returns the action after a failed trial: a smaller fraction of the step, or a smaller trust region.
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

    /// Makes a trial the current chain: fraction `share` of the steps, spare length `slack` for `sigma`. Returns the
    /// next action.
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

    /// Continues after the target was raised to `sigma`, as far as the unchanged chain allows. `slack` is the chain's
    /// spare length for it, m. Returns the next action.
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
