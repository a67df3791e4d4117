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

use super::computation::{Computation, PassKind, SENSING};
use super::state::{Action, Phase};
use crate::node::context::{Context, Member};
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::sensing::average::{Average, left};
use crate::sensing::belief::{Belief, Known, Told, review};
use crate::sensing::doubt::is_off;
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::listener::Listener;
use crate::sensing::sums::Sums;
use crate::sensing::terms::unit_w;
use crate::settings::Listen;
use crate::time::{Duration, Instant};
use crate::wire::message::{Hearing, Receiver};

/// The time between passes grows up to so many times the least.
const RAREST: u32 = 64;

/// and doubles when so many passes in a row have changed nothing.
const PATIENCE: u8 = 4;

/// What a relay hears, and what it believes of it.
#[derive(Clone, Debug)]
pub(crate) struct Sensing {
    listener: Listener,
    pub(super) told: Told,
    /// What the receiver hears, as far as it has told this relay.
    receiver: Average,
    /// Whether this relay hears something else than all the others.
    off: bool,
    /// Who does, as of the last pass.
    named: u16,
    /// At the leader: whether it has told the relays of the view what it believes.
    has_told: bool,
    /// How much was known when that was taken up.
    known: Known,
    /// Why nothing was made of the last sums.
    unfit: Option<Unfit>,
    /// How long to wait for the next pass, and until when.
    wait: u32,
    kept: u8,
    at: Option<Instant>,
}

impl Sensing {
    pub(super) const fn new(listen: Option<Listen>, now: Instant) -> Self {
        let half_life = match listen {
            Some(listen) => listen.half_life,
            None => Duration::from_micros(0),
        };
        Self {
            listener: Listener::new(half_life, now),
            told: Told {
                number: 0,
                belief: Belief::Mission,
            },
            receiver: Average::NONE,
            off: false,
            named: 0,
            has_told: false,
            known: Known::NOTHING,
            unfit: None,
            wait: 1,
            kept: 0,
            at: None,
        }
    }

    /// A new view: the leader tells what it believes before anything is agreed on.
    pub(super) const fn renew(&mut self) {
        self.has_told = false;
        self.at = None;
    }

    /// Another mission is flown.
    pub(super) const fn load(&mut self) {
        self.told.belief = Belief::Mission;
        self.told.number = self.told.number.wrapping_add(1);
        self.known = Known::NOTHING;
        self.wait = 1;
    }

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }

    /// Whether its time has come; once.
    pub(super) fn take_due(&mut self, now: Instant) -> bool {
        let due = self.at.is_some_and(|at| at <= now);
        if due {
            self.at = None;
        }
        due
    }

    pub(super) const fn unfit(&self) -> Option<Unfit> {
        self.unfit
    }

    fn heard_at_receiver(&self, now: Instant) -> Receiver {
        let Average {
            mean, weight, last, ..
        } = self.receiver;
        Receiver {
            power_w: mean,
            count: weight * left(now.since(last), self.listener.half_life()),
        }
    }

    /// What has come of it so far.
    pub(super) const fn found(&self) -> Found {
        Found {
            told: self.told,
            unfit: self.unfit,
            off: self.named,
        }
    }

    /// One measurement; whether it was of use.
    pub(super) fn take(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        let noise_w = member.mission.config().noise_w;
        // What is left above the receiver's own noise.
        let heard = |power_w: f32| {
            let heard_w = power_w - noise_w;
            (1e-30..=1e6).contains(&heard_w).then_some(heard_w)
        };
        match sample {
            Sample::Heard { at, power_w } if is_near(at) => {
                let Some(heard_w) = heard(power_w) else {
                    return false;
                };
                let unit = unit_w(&member.mission);
                let distance_m = member.mission.config().distance_m;
                let expected = expected_at(&member.mission);
                self.listener
                    .take(now, distance_m, at, heard_w / unit, expected);
                true
            }
            Sample::Receiver { power_w } => {
                let heard = heard(power_w);
                if let Some(heard_w) = heard {
                    self.receiver.take(now, self.listener.half_life(), heard_w);
                }
                heard.is_some()
            }
            _ => false,
        }
    }
}

/// What has come of listening so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub(super) told: Told,
    pub(super) unfit: Option<Unfit>,
    /// Who hears something else than all the others, as of the last pass.
    pub(super) off: u16,
}

/// Whether a drone may be there.
fn is_near(at: Placement) -> bool {
    [at.x_m, at.y_m, at.altitude_m]
        .iter()
        .all(|metres| (-1e7..=1e7).contains(metres))
}

/// A pass of that kind, as one relay sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense {
    pub(super) hearing: Hearing,
    /// What came from the relay before.
    from: Sums,
    /// Its own share.
    own: Sums,
    /// Whether places were agreed on by what is believed.
    holds: bool,
}

