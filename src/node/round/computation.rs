//! State of a relay's part in a round of agreement: the current pass, its position and its target.
//!
//! The leader also has a task: the choice of the next pass, and the computation before it (prediction, targets or altitudes to
//! try).

use super::gathering::Seats;
use super::sense::{Sense, Sensing};
use super::state::{Action, Phase, RoundState};
use super::sweep::SweepPass;
use super::turn::TurnPass;
use crate::features::{ADJUST, ALTITUDE, SENSING};
use crate::mission::Profile;
use crate::node::context::Context;
use crate::node::sample::Meter;
use crate::optimiser::joint::fitted::SlotShares;
use crate::optimiser::joint::{MOST_SOLVED, Solver};
use crate::optimiser::ladder::Ladder;
use crate::optimiser::local::HopEnd;
use crate::optimiser::pass::origins;
use crate::optimiser::plan::Planner;
use crate::optimiser::search::{Infeasible, Schedule, Search};
use crate::place::{CrossSection, Placement, Station};
use crate::settings::{Adjust, Method, Settings};
use crate::time::Instant;
use crate::wire::message::{AdjustStep, Message, Moved, Roster, Sweep, SweepVerdict, Token};

/// Number of positions that one call of [`Computation::work`] evaluates in Algorithm 2. The first value is for
/// traffic from Tx to Rx only, the second for both directions.
///
/// A call also completes the current altitude of the search grid, which is at most 24 or 194 positions more.
pub(super) const PLACES_AT_ONCE: [u16; 2] = [600, 300];

/// Kind and data of the current pass (message along the chain) at this relay.
#[derive(Clone, Debug)]
pub(super) enum PassKind {
    Sweep(SweepPass),
    Gather(Roster),
    Sense(Sense),
    Turn(TurnPass),
}

/// Position that the joint method has computed for this relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointPlace {
    /// Lateral offset and altitude of the position that this relay computed.
    pub(super) cross_section: CrossSection,
    /// Largest x that this relay may take, m. Beyond it, the later relays could not keep the minimum separation. Not
    /// used in an interference field.
    pub(super) end_m: f32,
    /// True for a plain pass: every relay takes the farthest x that meets the target SIR. False if relays may stop
    /// before that x to help the next hop.
    pub(super) plain: bool,
}

/// Time slots of this relay that are as long as its hops need; unused if all slots are equal.
#[derive(Clone, Copy, Debug)]
pub(super) struct FittedSlots {
    /// x of this relay in its joint solution, m, and the shares of its slots there.
    pub(super) solved: Option<(f32, SlotShares)>,
    /// Begin and end of its slots at the agreed positions, as shares of the frame.
    pub(super) agreed: Option<SlotShares>,
}

impl FittedSlots {
    const NONE: Self = Self {
        solved: None,
        agreed: None,
    };
}

/// State of one relay in the placement algorithms: current pass, own position, and the leader's task.
#[derive(Clone, Debug)]
pub(crate) struct Computation {
    pub(super) state: RoundState,
    pub(super) pass: PassKind,
    pub(super) task: LeaderTask,
    /// True from the start of a pass by this relay until the statistics count it. A pass is a message along the
    /// chain.
    pub(super) began: bool,
    /// Altitude and transmit power that the mission gives to this relay.
    pub(super) profile: Profile,
    /// Profiles (altitude and power) of the relays of this view, collected by a message along the chain.
    pub(super) seats: Seats,
    /// Position that the joint method has computed for this relay in this view; `None` before it has.
    pub(super) chosen: Option<JointPlace>,
    /// Lateral offset and altitude of the position that the chain has agreed on for this relay.
    pub(super) cross_section: CrossSection,
    /// Position and power of the next relay toward Rx, as last reported; `None` if unknown. Algorithm 2 uses it as
    /// the end of the hop from this relay.
    pub(super) after: Option<HopEnd>,
    pub(super) agreed_place: Option<Placement>,
    /// Fitted time slots of this relay; the array is empty without the feature `altitude`.
    pub(super) fitted: [FittedSlots; ALTITUDE as usize],
    /// Average of the measured interference at the agreed position. Used only if the interference is a field (a known
    /// distribution along x).
    pub(super) meter: Meter,
    /// Measurements of the unknown interferer, and the chain's estimate of it.
    pub(super) sensing: Sensing,
    pub(super) target: Option<f32>,
    /// Upper bound of the worst hop's SIR for any positions at the configured altitudes, linear. `None` at other
    /// relays than the leader, and until it is known.
    pub(super) bound: Option<f32>,
}

