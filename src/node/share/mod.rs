//! A relay's share of every algorithm: what it does with a pass, and with what comes back of it.
//!
//! [`exchange`](super::exchange) has the state table. What a pass carries is one of three: targets (`sweeps`), targets and
//! altitude levels (`waves`), or a token (`turns`). The call for a new view (`roll`) is a pass like them.

mod roll;
mod sweeps;
mod turns;
mod waves;

use core::task::Poll;

use super::MEMBERSHIP;
use super::adjust::Turning;
use super::align::Sweeping;
use super::exchange::{Exchange, Next, Phase};
use super::lead::Lead;
use super::settings::{Method, Settings};
use crate::mission::{Band, Mission, Profile};
use crate::placement::climb::{Attempt, Climb};
use crate::placement::coarse::Coarse;
use crate::placement::ladder::Ladder;
use crate::placement::levels::{Levels, TUBE};
use crate::placement::local::Beside;
use crate::placement::pass::origins;
use crate::placement::search::{Infeasible, Schedule, Search};
use crate::placement::wave::{Choice, Wave};
use crate::sir::Placement;
use crate::wire::message::{self, Answer, Count, Message, Moved, Roster, Sweep, Token, Trace};

use roll::Rolling;

/// Hops of the prediction in one call of `work`: 16 reaches each.
const HOPS_AT_ONCE: u16 = 16;

/// The same in a field, where a reach takes twice the work.
const FIELD_HOPS_AT_ONCE: u16 = 8;

/// Hops evaluated in one call of `work` on a pass of altitude levels, and 64 more at most.
const LEVELS_AT_ONCE: u16 = 32;

/// Places weighed in one call of `work` in Algorithm 2, and a row of 24 more at most.
const PLACES_AT_ONCE: u16 = 600;

/// Whether this crate was built with the methods beyond Algorithm 1. Without one, none of its code is reached.
pub(crate) const ALTITUDE: bool = cfg!(feature = "altitude");
pub(crate) const ADJUST: bool = cfg!(feature = "adjust");

/// What a relay is and holds, while it does its share.
#[derive(Clone, Copy)]
pub(crate) struct Own<'a> {
    pub(crate) mission: &'a Mission,
    pub(crate) settings: &'a Settings,
    /// The digest of the mission as it was loaded.
    pub(crate) mission_digest: u16,
    /// Number of the view that it has agreed to.
    pub(crate) view: u16,
    /// Its place among the relays of that view, 1 next to Tx.
    pub(crate) index: u16,
    /// Whether nobody comes after it on a pass.
    pub(crate) end: bool,
    /// Upsilon as it measures it where it stands, 1/W.
    pub(crate) measured_per_w: Option<f32>,
}

impl Own<'_> {
    /// The digest that the passes of this view bear.
    const fn digest(self) -> u16 {
        self.mission_digest.wrapping_add(self.view)
    }

    fn is_last(&self) -> bool {
        self.mission.after(self.index).is_none()
    }

    /// Whether a neighbour may stand at `place`.
    fn is_between(&self, place: Placement) -> bool {
        (0.0..=self.mission.config().distance_m).contains(&place.x_m)
    }

    /// The altitudes that this relay may choose from, when it holds `altitude_m`.
    fn band(&self, altitude_m: f32) -> Band {
        if self.settings.hold_altitude {
            Band::at(altitude_m)
        } else {
            self.mission.config().band
        }
    }
}

/// What the current pass carries. The [`Wave`] is kept beside it: it is long, and worked on where it is.
#[derive(Clone, Debug)]
enum Pass {
    Sweep(Sweeping),
    Wave,
    Turn(Turning),
    Roll(Rolling),
}

/// A relay's share of the algorithms.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    exchange: Exchange,
    pass: Pass,
    wave: Wave,
    /// What the relay before has to choose for what has come back of the wave.
    choice: Option<Choice>,
    /// The altitudes to weigh in the next tube.
    tube: Levels,
    lead: Lead,
    sweeps: u32,
    /// What this relay was given.
    profile: Profile,
    /// The altitude chosen for it, m; a sweep goes back to the one it was given.
    altitude_m: f32,
    /// Where the neighbour toward Rx stands, as far as it has said.
    after: Option<Placement>,
    setpoint: Option<Placement>,
    target: Option<f32>,
}

impl Share {
    /// A relay that has just been switched on. The leader numbers its passes from `number` on, and has work to do.
    pub(crate) const fn new(
        mission: &Mission,
        leader: bool,
        number: u16,
        profile: Profile,
    ) -> Self {
        Self {
            exchange: Exchange::new(if leader { Phase::Planning } else { Phase::Idle }, number),
            pass: Pass::Sweep(Sweeping::new(Ladder::single(1.0))),
            wave: Wave::new(mission),
            choice: None,
            tube: Levels::held(profile.altitude_m, TUBE),
            lead: Lead::No,
            sweeps: 0,
            profile,
            altitude_m: profile.altitude_m,
            after: None,
            setpoint: None,
            target: None,
        }
    }

