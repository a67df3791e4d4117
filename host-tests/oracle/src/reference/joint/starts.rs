//! Multi-start search. Chains from searches over levels, bends and perturbations are each locally optimised.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::draws::{Side, bow, levels};
use super::kicks::kicked;
use super::levels::{Slot, at_places, best_chain, in_room, least_advance};
use super::polish::polish;
use super::scene::{Room, Scene};
use super::space::{Across, Triple};
use crate::random::log_uniform;

/// Search effort.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Seed of all random numbers: the same seed gives the same optimum.
    pub seed: u64,
    /// Rounds over newly drawn levels, >= 1; the time is about proportional.
    pub rounds: u32,
}

impl Effort {
    /// Returns two rounds: some milliseconds with few relays, about half a second with 50 (release build).
    pub fn usual(seed: u64) -> Self {
        Self { seed, rounds: 2 }
    }
}

/// ln SIR below which no chain is searched.
const LEAST: f64 = -200.0;

/// Accuracy of a search over levels, in ln SIR: its chain is polished afterwards.
const COARSE: f64 = 2e-3;

/// Accuracy of a search without later polishing.
const FINE: f64 = 1e-12;

/// Least improvement on the best chain, in ln SIR, for which polishing continues.
const WORTH: f64 = 1e-8;

/// Initial slack of a polishing that may move far from its chain, in ln SIR.
const FAR: f64 = 1.0;
/// Initial slack of a polishing that stays near its chain, in ln SIR.
const NEAR: f64 = 0.03;

const ANYWHERE: (f64, f64) = (0.0, 1.0);

/// Columns and rows of the grid of lateral positions and altitudes, by round.
const GRIDS: [(u32, u32); 4] = [(5, 4), (4, 6), (7, 4), (6, 5)];

/// Number of bent chains per round.
const BOWS: u32 = 8;
/// Number of random chains per round.
const SCATTERED: u32 = 2;
/// Number of perturbations of the best chain per round.
const KICKS: u32 = 10;

pub(super) fn search(scene: &Scene, effort: Effort) -> Option<Vec<Triple>> {
    if scene.rooms.iter().all(Room::is_point) {
        let any = vec![Across::default(); scene.len()];
        return best_chain(scene, &at_places(scene, &any), LEAST, FINE);
    }
    let mut search = Search {
        scene,
        roomy: Scene {
            apart: 1.02 * scene.apart,
            ..scene.clone()
        },
        best: None,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(effort.seed);
    search.one_level();
    for (round, (columns, rows)) in (0..effort.rounds).zip(GRIDS.into_iter().cycle()) {
        let side = match round % 4 {
            1 => Side::Left,
            3 => Side::Right,
            _ => Side::Any,
        };
        let part = side.part(scene).unwrap_or(scene.corridor);
        let drawn = levels(&part, &mut rng, columns, rows);
        search.on_levels(&drawn, None, 1.0);
        search.bowed(&mut rng);
        for _ in 0..SCATTERED {
            search.scattered(&mut rng);
        }
        for _ in 0..KICKS {
            search.kicked(&mut rng);
        }
    }
    let drawn = levels(&scene.corridor, &mut rng, 4, 3);
    search.other_splits(&drawn);
    search.around();
    search.best.map(|(_, chain)| chain)
}

struct Search<'a> {
    scene: &'a Scene,
    /// Scene with a slightly larger least separation, so that its chains can be moved a little.
    roomy: Scene,
    best: Option<(f64, Vec<Triple>)>,
}

