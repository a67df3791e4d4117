//! One pass of targets and altitude levels along the chain, toward Rx: how far each relay reaches for every pair of them.
//!
//! For a target, a relay's reach at one of its levels is the farthest over all the levels that the relay before it may
//! stand at; that relay's level is kept, so that the choice of the last relay can be traced back. Farthest per level is not
//! exact: near the interferer a climb may be impossible from a place farther on that was possible from one before it.

use super::coded::{Coded, PLACES};
use super::levels::{Levels, MOST_LEVELS};
use super::spacing::{Hop, receiver_reach};
use crate::mission::{Band, Interferer, Mission, Profile};
use crate::sir::Sender;

/// The targets of one pass, in nine bytes: one that is thought to be met, and others above it.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Rungs {
    /// The lowest target, linear SIR.
    base: f32,
    /// By how much of it the highest is above it; each one below is half as far.
    rise: f32,
    count: u8,
}

impl Rungs {
    /// `count` targets, 1 to 16, from `base` up to `base` (1 + `rise`).
    pub const fn new(base: f32, rise: f32, count: u8) -> Self {
        Self { base, rise, count }
    }

    /// Targets from their parts, if they are normal f32s above zero, rising by 0 to 1e6, and 1 to 16.
    pub fn from_parts(base: f32, rise: f32, count: u8) -> Option<Self> {
        let sound = (f32::MIN_POSITIVE..=1e30).contains(&base)
            && (0.0..=1e6).contains(&rise)
            && (1..=16).contains(&count);
        sound.then_some(Self { base, rise, count })
    }

    /// Base, rise and count, as [`Rungs::from_parts`] takes them.
    pub const fn parts(&self) -> (f32, f32, u8) {
        (self.base, self.rise, self.count)
    }

    /// How many there are.
    pub const fn count(&self) -> u8 {
        self.count
    }

    /// By how much of the base target `at` is above it.
    pub fn rise(&self, at: u8) -> f32 {
        if at == 0 {
            return 0.0;
        }
        let halvings = u32::from(self.count.saturating_sub(1).saturating_sub(at));
        self.rise / (1_u32 << halvings.min(15)) as f32
    }

    /// Target `at`, linear SIR.
    pub fn target(&self, at: u8) -> f32 {
        self.base + self.base * self.rise(at)
    }
}

/// A target and a level, by their numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Choice {
    /// The target.
    pub target: u8,
    /// The level.
    pub level: u8,
}

/// A relay's share of one pass, worked out in portions.
#[derive(Clone, Debug)]
pub struct Wave {
    rungs: Rungs,
    /// The node before this one, its power in its gain, and its levels.
    sender: Sender,
    from: Levels,
    /// This relay's levels.
    own: Levels,
    /// What the node before this one reaches: target by target, level by level.
    before: Coded,
    reaches: Coded,
    /// The level of the node before this one that each reach starts from.
    starts: [u8; PLACES],
    /// The pair of this relay's to work out next.
    next: u8,
}

impl Wave {
    /// Nothing to work out.
    pub const fn new(mission: &Mission) -> Self {
        Self {
            rungs: Rungs::new(1.0, 0.0, 1),
            sender: Sender::transmitter(mission),
            from: Levels::held(0.0, 1),
            own: Levels::held(1.0, 1),
            before: Coded::new(),
            reaches: Coded::new(),
            starts: [0; PLACES],
            next: 0,
        }
    }

    /// Begins the pass at the transmitter, for relay 1 with the levels `own`.
    pub fn begin(&mut self, mission: &Mission, rungs: Rungs, own: Levels) {
        self.before = Coded::new();
        for target in 0..rungs.count {
            self.before
                .set(usize::from(target), Some(0.0), mission.config().distance_m);
        }
        self.sender = Sender::transmitter(mission);
        self.from = Levels::held(0.0, 1);
        self.set_out(rungs, own);
    }

    /// Takes over the pass from the relay before, which feeds the hop with `power_w` watts from the levels `from`.
    pub fn take(
        &mut self,
        mission: &Mission,
        rungs: Rungs,
        from: Levels,
        power_w: f32,
        reaches: &[u8],
        own: Levels,
    ) {
        self.before.fill(reaches);
        self.sender = Sender::relay(
            mission,
            Profile {
                altitude_m: 0.0,
                power_w,
            },
        );
        self.from = from;
        self.set_out(rungs, own);
    }

    /// Goes on as the next relay of a chain of equals, which has the same levels: what it takes over are the own reaches.
    pub fn hand_over(&mut self, mission: &Mission, power_w: f32) {
        core::mem::swap(&mut self.before, &mut self.reaches);
        self.sender = Sender::relay(
            mission,
            Profile {
                altitude_m: 0.0,
                power_w,
            },
        );
        self.from = self.own;
        self.set_out(self.rungs, self.own);
    }

    fn set_out(&mut self, rungs: Rungs, own: Levels) {
        self.rungs = rungs;
        self.own = own;
        self.reaches = Coded::new();
        self.next = 0;
    }

