//! An f64 judge of placements that shares no formula with `uav-relay`.
//!
//! The crate solves a quadratic for the reach of a node. Here nothing is solved: the SIR of a hop is computed from received
//! powers, and whatever is asked about it (how far a node may stand, the best target of a chain) is found by bisecting that
//! function. A slip in the crate's algebra therefore cannot repeat itself here.
//!
//! The only analysis used is the *number* of turning points. With d >= 0 the distance past the sender, a hop's SIR is a
//! quotient of two quadratics with equal leading coefficients, so its derivative has the sign of a quadratic in d, and the
//! product of that quadratic's roots is -(height difference)^2 <= 0: at most one turning point lies beyond the sender. So the
//! SIR only falls, only rises, forms one valley (interferer ahead) or one hill (interferer behind), and bisection is safe.
//!
//! Order of travel: a relay never stands behind the one before it (0 <= `x_1` <= ... <= `x_N` <= D). The least separation is
//! carried for the tests that check it, and ignored by every search here but that of [`joint`].
//!
//! - `Link::feasible` extends the chain greedily, as the on-board protocol does. It is exact when all altitudes are equal.
//! - `Link::placement` keeps the whole set of places each node can reach. It is exact for any altitudes, which the greedy
//!   chain is not: close to the interferer a climb may be impossible that was possible earlier.
//! - [`joint::optimum`] chooses altitudes and offsets to the side too. It is a numerical search: no proof, and it does solve
//!   quadratics on the way, but what it reports is the SIR of the places it found.
//!
//! Cost: a reach takes about 60 SIR evaluations when the node may start from where the search starts, at most about 150 when
//! a hilltop has to be found first. An optimum takes about 50 to 60 chains.

mod hop;
pub mod joint;
mod optimum;
mod reach;
mod search;
mod sets;
pub mod stochastic;

use hop::Hop;

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

    /// SIR (linear) of hop `k` in 1..=N measured at relay `k` standing at `x` metres, its sender at `from_x` metres.
    ///
    /// Hop 1 is sent by Tx, which stands at 0: `from_x` is then not looked at. `None` for any other `k`. Infinite when sender
    /// and receiver coincide.
    pub fn sir_relay(&self, k: usize, from_x: f64, x: f64) -> Option<f64> {
        Hop::new(self, k, from_x).map(|hop| hop.sir(x))
    }

    /// SIR (linear) of hop N+1, measured at Rx, the last relay standing at `x` metres; `None` without relays.
    pub fn sir_rx(&self, x: f64) -> Option<f64> {
        let last = self.relays.last()?;
        let signal = received_w(
            last.power_w,
            self.eta,
            self.distance_m - x,
            0.0,
            last.altitude_m,
        );
        let noise = received_w(
            self.interferer_w,
            self.mu_nlos,
            self.distance_m - self.x_i,
            self.y_i,
            0.0,
        );
        Some(signal / noise)
    }

    /// SIR (linear) of the N+1 hops of a chain whose relay k stands at `x[k-1]` metres.
    ///
    /// Empty when `x` does not hold exactly one place per relay, or there is no relay.
    pub fn sir_hops(&self, x: &[f64]) -> Vec<f64> {
        if x.len() != self.len() {
            return Vec::new();
        }
        let senders = std::iter::once(&0.0).chain(x);
        let hops = (1..).zip(senders.zip(x));
        let mut sir: Vec<f64> = hops
            .filter_map(|(k, (&from, &to))| self.sir_relay(k, from, to))
            .collect();
        sir.extend(x.last().and_then(|&tail| self.sir_rx(tail)));
        sir
    }

    /// SIR (linear) of the chain: that of its worst hop; 0 where [`Link::sir_hops`] is empty.
    pub fn chain_sir(&self, x: &[f64]) -> f64 {
        self.sir_hops(x).into_iter().reduce(f64::min).unwrap_or(0.0)
    }
}

/// Power received over a squared-distance path loss, watts; the offsets in metres.
fn received_w(power_w: f64, factor: f64, dx: f64, dy: f64, dz: f64) -> f64 {
    power_w / (factor * (dx * dx + dy * dy + dz * dz))
}

/// Whether an SIR counts as meeting a target.
///
/// A few units in the last place are forgiven, so that a constant SIR (interferer at Tx) that equals the target on paper
/// meets it in f64 wherever it is evaluated.
fn meets(sir: f64, target: f64) -> bool {
    sir >= target * (1.0 - 4.0 * f64::EPSILON)
}
