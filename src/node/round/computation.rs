//! State of one relay during an agreement on positions: current pass, own position and target SIR.
//!
//! A pass is a message along the chain whose result comes back. All kinds of passes share this state, which also has
//! the leader's current task. The files of the passes have their handlers.

use super::state::{Action, Phase, RoundState};
use crate::features::{ADJUST, ALTITUDE, SENSING};
use crate::mission::{Mission, Profile};
use crate::node::context::Context;
use crate::node::measurement::{Meter, Sense, Sensing};
use crate::optimiser::PerTarget;
use crate::optimiser::joint::fitted::SlotShares;
use crate::optimiser::joint::{MOST_SOLVED, Seat, Solver};
use crate::optimiser::ladder::Ladder;
use crate::optimiser::local::{HopEnd, Hops, LocalSearch};
use crate::optimiser::pass::{Behind, Link, Verdict, close};
use crate::optimiser::plan::Planner;
use crate::optimiser::search::{Infeasible, Schedule, Search};
use crate::optimiser::spacing::RequiredPosition;
use crate::place::{CrossSection, Placement, Station};
use crate::settings::{Adjust, Settings};
use crate::side::Heading;
use crate::time::Instant;
use crate::wire::message::{AdjustStep, Message, Moved, Roster, Sweep, SweepVerdict, Token};
use core::task::Poll;

/// Kind and data of the current pass: a message along the chain, and its result on the way back.
#[derive(Clone, Debug)]
pub(super) enum PassKind {
    Sweep(SweepPass),
    Gather(Roster),
    Sense(Sense),
    Turn(TurnPass),
}

/// Lateral offset, altitude and maximum x that the joint method has computed for this relay. The joint method optimises
/// x, y and altitude of all relays together.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointPlace {
    /// Lateral offset and altitude that this relay has computed for itself.
    pub(super) cross_section: CrossSection,
    /// Largest allowed x of this relay, m. Beyond it the relays nearer to Rx could not keep the minimum separation.
    /// Unused in an interference field.
    pub(super) end_m: f32,
    /// True if every relay takes the x farthest from the leader that meets the target SIR.
    ///
    /// False if a relay may take an x nearer to the leader, which helps the next hop.
    pub(super) plain: bool,
}

/// Time slots of this relay, each as long as its hop needs. Unused if all slots have the same length.
#[derive(Clone, Copy, Debug)]
pub(super) struct FittedSlots {
    /// The x of this relay in the joint solution, m, and its slots at this x. Slots are fractions of the frame (all
    /// slots together).
    ///
    /// `None` without a solution.
    pub(super) solved: Option<(f32, SlotShares)>,
    /// Start and end of this relay's slots at the agreed positions. They are fractions of the frame (all slots
    /// together). `None` without an agreement.
    pub(super) agreed: Option<SlotShares>,
}

impl FittedSlots {
    const NONE: Self = Self {
        solved: None,
        agreed: None,
    };
}

/// State of one relay in the placement algorithms: current pass, own position, and task as the leader.
#[derive(Clone, Debug)]
pub(crate) struct Computation {
    pub(super) state: RoundState,
    pub(super) pass: PassKind,
    pub(super) task: LeaderTask,
    /// True from the start of a pass along the chain until the statistics have counted this pass.
    pub(super) began: bool,
    /// Altitude and transmit power of this relay in the mission.
    pub(super) profile: Profile,
    /// Altitudes and powers of the relays of this view, as collected along the chain.
    pub(super) seats: Seats,
    /// Position computed for this relay by the joint method; `None` before the computation.
    pub(super) joint_place: Option<JointPlace>,
    /// Lateral offset and altitude that the chain has agreed on for this relay.
    pub(super) cross_section: CrossSection,
    /// Position and power of the next relay toward Rx, as last reported; `None` if unknown. In Algorithm 2 (relays move
    /// in turn) that relay is the receiver of the hop from this relay.
    pub(super) after: Option<HopEnd>,
    pub(super) agreed_place: Option<Placement>,
    /// Time slots of this relay that are as long as each hop needs. Empty without the feature `altitude`.
    pub(super) fitted: [FittedSlots; ALTITUDE as usize],
    /// Average of the interference measured at the agreed position. Used only if the interference is known as a
    /// function of x (a field).
    pub(super) meter: Meter,
    /// Measurements of the unknown interferer, and the chain's estimate of it.
    pub(super) sensing: Sensing,
    pub(super) target: Option<f32>,
    /// Upper bound of the worst hop's SIR at the configured altitudes, linear. The bound holds for all x of the relays.
    /// `None` until it is known, and always at a relay other than the leader.
    pub(super) bound: Option<f32>,
}

