//! The best common altitude of a chain.

use super::optimum::{Chain, at_altitude, best_at_altitude};
use uav_relay_scenario::scene::Scene;

/// Number of scanned altitudes with equal spacing; as many again have equal ratios.
const SCANNED: u32 = 24;

const TOPS: usize = 3;

/// Golden-section steps per refined maximum. The interval shrinks by about 5e-6, the loss in SIR by its square.
const STEPS: u32 = 25;

const TOLERANCE: f64 = 1e-11;

/// Returns the best chain whose relays share one altitude of the band. Never worse than at either end of the band.
///
/// Scans the band and refines the three highest maxima; a narrower maximum between scanned altitudes may be missed. `None` as for
/// [`optimum`](super::optimum()), if a relay has a fixed altitude of its own, and for an empty band. Work: about 120 optima.
pub fn best_common_altitude(scene: &Scene) -> Option<Chain> {
    let band = scene.band;
    if scene.relays.iter().any(|relay| relay.holds) || !(band.least_m <= band.most_m) {
        return None;
    }
    let reached = |h: f64| best_at_altitude(scene, h, TOLERANCE).unwrap_or(0.0);
    let scanned: Vec<(f64, f64)> = altitudes(band.least_m, band.most_m)
        .into_iter()
        .map(|h| (h, reached(h)))
        .collect();
    let mut tops: Vec<(f64, f64, f64)> = Vec::new();
    for (at, &(h, sir)) in scanned.iter().enumerate() {
        let left = at.checked_sub(1).and_then(|at| scanned.get(at));
        let right = scanned.get(at + 1);
        let is_top = [left, right]
            .into_iter()
            .flatten()
            .all(|side| side.1 <= sir);
        if is_top {
            let end = |side: Option<&(f64, f64)>| side.map_or(h, |side| side.0);
            tops.push((sir, end(left), end(right)));
        }
    }
    tops.sort_by(|a, b| b.0.total_cmp(&a.0));
    let refined = tops
        .iter()
        .take(TOPS)
        .map(|&(_, low, high)| golden(low, high, STEPS, reached));
    let best = scanned
        .iter()
        .copied()
        .chain(refined)
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    at_altitude(scene, best.0)
}

/// Returns the altitudes of the scan in rising order; a single one if the band is a point.
fn altitudes(least: f64, most: f64) -> Vec<f64> {
    let shares = (0..=SCANNED).map(|i| f64::from(i) / f64::from(SCANNED));
    let mut altitudes: Vec<f64> = shares
        .flat_map(|share| {
            [
                least + share * (most - least),
                least * (most / least).powf(share),
            ]
        })
        .map(|h| h.clamp(least, most))
        .collect();
    altitudes.sort_by(f64::total_cmp);
    altitudes.dedup();
    altitudes
}

/// Returns the best argument of a golden-section search on [`low`, `high`], and the value there.
pub(super) fn golden(
    mut low: f64,
    mut high: f64,
    steps: u32,
    f: impl Fn(f64) -> f64,
) -> (f64, f64) {
    let ratio = (5_f64.sqrt() - 1.0) / 2.0;
    let at = |x: f64| (x, f(x));
    let (mut a, mut b) = (
        at(high - ratio * (high - low)),
        at(low + ratio * (high - low)),
    );
    for _ in 0..steps {
        if a.1 < b.1 {
            (low, a) = (a.0, b);
            b = at(low + ratio * (high - low));
        } else {
            (high, b) = (b.0, a);
            a = at(high - ratio * (high - low));
        }
    }
    if a.1 < b.1 { b } else { a }
}
