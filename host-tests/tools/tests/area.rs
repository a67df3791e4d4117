//! `cargo plan` for interferers that may be anywhere in an area, and around no-fly areas.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    missing_docs
)]

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

use chacha20::ChaCha8Rng;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::Value;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;
use uav_relay_tools::plan::area;
use uav_relay_tools::plan::{Number, Plan, PlanRequest, plan};

fn variable(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// Random scene. `places` are positions of each interferer: a fine grid of its area, or one point.
struct Drawn {
    scenario: Scenario,
    relays: u16,
    is_free: bool,
    /// Outline of each interferer's area, empty without an area.
    outlines: Vec<Vec<[f64; 2]>>,
    places: Vec<Vec<[f64; 2]>>,
    powers_w: Vec<f64>,
}

/// Returns true if the polygon winds around `at`. Not the method of the planner.
fn winds(outline: &[[f64; 2]], at: [f64; 2]) -> bool {
    let angle = |i: usize| {
        let [x, y] = outline[i % outline.len()];
        (y - at[1]).atan2(x - at[0])
    };
    let total: f64 = (0..outline.len())
        .map(|i| {
            let turn = angle(i + 1) - angle(i);
            turn - TAU * (turn / TAU).round()
        })
        .sum();
    total.abs() > 3.0
}

/// Returns points on the outline and in it.
fn fine_grid(outline: &[[f64; 2]], number: usize) -> Vec<[f64; 2]> {
    let length = |i: usize| {
        let ([a, b], [c, d]) = (outline[i], outline[(i + 1) % outline.len()]);
        (a - c).hypot(b - d)
    };
    let whole: f64 = (0..outline.len()).map(length).sum();
    let mut points = Vec::new();
    for i in 0..outline.len() {
        let steps = (number as f64 * length(i) / whole).ceil() as usize;
        let ([a, b], [c, d]) = (outline[i], outline[(i + 1) % outline.len()]);
        points.extend((0..steps).map(|step| {
            let share = step as f64 / steps as f64;
            [a + share * (c - a), b + share * (d - b)]
        }));
    }
    let [x, y] = [0, 1].map(|axis| {
        let all = outline.iter().map(|at| at[axis]);
        [
            all.clone().fold(f64::INFINITY, f64::min),
            all.fold(f64::NEG_INFINITY, f64::max),
        ]
    });
    for i in 0..20 {
        for j in 0..20 {
            let at = [x, y].map(|[low, high]| (low, high - low));
            let at = [
                at[0].0 + at[0].1 * (f64::from(i) + 0.5) / 20.0,
                at[1].0 + at[1].1 * (f64::from(j) + 0.5) / 20.0,
            ];
            if winds(outline, at) {
                points.push(at);
            }
        }
    }
    points
}

/// Draws an area as TOML, with its outline.
fn area_of(rng: &mut ChaCha8Rng, d: f64, most_m: f64) -> (String, Vec<[f64; 2]>) {
    let (x, y) = (
        rng.random_range(-0.3 * d..1.3 * d),
        rng.random_range(-0.6 * d..0.6 * d),
    );
    let size = rng.random_range(0.03..0.35_f64) * most_m;
    let round = |corners: u32, radius: &mut dyn FnMut() -> f64| -> Vec<[f64; 2]> {
        let corner = |i: u32| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(corners)).sin_cos();
            let radius = radius();
            [x + radius * cos, y + radius * sin]
        };
        (0..corners).map(corner).collect()
    };
    match rng.random_range(0..3) {
        0 => (
            format!("circle = [{x:?}, {y:?}, {size:?}]"),
            round(720, &mut || size),
        ),
        1 => {
            let wide = size * rng.random_range(0.1..1.0);
            let [a, b, c, e] = [x - size, y - wide, x + size, y + wide];
            let text = format!("rectangle = [[{a:?}, {b:?}], [{c:?}, {e:?}]]");
            (text, vec![[a, b], [c, b], [c, e], [a, e]])
        }
        _ => {
            // Seldom convex.
            let corners = rng.random_range(3..9);
            let outline = round(corners, &mut || size * rng.random_range(0.2..1.0));
            (format!("polygon = {outline:?}"), outline)
        }
    }
}

