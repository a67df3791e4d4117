//! The joint problem: relays choose their altitudes as well as their places, to make the worst hop's SIR as large as can be.
//!
//! 0 <= `x_1` <= ... <= `x_N` <= D, every altitude within one [`Band`], neighbouring relays at least the link's least separation
//! apart. The problem is not concave: a chain may leave the interferer between any two of its relays, climb early or late. So
//! [`optimum`] collects fair chains by searches that are global on a coarse scale (`levels`: exact for given levels), follows
//! each to its local optimum (`polish`: to about 1e-9), and keeps the best. Nothing proves that it is the global optimum; the
//! tests show how seldom two seeds disagree.
//!
//! What is reported is the SIR of the places themselves, as [`Link::sir_hops`] computes it: never more than can be flown.

mod levels;
mod plane;
mod polish;
mod scene;
mod starts;

use super::{Link, Station};
use plane::Pair;
use scene::Scene;

/// The altitudes that relays may fly at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Lowest altitude above the ground of Tx, Rx and the interferer, metres, > 0.
    pub least_m: f64,
    /// Highest altitude, metres, >= `least_m`.
    pub most_m: f64,
}

/// Where one relay flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Coordinate along Tx-Rx, metres, in [0, D].
    pub x_m: f64,
    /// Altitude, metres, within the band.
    pub altitude_m: f64,
}

/// How hard to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Seed of all that is drawn: the same seed gives the same optimum.
    pub seed: u64,
    /// Searches over levels drawn anew, >= 1; the time is about proportional.
    pub rounds: u32,
}

impl Effort {
    /// Five rounds: some milliseconds with few relays, about a second with 50 (release build).
    pub fn usual(seed: u64) -> Self {
        Self { seed, rounds: 5 }
    }
}

/// The best chain that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOptimum {
    /// SIR (linear) of its worst hop, computed from `places`.
    pub sir: f64,
    /// Its relays from Tx to Rx.
    pub places: Vec<Place>,
}

/// The best chain of a link whose relays may fly at any altitude of the band; the altitudes in `link` are not looked at.
///
/// `None` without relays, with an empty band, where no chain has a positive SIR, or where no chain was found that keeps the
/// least separation. Deterministic.
pub fn optimum(link: &Link, band: Band, effort: Effort) -> Option<JointOptimum> {
    let scene = Scene::new(link, band)?;
    let best = starts::search(&scene, effort)?;
    let places = best.iter().map(|&place| in_metres(link, band, place));
    let places: Vec<Place> = places.collect();
    let sir = sir(link, &places)?;
    (sir > 0.0 && keeps_rules(link, band, &places)).then_some(JointOptimum { sir, places })
}

/// The best SIR (linear) of a link whose relays hold the altitudes they have, with its least separation; to 1e-6 relative.
///
/// `None` as for [`optimum`].
pub fn at_their_altitudes(link: &Link) -> Option<f64> {
    let heights = || link.relays.iter().map(|relay| relay.altitude_m);
    let band = Band {
        least_m: heights().reduce(f64::min)?,
        most_m: heights().reduce(f64::max)?,
    };
    let scene = Scene::new(link, band)?;
    let slots: Vec<levels::Slot> = heights()
        .map(|height| levels::Slot {
            levels: vec![height / link.distance_m],
            window: (0.0, 1.0),
        })
        .collect();
    let best = levels::best_chain(&scene, &slots, -200.0, 1e-6)?;
    Some(scene.worst(&best).exp())
}

/// The SIR (linear) of the worst hop of a chain; `None` unless there is one place per relay.
pub fn sir(link: &Link, places: &[Place]) -> Option<f64> {
    let flown = Link {
        relays: link
            .relays
            .iter()
            .zip(places)
            .map(|(relay, place)| Station {
                altitude_m: place.altitude_m,
                ..*relay
            })
            .collect(),
        ..link.clone()
    };
    let x: Vec<f64> = places.iter().map(|place| place.x_m).collect();
    flown.sir_hops(&x).into_iter().reduce(f64::min)
}

/// Whether a chain keeps order, band and least separation (but for 1e-9 of it, for rounding).
pub fn keeps_rules(link: &Link, band: Band, places: &[Place]) -> bool {
    let within = places.iter().all(|place| {
        (0.0..=link.distance_m).contains(&place.x_m)
            && (band.least_m..=band.most_m).contains(&place.altitude_m)
    });
    let neighbours = places.iter().zip(places.iter().skip(1));
    within
        && neighbours
            .map(|(a, b)| (b.x_m - a.x_m, b.altitude_m - a.altitude_m))
            .all(|(dx, dh)| dx >= 0.0 && dx.hypot(dh) >= link.min_separation_m * (1.0 - 1e-9))
}

fn in_metres(link: &Link, band: Band, place: Pair) -> Place {
    Place {
        x_m: (place.x * link.distance_m).clamp(0.0, link.distance_m),
        altitude_m: (place.h * link.distance_m).clamp(band.least_m, band.most_m),
    }
}
