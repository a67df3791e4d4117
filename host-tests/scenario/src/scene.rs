//! Scene: a chain of relays and several interferers whose powers add up.

use std::collections::BTreeMap;

use uav_relay::channel::AirGround;
use uav_relay::{Channel, Placement};

use crate::area::Area;
use crate::{Interference, Scenario, Source};

/// Relay of a chain in a [`Scene`]: its altitude and its transmit power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relay {
    /// Altitude of the relay, m, > 0.
    ///
    /// Planning methods that choose altitudes may change it unless `holds` is true.
    pub altitude_m: f64,
    /// Transmit power (EIRP) of the relay, W, > 0.
    pub power_w: f64,
    /// True if the relay keeps its altitude, even outside the altitude limits of the other relays.
    pub holds: bool,
}

/// Limits of the altitudes and lateral positions of relays, m.
///
/// A lateral position is the offset from the line Tx-Rx, positive to the right as seen from Tx toward Rx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Lowest altitude of a relay, m, > 0.
    pub least_m: f64,
    /// Highest altitude of a relay, m.
    pub most_m: f64,
    /// Smallest lateral position (left limit as seen from Tx toward Rx), m, <= 0.
    pub left_m: f64,
    /// Largest lateral position (right limit as seen from Tx toward Rx), m, >= 0.
    pub right_m: f64,
}

impl Corridor {
    /// Creates limits without lateral offsets, for altitudes from `least_m` to `most_m`, m.
    pub const fn plane(least_m: f64, most_m: f64) -> Self {
        Self {
            least_m,
            most_m,
            left_m: 0.0,
            right_m: 0.0,
        }
    }
}

/// Chain of relays from Tx at (0, 0) to Rx at (D, 0), and any number of interferers.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Distance D from Tx to Rx, m, > 0.
    pub distance_m: f64,
    /// Least distance between two relays, m, >= 0.
    pub min_separation_m: f64,
    /// Transmit power of Tx, W, > 0.
    pub tx_w: f64,
    /// Transmit power of Rx when it sends toward Tx, W, > 0.
    pub rx_w: f64,
    /// Required SIR toward Tx, as a fraction of the required SIR toward Rx. 0 means that only the direction from Tx to
    /// Rx counts.
    pub reverse: f64,
    /// Interfering transmitters, at least one; their powers add up at a receiver.
    pub sources: Vec<Source>,
    /// Areas of interferers whose positions are uncertain, by index in `sources`.
    ///
    /// For each receiver, the interferer is at the area's point nearest to the receiver. The SIR of a hop is therefore
    /// the SIR for the worst position of the interferer.
    pub areas: BTreeMap<usize, Area>,
    /// Least and greatest altitude of each interferer, m, by index in `sources`; 0 if it is not in the map.
    ///
    /// For each receiver, the interferer's altitude is the one within these limits that is nearest to the receiver's
    /// altitude.
    pub heights_m: BTreeMap<usize, [f64; 2]>,
    /// Path-loss factor mu between two relays, 1/m^2, > 0: the path loss at distance d is mu d^2.
    pub mu_los: f64,
    /// Path-loss factor mu between two points on the ground, 1/m^2, > 0. The path loss at distance d is mu d^2.
    pub mu_nlos: f64,
    /// Path-loss factor eta between a relay and the ground, 1/m^2, > 0. The path loss at distance d is eta d^2.
    pub eta: f64,
    /// Noise power of every receiver, W, >= 0. With noise above 0, methods that return SIRs return SINRs.
    pub noise_w: f64,
    /// Altitude limits of relays without a fixed altitude, and lateral limits of all relays.
    pub band: Corridor,
    /// Relays 1 to N, in order from Tx to Rx.
    pub relays: Vec<Relay>,
}

/// Position of a relay relative to the line from Tx to Rx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Distance of the relay from Tx toward Rx, m.
    pub x: f64,
    /// Lateral position of the relay, m; positive to the right as seen from Tx toward Rx.
    pub y: f64,
    /// Height of the relay above ground, m, > 0.
    pub h: f64,
}

impl From<(f64, f64)> for Place {
    /// Converts (x, h), distance from Tx and altitude in metres, to a position with lateral offset 0.
    fn from((x, h): (f64, f64)) -> Self {
        Self { x, y: 0.0, h }
    }
}

impl From<Placement> for Place {
    fn from(place: Placement) -> Self {
        let [x, y, h] = [place.x_m, place.y_m, place.altitude_m].map(f64::from);
        Self { x, y, h }
    }
}

