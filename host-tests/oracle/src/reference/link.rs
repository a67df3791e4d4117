//! A chain of relays as the judges see it, and what one power comes to at one distance.

/// One relay: where it flies and how loud it speaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// Altitude above the ground of Tx, Rx and the interferer, metres, > 0.
    pub altitude_m: f64,
    /// Transmit power, watts, > 0.
    pub power_w: f64,
}

/// A chain of relays between Tx at (0, 0) and Rx at (D, 0) under one interferer on the ground.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Tx-Rx distance D, metres, > 0.
    pub distance_m: f64,
    /// Least distance between neighbours, metres, >= 0; carried along, not enforced by the searches.
    pub min_separation_m: f64,
    /// Transmit power of Tx, watts, > 0.
    pub tx_w: f64,
    /// Transmit power of the interferer, watts, > 0.
    pub interferer_w: f64,
    /// Interferer's coordinate along Tx-Rx, metres; any finite value.
    pub x_i: f64,
    /// Interferer's offset from the Tx-Rx plane, metres; any finite value.
    pub y_i: f64,
    /// Path-loss factor between two relays, 1/m^2, > 0.
    pub mu_los: f64,
    /// Path-loss factor between two places on the ground, 1/m^2, > 0.
    pub mu_nlos: f64,
    /// Path-loss factor between a relay and the ground, 1/m^2, > 0.
    pub eta: f64,
    /// Noise power of every receiver, watts, >= 0; with any, what is called SIR is the SINR.
    pub noise_w: f64,
    /// The relays from Tx to Rx; their number is N.
    pub relays: Vec<Station>,
}

/// Free-space path-loss factor (4 pi f / c)^2 times an excess loss, 1/m^2; `carrier_hz` > 0, `excess` >= 1 (linear).
pub fn path_loss_factor(carrier_hz: f64, excess: f64) -> f64 {
    const LIGHT_M_PER_S: f64 = 299_792_458.0;
    let waves = 4.0 * std::f64::consts::PI * carrier_hz / LIGHT_M_PER_S;
    excess * waves * waves
}

impl Link {
    /// The paper's multi-hop scenario with `n` relays: 80 W Tx, 1 W relays at 20 m, 80 W interferer at (500, 400) m, D = 1 km.
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
                Station {
                    altitude_m: 20.0,
                    power_w: 1.0
                };
                n
            ],
        }
    }

    /// Number of relays N.
    pub fn len(&self) -> usize {
        self.relays.len()
    }

    /// Whether there is no relay at all; every search then finds nothing.
    pub fn is_empty(&self) -> bool {
        self.relays.is_empty()
    }
}

/// Power received over a squared-distance path loss, watts; the offsets in metres.
pub(super) fn received_w(power_w: f64, factor: f64, dx: f64, dy: f64, dz: f64) -> f64 {
    power_w / (factor * (dx * dx + dy * dy + dz * dz))
}

/// Whether an SIR counts as meeting a target.
///
/// A few units in the last place are forgiven, so that a constant SIR (interferer at Tx) that equals the target on paper
/// meets it in f64 wherever it is evaluated.
pub(super) fn meets(sir: f64, target: f64) -> bool {
    sir >= target * (1.0 - 4.0 * f64::EPSILON)
}
