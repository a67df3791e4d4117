//! Best chain by dynamic programming over successively refined grids, without the crate's formulas.

use uav_relay_scenario::scene::Scene;

/// Number of grid cells along the line in the first search.
const CELLS: u32 = 600;

/// Number of segments of the line from Tx to Rx. For each segment, the best chain with relay 1 in this segment is a candidate.
const PARTS: f64 = 16.0;

/// Number of the best candidates that are refined.
const CANDIDATES: usize = 4;

/// Number of grid positions of each relay in a refinement, on either side of its present position.
const BESIDE: i32 = 40;

/// Half width of the first refinement's grid around a relay. It is a fraction of the distance from Tx to Rx.
const WINDOW: f64 = 0.06;

/// Number of refinements of a candidate chain, each with a narrower grid.
const REFINEMENTS: u32 = 32;

/// Ratio of the grid widths of two successive refinements.
const SHRINK: f64 = 0.6;

/// SIR of a chain's worst hop, and the x of its relays, m.
type BestChain = (f64, Vec<f64>);

/// Returns the SIR of the best chain at altitude `h`; 0 if no chain on the grid keeps the separation.
pub(crate) fn best(scene: &Scene, h: f64) -> f64 {
    let d = scene.distance_m;
    let mut grid: Vec<f64> = (0..=CELLS)
        .map(|i| d * f64::from(i) / f64::from(CELLS))
        .collect();
    for source in &scene.sources {
        for i in -10..=10 {
            grid.push(source.x_m + 0.25 * f64::from(i) * source.y_m.hypot(h));
        }
    }
    grid.retain(|x| (0.0..=d).contains(x));
    grid.sort_by(f64::total_cmp);
    let starts = on(scene, h, &vec![grid; scene.relays.len()], PARTS);
    let refined = starts.into_iter().take(CANDIDATES).map(|start| {
        let mut found = start;
        let mut cell = WINDOW * d / f64::from(BESIDE);
        for _ in 0..REFINEMENTS {
            let around = |&x: &f64| -> Vec<f64> {
                let places = (-BESIDE..=BESIDE).map(|i| x + cell * f64::from(i));
                places.map(|x| x.clamp(0.0, d)).collect()
            };
            let grids: Vec<Vec<f64>> = found.1.iter().map(around).collect();
            let next = on(scene, h, &grids, 1.0).swap_remove(0);
            if next.0 >= found.0 {
                found = next;
            }
            cell *= SHRINK;
        }
        found.0
    });
    refined.fold(0.0, f64::max)
}

/// Returns the best chains with relay k at a point of `grids[k - 1]`, best first. There is one chain for each of
/// `parts` segments that relay 1 can be in.
fn on(scene: &Scene, h: f64, grids: &[Vec<f64>], parts: f64) -> Vec<BestChain> {
    let d = scene.distance_m;
    let (mut worth, mut ways) = (at_last(scene, h, &grids[grids.len() - 1]), Vec::new());
    for k in (1..grids.len()).rev() {
        let noises: Vec<f64> = grids[k]
            .iter()
            .map(|&x| noise(scene, x, h, scene.eta))
            .collect();
        let power = scene.relays[k - 1].power_w / scene.mu_los;
        let way = |&from: &f64| -> (f64, usize) {
            let mut best = (0.0, 0);
            for (j, &to) in grids[k].iter().enumerate() {
                if to >= from && to - from >= scene.min_separation_m * (1.0 - 1e-12) {
                    let sir = (power / (to - from).powi(2) / noises[j]).min(worth[j]);
                    if sir > best.0 {
                        best = (sir, j);
                    }
                }
            }
            best
        };
        let (next, chosen): (_, Vec<usize>) = grids[k - 1].iter().map(way).unzip();
        worth = next;
        ways.push(chosen);
    }
    let mut firsts: Vec<(f64, usize)> = (0..worth.len())
        .map(|i| {
            let x = grids[0][i];
            let signal = scene.tx_w / scene.eta / (x.powi(2) + h.powi(2));
            (worth[i].min(signal / noise(scene, x, h, scene.eta)), i)
        })
        .collect();
    firsts.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut seen = Vec::new();
    firsts.retain(|&(_, i)| {
        let part = (grids[0][i] / d * parts).floor();
        let fresh = parts > 1.0 && !seen.contains(&part);
        seen.push(part);
        fresh || seen.len() == 1
    });
    let chain = |&(sir, first): &(f64, usize)| {
        let mut at = first;
        let mut places = vec![grids[0][at]];
        for (grid, way) in grids[1..].iter().zip(ways.iter().rev()) {
            at = way[at];
            places.push(grid[at]);
        }
        (sir, places)
    };
    firsts.iter().map(chain).collect()
}

/// Returns the SIR at Rx for each position of the last relay.
fn at_last(scene: &Scene, h: f64, places: &[f64]) -> Vec<f64> {
    let d = scene.distance_m;
    let power = scene.relays[scene.relays.len() - 1].power_w / scene.eta;
    let noise = noise(scene, d, 0.0, scene.mu_nlos);
    let sir = |x: &f64| power / ((d - x).powi(2) + h.powi(2)) / noise;
    places.iter().map(sir).collect()
}

/// Returns the interference power at (x, h), W, received with the path-loss factor `factor`.
fn noise(scene: &Scene, x: f64, h: f64, factor: f64) -> f64 {
    let each = scene.sources.iter().map(|s| {
        let square = (x - s.x_m).powi(2) + s.y_m.powi(2) + h.powi(2);
        s.power_w / factor / square
    });
    each.sum()
}
