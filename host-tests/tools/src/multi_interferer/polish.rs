//! Local search that improves any chain against the true sum, one relay at a time.
//!
//! Moving a relay changes two hops: the one that it receives, and the one that it sends. Each relay moves between its
//! neighbours so that the worse of its two hops is best. This is repeated along the chain and back. The search improves
//! a placement, but cannot move the chain to the other side of an interferer.

use super::optimum::golden;
use uav_relay_scenario::scene::{Corridor, Place, Relay, Scene, Sender};

const ROUNDS: u32 = 200;

/// Smallest relative gain in SIR for which a round counts as progress.
const GAIN: f64 = 1e-6;

/// Number of consecutive rounds without progress after which the search ends.
///
/// It is above 1, because a round without progress may make progress possible in the next round.
const PATIENCE: u32 = 3;

/// Number of equal steps along x in the first scan for a relay's best position.
const PLACES: u32 = 16;

/// Number of equal steps in the first round's scan of altitudes, and of lateral positions.
///
/// Later rounds search only the length of one of these steps below and above the present value.
const LEVELS: u32 = 8;

/// Number of golden-section steps that refine a maximum. They reduce the interval to 1e-7 of its length.
const STEPS: u32 = 34;

/// Result of the local search: the improved chain and its SIR.
#[derive(Debug, Clone, PartialEq)]
pub struct Polished {
    /// Positions of the relays from Tx to Rx.
    pub places: Vec<Place>,
    /// SIR of the worst hop, linear, by [`Scene::hop_sirs`].
    pub sir: f64,
    /// Number of rounds. In a round each relay is moved twice: from relay 1 to the last, and back.
    pub rounds: u32,
}

/// Search for the best position of one relay, while its two neighbours keep their positions.
struct Turn<'a> {
    scene: &'a Scene,
    relay: &'a Relay,
    before: Sender,
    next: Option<Place>,
    /// Minimum distance from the previous relay, m; 0 if the relay receives from Tx.
    apart_before: f64,
}

/// Improves the chain `start` by moving one relay at a time within the limits `room`.
///
/// The result is never worse than `start`. The result keeps order and minimum separation if `start` does. A relay with
/// a fixed altitude moves only along x and y. `None` unless `start` has one position per relay and at least one relay.
///
/// The search ends after 200 rounds, or after three rounds in a row that each gain less than a millionth. A round is 2
/// N moves. A move computes about 50 SIRs at one altitude, and 2 400 in a range of altitudes. Free lateral positions
/// take 2 400 more.
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

/// Moves relay `at` (from 0) if that raises the SIR of the worse of its two hops.
///
/// Altitude and lateral position are searched above and below the present values. Both change by at most the fraction
/// `window` of the permitted ranges `room`.
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

    /// Returns the best position found for the relay, and the SIR of its worse hop.
    ///
    /// The search starts from the position `own`. It first changes the altitude, and then the lateral position. The SIR
    /// is 0 if no position is allowed.
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

    /// Returns the relay's best x at altitude `h` and lateral position `y`, and the SIR of its worse hop.
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

    /// Returns the smallest and largest x of the relay, m, at altitude `h` and lateral position `y`.
    ///
    /// The relay stays between its two neighbours, at the minimum separation from each. The first result is above the
    /// second if no x is allowed.
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

/// Searches the altitude or lateral position near `own` at which a relay has the best SIR.
///
/// `at` returns the relay's best position and its SIR for a given altitude or lateral position. The search covers an
/// interval above `own` and an equal interval below: each has the length `window` times (`most` - `least`).
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
