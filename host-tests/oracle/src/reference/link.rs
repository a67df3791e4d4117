//! A chain of relays for the reference optimisers, and the received power over a distance.

/// Relay in a reference link: altitude and transmit power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relay {
    /// Altitude of the relay above the ground, m, > 0. Tx, Rx and interferer are on the ground.
    pub altitude_m: f64,
    /// Transmit power of the relay, W, > 0.
    pub power_w: f64,
}

/// Chain of relays between Tx at (0, 0) and Rx at (D, 0), with one interferer on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Distance D from Tx to Rx, m, > 0.
    pub distance_m: f64,
    /// Minimum distance between neighbouring relays, m, >= 0; most searches ignore it.
    pub min_separation_m: f64,
    /// Transmit power of Tx, W, > 0.
    pub tx_w: f64,
    /// Transmit power of the interferer, W, > 0.
    pub interferer_w: f64,
    /// Position x of the interferer, m; any finite value.
    pub x_i: f64,
    /// Lateral position y of the interferer, m; any finite value.
    ///
    /// It is the offset from the vertical plane through Tx and Rx.
    pub y_i: f64,
    /// Path-loss factor between two relays, 1/m^2, > 0.
    pub mu_los: f64,
    /// Path-loss factor between two points on the ground, 1/m^2, > 0.
    pub mu_nlos: f64,
    /// Path-loss factor between a relay and the ground, 1/m^2, > 0.
    pub eta: f64,
    /// Noise power of every receiver, W, >= 0; if above 0, SIR means SINR.
    pub noise_w: f64,
    /// Relays 1 to N, in order from Tx to Rx.
    pub relays: Vec<Relay>,
}

/// Returns a path-loss factor, 1/m^2: the free-space factor (4 pi f / c)^2 times the excess loss.
///
/// `carrier_hz` > 0 is the frequency f, `excess` >= 1 the excess loss (linear).
pub fn path_loss_factor(carrier_hz: f64, excess: f64) -> f64 {
    const LIGHT_M_PER_S: f64 = 299_792_458.0;
    let waves = 4.0 * std::f64::consts::PI * carrier_hz / LIGHT_M_PER_S;
    excess * waves * waves
}

impl Link {
    /// Returns the paper's multi-hop scenario with `n` relays of 1 W at 20 m.
    ///
    /// Tx and interferer have 80 W. The interferer is at (500, 400) m, and Rx is 1 km from Tx.
    pub fn paper(n: usize) -> Self {
        let mu_los = path_loss_factor(2e9, 10_f64.powf(0.01));
        Self {
            distance_m: 1000.0,
            min_separation_m: 0.0,
            tx_w: 80.0,
            interferer_w: 80.0,
            x_i: 500.0,
            y_i: 400.0,
            mu_los,
            mu_nlos: path_loss_factor(2e9, 10_f64.powf(2.1)),
            eta: mu_los,
            noise_w: 0.0,
            relays: vec![
                Relay {
                    altitude_m: 20.0,
                    power_w: 1.0
                };
                n
            ],
        }
    }

    /// Returns the number of relays N.
    pub fn len(&self) -> usize {
        self.relays.len()
    }

    /// Returns true if the link has no relays. Every search then returns `None`.
    pub fn is_empty(&self) -> bool {
        self.relays.is_empty()
    }
}

/// Returns the received power, W: `power_w` / (`factor` d^2).
///
/// d is the length of the offset (`dx`, `dy`, `dz`), m.
pub(super) fn received_w(power_w: f64, factor: f64, dx: f64, dy: f64, dz: f64) -> f64 {
    power_w / (factor * (dx * dx + dy * dy + dz * dz))
}

/// Returns true if `sir` is at least `target`, apart from rounding.
///
/// With the interferer at Tx, the SIR of the first hop is constant and can be equal to the target. Without a tolerance
/// for rounding errors the result would then be arbitrary.
pub(super) fn meets(sir: f64, target: f64) -> bool {
    sir >= target * (1.0 - 4.0 * f64::EPSILON)
}
