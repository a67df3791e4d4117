//! Any chain made better against the true sum, by one relay after the other.
//!
//! A relay that moves changes two hops: the one it hears and the one it feeds. It moves to where the worse of these two is
//! best, between its neighbours; a pass there and one back let what one relay gains reach every hop. That is a local search: it
//! improves a chain that was placed by an approximation, and cannot leave the side of an interferer that the chain is on.

use super::altitude::golden;
use uav_relay_scenario::scene::Corridor;
use uav_relay_scenario::scene::{Place, Relay, Scene, Sender};

/// Rounds after which it ends.
const ROUNDS: u32 = 200;

/// A round gains something if it gains more than this (relative).
const GAIN: f64 = 1e-6;

/// Rounds in a row without a gain after which it ends: one alone may only prepare the gain of the next.
const PATIENCE: u32 = 3;

/// Places along x that are looked at before the best of them is refined.
const PLACES: u32 = 16;

/// Altitudes, and sides, that are looked at in the first round, and the part of the room on either hand in later ones.
const LEVELS: u32 = 8;

/// Golden-section steps: the interval shrinks by about 1e-7.
const STEPS: u32 = 34;

/// What came of polishing.
#[derive(Debug, Clone, PartialEq)]
pub struct Polished {
    /// Where each relay stands from Tx to Rx.
    pub places: Vec<Place>,
    /// SIR (linear) of the worst hop, by [`Scene::hop_sirs`] of these places.
    pub sir: f64,
    /// Rounds it took, the last one included; each is a pass there and one back.
    pub rounds: u32,
}

/// What one relay may do, its neighbours held still.
struct Turn<'a> {
    scene: &'a Scene,
    relay: &'a Relay,
    before: Sender,
    /// The next relay's place; `None` for the last one.
    next: Option<Place>,
    /// Least distance from the relay before, metres: 0 from Tx.
    apart_before: f64,
}

/// The chain that is reached from `start` by moving relays within `room`; never worse than `start`.
///
/// Relays keep their order and the least separation, as long as the start does; a relay that holds an altitude of its own
/// only moves along x, and to the side. At most 200 rounds, fewer when three in a row gain less than a millionth each: a round is
/// 2 N moves, a move about 50 SIRs at one altitude, 2 400 in a band and as many more with room to the side. `None` unless the
/// start has one place per relay and at least one relay.
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

/// Moves relay `at`, counted from 0, if a better place is found for it.
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
    /// The worse of the two hops with this relay at `place`.
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

    /// The best place that is found from `own` on, first upward and then to the side, and the SIR there: 0 where there is no
    /// room.
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

    /// The best place found at altitude `h`, `y` to the side.
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

    /// From where to where the relay may move along x at altitude `h`, `y` to the side, metres; the wrong way round where there
    /// is no room.
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

/// The best of `at`, seen from `own`, over a `window` of the range from `least` to `most`: a scan and a refinement of its top.
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
