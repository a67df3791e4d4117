//! The pass on which the relays add up what they hear, and tell each other what they believe of it.
//!
//! | the leader | what follows |
//! | --- | --- |
//! | a view is new, or it was switched on | a pass tells all what it believes; then the places are agreed on |
//! | the chain has agreed, and its time has come | a pass; what comes back is reviewed |
//! | another belief is better | its number is one higher; a pass tells all; then new places are agreed on |
//! | none is | all hold their places; the next pass comes after twice the time, up to 64 times [`Listen::every`](crate::settings::Listen) |
//!
//! A relay that has missed such a pass can take no part in the next one: its number is not the one that follows. So whoever agrees on
//! places believes what all do.

use super::computation::{Computation, PassKind};
use super::ear::{SENSING, Sense};
use super::state::{Action, Phase};
use crate::node::context::Context;
use crate::sensing::belief::{Told, review};
use crate::sensing::doubt::is_off;
use crate::sensing::fit::expected_at;
use crate::sensing::level::{Level, Levels};
use crate::sensing::sums::Sums;
use crate::wire::message::Heard;

/// The time between passes grows up to so many times the least.
const RAREST: u32 = 64;

/// and doubles when so many passes in a row have changed nothing.
const PATIENCE: u8 = 4;

impl Computation {
    /// Whether the chain finds its interferer by itself.
    pub(super) fn senses(context: &Context<'_>) -> bool {
        SENSING && context.settings().listen.is_some() && context.mission().field().is_none()
    }

    /// Whether the leader has to tell what it believes before anything else.
    pub(super) fn has_to_tell(&self, context: &Context<'_>) -> bool {
        Self::senses(context)
            && context.leads()
            && self.sensing.ear().is_some_and(|ear| !ear.has_told)
    }

    /// Whether nothing else is under way.
    pub(super) fn may_sense(&self, context: &Context<'_>) -> bool {
        let settled = matches!(self.state.phase(), Phase::Holding | Phase::Infeasible);
        Self::senses(context) && context.leads() && settled
    }

    /// The leader plans its next look, if it holds a place.
    pub(super) fn plan_to_sense(&mut self, context: &Context<'_>) {
        if let Some(listen) = context.settings().listen
            && self.may_sense(context)
            && let Some(ear) = self.sensing.ear_mut()
            && ear.at.is_none()
        {
            ear.at = Some(context.now + listen.every.times(ear.wait));
        }
    }

    /// The leader begins such a pass.
    pub(super) fn begin_sense(&mut self, context: &Context<'_>) -> Action {
        let Some(ear) = self.sensing.ear_mut() else {
            return Action::Nothing;
        };
        let has_told = core::mem::replace(&mut ear.has_told, true);
        let holds = has_told && self.state.phase() == Phase::Holding;
        self.begin();
        let hearing = Heard {
            number: self.state.number(),
            mission: context.digest(),
            told: self.sensing.told(),
            sums: Sums::NONE,
            receiver: Level::default(),
            off: 0,
        };
        self.sense(context, hearing, holds)
    }

    /// One from the relay before.
    pub(crate) fn on_sense(&mut self, context: &Context<'_>, hearing: &Heard) -> Action {
        let same = matches!(&self.pass, PassKind::Sense(known)
            if known.hearing.told == hearing.told && known.from == hearing.sums);
        let arrival = self.state.arrival(hearing.number, same);
        if let Some(next) = arrival.refused(self.state) {
            return next;
        }
        if !Self::senses(context) {
            return Action::Stale;
        }
        let holds = self.state.phase() == Phase::Holding && hearing.told == self.sensing.told();
        self.state.take(hearing.number);
        self.sense(context, *hearing, holds)
    }

