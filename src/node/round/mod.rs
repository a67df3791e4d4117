//! Agreement on positions: the leader's messages along the chain and their results.
//!
//! A *pass* is a message that the leader sends along the chain, and its result, which comes back. All algorithms
//! consist of passes.
//!
//! | file | content |
//! | --- | --- |
//! | [`state`] | state table of a pass, and pass numbers |
//! | `computation` | state of a relay's part in a round, shared by all passes |
//! | `sweep` | sweep of targets (Algorithms 1 and 4) and its verdict |
//! | `gathering` | joint method: collection of profiles, and the relay's own solution of the chain |
//! | `turn` | token of Algorithm 2 |
//! | `sense` | collection of interference measurements, and the estimate |
//!
//! The passes import `computation`, which imports `state`. This file handles received messages and timers, and has the
//! leader's choice of the next pass.
//!
//! A received message proves that a neighbour was alive after a certain time. For the next relay, the proof is the
//! result of a pass, and the time is that of the pass's first transmission. For the previous relay, the proof is the
//! next pass, and the time is that of the last result's first transmission. If the leader's firmware calls
//! `Relay::restart`, the next pass begins before that result. The time for the previous relay is then up to one pass
//! too late.

mod computation;
mod gathering;
mod sense;
pub(crate) mod state;
mod sweep;
#[cfg(test)]
mod tests;
mod turn;

use super::circulation::{Circulation, Path, Reply};
use super::context::{Context, Effects, LayerEvent, Member, Peer};
use super::context::{PAUSE, earliest};
use super::measurement::{Findings, Meter, Sensing};
use crate::features::{ADJUST, ALTITUDE, SENSING};
use crate::mission::Profile;
use crate::optimiser::joint::fitted::SlotShares;
use crate::optimiser::pass::origins;
use crate::optimiser::plan::Planner;
use crate::optimiser::search::{Infeasible, Schedule};
use crate::place::Placement;
use crate::sample::Sample;
use crate::settings::{Method, Settings};
use crate::time::Instant;
use crate::wire::message::Message;

use computation::{Computation, LeaderTask, PassKind, TurnPass};
use state::{Action, Phase};

#[derive(Clone, Debug)]
pub(crate) struct Round {
    circulation: Circulation,
    work_at: Option<Instant>,
    computation: Computation,
}

impl Round {
    /// Creates the state of the agreement on positions when the relay starts. `leads` is true at the leader. The leader
    /// numbers its messages along the chain (passes) from `number`.
    pub(crate) const fn new(
        leads: bool,
        number: u16,
        profile: Profile,
        settings: &Settings,
        seed: u32,
        now: Instant,
    ) -> Self {
        Self {
            computation: Computation::new(leads, number, profile, settings, now),
            circulation: Circulation::new(seed),
            work_at: None,
        }
    }