fn draw(seed: u64) -> Drawn {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    loop {
        let rng = &mut rng;
        let d: f64 = rng.random_range(300.0..5000.0);
        let altitude = rng.random_range(20.0..120.0_f64);
        let is_free = rng.random_range(0..3) == 0;
        let relays = rng.random_range(1..=if is_free { 2 } else { 4 });
        let mut text = format!(
            "[geometry]\ndistance_m = {d:?}\naltitude_m = {altitude:?}\nmin_separation_m = 4\n"
        );
        if is_free {
            let most = altitude * rng.random_range(1.0..3.0);
            let side = d * rng.random_range(0.0..0.3);
            _ = writeln!(
                text,
                "altitude_max_m = {most:?}\nlateral_min_m = {:?}\nlateral_max_m = {side:?}",
                -side
            );
        }
        _ = writeln!(
            text,
            "[power]\ntx_w = {:?}\nuav_w = 1",
            rng.random_range(0.5..50.0)
        );
        if rng.random() {
            text += "[noise]\nbandwidth_hz = 1e7\n";
        }
        // The joint method of both directions is one for known interferers.
        if rng.random_range(0..3) == 0 {
            _ = writeln!(text, "[link]\nreverse = {:?}", rng.random_range(0.2..1.0));
        }
        if !is_free && rng.random_range(0..4) == 0 {
            _ = writeln!(
                text,
                "[[relay]]\nindex = 1\naltitude_m = {:?}",
                altitude * 1.5
            );
        }
        let sources = rng.random_range(1..=2);
        let second_is_point = sources == 2 && rng.random();
        let most_m = if sources == 2 && !second_is_point {
            300.0
        } else {
            d.min(2000.0)
        };
        let (mut outlines, mut places, mut powers_w) = (Vec::new(), Vec::new(), Vec::new());
        for source in 0..sources {
            let power = rng.random_range(0.1..50.0_f64);
            powers_w.push(power);
            if source == 1 && second_is_point {
                let at = [rng.random_range(0.0..d), rng.random_range(0.2..0.6) * d];
                _ = writeln!(
                    text,
                    "[[interferer]]\npower_w = {power:?}\nx_m = {:?}\ny_m = {:?}",
                    at[0], at[1]
                );
                outlines.push(Vec::new());
                places.push(vec![at]);
                continue;
            }
            let (area, outline) = area_of(rng, d, most_m);
            _ = writeln!(
                text,
                "[[interferer]]\npower_w = [{:?}, {power:?}]\narea = {{ {area} }}",
                power / 4.0
            );
            places.push(fine_grid(
                &outline,
                if sources == 2 && !second_is_point {
                    60
                } else {
                    800
                },
            ));
            outlines.push(outline);
        }
        match Scenario::parse("drawn.toml", &text) {
            Ok(scenario) => {
                return Drawn {
                    scenario,
                    relays,
                    is_free,
                    outlines,
                    places,
                    powers_w,
                };
            }
            Err(error) => assert!(
                error.to_string().contains("contains a site"),
                "{error}\n{text}"
            ),
        }
    }
}

/// Judge: the SIR of the worst hop for every position of the interferers on the grid, one after the other.
struct Judge<'a> {
    drawn: &'a Drawn,
    scene: Scene,
}

