//! Relay's part in a sweep of targets (Algorithms 1 and 4) and in its verdict.

use super::computation::{Computation, LeaderTask, PassKind};
use super::state::Action;
use crate::features::{ADJUST, ALTITUDE};
use crate::node::context::Context;
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::{Behind, Link, Verdict, close};
use crate::optimiser::spacing::RequiredPosition;
use crate::place::Station;
use crate::settings::Method;
use crate::side::Heading;
use crate::wire::message::{Sweep, SweepVerdict};

impl Computation {
    /// Handles a sweep from the previous relay: a pass along the chain that tries several target SIRs.
    pub(crate) fn on_sweep(&mut self, context: &Context<'_>, sweep: &Sweep) -> Action {
        let behind = Behind {
            relay: sweep.relay,
            measured_per_w: sweep.measured_per_w,
        };
        let print = fingerprint(Some(behind), &sweep.reaches);
        let same = matches!(&self.pass, PassKind::Sweep(sweep_pass)
            if sweep_pass.ladder == sweep.ladder
                && sweep_pass.chosen == sweep.chosen
                && sweep_pass.fingerprint == print);
        let arrival = self.state.arrival(sweep.number, same);
        if let Some(next) = arrival.refused() {
            return next;
        }
        if sweep.chosen && context.mission().interferer().is_none() {
            return Action::Stale;
        }
        if sweep.chosen && self.seats.is_partial(context.mission().relays()) {
            // This relay missed the pass with the profiles.
            return Action::Foreign;
        }
        self.state.accept(sweep.number);
        self.sweep_on(
            context,
            sweep.ladder,
            sweep.chosen,
            Some(behind),
            &sweep.reaches,
        )
    }

    /// Starts this relay's computation in a sweep, a pass along the chain that tries target SIRs. `from` has the
    /// previous node's farthest x in the direction of the pass for each target, m.
    pub(super) fn sweep_on(
        &mut self,
        context: &Context<'_>,
        ladder: Ladder,
        chosen: bool,
        behind: Option<Behind>,
        from: &PerTarget,
    ) -> Action {
        if !matches!(self.pass, PassKind::Sweep(_)) {
            self.pass = PassKind::Sweep(SweepPass::new(ladder));
        }
        let PassKind::Sweep(sweep_pass) = &mut self.pass else {
            return Action::Stale;
        };
        sweep_pass.ladder = ladder;
        sweep_pass.chosen = chosen;
        sweep_pass.begin(behind, from);
        self.state.wait();
        self.continue_sweep(context)
    }

