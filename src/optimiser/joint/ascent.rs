//! From iteration to iteration: how far the target is raised, which part of the step is taken, whom to believe.
//!
//! A pass back gives the slack's slope by ln gamma and what the steps should gain. A pass forward tries them with the target that they
//! should just allow. It is taken if the target at which the slack would be zero is higher than before; else a smaller part of the step
//! is tried, and in the end a smaller region in which the derivatives are trusted.

use super::outlook::Outlook;

/// Parts of the step that are tried, one after the other.
const SHARES: [f32; 3] = [1.0, 0.3, 0.09];

/// What is trusted at first, of a relay's distance from the interferer and of ln gamma.
const TRUST: f32 = 0.5;

/// Trust below which a step says little about what is to come.
const RESTRAINED: f32 = 0.05;

/// Trust below which nothing is gained any more.
const LEAST_TRUST: f32 = 1e-4;

/// Hops as long as D in all lose half of it for each e-fold of the target: less than that is a chain that does not feel it yet.
const LEAST_SLOPE: f32 = 0.3;

/// By how much the target is above the ceiling when a chain is probed again, in ln gamma, at first.
const EXCESS: f32 = 0.03;

/// How much of the slack counts where it would outweigh a penalty, in parts of D: at first, and what is not made less.
const SPARE: f32 = 3e-3;
const LEAST_SPARE: f32 = 4e-5;

/// What slack that is missing is worth against such that is left over.
const SHORT: f32 = 2.0;

/// How close to the optimum is close enough, in ln gamma.
const CLOSE: f32 = 3e-6;

/// What a step has to promise, in ln gamma, where it is the last that is worth while.
const SETTLED: f32 = 0.3 * CLOSE;

/// What is so little to gain, in ln gamma, that where an ascent ends is known.
const FORESEEN: f32 = 1e-4;

/// Iterations after which an ascent has come near its target, and the slack that is missing, in parts of D, where it will not.
const ASTRAY_AFTER: u8 = 12;
const ASTRAY: f32 = 0.3;

/// The same where an ascent is over: less slack is made up for.
const ASTRAY_AT_END: f32 = 0.1;

/// Iterations after which what there is has to do.
const ITERATIONS: u8 = 40;

/// What to do next.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum AscentStep {
    /// Try this part of the step with this target, in ln gamma.
    Try { share: f32, sigma: f32 },
    /// Raise the target as far as the chain goes as it stands.
    Raise,
    /// Work out the steps anew.
    Again,
    /// It is over.
    Over,
}

/// The state of an ascent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Ascent {
    /// The target of the nominal chain, in ln gamma, and its slack, m.
    pub(crate) sigma: f32,
    pub(crate) slack: f32,
    /// The least target that may be tried.
    floor: f32,
    /// The most that is tried before the chain is probed, in ln gamma, and by how much that is raised next.
    limit: f32,
    excess: f32,
    /// How much of the slack counts, in parts of D: less and less where it would outweigh a penalty.
    spare: f32,
    /// The nominal chain's penalty, m.
    pub(crate) penalty: f32,
    distance_m: f32,
    /// The slack's slope by ln gamma, m.
    pub(crate) slope: f32,
    linear: f32,
    square: f32,
    pub(crate) trust: f32,
    /// Which of the shares is tried.
    share: u8,
    iterations: u8,
    idle: u8,
}

impl Ascent {
    /// From a chain that has `slack` for the target `sigma`.
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

    /// The same, to be probed at `limit` first.
    pub(crate) const fn probed_at(self, limit: f32) -> Self {
        Self {
            limit,
            excess: EXCESS,
            ..self
        }
    }

    /// The highest target for now.
    pub(crate) const fn limit(&self) -> f32 {
        self.limit
    }

    /// How much of the slack counts, m.
    pub(crate) fn spare_m(&self) -> f32 {
        self.spare * self.distance_m
    }