    fn sense(&mut self, context: &Context<'_>, hearing: Heard, holds: bool) -> Action {
        let Some(ear) = self.sensing.ear_mut() else {
            return Action::Stale;
        };
        if hearing.told != ear.told || !holds {
            // Where all are to be follows from it.
            ear.told = hearing.told;
            self.task.rest();
            self.chosen = None;
        }
        let mission = context.mission();
        let own = if ear.off {
            Sums::NONE
        } else {
            let distance_m = mission.config().distance_m;
            ear.listener
                .sums(context.now, distance_m, expected_at(mission))
        };
        let from = hearing.sums;
        let mut hearing = hearing;
        hearing.sums.merge(&own);
        if context.is_last() {
            hearing.receiver = ear.level(&ear.receiver, context.now);
        }
        self.pass = PassKind::Sense(Sense {
            hearing,
            from,
            own,
            holds,
        });
        self.state.wait();
        if context.is_last() {
            if let PassKind::Sense(sense) = &mut self.pass {
                sense.hearing.sums = Sums::NONE;
            }
            return self.conclude_sense(context);
        }
        Action::Forward
    }

    /// What came of it, from the relay after.
    pub(crate) fn on_sensed(&mut self, context: &Context<'_>, hearing: &Heard) -> Action {
        if let PassKind::Sense(known) = &mut self.pass
            && self.state.awaits(hearing.number)
            && hearing.told == known.hearing.told
        {
            known.hearing.sums = hearing.sums;
            known.hearing.receiver = hearing.receiver;
            known.hearing.off = hearing.off;
            return self.conclude_sense(context);
        }
        Action::Stale
    }

    fn conclude_sense(&mut self, context: &Context<'_>) -> Action {
        self.doubt(context);
        let PassKind::Sense(Sense { hearing, holds, .. }) = self.pass else {
            return Action::Stale;
        };
        if let Some(ear) = self.sensing.ear_mut() {
            ear.named = hearing.off;
        }
        if holds {
            self.state.hold();
        } else {
            self.state.answer();
        }
        if !context.leads() {
            return Action::Answer { agreed: false };
        }
        if holds && !self.reconsiders(context, &hearing) {
            if let Some(ear) = self.sensing.ear_mut() {
                ear.kept = (ear.kept + 1) % PATIENCE;
                if ear.kept == 0 {
                    ear.wait = (2 * ear.wait).min(RAREST);
                }
            }
            return Action::Nothing;
        }
        self.state.plan();
        Action::Work
    }

    /// Whether the leader believes something else from now on.
    fn reconsiders(&mut self, context: &Context<'_>, hearing: &Heard) -> bool {
        let (Some(listen), Some(ear)) = (context.settings().listen, self.sensing.ear_mut()) else {
            return false;
        };
        let levels = Levels {
            transmitter: ear.level(&ear.transmitter, context.now),
            receiver: hearing.receiver,
        };
        let review = review(
            context.mission(),
            &ear.told.belief,
            &hearing.sums,
            &levels,
            &listen,
            ear.known,
            context.now,
        );
        ear.unfit = review.unfit;
        ear.known = review.known;
        let Some(belief) = review.adopt else {
            return false;
        };
        ear.told = Told {
            number: ear.told.number.wrapping_add(1),
            belief,
        };
        ear.has_told = false;
        ear.kept = 0;
        ear.wait = 1;
        self.task.rest();
        self.chosen = None;
        true
    }

    /// Whether this relay hears something else than all the others do: then its share is not added to what those after it hear, and it is
    /// named.
    fn doubt(&mut self, context: &Context<'_>) {
        let (Some(listen), Some(ear), PassKind::Sense(sense)) = (
            context.settings().listen,
            self.sensing.ear_mut(),
            &mut self.pass,
        ) else {
            return;
        };
        let mission = context.mission();
        let mut others = sense.from;
        others.merge(&sense.hearing.sums);
        let place = ear.listener.place(mission.config().distance_m);
        let off = place.is_some_and(|place| {
            let expected = expected_at(mission)(&place.terms);
            is_off(&others, &place, expected, listen.relative_error)
        });
        if off {
            sense.hearing.off = context.member.node;
            ear.listener.forget_past();
        } else {
            sense.hearing.sums.merge(&sense.own);
        }
        ear.off = off;
    }
}
