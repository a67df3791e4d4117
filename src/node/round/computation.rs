//! What a relay holds while it does its share of an algorithm: the pass that is under way, its place, its targets.
//!
//! The leader has a task besides: which pass comes next, and what it works out before it begins one: its prediction, the targets or
//! altitudes to try.

use super::gathering::Seats;
use super::sense::{SENSING, Sense, Sensing};
use super::state::{Action, Phase, RoundState};
use super::sweep::Sweeping;
use super::turn::Turning;
use crate::mission::Profile;
use crate::node::context::Context;
use crate::node::sample::Meter;
use crate::optimiser::joint::{MOST_SOLVED, Solver};
use crate::optimiser::ladder::Ladder;
use crate::optimiser::local::HopEnd;
use crate::optimiser::pass::origins;
use crate::optimiser::plan::Planner;
use crate::optimiser::search::{Infeasible, Schedule, Search};
use crate::place::{CrossSection, Placement, Station};
use crate::settings::{Adjust, Method, Settings};
use crate::time::Instant;
use crate::wire::message::{AdjustStep, Answer, Message, Moved, Roster, Sweep, Token};

/// Places weighed in one call of `work` in Algorithm 2, and a row of 24 more at most.
pub(super) const PLACES_AT_ONCE: u16 = 600;

/// Whether this crate was built with the methods beyond Algorithm 1. Without one, none of its code is reached.
pub(crate) const ALTITUDE: bool = cfg!(feature = "altitude");
pub(crate) const ADJUST: bool = cfg!(feature = "adjust");

/// What the current pass carries.
#[derive(Clone, Debug)]
pub(super) enum PassKind {
    Sweep(Sweeping),
    Gather(Roster),
    Sense(Sense),
    Turn(Turning),
}

/// Where the joint method has a relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chosen {
    /// Across the line.
    pub(super) at: CrossSection,
    /// And no farther along it, m.
    pub(super) end_m: f32,
    /// Whether nobody holds back there.
    pub(super) plain: bool,
}

/// A relay's share of the algorithms.
#[derive(Clone, Debug)]
pub(crate) struct Computation {
    pub(super) state: RoundState,
    pub(super) pass: PassKind,
    pub(super) task: LeaderTask,
    pub(super) sweeps: u32,
    /// What this relay was given.
    pub(super) profile: Profile,
    /// What the relays of this view bring along.
    pub(super) seats: Seats,
    /// Where the joint method has it in this view, once that is known.
    pub(super) chosen: Option<Chosen>,
    /// Where it is to be across the line.
    pub(super) at: CrossSection,
    /// Where the neighbour toward Rx stands, as far as it has said.
    pub(super) after: Option<Placement>,
    pub(super) setpoint: Option<Placement>,
    /// What it measures there.
    pub(super) meter: Meter,
    /// What it hears of the interference.
    pub(super) sensing: Sensing,
    pub(super) target: Option<f32>,
    /// At the leader, what no chain can have.
    pub(super) bound: Option<f32>,
}

impl Computation {
    /// A relay that has just been switched on. The leader numbers its passes from `number` on, and has work to do.
    pub(crate) const fn new(
        leader: bool,
        number: u16,
        profile: Profile,
        settings: &Settings,
        now: Instant,
    ) -> Self {
        Self {
            state: RoundState::new(if leader { Phase::Planning } else { Phase::Idle }, number),
            pass: PassKind::Sweep(Sweeping::new(Ladder::single(1.0))),
            task: LeaderTask::No,
            sweeps: 0,
            profile,
            seats: Seats::UNKNOWN,
            chosen: None,
            at: profile.on_line().at,
            after: None,
            setpoint: None,
            meter: Meter::new(settings.measure),
            sensing: Sensing::new(settings.listen, now),
            target: None,
            bound: None,
        }
    }

    /// Whether it has just been made.
    pub(crate) const fn is_untouched(&self) -> bool {
        let at_first = matches!(self.state.phase(), Phase::Idle | Phase::Planning);
        at_first && matches!(self.task, LeaderTask::No) && self.setpoint.is_none()
    }

    /// Another mission is flown from now on, in which this relay is given `profile`. It stays where it is.
    pub(crate) fn load(&mut self, profile: Profile) {
        self.profile = profile;
        self.chosen = None;
        self.seats = Seats::UNKNOWN;
        self.sensing.load();
        if self.setpoint.is_none() {
            self.at = profile.on_line().at;
        }
    }

    /// Discards the agreed place, and that of the neighbour.
    pub(crate) const fn discard_place(&mut self) {
        self.setpoint = None;
        self.after = None;
    }

    /// The leader begins from the start: with Algorithm 1 or 4, at the altitudes the relays were given.
    pub(crate) fn restart(&mut self) {
        self.task.rest();
        // Solved once more, the chain is tried at the same targets as the first time.
        self.chosen = None;
        self.state.plan();
    }

