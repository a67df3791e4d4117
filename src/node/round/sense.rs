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
use super::state::{Action, Phase};
use crate::node::context::{Context, Member};
use crate::node::sample::Sample;
use crate::node::timing::PAUSE;
use crate::place::Placement;
use crate::sensing::belief::{Belief, Knowledge, Spread, Told, review};
use crate::sensing::doubt::{Next, Trial, is_absurd, is_deaf, is_off};
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::listener::{Average, Listener, left};
use crate::sensing::sums::{EndsOff, Level, Levels, Sums, UNIT_W, is_level, terms};
use crate::settings::Listen;
use crate::side::Side;
use crate::time::{Duration, Instant};
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
        if let Some(next) = arrival.refused() {
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

/// Whether this crate was built to listen. If not, none of its code is reached.
pub(crate) const SENSING: bool = cfg!(feature = "sensing");

/// A relay hears nothing of its line from farther away than so many times the distance.
const FARTHEST: f32 = 100.0;

/// What a relay hears, and what it believes of it: nothing, and no room for it, where this crate was built without `sensing`.
#[derive(Clone, Debug)]
pub(crate) struct Sensing([Ear; SENSING as usize]);

/// What a relay that listens hears, and what it believes of it.
#[expect(clippy::struct_excessive_bools, reason = "each for itself")]
#[derive(Clone, Copy, Debug)]
pub(super) struct Ear {
    pub(super) listener: Listener,
    pub(super) told: Told,
    /// What the transmitter and the receiver hear, as far as they have told this relay.
    pub(super) transmitter: Average,
    pub(super) receiver: Average,
    /// Whether this relay hears something else than all the others, and leaves itself out.
    pub(super) off: bool,
    /// Who was left out of the last pass, and of the last two; 0 for nobody.
    pub(super) left_out: u16,
    pub(super) named: u16,
    /// At the leader: the search for who is wrong, and the ends that are.
    pub(super) trial: Trial,
    pub(super) ends: EndsOff,
    /// Whether what came back last does not fit together, and nobody knows who is wrong.
    pub(super) contradicted: bool,
    /// Whether it hears nothing where the others say that there is much to hear.
    pub(super) deaf: bool,
    /// Measurements in a row that were nothing above the noise, of a relay that has not heard anything yet, and where the last one was.
    pub(super) silent: u8,
    pub(super) silent_at: Placement,
    /// At the leader: whether it has told the relays of the view what it believes.
    pub(super) has_told: bool,
    /// How much was known when that was taken up.
    pub(super) known: Knowledge,
    /// Why nothing was made of the last sums.
    pub(super) unfit: Option<Unfit>,
    /// How long to wait for the next pass, and until when.
    pub(super) wait: u32,
    pub(super) kept: u8,
    pub(super) at: Option<Instant>,
}

/// What is believed before anything is found.
const AS_LOADED: Told = Told {
    number: 0,
    belief: Belief::Mission,
};

impl Sensing {
    pub(super) const fn new(listen: Option<Listen>, now: Instant) -> Self {
        let half_life = match listen {
            Some(listen) => listen.half_life,
            None => Duration::from_micros(0),
        };
        let ear = Ear {
            listener: Listener::new(half_life, now),
            told: AS_LOADED,
            transmitter: Average::NONE,
            receiver: Average::NONE,
            off: false,
            left_out: 0,
            named: 0,
            trial: Trial::NONE,
            ends: EndsOff::NONE,
            contradicted: false,
            deaf: false,
            silent: 0,
            silent_at: Placement::on_line(0.0, 0.0),
            has_told: false,
            known: Knowledge::NOTHING,
            unfit: None,
            wait: 1,
            kept: 0,
            at: None,
        };
        Self([ear; SENSING as usize])
    }

    pub(super) const fn ear(&self) -> Option<&Ear> {
        let ears: &[Ear] = &self.0;
        ears.first()
    }

    pub(super) const fn ear_mut(&mut self) -> Option<&mut Ear> {
        let ears: &mut [Ear] = &mut self.0;
        ears.first_mut()
    }

    /// A new view: the leader tells what it believes before anything is agreed on.
    pub(super) const fn renew(&mut self) {
        if let Some(ear) = self.ear_mut() {
            ear.has_told = false;
            ear.at = None;
            ear.trial = Trial::NONE;
        }
    }

    /// Another mission is flown.
    pub(super) const fn load(&mut self) {
        if let Some(ear) = self.ear_mut() {
            ear.told.belief = Belief::Mission;
            ear.told.number = ear.told.number.wrapping_add(1);
            // The ends may stand elsewhere.
            ear.transmitter = Average::NONE;
            ear.receiver = Average::NONE;
            ear.known = Knowledge::NOTHING;
            ear.ends = EndsOff::NONE;
            ear.wait = 1;
        }
    }

    pub(super) fn next_timeout(&self) -> Option<Instant> {
        self.ear()?.at
    }

    /// Whether its time has come; once.
    pub(super) fn take_due(&mut self, now: Instant) -> bool {
        self.ear_mut()
            .is_some_and(|ear| ear.at.take_if(|at| *at <= now).is_some())
    }

    /// What it believes.
    pub(crate) const fn told(&self) -> Told {
        match self.ear() {
            Some(ear) => ear.told,
            None => AS_LOADED,
        }
    }

    /// At the leader: why nothing was made of what was heard last.
    pub(crate) const fn unfit(&self) -> Option<Unfit> {
        match self.ear() {
            Some(ear) => ear.unfit,
            None => None,
        }
    }

    /// What the end at `side` has told this relay, W; `None` before it has.
    pub(crate) fn level_w(&self, side: Side) -> Option<f32> {
        let ear = self.ear()?;
        let level_w = match side {
            Side::Upstream => ear.transmitter.mean,
            Side::Downstream => ear.receiver.mean,
        };
        (level_w > 0.0).then_some(level_w)
    }

    /// What has come of it so far.
    pub(super) fn found(&self) -> Findings {
        Findings {
            told: self.told(),
            unfit: self.unfit(),
            off: self.ear().map_or(0, |ear| ear.named),
            ends: self.ear().map_or(EndsOff::NONE, |ear| ear.ends),
            deaf: self.ear().is_some_and(|ear| ear.deaf),
        }
    }

    /// One measurement; whether it was of use.
    pub(super) fn take(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        self.ear_mut()
            .is_some_and(|ear| ear.take(now, member, sample))
    }
}

impl Ear {
    /// What an end hears of which this is the average.
    pub(super) fn level(&self, average: &Average, now: Instant) -> Level {
        let age = now.since(average.last);
        Level {
            power_w: average.mean,
            count: average.weight * left(age, self.listener.half_life()),
        }
    }

    /// One measurement; whether it was of use.
    fn take(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        let noise_w = member.mission.config().noise_w;
        // What is left above the receiver's own noise.
        let heard = |power_w: f32| {
            let heard_w = power_w - noise_w;
            is_level(heard_w).then_some(heard_w)
        };
        let half_life = self.listener.half_life();
        match sample {
            Sample::Heard { at, power_w } if is_near(at, member.mission.config().distance_m) => {
                let Some(heard_w) = heard(power_w) else {
                    if power_w >= 0.0 && power_w <= noise_w {
                        self.silent = self.silent.saturating_add(1);
                        self.silent_at = at;
                    }
                    return false;
                };
                (self.silent, self.deaf) = (0, false);
                let distance_m = member.mission.config().distance_m;
                let expected = expected_at(&member.mission);
                self.listener
                    .take(now, distance_m, at, heard_w / UNIT_W, expected);
                true
            }
            Sample::Transmitter { power_w } => {
                take_level(&mut self.transmitter, now, half_life, heard(power_w))
            }
            Sample::Receiver { power_w } => {
                take_level(&mut self.receiver, now, half_life, heard(power_w))
            }
            _ => false,
        }
    }
}

/// A pass on which relays add up what they hear, as one of them sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense {
    pub(super) hearing: Heard,
    /// What came from the relay before.
    pub(super) from: Sums,
    /// Its own share.
    pub(super) own: Sums,
    /// Whether places were agreed on by what is believed.
    pub(super) holds: bool,
}

