//! Step control of an ascent: the target's increase, the fraction of the step, and the trust region.
//!
//! A backward pass gives the slack's derivative by ln gamma and the expected gain of the steps. A forward pass tries
//! the steps, together with the target that they should just allow. The trial is accepted if the chain's zero-slack
//! target becomes higher. Otherwise a smaller fraction of the steps is tried, and after the last fraction a smaller
//! trust region.

use super::outlook::Outlook;

/// Fractions of the moves, tried until the chain improves.
const SHARES: [f32; 3] = [1.0, 0.3, 0.09];

/// First *trust*: maximum move, divided by the distance from the interferer.
const TRUST: f32 = 0.5;

/// Smallest trust that allows a prediction.
const RESTRAINED: f32 = 0.05;

/// Trust below which the improvement ends without progress.
const LEAST_TRUST: f32 = 1e-4;

/// Least assumed shortening per ln(target SIR), in Tx-Rx distances. It is a divisor.
const LEAST_SLOPE: f32 = 0.3;

/// First increase of the target's limit, in ln(SIR).
const EXCESS: f32 = 0.03;

/// First upper limit on the slack, in Tx-Rx distances. More slack could outweigh the penalty.
const SPARE: f32 = 3e-3;
/// Smallest upper limit on the slack, in Tx-Rx distances.
const LEAST_SPARE: f32 = 4e-5;

/// Weight of negative slack relative to positive slack.
const SHORT: f32 = 2.0;

/// Increase of ln(target SIR) that counts as idle.
const CLOSE: f32 = 3e-6;

/// Expected increase of ln(target SIR) that ends the improvement.
const SETTLED: f32 = 0.3 * CLOSE;

/// Expected increase of ln(target SIR) below which predictions are possible.
const FORESEEN: f32 = 1e-4;

/// Iterations after which a far too short chain has diverged.
const ASTRAY_AFTER: u8 = 12;
const ASTRAY: f32 = 0.3;

/// Largest shortfall that is improved again, in Tx-Rx distances.
const ASTRAY_AT_END: f32 = 0.1;

