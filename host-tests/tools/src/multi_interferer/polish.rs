//! Local search that improves any chain against the true sum, one relay at a time.
//!
//! Moving a relay changes two hops: the one that it receives and the one that it sends. The relay moves, between its neighbours,
//! to maximise the worse of the two; passes along the chain and back spread the gain. The search improves an approximate
//! placement but cannot move the chain to the other side of an interferer.

use super::optimum::golden;
use uav_relay_scenario::scene::{Corridor, Place, Relay, Scene, Sender};

const ROUNDS: u32 = 200;

/// Least relative gain for a round to count as progress.
const GAIN: f64 = 1e-6;

/// Rounds without progress before the search ends: a single one may only prepare the gain of the next.
const PATIENCE: u32 = 3;

/// Positions along x that are scanned before the best is refined.
const PLACES: u32 = 16;

/// Altitudes and lateral positions scanned in the first round. Later rounds search this fraction of the range on either side.
const LEVELS: u32 = 8;

/// Golden-section steps: the interval shrinks by about 1e-7.
const STEPS: u32 = 34;

/// Result of the local search.
#[derive(Debug, Clone, PartialEq)]
pub struct Polished {
    /// Positions from Tx to Rx.
    pub places: Vec<Place>,
    /// SIR (linear) of the worst hop, by [`Scene::hop_sirs`].
    pub sir: f64,
    /// Number of rounds, the last one included; each is a pass along the chain and one back.
    pub rounds: u32,
}

/// The move of one relay while its neighbours are fixed.
struct Turn<'a> {
    scene: &'a Scene,
    relay: &'a Relay,
    before: Sender,
    next: Option<Place>,
    /// Least distance from the previous relay, m; 0 from Tx.
    apart_before: f64,
}

/// Returns the chain reached from `start` by moving relays within `room`; never worse than `start`.
///
/// Order and least separation are kept if the start has them; a relay with a fixed altitude moves along x and sideways only. At
/// most 200 rounds, fewer when three in a row gain less than a millionth each. A round is 2 N moves, a move about 50 SIRs at one
/// altitude, 2 400 in a band and as many again with lateral room. `None` unless the start has one position per relay and at least
/// one relay.
pub fn polish(
    scene: &Scene,
    start: &[impl Copy + Into<Place>],
    room: Corridor,
) -> Option<Polished> {
    if start.is_empty() || start.len() != scene.relays.len() {
        return None;
    }
    let mut places: Vec<Place> = start.iter().map(|&place| place.into()).collect();
    let mut sir = scene.chain_sir(&places);
    let (mut rounds, mut idle) = (0, 0);
    while rounds < ROUNDS && idle < PATIENCE {
        let window = if rounds == 0 {
            1.0
        } else {
            1.0 / f64::from(LEVELS)
        };
        for at in (0..places.len()).chain((0..places.len()).rev()) {
            step(scene, &mut places, at, room, window);
        }
        rounds += 1;
        let now = scene.chain_sir(&places);
        idle = if now - sir > GAIN * sir { 0 } else { idle + 1 };
        sir = now;
    }
    Some(Polished {
        places,
        sir,
        rounds,
    })
}

/// Moves relay `at` (from 0) if a better position is found.
fn step(scene: &Scene, places: &mut [Place], at: usize, room: Corridor, window: f64) {
    let relays = &scene.relays;
    let (Some(&own), Some(relay)) = (places.get(at), relays.get(at)) else {
        return;
    };
    let behind = at.checked_sub(1);
    let behind = behind.and_then(|at| Some((*places.get(at)?, relays.get(at)?)));
    let turn = Turn {
        scene,
        relay,
        before: behind.map_or(scene.tx(), |(place, relay)| scene.sender(place, relay)),
        next: places.get(at + 1).copied(),
        apart_before: behind.map_or(0.0, |_| scene.min_separation_m),
    };
    let (better, sir) = turn.best(own, room, window);
    if sir > turn.sir(own)
        && let Some(place) = places.get_mut(at)
    {
        *place = better;
    }
}