    /// The leader begins from the start: with Algorithm 1 or 4, at the altitudes the relays were given.
    pub(crate) fn restart(&mut self) {
        self.lead = Lead::No;
        self.exchange.phase = Phase::Planning;
    }

    fn give_up(&mut self) -> Next {
        self.exchange.phase = Phase::Infeasible;
        Next::Infeasible
    }

    /// Goes on with a computation: the relay's own share of the current pass, or the leader's next pass.
    ///
    /// Bounded by 16 hops of 16 reaches, half as many in a field, 96 hops of a wave, or 624 places of Algorithm 2.
    pub(crate) fn work(&mut self, own: Own<'_>) -> Next {
        if self.exchange.phase == Phase::Waiting {
            return match &self.pass {
                Pass::Wave if ALTITUDE => self.go_on_with_wave(own),
                Pass::Turn(_) if ADJUST => self.go_on_with_turn(own),
                _ => Next::Stale,
            };
        }
        match self.plan(own) {
            Ok(true) => self.begin_pass(own),
            Ok(false) => Next::Work { moved: false },
            Err(Infeasible) => self.give_up(),
        }
    }

    /// Goes on with the leader's computation; whether the next pass can begin.
    fn plan(&mut self, own: Own<'_>) -> Result<bool, Infeasible> {
        let (mission, profile) = (own.mission, self.profile);
        match &mut self.lead {
            Lead::No => {
                self.begin_lead(own)?;
                Ok(false)
            }
            Lead::Predicting(planner) => {
                // The leader knows its own profile; of the others it can only assume what the mission has in common.
                let profile_of = |index| {
                    if index == own.index {
                        profile
                    } else {
                        mission.config().common
                    }
                };
                let hops = match mission.field() {
                    None => HOPS_AT_ONCE,
                    Some(_) => FIELD_HOPS_AT_ONCE,
                };
                let ladder = match planner.step(mission, profile_of, hops) {
                    Ok(None) => return Ok(false),
                    Ok(Some(agreed)) => Some(agreed.ladder),
                    // The others may hold something else: let their answers decide.
                    Err(Infeasible) => None,
                };
                let last = own.settings.method == Method::Align;
                self.search_with(own, ladder, last)?;
                Ok(true)
            }
            Lead::Surveying(coarse) if ALTITUDE => {
                let Some(interferer) = mission.interferer() else {
                    return Err(Infeasible);
                };
                let found =
                    coarse.step(mission, interferer, profile, &mut self.wave, LEVELS_AT_ONCE);
                if let Poll::Ready(predicted) = found {
                    self.climb(own, predicted);
                }
                Ok(false)
            }
            Lead::Climbing(climb) if ALTITUDE && climb.is_vain() => {
                // Nothing better than what Algorithm 1 gave: agree on that once more.
                let target = climb.target();
                self.search_with(own, Some(Ladder::single(target)), true)?;
                Ok(true)
            }
            _ => Ok(true),
        }
    }

    #[inline(never)] // a planner is built here once; its stack is not for every call of `work`
    fn begin_lead(&mut self, own: Own<'_>) -> Result<(), Infeasible> {
        self.lead = Lead::begin(own.mission, self.profile, own.settings)?;
        if let Lead::Searching { search, .. } = &mut self.lead
            && own.measured_per_w.is_some()
        {
            search.take_as_even();
        }
        Ok(())
    }

    /// Goes over to trying targets, with `ladder` first if there is one.
    #[inline(never)]
    fn search_with(
        &mut self,
        own: Own<'_>,
        ladder: Option<Ladder>,
        last: bool,
    ) -> Result<(), Infeasible> {
        let mut search = Search::new(own.mission, self.profile, Schedule::Bracketed)?;
        if own.measured_per_w.is_some() {
            search.take_as_even();
        }
        if let Some(ladder) = ladder {
            search.begin_with(ladder);
        }
        self.lead = Lead::Searching { search, last };
        Ok(())
    }

    #[inline(never)]
    fn climb(&mut self, own: Own<'_>, predicted: Option<(f32, u8)>) {
        let target = self.target.unwrap_or(1.0);
        let tolerance = own.mission.config().tolerance;
        self.lead = Lead::Climbing(Climb::new(target, tolerance, predicted));
    }

    #[inline(never)]
    fn survey(&mut self, own: Own<'_>, target: f32) {
        let coarse = Coarse::new(own.mission, target, &mut self.wave);
        self.lead = Lead::Surveying(coarse);
    }