impl Scene {
    /// Creates the scene of a chain of `relays` relays in `scenario`.
    ///
    /// `None` if the interference is a random field, if there is no interferer, or if the channel is invalid. In a
    /// scenario from a file, the channel is valid, and an interferer is missing only if the relays have to locate it.
    pub fn new(scenario: &Scenario, relays: u16) -> Option<Self> {
        let Interference::Sources(sources) = &scenario.interference else {
            return None;
        };
        let spec = &scenario.channel;
        let air_ground = match spec.air_ground {
            crate::AirGround::Los => AirGround::Los,
            crate::AirGround::Nlos => AirGround::Nlos,
            crate::AirGround::Weight(weight) => AirGround::Weighted(weight),
        };
        let channel = Channel::from_db(
            spec.carrier_hz,
            spec.excess_loss_los_db,
            spec.excess_loss_nlos_db,
            air_ground,
        )
        .ok()?;
        (!sources.is_empty()).then(|| Self {
            distance_m: scenario.distance_m,
            min_separation_m: scenario.min_separation_m,
            tx_w: scenario.tx_w,
            rx_w: scenario.rx_w,
            reverse: scenario.reverse,
            sources: sources.clone(),
            areas: scenario
                .areas
                .iter()
                .map(|(at, source)| (*at, source.area.clone()))
                .collect(),
            heights_m: BTreeMap::new(),
            mu_los: channel.mu_los(),
            mu_nlos: channel.mu_nlos(),
            eta: channel.eta(),
            noise_w: scenario.noise.power_w(),
            band: Corridor {
                least_m: scenario.altitude_min_m,
                most_m: scenario.altitude_max_m,
                left_m: scenario.lateral_min_m,
                right_m: scenario.lateral_max_m,
            },
            relays: (1..=relays).map(|index| relay(scenario, index)).collect(),
        })
    }

    /// Returns the interference power that a relay at `at` receives, W: the sum over all interferers.
    pub fn interference_w(&self, at: impl Into<Place>) -> f64 {
        let Place { x, y, h } = at.into();
        let each = self.offsets(x, y).enumerate();
        each.map(|(at, (power_w, [dx, dy]))| {
            received_w(power_w, self.eta, dx, dy, self.climb_m(at, h))
        })
        .sum()
    }

    /// Returns the height difference from interferer `at` to a receiver at the altitude `h_m`, m.
    ///
    /// `at` is the interferer's index in `sources`. The difference is positive for a receiver above the interferer, and
    /// 0 within the altitude limits of the interferer.
    fn climb_m(&self, at: usize, h_m: f64) -> f64 {
        let [low, high] = self.heights_m.get(&at).copied().unwrap_or_default();
        h_m - h_m.clamp(low, high)
    }

    /// Returns the interference power at Rx, W; infinite if an interferer is exactly at Rx.
    pub fn interference_rx_w(&self) -> f64 {
        self.interference_on_ground_w(self.distance_m)
    }

    /// Returns the interference power on the ground at the distance `x_m` from Tx toward Rx, W.
    pub fn interference_on_ground_w(&self, x_m: f64) -> f64 {
        let each = self.offsets(x_m, 0.0).enumerate();
        each.map(|(at, (power_w, [dx, dy]))| {
            received_w(power_w, self.mu_nlos, dx, dy, self.climb_m(at, 0.0))
        })
        .sum()
    }

    /// Returns for each interferer its power, W, and the offset from the interferer to (`x`, `y`), m.
    ///
    /// An interferer with an area is at the area's point nearest to (`x`, `y`).
    pub fn offsets(&self, x: f64, y: f64) -> impl Iterator<Item = (f64, [f64; 2])> {
        let each = self.sources.iter().enumerate();
        each.map(move |(at, source)| {
            let area = self.areas.get(&at);
            let [from_x, from_y] =
                area.map_or([source.x_m, source.y_m], |area| area.nearest([x, y]));
            (source.power_w, [x - from_x, y - from_y])
        })
    }

    /// Returns the linear SIRs of the N + 1 hops from Tx to Rx, with relay k at `places[k - 1]`.
    ///
    /// A SIR is infinite if the two nodes of its hop share a position. The list is empty unless there is one position
    /// per relay, and at least one relay.
    pub fn hop_sirs(&self, places: &[impl Copy + Into<Place>]) -> Vec<f64> {
        if places.len() != self.relays.len() {
            return Vec::new();
        }
        let mut from = self.tx();
        let mut sirs = Vec::with_capacity(places.len() + 1);
        for (&at, relay) in places.iter().zip(&self.relays) {
            sirs.push(self.sir_at(from, at));
            from = self.sender(at, relay);
        }
        if let (Some(&last), Some(relay)) = (places.last(), self.relays.last()) {
            sirs.push(self.sir_at_rx(last, relay));
        }
        sirs
    }

