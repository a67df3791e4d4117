//! The joint problem: positions in a corridor along Tx-Rx that maximise the worst hop's SIR.
//!
//! 0 <= `x_1` <= ... <= `x_N` <= D, every relay within one [`Corridor`] (except relays with a fixed cross-section position), and
//! neighbours at least the link's least separation apart. The problem is not concave: a chain may pass the interferer on either
//! side or above, between any two of its relays, and climb early or late. So [`optimum`] collects good chains by searches that
//! are global on a coarse scale (`levels`: exact for given cross-section positions), follows each to its local optimum (`polish`:
//! to about 1e-9), perturbs the best (`kicks`), and keeps the best of all. The global optimum is not proven; the tests show how
//! seldom two seeds disagree.
//!
//! The reported SIR is computed from received powers at the positions found: never more than can be flown.

mod corridor;
mod draws;
mod kicks;
mod levels;
mod limits;
mod polish;
mod roots;
mod scene;
mod space;
mod starts;
mod system;

use super::link::{Link, received_w};
pub use corridor::{Corridor, Hold, Place};
use scene::Scene;
use space::Triple;
pub use starts::Effort;

/// Best chain found.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOptimum {
    /// SIR (linear) of the worst hop, computed from `places`.
    pub sir: f64,
    /// Positions from Tx to Rx.
    pub places: Vec<Place>,
}

/// Returns the best chain of a link in a corridor; the altitudes in `link` are ignored.
///
/// `None` without relays, with an empty corridor, if no chain has a positive SIR, or if no chain was found that keeps the least
/// separation. Deterministic.
pub fn optimum(
    link: &Link,
    corridor: Corridor,
    held: &[Hold],
    effort: Effort,
) -> Option<JointOptimum> {
    let scene = Scene::new(link, corridor, held)?;
    let best = starts::search(&scene, effort)?;
    let places = (0..).zip(&best).map(|(relay, &place)| {
        let room = Hold::room(held, relay, corridor);
        in_metres(link, room, place)
    });
    let places: Vec<Place> = places.collect();
    let sir = sir(link, &places)?;
    (sir > 0.0 && keeps_rules(link, corridor, held, &places))
        .then_some(JointOptimum { sir, places })
}

/// Returns the best SIR (linear) of a link. Relays keep their altitudes above the line and the least separation.
///
/// Accurate to 1e-6 relative. `None` as for [`optimum`].
pub fn at_their_altitudes(link: &Link) -> Option<f64> {
    let heights = || link.relays.iter().map(|relay| relay.altitude_m);
    let corridor = Corridor::plane(heights().reduce(f64::min)?, heights().reduce(f64::max)?);
    let scene = Scene::new(link, corridor, &[])?;
    let slots: Vec<levels::Slot> = heights()
        .map(|height| levels::Slot {
            levels: vec![space::Across {
                y: 0.0,
                h: height / link.distance_m,
            }],
            window: (0.0, 1.0),
        })
        .collect();
    let best = levels::best_chain(&scene, &slots, -200.0, 1e-6)?;
    Some(scene.worst(&best).exp())
}

/// Returns the SIR (linear) of the worst hop. `None` without relays, or unless there is one position per relay.
pub fn sir(link: &Link, places: &[Place]) -> Option<f64> {
    let (tail, last) = (places.last()?, link.relays.last()?);
    if places.len() != link.len() {
        return None;
    }
    let first = (link.tx_w, link.eta, Place::in_plane(0.0, 0.0));
    let others = link.relays.iter().zip(places);
    let senders =
        std::iter::once(first).chain(others.map(|(relay, &at)| (relay.power_w, link.mu_los, at)));
    let hops = senders.zip(places).map(|((power_w, factor, from), to)| {
        let signal = received_w(
            power_w,
            factor,
            to.x_m - from.x_m,
            to.y_m - from.y_m,
            to.altitude_m - from.altitude_m,
        );
        let (dx, dy) = (to.x_m - link.x_i, to.y_m - link.y_i);
        signal / (received_w(link.interferer_w, link.eta, dx, dy, to.altitude_m) + link.noise_w)
    });
    let signal = received_w(
        last.power_w,
        link.eta,
        link.distance_m - tail.x_m,
        tail.y_m,
        tail.altitude_m,
    );
    let (dx, dy) = (link.distance_m - link.x_i, link.y_i);
    let rx = signal / (received_w(link.interferer_w, link.mu_nlos, dx, dy, 0.0) + link.noise_w);
    Some(hops.fold(rx, f64::min))
}

/// Returns true if a chain keeps order, corridor, fixed positions and least separation. The separation may be short by 1e-9 of
/// itself, for rounding.
pub fn keeps_rules(link: &Link, corridor: Corridor, held: &[Hold], places: &[Place]) -> bool {
    let mut each = (0..).zip(places);
    let within = each.all(|(relay, place)| {
        (0.0..=link.distance_m).contains(&place.x_m)
            && Hold::room(held, relay, corridor).contains(place, 0.0)
    });
    let mut neighbours = places.iter().zip(places.iter().skip(1));
    let least_m = link.min_separation_m * (1.0 - 1e-9);
    within && neighbours.all(|(a, b)| b.x_m >= a.x_m && a.distance_m(b) >= least_m)
}

fn in_metres(link: &Link, room: Corridor, place: Triple) -> Place {
    Place {
        x_m: (place.x * link.distance_m).clamp(0.0, link.distance_m),
        y_m: (place.y * link.distance_m).clamp(room.left_m, room.right_m),
        altitude_m: (place.h * link.distance_m).clamp(room.least_m, room.most_m),
    }
}