    /// Handles a message of the current mission and view. A message from the leader comes from the previous relay, a
    /// reply from the next one. Work: at most the computation of this relay's positions for 16 target SIRs.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        let computation = &mut self.computation;
        let before = computation.state;
        let (forwarded_at, replied_at) = (
            self.circulation.started_at(),
            self.circulation.completed_at(),
        );
        let found = computation.sensing.findings();
        let next = match message {
            Message::Sweep(sweep) => computation.on_sweep(context, sweep),
            Message::Verdict(answer) => computation.on_verdict(context, answer),
            Message::Gather(roster) if ALTITUDE => computation.on_gather(context, roster),
            Message::Gathered(roster) if ALTITUDE => computation.on_gathered(context, roster),
            Message::Sense(hearing) if SENSING => computation.on_sense(context, hearing),
            Message::Sensed(hearing) if SENSING => computation.on_sensed(context, hearing),
            Message::Token(token) if ADJUST => computation.on_token(context, token),
            Message::Moved(moved) if ADJUST => computation.on_moved(context, moved),
            Message::Busy { number: sweep } => {
                if computation.phase() == Phase::Waiting && *sweep == computation.number() {
                    let path = self.path(context);
                    self.circulation.on_in_progress(context.now, path);
                }
                return Effects::NONE;
            }
            _ => return Effects::NONE,
        };
        let state = computation.state;
        let alive = if state.answers(before) {
            forwarded_at.map(|at| (Peer::Next, at))
        } else {
            replied_at
                .filter(|_| state.follows(before))
                .map(|at| (Peer::Previous, at))
        };
        Effects {
            alive,
            ..self.proceed_with(context, next, found)
        }
    }

    /// Handles expired timers of the agreement on positions. Work: at most one step of a long computation.
    pub(crate) fn handle_timeout(&mut self, context: &Context<'_>) -> Effects {
        let hop_time = context.settings().hop_time;
        let resent = self.circulation.handle_timeout(context.now, hop_time);
        let found = self.computation.sensing.findings();
        let next = if SENSING
            && self.computation.sensing.poll_due(context.now)
            && self.computation.may_sense(context)
        {
            self.computation.begin_sense(context)
        } else if self.work_at.is_some_and(|at| at <= context.now) {
            self.work_at = None;
            self.computation.work(context)
        } else {
            return Effects {
                resent,
                ..Effects::NONE
            };
        };
        Effects {
            resent,
            began: core::mem::take(&mut self.computation.began),
            ..self.proceed_with(context, next, found)
        }
    }

    /// Carries out the action `next`, and returns the effects on the other parts of the relay. The effects include
    /// the sensing results that have changed since `before`.
    fn proceed_with(&mut self, context: &Context<'_>, next: Action, before: Findings) -> Effects {
        let effects = self.proceed(context, next);
        if !SENSING {
            return effects;
        }
        self.computation.schedule_sensing(context);
        let found = self.computation.sensing.findings();
        Effects {
            sensed: found.since(&before, context.member),
            ..effects
        }
    }

    fn proceed(&mut self, context: &Context<'_>, next: Action) -> Effects {
        match next {
            Action::Nothing => Effects::NONE,
            Action::Foreign => Effects::FOREIGN,
            Action::Stale => Effects::STALE,
            Action::ContinueWithoutReply => {
                self.circulation.withdraw();
                self.work_soon(context.now);
                Effects::NONE
            }
            Action::Continue => {
                self.work_soon(context.now);
                Effects::NONE
            }
            Action::Forward => {
                self.circulation.start(context.now);
                self.work_at = None;
                Effects::NONE
            }
            Action::Repeat => {
                let path = context.path_to_leader();
                self.circulation.on_duplicate(context.now, path);
                Effects::DUPLICATE
            }
            Action::Answer { agreed } => {
                let path = context.path_to_leader();
                self.circulation.complete(context.now, path);
                // All profiles are known, so the joint solution can start.
                self.work_at = None;
                if self.computation.is_solving(context) {
                    self.work_soon(context.now);
                }
                if agreed {
                    Effects::of(LayerEvent::Converged)
                } else {
                    Effects::NONE
                }
            }
            Action::EndTask => {
                self.circulation.close();
                Effects::NONE
            }
            Action::Infeasible => {
                self.circulation.close();
                Effects::of(LayerEvent::Infeasible)
            }
        }
    }

    /// Handles a measurement of this relay's radio; returns true if the measurement was accepted.
    pub(crate) fn handle_sample(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        if sample.is_heard() {
            return SENSING
                && member.settings.listen.is_some()
                && self.computation.sensing.add_sample(now, member, sample);
        }
        let at = self.computation.agreed_place.filter(|_| member.index == 1);
        self.computation.meter.take(&member.mission, at, sample)
    }

    /// Schedules the next step of a computation after a pause, in which the caller can do other work.
    pub(crate) fn work_soon(&mut self, now: Instant) {
        self.work_at = Some(now + PAUSE);
    }

    /// Cancels the next step of a computation, so that a leader that leaves the chain sends no new message.
    pub(crate) const fn cancel_work(&mut self) {
        self.work_at = None;
    }

    pub(crate) fn restart(&mut self, context: &Context<'_>) -> Effects {
        self.computation.restart();
        self.proceed(context, Action::ContinueWithoutReply)
    }

    /// Ends the current pass along the chain without a result, because a new view is proposed.
    pub(crate) fn suspend(&mut self) {
        self.computation.suspend();
        self.circulation.cancel();
        self.work_at = None;
    }

    /// Resets the agreement on positions for a new view at `now`. `leads` is true at the view's leader. `works` is true
    /// if this relay starts to compute at once, without a message from the leader, as in the joint method.
    pub(crate) fn renew(&mut self, now: Instant, leads: bool, works: bool) {
        self.computation.renew(leads);
        if leads || works {
            self.work_soon(now);
        }
    }

    /// Loads a new mission, in which this relay has the altitude and power `profile`. The agreed position is kept.
    pub(crate) fn load(&mut self, profile: Profile) {
        self.computation.load(profile);
    }

    /// Discards the agreed position. The relay has none until the next agreement.
    pub(crate) fn discard_agreed_place(&mut self) {
        self.computation.discard_agreed_place();
    }

    #[cfg(all(test, feature = "departures"))]
    pub(crate) const fn set_agreed_place(&mut self, place: Placement) {
        self.computation.agreed_place = Some(place);
    }

    /// Schedules a retransmission of a message that awaits its reply. Called when the next relay is reachable again.
    pub(crate) fn resend(&mut self) {
        self.circulation.resend();
    }

    /// Returns the pending message for the next relay, and starts its retransmission timer. `None` if none is pending,
    /// or if no next relay can receive it (`reachable` is false).
    pub(crate) fn poll_onward(
        &mut self,
        context: &Context<'_>,
        reachable: bool,
    ) -> Option<Message> {
        let is_due = self.circulation.poll_forward();
        let message = self.computation.onward(context).filter(|_| is_due)?;
        let path = self.path(context);
        self.circulation.await_result(context.now, path);
        reachable.then_some(message)
    }

    /// Returns the pending reply to the previous relay and marks it as sent. `None` if none is pending, or if the
    /// previous relay cannot receive it (`reachable` is false).
    pub(crate) fn poll_back(&mut self, context: &Context<'_>, reachable: bool) -> Option<Message> {
        match self.circulation.poll_reply().filter(|_| reachable)? {
            Reply::Result => self.computation.back(context),
            Reply::InProgress => Some(Message::Busy {
                number: self.computation.number(),
            }),
        }
    }

    fn path(&self, context: &Context<'_>) -> Path {
        Path {
            slow: self.computation.is_slow(),
            ..context.path_to_last()
        }
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let due = earliest(self.work_at, self.circulation.next_timeout());
        earliest(due, self.computation.sensing.next_timeout())
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.computation.phase()
    }

    /// Returns true if this relay has taken part in no pass and in no view since its start.
    ///
    /// Its phase is then `Idle`. Always false at the leader of the mission, which starts in the phase `Planning`.
    pub(crate) fn is_idle(&self) -> bool {
        self.computation.phase() == Phase::Idle
    }

    pub(crate) fn is_solving(&self, context: &Context<'_>) -> bool {
        self.work_at.is_some() && self.computation.is_solving(context)
    }

    pub(crate) const fn is_untouched(&self) -> bool {
        self.computation.is_untouched()
    }

    /// Returns the position that the chain has agreed on; `None` before an agreement. The setpoint can differ from this
    /// position, because the guard (collision avoidance) limits the setpoint.
    pub(crate) const fn agreed_place(&self) -> Option<Placement> {
        self.computation.agreed_place
    }

    pub(crate) fn slot_shares(&self) -> Option<SlotShares> {
        self.computation.slot_shares()
    }

    pub(crate) const fn meter(&self) -> &Meter {
        &self.computation.meter
    }

    pub(crate) const fn sensing(&self) -> &Sensing {
        &self.computation.sensing
    }

    pub(crate) const fn target(&self) -> Option<f32> {
        self.computation.target
    }

    pub(crate) const fn bound(&self) -> Option<f32> {
        self.computation.bound
    }

    pub(crate) const fn profile(&self) -> Profile {
        self.computation.profile()
    }

    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        self.computation.rounds()
    }
}