    /// Returns true if [`tighten`](Self::tighten) would.
    pub(crate) fn may_tighten(&self) -> bool {
        !(self.spare < LEAST_SPARE || self.penalty <= LEAST_SPARE * self.distance_m)
    }

    /// Whether less of the slack is to count from now on: where there is a penalty.
    pub(crate) fn tighten(&mut self) -> bool {
        if !self.may_tighten() {
            return false;
        }
        self.spare = (0.1 * self.spare).min(SPARE);
        true
    }

    /// The nominal chain's slack is that.
    pub(crate) const fn tightened(&mut self, slack: f32) -> AscentStep {
        self.slack = slack;
        self.trust = TRUST;
        (self.idle, self.iterations) = (0, 0);
        AscentStep::Again
    }

    /// Whether there is no higher one for now.
    pub(crate) fn at_limit(&self) -> bool {
        self.slack >= 0.0 && self.sigma >= self.limit
    }

    /// The probe came to nothing: the chain has to have more to spare.
    pub(crate) fn probed(&mut self) -> AscentStep {
        self.limit += self.excess;
        self.excess *= 4.0;
        self.trust = TRUST;
        AscentStep::Again
    }

    /// A pass back begins.
    pub(crate) const fn look_back(&mut self) {
        (self.slope, self.linear, self.square) = (0.0, 0.0, 0.0);
    }

    /// A part of the chain has been looked through.
    pub(crate) fn add(&mut self, outlook: &Outlook) {
        self.slope += outlook.by_target;
        self.linear += outlook.linear;
        self.square += outlook.square;
    }

    /// The pass back has come to the leader.
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
        // More than enough, and no use for it but a higher target.
        if self.slack > 1e-4 * self.distance_m && self.linear + self.square < 0.1 * self.slack {
            return AscentStep::Raise;
        }
        self.attempt()
    }

    /// Whether neither the slack nor the step is worth more than `by`, in ln gamma.
    fn is_within(&self, by: f32) -> bool {
        let least = by * -self.slope;
        self.slack.abs() < least && (self.linear + self.square).abs() < least
    }

    /// Whether it goes up a slope that leads nowhere: the target rises, and the chain does not follow.
    pub(crate) fn is_astray(&self) -> bool {
        self.iterations >= ASTRAY_AFTER && self.slack < -ASTRAY * self.distance_m
    }

    /// Whether a chain that is not improved any more may yet meet its target.
    pub(crate) fn is_kept_up_with(&self) -> bool {
        self.slack > -ASTRAY_AT_END * self.distance_m
    }

    /// Whether it is about to end, as `turn` has it, no higher than `sigma`. Where there is a penalty nobody can tell.
    pub(crate) fn ends_below(&self, turn: AscentStep, sigma: f32) -> bool {
        let gain = (self.linear + self.square).max(0.0);
        let end = self.sigma + (self.slack + gain).max(self.slack.min(0.0)) / -self.slope;
        matches!(turn, AscentStep::Try { .. })
            && self.penalty <= 0.0
            && self.is_within(FORESEEN)
            && self.trust >= RESTRAINED
            && end < sigma + SETTLED
    }

    /// The target for each part of the step.
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

    /// What a chain is worth that has `slack` for `sigma`: slack that is missing costs more than that which is left over gains.
    fn merit(&self, sigma: f32, slack: f32) -> f32 {
        sigma - slack.min(SHORT * slack) / self.slope
    }

    /// Whether a trial that has `slack` for `sigma` is better than the nominal chain.
    pub(crate) fn is_gain(&self, sigma: f32, slack: f32) -> bool {
        if sigma >= self.limit && slack >= 0.0 && self.sigma < self.limit {
            return true;
        }
        let by = self.merit(sigma, slack) - self.merit(self.sigma, self.slack);
        by > 0.0 || (by >= -1e-7 && slack.abs() < self.slack.abs())
    }

    /// The current trial came to nothing: the next part, or less trust.
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

    /// The trial with `share` is the nominal chain from now on.
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

    /// The target has been raised as far as the chain goes.
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
