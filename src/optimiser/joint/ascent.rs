//! Step control of an ascent: the target's increase, the fraction of the step, and the trust region.
//!
//! A backward pass gives the slack's derivative by ln gamma and the expected gain of the steps. A forward pass tries
//! the steps, together with the target that they should just allow. The trial is accepted if the chain's zero-slack
//! target becomes higher. Otherwise a smaller fraction of the steps is tried, and after the last fraction a smaller
//! trust region.

use super::outlook::Outlook;

/// Fractions of the moves that the backward pass computes for the relays. An iteration tries these fractions in this
/// order until one improves the chain.
const SHARES: [f32; 3] = [1.0, 0.3, 0.09];

/// First value of the *trust*, which limits the changes of a chain in one iteration. Each relay moves by at most the
/// trust times its distance to the interferer, and ln(target SIR) changes by at most the trust.
const TRUST: f32 = 0.5;

/// Minimum trust (limit of the relays' moves) at which the final target of a chain is predicted. With a smaller trust
/// the predicted target would be too low.
const RESTRAINED: f32 = 0.05;

/// Trust (limit of the relays' moves) below which the improvement of a chain is given up.
const LEAST_TRUST: f32 = 1e-4;

/// Minimum length by which a chain is assumed to shrink per unit of ln(target SIR). The unit is the distance from Tx to
/// Rx. The usual length is 0.5.
const LEAST_SLOPE: f32 = 0.3;

/// First increase of the upper limit on a chain's target SIR, in ln(SIR). The limit is raised if the chain meets this
/// target, but does not reach the upper bound on the SIR of all chains.
const EXCESS: f32 = 0.03;

/// First upper limit on the slack, the length by which a chain reaches beyond Rx. The unit is the distance from Tx to
/// Rx. Without the limit a large slack could outweigh the penalty for relays too near the interferer.
const SPARE: f32 = 3e-3;
/// Value of the upper limit on the slack below which the limit is not lowered again. The slack is the length by which a
/// chain reaches beyond Rx. The unit is the distance from Tx to Rx.
const LEAST_SPARE: f32 = 4e-5;

/// Factor on a negative slack (length by which a chain ends before Rx), when two chains are compared.
const SHORT: f32 = 2.0;

/// Increase of ln(target SIR) below which an iteration counts as idle. Two idle iterations in a row end a chain's
/// improvement.
const CLOSE: f32 = 3e-6;

/// Expected increase of ln(target SIR) by the next moves, below which a chain's improvement ends.
const SETTLED: f32 = 0.3 * CLOSE;

/// Expected increase of ln(target SIR) by the next moves, below which the final target is predicted.
const FORESEEN: f32 = 1e-4;

/// Number of iterations after which a chain that falls far short of Rx counts as diverged.
const ASTRAY_AFTER: u8 = 12;
const ASTRAY: f32 = 0.3;

/// Maximum distance by which a chain may end before Rx, if its improvement is to be repeated. The repetition has a
/// lower upper limit on the slack (length by which a chain reaches beyond Rx). The unit is the distance from Tx to Rx.
const ASTRAY_AT_END: f32 = 0.1;

const ITERATIONS: u8 = 40;

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum AscentStep {
    /// Try the fraction `share` of the moves from the backward pass, with the target `sigma` = ln(SIR).
    Try { share: f32, sigma: f32 },
    /// Raise the target SIR as far as the unchanged chain allows.
    Raise,
    /// Compute new moves of the relays by a backward pass, from the last relay to the first.
    Again,
    /// End the improvement of this chain, or repeat it with a lower upper limit on the slack. The slack is the length
    /// by which the chain reaches beyond Rx.
    Over,
}

#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ascent {
    /// Target SIR of the current chain, as ln(SIR).
    pub(crate) sigma: f32,
    /// Slack of the current chain, m: the length by which it could reach beyond Rx at its target SIR. Below 0 if the
    /// chain is too short.
    pub(crate) slack: f32,
    floor: f32,
    /// Upper limit on the target, in ln(SIR). A chain that reaches this limit is compared with the upper bound on the
    /// SIR of all chains. If the chain does not reach this bound, the limit is raised.
    pub(crate) limit: f32,
    /// Next increase of `limit`, in ln(SIR).
    excess: f32,
    /// Upper limit on the chain's slack, as a fraction of the distance from Tx to Rx. This limit is lowered if relays
    /// are too near the interferer: a large slack would outweigh the penalty for such relays.
    spare: f32,
    /// Penalty for relays too near the interferer, m, subtracted from the chain's slack.
    pub(crate) penalty: f32,
    distance_m: f32,
    /// Change of the chain's slack per unit of ln(target SIR), m; below 0.
    pub(crate) slope: f32,
    linear: f32,
    square: f32,
    pub(crate) trust: f32,
    share: u8,
    iterations: u8,
    idle: u8,
}

impl Ascent {
    /// State before the first improvement of a chain. All its bytes are 0.
    pub(crate) const NONE: Self = Self {
        spare: 0.0,
        limit: 0.0,
        slope: 0.0,
        trust: 0.0,
        ..Self::new(0.0, 0.0, 0.0, 0.0)
    };

    /// Starts the improvement of a chain with the slack `slack`, m, at the target `sigma`. The slack is the length by
    /// which the chain reaches beyond Rx. Targets are in ln(SIR), never below `floor`.
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

    /// Returns this state with `limit` as the upper limit on the target, in ln(SIR).
    ///
    /// At this target the chain is compared with the upper bound on the SIR of any chain.
    pub(crate) const fn probed_at(self, limit: f32) -> Self {
        Self {
            limit,
            excess: EXCESS,
            ..self
        }
    }