/// Maximum number of hops per call of [`Computation::work`] in the prediction of the target SIR. Each hop is computed
/// for 16 target SIRs.
///
/// If the interference varies along x, one call computes only a part of one hop.
const HOPS_AT_ONCE: u16 = 12;

/// Maximum number of hops per call of [`Computation::work`] in a uniform interference field.
///
/// Such a hop takes twice as much computation as a hop with one interferer ([`HOPS_AT_ONCE`]).
const FIELD_HOPS_AT_ONCE: u16 = 8;

/// Choice of the next pass along the chain, and the computation before it, both by the leader.
impl Computation {
    /// Continues the computation for the current pass along the chain, or for the leader's next one.
    ///
    /// One call does at most one of these: 12 hops for 16 target SIRs; 128 points of an interference field that varies
    /// along x, or the points for one target if these are more; ten relays of the joint method; 624 positions of
    /// Algorithm 2.
    fn work(&mut self, context: &Context<'_>) -> Action {
        if self.state.phase() == Phase::Waiting {
            match &self.pass {
                PassKind::Sweep(sweep_pass) if !sweep_pass.is_done() => {
                    let unknown = ALTITUDE && sweep_pass.chosen && self.joint_place.is_none();
                    if unknown && self.solve(context).is_none() {
                        return Action::ContinueWithoutReply;
                    }
                    return self.continue_sweep(context);
                }
                PassKind::Turn(_) if ADJUST => return self.continue_turn(context),
                _ => {}
            }
        }
        if context.index() != context.mission().leader() || self.state.phase() == Phase::Waiting {
            return self.solve_ahead(context);
        }
        match self.plan(context) {
            Ok(true) => self.begin_pass(context),
            Ok(false) => Action::ContinueWithoutReply,
            Err(Infeasible) => self.give_up(),
        }
    }