impl Search<'_> {
    /// Tries chains at one common lateral position and altitude.
    ///
    /// Several lateral positions are tried, each at the best of a few altitudes.
    fn one_level(&mut self) {
        for side in [Side::Any, Side::Left, Side::Right] {
            let Some(room) = side.part(self.scene) else {
                continue;
            };
            let columns = if room.free().y > 0.0 { 5 } else { 1 };
            for column in 0..columns {
                let foot = room.within(f64::from(column) / 4.0, 0.0);
                if let Some(chain) = self.best_altitude(foot.y, &room) {
                    self.consider(&chain, NEAR);
                }
            }
        }
    }

    /// Returns the best of the chains at lateral position `y` and one of several altitudes in `room`.
    fn best_altitude(&self, y: f64, room: &Room) -> Option<Vec<Triple>> {
        let mut best: Option<(f64, Vec<Triple>)> = None;
        for row in 0..8 {
            let h = room.low.h * (room.high.h / room.low.h).powf(f64::from(row) / 7.0);
            let level = room.nearest(Across::new(y, h), 0.0);
            let slots = at_places(self.scene, &vec![level; self.scene.len()]);
            let floor = best.as_ref().map_or(LEAST, |(sir, _)| *sir);
            if let Some(chain) = best_chain(&self.roomy, &slots, floor, COARSE) {
                best = Some((self.scene.worst(&chain), chain));
            }
        }
        best.map(|(_, chain)| chain)
    }

    /// Tries the best chain on some levels. With `split`, the first `count` relays are before the interferer.
    fn on_levels(&mut self, levels: &[Across], split: Option<usize>, below: f64) {
        let x_i = self.scene.interferer.x;
        let window = |k: usize| match split {
            Some(count) if k + 1 == count => (0.0, x_i),
            Some(count) if k == count => (x_i, 1.0),
            _ => ANYWHERE,
        };
        let rooms = self.scene.rooms.iter().enumerate();
        let slots: Vec<Slot> = rooms
            .map(|(k, room)| Slot {
                levels: in_room(room, levels),
                window: window(k),
            })
            .collect();
        let floor = self.sir() - below;
        if let Some(chain) = best_chain(&self.roomy, &slots, floor, COARSE) {
            self.consider(&chain, NEAR);
        }
    }

    /// Tries chains that pass the interferer a few relays earlier or later than the best one.
    fn other_splits(&mut self, levels: &[Across]) {
        let x_i = self.scene.interferer.x;
        if !(0.0..=1.0).contains(&x_i) {
            return;
        }
        let passed = |chain: &Vec<Triple>| chain.iter().filter(|place| place.x < x_i).count();
        let Some(now) = self.best.as_ref().map(|(_, chain)| passed(chain)) else {
            return;
        };
        for split in now.saturating_sub(2)..=(now + 2).min(self.scene.len()) {
            if split != now {
                self.on_levels(levels, Some(split), 0.3);
            }
        }
    }

    /// Tries chains near the best one, on a grid around each relay's position.
    fn around(&mut self) {
        for share in [0.08, 0.02] {
            let Some((sir, chain)) = &self.best else {
                return;
            };
            let width = self.scene.corridor.width();
            let near = |place: &Triple| -> Vec<Across> {
                let steps = (-2..=2).flat_map(|i| (-2..=2).map(move |j| (i, j)));
                steps
                    .map(|(i, j)| {
                        let (i, j) = (share * f64::from(i), share * f64::from(j));
                        Across::new(place.y + i * width.y, place.h + j * width.h)
                    })
                    .collect()
            };
            let slots: Vec<Slot> = (chain.iter().zip(&self.scene.rooms))
                .map(|(place, room)| Slot {
                    levels: in_room(room, &near(place)),
                    window: ANYWHERE,
                })
                .collect();
            if let Some(chain) = best_chain(&self.roomy, &slots, sir - 0.1, COARSE) {
                self.consider(&chain, NEAR);
            }
        }
    }

    fn bowed(&mut self, rng: &mut ChaCha8Rng) {
        for _ in 0..BOWS {
            let bow = bow(&self.scene.corridor, rng, self.scene.len());
            let slots = at_places(self.scene, &bow);
            if let Some(chain) = best_chain(&self.roomy, &slots, self.sir() - 1.0, COARSE) {
                self.consider(&chain, NEAR);
            }
        }
    }

    fn scattered(&mut self, rng: &mut ChaCha8Rng) {
        let mut along: Vec<f64> = (0..self.scene.len()).map(|_| rng.random()).collect();
        along.sort_unstable_by(f64::total_cmp);
        let chain = along
            .into_iter()
            .map(|x| Triple::at(x, self.scene.corridor.within(rng.random(), rng.random())));
        let chain = chain.collect();
        self.consider_apart(chain, FAR);
    }

    fn kicked(&mut self, rng: &mut ChaCha8Rng) {
        if let Some((_, chain)) = &self.best {
            let chain = kicked(self.scene, chain, rng);
            self.consider_apart(chain, log_uniform(rng, NEAR, FAR));
        }
    }

    /// Considers a chain after restoring rooms, order and separation.
    fn consider_apart(&mut self, mut chain: Vec<Triple>, slack: f64) {
        let mut before: Option<Triple> = None;
        for (place, room) in chain.iter_mut().zip(&self.scene.rooms) {
            let across = room.nearest(place.across(), 0.0);
            *place = Triple::at(place.x.clamp(0.0, 1.0), across);
            if let Some(before) = before {
                let advance = least_advance(&self.roomy, across.apart_2(before.across()));
                place.x = place.x.max(before.x + advance);
            }
            before = Some(*place);
        }
        let mut next: Option<Triple> = None;
        for place in chain.iter_mut().rev() {
            let limit = next.map_or(1.0, |next| {
                next.x - least_advance(&self.roomy, place.across().apart_2(next.across()))
            });
            place.x = place.x.min(limit);
            next = Some(*place);
        }
        if next.is_some_and(|first| first.x >= 0.0) {
            self.consider(&chain, slack);
        }
    }

    /// Keeps a chain, or the local optimum reached from it, if it is the best so far.
    fn consider(&mut self, chain: &[Triple], slack: f64) {
        let hope = self.sir() + WORTH;
        let polished = [1e-3, 1e-5, 1e-2]
            .iter()
            .map(|&share| self.inward(chain, share))
            .find(|start| self.is_fair(start))
            .and_then(|start| polish(self.scene, &start, slack, hope));
        for chain in polished.into_iter().chain([chain.to_vec()]) {
            let sir = self.scene.worst(&chain);
            if sir > self.sir() {
                self.best = Some((sir, chain));
            }
        }
    }

    /// Moves the chain by `share` toward evenly spread positions within the rooms. The result is off every active constraint.
    fn inward(&self, chain: &[Triple], share: f64) -> Vec<Triple> {
        let gap = 1.0 / (self.scene.len() as f64 + 1.0);
        let mut even = 0.0;
        let moved = chain.iter().zip(&self.scene.rooms).map(|(place, room)| {
            even += gap;
            let x = (1.0 - share) * place.x + share * even;
            Triple::at(x, room.nearest(place.across(), share))
        });
        moved.collect()
    }

    /// Returns true if neighbours are in order and more than the least separation apart.
    fn is_fair(&self, chain: &[Triple]) -> bool {
        let apart_2 = self.scene.apart * self.scene.apart;
        let neighbours = chain.iter().zip(chain.iter().skip(1));
        let mut steps = neighbours.map(|(a, b)| *b - *a);
        steps.all(|step| step.x > 0.0 && step.dot(step) > apart_2)
    }

    fn sir(&self) -> f64 {
        self.best.as_ref().map_or(LEAST, |(sir, _)| *sir)
    }
}