    /// Returns the linear SIRs of the N + 1 hops from Rx to Tx, with relay k at `places[k - 1]`.
    ///
    /// Node 0 is Tx, node k relay k, and node N + 1 Rx. Entry k - 1 is the SIR of the hop from node k to node k - 1. A
    /// SIR is infinite if the two nodes of its hop share a position. The list is empty unless there is one position per
    /// relay, and at least one relay.
    pub fn hop_sirs_back(&self, places: &[impl Copy + Into<Place>]) -> Vec<f64> {
        let (Some(&first), Some(relay)) = (places.first(), self.relays.first()) else {
            return Vec::new();
        };
        if places.len() != self.relays.len() {
            return Vec::new();
        }
        let mut sirs = vec![self.sir_at_tx(first, relay)];
        let senders = places.iter().zip(&self.relays).skip(1);
        let senders = senders.map(|(&at, relay)| self.sender(at, relay));
        let hops = places.iter().zip(senders.chain([self.rx()]));
        sirs.extend(hops.map(|(&at, sender)| self.sir_at(sender, at)));
        sirs
    }

    /// Returns the linear SIR of the worst hop from Tx to Rx; 0 if [`Scene::hop_sirs`] returns no hop.
    ///
    /// If `self.reverse` is above 0, the SIRs of the hops from Rx to Tx count as well, divided by `reverse`.
    pub fn chain_sir(&self, places: &[impl Copy + Into<Place>]) -> f64 {
        let sirs = self.hop_sirs(places).into_iter();
        let there = sirs.reduce(f64::min).unwrap_or(0.0);
        if !(self.reverse > 0.0) {
            return there;
        }
        let back = self.hop_sirs_back(places).into_iter();
        back.fold(there, |worst, sir| worst.min(sir / self.reverse))
    }

    /// Returns the linear SIR of the worst hop for relays with y = 0 and x = `along`, m.
    ///
    /// The altitudes are those in `self.relays`. Returns 0 unless `along` has one position for each relay.
    pub fn sir_along(&self, along: &[f64]) -> f64 {
        let places = along.iter().zip(&self.relays);
        let places: Vec<(f64, f64)> = places.map(|(&x, relay)| (x, relay.altitude_m)).collect();
        self.chain_sir(&places)
    }

    /// Returns Tx as a sender, for [`Scene::sir_at`].
    pub fn tx(&self) -> Sender {
        Sender {
            at: Place::from((0.0, 0.0)),
            power_w: self.tx_w,
            factor: self.eta,
        }
    }

    /// Returns Rx as a sender toward Tx, for [`Scene::sir_at`].
    pub fn rx(&self) -> Sender {
        Sender {
            at: Place::from((self.distance_m, 0.0)),
            power_w: self.rx_w,
            factor: self.eta,
        }
    }

    /// Returns `relay` at the position `at` as a sender to the next relay, for [`Scene::sir_at`].
    pub fn sender(&self, at: impl Into<Place>, relay: &Relay) -> Sender {
        Sender {
            at: at.into(),
            power_w: relay.power_w,
            factor: self.mu_los,
        }
    }

    /// Returns the linear SIR at a relay at `at` that receives from the sender `from`.
    pub fn sir_at(&self, from: Sender, at: impl Into<Place>) -> f64 {
        let (to, by) = (at.into(), from.at);
        let signal = received_w(
            from.power_w,
            from.factor,
            to.x - by.x,
            to.y - by.y,
            to.h - by.h,
        );
        signal / (self.interference_w(to) + self.noise_w)
    }

    /// Returns the linear SIR at Tx if the first relay of the chain is `relay`, at the position `at`.
    pub fn sir_at_tx(&self, at: impl Into<Place>, relay: &Relay) -> f64 {
        let Place { x, y, h } = at.into();
        let signal = received_w(relay.power_w, self.eta, x, y, h);
        signal / (self.interference_on_ground_w(0.0) + self.noise_w)
    }

    /// Returns the linear SIR at Rx if the last relay of the chain is `relay`, at the position `at`.
    pub fn sir_at_rx(&self, at: impl Into<Place>, relay: &Relay) -> f64 {
        let Place { x, y, h } = at.into();
        let signal = received_w(relay.power_w, self.eta, self.distance_m - x, y, h);
        signal / (self.interference_rx_w() + self.noise_w)
    }
}

/// Sender of a signal: its position, its power, and the path-loss factor from it to a relay.
#[derive(Debug, Clone, Copy)]
pub struct Sender {
    /// Position of the node that sends over the hop.
    pub at: Place,
    power_w: f64,
    factor: f64,
}

fn relay(scenario: &Scenario, index: u16) -> Relay {
    let own = scenario.relays.get(&index);
    let altitude_m = own.and_then(|own| own.altitude_m);
    Relay {
        altitude_m: altitude_m.unwrap_or(scenario.altitude_m),
        power_w: own.and_then(|own| own.power_w).unwrap_or(scenario.uav_w),
        holds: altitude_m.is_some(),
    }
}

/// Returns the received power, W: `power_w` / (`factor` d^2). d is the length of the offset (`dx`, `dy`, `dz`), m.
fn received_w(power_w: f64, factor: f64, dx: f64, dy: f64, dz: f64) -> f64 {
    power_w / (factor * (dx * dx + dy * dy + dz * dz))
}
