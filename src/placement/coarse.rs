//! The leader's prediction for the whole band: the highest target that a chain of equals meets on evenly spread levels.
//!
//! It walks the chain with the very passes that the relays exchange, and keeps no more of it than the relay it is at.
//! First from the highest target that either end of the chain can have downward: what a chain meets that stops short of the
//! interferer may lie far above the targets that no chain past it meets. Then with more levels, upward from what was met:
//! which number of levels happens to suit a chain cannot be foreseen, and the best start is worth more than a fine one.

use core::task::Poll;

use super::levels::Levels;
use super::wave::{Rungs, Wave};
use crate::mission::{Interferer, Mission, Profile};
use crate::sir::{self, square};

/// Numbers of levels that are tried, one after the other.
const SETS: [u8; 5] = [16, 32, 40, 52, 64];

/// How close to the best target of a set is close enough, relative.
const CLOSE: f32 = 1e-2;

/// From one target to the next on the way down.
const DESCENT: f32 = 0.85;

/// A prediction being worked out.
#[derive(Clone, Debug)]
pub struct Coarse {
    /// Which of [`SETS`].
    set: u8,
    /// The relay that is next.
    index: u16,
    /// What is being tried.
    target: f32,
    /// What the chain meets as it stands: nothing below it is of use.
    floor: f32,
    /// The highest target met on these levels, the lowest not met above it.
    low: Option<f32>,
    high: Option<f32>,
    /// How far above the last one met the next one is, as long as all are met.
    growth: f32,
    /// The best so far, and on how many levels.
    best: Option<(f32, u8)>,
}

impl Coarse {
    /// Begins in `wave`; `target` is what the chain meets as it stands.
    pub fn new(mission: &Mission, target: f32, wave: &mut Wave) -> Self {
        let config = mission.config();
        let least_m = config.band.least_m;
        let last_hop = mission.receiver_gain(config.common.power_w) / square(least_m);
        let coarse = Self {
            set: 0,
            index: 1,
            target: sir::first_hop_ceiling(mission, least_m)
                .min(last_hop)
                .max(target),
            floor: target,
            low: None,
            high: None,
            growth: 0.1,
            best: None,
        };
        coarse.set_out(mission, wave);
        coarse
    }

    fn levels(&self) -> u8 {
        SETS.get(usize::from(self.set)).copied().unwrap_or(2)
    }

    fn set_out(&self, mission: &Mission, wave: &mut Wave) {
        wave.begin(
            mission,
            Rungs::new(self.target, 0.0, 1),
            Levels::even(mission.config().band, self.levels()),
        );
    }

    /// Goes on for at most `budget` + 64 evaluations of a hop; ready when it is known: a target and its number of levels,
    /// or that no target above the one it began with is met on any.
    ///
    /// `leader` is what relay 1 holds, the others what the mission has in common; of both only the power counts.
    pub fn step(
        &mut self,
        mission: &Mission,
        interferer: &Interferer,
        leader: Profile,
        wave: &mut Wave,
        budget: u16,
    ) -> Poll<Option<(f32, u8)>> {
        if !wave.step(mission, interferer, self.index, budget) {
            return Poll::Pending;
        }
        let common = mission.config().common;
        let power_w = if self.index == 1 { leader } else { common }.power_w;
        if self.index < mission.relays() {
            wave.hand_over(mission, power_w);
            self.index += 1;
            return Poll::Pending;
        }
        let met = wave.choose(mission, power_w).is_some();
        if !self.next_target(met) {
            return Poll::Ready(self.best);
        }
        self.index = 1;
        self.set_out(mission, wave);
        Poll::Pending
    }

    /// What to try after `target` has been `met` or not; whether there is anything left.
    fn next_target(&mut self, met: bool) -> bool {
        if met {
            self.low = Some(self.target);
            self.best = Some((self.target, self.levels()));
        } else {
            self.high = Some(self.target);
        }
        self.target = match (self.low, self.high) {
            (None, Some(high)) if self.set == 0 && high * DESCENT > self.floor => high * DESCENT,
            // Nothing is met that would beat what there is.
            (None, _) => return self.next_set(),
            (Some(low), Some(high)) if high <= low * (1.0 + CLOSE) => return self.next_set(),
            (Some(low), Some(high)) => 0.5 * (low + high),
            (Some(low), None) => {
                let target = low + low * self.growth;
                self.growth *= 3.0;
                target
            }
        };
        true
    }

    fn next_set(&mut self) -> bool {
        self.set += 1;
        if usize::from(self.set) >= SETS.len() {
            return false;
        }
        self.target = self
            .best
            .map_or(self.floor, |(best, _)| best + best * CLOSE);
        self.low = None;
        self.high = None;
        self.growth = 4.0 * CLOSE;
        true
    }
}