impl Computation {
    /// Creates the state of the placement algorithms at a start. A leader starts in the phase `Planning`, and numbers
    /// its passes along the chain from `number`.
    pub(crate) const fn new(
        leader: bool,
        number: u16,
        profile: Profile,
        settings: &Settings,
        now: Instant,
    ) -> Self {
        Self {
            state: RoundState::new(if leader { Phase::Planning } else { Phase::Idle }, number),
            pass: PassKind::Sweep(SweepPass::new(Ladder::single(1.0))),
            task: LeaderTask::Idle,
            began: false,
            profile,
            seats: Seats::UNKNOWN,
            joint_place: None,
            cross_section: profile.on_line().cross_section,
            after: None,
            agreed_place: None,
            fitted: [FittedSlots::NONE; ALTITUDE as usize],
            meter: Meter::new(settings.measure),
            sensing: Sensing::new(settings.listen, now),
            target: None,
            bound: None,
        }
    }

    /// Returns true until this relay starts a task, takes part in a pass, or agrees on a position. A pass is a message
    /// along the chain.
    pub(crate) const fn is_untouched(&self) -> bool {
        let at_first = matches!(self.state.phase(), Phase::Idle | Phase::Planning);
        at_first && matches!(self.task, LeaderTask::Idle) && self.agreed_place.is_none()
    }

    pub(crate) fn load(&mut self, profile: Profile) {
        self.profile = profile;
        self.joint_place = None;
        self.seats = Seats::UNKNOWN;
        self.sensing.load();
        if self.agreed_place.is_none() {
            self.cross_section = profile.on_line().cross_section;
        }
    }

    pub(crate) fn discard_agreed_place(&mut self) {
        self.agreed_place = None;
        self.set_slot_shares(None);
        self.after = None;
    }

    /// Restarts the leader's search for the best target SIR.
    pub(crate) fn restart(&mut self) {
        self.task.clear();
        // After a new joint solution the leader starts again from the first targets.
        self.joint_place = None;
        self.state.plan();
    }

    pub(crate) fn suspend(&mut self) {
        self.task.clear();
        self.pass = PassKind::Sweep(SweepPass::new(Ladder::single(1.0)));
        self.state.answer();
    }

    /// Resets the computation for a new view. `leads` is true at the view's leader.
    pub(crate) fn renew(&mut self, leads: bool) {
        self.task.clear();
        // The slots belong to the mission and the hops of the previous view.
        self.set_slot_shares(None);
        self.after = None;
        self.joint_place = None;
        self.seats = Seats::UNKNOWN;
        self.sensing.renew();
        self.state.renew(leads);
    }

    /// Sets the agreed position to `place`, and the agreed lateral offset and altitude to `cross_section`.
    #[inline(never)]
    pub(super) fn agree_on(&mut self, place: Placement, cross_section: CrossSection) {
        self.agreed_place = Some(place);
        self.cross_section = cross_section;
        // Samples at the previous position must not be used.
        self.meter.restart();
    }

    /// Returns this relay's slots at the agreed positions, as fractions of the frame (all slots together). `None`
    /// unless each slot is as long as its hop needs.
    pub(crate) fn slot_shares(&self) -> Option<SlotShares> {
        self.fitted.first()?.agreed
    }

    pub(super) fn set_slot_shares(&mut self, shares: Option<SlotShares>) {
        if let Some(fitted) = self.fitted.first_mut() {
            fitted.agreed = shares;
        }
    }