    /// A view is proposed: what was under way is over.
    pub(crate) fn suspend(&mut self) {
        self.task.rest();
        self.pass = PassKind::Sweep(Sweeping::new(Ladder::single(1.0)));
        self.state.answer();
    }

    /// The new view is in force: everybody's first pass in it is still to come.
    pub(crate) fn renew(&mut self, leads: bool) {
        self.task.rest();
        self.after = None;
        self.chosen = None;
        self.seats = Seats::UNKNOWN;
        self.sensing.renew();
        self.state.renew(leads);
    }

    /// It is to be at `place` from now on, and keeps to `at` across the line.
    #[inline(never)]
    pub(super) fn stand_at(&mut self, place: Placement, at: CrossSection) {
        self.setpoint = Some(place);
        self.at = at;
        // What is measured from now on is measured elsewhere.
        self.meter.restart();
    }

    pub(super) fn give_up(&mut self) -> Action {
        self.state.give_up();
        Action::Infeasible
    }

    /// Goes on with a computation: the relay's own share of the current pass, or the leader's next pass.
    ///
    /// Bounded by 12 hops of 16 reaches, 128 points of an uneven field (or all of them for one target), ten relays of the joint method,
    /// or 624 places of Algorithm 2.
    pub(crate) fn work(&mut self, context: &Context<'_>) -> Action {
        if self.state.phase() == Phase::Waiting {
            match &self.pass {
                PassKind::Sweep(sweeping) if !sweeping.is_done() => {
                    let unknown = ALTITUDE && sweeping.chosen && self.chosen.is_none();
                    if unknown && self.solve(context).is_none() {
                        return Action::Work;
                    }
                    return self.go_on_with_sweep(context);
                }
                PassKind::Turn(_) if ADJUST => return self.go_on_with_turn(context),
                _ => {}
            }
        }
        if context.index() != context.mission().leader() || self.state.phase() == Phase::Waiting {
            return self.think(context);
        }
        match self.plan(context) {
            Ok(true) => self.begin_pass(context),
            Ok(false) => Action::Work,
            Err(Infeasible) => self.give_up(),
        }
    }

    /// What to hand onward, while an answer is awaited.
    pub(crate) fn onward(&self, context: &Context<'_>) -> Option<Message> {
        if self.state.phase() != Phase::Waiting {
            return None;
        }
        let (number, mission) = (self.state.number(), context.digest());
        match &self.pass {
            PassKind::Sweep(sweeping) if !sweeping.is_done() => None,
            PassKind::Sweep(sweeping) => Some(Message::Sweep(Sweep {
                number,
                mission,
                ladder: sweeping.ladder,
                relay: self.station_for(sweeping.chosen),
                chosen: sweeping.chosen,
                measured_per_w: self.meter.published(),
                reaches: sweeping.reaches.clone(),
            })),
            PassKind::Gather(roster) if ALTITUDE => Some(Message::Gather(roster.clone())),
            PassKind::Sense(sense) if SENSING => Some(Message::Sense(sense.hearing)),
            PassKind::Turn(turning) if turning.is_searching() => None,
            PassKind::Turn(turning) if ADJUST => self.setpoint.map(|place| {
                Message::Token(Token {
                    number,
                    mission,
                    place,
                    power_w: self.profile.power_w,
                    turn: turning.turn,
                    sir: turning.sir,
                })
            }),
            _ => None,
        }
    }

    /// Whether the current pass is one on which relays compute for a while.
    pub(crate) const fn is_slow(&self) -> bool {
        match &self.pass {
            PassKind::Turn(_) => true,
            PassKind::Sweep(sweeping) => sweeping.chosen,
            PassKind::Gather(_) | PassKind::Sense(_) => false,
        }
    }

    /// What to hand back, once it is known.
    pub(crate) fn back(&self, context: &Context<'_>) -> Option<Message> {
        if !self.state.is_answered() {
            return None;
        }
        let (number, mission) = (self.state.number(), context.digest());
        match &self.pass {
            PassKind::Sweep(sweeping) => Some(Message::Verdict(Answer {
                number,
                mission,
                verdict: sweeping.verdict.clone(),
                stand: sweeping.stand(),
                own: sweeping.own || self.differs(context),
            })),
            PassKind::Gather(roster) if ALTITUDE => Some(Message::Gathered(roster.clone())),
            PassKind::Sense(sense) if SENSING => Some(Message::Sensed(sense.hearing)),
            PassKind::Turn(turning) if ADJUST => self.setpoint.map(|place| {
                Message::Moved(Moved {
                    number,
                    mission,
                    place,
                    any: turning.any,
                    worst: turning.worst,
                })
            }),
            _ => None,
        }
    }

    /// The number of the current pass.
    pub(crate) const fn number(&self) -> u16 {
        self.state.number()
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.state.phase()
    }

    /// What this relay holds.
    pub(crate) const fn profile(&self) -> Profile {
        Profile {
            altitude_m: self.at.altitude_m,
            power_w: self.profile.power_w,
        }
    }