impl Computation {
    /// Whether the chain finds its interferer by itself.
    pub(super) fn senses(context: &Context<'_>) -> bool {
        SENSING && context.settings().listen.is_some() && context.mission().field().is_none()
    }

    /// Whether the leader has to tell what it believes before anything else.
    pub(super) fn has_to_tell(&self, context: &Context<'_>) -> bool {
        Self::senses(context) && context.leads() && !self.sensing.has_told
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
            && self.sensing.at.is_none()
        {
            self.sensing.at = Some(context.now + listen.every.times(self.sensing.wait));
        }
    }

    /// The leader begins such a pass.
    pub(super) fn begin_sense(&mut self, context: &Context<'_>) -> Action {
        let holds = self.sensing.has_told && self.state.phase() == Phase::Holding;
        self.begin();
        self.sensing.has_told = true;
        let hearing = Hearing {
            number: self.state.number(),
            mission: context.digest(),
            told: self.sensing.told,
            sums: Sums::NONE,
            receiver: Receiver::default(),
            off: 0,
        };
        self.sense(context, hearing, holds)
    }

    /// One from the relay before.
    pub(crate) fn on_sense(&mut self, context: &Context<'_>, hearing: &Hearing) -> Action {
        let same = matches!(&self.pass, PassKind::Sense(known)
            if known.hearing.told == hearing.told && known.from == hearing.sums);
        let arrival = self.state.arrival(hearing.number, same);
        if let Some(next) = arrival.refused(self.state) {
            return next;
        }
        if !Self::senses(context) {
            return Action::Stale;
        }
        let holds = self.state.phase() == Phase::Holding && hearing.told == self.sensing.told;
        self.state.take(hearing.number);
        self.sense(context, *hearing, holds)
    }

    fn sense(&mut self, context: &Context<'_>, hearing: Hearing, holds: bool) -> Action {
        if hearing.told != self.sensing.told || !holds {
            // Where all are to be follows from it.
            self.sensing.told = hearing.told;
            self.task.rest();
            self.chosen = None;
        }
        let mission = context.mission();
        let own = if self.sensing.off {
            Sums::NONE
        } else {
            let distance_m = mission.config().distance_m;
            self.sensing
                .listener
                .sums(context.now, distance_m, expected_at(mission))
        };
        let from = hearing.sums;
        let mut hearing = hearing;
        hearing.sums.merge(&own);
        if context.is_last() {
            hearing.receiver = self.sensing.heard_at_receiver(context.now);
        }
        self.pass = PassKind::Sense(Sense {
            hearing,
            from,
            own,
            holds,
        });
        self.state.wait();
        if context.is_last() {
            return self.conclude_sense(context);
        }
        Action::Forward
    }

    /// What came of it, from the relay after.
    pub(crate) fn on_sensed(&mut self, context: &Context<'_>, hearing: &Hearing) -> Action {
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
        self.sensing.named = hearing.off;
        if holds {
            self.state.hold();
        } else {
            self.state.answer();
        }
        if !context.leads() {
            return Action::Answer { agreed: false };
        }
        if holds && !self.reconsiders(context, &hearing) {
            self.sensing.kept = (self.sensing.kept + 1) % PATIENCE;
            if self.sensing.kept == 0 {
                self.sensing.wait = (2 * self.sensing.wait).min(RAREST);
            }
            return Action::Nothing;
        }
        self.state.plan();
        Action::Work
    }

    /// Whether the leader believes something else from now on.
    fn reconsiders(&mut self, context: &Context<'_>, hearing: &Hearing) -> bool {
        let Some(listen) = context.settings().listen else {
            return false;
        };
        let review = review(
            context.mission(),
            &self.sensing.told.belief,
            &hearing.sums,
            hearing.receiver,
            &listen,
            self.sensing.known,
            context.now,
        );
        self.sensing.unfit = review.unfit;
        self.sensing.known = review.known;
        let Some(belief) = review.adopt else {
            return false;
        };
        self.sensing.told = Told {
            number: self.sensing.told.number.wrapping_add(1),
            belief,
        };
        self.sensing.has_told = false;
        self.sensing.kept = 0;
        self.sensing.wait = 1;
        self.task.rest();
        self.chosen = None;
        true
    }

    /// Whether this relay hears something else than all the others do: then its share is left out, and it is named.
    fn doubt(&mut self, context: &Context<'_>) {
        let (Some(listen), PassKind::Sense(Sense { hearing, own, .. })) =
            (context.settings().listen, &mut self.pass)
        else {
            return;
        };
        let distance_m = context.mission().config().distance_m;
        let Some(place) = self.sensing.listener.place(distance_m) else {
            return;
        };
        let others = hearing.sums.without(own);
        let off = is_off(&others, &place, listen.relative_error);
        if off {
            hearing.sums = others;
            hearing.off = context.member.node;
            self.sensing.listener.forget_past();
        }
        self.sensing.off = off;
    }
}