    /// Returns the upper limit on the slack, the length by which the chain reaches beyond Rx, m. Slack above this limit
    /// does not count when chains are compared.
    pub(crate) fn spare_m(&self) -> f32 {
        self.spare * self.distance_m
    }

    /// Returns true if [`tighten`](Self::tighten) would lower the upper limit on the chain's slack. The slack is the
    /// length by which the chain reaches beyond Rx.
    pub(crate) fn may_tighten(&self) -> bool {
        !(self.spare < LEAST_SPARE || self.penalty <= LEAST_SPARE * self.distance_m)
    }

    /// Lowers the upper limit on the chain's slack if relays are too near the interferer. The slack is the length by
    /// which the chain reaches beyond Rx. Returns true if the limit was lowered.
    pub(crate) fn tighten(&mut self) -> bool {
        if !self.may_tighten() {
            return false;
        }
        self.spare = (0.1 * self.spare).min(SPARE);
        true
    }

    /// Returns the next action after the upper limit on the chain's slack was lowered. `slack` is the chain's slack
    /// under the lowered limit, m.
    pub(crate) const fn tightened(&mut self, slack: f32) -> AscentStep {
        self.slack = slack;
        self.trust = TRUST;
        (self.idle, self.iterations) = (0, 0);
        AscentStep::Again
    }

    /// Returns true if the target SIR has reached its limit. The chain must then be compared with the upper bound on
    /// the SIR of any chain.
    pub(crate) fn at_limit(&self) -> bool {
        self.slack >= 0.0 && self.sigma >= self.limit
    }

    /// Raises the upper limit on the target SIR; returns the next action. Called if the chain meets the limit, but its
    /// SIR does not reach the upper bound on the SIR of any chain.
    pub(crate) fn probed(&mut self) -> AscentStep {
        self.limit += self.excess;
        self.excess *= 4.0;
        self.trust = TRUST;
        AscentStep::Again
    }

    pub(crate) const fn look_back(&mut self) {
        (self.slope, self.linear, self.square) = (0.0, 0.0, 0.0);
    }

    /// Adds the backward pass's results for one segment (ten relays) to the sums over the chain. The results are the
    /// length that the relays' moves are expected to add beyond Rx (slack), and the change of the slack per unit of
    /// ln(target SIR).
    pub(crate) fn add(&mut self, outlook: &Outlook) {
        self.slope += outlook.by_target;
        self.linear += outlook.linear;
        self.square += outlook.square;
    }

    /// Returns the next action after the backward pass has computed the moves of all relays.
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

    /// Returns true if the slack and its expected increase by the relays' moves are both small. Small means that each
    /// of them is worth less than `by` in ln(target SIR).
    fn is_within(&self, by: f32) -> bool {
        let least = by * -self.slope;
        self.slack.abs() < least && (self.linear + self.square).abs() < least
    }

    /// Returns true if the improvement diverges: after 12 iterations the chain still ends far before Rx.
    pub(crate) fn is_astray(&self) -> bool {
        self.iterations >= ASTRAY_AFTER && self.slack < -ASTRAY * self.distance_m
    }

    /// Returns true if the chain ends at most a tenth of the distance from Tx to Rx before Rx. Only such a chain is
    /// improved again, with a lower upper limit on its slack.
    pub(crate) fn is_kept_up_with(&self) -> bool {
        self.slack > -ASTRAY_AT_END * self.distance_m
    }

    /// Returns true if this chain's improvement is predicted to end at a target of at most `sigma`. `sigma` is in
    /// ln(SIR), and `turn` is the next action of the improvement. False also if no prediction is possible.
    pub(crate) fn ends_below(&self, turn: AscentStep, sigma: f32) -> bool {
        let gain = (self.linear + self.square).max(0.0);
        let end = self.sigma + (self.slack + gain).max(self.slack.min(0.0)) / -self.slope;
        matches!(turn, AscentStep::Try { .. })
            && self.penalty <= 0.0
            && self.is_within(FORESEEN)
            && self.trust >= RESTRAINED
            && end < sigma + SETTLED
    }

    /// Returns the target that the chain is expected to just meet, in ln(SIR). The relays make the fraction `share` of
    /// their computed moves.
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

    /// Returns the merit of a chain: the target, as ln(SIR), at which the chain would just reach Rx. `slack` is the
    /// length by which the chain reaches beyond Rx at the target `sigma`, m. A negative `slack` is doubled.
    fn merit(&self, sigma: f32, slack: f32) -> f32 {
        sigma - slack.min(SHORT * slack) / self.slope
    }

    /// Returns true if a trial chain is better than the current chain. `slack` is the length by which the trial chain
    /// reaches beyond Rx, m, at the target `sigma`, as ln(SIR).
    pub(crate) fn is_gain(&self, sigma: f32, slack: f32) -> bool {
        if sigma >= self.limit && slack >= 0.0 && self.sigma < self.limit {
            return true;
        }
        let by = self.merit(sigma, slack) - self.merit(self.sigma, self.slack);
        by > 0.0 || (by >= -1e-7 && slack.abs() < self.slack.abs())
    }

    /// Returns the next action after a trial that did not improve the chain. The action is a trial with a smaller
    /// fraction of the computed moves. After the smallest fraction, new and shorter moves are computed.
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

    /// Accepts the trial chain, and returns the next action. `share` is the fraction of their computed moves that the
    /// relays made in the trial. `slack` is the length by which the chain reaches beyond Rx, m, at the target `sigma`,
    /// in ln(SIR).
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

    /// Returns the next action after the search has found the highest target of the unchanged chain. `sigma` is this
    /// target, in ln(SIR), and `slack` the length by which the chain reaches beyond Rx at this target, m.
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