    pub(super) fn begin(&mut self) {
        self.state.begin();
        self.began = true;
    }

    /// Starts the search for the highest feasible target SIR with the targets in `ladder`. `None` stands for the usual
    /// first targets. `last` is true if no other algorithm follows the search.
    pub(super) fn search_with(
        &mut self,
        context: &Context<'_>,
        ladder: Option<Ladder>,
        last: bool,
    ) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, ladder, last, false)
    }

    /// Starts the search for the target SIR at the configured lateral offsets and altitudes.
    ///
    /// This search follows if no target is feasible at the joint method's lateral offsets and altitudes.
    pub(super) fn search_configured(&mut self, context: &Context<'_>) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, None, true, true)
    }

    #[inline(never)]
    pub(super) fn search_by(
        &mut self,
        context: &Context<'_>,
        schedule: Schedule,
        ladder: Option<Ladder>,
        last: bool,
        given: bool,
    ) -> Result<(), Infeasible> {
        let mut search = Search::new(context.mission(), self.profile, schedule)?;
        if let Some(ladder) = ladder {
            search.begin_with(ladder);
        }
        self.task.search(search, last, given);
        Ok(())
    }

    pub(super) fn give_up(&mut self) -> Action {
        self.state.give_up();
        Action::Infeasible
    }

    /// Returns the message of the current pass along the chain for the next relay. `None` if the pass has ended, or
    /// while this relay computes.
    pub(crate) fn onward(&self, context: &Context<'_>) -> Option<Message> {
        if self.state.phase() != Phase::Waiting {
            return None;
        }
        let (number, view_digest) = (self.state.number(), context.digest());
        match &self.pass {
            PassKind::Sweep(sweep_pass) if !sweep_pass.is_done() => None,
            PassKind::Sweep(sweep_pass) => Some(Message::Sweep(Sweep {
                number,
                view_digest,
                ladder: sweep_pass.ladder,
                relay: self.station_for(sweep_pass.chosen),
                chosen: sweep_pass.chosen,
                measured_per_w: self.meter.published(),
                reaches: sweep_pass.reaches.clone(),
            })),
            PassKind::Gather(roster) if ALTITUDE => Some(Message::Gather(roster.clone())),
            PassKind::Sense(sense) if SENSING => Some(Message::Sense(sense.hearing)),
            PassKind::Turn(turn_pass) if turn_pass.is_searching() => None,
            PassKind::Turn(turn_pass) if ADJUST => self.agreed_place.map(|place| {
                Message::Token(Token {
                    number,
                    view_digest,
                    place,
                    power_w: self.profile.power_w,
                    turn: turn_pass.turn,
                    sir: turn_pass.sir,
                })
            }),
            _ => None,
        }
    }

    /// Returns true if each relay computes for long before it forwards the message of the current pass.
    pub(crate) const fn is_slow(&self) -> bool {
        match &self.pass {
            PassKind::Turn(_) => true,
            PassKind::Sweep(sweep_pass) => sweep_pass.chosen,
            PassKind::Gather(_) | PassKind::Sense(_) => false,
        }
    }

    /// Returns the reply to the previous relay, with the result of the pass along the chain. `None` until the result is
    /// known.
    pub(crate) fn back(&self, context: &Context<'_>) -> Option<Message> {
        if !self.state.is_answered() {
            return None;
        }
        let (number, view_digest) = (self.state.number(), context.digest());
        match &self.pass {
            PassKind::Sweep(sweep_pass) => Some(Message::Verdict(SweepVerdict {
                number,
                view_digest,
                verdict: sweep_pass.verdict.clone(),
                required_x_m: sweep_pass.required_x_m(),
                own: sweep_pass.own || self.has_own_profile(context),
            })),
            PassKind::Gather(roster) if ALTITUDE => Some(Message::Gathered(roster.clone())),
            PassKind::Sense(sense) if SENSING => Some(Message::Sensed(sense.hearing)),
            PassKind::Turn(turn_pass) if ADJUST => self.agreed_place.map(|place| {
                Message::Moved(Moved {
                    number,
                    view_digest,
                    place,
                    position_changed: turn_pass.any,
                    worst_sir: turn_pass.worst,
                    power_w: self.profile.power_w,
                })
            }),
            _ => None,
        }
    }

    pub(crate) const fn number(&self) -> u16 {
        self.state.number()
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.state.phase()
    }

    pub(crate) const fn profile(&self) -> Profile {
        Profile {
            altitude_m: self.cross_section.altitude_m,
            power_w: self.profile.power_w,
        }
    }

    /// Returns the lateral offset, altitude and power with which this relay tries target SIRs. If `chosen` is true,
    /// offset and altitude are those of the joint method; otherwise they are those configured.
    pub(super) fn station_for(&self, chosen: bool) -> Station {
        let given = self.profile.on_line();
        match self.joint_place {
            Some(JointPlace { cross_section, .. }) if chosen => Station {
                cross_section,
                ..given
            },
            _ => given,
        }
    }

    /// Returns the number of completed rounds of Algorithm 2, and the chain's SIR after the last round. In Algorithm 2
    /// the relays move in turn. `None` unless this relay is the leader and runs Algorithm 2.
    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        match &self.task {
            LeaderTask::Adjusting(rounds) => Some((rounds.done(), rounds.sir)),
            _ => None,
        }
    }
}

