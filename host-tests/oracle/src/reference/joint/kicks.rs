//! Random perturbations of a good chain, to reach neighbouring local optima.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::draws::place;
use super::scene::Scene;
use super::space::{Across, Triple};
use crate::random::log_uniform;

/// Returns a randomly perturbed chain; order, separation and rooms are not yet restored.
pub(super) fn kicked(scene: &Scene, chain: &[Triple], rng: &mut ChaCha8Rng) -> Vec<Triple> {
    match rng.random_range(0..8) {
        0..4 => reinserted(chain, rng),
        4 | 5 => shaken(scene, chain, rng),
        6 => mirrored(scene, chain, rng),
        _ => pulled(scene, chain, rng),
    }
}

fn row(chain: &[Triple], rng: &mut ChaCha8Rng) -> std::ops::RangeInclusive<usize> {
    let (one, other) = (
        rng.random_range(0..chain.len()),
        rng.random_range(0..chain.len()),
    );
    one.min(other)..=one.max(other)
}

fn reinserted(chain: &[Triple], rng: &mut ChaCha8Rng) -> Vec<Triple> {
    let mut chain = chain.to_vec();
    for _ in 0..rng.random_range(1..=3) {
        let taken = rng.random_range(0..chain.len());
        chain.remove(taken);
        let to = rng.random_range(0..=chain.len());
        let before = to.checked_sub(1).and_then(|i| chain.get(i)).copied();
        let after = chain.get(to).copied();
        let middle = match (before, after) {
            (Some(before), Some(after)) => (before + after) * 0.5,
            (Some(before), None) => Triple::at(before.x.midpoint(1.0), before.across()),
            (None, Some(after)) => Triple::at(0.5 * after.x, after.across()),
            (None, None) => Triple::at(rng.random(), Across::default()),
        };
        chain.insert(to, middle);
    }
    chain
}

/// Moves a range of relays at random, each on its own or all together.
fn shaken(scene: &Scene, chain: &[Triple], rng: &mut ChaCha8Rng) -> Vec<Triple> {
    let mut chain = chain.to_vec();
    let row = row(&chain, rng);
    let size = log_uniform(rng, 0.01, 1.0);
    let width = scene.corridor.width();
    let reach = Triple::new(1.0 / (chain.len() as f64 + 1.0), width.y, width.h) * size;
    let mut draw = || {
        let mut part = || rng.random_range(-1.0..=1.0);
        reach.times(Triple::new(part(), part(), part()))
    };
    let together = draw();
    let is_together = draw().x > 0.0;
    for (_, place) in chain
        .iter_mut()
        .enumerate()
        .filter(|(k, _)| row.contains(k))
    {
        *place = *place + if is_together { together } else { draw() };
    }
    chain
}

fn mirrored(scene: &Scene, chain: &[Triple], rng: &mut ChaCha8Rng) -> Vec<Triple> {
    let mut chain = chain.to_vec();
    let row = row(&chain, rng);
    for (_, place) in chain
        .iter_mut()
        .enumerate()
        .filter(|(k, _)| row.contains(k))
    {
        place.y = 2.0 * scene.interferer.y - place.y;
    }
    chain
}

/// Pulls all relays toward one cross-section position, most strongly near some position along Tx-Rx.
fn pulled(scene: &Scene, chain: &[Triple], rng: &mut ChaCha8Rng) -> Vec<Triple> {
    let to = place(&scene.corridor, rng);
    let (centre, breadth): (f64, f64) = (rng.random(), log_uniform(rng, 0.03, 1.0));
    let strength: f64 = rng.random();
    let pull = |at: &Triple| {
        let part = strength * (-((at.x - centre) / breadth).powi(2)).exp();
        let across = Across::new(at.y + part * (to.y - at.y), at.h + part * (to.h - at.h));
        Triple::at(at.x, across)
    };
    chain.iter().map(pull).collect()
}