impl Computation {
    /// Creates the state of the placement algorithms after a start. The leader is in the phase `Planning`, and counts
    /// its passes from `number`.
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
            chosen: None,
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

    /// Returns true until this relay starts a task, takes part in a pass, or agrees on a position. A pass is a
    /// message along the chain.
    pub(crate) const fn is_untouched(&self) -> bool {
        let at_first = matches!(self.state.phase(), Phase::Idle | Phase::Planning);
        at_first && matches!(self.task, LeaderTask::Idle) && self.agreed_place.is_none()
    }

    pub(crate) fn load(&mut self, profile: Profile) {
        self.profile = profile;
        self.chosen = None;
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

    /// Starts the leader's search for the best target SIR again, from its first step.
    pub(crate) fn restart(&mut self) {
        self.task.clear();
        // A new solution makes the leader try the same targets as the first time.
        self.chosen = None;
        self.state.plan();
    }

    pub(crate) fn suspend(&mut self) {
        self.task.clear();
        self.pass = PassKind::Sweep(SweepPass::new(Ladder::single(1.0)));
        self.state.answer();
    }

    /// Resets the computation for a new view (membership of the chain). `leads` is true at its leader.
    pub(crate) fn renew(&mut self, leads: bool) {
        self.task.clear();
        // They belong to the previous view's mission and hops.
        self.set_slot_shares(None);
        self.after = None;
        self.chosen = None;
        self.seats = Seats::UNKNOWN;
        self.sensing.renew();
        self.state.renew(leads);
    }

    /// Sets the agreed position to `place`, and its lateral offset and altitude to `cross_section`.
    #[inline(never)]
    pub(super) fn agree_on(&mut self, place: Placement, cross_section: CrossSection) {
        self.agreed_place = Some(place);
        self.cross_section = cross_section;
        // Samples of the previous position do not count.
        self.meter.restart();
    }

    /// Returns the shares of this relay's slots at the agreed positions; `None` unless they were fitted.
    pub(crate) fn slot_shares(&self) -> Option<SlotShares> {
        self.fitted.first()?.agreed
    }

    pub(super) fn set_slot_shares(&mut self, shares: Option<SlotShares>) {
        if let Some(fitted) = self.fitted.first_mut() {
            fitted.agreed = shares;
        }
    }

    pub(super) fn give_up(&mut self) -> Action {
        self.state.give_up();
        Action::Infeasible
    }

    /// Continues this relay's part in the current pass, or the leader's preparation of the next one.
    ///
    /// Work: at most 12 hops for 16 targets, 128 points of an uneven field (or all of them for one target), ten
    /// relays of the joint method, or 624 positions of Algorithm 2.
    pub(crate) fn work(&mut self, context: &Context<'_>) -> Action {
        if self.state.phase() == Phase::Waiting {
            match &self.pass {
                PassKind::Sweep(sweep_pass) if !sweep_pass.is_done() => {
                    let unknown = ALTITUDE && sweep_pass.chosen && self.chosen.is_none();
                    if unknown && self.solve(context).is_none() {
                        return Action::Work;
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
            Ok(false) => Action::Work,
            Err(Infeasible) => self.give_up(),
        }
    }

    /// Returns the message of the current pass for the next relay along the chain. `None` if the pass has ended, or
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

    /// Returns true if each relay computes for long before it forwards the current pass along the chain.
    pub(crate) const fn is_slow(&self) -> bool {
        match &self.pass {
            PassKind::Turn(_) => true,
            PassKind::Sweep(sweep_pass) => sweep_pass.chosen,
            PassKind::Gather(_) | PassKind::Sense(_) => false,
        }
    }

    /// Returns the reply to the previous relay, with the result of the pass. `None` until the result is known.
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

    /// Returns this relay's lateral offset, altitude and power for a sweep. A sweep is a pass along the chain that
    /// tries target SIRs. Offset and altitude are the joint method's if `chosen` is true, else the configured ones.
    pub(super) fn station_for(&self, chosen: bool) -> Station {
        let given = self.profile.on_line();
        match self.chosen {
            Some(JointPlace { cross_section, .. }) if chosen => Station {
                cross_section,
                ..given
            },
            _ => given,
        }
    }

    /// Returns the number of completed rounds of Algorithm 2, and the SIR after the last one. `None` except at the
    /// leader.
    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        match &self.task {
            LeaderTask::Adjusting(rounds) => Some((rounds.done(), rounds.sir)),
            _ => None,
        }
    }
}

/// Solver of the joint method (all positions at once) for up to [`MOST_SOLVED`] relays.
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
    /// Prediction of the chain's target SIR from the mission; the first sweep tries targets around it.
    Predicting(Planner),
    /// Solution of the whole chain by the joint method. Every relay computes it for itself.
    Solving(ChainSolver),
    /// Search for the highest target SIR that the chain meets, by sweeps (messages along the chain). The lateral
    /// offsets and altitudes stay as they are.
    Searching {
        search: Search,
        /// True if the method of the settings ends with this search, and no other algorithm follows.
        last: bool,
        /// True while the relays search at the configured altitudes. Reason: the joint method's altitudes have no feasible target.
        given: bool,
    },
    /// Algorithm 2 is running: the state of its rounds.
    Adjusting(Rounds),
}

/// Progress of Algorithm 2, in which the relays move one after the other: rounds and SIR.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounds {
    adjust: Adjust,
    /// Number of completed rounds. The first pass, in which no relay moves, does not count.
    done: u16,
    turn: AdjustStep,
    /// SIR of the chain's worst hop after the last round, linear.
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

    /// Records the result of a pass of Algorithm 2; returns true if it was the last pass. `any` is true if a relay
    /// has moved; `sir` is the SIR of the chain's worst hop, linear.
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

    /// Starts the joint method with a new solver, whose first step is still to come.
    #[inline(never)] // or the stack of each step has room for a second solver
    pub(crate) fn solve(&mut self) {
        *self = Self::Solving(ChainSolver::NEW);
    }

    /// Starts a search for the highest feasible target SIR. `last` is true if no other algorithm follows. `given` is
    /// true if the configured altitudes are used because those of the joint method failed.
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

/// Maximum number of hops that one call of [`Computation::work`] predicts, each for 16 target SIRs. If the
/// interference varies along x, it predicts only part of one hop.
const HOPS_AT_ONCE: u16 = 12;

/// Maximum number of hops that one call of [`Computation::work`] predicts in a uniform field. A field is a known
/// distribution of the interference. Its hops cost twice as much as with an interferer, for which the maximum is
/// [`HOPS_AT_ONCE`].
const FIELD_HOPS_AT_ONCE: u16 = 8;

impl Computation {
    /// Continues the leader's computation before a pass along the chain. Returns true if the pass can start, and the
    /// error `Infeasible` if no target SIR is feasible.
    pub(super) fn plan(&mut self, context: &Context<'_>) -> Result<bool, Infeasible> {
        if self.must_distribute(context) || self.must_gather(context) {
            return Ok(true);
        }
        if self.is_solving(context) {
            if let Some(target) = self.solve(context) {
                self.search_chosen(context, target)?;
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
                    // Other relays may have other profiles, so the search decides.
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

    /// Starts the search for the highest feasible target SIR. The first sweep tries the targets in `ladder`, if there
    /// is one. `last` is true if no other algorithm follows.
    pub(super) fn search_with(
        &mut self,
        context: &Context<'_>,
        ladder: Option<Ladder>,
        last: bool,
    ) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, ladder, last, false)
    }

    /// Starts the search for the target SIR at the configured lateral offsets and altitudes. This search follows if no target is feasible
    /// at those of the joint method.
    pub(super) fn search_configured(&mut self, context: &Context<'_>) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, None, true, true)
    }

    #[inline(never)]
    fn search_by(
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

    /// Starts the pass along the chain that the leader has planned.
    pub(super) fn begin_pass(&mut self, context: &Context<'_>) -> Action {
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
                let chosen = context.joins() && self.chosen.is_some() && !given;
                self.begin();
                self.sweep_on(context, ladder, chosen, None, &origins(mission))
            }
            LeaderTask::Adjusting(rounds) if ADJUST => {
                let (turn, sir) = (rounds.turn(), rounds.sir);
                self.begin();
                self.take_turn(context, TurnPass::new(turn, sir, None))
            }
            _ => Action::Work,
        }
    }

    pub(super) fn begin(&mut self) {
        self.state.begin();
        self.began = true;
    }
}