impl Turn<'_> {
    fn sir(&self, place: Place) -> f64 {
        let heard = self.scene.sir_at(self.before, place);
        let fed = match self.next {
            Some(next) => {
                let sender = self.scene.sender(place, self.relay);
                self.scene.sir_at(sender, next)
            }
            None => self.scene.sir_at_rx(place, self.relay),
        };
        heard.min(fed)
    }

    /// Returns the best position found from `own`, first upward and then sideways, and its SIR. 0 if there is no room.
    fn best(&self, own: Place, room: Corridor, window: f64) -> (Place, f64) {
        let start = if self.relay.holds {
            own.h
        } else {
            own.h.clamp(room.least_m, room.most_m)
        };
        let mut best = self.best_at(own.y, start);
        if !self.relay.holds && room.least_m < room.most_m {
            let at = |h: f64| self.best_at(own.y, h);
            best = better(
                best,
                scanned(own.h, (room.least_m, room.most_m), window, at),
            );
        }
        if room.left_m < room.right_m {
            let h = best.0.h;
            let at = |y: f64| self.best_at(y, h);
            best = better(
                best,
                scanned(own.y, (room.left_m, room.right_m), window, at),
            );
        }
        best
    }

    /// Returns the best position found at altitude `h` and lateral position `y`, and its SIR.
    fn best_at(&self, y: f64, h: f64) -> (Place, f64) {
        let (low, high) = self.room(y, h);
        if !(low <= high) {
            return (Place { x: low, y, h }, 0.0);
        }
        let value = |x: f64| self.sir(Place { x, y, h });
        let place = |i: u32| (low + (high - low) * f64::from(i) / f64::from(PLACES)).min(high);
        let scanned = (0..=PLACES).map(|i| (i, value(place(i))));
        let top = scanned.max_by(|a, b| a.1.total_cmp(&b.1));
        let (top, of_top) = top.unwrap_or((0, 0.0));
        let (left, right) = (place(top.saturating_sub(1)), place((top + 1).min(PLACES)));
        let (x, refined) = golden(left, right, STEPS, value);
        if refined > of_top {
            (Place { x, y, h }, refined)
        } else {
            let x = place(top);
            (Place { x, y, h }, of_top)
        }
    }

    /// Returns the range along x open to the relay at altitude `h` and lateral position `y`, m. Reversed if there is no room.
    fn room(&self, y: f64, h: f64) -> (f64, f64) {
        let ahead = |apart: f64, other: Place| {
            let across = (y - other.y).powi(2) + (h - other.h).powi(2);
            (apart * apart - across).max(0.0).sqrt()
        };
        let low = self.before.at.x + ahead(self.apart_before, self.before.at);
        let high = match self.next {
            Some(next) => next.x - ahead(self.scene.min_separation_m, next),
            None => self.scene.distance_m,
        };
        (low, high)
    }
}

fn better(one: (Place, f64), other: (Place, f64)) -> (Place, f64) {
    if other.1 > one.1 { other } else { one }
}

/// Returns the best of `at` within a `window` of the range around `own`. A scan and a refinement of its maximum.
fn scanned(
    own: f64,
    (least, most): (f64, f64),
    window: f64,
    at: impl Fn(f64) -> (Place, f64),
) -> (Place, f64) {
    let reach = window * (most - least);
    let low = (own - reach).clamp(least, most);
    let high = (own + reach).clamp(least, most);
    let levels = if window < 1.0 { 2 } else { LEVELS };
    let level = |i: u32| (low + (high - low) * f64::from(i) / f64::from(levels)).min(high);
    let value = |level: f64| at(level).1;
    let scanned = (0..=levels).map(|i| (i, value(level(i))));
    let top = scanned.max_by(|a, b| a.1.total_cmp(&b.1));
    let (top, of_top) = top.unwrap_or((0, 0.0));
    let (left, right) = (level(top.saturating_sub(1)), level((top + 1).min(levels)));
    let (refined, of_refined) = golden(left, right, STEPS, value);
    at(if of_refined > of_top {
        refined
    } else {
        level(top)
    })
}