/// Solver of the joint method (x, y and altitude of all relays together). It works for up to [`MOST_SOLVED`] relays.
pub(crate) type ChainSolver = Solver<MOST_SOLVED, { MOST_SOLVED / 10 }>;

/// Current task of the leader: prediction, joint method, search for the target SIR, or Algorithm 2.
#[cfg_attr(
    feature = "altitude",
    expect(
        clippy::large_enum_variant,
        reason = "a relay has a single value of this type, and this crate does not allocate"
    )
)]
#[derive(Clone, Debug)]
pub(crate) enum LeaderTask {
    /// No task: this relay is not the leader, has not started, or has finished.
    Idle,
    /// Prediction of the target SIR from the mission. The first targets that the chain tries are near the predicted
    /// one.
    Predicting(Planner),
    /// Solution of the whole chain by the joint method. Every relay computes it.
    Solving(ChainSolver),
    /// Search for the highest target SIR that the chain meets at fixed lateral offsets and altitudes.
    Searching {
        search: Search,
        /// True if no other algorithm follows this search.
        last: bool,
        /// True for the search at the configured altitudes. It follows if no target was feasible at the joint method's
        /// altitudes.
        given: bool,
    },
    /// Algorithm 2, in which the relays move one after the other.
    Adjusting(Rounds),
}

/// Progress of Algorithm 2 (relays move in turn): number of rounds, and SIR of the chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounds {
    adjust: Adjust,
    /// Number of completed rounds of Algorithm 2 (relays move in turn). The first pass of its token along the chain, in
    /// which no relay moves, does not count.
    done: u16,
    turn: AdjustStep,
    /// SIR of the chain's worst hop after the last round of Algorithm 2 (relays move in turn), linear.
    pub(crate) sir: f32,
}

impl Rounds {
    pub(crate) const fn new(adjust: Adjust) -> Self {
        Self {
            adjust,
            done: 0,
            turn: AdjustStep::Look,
            sir: 0.0,
        }
    }

    pub(crate) const fn turn(&self) -> AdjustStep {
        self.turn
    }

    pub(crate) const fn done(&self) -> u16 {
        self.done
    }

    /// Records the result of a pass of Algorithm 2's token along the chain. Returns true if it was the last pass. `any`
    /// is true if any relay has moved in this pass. `sir` is the SIR of the chain's worst hop, linear.
    pub(crate) fn advance(&mut self, any: bool, sir: f32) -> bool {
        self.sir = sir;
        let idle = match self.turn {
            AdjustStep::Stop => return true,
            AdjustStep::Look => false,
            AdjustStep::Move { .. } => {
                self.done = self.done.saturating_add(1);
                !any
            }
        };
        self.turn = if idle || self.done >= self.adjust.rounds {
            AdjustStep::Stop
        } else {
            AdjustStep::Move {
                explore_m: self.adjust.explore_m,
                local: self.adjust.local,
            }
        };
        false
    }
}

