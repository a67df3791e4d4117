//! Where to look: chains to polish, from searches over levels.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Effort;
use super::levels::{Slot, best_chain, least_advance};
use super::plane::Pair;
use super::polish::polish;
use super::scene::Scene;
use crate::random::log_uniform;

/// ln SIR below which no chain is looked for.
const LEAST: f64 = -200.0;

/// Accuracy of a search over levels, in ln SIR: its chain is polished afterwards.
const COARSE: f64 = 2e-3;

/// Accuracy of a search at one altitude.
const FINE: f64 = 1e-12;

/// Every place along Tx-Rx.
const ANYWHERE: (f64, f64) = (0.0, 1.0);

/// Random chains and random moves of the best chain that are tried in each round.
const DRAWS: u32 = 4;

/// The best chain of all starts.
pub(super) fn search(scene: &Scene, effort: Effort) -> Option<Vec<Pair>> {
    let mut search = Search {
        scene,
        roomy: Scene {
            apart: 1.02 * scene.apart,
            ..scene.clone()
        },
        best: None,
    };
    if scene.high <= scene.low * (1.0 + 1e-9) {
        return common_altitude(scene, scene.low, FINE);
    }
    search.one_level();
    let mut rng = ChaCha8Rng::seed_from_u64(effort.seed);
    for round in 0..effort.rounds {
        let count = 8 + 3 * (round % 4);
        let levels = draw_levels(scene, &mut rng, count);
        search.on_levels(&levels, None, 1.0);
        for _ in 0..DRAWS {
            search.scattered(&mut rng);
            search.kicked(&mut rng);
        }
    }
    let levels = draw_levels(scene, &mut rng, 8);
    search.other_splits(&levels);
    search.around();
    search.best.map(|(_, chain)| chain)
}

/// The starts of one scene and the best chain so far.
struct Search<'a> {
    scene: &'a Scene,
    /// The same with a somewhat larger least separation, so that what is found can be moved a little.
    roomy: Scene,
    /// ln SIR and chain.
    best: Option<(f64, Vec<Pair>)>,
}