    /// What it is on a sweep: of the joint method, or where it was given to be.
    pub(super) fn station_for(&self, chosen: bool) -> Station {
        let given = self.profile.on_line();
        match self.chosen {
            Some(Chosen { at, .. }) if chosen => Station { at, ..given },
            _ => given,
        }
    }

    /// Rounds of Algorithm 2 that are over and the SIR of the chain after the last one, at the leader while it adjusts.
    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        match &self.task {
            LeaderTask::Adjusting(rounds) => Some((rounds.done(), rounds.sir)),
            _ => None,
        }
    }
}

/// A chain being solved by the joint method.
pub(crate) type ChainSolver = Solver<MOST_SOLVED, { MOST_SOLVED / 10 }>;

/// What the leader is at.
#[cfg_attr(
    feature = "altitude",
    expect(
        clippy::large_enum_variant,
        reason = "there is one of it, and nothing allocates"
    )
)]
#[derive(Clone, Debug)]
pub(crate) enum LeaderTask {
    /// Not the leader, or nothing begun yet, or all done.
    No,
    /// Solving the chain from the mission.
    Predicting(Planner),
    /// The same by the joint method: every relay does that, not the leader alone.
    Solving(ChainSolver),
    /// Trying targets at the altitudes held; whether the chain settles with what is agreed.
    Searching {
        search: Search,
        /// Nothing comes after it.
        last: bool,
        /// Of the places that the relays were given, though others were chosen.
        given: bool,
    },
    /// Algorithm 2.
    Adjusting(Rounds),
}

/// Where Algorithm 2 is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounds {
    adjust: Adjust,
    /// Rounds that are over; the first pass, which only looks, is not one.
    done: u16,
    turn: AdjustStep,
    /// SIR of the chain after the last round.
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

    /// What the next pass is for.
    pub(crate) const fn turn(&self) -> AdjustStep {
        self.turn
    }

    /// How many rounds are over.
    pub(crate) const fn done(&self) -> u16 {
        self.done
    }

    /// Takes what came of a pass; whether that was the last one.
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
    /// Nothing is left to do.
    pub(crate) fn rest(&mut self) {
        *self = Self::No;
    }

    /// Solves the chain from the mission.
    pub(crate) fn predict(&mut self, planner: Planner) {
        *self = Self::Predicting(planner);
    }

    /// The same by the joint method.
    pub(crate) fn solve(&mut self, chain: ChainSolver) {
        *self = Self::Solving(chain);
    }

    /// Tries targets: the `last` thing to do, and of the places `given`, or not.
    pub(crate) fn search(&mut self, search: Search, last: bool, given: bool) {
        *self = Self::Searching {
            search,
            last,
            given,
        };
    }

    /// Begins Algorithm 2.
    pub(crate) fn adjust(&mut self, adjust: Adjust) {
        *self = Self::Adjusting(Rounds::new(adjust));
    }
}

/// Hops of the prediction in one call of `work`, 16 reaches each. In an uneven field a part of one.
const HOPS_AT_ONCE: u16 = 12;

/// The same in an even field, where a reach takes twice the work.
const FIELD_HOPS_AT_ONCE: u16 = 8;

impl Computation {
    /// Goes on with the leader's computation; whether the next pass can begin.
    pub(super) fn plan(&mut self, context: &Context<'_>) -> Result<bool, Infeasible> {
        if self.has_to_tell(context) || self.gathers(context) {
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
            LeaderTask::No => {
                self.begin_task(context)?;
                Ok(false)
            }
            LeaderTask::Predicting(planner) => {
                // The leader knows its own profile; of the others it can only assume what the mission has in common.
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
                    // The others may hold something else: let their answers decide.
                    Err(Infeasible) => None,
                };
                let last = context.settings().method == Method::Align;
                self.search_with(context, ladder, last)?;
                Ok(true)
            }
            _ => Ok(true),
        }
    }

    /// What the leader begins with: its prediction, if it may, or the search itself.
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

    /// Goes over to trying targets, with `ladder` first if there is one.
    pub(super) fn search_with(
        &mut self,
        context: &Context<'_>,
        ladder: Option<Ladder>,
        last: bool,
    ) -> Result<(), Infeasible> {
        self.search_by(context, Schedule::Bracketed, ladder, last, false)
    }

    /// The leader goes back to the places that the relays were given: nothing can be met at those chosen.
    pub(super) fn search_given(&mut self, context: &Context<'_>) -> Result<(), Infeasible> {
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

    /// The leader begins the pass it has planned.
    pub(super) fn begin_pass(&mut self, context: &Context<'_>) -> Action {
        let mission = context.mission();
        if self.has_to_tell(context) {
            return self.begin_sense(context);
        }
        if self.gathers(context) {
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
                let tx = HopEnd {
                    place: Placement::default(),
                    apart_m: 0.0,
                };
                self.take_turn(context, Turning::new(turn, sir, tx, mission.tx_gain()))
            }
            _ => Action::Work,
        }
    }

    pub(super) fn begin(&mut self) {
        self.state.begin();
        self.sweeps = self.sweeps.saturating_add(1);
    }
}
