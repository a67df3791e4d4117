//! Random placement: N positions uniform between Tx and Rx, sorted.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use uav_relay_scenario::scene::Scene;

/// Number of draws used in the paper.
pub const DRAWS: u32 = 1000;

/// Statistics over many random chains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mean {
    /// Mean SIR of the worst hop, linear.
    pub sir: f64,
    /// Standard error of the mean SIR, linear.
    pub error: f64,
    /// Mean over the draws of the worst hop's SIR in dB.
    pub db: f64,
    /// Mean of log2(1 + SIR) of the worst hop, bit/s/Hz.
    pub rate: f64,
}

/// Returns the statistics of `draws` (at least 2) random chains from `seed`. Work: `draws` sorted chains, N + 1 SIRs each.
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
