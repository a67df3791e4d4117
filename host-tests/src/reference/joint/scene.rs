//! The joint problem in units of D: what limits a chain, with slopes and curvatures.
//!
//! A hop's SIR is a constant times (receiver to interferer)^2 / (sender to receiver)^2, at Rx a constant over (sender to
//! Rx)^2. So its logarithm is a sum of logarithms of squared distances, whose derivatives are those of ln(q), q = dx^2 + dh^2
//! + const: slope 2 d / q, curvature 2 I / q - 4 d d^T / q^2.

use super::super::Link;
use super::Band;
use super::plane::{Pair, Square};

/// A link and a band of altitudes with all lengths in units of D.
#[derive(Debug, Clone)]
pub(super) struct Scene {
    /// The interferer's foot on the Tx-Rx line.
    pub(super) interferer: Pair,
    /// Square of its offset from that line.
    pub(super) aside_2: f64,
    pub(super) low: f64,
    pub(super) high: f64,
    /// Least separation of neighbouring relays.
    pub(super) apart: f64,
    /// ln of the constant of the hop that ends at each relay.
    pub(super) hops: Vec<f64>,
    /// ln of the constant of the hop to Rx.
    pub(super) last: f64,
}

/// Something that must stay >= 0 (a hop's ln SIR over the target, a margin of order, band or separation), of one relay and
/// the one before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limit {
    /// Number of the relay, from 0.
    pub(super) relay: usize,
    pub(super) value: f64,
    /// Slope by the relay's own place.
    pub(super) own: Pair,
    /// Slope by the place of the relay before.
    pub(super) before: Pair,
    /// Slope by the target: -1 for hops, 0 for margins.
    pub(super) target: f64,
    /// Curvature by the relay's own place.
    pub(super) bend_own: Square,
    /// Curvature by the relay's own place (rows) and that of the one before; its negative is the curvature by the latter.
    pub(super) bend_across: Square,
}

impl Limit {
    /// A linear margin.
    fn margin(relay: usize, value: f64, own: Pair, before: Pair) -> Self {
        Self {
            relay,
            value,
            own,
            before,
            target: 0.0,
            bend_own: Square::default(),
            bend_across: Square::default(),
        }
    }
}

/// ln(d^2 + rest) with its slope and curvature by d.
fn ln_square(d: Pair, rest: f64) -> (f64, Pair, Square) {
    let q = d.dot(d) + rest;
    let slope = d * (2.0 / q);
    (
        q.ln(),
        slope,
        Square::diagonal(2.0 / q) - Square::outer(slope, slope),
    )
}

impl Scene {
    /// `None` without relays, with an empty band, or where every chain has an SIR of zero.
    pub(super) fn new(link: &Link, band: Band) -> Option<Self> {
        let unit = link.distance_m.recip();
        let powers = || link.relays.iter().map(|relay| relay.power_w);
        let senders = powers().map(|power| power * link.eta / link.mu_los);
        let hops = std::iter::once(link.tx_w).chain(senders);
        let rx = (link.distance_m - link.x_i).powi(2) + link.y_i.powi(2);
        let last = powers().next_back()? / link.interferer_w * link.mu_nlos / link.eta;
        let scene = Self {
            interferer: Pair::new(link.x_i * unit, 0.0),
            aside_2: (link.y_i * unit).powi(2),
            low: band.least_m * unit,
            high: band.most_m * unit,
            apart: link.min_separation_m * unit,
            hops: hops
                .take(link.len())
                .map(|power| (power / link.interferer_w).ln())
                .collect(),
            last: (last * rx * unit * unit).ln(),
        };
        (scene.low > 0.0 && scene.high >= scene.low && scene.last.is_finite()).then_some(scene)
    }

    pub(super) fn len(&self) -> usize {
        self.hops.len()
    }

    /// No chain's ln SIR exceeds this: the best that the hop to Rx can do.
    pub(super) fn ceiling(&self) -> f64 {
        self.last - 2.0 * self.low.ln()
    }

    /// ln SIR of a chain's worst hop; minus infinity for a chain of another length.
    pub(super) fn worst(&self, places: &[Pair]) -> f64 {
        let Some(&tail) = places.last().filter(|_| places.len() == self.len()) else {
            return f64::NEG_INFINITY;
        };
        let senders = std::iter::once(Pair::default()).chain(places.iter().copied());
        let hops = self.hops.iter().zip(senders.zip(places));
        let end = tail - Pair::new(1.0, 0.0);
        hops.map(|(&constant, (from, &to))| {
            let (near, far) = (to - from, to - self.interferer);
            constant + ((far.dot(far) + self.aside_2) / near.dot(near)).ln()
        })
        .fold(self.last - end.dot(end).ln(), f64::min)
    }

    /// Everything that limits a chain when its ln SIR is to exceed `target`.
    pub(super) fn limits(&self, places: &[Pair], target: f64) -> Vec<Limit> {
        let mut limits = Vec::with_capacity(6 * places.len() + 2);
        let mut from = Pair::default();
        for (relay, (&constant, &place)) in self.hops.iter().zip(places).enumerate() {
            let leap = place - from;
            let (near, near_slope, near_bend) = ln_square(leap, 0.0);
            let (far, far_slope, far_bend) = ln_square(place - self.interferer, self.aside_2);
            let after_tx = relay == 0;
            limits.push(Limit {
                relay,
                value: constant + far - near - target,
                own: far_slope - near_slope,
                before: if after_tx {
                    Pair::default()
                } else {
                    near_slope
                },
                target: -1.0,
                bend_own: far_bend - near_bend,
                bend_across: if after_tx {
                    Square::default()
                } else {
                    near_bend
                },
            });
            let (ahead, up) = (Pair::new(1.0, 0.0), Pair::new(0.0, 1.0));
            let none = Pair::default();
            let back = if after_tx { none } else { -ahead };
            limits.extend([
                Limit::margin(relay, leap.x, ahead, back),
                Limit::margin(relay, place.h - self.low, up, none),
                Limit::margin(relay, self.high - place.h, -up, none),
            ]);
            if !after_tx && self.apart > 0.0 {
                // As a logarithm: the margin then has the size of those of the hops.
                limits.push(Limit {
                    relay,
                    value: near - 2.0 * self.apart.ln(),
                    own: near_slope,
                    before: -near_slope,
                    target: 0.0,
                    bend_own: near_bend,
                    bend_across: near_bend * -1.0,
                });
            }
            if relay + 1 == self.len() {
                let (near, slope, bend) = ln_square(place - ahead, 0.0);
                limits.push(Limit::margin(relay, 1.0 - place.x, -ahead, none));
                limits.push(Limit {
                    relay,
                    value: self.last - near - target,
                    own: -slope,
                    before: none,
                    target: -1.0,
                    bend_own: bend * -1.0,
                    bend_across: Square::default(),
                });
            }
            from = place;
        }
        limits
    }
}