impl LeaderTask {
    pub(crate) fn clear(&mut self) {
        *self = Self::Idle;
    }

    pub(crate) fn predict(&mut self, planner: Planner) {
        *self = Self::Predicting(planner);
    }

    /// Starts the joint method with a new solver.
    #[inline(never)] // or the stack of each step has room for a second solver
    pub(crate) fn solve(&mut self) {
        *self = Self::Solving(ChainSolver::NEW);
    }

    /// Starts a search for the highest feasible target SIR. `last` is true if no other algorithm follows. `given` is
    /// true for a search at the configured altitudes, because no target is feasible at the joint method's altitudes.
    pub(crate) fn search(&mut self, search: Search, last: bool, given: bool) {
        *self = Self::Searching {
            search,
            last,
            given,
        };
    }

    pub(crate) fn adjust(&mut self, adjust: Adjust) {
        *self = Self::Adjusting(Rounds::new(adjust));
    }
}

/// State of one relay in a sweep: a pass along the chain that tries several target SIRs.
#[derive(Clone, Debug)]
pub(crate) struct SweepPass {
    pub(crate) ladder: Ladder,
    /// Checksum of the previous relay's data; equal checksums show a duplicate. See [`fingerprint`].
    pub(crate) fingerprint: u32,
    /// True if the relays use the lateral offsets and altitudes of the joint method.
    pub(crate) chosen: bool,
    /// True if a relay farther along the sweep has a power or fixed altitude other than the mission's.
    pub(crate) own: bool,
    behind: Option<Behind>,
    /// Farthest x of the previous node along the sweep that meets the target SIR, m; one x per target.
    from: PerTarget,
    /// Farthest x of this relay along the sweep that meets the target SIR, m; one x per target.
    pub(crate) reaches: PerTarget,
    /// True once this relay's farthest x is computed for all targets.
    done: bool,
    pub(crate) verdict: Verdict,
    /// The relay's x for the committed target SIR, m; `None` if no target is committed.
    place: Option<f32>,
    /// x that the previous relay must take for the committed target SIR, m. `None` if the previous relay takes its
    /// farthest x for the target.
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

    /// Starts this relay's part in a sweep, with the data of the previous node.
    ///
    /// `behind` describes the previous node; `None` if that is Tx or Rx. `from` has, for each target SIR, the
    /// farthest x at which the previous node meets this target, m.
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

    /// Continues the computation of this relay's farthest x for each target. Returns true when it is complete. Then the
    /// last relay also decides which target is committed, if any.
    ///
    /// Work: at most 16 targets; in an interference field 128 points of the field, or one target.
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

    /// Accepts the result of a sweep if this relay has a position for the committed target. Returns true on acceptance.
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

    /// Stores this relay's x for the committed target SIR, `place`, m. From `place` follows the x that the previous
    /// relay must take. If no x is possible for that relay, or if `place` is `None`, the commitment is revoked.
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

    /// Returns the committed target SIR, and the farthest x at which this relay meets this target, m. `None` if no
    /// target is committed.
    fn committed(&self) -> Option<(f32, f32)> {
        let commit = usize::from(self.verdict.commit?);
        Some((
            *self.ladder.targets().get(commit)?,
            *self.reaches.get(commit)?,
        ))
    }