impl Judge<'_> {
    /// Returns the least SIR over all positions of the interferers; each relay is [x, y, h].
    fn worst(&self, chain: &[[f64; 3]]) -> f64 {
        let s = &self.scene;
        let mut nodes = vec![[0.0; 3]];
        nodes.extend(chain);
        nodes.push([s.distance_m, 0.0, 0.0]);
        let last = nodes.len() - 1;
        let is_ground = |node: usize| node == 0 || node == last;
        let squared =
            |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().max(1e-9);
        let power = |node: usize| match node {
            0 => s.tx_w,
            _ if node == last => s.rx_w,
            _ => s.relays[node - 1].power_w,
        };
        let mut signals = Vec::new();
        for hop in 0..last {
            let loss = if is_ground(hop) || is_ground(hop + 1) {
                s.eta
            } else {
                s.mu_los
            };
            let gain = 1.0 / (loss * squared(nodes[hop], nodes[hop + 1]));
            signals.push((hop + 1, power(hop) * gain));
            if s.reverse > 0.0 {
                signals.push((hop, power(hop + 1) * gain / s.reverse));
            }
        }
        // The positions right below the receivers are on the grid, too.
        let grids: Vec<Vec<[f64; 2]>> = self
            .drawn
            .places
            .iter()
            .zip(&self.drawn.outlines)
            .map(|(places, outline)| {
                let below = nodes.iter().map(|at| [at[0], at[1]]);
                let below = below.filter(|at| !outline.is_empty() && winds(outline, *at));
                places.iter().copied().chain(below).collect()
            })
            .collect();
        let received = |source: usize, at: [f64; 2]| -> Vec<f64> {
            signals
                .iter()
                .map(|(node, _)| {
                    let loss = if is_ground(*node) { s.mu_nlos } else { s.eta };
                    self.drawn.powers_w[source]
                        / (loss * squared(nodes[*node], [at[0], at[1], 0.0]))
                })
                .collect()
        };
        let tables: Vec<Vec<Vec<f64>>> = grids
            .iter()
            .enumerate()
            .map(|(source, grid)| grid.iter().map(|at| received(source, *at)).collect())
            .collect();
        let none = vec![vec![0.0; signals.len()]];
        let second = tables.get(1).unwrap_or(&none);
        let mut worst = f64::INFINITY;
        for one in &tables[0] {
            for other in second {
                for (hop, (_, signal)) in signals.iter().enumerate() {
                    worst = worst.min(signal / (one[hop] + other[hop] + s.noise_w));
                }
            }
        }
        worst
    }

    /// Returns the best worst case that differential evolution finds.
    fn best(&self, seed: u64) -> f64 {
        const CROWD: usize = 24;
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let s = &self.scene;
        let n = s.relays.len();
        let mut bounds = vec![[0.0, s.distance_m]; n];
        if self.drawn.is_free {
            bounds.extend(vec![[s.band.left_m, s.band.right_m]; n]);
            bounds.extend(vec![[s.band.least_m, s.band.most_m]; n]);
        }
        let value = |genes: &[f64]| {
            let mut x = genes[..n].to_vec();
            x.sort_by(f64::total_cmp);
            let chain: Vec<[f64; 3]> = (0..n)
                .map(|i| {
                    let free = self.drawn.is_free && !s.relays[i].holds;
                    if free {
                        [x[i], genes[n + i], genes[2 * n + i]]
                    } else {
                        [x[i], 0.0, s.relays[i].altitude_m]
                    }
                })
                .collect();
            let apart = chain.windows(2).all(|pair| {
                (0..3)
                    .map(|i| (pair[0][i] - pair[1][i]).powi(2))
                    .sum::<f64>()
                    .sqrt()
                    >= s.min_separation_m
            });
            if apart { self.worst(&chain) } else { 0.0 }
        };
        let mut crowd: Vec<(f64, Vec<f64>)> = (0..CROWD)
            .map(|_| {
                let genes: Vec<f64> = bounds
                    .iter()
                    .map(|[low, high]| low + (high - low) * rng.random_range(0.0..=1.0))
                    .collect();
                (value(&genes), genes)
            })
            .collect();
        for _ in 0..40 + 25 * bounds.len() {
            for at in 0..CROWD {
                let [a, b, c] = [(); 3].map(|()| rng.random_range(0..CROWD));
                let kept = rng.random_range(0..bounds.len());
                let best = (0..CROWD)
                    .max_by(|a, b| crowd[*a].0.total_cmp(&crowd[*b].0))
                    .unwrap();
                let base = if rng.random_range(0..3) == 0 { best } else { a };
                let genes: Vec<f64> = (0..bounds.len())
                    .map(|gene| {
                        let moved =
                            crowd[base].1[gene] + 0.6 * (crowd[b].1[gene] - crowd[c].1[gene]);
                        let is_new = gene == kept || rng.random_range(0..10) < 9;
                        if is_new {
                            moved.clamp(bounds[gene][0], bounds[gene][1])
                        } else {
                            crowd[at].1[gene]
                        }
                    })
                    .collect();
                let new = value(&genes);
                if new >= crowd[at].0 {
                    crowd[at] = (new, genes);
                }
            }
        }
        crowd.iter().map(|(value, _)| *value).fold(0.0, f64::max)
    }
}

fn ask(relays: u16, free_altitude: bool) -> PlanRequest {
    PlanRequest {
        number: Number::Of(relays),
        free_altitude,
        x_m: None,
        tolerance: 1e-4,
    }
}

fn points(plan: &Plan) -> Vec<[f64; 3]> {
    let each = plan.places.iter();
    each.map(|(at, _)| [at.x_m, at.y_m, at.altitude_m].map(f64::from))
        .collect()
}

