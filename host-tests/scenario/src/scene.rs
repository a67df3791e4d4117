//! Scene: a chain of relays and several interferers whose powers add up.

use uav_relay::channel::AirGround;
use uav_relay::{Channel, Placement};

use crate::{Interference, Scenario, Source};

/// A relay of a [`Scene`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relay {
    /// Initial altitude, m, > 0.
    pub altitude_m: f64,
    /// Transmit power, W, > 0.
    pub power_w: f64,
    /// True if the altitude is fixed, whatever the band.
    pub holds: bool,
}

/// Altitudes and lateral positions open to relays, m; positive to the right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corridor {
    /// Lowest altitude, > 0.
    pub least_m: f64,
    /// Highest altitude.
    pub most_m: f64,
    /// Limit to the left, <= 0.
    pub left_m: f64,
    /// Limit to the right, >= 0.
    pub right_m: f64,
}

impl Corridor {
    /// Creates the plane above Tx-Rx, between two altitudes, m.
    pub const fn plane(least_m: f64, most_m: f64) -> Self {
        Self {
            least_m,
            most_m,
            left_m: 0.0,
            right_m: 0.0,
        }
    }
}

/// A chain of relays from Tx at (0, 0) to Rx at (D, 0), and any number of interferers on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Distance D from Tx to Rx, m, > 0.
    pub distance_m: f64,
    /// Least distance between two relays, m, >= 0.
    pub min_separation_m: f64,
    /// Transmit power of Tx, W, > 0.
    pub tx_w: f64,
    /// Transmit power of Rx on the way back, W, > 0.
    pub rx_w: f64,
    /// SIR needed on the way back, relative to that on the way there; 0 for one direction.
    pub reverse: f64,
    /// Interferers; at least one.
    pub sources: Vec<Source>,
    /// Path-loss factor between two relays, 1/m^2, > 0.
    pub mu_los: f64,
    /// Path-loss factor between two points on the ground, 1/m^2, > 0.
    pub mu_nlos: f64,
    /// Path-loss factor between a relay and the ground, 1/m^2, > 0.
    pub eta: f64,
    /// Noise power of every receiver, W, >= 0; if above 0, SIR means SINR.
    pub noise_w: f64,
    /// Altitude limits of relays without a fixed altitude, and lateral limits of all relays.
    pub band: Corridor,
    /// Relays 1 to N from Tx to Rx.
    pub relays: Vec<Relay>,
}

/// Position of a relay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Distance along the line from Tx, m.
    pub x: f64,
    /// Lateral position, m; positive to the right of the line.
    pub y: f64,
    /// Height above ground, m, > 0.
    pub h: f64,
}

impl From<(f64, f64)> for Place {
    /// Converts (x, h), in metres, to a position above the line between Tx and Rx.
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
    /// Creates the scene of `relays` relays in `scenario`.
    ///
    /// `None` for a field of interference, and for a channel or a list of interferers that no scenario file can have.
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

    /// Returns the interference power at a relay, W: the sum over all sources.
    pub fn interference_w(&self, at: impl Into<Place>) -> f64 {
        let Place { x, y, h } = at.into();
        let each = self.sources.iter().map(|source| {
            let (dx, dy) = (x - source.x_m, y - source.y_m);
            received_w(source.power_w, self.eta, dx, dy, h)
        });
        each.sum()
    }

    /// Returns the interference power at Rx, W; infinite with an interferer at Rx.
    pub fn interference_rx_w(&self) -> f64 {
        self.interference_on_ground_w(self.distance_m)
    }

    /// Returns the interference power on the ground at `x_m` on the line, W.
    pub fn interference_on_ground_w(&self, x_m: f64) -> f64 {
        let each = self.sources.iter().map(|source| {
            let dx = x_m - source.x_m;
            received_w(source.power_w, self.mu_nlos, dx, source.y_m, 0.0)
        });
        each.sum()
    }

