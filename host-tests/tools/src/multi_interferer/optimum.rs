//! The best chain against the true sum of the interference, for relays at one fixed altitude.

use super::line::Line;
use super::spans::Span;
use super::stages::Stages;
use uav_relay_scenario::scene::Scene;

/// Relative bracket width at which the bisection of the target ends.
const TOLERANCE: f64 = 1e-13;

const LEAST_TARGET: f64 = 1e-250;

/// Relative rounding allowance on the least separation. A thousand relays that just fit are accepted.
const ROUNDING: f64 = 1e-12;

/// A chain and its SIR.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Positions from Tx to Rx, (x, h) in metres. x in [0, D], rising by at least the least separation (less 1e-12 of it, for
    /// rounding).
    pub places: Vec<(f64, f64)>,
    /// SIR (linear) of the worst hop, by [`Scene::hop_sirs`].
    pub sir: f64,
    /// SIR of the best chain without a least separation; equals `sir` where the separation does not bind.
    pub free_sir: f64,
}

impl Chain {
    /// Returns true if the least separation, which the chain keeps, costs more than a millionth of the SIR.
    pub fn separation_binds(&self) -> bool {
        self.sir < self.free_sir * (1.0 - 1e-6)
    }
}

/// Returns the best chain of relays at one common altitude, with any powers; exact except for rounding.
///
/// Tested to 1e-9 against the reference for one interferer and to 1e-6 against brute force for several
/// (`of_one_source_it_is_the_optimum_of_the_reference`, `brute_force_finds_the_same` in `host-tests/tests/several`).
///
/// If the least separation binds, the SIR is the best of the chains that keep it. Without one, relays may share a position when
/// another hop is the bottleneck. `None` without relays or interferers, if altitudes differ, if the relays do not fit on the
/// line, and if no chain has an SIR above zero (an interferer at Rx).
///
/// Work: about 50 targets, twice with a least separation. For each target: some thousand points of the line per change of power
/// along the chain, and a few intervals per relay.
pub fn optimum(scene: &Scene) -> Option<Chain> {
    let altitude_m = scene.relays.first()?.altitude_m;
    let same = |other: f64| other.total_cmp(&altitude_m).is_eq();
    let alike = scene.relays.iter().all(|relay| same(relay.altitude_m));
    alike.then(|| at_altitude(scene, altitude_m)).flatten()
}

/// Returns the best chain at `altitude_m`, m, > 0, whatever the altitudes in the scene.
pub(super) fn at_altitude(scene: &Scene, altitude_m: f64) -> Option<Chain> {
    let line = Line::new(scene, altitude_m);
    let apart = scene.min_separation_m * (1.0 - ROUNDING);
    let target = best_target(&line, apart, TOLERANCE)?;
    let xs = Stages::new(&line, target, apart)?.chain()?;
    let places: Vec<(f64, f64)> = xs.into_iter().map(|x| (x, altitude_m)).collect();
    let sir = scene.chain_sir(&places);
    let free_sir = if apart > 0.0 {
        best_target(&line, 0.0, TOLERANCE)?.max(sir)
    } else {
        sir
    };
    Some(Chain {
        places,
        sir,
        free_sir,
    })
}

/// Returns the best target (linear) with the least separation, to a relative `tolerance`. `None` as for [`optimum`].
pub(super) fn best_at_altitude(scene: &Scene, altitude_m: f64, tolerance: f64) -> Option<f64> {
    let apart = scene.min_separation_m * (1.0 - ROUNDING);
    best_target(&Line::new(scene, altitude_m), apart, tolerance)
}

fn best_target(line: &Line, apart: f64, tolerance: f64) -> Option<f64> {
    let scene = line.scene;
    let gaps = scene.relays.len().checked_sub(1)? as f64;
    if scene.sources.is_empty() || gaps * apart > scene.distance_m {
        return None;
    }
    let met = |target: f64| Stages::new(line, target, apart).is_some_and(|found| found.is_met());
    // No chain is better than its first hop.
    let whole = Span {
        low: 0.0,
        high: scene.distance_m,
    };
    let mut above = 2.0 * line.first_sir(line.best_first(&[whole])?);
    let mut below = above / 16.0;
    while !met(below) {
        (above, below) = (below, below / 16.0);
        if below < LEAST_TARGET {
            return None;
        }
    }
    while above - below > tolerance * below {
        // Geometric mean, because the targets span many decades.
        let middle = below * (above / below).sqrt();
        if met(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    Some(below)
}
