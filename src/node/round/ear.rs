//! What one relay has heard and believes, between the passes.

use crate::node::context::Member;
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::sensing::average::{Average, left};
use crate::sensing::belief::{Belief, Knowledge, Told};
use crate::sensing::doubt::Trial;
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::level::{EndsOff, Level, is_level};
use crate::sensing::listener::Listener;
use crate::sensing::sums::Sums;
use crate::sensing::terms::UNIT_W;
use crate::settings::Listen;
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::wire::message::Heard;

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