    /// Returns the farthest x at which the previous node meets the committed target SIR, m. `None` if no target is
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

/// Returns a checksum of the previous node's data in a sweep. `behind` is `None` if that node is Tx or Rx.
///
/// The checksum distinguishes a duplicate from a new sweep with different data, which a restarted relay sends.
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

/// State of one relay while the token of Algorithm 2 (relays move in turn) travels along the chain.
#[derive(Clone, Debug)]
pub(crate) struct TurnPass {
    /// Action of every relay in this pass of Algorithm 2's token: look, move or stop.
    pub(crate) turn: AdjustStep,
    /// SIR of the chain's worst hop before this pass of Algorithm 2's token, linear.
    pub(crate) sir: f32,
    /// Position and power of the previous relay, which sends to this relay; `None` if Tx is the sender.
    pub(super) before: Option<HopEnd>,
    search: Option<LocalSearch>,
    /// True if this relay, or a relay farther from the leader, has moved in this pass of the token.
    pub(crate) any: bool,
    /// Worst SIR of the hops between this relay and Rx, linear.
    pub(crate) worst: f32,
}

impl TurnPass {
    pub(crate) const fn new(turn: AdjustStep, sir: f32, before: Option<HopEnd>) -> Self {
        Self {
            turn,
            sir,
            before,
            search: None,
            any: false,
            worst: f32::MAX,
        }
    }

    /// Starts a search for a better position around `at`. `band` is the lowest and the highest altitude, m. Returns
    /// false, and does not search, if relays do not move in this pass of the token.
    pub(crate) fn begin(&mut self, hops: Hops, at: Placement, band: (f32, f32)) -> bool {
        if let AdjustStep::Move { explore_m, local } = self.turn {
            self.search = Some(LocalSearch::new(local, hops, at, explore_m, band));
        }
        self.search.is_some()
    }

    /// Continues the search: evaluates `budget` positions, and then the rest of the last grid row.
    ///
    /// Returns `Ready` at the end of the search, with a better position, or with `None` if none was found.
    pub(crate) fn step(&mut self, budget: u16) -> Poll<Option<Placement>> {
        let Some(search) = &mut self.search else {
            return Poll::Ready(None);
        };
        let Poll::Ready(found) = search.step(budget) else {
            return Poll::Pending;
        };
        self.search = None;
        self.any |= found.is_some();
        Poll::Ready(found)
    }

    pub(crate) const fn is_searching(&self) -> bool {
        self.search.is_some()
    }
}

/// Altitudes and transmit powers of the view's relays, as far as they are known.
#[derive(Clone, Debug)]
pub(super) struct Seats {
    /// Number of relays, from Tx on, whose profiles are known. `None` before the first collection of profiles.
    pub(super) known: Option<u16>,
    /// Altitude, m, and power, W, of each relay. The altitude is 0 if the relay chooses its altitude itself. The power
    /// is 0 if the relay has the power and altitude of the mission's common profile.
    own: [[f32; 2]; MOST_SOLVED],
}

impl Seats {
    pub(super) const UNKNOWN: Self = Self {
        known: None,
        own: [[0.0; 2]; MOST_SOLVED],
    };

    /// Returns the collected profile of relay `index`, or the common profile if none was collected for it.
    #[inline(never)] // the solver asks in many places
    pub(super) fn of(&self, mission: &Mission, index: u16) -> Seat {
        let at = usize::from(index).wrapping_sub(1);
        match self.own.get(at) {
            Some(&[altitude_m, power_w]) if power_w > 0.0 => {
                let own = Profile {
                    altitude_m,
                    power_w,
                };
                Seat::of(mission, own, altitude_m > 0.0)
            }
            _ => Seat::common(mission),
        }
    }

    /// Returns true if some of the `relays` profiles were collected, but not all.
    pub(super) fn is_partial(&self, relays: u16) -> bool {
        self.known.is_some_and(|known| known < relays)
    }

    /// Stores the profiles in `roster`, collected from `relays` relays. Returns true if all profiles are now known.
    pub(super) fn adopt(&mut self, roster: &Roster, relays: u16) -> bool {
        for seat in &roster.seats {
            let at = usize::from(seat.index).wrapping_sub(1);
            if let Some(own) = self.own.get_mut(at) {
                *own = [seat.held_m, seat.power_w];
            }
        }
        let last = roster.seats.last().filter(|_| roster.seats.is_full());
        self.known = Some(last.map_or(relays, |last| last.index));
        !self.is_partial(relays)
    }
}
