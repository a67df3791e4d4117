//! What a relay holds while it does its share of an algorithm: the pass that is under way, its place, its targets.

use super::state::{Exchange, Next, Phase};
use super::sweeping::Sweeping;
use super::task::Lead;
use super::turning::Turning;
use crate::mission::{Band, Mission, Profile};
use crate::node::context::Context;
use crate::optimiser::joint::course::Coursing;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::search::Infeasible;
use crate::place::{CrossSection, Placement, Station};
use crate::settings::{Method, Settings};
use crate::wire::message::{Answer, Course, Message, Moved, Sweep, Token, Worth};

/// Places weighed in one call of `work` in Algorithm 2, and a row of 24 more at most.
pub(super) const PLACES_AT_ONCE: u16 = 600;

/// Whether this crate was built with the methods beyond Algorithm 1. Without one, none of its code is reached.
pub(crate) const ALTITUDE: bool = cfg!(feature = "altitude");
pub(crate) const ADJUST: bool = cfg!(feature = "adjust");

/// What a relay is and holds, while it does its share.
#[derive(Clone, Copy)]
pub(crate) struct Own<'a> {
    pub(crate) mission: &'a Mission,
    pub(crate) settings: &'a Settings,
    /// The digest that the passes of this view bear.
    digest: u16,
    /// Its place among the relays of that view, 1 next to Tx.
    pub(crate) index: u16,
    /// Upsilon as it measures it where it stands, 1/W.
    pub(crate) measured_per_w: Option<f32>,
}

impl<'a> Own<'a> {
    pub(crate) const fn new(context: &Context<'a>) -> Self {
        Self {
            mission: &context.chain.mission,
            settings: &context.chain.settings,
            digest: context.chain.pass_digest(),
            index: context.chain.index,
            measured_per_w: context.measured_per_w,
        }
    }
}

impl Own<'_> {
    /// Whether the joint method is asked for, and has something to choose.
    pub(super) fn joins(&self) -> bool {
        let config = self.mission.config();
        let free = !(config.band.is_single() && config.lateral.is_single());
        ALTITUDE && self.settings.method == Method::Joint && free
    }

    pub(super) fn is_last(&self) -> bool {
        self.mission.after(self.index).is_none()
    }

    /// Whether a neighbour may stand at `place`.
    pub(super) fn is_between(&self, place: Placement) -> bool {
        (0.0..=self.mission.config().distance_m).contains(&place.x_m)
    }

    /// The altitudes that this relay may choose from, when it holds `altitude_m`.
    pub(super) fn band(&self, altitude_m: f32) -> Band {
        if self.settings.hold_altitude {
            Band::at(altitude_m)
        } else {
            self.mission.config().band
        }
    }
}

/// What the current pass carries.
#[derive(Clone, Debug)]
pub(super) enum Pass {
    Sweep(Sweeping),
    Course(Coursing),
    Turn(Turning),
}

/// Where the joint method has a relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chosen {
    /// Across the line.
    pub(super) at: CrossSection,
    /// Where it was by its own solution of the chain, before courses moved it: every beginning is from there.
    solved: CrossSection,
    /// And no farther along it, m.
    pub(super) end_m: f32,
    /// Whether nobody holds back there.
    pub(super) plain: bool,
}

impl Chosen {
    pub(super) const fn new(at: CrossSection, end_m: f32, plain: bool) -> Self {
        Self {
            at,
            solved: at,
            end_m,
            plain,
        }
    }

    /// What courses have come to counts no more.
    pub(super) const fn begin_again(&mut self) {
        self.at = self.solved;
    }
}

/// A relay's share of the algorithms.
#[derive(Clone, Debug)]
pub(crate) struct Share {
    pub(super) exchange: Exchange,
    pub(super) pass: Pass,
    pub(super) lead: Lead,
    pub(super) sweeps: u32,
    /// What this relay was given.
    pub(super) profile: Profile,
    /// Where the joint method has it in this view, once that is known.
    pub(super) chosen: Option<Chosen>,
    /// Where it is to be across the line.
    pub(super) at: CrossSection,
    /// Where the neighbour toward Rx stands, as far as it has said.
    pub(super) after: Option<Placement>,
    pub(super) setpoint: Option<Placement>,
    pub(super) target: Option<f32>,
    /// At the leader, what no chain can have.
    pub(super) bound: Option<f32>,
}

impl Share {
    /// A relay that has just been switched on. The leader numbers its passes from `number` on, and has work to do.
    pub(crate) const fn new(leader: bool, number: u16, profile: Profile) -> Self {
        Self {
            exchange: Exchange::new(if leader { Phase::Planning } else { Phase::Idle }, number),
            pass: Pass::Sweep(Sweeping::new(Ladder::single(1.0))),
            lead: Lead::No,
            sweeps: 0,
            profile,
            chosen: None,
            at: profile.on_line().at,
            after: None,
            setpoint: None,
            target: None,
            bound: None,
        }
    }