    /// The leader begins the pass it has planned.
    fn begin_pass(&mut self, own: Own<'_>) -> Next {
        let mission = own.mission;
        match &self.lead {
            Lead::Searching { search, .. } => {
                let ladder = *search.ladder();
                self.begin();
                self.sweep_on(own, ladder, None, &origins(mission))
            }
            Lead::Climbing(climb) if ALTITUDE => {
                let Attempt { rungs, levels } = climb.attempt();
                self.begin();
                let levels = self.levels(own, levels);
                self.wave.begin(mission, rungs, levels);
                self.pass = Pass::Wave;
                self.go_on_with_wave(own)
            }
            Lead::Adjusting(rounds) if ADJUST => {
                let (turn, sir) = (rounds.turn(), rounds.sir);
                self.begin();
                let tx = Beside {
                    place: Placement::default(),
                    apart_m: 0.0,
                };
                self.take_turn(own, Turning::new(turn, sir, tx, mission.tx_gain()))
            }
            _ => Next::Work { moved: false },
        }
    }

    fn begin(&mut self) {
        self.exchange.begin();
        self.sweeps = self.sweeps.saturating_add(1);
    }

    /// What to hand onward, while an answer is awaited.
    pub(crate) fn onward(&self, own: Own<'_>) -> Option<Message<'_>> {
        if self.exchange.phase != Phase::Waiting {
            return None;
        }
        let (number, mission) = (self.exchange.number, own.digest());
        match &self.pass {
            Pass::Sweep(sweeping) => Some(Message::Sweep(Sweep {
                number,
                mission,
                ladder: sweeping.ladder,
                profile: self.profile,
                measured_per_w: own.measured_per_w,
                reaches: sweeping.reaches.clone(),
            })),
            Pass::Wave if ALTITUDE => Some(Message::Wave(message::Wave {
                number,
                mission,
                rungs: self.wave.rungs(),
                levels: self.wave.levels(),
                power_w: self.profile.power_w,
                reaches: self.wave.reaches(),
            })),
            Pass::Turn(turning) if ADJUST => self.setpoint.map(|place| {
                Message::Token(Token {
                    number,
                    mission,
                    place,
                    power_w: self.profile.power_w,
                    turn: turning.turn,
                    sir: turning.sir,
                })
            }),
            Pass::Roll(rolling) if MEMBERSHIP => Some(Message::Roster(Roster {
                mission: own.mission_digest,
                view: rolling.view,
                place: rolling.place,
                before: rolling.before,
            })),
            _ => None,
        }
    }

    /// Whether there is something to hand back.
    pub(crate) fn has_answer(&self) -> bool {
        self.exchange.is_answered()
    }

    /// Whether the current pass is one on which relays compute for a while.
    pub(crate) const fn is_slow(&self) -> bool {
        matches!(self.pass, Pass::Wave | Pass::Turn(_))
    }

    /// What to hand back, once it is known.
    pub(crate) fn back(&self, own: Own<'_>) -> Option<Message<'_>> {
        if !self.exchange.is_answered() {
            return None;
        }
        let (number, mission) = (self.exchange.number, own.digest());
        match &self.pass {
            Pass::Sweep(sweeping) => Some(Message::Verdict(Answer {
                number,
                mission,
                verdict: sweeping.verdict.clone(),
            })),
            Pass::Wave if ALTITUDE => Some(Message::Trace(Trace {
                number,
                mission,
                choice: self.choice,
            })),
            Pass::Turn(turning) if ADJUST => self.setpoint.map(|place| {
                Message::Moved(Moved {
                    number,
                    mission,
                    place,
                    any: turning.any,
                    worst: turning.worst,
                })
            }),
            Pass::Roll(rolling) if MEMBERSHIP => Some(Message::Count(Count {
                mission: own.mission_digest,
                view: rolling.view,
                place: rolling.place,
                relays: rolling.relays,
            })),
            _ => None,
        }
    }

    /// The number of the current pass.
    pub(crate) const fn number(&self) -> u16 {
        match &self.pass {
            Pass::Roll(rolling) => rolling.view,
            _ => self.exchange.number,
        }
    }

    /// Whether no pass and no view has been taken part in yet.
    pub(crate) fn is_fresh(&self) -> bool {
        self.exchange.phase == Phase::Idle
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.exchange.phase
    }

    pub(crate) const fn sweeps(&self) -> u32 {
        self.sweeps
    }

    pub(crate) const fn setpoint(&self) -> Option<Placement> {
        self.setpoint
    }

    pub(crate) const fn target(&self) -> Option<f32> {
        self.target
    }

    /// What this relay holds.
    pub(crate) const fn profile(&self) -> Profile {
        Profile {
            altitude_m: self.altitude_m,
            power_w: self.profile.power_w,
        }
    }

    /// Rounds of Algorithm 2 that are over and the SIR of the chain after the last one, at the leader while it adjusts.
    pub(crate) const fn rounds(&self) -> Option<(u16, f32)> {
        match &self.lead {
            Lead::Adjusting(rounds) => Some((rounds.done(), rounds.sir)),
            _ => None,
        }
    }
}