    /// Returns the SIR (linear) of the N + 1 hops of a chain with relay k at `places[k - 1]`.
    ///
    /// Infinite if two relays share a position; empty unless there is one position per relay, and at least one relay.
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

    /// Returns the SIR (linear) of the N + 1 hops on the way back from Rx to Tx.
    ///
    /// Hop k is sent by node k and received by node k - 1, where node 0 is Tx and node N + 1 is Rx. The interference is that at its
    /// receiver. Empty and infinite as [`Scene::hop_sirs`].
    pub fn hop_sirs_back(&self, places: &[impl Copy + Into<Place>]) -> Vec<f64> {
        let (Some(&first), Some(relay)) = (places.first(), self.relays.first()) else {
            return Vec::new();
        };
        if places.len() != self.relays.len() {
            return Vec::new();
        }
        let Place { x, y, h } = first.into();
        let signal = received_w(relay.power_w, self.eta, x, y, h);
        let mut sirs = vec![signal / (self.interference_on_ground_w(0.0) + self.noise_w)];
        let senders = places.iter().zip(&self.relays).skip(1);
        let senders = senders.map(|(&at, relay)| self.sender(at, relay));
        let rx = Sender {
            at: Place::from((self.distance_m, 0.0)),
            power_w: self.rx_w,
            factor: self.eta,
        };
        let hops = places.iter().zip(senders.chain([rx]));
        sirs.extend(hops.map(|(&at, sender)| self.sir_at(sender, at)));
        sirs
    }

    /// Returns the SIR (linear) of the worst hop; 0 if [`Scene::hop_sirs`] is empty.
    ///
    /// With a way back it is that of the worse direction, the way back divided by `reverse`.
    pub fn chain_sir(&self, places: &[impl Copy + Into<Place>]) -> f64 {
        let sirs = self.hop_sirs(places).into_iter();
        let there = sirs.reduce(f64::min).unwrap_or(0.0);
        if !(self.reverse > 0.0) {
            return there;
        }
        let back = self.hop_sirs_back(places).into_iter();
        back.fold(there, |worst, sir| worst.min(sir / self.reverse))
    }

    /// Returns the SIR (linear) of the worst hop. Relays are at `along`, m from Tx, at their own altitudes above the line.
    ///
    /// 0 unless there is one position per relay.
    pub fn sir_along(&self, along: &[f64]) -> f64 {
        let places = along.iter().zip(&self.relays);
        let places: Vec<(f64, f64)> = places.map(|(&x, relay)| (x, relay.altitude_m)).collect();
        self.chain_sir(&places)
    }

    /// Returns Tx as a sender.
    pub fn tx(&self) -> Sender {
        Sender {
            at: Place::from((0.0, 0.0)),
            power_w: self.tx_w,
            factor: self.eta,
        }
    }

    /// Returns a relay as a sender to other relays.
    pub fn sender(&self, at: impl Into<Place>, relay: &Relay) -> Sender {
        Sender {
            at: at.into(),
            power_w: relay.power_w,
            factor: self.mu_los,
        }
    }

    /// Returns the SIR (linear) at a relay.
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

    /// Returns the SIR (linear) at Rx of the last relay, `relay`, at `at`.
    pub fn sir_at_rx(&self, at: impl Into<Place>, relay: &Relay) -> f64 {
        let Place { x, y, h } = at.into();
        let signal = received_w(relay.power_w, self.eta, self.distance_m - x, y, h);
        signal / (self.interference_rx_w() + self.noise_w)
    }
}

/// A sender to relays: position, power and path-loss factor.
#[derive(Debug, Clone, Copy)]
pub struct Sender {
    /// Position.
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

/// Returns the received power over a squared-distance path loss, W; offsets in metres.
fn received_w(power_w: f64, factor: f64, dx: f64, dy: f64, dz: f64) -> f64 {
    power_w / (factor * (dx * dx + dy * dy + dz * dz))
}