    /// Continues the leader's computation before a pass along the chain. Returns true if the pass can start, or an
    /// error if no target SIR is feasible.
    fn plan(&mut self, context: &Context<'_>) -> Result<bool, Infeasible> {
        if self.must_distribute(context) || self.must_gather(context) {
            return Ok(true);
        }
        if self.is_solving(context) {
            if let Some(target) = self.solve(context) {
                self.search_joint_place(context, target)?;
                return Ok(true);
            }
            return Ok(false);
        }
        let (mission, profile) = (context.mission(), self.profile);
        match &mut self.task {
            LeaderTask::Idle => {
                self.begin_task(context)?;
                Ok(false)
            }
            LeaderTask::Predicting(planner) => {
                // The leader knows only its own profile, and assumes the mission's common one for the other relays.
                let profile_of = |index| {
                    if index == context.index() {
                        profile
                    } else {
                        mission.config().common
                    }
                };
                let hops = match mission.field() {
                    None => HOPS_AT_ONCE,
                    Some(field) if field.is_constant() => FIELD_HOPS_AT_ONCE,
                    Some(_) => 1,
                };
                let ladder = match planner.step(mission, profile_of, hops) {
                    Ok(None) => return Ok(false),
                    Ok(Some(agreed)) => Some(agreed.ladder),
                    // Other relays may have other profiles, so only the search can decide.
                    Err(Infeasible) => None,
                };
                let last = context.settings().method == Method::Align;
                self.search_with(context, ladder, last)?;
                Ok(true)
            }
            _ => Ok(true),
        }
    }

    #[inline(never)] // a planner is built here once; its stack is not for every call of `work`
    fn begin_task(&mut self, context: &Context<'_>) -> Result<(), Infeasible> {
        let Settings {
            predict, schedule, ..
        } = *context.settings();
        if predict && schedule == Schedule::Bracketed {
            let planner = Planner::new(context.mission(), self.profile, schedule)?;
            self.task.predict(planner);
            return Ok(());
        }
        self.search_by(
            context,
            schedule,
            None,
            context.settings().method == Method::Align,
            false,
        )
    }

    /// Starts the pass along the chain that the leader has planned.
    fn begin_pass(&mut self, context: &Context<'_>) -> Action {
        let mission = context.mission();
        if self.must_distribute(context) {
            return self.begin_sense(context);
        }
        if self.must_gather(context) {
            self.begin();
            return self.begin_gathering(context);
        }
        match &self.task {
            LeaderTask::Searching { search, given, .. } => {
                let ladder = *search.ladder();
                let chosen = context.solves_jointly() && self.joint_place.is_some() && !given;
                self.begin();
                self.sweep_on(context, ladder, chosen, None, &origins(mission))
            }
            LeaderTask::Adjusting(rounds) if ADJUST => {
                let (turn, sir) = (rounds.turn(), rounds.sir);
                self.begin();
                self.take_turn(context, TurnPass::new(turn, sir, None))
            }
            _ => Action::ContinueWithoutReply,
        }
    }
}