const ITERATIONS: u8 = 40;

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum AscentStep {
    /// Try the fraction `share` of the moves at the target `sigma`.
    Try { share: f32, sigma: f32 },
    /// Raise the target as far as the unchanged chain allows.
    Raise,
    /// Compute new moves, from the last relay to the first.
    Again,
    /// End the improvement, or repeat it with less allowed slack.
    Over,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ascent {
    /// Target of the current chain, ln(SIR).
    pub(crate) sigma: f32,
    /// Length beyond Rx at the target, m; below 0 if short.
    pub(crate) slack: f32,
    floor: f32,
    /// Target that is compared with the upper bound, ln(SIR).
    pub(crate) limit: f32,
    /// Next increase of `limit`, in ln(SIR).
    excess: f32,
    /// Upper limit on the slack, in Tx-Rx distances.
    spare: f32,
    /// Penalty for relays too near the interferer, m.
    pub(crate) penalty: f32,
    distance_m: f32,
    /// Change of slack per ln(target SIR), m; below 0.
    pub(crate) slope: f32,
    linear: f32,
    square: f32,
    pub(crate) trust: f32,
    share: u8,
    iterations: u8,
    idle: u8,
}

impl Ascent {
    /// State before the first improvement: all bytes are 0.
    pub(crate) const NONE: Self = Self {
        spare: 0.0,
        limit: 0.0,
        slope: 0.0,
        trust: 0.0,
        ..Self::new(0.0, 0.0, 0.0, 0.0)
    };

    /// Starts at the target `sigma` with the slack `slack`, m. Targets are ln(SIR), at least `floor`.
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

    /// Returns this state with another `limit`, in ln(SIR).
    pub(crate) const fn probed_at(self, limit: f32) -> Self {
        Self {
            limit,
            excess: EXCESS,
            ..self
        }
    }

    /// Returns the upper limit on the slack, m.
    pub(crate) fn spare_m(&self) -> f32 {
        self.spare * self.distance_m
    }

    /// Returns true if [`tighten`](Self::tighten) would lower the limit.
    pub(crate) fn may_tighten(&self) -> bool {
        !(self.spare < LEAST_SPARE || self.penalty <= LEAST_SPARE * self.distance_m)
    }

    /// Lowers the limit on the slack; true if it did.
    pub(crate) fn tighten(&mut self) -> bool {
        if !self.may_tighten() {
            return false;
        }
        self.spare = (0.1 * self.spare).min(SPARE);
        true
    }

    /// Returns the next action after a lower limit on the slack.
    pub(crate) const fn tightened(&mut self, slack: f32) -> AscentStep {
        self.slack = slack;
        self.trust = TRUST;
        (self.idle, self.iterations) = (0, 0);
        AscentStep::Again
    }

    /// Returns true if the target has reached its limit.
    pub(crate) fn at_limit(&self) -> bool {
        self.slack >= 0.0 && self.sigma >= self.limit
    }

    /// Raises the target's limit, and returns the next action.
    pub(crate) fn probed(&mut self) -> AscentStep {
        self.limit += self.excess;
        self.excess *= 4.0;
        self.trust = TRUST;
        AscentStep::Again
    }

    pub(crate) const fn look_back(&mut self) {
        (self.slope, self.linear, self.square) = (0.0, 0.0, 0.0);
    }

    /// Adds one segment's expected increase of slack, and its slope.
    pub(crate) fn add(&mut self, outlook: &Outlook) {
        self.slope += outlook.by_target;
        self.linear += outlook.linear;
        self.square += outlook.square;
    }

    /// Returns the next action after all moves are computed.
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
        // The relays' moves gain little here: only a higher target can use the slack.
        if self.slack > 1e-4 * self.distance_m && self.linear + self.square < 0.1 * self.slack {
            return AscentStep::Raise;
        }
        self.attempt()
    }

    /// Returns true if ln(target SIR) changes by less than `by`.
    fn is_within(&self, by: f32) -> bool {
        let least = by * -self.slope;
        self.slack.abs() < least && (self.linear + self.square).abs() < least
    }

    /// Returns true if the improvement diverges, far short of Rx.
    pub(crate) fn is_astray(&self) -> bool {
        self.iterations >= ASTRAY_AFTER && self.slack < -ASTRAY * self.distance_m
    }

    /// Returns true if a short chain is worth another improvement.
    pub(crate) fn is_kept_up_with(&self) -> bool {
        self.slack > -ASTRAY_AT_END * self.distance_m
    }

    /// Returns true if the improvement should end at most at `sigma`.
    pub(crate) fn ends_below(&self, turn: AscentStep, sigma: f32) -> bool {
        let gain = (self.linear + self.square).max(0.0);
        let end = self.sigma + (self.slack + gain).max(self.slack.min(0.0)) / -self.slope;
        matches!(turn, AscentStep::Try { .. })
            && self.penalty <= 0.0
            && self.is_within(FORESEEN)
            && self.trust >= RESTRAINED
            && end < sigma + SETTLED
    }

    /// Returns the target that the moved chain should meet, ln(SIR).
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

    /// Returns the target that just reaches Rx, ln(SIR). Negative slack counts twice.
    fn merit(&self, sigma: f32, slack: f32) -> f32 {
        sigma - slack.min(SHORT * slack) / self.slope
    }

    /// Returns true if a trial chain is better than the current.
    pub(crate) fn is_gain(&self, sigma: f32, slack: f32) -> bool {
        if sigma >= self.limit && slack >= 0.0 && self.sigma < self.limit {
            return true;
        }
        let by = self.merit(sigma, slack) - self.merit(self.sigma, self.slack);
        by > 0.0 || (by >= -1e-7 && slack.abs() < self.slack.abs())
    }

    /// Returns the next action after a failed trial.
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

    /// Accepts the trial chain, and returns the next action.
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

    /// Returns the next action after the target rose to `sigma`.
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