/// What has come of listening so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Findings {
    pub(super) told: Told,
    pub(super) unfit: Option<Unfit>,
    /// Who hears something else than all the others, as of the last pass.
    pub(super) off: u16,
    pub(super) ends: EndsOff,
    pub(super) deaf: bool,
}

impl Findings {
    /// The node whose measurements are off, and were not `before`, as node `own` of `all` sees it; the ends of the line are 0 and `all` + 1.
    pub(super) fn newly_off(&self, before: &Self, own: u16, all: u16) -> Option<u16> {
        if self.off != before.off && self.off != 0 {
            return Some(self.off);
        }
        if self.deaf && !before.deaf {
            return Some(own);
        }
        if self.ends.receiver && !before.ends.receiver {
            return Some(all.saturating_add(1));
        }
        (self.ends.transmitter && !before.ends.transmitter).then_some(0)
    }
}

/// Takes what an end hears, if that is anything above the noise; whether it is.
fn take_level(
    average: &mut Average,
    now: Instant,
    half_life: Duration,
    heard_w: Option<f32>,
) -> bool {
    if let Some(heard_w) = heard_w {
        average.take(now, half_life, heard_w);
    }
    heard_w.is_some()
}

/// Whether what is heard there says anything of the line: within so many times its length of Tx in each coordinate.
fn is_near(at: Placement, distance_m: f32) -> bool {
    let far_m = FARTHEST * distance_m;
    [at.x_m, at.y_m, at.altitude_m]
        .iter()
        .all(|metres| (-far_m..=far_m).contains(metres))
}