    /// Whether it has just been made.
    #[cfg(feature = "upload")]
    pub(crate) const fn is_untouched(&self) -> bool {
        let at_first = matches!(self.exchange.phase(), Phase::Idle | Phase::Planning);
        at_first && matches!(self.lead, Lead::No) && self.setpoint.is_none()
    }

    /// Another mission is flown from now on, in which this relay is given `profile`. It stays where it is.
    pub(crate) fn load(&mut self, profile: Profile) {
        self.profile = profile;
        self.chosen = None;
        if self.setpoint.is_none() {
            self.at = profile.on_line().at;
        }
    }

    /// The leader begins from the start: with Algorithm 1 or 4, at the altitudes the relays were given.
    pub(crate) fn restart(&mut self) {
        self.lead = Lead::No;
        // Solved once more, the chain is tried at the same targets as the first time.
        self.chosen = None;
        self.exchange.plan();
    }

    /// A view is proposed: what was under way is over.
    pub(crate) fn suspend(&mut self) {
        self.lead = Lead::No;
        self.pass = Pass::Sweep(Sweeping::new(Ladder::single(1.0)));
        self.exchange.answer();
    }

    /// The new view is in force: everybody's first pass in it is still to come.
    pub(crate) fn renew(&mut self, leads: bool) {
        self.lead = Lead::No;
        self.after = None;
        self.chosen = None;
        self.exchange.renew(leads);
    }

    pub(super) fn give_up(&mut self) -> Next {
        self.exchange.give_up();
        Next::Infeasible
    }

    /// Goes on with a computation: the relay's own share of the current pass, or the leader's next pass.
    ///
    /// Bounded by 12 hops of 16 reaches, 128 points of an uneven field (or all of them for one target), ten relays of the joint method,
    /// or 624 places of Algorithm 2.
    pub(crate) fn work(&mut self, own: Own<'_>) -> Next {
        if self.exchange.phase() == Phase::Waiting {
            match &self.pass {
                Pass::Sweep(sweeping) if !sweeping.is_done() => {
                    let unknown = ALTITUDE && sweeping.chosen && self.chosen.is_none();
                    if unknown && self.solve(own).is_none() {
                        return Next::Work { moved: false };
                    }
                    return self.go_on_with_sweep(own);
                }
                Pass::Turn(_) if ADJUST => return self.go_on_with_turn(own),
                _ => {}
            }
        }
        if own.index != own.mission.leader() || self.exchange.phase() == Phase::Waiting {
            return self.think(own);
        }
        match self.plan(own) {
            Ok(true) => self.begin_pass(own),
            Ok(false) => Next::Work { moved: false },
            Err(Infeasible) => self.give_up(),
        }
    }

    /// What to hand onward, while an answer is awaited.
    pub(crate) fn onward(&self, own: Own<'_>) -> Option<Message> {
        if self.exchange.phase() != Phase::Waiting {
            return None;
        }
        let (number, mission) = (self.exchange.number(), own.digest);
        match &self.pass {
            Pass::Sweep(sweeping) if !sweeping.is_done() => None,
            Pass::Sweep(sweeping) => Some(Message::Sweep(Sweep {
                number,
                mission,
                ladder: sweeping.ladder,
                relay: self.station_for(sweeping.chosen),
                chosen: sweeping.chosen,
                measured_per_w: own.measured_per_w,
                reaches: sweeping.reaches.clone(),
            })),
            Pass::Course(coursing) if ALTITUDE => Some(Message::Course(Course {
                number,
                mission,
                power_w: self.profile.power_w,
                bar: coursing.bar,
                trials: coursing.own.clone(),
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
            _ => None,
        }
    }

    /// Whether there is something to hand back.
    pub(crate) fn has_answer(&self) -> bool {
        self.exchange.is_answered()
    }

    /// Whether the current pass is one on which relays compute for a while.
    pub(crate) const fn is_slow(&self) -> bool {
        match &self.pass {
            Pass::Turn(_) => true,
            Pass::Sweep(sweeping) => sweeping.chosen,
            _ => false,
        }
    }

    /// What to hand back, once it is known.
    pub(crate) fn back(&self, own: Own<'_>) -> Option<Message> {
        if !self.exchange.is_answered() {
            return None;
        }
        let (number, mission) = (self.exchange.number(), own.digest);
        match &self.pass {
            Pass::Sweep(sweeping) => Some(Message::Verdict(Answer {
                number,
                mission,
                verdict: sweeping.verdict.clone(),
                stand: sweeping.stand(),
                own: sweeping.own || self.differs(own),
            })),
            Pass::Course(coursing) if ALTITUDE => {
                coursing.worth.map(|(trial, slack_m, outlook)| {
                    Message::Worth(Worth {
                        number,
                        mission,
                        trial,
                        slack_m,
                        outlook,
                    })
                })
            }
            Pass::Turn(turning) if ADJUST => self.setpoint.map(|place| {
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
        self.exchange.number()
    }

    pub(crate) const fn phase(&self) -> Phase {
        self.exchange.phase()
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
        match &self.lead {
            Lead::Adjusting(rounds) => Some((rounds.done(), rounds.sir)),
            _ => None,
        }
    }
}
