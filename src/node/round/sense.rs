//! The pass on which the relays add up what they hear, and tell each other what they believe of it.
//!
//! | the leader | what follows |
//! | --- | --- |
//! | a view is new, or it was switched on | a pass tells all what it believes; then the places are agreed on |
//! | the chain has agreed, and its time has come | a pass; what comes back is reviewed |
//! | nobody hears enough, and all three spreads were tried | the same, and the next pass comes after twice the time |
//! | another belief is better | its number is one higher; a pass tells all; then new places are agreed on |
//! | what comes back does not fit together | passes of which one relay after the other is left out, see [`doubt`](crate::sensing) |
//! | none is | all hold their places; the next pass comes after twice the time, up to 64 times [`Listen::every`](crate::settings::Listen) |
//!
//! A relay that has missed such a pass can take no part in the next one: its number is not the one that follows. So whoever agrees on
//! places believes what all do.

use super::computation::{Computation, PassKind};
use super::ear::{SENSING, Sense};
use super::state::{Action, Phase};
use crate::node::context::Context;
use crate::node::timing::PAUSE;
use crate::sensing::belief::{Belief, Spread, Told, review};
use crate::sensing::doubt::{Next, is_absurd, is_deaf, is_off};
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::level::{Level, Levels};
use crate::sensing::sums::Sums;
use crate::sensing::terms::terms;
use crate::time::Duration;
use crate::wire::message::Heard;

/// The time between passes grows up to so many times the least.
const RAREST: u32 = 64;

/// and doubles when so many passes in a row have changed nothing.
const PATIENCE: u8 = 4;

/// Passes of a search for who is wrong in the least time between two usual ones.
const TRIALS_A_PERIOD: u64 = 8;

/// Measurements of nothing in a row after which a relay may be deaf.
const SILENT: u8 = 8;

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
        let left_out = ear.trial.left_out();
        let holds = has_told && self.state.phase() == Phase::Holding;
        self.begin();
        let hearing = Heard {
            number: self.state.number(),
            mission: context.digest(),
            told: self.sensing.told(),
            sums: Sums::NONE,
            receiver: Level::default(),
            off: if holds { left_out } else { 0 },
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
        // Who is left out twice is left out for good.
        let twice = hearing.off == ear.left_out;
        ear.named = if twice { hearing.off } else { 0 };
        ear.left_out = hearing.off;
        let is_out = hearing.off == context.member.node;
        ear.off |= twice && is_out;
        let own = if ear.off || is_out {
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
        if let (PassKind::Sense(known), Some(ear)) = (&mut self.pass, self.sensing.ear_mut())
            && self.state.awaits(hearing.number)
            && hearing.told == known.hearing.told
        {
            known.hearing.sums = hearing.sums;
            known.hearing.receiver = hearing.receiver;
            if hearing.off != known.hearing.off {
                known.hearing.off = hearing.off;
                ear.named = hearing.off;
            }
            return self.conclude_sense(context);
        }
        Action::Stale
    }

    fn conclude_sense(&mut self, context: &Context<'_>) -> Action {
        self.doubt(context);
        let PassKind::Sense(Sense { hearing, holds, .. }) = self.pass else {
            return Action::Stale;
        };
        if holds {
            self.state.hold();
        } else {
            self.state.answer();
        }
        if !context.leads() {
            return Action::Answer { agreed: false };
        }
        if holds && self.tries(context, &hearing) {
            return Action::Settled;
        }
        if holds && !self.reconsiders(context, &hearing) {
            if let Some(ear) = self.sensing.ear_mut() {
                ear.kept = (ear.kept + 1) % PATIENCE;
                if ear.kept == 0 {
                    ear.wait = (2 * ear.wait).min(RAREST);
                }
            }
            return Action::Settled;
        }
        self.state.plan();
        Action::Work
    }

    /// Whether the leader goes on with a search for who is wrong: then what came back counts for nothing else.
    fn tries(&mut self, context: &Context<'_>, hearing: &Heard) -> bool {
        let (Some(listen), Some(ear)) = (context.settings().listen, self.sensing.ear_mut()) else {
            return false;
        };
        let (relays, nodes) = (context.mission().relays(), context.member.all);
        let next = ear
            .trial
            .take(&hearing.sums, listen.relative_error, relays, nodes);
        ear.contradicted = next == Next::Unknown;
        if next == Next::Again {
            let pause = Duration::from_micros(listen.every.as_micros() / TRIALS_A_PERIOD);
            ear.at = Some(context.now + PAUSE.max(pause));
        }
        next == Next::Again
    }

    /// Whether the leader believes something else from now on.
    fn reconsiders(&mut self, context: &Context<'_>, hearing: &Heard) -> bool {
        let (Some(listen), Some(ear)) = (context.settings().listen, self.sensing.ear_mut()) else {
            return false;
        };
        let levels = Levels {
            transmitter: ear.level(&ear.transmitter, context.now),
            receiver: hearing.receiver,
            off: ear.ends,
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
        ear.unfit = match review.unfit {
            None if ear.contradicted => Some(Unfit::Contradiction),
            unfit => unfit,
        };
        ear.ends = review.ends;
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
        ear.wait = match belief {
            // All three spreads in vain: relays that cannot learn anything fly about less and less often.
            Belief::Unknown(Spread::Even) => (2 * ear.wait).min(RAREST),
            Belief::Unknown(_) => ear.wait,
            _ => 1,
        };
        self.task.rest();
        self.chosen = None;
        true
    }

    /// Adds this relay's share to what those after it hear. One that has left itself out looks whether it fits the others again; one that has
    /// never heard anything, where the others say that there is much to hear, names itself.
    fn doubt(&mut self, context: &Context<'_>) {
        let (Some(listen), Some(ear), PassKind::Sense(sense)) = (
            context.settings().listen,
            self.sensing.ear_mut(),
            &mut self.pass,
        ) else {
            return;
        };
        let mission = context.mission();
        let distance_m = mission.config().distance_m;
        let mut others = sense.from;
        others.merge(&sense.hearing.sums);
        let place = ear.listener.place(distance_m);
        let expected = place.and_then(|place| expected_at(mission)(&place.terms));
        let error = listen.relative_error;
        if ear.off {
            // What it heard elsewhere while it was off is nothing to go by.
            ear.listener.forget_past();
            ear.off = place.is_some_and(|place| is_off(&others, &place, expected, error));
        } else if place.is_some_and(|place| is_absurd(&others, &place, expected, error)) {
            ear.off = true;
            ear.named = context.member.node;
            sense.hearing.off = context.member.node;
            return;
        } else if ear.silent >= SILENT {
            let there = terms(distance_m, ear.silent_at);
            if place.is_none()
                && is_deaf(
                    &others,
                    &there,
                    mission.config().noise_w,
                    listen.relative_error,
                )
            {
                ear.deaf = true;
            }
        }
        sense.hearing.sums.merge(&sense.own);
    }
}