    /// How many pairs of a target and a level there are, at most [`PLACES`].
    fn pairs(&self) -> u8 {
        let pairs = u16::from(self.rungs.count) * u16::from(self.own.count());
        u8::try_from(pairs).map_or(MOST_LEVELS, |pairs| pairs.min(MOST_LEVELS))
    }

    /// Works out some more reaches of relay `index`; whether all are known.
    ///
    /// Bounded by `budget` + 64 evaluations of a hop.
    pub fn step(
        &mut self,
        mission: &Mission,
        interferer: &Interferer,
        index: u16,
        budget: u16,
    ) -> bool {
        let mut left = budget;
        while self.next < self.pairs() {
            if left == 0 {
                return false;
            }
            let level = self.next % self.own.count().max(1);
            let target = self.next / self.own.count().max(1);
            let (reach, start) = self.reach(mission, interferer, index, target, level);
            let at = usize::from(self.next);
            self.reaches.set(at, reach, mission.config().distance_m);
            if let Some(place) = self.starts.get_mut(at) {
                *place = start;
            }
            left = left.saturating_sub(u16::from(self.from.count()));
            self.next += 1;
        }
        true
    }

    /// The farthest place for `target` at `level`, and the level before it that leads there.
    fn reach(
        &self,
        mission: &Mission,
        interferer: &Interferer,
        index: u16,
        target: u8,
        level: u8,
    ) -> (Option<f32>, u8) {
        let MissionBand { band, distance_m } = MissionBand::of(mission);
        let sir = self.rungs.target(target);
        let altitude_m = self.own.altitude(band, level);
        let mut farthest: Option<f32> = None;
        let mut from = 0;
        for start in 0..self.from.count() {
            let at = usize::from(target) * usize::from(self.from.count()) + usize::from(start);
            let Some(from_m) = self.before.get(at, distance_m) else {
                continue;
            };
            let sender = Sender {
                altitude_m: self.from.altitude(band, start),
                ..self.sender
            };
            let hop = Hop::new(
                mission,
                interferer,
                sender,
                index,
                altitude_m,
                band.span_m(),
            );
            if let Some(place) = hop.reach(sir, from_m)
                && farthest.is_none_or(|farthest| place > farthest)
            {
                farthest = Some(place);
                from = start;
            }
        }
        (farthest, from)
    }

    /// Whether all reaches are known.
    pub fn is_worked_out(&self) -> bool {
        self.next >= self.pairs()
    }

    /// The last relay's choice, which sends with `power_w` watts: the highest target that closes the chain, and the level at
    /// which it does so best. At most 64 roots.
    pub fn choose(&self, mission: &Mission, power_w: f32) -> Option<Choice> {
        let MissionBand { band, distance_m } = MissionBand::of(mission);
        let (mut best, mut most) = (None, f32::NEG_INFINITY);
        for target in (0..self.rungs.count).rev() {
            for level in 0..self.own.count() {
                let at = usize::from(target) * usize::from(self.own.count()) + usize::from(level);
                let profile = Profile {
                    altitude_m: self.own.altitude(band, level),
                    power_w,
                };
                let Some(slack) = self
                    .reaches
                    .get(at, distance_m)
                    .zip(receiver_reach(mission, profile, self.rungs.target(target)))
                    .map(|(place, last_hop)| place - distance_m + last_hop)
                else {
                    continue;
                };
                if slack >= 0.0 && slack > most {
                    most = slack;
                    best = Some(Choice { target, level });
                }
            }
            if best.is_some() {
                break;
            }
        }
        best
    }

    /// What the relay before has to choose for this one to have `choice`; `None` if the pass had no such reach.
    pub fn start_of(&self, choice: Choice) -> Option<Choice> {
        if choice.target >= self.rungs.count || choice.level >= self.own.count() {
            return None;
        }
        let at =
            usize::from(choice.target) * usize::from(self.own.count()) + usize::from(choice.level);
        self.reaches.get(at, 1.0)?;
        Some(Choice {
            target: choice.target,
            level: *self.starts.get(at)?,
        })
    }

    /// Where this relay stands for `choice`, m along x; `None` if the pass had no such reach.
    pub fn place(&self, mission: &Mission, choice: Choice) -> Option<f32> {
        let at =
            usize::from(choice.target) * usize::from(self.own.count()) + usize::from(choice.level);
        self.reaches.get(at, mission.config().distance_m)
    }

    /// The targets.
    pub const fn rungs(&self) -> Rungs {
        self.rungs
    }

    /// This relay's levels.
    pub const fn levels(&self) -> Levels {
        self.own
    }

    /// This relay's reaches, as they are sent.
    pub fn reaches(&self) -> &[u8] {
        self.reaches.bytes(usize::from(self.pairs()))
    }

    /// Whether this is the pass of `rungs`.
    pub fn is_of(&self, rungs: Rungs) -> bool {
        self.rungs == rungs
    }
}

/// The two numbers of a mission that every reach needs.
struct MissionBand {
    band: Band,
    distance_m: f32,
}

impl MissionBand {
    const fn of(mission: &Mission) -> Self {
        let config = mission.config();
        Self {
            band: config.band,
            distance_m: config.distance_m,
        }
    }
}
