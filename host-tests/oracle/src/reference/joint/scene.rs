//! The joint problem in units of D.

use super::super::link::Link;
use super::corridor::{Corridor, Hold};
use super::space::{Across, Triple};

/// Width below which a room's side counts as a point, in units of D.
const NO_WIDTH: f64 = 1e-9;

/// Cross-section open to one relay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Room {
    pub(super) low: Across,
    pub(super) high: Across,
}

impl Room {
    fn of(corridor: Corridor, unit: f64) -> Option<Self> {
        let low = Across::new(corridor.left_m * unit, corridor.least_m * unit);
        let high = Across::new(corridor.right_m * unit, corridor.most_m * unit);
        let is_room = low.h > 0.0
            && high.h >= low.h
            && high.h.is_finite()
            && high.y >= low.y
            && low.y.is_finite()
            && high.y.is_finite();
        is_room.then_some(Self { low, high })
    }

    /// Returns 1 for each coordinate that a relay may choose, 0 for the others.
    pub(super) fn free(&self) -> Triple {
        let wide = |low: f64, high: f64| f64::from(u8::from(high - low > NO_WIDTH));
        Triple::new(
            1.0,
            wide(self.low.y, self.high.y),
            wide(self.low.h, self.high.h),
        )
    }

    pub(super) fn is_point(&self) -> bool {
        self.free() == Triple::new(1.0, 0.0, 0.0)
    }

    pub(super) fn width(&self) -> Across {
        Across::new(self.high.y - self.low.y, self.high.h - self.low.h)
    }

    /// Returns the nearest point to `across` inside the room, at least `share` of its width off the walls.
    pub(super) fn nearest(&self, across: Across, share: f64) -> Across {
        let clamp = |value: f64, low: f64, high: f64| {
            let room = share * (high - low);
            value.clamp(low + room, (high - room).max(low + room))
        };
        Across::new(
            clamp(across.y, self.low.y, self.high.y),
            clamp(across.h, self.low.h, self.high.h),
        )
    }

    /// Returns the point at these shares of the width.
    pub(super) fn within(&self, y: f64, h: f64) -> Across {
        let width = self.width();
        self.nearest(
            Across::new(self.low.y + y * width.y, self.low.h + h * width.h),
            0.0,
        )
    }
}

/// A link and its corridor, with all lengths in units of D.
#[derive(Debug, Clone)]
pub(super) struct Scene {
    pub(super) interferer: Triple,
    /// Room of relays without a fixed position.
    pub(super) corridor: Room,
    pub(super) rooms: Vec<Room>,
    pub(super) apart: f64,
    /// ln of the constant of the hop that ends at each relay.
    pub(super) hops: Vec<f64>,
    /// ln of the constant of the hop to Rx.
    pub(super) last: f64,
    /// Noise over the interference at a relay at distance D from the interferer.
    pub(super) noise: f64,
}

impl Scene {
    /// Creates the scene. `None` without relays, with an empty corridor, or if every chain has an SIR of zero.
    pub(super) fn new(link: &Link, corridor: Corridor, held: &[Hold]) -> Option<Self> {
        let unit = link.distance_m.recip();
        let powers = || link.relays.iter().map(|relay| relay.power_w);
        let senders = powers().map(|power| power * link.eta / link.mu_los);
        let hops = std::iter::once(link.tx_w).chain(senders);
        let rx = (link.distance_m - link.x_i).powi(2) + link.y_i.powi(2);
        let last = powers().next_back()? / link.interferer_w * link.mu_nlos / link.eta;
        let louder = 1.0 + link.noise_w * link.mu_nlos * rx / link.interferer_w;
        let rooms: Option<Vec<Room>> = (0..link.len())
            .map(|relay| Room::of(Hold::room(held, relay, corridor), unit))
            .collect();
        let scene = Self {
            interferer: Triple::new(link.x_i * unit, link.y_i * unit, 0.0),
            corridor: Room::of(corridor, unit)?,
            rooms: rooms?,
            apart: link.min_separation_m * unit,
            hops: hops
                .take(link.len())
                .map(|power| (power / link.interferer_w).ln())
                .collect(),
            last: (last * rx * unit * unit / louder).ln(),
            noise: link.noise_w * link.eta / link.interferer_w / (unit * unit),
        };
        scene.last.is_finite().then_some(scene)
    }

    pub(super) fn len(&self) -> usize {
        self.hops.len()
    }

    /// Returns an upper bound on any chain's ln SIR: the best possible for the hop to Rx.
    pub(super) fn ceiling(&self) -> f64 {
        let nearest = |room: &Room| Across::default().apart_2(room.nearest(Across::default(), 0.0));
        self.last - self.rooms.last().map_or(1.0, nearest).ln()
    }

    /// Returns the ln SIR of a chain's worst hop; minus infinity for a chain of another length.
    pub(super) fn worst(&self, places: &[Triple]) -> f64 {
        let Some(&tail) = places.last().filter(|_| places.len() == self.len()) else {
            return f64::NEG_INFINITY;
        };
        let senders = std::iter::once(Triple::default()).chain(places.iter().copied());
        let hops = self.hops.iter().zip(senders.zip(places));
        let end = tail - Triple::new(1.0, 0.0, 0.0);
        hops.map(|(&constant, (from, &to))| {
            let (near, far) = (to - from, to - self.interferer);
            let heard = far.dot(far);
            constant + (heard / (1.0 + self.noise * heard) / near.dot(near)).ln()
        })
        .fold(self.last - end.dot(end).ln(), f64::min)
    }
}
