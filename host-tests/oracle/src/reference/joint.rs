//! The joint problem: positions in a corridor along Tx-Rx that maximise the worst hop's SIR.
//!
//! 0 <= `x_1` <= ... <= `x_N` <= D, every relay within one [`Corridor`] (except relays with a fixed cross-section
//! position), and neighbours at least the link's minimum separation apart. This module evaluates and checks chains.
//! Optima are in [`crate::recorded`].
//!
//! The SIR is computed from the received powers at the positions, so it is never higher than in flight.

use super::link::{Link, received_w};

/// Limits of the relays' altitudes and lateral positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Lowest altitude of a relay, m, > 0. Altitudes count from the ground; Tx, Rx and interferer are there.
    pub least_m: f64,
    /// Highest altitude of a relay, m, >= `least_m`.
    pub most_m: f64,
    /// Smallest lateral position y of a relay, m; seldom above 0.
    pub left_m: f64,
    /// Largest lateral position y of a relay, m, >= `left_m`.
    pub right_m: f64,
}

impl Corridor {
    /// Creates a corridor without width: altitudes from `least_m` to `most_m`, and lateral position 0.
    pub const fn plane(least_m: f64, most_m: f64) -> Self {
        Self {
            least_m,
            most_m,
            left_m: 0.0,
            right_m: 0.0,
        }
    }

    /// Returns true if `place` is inside the corridor, or outside by at most `slack_m`.
    pub fn contains(&self, place: &Place, slack_m: f64) -> bool {
        let within =
            |low: f64, value: f64, high: f64| (low - slack_m..=high + slack_m).contains(&value);
        within(self.least_m, place.altitude_m, self.most_m)
            && within(self.left_m, place.y_m, self.right_m)
    }
}

/// Relay with a fixed lateral position and altitude, inside or outside of the corridor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedCrossSection {
    /// Index of the relay in the link, from 0.
    pub relay: usize,
    /// Fixed lateral position: the offset from the vertical plane through Tx and Rx, m.
    pub y_m: f64,
    /// Fixed altitude of the relay, m, > 0.
    pub altitude_m: f64,
}

impl FixedCrossSection {
    /// Returns the limits of the altitude and lateral position of one relay.
    ///
    /// They are a single point if `held` fixes them for this relay.
    pub(crate) fn corridor_of(held: &[Self], relay: usize, corridor: Corridor) -> Corridor {
        let own = held.iter().find(|hold| hold.relay == relay);
        own.map_or(corridor, |hold| Corridor {
            least_m: hold.altitude_m,
            most_m: hold.altitude_m,
            left_m: hold.y_m,
            right_m: hold.y_m,
        })
    }
}

/// Position of a relay in the reference model of the joint method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Distance from Tx toward Rx, m: 0 to the distance D.
    pub x_m: f64,
    /// Lateral offset from the vertical plane through Tx and Rx, m.
    ///
    /// It is positive on the side of an interferer with a positive `y_i`.
    pub y_m: f64,
    /// Altitude of the relay, m.
    pub altitude_m: f64,
}

impl Place {
    /// Creates a position in the vertical plane through Tx and Rx.
    pub const fn in_plane(x_m: f64, altitude_m: f64) -> Self {
        Self {
            x_m,
            y_m: 0.0,
            altitude_m,
        }
    }

    /// Returns the distance to another position, m.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let aside = (self.y_m - other.y_m).hypot(self.altitude_m - other.altitude_m);
        (self.x_m - other.x_m).hypot(aside)
    }
}

/// Returns the linear SIR of a chain's worst hop.
///
/// `None` if the link has no relays, or if the number of positions differs from the number of relays.
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

/// Returns true if a chain keeps the order, the corridor, fixed positions and the minimum separation.
///
/// A distance may be below the minimum separation by less than 1e-9 of it, because of rounding.
pub fn keeps_rules(
    link: &Link,
    corridor: Corridor,
    held: &[FixedCrossSection],
    places: &[Place],
) -> bool {
    let mut each = (0..).zip(places);
    let within = each.all(|(relay, place)| {
        (0.0..=link.distance_m).contains(&place.x_m)
            && FixedCrossSection::corridor_of(held, relay, corridor).contains(place, 0.0)
    });
    let mut neighbours = places.iter().zip(places.iter().skip(1));
    let least_m = link.min_separation_m * (1.0 - 1e-9);
    within && neighbours.all(|(a, b)| b.x_m >= a.x_m && a.distance_m(b) >= least_m)
}