impl Search<'_> {
    /// Chains at one common altitude, for a few altitudes.
    fn one_level(&mut self) {
        let altitudes = spread(self.scene.low, self.scene.high, 12);
        for level in altitudes {
            if let Some(chain) = common_altitude(&self.roomy, level, FINE) {
                self.consider(chain);
            }
        }
    }

    /// The best chain on some levels, with the relays' windows split at the interferer: the first `count` relays before it,
    /// or anywhere if `split` is `None`.
    fn on_levels(&mut self, levels: &[f64], split: Option<usize>, below: f64) {
        let x_i = self.scene.interferer.x;
        let window = |k: usize| match split {
            Some(count) if k + 1 == count => (0.0, x_i),
            Some(count) if k == count => (x_i, 1.0),
            _ => ANYWHERE,
        };
        let slots: Vec<Slot> = (0..self.scene.len())
            .map(|k| Slot {
                levels: levels.to_vec(),
                window: window(k),
            })
            .collect();
        let floor = self.sir() - below;
        if let Some(chain) = best_chain(&self.roomy, &slots, floor, COARSE) {
            self.consider(chain);
        }
    }

    /// Chains that pass the interferer a few relays earlier or later than the best one.
    fn other_splits(&mut self, levels: &[f64]) {
        let x_i = self.scene.interferer.x;
        if !(0.0..=1.0).contains(&x_i) {
            return;
        }
        let passed = |chain: &Vec<Pair>| chain.iter().filter(|place| place.x < x_i).count();
        let Some(now) = self.best.as_ref().map(|(_, chain)| passed(chain)) else {
            return;
        };
        for split in now.saturating_sub(2)..=(now + 2).min(self.scene.len()) {
            if split != now {
                self.on_levels(levels, Some(split), 0.3);
            }
        }
    }

    /// Chains near the best one, at seven altitudes of each relay's own.
    fn around(&mut self) {
        for share in [0.08, 0.02] {
            let Some((sir, chain)) = &self.best else {
                return;
            };
            let stride = share * (self.scene.high - self.scene.low);
            let slots: Vec<Slot> = chain
                .iter()
                .map(|place| Slot {
                    levels: (-3..=3)
                        .map(|i| place.h + f64::from(i) * stride)
                        .filter(|h| (self.scene.low..=self.scene.high).contains(h))
                        .collect(),
                    window: ANYWHERE,
                })
                .collect();
            if let Some(chain) = best_chain(&self.roomy, &slots, sir - 0.1, COARSE) {
                self.consider(chain);
            }
        }
    }

    /// A chain of places drawn at random, put in order.
    fn scattered(&mut self, rng: &mut ChaCha8Rng) {
        let mut along: Vec<f64> = (0..self.scene.len()).map(|_| rng.random()).collect();
        along.sort_unstable_by(f64::total_cmp);
        let chain = along
            .into_iter()
            .map(|x| Pair::new(x, rng.random_range(self.scene.low..=self.scene.high)));
        let chain = chain.collect();
        self.consider_apart(chain);
    }

    /// The best chain with some of its relays, all in a row, moved at random.
    fn kicked(&mut self, rng: &mut ChaCha8Rng) {
        let Some((_, chain)) = &self.best else {
            return;
        };
        let mut chain = chain.clone();
        let (first, last) = (
            rng.random_range(0..chain.len()),
            rng.random_range(0..chain.len()),
        );
        let (low, high) = (self.scene.low, self.scene.high);
        let size = log_uniform(rng, 0.01, 1.0);
        let gap = 1.0 / (chain.len() as f64 + 1.0);
        let row = chain.iter_mut().enumerate();
        for (_, place) in row.filter(|(k, _)| (first.min(last)..=first.max(last)).contains(k)) {
            let x = place.x + size * gap * rng.random_range(-1.0..=1.0);
            let h = place.h + size * (high - low) * rng.random_range(-1.0..=1.0);
            *place = Pair::new(x.clamp(0.0, 1.0), h.clamp(low, high));
        }
        self.consider_apart(chain);
    }

    /// Considers a chain after moving its relays along until they are in order and apart.
    fn consider_apart(&mut self, mut chain: Vec<Pair>) {
        let mut before: Option<Pair> = None;
        for place in &mut chain {
            if let Some(before) = before {
                let advance = least_advance(&self.roomy, place.h - before.h);
                place.x = place.x.max(before.x + advance);
            }
            before = Some(*place);
        }
        let mut next: Option<Pair> = None;
        for place in chain.iter_mut().rev() {
            let limit = next.map_or(1.0, |next| {
                next.x - least_advance(&self.roomy, place.h - next.h)
            });
            place.x = place.x.min(limit);
            next = Some(*place);
        }
        if next.is_some_and(|first| first.x >= 0.0) {
            self.consider(chain);
        }
    }

    /// Keeps a chain, or the local optimum near it, if that is the best so far.
    fn consider(&mut self, chain: Vec<Pair>) {
        let polished = [1e-3, 1e-5, 1e-2]
            .iter()
            .find_map(|&share| polish(self.scene, &self.inward(&chain, share), 0.03));
        for chain in polished.into_iter().chain([chain]) {
            let sir = self.scene.worst(&chain);
            if sir > self.sir() {
                self.best = Some((sir, chain));
            }
        }
    }

    /// The chain moved by `share` toward evenly spread places within the band, off every limit it touches.
    fn inward(&self, chain: &[Pair], share: f64) -> Vec<Pair> {
        let (low, high) = (self.scene.low, self.scene.high);
        let room = share * (high - low);
        let gaps = self.scene.len() as f64 + 1.0;
        let moved = (1..).zip(chain).map(|(k, place)| {
            let even = f64::from(k) / gaps;
            Pair::new(
                (1.0 - share) * place.x + share * even,
                place.h.clamp(low + room, high - room),
            )
        });
        moved.collect()
    }

    /// ln SIR of the best chain so far.
    fn sir(&self) -> f64 {
        self.best.as_ref().map_or(LEAST, |(sir, _)| *sir)
    }
}

/// The best chain at one altitude, to `tolerance` in ln SIR.
fn common_altitude(scene: &Scene, level: f64, tolerance: f64) -> Option<Vec<Pair>> {
    let slot = Slot {
        levels: vec![level],
        window: ANYWHERE,
    };
    let slots = vec![slot; scene.len()];
    best_chain(scene, &slots, LEAST, tolerance)
}

/// `count` levels over the band with some jitter, its ends included: evenly or closer at the bottom.
fn draw_levels(scene: &Scene, rng: &mut ChaCha8Rng, count: u32) -> Vec<f64> {
    let power = rng.random_range(1.0..=2.0);
    let shares = (0..count).map(|i| {
        let jitter = if i == 0 || i + 1 == count {
            0.0
        } else {
            rng.random_range(-0.3..=0.3)
        };
        ((f64::from(i) + jitter) / f64::from(count - 1)).powf(power)
    });
    shares
        .map(|share| scene.low + share * (scene.high - scene.low))
        .collect()
}

/// `count` numbers from `low` to `high`, ends included, evenly spaced in their logarithms.
fn spread(low: f64, high: f64, count: u32) -> Vec<f64> {
    (0..count)
        .map(|i| low * (high / low).powf(f64::from(i) / f64::from(count - 1)))
        .map(|level| level.clamp(low, high))
        .collect()
}