#[test]
fn the_worst_case_is_that_of_brute_force() {
    let (first, count) = (variable("SEED", 1), variable("COUNT", 12));
    let (mut ratios, mut gains) = (Vec::new(), Vec::new());
    for seed in first..first + count {
        let drawn = draw(seed);
        let Drawn {
            scenario,
            relays,
            is_free,
            ..
        } = &drawn;
        let judge = Judge {
            drawn: &drawn,
            scene: Scene::new(scenario, *relays).unwrap(),
        };
        let planned = plan(scenario, &ask(*relays, *is_free)).unwrap();
        let judged = judge.worst(&points(&planned));
        // The closed form of the worst case is that of the grid; between its points an interferer may be a little worse.
        let form = planned.sir() / judged;
        assert!((0.99..=1.0 + 1e-5).contains(&form), "seed {seed}: {form}");
        let brute = judge.best(seed);
        let ratio = judged / brute;
        if !(ratio > 0.999) {
            println!(
                "seed {seed}: {ratio} of brute force, {relays} relays, free {is_free}, reverse {}",
                scenario.reverse
            );
        }
        assert!(
            ratio > 0.99,
            "seed {seed}: {ratio} of brute force\n{scenario:?}"
        );
        ratios.push(ratio);
        if let Ok(centre) = plan(&area::at_centre(scenario), &ask(*relays, *is_free)) {
            gains.push(10.0 * (judged / judge.worst(&points(&centre))).log10());
        }
    }
    for (name, values) in [
        ("plan / brute force", &mut ratios),
        ("gain over the middle, dB", &mut gains),
    ] {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
        println!(
            "{name}: worst {:.5}, 10 % {:.5}, median {:.5}, 90 % {:.5}, most {:.5}",
            at(0.0),
            at(0.1),
            at(0.5),
            at(0.9),
            at(1.0)
        );
    }
}

/// Returns the quantile of the worst hop's SIR over positions and powers that the test draws itself.
fn quantile(drawn: &Drawn, plan: &Plan, share: f64) -> f64 {
    let rng = &mut ChaCha8Rng::seed_from_u64(99);
    let mut scene = Scene::new(&drawn.scenario, drawn.relays).unwrap();
    let outline = &drawn.outlines[0];
    let chain: Vec<_> = plan.places.iter().map(|(at, _)| *at).collect();
    scene.areas.clear();
    let spread = outline
        .iter()
        .flatten()
        .fold(0.0_f64, |most, at| most.max(at.abs()));
    let mut sirs = Vec::new();
    while sirs.len() < 3000 {
        let at = [
            rng.random_range(-spread..spread),
            rng.random_range(-spread..spread),
        ];
        if winds(outline, at) {
            (scene.sources[0].x_m, scene.sources[0].y_m) = (at[0], at[1]);
            scene.sources[0].power_w =
                drawn.powers_w[0] * 0.25_f64.powf(rng.random_range(0.0..1.0));
            sirs.push(scene.chain_sir(&chain));
        }
    }
    sirs.sort_by(f64::total_cmp);
    sirs[((1.0 - share) * sirs.len() as f64) as usize]
}

#[test]
fn the_plan_by_a_quantile_has_a_better_quantile() {
    let (first, count) = (variable("SEED", 1), variable("COUNT", 8));
    let (mut better, mut over_centre) = (Vec::new(), Vec::new());
    for seed in first..first + count {
        let drawn = draw(seed);
        if drawn.outlines.len() > 1 {
            continue;
        }
        let request = ask(drawn.relays, drawn.is_free);
        let worst = plan(&drawn.scenario, &request).unwrap();
        let by_quantile = area::plan(&drawn.scenario, &request, Some(0.8)).unwrap();
        assert!(by_quantile.sir() <= worst.sir() * 1.0001, "seed {seed}");
        let own = quantile(&drawn, &by_quantile, 0.8);
        let report =
            area::AreaReport::new(&drawn.scenario, &request, &by_quantile, Some(0.8)).unwrap();
        // 4000 and 3000 draws.
        let error_db = report.plan.quantile_sir_db - 10.0 * own.log10();
        assert!(error_db.abs() < 0.5, "seed {seed}: {error_db}");
        better.push(10.0 * (own / quantile(&drawn, &worst, 0.8)).log10());
        let centre = plan(&area::at_centre(&drawn.scenario), &request).unwrap();
        over_centre.push(10.0 * (own / quantile(&drawn, &centre, 0.8)).log10());
    }
    println!("gain over the worst-case plan {better:.2?} dB, over the middle {over_centre:.2?} dB");
    // The draws of the test are others.
    assert!(better.iter().chain(&over_centre).all(|gain| *gain > -0.2));
    assert!(better.iter().any(|gain| *gain > 0.1), "{better:?}");
}