    /// Continues this relay's computation in a sweep of target SIRs by one step.
    pub(super) fn continue_sweep(&mut self, context: &Context<'_>) -> Action {
        let is_chosen = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.chosen);
        if ALTITUDE && is_chosen && self.chosen.is_none() {
            // The relay first needs its joint solution.
            return Action::Work;
        }
        let link = self.link(context, is_chosen);
        let PassKind::Sweep(sweep_pass) = &mut self.pass else {
            return Action::Stale;
        };
        if !sweep_pass.advance(link) {
            return Action::Work;
        }
        if context.is_last() {
            self.conclude_sweep(context)
        } else {
            Action::Forward
        }
    }

    /// Handles a verdict, the reply with the result of a sweep, from the next relay.
    pub(crate) fn on_verdict(&mut self, context: &Context<'_>, answer: &SweepVerdict) -> Action {
        let is_chosen = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.chosen);
        let link = self.link(context, is_chosen);
        if let PassKind::Sweep(sweep_pass) = &mut self.pass
            && self.state.is_awaited(answer.number)
            && sweep_pass.apply_sweep_verdict(link, answer)
        {
            return self.conclude_sweep(context);
        }
        Action::Stale
    }

    /// Handles the result of a sweep of target SIRs. If a target is committed, this relay agrees on its position for that target. Otherwise
    /// the leader continues its search.
    pub(super) fn conclude_sweep(&mut self, context: &Context<'_>) -> Action {
        let PassKind::Sweep(sweep_pass) = &self.pass else {
            return Action::Stale;
        };
        if let Some((x_m, target)) = sweep_pass.agreed() {
            let chosen = sweep_pass.chosen;
            if let LeaderTask::Searching { search, given, .. } = &self.task {
                // A sweep at some cross-sections is no bound for chains with other ones.
                let most = search.most(&sweep_pass.verdict.slacks);
                self.bound = most.filter(|_| !chosen && !given);
            }
            let cross_section = self.station_for(chosen).cross_section;
            self.agree_on(cross_section.at(x_m), cross_section);
            self.target = Some(target);
            let fitted = self.fitted.first().filter(|_| chosen);
            let shares = fitted.and_then(|fitted| Some(fitted.solved?.1));
            self.set_slot_shares(shares);
            if let LeaderTask::Searching { search, .. } = &mut self.task
                && !search.accept(target)
            {
                self.state.answer();
                return Action::Work;
            }
            return self.agree(context);
        }
        self.state.answer();
        if self.must_gather(context) {
            return Action::Work;
        }
        let LeaderTask::Searching { search, .. } = &mut self.task else {
            return Action::Answer { agreed: false };
        };
        let verdict = &sweep_pass.verdict;
        let next = match search.refused(context.mission(), verdict) {
            Some(target) => {
                let most = search.most(&verdict.slacks);
                search.refuse(context.mission(), self.profile, target, most)
            }
            None => search.advance(&verdict.slacks),
        };
        if next.is_err() {
            let chosen = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.chosen);
            if !chosen || self.search_configured(context).is_err() {
                return self.give_up();
            }
        }
        Action::Work
    }

    /// Completes the agreement on a target SIR, or starts the next algorithm of the settings' method.
    pub(super) fn agree(&mut self, context: &Context<'_>) -> Action {
        self.state.hold();
        if let LeaderTask::Searching { last: false, .. } = self.task {
            match context.settings().method {
                Method::Adjust(adjust) if ADJUST => {
                    self.task.adjust(adjust);
                    self.state.answer();
                    return Action::Work;
                }
                Method::Joint if self.must_gather(context) => {
                    self.state.answer();
                    return Action::Work;
                }
                _ => {}
            }
        }
        self.task.clear();
        Action::Answer { agreed: true }
    }
}

/// State of a sweep of target SIRs at one relay.
#[derive(Clone, Debug)]
pub(crate) struct SweepPass {
    pub(crate) ladder: Ladder,
    /// Checksum of the previous relay's data in the sweep, to recognise duplicates; see [`fingerprint`].
    pub(crate) fingerprint: u32,
    /// True if the relays use the lateral offsets and altitudes that the joint method has computed.
    pub(crate) chosen: bool,
    /// True if a later relay on this pass has its own power or fixed altitude, other than the mission's.
    pub(crate) own: bool,
    behind: Option<Behind>,
    /// Farthest x in the direction of the pass at which the previous node meets each target SIR, m.
    from: PerTarget,
    /// Reaches of this relay, one for each target SIR, m. A reach is the farthest x in the direction of the pass at
    /// which the relay meets the target.
    pub(crate) reaches: PerTarget,
    /// True once this relay's farthest x is computed for all targets.
    done: bool,
    pub(crate) verdict: Verdict,
    /// x of this relay for the target SIR that was committed, m; `None` if none was committed.
    place: Option<f32>,
    /// x that the previous relay must take for the target SIR that was committed, m. `None` if it takes the farthest
    /// x that meets the target.
    required_x_m: Option<f32>,
}

impl SweepPass {
    pub(crate) const fn new(ladder: Ladder) -> Self {
        Self {
            ladder,
            fingerprint: 0,
            chosen: false,
            own: false,
            behind: None,
            from: PerTarget::new(),
            reaches: PerTarget::new(),
            done: false,
            verdict: Verdict {
                commit: None,
                slacks: PerTarget::new(),
            },
            place: None,
            required_x_m: None,
        }
    }

    /// Starts a sweep with the data of its sender, the node before this relay on the pass. `behind` describes that
    /// relay, `None` if the node is Tx or Rx; `from` has its farthest x for each target, m.
    pub(crate) fn begin(&mut self, behind: Option<Behind>, from: &PerTarget) {
        self.fingerprint = fingerprint(behind, from);
        self.behind = behind;
        self.from.clone_from(from);
        self.reaches.clear();
        self.done = false;
        self.own = false;
        self.place = None;
        self.required_x_m = None;
    }

