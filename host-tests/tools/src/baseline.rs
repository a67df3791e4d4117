//! Baseline placements that ignore the interferer, for comparison with the crate's methods.
//!
//! | function | positions of the relays |
//! | --- | --- |
//! | [`mean`] | uniformly random, in order; mean over many draws |
//! | [`blind_places`] | maximise the weakest received signal, without interference |
//! | [`equal_places`] | equal spacing |
//!
//! [`Scene`] computes the SIR of the worst hop for each of them, in f64.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_scenario::scene::{Relay, Scene};

/// Number of random chains whose results are averaged, as in the paper.
pub const DRAWS: u32 = 1000;

/// Results averaged over many chains whose relays are at random positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Mean over the random chains of the worst hop's SIR, linear.
    pub sir: f64,
    /// Standard error of the mean SIR, linear.
    pub error: f64,
    /// Mean over the random chains of the worst hop's SIR in dB.
    pub db: f64,
    /// Mean over the random chains of the worst hop's log2(1 + SIR), bit/s/Hz.
    pub rate: f64,
}

/// Returns the mean results of `draws` (at least 2) chains with random positions.
///
/// `seed` is the seed of the random positions. Cost for N relays: N numbers are sorted, and N + 1 SIRs computed, for
/// each chain.
pub fn mean(scene: &Scene, draws: u32, seed: u64) -> Mean {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut places = vec![0.0; scene.relays.len()];
    let (mut sum, mut squares, mut db, mut rate) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..draws {
        for place in &mut places {
            *place = rng.random_range(0.0..scene.distance_m);
        }
        places.sort_by(f64::total_cmp);
        let sir = scene.sir_along(&places);
        sum += sir;
        squares += sir * sir;
        db += 10.0 * sir.log10();
        rate += sir.ln_1p() / std::f64::consts::LN_2;
    }
    let count = f64::from(draws);
    let sir = sum / count;
    let variance = (squares / count - sir * sir).max(0.0) * count / (count - 1.0);
    Mean {
        sir,
        error: (variance / count).sqrt(),
        db: db / count,
        rate: rate / count,
    }
}

// Interference-blind baseline: the chain that maximises the weakest received signal.
//
// The received power of a hop is p_t / (eta (d^2 + h^2)) from Tx, p_u / (mu_LoS d^2) between relays and p_u / (eta (d^2
// + h^2)) to Rx. It falls with the hop length. In the best chain all received powers are therefore equal, and the hops
// together are as long as the distance. With one relay this maximises min{p_t / (x^2 + h^2), p_u / ((D - x)^2 + h^2)}.
//
// The first and the last hop are at least as long as the altitude, which limits their power. With this power the hops
// may together be longer than the distance. Many chains are then equally good; the one used shortens every hop by the
// same factor.

/// Largest number of bisection steps in the search for the signal power that all hops can have.
///
/// Any f64 interval needs fewer steps.
const HALVINGS: u32 = 200;

/// Returns the relays' x, m, that maximise the weakest received signal. Interference is ignored.
///
/// All relays get the altitude and power of the first relay. The list is empty if the scene has no relays. The cost is
/// 200 computations of a chain's length.
pub fn blind_places(scene: &Scene) -> Vec<f64> {
    let Some(relay) = scene.relays.first() else {
        return Vec::new();
    };
    let hops = Hops { scene, relay };
    let strongest = hops.strongest();
    let mut signal = strongest;
    if hops.span(strongest) < scene.distance_m {
        let (mut covers, mut falls_short) = (0.0, strongest);
        for _ in 0..HALVINGS {
            signal = f64::midpoint(covers, falls_short);
            if hops.span(signal) >= scene.distance_m {
                covers = signal;
            } else {
                falls_short = signal;
            }
        }
    }
    let share = (scene.distance_m / hops.span(signal)).min(1.0);
    let (first, between) = (share * hops.first(signal), share * hops.between(signal));
    (0..scene.relays.len())
        .map(|before| (first + before as f64 * between).min(scene.distance_m))
        .collect()
}

/// Hop lengths, m, as a function of the received power, W.
struct Hops<'a> {
    scene: &'a Scene,
    relay: &'a Relay,
}

impl Hops<'_> {
    /// Returns the largest signal power that the first and the last hop can both have, W.
    ///
    /// The hop from Tx has its largest power if the relay is vertically above Tx. The hop to Rx has its largest power
    /// if the relay is vertically above Rx.
    fn strongest(&self) -> f64 {
        let height = self.relay.altitude_m;
        self.scene.tx_w.min(self.relay.power_w) / (self.scene.eta * height * height)
    }

    /// Returns the horizontal length of a hop from Tx or to Rx, m, at which `signal_w` watts are received.
    ///
    /// `power_w` is the sender's power, W.
    fn outer(&self, power_w: f64, signal_w: f64) -> f64 {
        let height = self.relay.altitude_m;
        let squared = power_w / (self.scene.eta * signal_w) - height * height;
        squared.max(0.0).sqrt()
    }

    fn first(&self, signal_w: f64) -> f64 {
        self.outer(self.scene.tx_w, signal_w)
    }

    fn between(&self, signal_w: f64) -> f64 {
        (self.relay.power_w / (self.scene.mu_los * signal_w)).sqrt()
    }

    fn span(&self, signal_w: f64) -> f64 {
        let between = (self.scene.relays.len() - 1) as f64 * self.between(signal_w);
        self.first(signal_w) + between + self.outer(self.relay.power_w, signal_w)
    }
}

/// Returns equally spaced x, m: relay k of N is at k / (N + 1) of the distance from Tx to Rx.
pub fn equal_places(scene: &Scene) -> Vec<f64> {
    let hops = (scene.relays.len() + 1) as f64;
    (1..=scene.relays.len())
        .map(|k| scene.distance_m * k as f64 / hops)
        .collect()
}