    /// Continues the computation of this relay's farthest x for each target. The last relay also decides the verdict,
    /// which says if a target is committed. Returns true when the computation is complete.
    ///
    /// Work: at most 16 targets; in a field of interference 128 of its points, or one target.
    pub(crate) fn advance(&mut self, link: Link<'_>) -> bool {
        let link = self.link(link);
        let targets = self.ladder.targets();
        self.done = link.go_on(&targets, &self.from, &mut self.reaches);
        if self.done && link.mission.after(link.index).is_none() {
            self.verdict = close(&link, self.ladder, &self.from, &self.reaches);
            let place = self
                .committed()
                .zip(self.committed_before())
                .and_then(|((target, reach), from_m)| Some(link.ending(target, from_m, reach)?.1));
            self.store_position(&link, place);
        }
        self.done
    }

    /// Accepts a verdict, the result of a sweep, if this relay has a position for the committed target. Returns true
    /// if the verdict was accepted.
    pub(crate) fn apply_sweep_verdict(&mut self, link: Link<'_>, answer: &SweepVerdict) -> bool {
        let link = self.link(link);
        let (verdict, slacks) = (&answer.verdict, &answer.verdict.slacks);
        let met = |target: u8| {
            slacks
                .get(usize::from(target))
                .is_some_and(|slack| *slack >= 0.0)
        };
        let fits = slacks.len() <= self.reaches.len() && verdict.commit.is_none_or(met);
        if !(self.done && fits) {
            return false;
        }
        let position = |(_, reach): (f32, f32)| match (answer.required_x_m, link.mission.heading())
        {
            (None, _) => Some(reach),
            (Some(x_m), Heading::TowardRx) => (x_m <= reach).then_some(x_m),
            (Some(x_m), Heading::TowardTx) => (reach..=link.mission.config().distance_m)
                .contains(&x_m)
                .then_some(x_m),
        };
        self.verdict = verdict.clone();
        self.own = answer.own;
        let place = self.committed().and_then(position);
        self.store_position(&link, place);
        true
    }

    /// Stores this relay's x for the committed target SIR, `place`, m. Computes from it the x that the previous relay
    /// must take. If that relay has no such x, the commitment is revoked.
    fn store_position(&mut self, link: &Link<'_>, place: Option<f32>) {
        if self.verdict.commit.is_none() {
            return;
        }
        let before = self.committed_before();
        let required = match (self.committed(), before, place) {
            (Some((target, _)), Some(from_m), Some(place)) => {
                link.required_position(target, from_m, place)
            }
            _ => None,
        };
        match required {
            Some(required) => {
                self.place = place;
                self.required_x_m = match required {
                    RequiredPosition::AtReach => None,
                    RequiredPosition::At(x_m) => Some(x_m),
                };
            }
            None => self.verdict.commit = None,
        }
    }

    /// Returns the target SIR that was committed, and the farthest x, m, at which this relay meets it. `None` if none
    /// was.
    fn committed(&self) -> Option<(f32, f32)> {
        let commit = usize::from(self.verdict.commit?);
        Some((
            *self.ladder.targets().get(commit)?,
            *self.reaches.get(commit)?,
        ))
    }

    /// Returns the farthest x, m, at which the previous node meets the committed target SIR. `None` if no target is
    /// committed.
    fn committed_before(&self) -> Option<f32> {
        self.from.get(usize::from(self.verdict.commit?)).copied()
    }

    /// Returns this relay's agreed x, m, and the committed target SIR. `None` if no target is committed.
    pub(crate) fn agreed(&self) -> Option<(f32, f32)> {
        Some((self.place?, self.committed()?.0))
    }

    pub(crate) const fn required_x_m(&self) -> Option<f32> {
        self.required_x_m
    }

    pub(crate) const fn is_done(&self) -> bool {
        self.done
    }

    fn link<'a>(&self, link: Link<'a>) -> Link<'a> {
        Link {
            behind: self.behind,
            plain: link.plain || self.ladder.is_plain(),
            ..link
        }
    }
}

/// Returns a checksum of the data of a sweep's sender. `behind` is `None` if the pass starts at this relay, next to Tx
/// or Rx. The checksum distinguishes a duplicate from a sweep that a restarted relay sends with other data.
pub(crate) fn fingerprint(behind: Option<Behind>, from: &PerTarget) -> u32 {
    let values = behind.map_or([0.0; 3], |behind| {
        let Station {
            cross_section,
            power_w,
        } = behind.relay;
        [cross_section.y_m, cross_section.altitude_m, power_w]
    });
    values.iter().chain(from).fold(0, |sum: u32, value| {
        sum.rotate_left(5).wrapping_add(value.to_bits())
    })
}
