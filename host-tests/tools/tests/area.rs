//! `cargo plan` for interferers that may be anywhere in an area, and around no-fly areas.
#![cfg(test)]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::too_many_lines
)]

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use chacha20::ChaCha8Rng;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::Value;
use uav_relay::Placement;
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Scenario, Source};
use uav_relay_tools::plan::area;
use uav_relay_tools::plan::locating::error_m;
use uav_relay_tools::plan::{Plan, PlanRequest, plan};

fn variable(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap())
}

/// Random scene. `places` has the positions to check for each interferer: a fine grid of its area, or one point.
struct Drawn {
    scenario: Scenario,
    relays: u16,
    is_free: bool,
    /// Outline of each interferer's area; empty without an area.
    outlines: Vec<Vec<[f64; 2]>>,
    places: Vec<Vec<[f64; 2]>>,
    powers_w: Vec<f64>,
}

/// Returns the point on the polygon's edges nearest to `at`; `None` without edges.
fn nearest_on(outline: &[[f64; 2]], at: [f64; 2]) -> Option<[f64; 2]> {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let on_edge = edges.map(|([ax, ay], [bx, by])| {
        let (along, up) = (bx - ax, by - ay);
        let part = ((at[0] - ax) * along + (at[1] - ay) * up) / (along * along + up * up);
        let part = part.clamp(0.0, 1.0);
        [ax + part * along, ay + part * up]
    });
    let far = |on: &[f64; 2]| (on[0] - at[0]).hypot(on[1] - at[1]);
    on_edge.min_by(|a, b| far(a).total_cmp(&far(b)))
}

/// Returns true if the polygon contains `at`. It uses the winding number, unlike the planner.
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

/// Returns about `number` points on the outline, and points inside it.
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
    let side = if number < 100 { 5 } else { 20 };
    for i in 0..side {
        for j in 0..side {
            let at = [x, y].map(|[low, high]| (low, high - low));
            let at = [
                at[0].0 + at[0].1 * (f64::from(i) + 0.5) / f64::from(side),
                at[1].0 + at[1].1 * (f64::from(j) + 0.5) / f64::from(side),
            ];
            if winds(outline, at) {
                points.push(at);
            }
        }
    }
    points
}

/// Draws an area. Returns it as TOML, and its outline.
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
            // The polygon is seldom convex.
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

/// Independent check: the SIR of the worst hop for all positions of the interferers on a grid.
struct Judge<'a> {
    drawn: &'a Drawn,
    scene: Scene,
}

impl Judge<'_> {
    /// Returns the least SIR over all positions of the interferers. Each relay is [x, y, h].
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
        // The grid includes the positions right below the receivers, and the outline's points nearest to them.
        let grids: Vec<Vec<[f64; 2]>> = self
            .drawn
            .places
            .iter()
            .zip(&self.drawn.outlines)
            .map(|(places, outline)| {
                let nodes = nodes.iter().map(|at| [at[0], at[1]]);
                let below = nodes
                    .clone()
                    .filter(|at| !outline.is_empty() && winds(outline, *at));
                let beside = nodes.filter_map(|at| nearest_on(outline, at));
                places.iter().copied().chain(below).chain(beside).collect()
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

    /// Maximises the worst-case SIR by differential evolution. Returns the largest value that it finds.
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
    PlanRequest::of(relays, free_altitude, 1e-4)
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
        // The planner's worst case equals the grid's. Between grid points an interferer may be a little worse.
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

/// Returns the SIR that the worst hop has at least in the fraction `share` of random cases.
///
/// A case is a position and a power of the interferer, drawn by this function.
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
        let by = area::Criterion {
            quantile: Some(0.8),
            allow_crossing: false,
        };
        let worst = plan(&drawn.scenario, &request).unwrap();
        let by_quantile = area::plan(&drawn.scenario, &request, by).unwrap();
        // The worst-case search is within 1 % of the optimum.
        assert!(by_quantile.sir() <= worst.sir() * 1.01, "seed {seed}");
        let own = quantile(&drawn, &by_quantile, 0.8);
        let report =
            area::AreaReport::new(&drawn.scenario, &request, &by_quantile, Some(0.8)).unwrap();
        // The planner has 4000 draws, and this test 3000.
        let error_db = report.plan.quantile_sir_db - 10.0 * own.log10();
        assert!(error_db.abs() < 0.5, "seed {seed}: {error_db}");
        better.push(10.0 * (own / quantile(&drawn, &worst, 0.8)).log10());
        let centre = plan(&area::at_centre(&drawn.scenario), &request).unwrap();
        over_centre.push(10.0 * (own / quantile(&drawn, &centre, 0.8)).log10());
    }
    println!("gain over the worst-case plan {better:.2?} dB, over the middle {over_centre:.2?} dB");
    // The draws of this test differ from those of the planner.
    assert!(better.iter().chain(&over_centre).all(|gain| *gain > -0.2));
    assert!(
        count < 8 || better.iter().any(|gain| *gain > 0.1),
        "{better:?}"
    );
}

/// Runs a program; returns its exit status, its output and its errors.
fn run(program: &str, folder: &Path, args: &str) -> (Option<i32>, String, String) {
    let mut command = Command::new(program);
    command.current_dir(folder).args(args.split_whitespace());
    let out = command.output().unwrap();
    let [text, errors] = [out.stdout, out.stderr].map(|it| String::from_utf8(it).unwrap());
    (out.status.code(), text, errors)
}

fn cargo_plan(folder: &Path, args: &str) -> (Option<i32>, String, String) {
    run(env!("CARGO_BIN_EXE_plan"), folder, args)
}

/// Runs `cargo plan --json`; returns its exit status and its report.
fn json(folder: &Path, args: &str) -> (i32, Value) {
    let (status, text, errors) = cargo_plan(folder, &format!("{args} --json"));
    let report = serde_json::from_str(&text);
    let report = report.unwrap_or_else(|error| panic!("{error}: {text}{errors}"));
    (status.unwrap(), report)
}

const AREA: &str = "[geometry]\naltitude_m = 60\naltitude_max_m = 100\nmin_separation_m = 4\n\
    [site]\ntx = { lat_deg = 47.20, lon_deg = 8.51, amsl_m = 482 }\nrx = { lat_deg = 47.20, lon_deg = 8.536, amsl_m = 482 }\n\
    [power]\ntx_w = 5\nuav_w = 1\n[[interferer]]\npower_dbm = [20, 30]\narea = { circle = [1300, 700, 300] }\n";

const FLAT: &str = "[geometry]\ndistance_m = 2000\naltitude_m = 60\n[power]\ntx_w = 5\nuav_w = 1\n\
    [[interferer]]\npower_w = 1\nx_m = 1300\ny_m = 700\n";

/// Runs `cargo provision` for all three relays of `file`. Returns true if it succeeds, and its errors.
fn provision(folder: &Path, file: &str) -> (bool, String) {
    let options = format!("--scenario {file} --uavs 3 --all --out-dir blocks");
    let (status, _, errors) = run(env!("CARGO_BIN_EXE_provision"), folder, &options);
    (status == Some(0), errors)
}

#[test]
fn the_command_reports_the_area_and_draws_its_map() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("area.toml"), AREA).unwrap();
    let base = "--scenario area.toml --uavs 3";
    let files = "--area-svg map.svg --area-geojson map.geojson --geojson plan.geojson";
    let (status, report) = json(folder, &format!("{base} {files}"));
    assert_eq!(status, 0, "{report}");
    let [area, sir_db] = ["area", "sir_db"].map(|key| report[key].clone());
    assert_eq!(area["criterion"], "worst");
    assert!(report["proven"].as_bool().unwrap());
    let number = |value: &Value| value.as_f64().unwrap();
    assert!((number(&area["worst_sir_db"]) - number(&sir_db)).abs() < 1e-6);
    assert!(number(&area["worst_sir_db"]) <= number(&area["quantile_sir_db"]));
    assert!(number(&area["centre"]["worst_sir_db"]) < number(&area["worst_sir_db"]) - 0.1);
    // The lowest SIR on the map is the worst case, apart from the size of a cell.
    let cells: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("map.geojson")).unwrap())
            .unwrap();
    let cells = cells["features"].as_array().unwrap();
    assert!(cells.len() > 2000, "{}", cells.len());
    let sirs = || {
        cells
            .iter()
            .map(|cell| number(&cell["properties"]["sir_db"]))
    };
    let least = sirs().fold(f64::INFINITY, f64::min);
    assert!((least - number(&sir_db)).abs() < 0.15, "{least} {sir_db}");
    assert!(sirs().fold(0.0, f64::max) > least + 1.0);
    // The circle is south of the line, which runs east: y is to the right.
    assert!(
        cells
            .iter()
            .all(|cell| number(&cell["geometry"]["coordinates"][0][0][1]) < 47.2)
    );
    let svg = std::fs::read_to_string(folder.join("map.svg")).unwrap();
    let svg = roxmltree::Document::parse(&svg).unwrap();
    assert!(
        svg.descendants()
            .filter(|node| node.has_tag_name("rect"))
            .count()
            > cells.len()
    );
    // With a quantile, the criterion is not the worst case.
    let (_, by_quantile) = json(folder, &format!("{base} --quantile 0.8"));
    assert_eq!(by_quantile["area"]["criterion"], "quantile");
    assert!(number(&by_quantile["area"]["worst_sir_db"]) <= number(&area["worst_sir_db"]) + 1e-6);
    // The target is met even at the worst position.
    let (status, fewest) = json(folder, "--scenario area.toml --target-sir-db 9");
    assert_eq!(status, 0);
    assert!(number(&fewest["area"]["worst_sir_db"]) >= 9.0, "{fewest}");
    for (args, part) in [
        ("--out plan.toml", "cannot be used with --out"),
        ("--bandwidth-hz 1e6", "has no data rates"),
        ("--quantile 0.3", "0.5 to 0.99"),
        ("--x-m 3", "--x-m"),
    ] {
        let (status, _, line) = cargo_plan(folder, &format!("{base} {args}"));
        assert!(status == Some(2) && line.contains(part), "{line}");
    }
    // Relays know a single position, so other tools reject the file and name the area.
    let (succeeds, line) = provision(folder, "area.toml");
    assert!(
        !succeeds && line.contains("interferer[0].area") && line.contains("1300.0"),
        "{line}"
    );
}

/// Checks the planner's standard deviation of a located interferer against least-squares fits.
///
/// The scatter of fits to random measurements must differ from this standard deviation by less than 15 %.
#[test]
fn the_error_of_the_location_is_that_of_fits() {
    let rng = &mut ChaCha8Rng::seed_from_u64(7);
    let mut gauss = {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        move || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>()
    };
    for case in 0..variable("COUNT", 12) {
        let place = |rng: &mut ChaCha8Rng| Place {
            x: rng.random_range(0.0..2000.0),
            y: rng.random_range(-30.0..30.0) * f64::from(u32::from(case % 2 == 0)),
            h: rng.random_range(20.0..120.0),
        };
        let places: Vec<Place> = (0..8).map(|_| place(rng)).collect();
        let mut scenario = Scenario {
            distance_m: 2000.0,
            ..Scenario::default()
        };
        let truth = [
            rng.random_range(0.1..10.0_f64).ln(),
            rng.random_range(200.0..1800.0),
            rng.random_range(300.0..700.0),
        ];
        let source = Source {
            power_w: truth[0].exp(),
            x_m: truth[1],
            y_m: truth[2],
        };
        scenario.interference = Interference::Sources(vec![source]);
        scenario.noise.power_dbm = (case % 3 == 0).then_some(-60.0);
        let scene = Scene::new(&scenario, 2).unwrap();
        let (relative, runs) = (0.003, 400);
        let bound = error_m(&scene, &places, relative);
        let ln = |[p, x, y]: [f64; 3], at: &Place| {
            p - ((at.x - x).powi(2) + (at.y - y).powi(2) + at.h.powi(2)).ln()
        };
        let mut squares = 0.0;
        for _ in 0..runs {
            let errors: Vec<f64> = places
                .iter()
                .map(|at| relative * (1.0 + scene.noise_w / scene.interference_w(*at)))
                .collect();
            let heard: Vec<f64> = places
                .iter()
                .zip(&errors)
                .map(|(at, error)| ln(truth, at) + error * gauss())
                .collect();
            let cost = |of: [f64; 3]| -> f64 {
                let each = places.iter().zip(&heard).zip(&errors);
                each.map(|((at, heard), error)| ((heard - ln(of, at)) / error).powi(2))
                    .sum()
            };
            // Gauss-Newton steps, with slopes from differences.
            let mut fit = truth;
            for _ in 0..8 {
                let step = [1e-4, 1e-2, 1e-2];
                let with = |axis: usize, sign: f64| {
                    let mut of = fit;
                    of[axis] += sign * step[axis];
                    of
                };
                let (mut normal, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
                for ((at, heard), error) in places.iter().zip(&heard).zip(&errors) {
                    let slope = [0, 1, 2].map(|axis| {
                        (ln(with(axis, 1.0), at) - ln(with(axis, -1.0), at))
                            / (2.0 * step[axis] * error)
                    });
                    let off = (heard - ln(fit, at)) / error;
                    for i in 0..3 {
                        right[i] += slope[i] * off;
                        for j in 0..3 {
                            normal[i][j] += slope[i] * slope[j];
                        }
                    }
                }
                // Gaussian elimination.
                for i in 0..3 {
                    for j in i + 1..3 {
                        let share = normal[j][i] / normal[i][i];
                        let row = normal[i];
                        for (below, above) in normal[j].iter_mut().zip(row) {
                            *below -= share * above;
                        }
                        right[j] -= share * right[i];
                    }
                }
                let mut change = [0.0; 3];
                for i in (0..3).rev() {
                    let known: f64 = (i + 1..3).map(|k| normal[i][k] * change[k]).sum();
                    change[i] = (right[i] - known) / normal[i][i];
                }
                fit = [0, 1, 2].map(|axis| fit[axis] + change[axis]);
            }
            assert!(cost(fit) <= cost(truth) + 1e-6);
            squares += (fit[1] - truth[1]).powi(2) + (fit[2] - truth[2]).powi(2);
        }
        let scatter = (squares / f64::from(runs)).sqrt();
        println!("case {case}: bound {bound:.3} m, scatter {scatter:.3} m");
        assert!(
            (scatter / bound - 1.0).abs() < 0.15,
            "case {case}: {bound} {scatter}"
        );
    }
}

/// Checks the planner's report and map about where relays can locate an interferer.
///
/// Simulated searches must locate it with less than three times the reported error.
#[test]
fn the_command_says_from_where_relays_locate_the_interferer() {
    let folder = tempfile::tempdir().unwrap();
    let text = "[geometry]\ndistance_m = 1000\naltitude_m = 20\nmin_separation_m = 4\n[power]\ntx_w = 80\nuav_w = 1\n[listen]\nrelative_error = 0.03\n\
                [[interferer]]\npower_w = [40.0, 80.0]\narea = { rectangle = [[200.0, 150.0], [900.0, 700.0]] }\n";
    std::fs::write(folder.path().join("listen.toml"), text).unwrap();
    let args = "--scenario listen.toml --uavs 6 --listen-svg error.svg";
    let (status, report) = json(folder.path(), args);
    assert_eq!(status, 0, "{report}");
    let locating = &report["locating"];
    println!("{locating:#}");
    let number = |of: &Value, key: &str| of[key].as_f64();
    assert!(
        number(locating, "located").unwrap() > 0.2 && number(locating, "located").unwrap() <= 1.0
    );
    assert!(number(locating, "worst_error_m") >= number(locating, "error_m"));
    let searches = locating["searches"].as_array().unwrap();
    assert_eq!(searches.len(), 5);
    for one in searches {
        let (estimate, placed) = (
            number(one, "estimate_s").unwrap(),
            number(one, "placed_s").unwrap(),
        );
        assert!(estimate > 1.0 && placed < 280.0, "{one}");
        // The reported error is for one measurement at each position. The relays measure many times.
        assert!(
            number(one, "off_m").unwrap() < 3.0 * number(one, "error_m").unwrap(),
            "{one}"
        );
    }
    let svg = std::fs::read_to_string(folder.path().join("error.svg")).unwrap();
    roxmltree::Document::parse(&svg).unwrap();
    assert!(
        svg.contains("Error of the relays' estimate of the interferer's position ([listen]) with the interferer at each position, "),
        "{svg}"
    );
    let (_, table, _) = cargo_plan(folder.path(), "--scenario listen.toml --uavs 6");
    assert!(
        table.contains("listening: in 100.0 % of the area the relays would locate the interferer")
            && table
                .matches("simulated with the interferer at x = ")
                .count()
                == 5,
        "{table}"
    );
    // The measurements do not determine the location of so far an interferer. JSON has no infinite numbers.
    let far = text.replace(
        "rectangle = [[200.0, 150.0], [900.0, 700.0]]",
        "circle = [500, 2e6, 300]",
    );
    std::fs::write(folder.path().join("far.toml"), far).unwrap();
    let far = "--scenario far.toml --uavs 3";
    let (_, report) = json(folder.path(), far);
    let locating = &report["locating"];
    assert!(
        locating["located"] == 0.0 && !locating.to_string().contains("null"),
        "{locating}"
    );
    for key in ["error_m", "worst_error_m"] {
        assert!(locating.get(key).is_none(), "{locating}");
    }
    let (_, table, _) = cargo_plan(folder.path(), far);
    let part = "standard deviation of the located position: median not limited, largest not limited at x = ";
    assert!(table.contains(part), "{table}");
    std::fs::write(
        folder.path().join("deaf.toml"),
        text.replace("[listen]\nrelative_error = 0.03\n", ""),
    )
    .unwrap();
    let deaf = "--scenario deaf.toml --uavs 6 --listen-svg error.svg";
    let (status, _, line) = cargo_plan(folder.path(), deaf);
    let part = "--listen-svg error.svg: needs [listen]";
    assert!(status == Some(2) && line.contains(part), "{line}");
}

#[test]
fn no_relay_is_planned_in_a_no_fly_area() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let base = "--scenario flight.toml --uavs 3";
    let write = |zone: &str| {
        let text = format!("{FLAT}[[no_fly]]\n{zone}\n");
        std::fs::write(folder.join("flight.toml"), text).unwrap();
    };
    std::fs::write(folder.join("flight.toml"), FLAT).unwrap();
    let (_, free) = json(folder, base);
    let x = |report: &Value, relay: usize| report["relays"][relay]["x_m"].as_f64().unwrap();
    let (own, best) = (x(&free, 1), free["sir"].as_f64().unwrap());
    // An area far away, or above the relays, changes nothing.
    for zone in [
        "area = { circle = [1000, 500, 300] }".to_owned(),
        format!("area = {{ circle = [{own}, 0, 50] }}\nlowest_m = 61"),
    ] {
        write(&zone);
        assert_eq!(json(folder, base), (0, free.clone()), "{zone}");
    }
    // Relay 2 moves along the line out of the area. The area is then between two neighbours.
    let zone = format!(
        "area = {{ rectangle = [[{}, -30], [{}, 40]] }}",
        own - 60.0,
        own + 50.0
    );
    write(&zone);
    let (status, one_side) = json(folder, base);
    // No path crosses the area if all relays are on one side of it.
    assert_eq!(status, 0, "{one_side}");
    assert!(
        x(&one_side, 2) <= own - 59.98 || x(&one_side, 0) >= own + 49.98,
        "{one_side}"
    );
    let (status, moved) = json(folder, &format!("{base} --allow-crossing"));
    assert_eq!(status, 0, "{moved}");
    for relay in 0..3 {
        let x = x(&moved, relay);
        assert!(x <= own - 59.98 || x >= own + 49.98, "{moved}");
    }
    let sir = moved["sir"].as_f64().unwrap();
    assert!(sir < best * 0.9999 && sir > 0.6 * best, "{sir} {best}");
    assert!(one_side["sir"].as_f64().unwrap() < sir);
    let zones = Scenario::load(&folder.join("flight.toml")).unwrap();
    let chain = [own - 70.0, own + 60.0].map(|x_m| Placement::on_line(x_m as f32, 60.0));
    let line = area::problem(&zones, &chain, false, false).unwrap();
    for part in [
        "the line from relay 1 to relay 2 crosses no_fly[0] (0 to 10000 m) for 110.0 m",
        "--allow-crossing",
    ] {
        assert!(line.contains(part), "{line}");
    }
    assert_eq!(area::problem(&zones, &chain, false, true), None);
    // A path accepted by --allow-crossing is reported, also without --out.
    let (status, _, text) = cargo_plan(folder, &format!("{base} --allow-crossing"));
    assert!(
        status == Some(0)
            && text.contains("warning: the line from relay ")
            && text.trim_end().ends_with("accepted by --allow-crossing"),
        "{text}"
    );
    // Relays that compute their own positions would be inside the area.
    let out = format!("{base} --allow-crossing --out out.toml");
    let (status, _, text) = cargo_plan(folder, &out);
    let is_named = |text: &str| text.contains("relay 2 is") && text.contains("inside no_fly[0]");
    assert!(status == Some(1) && is_named(&text), "{text}");
    assert!(!folder.join("out.toml").exists());
    let (succeeds, text) = provision(folder, "flight.toml");
    assert!(!succeeds && is_named(&text), "{text}");
    // If relays can fly beside or above the area, no path crosses it.
    let low = format!("{zone}\nhighest_m = 80");
    for (zone, geometry) in [
        (&zone, "lateral_max_m = 200"),
        (&low, "altitude_max_m = 150"),
    ] {
        write(zone);
        let text = std::fs::read_to_string(folder.join("flight.toml")).unwrap();
        let text = text.replace(
            "altitude_m = 60\n",
            &format!("altitude_m = 60\n{geometry}\n"),
        );
        std::fs::write(folder.join("flight.toml"), text).unwrap();
        let (status, around) = json(folder, &format!("{base} --altitude free"));
        assert_eq!(status, 0, "{around}");
        assert!(around["sir"].as_f64().unwrap() > 0.5 * best, "{around}");
    }
}

/// Checks that a plan in another folder finds the files of its scenario.
#[test]
fn a_plan_in_another_folder_finds_its_files() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::create_dir_all(folder.join("own")).unwrap();
    std::fs::create_dir_all(folder.join("other")).unwrap();
    let ring = "[[8.52, 47.21], [8.523, 47.21], [8.523, 47.212], [8.52, 47.21]]";
    let polygon = format!(r#"{{ "type": "Polygon", "coordinates": [{ring}] }}"#);
    std::fs::write(folder.join("own/zones.geojson"), polygon).unwrap();
    let key = folder.join("own/net.key");
    std::fs::write(&key, "01".repeat(32)).unwrap();
    std::fs::set_permissions(&key, std::os::unix::fs::PermissionsExt::from_mode(0o600)).unwrap();
    let text = AREA
        .replace(
            "area = { circle = [1300, 700, 300] }",
            "x_m = 1300\ny_m = 700",
        )
        .replace("[20, 30]", "20");
    let sections = "[[no_fly]]\nfile = \"zones.geojson\"\n[network]\nkey_file = \"net.key\"\n\
        [companion]\nautopilot = \"udp:127.0.0.1:14550\"\nepoch_file = \"state/epoch\"\nlog_file = \"/var/log/relay\"\n";
    std::fs::write(folder.join("own/flight.toml"), format!("{text}{sections}")).unwrap();
    let of = |out: &str| {
        let args = format!("--scenario own/flight.toml --uavs 3 --out {out}");
        let (status, _, errors) = cargo_plan(folder, &args);
        assert_eq!(status, Some(0), "{errors}");
        std::fs::read_to_string(folder.join(out)).unwrap()
    };
    let root = folder.canonicalize().unwrap().join("own");
    let moved = of("other/plan.toml");
    for (key, name) in [
        ("file", "zones.geojson"),
        ("key_file", "net.key"),
        ("epoch_file", "state/epoch"),
    ] {
        let line = format!("\n{key} = \"{}\"\n", root.join(name).display());
        assert!(moved.contains(&line), "{line}: {moved}");
    }
    assert!(
        moved.contains("\"udp:127.0.0.1:14550\"") && moved.contains("\"/var/log/relay\""),
        "{moved}"
    );
    let scenario = Scenario::load(&folder.join("other/plan.toml")).unwrap();
    assert_eq!(scenario.no_fly.len(), 1);
    let (succeeds, said) = provision(folder, "other/plan.toml");
    assert!(succeeds && !said.contains("not signed"), "{said}");
    // In the folder of the scenario the paths stay as they are.
    assert!(of("own/plan.toml").contains("\nfile = \"zones.geojson\"\n"));
}

/// Checks no-fly areas on the paths of relays at fixed altitudes, also after the loss of a relay.
#[test]
fn relays_that_close_a_gap_keep_their_altitudes_beside_no_fly_areas() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write = |more: &str| std::fs::write(folder.join("flight.toml"), format!("{FLAT}{more}"));
    let own = "[[relay]]\nindex = 1\naltitude_m = 40\n[[relay]]\nindex = 2\naltitude_m = 120\n";
    write(own).unwrap();
    let base = "--scenario flight.toml --uavs 3";
    let (_, free) = json(folder, base);
    let x = |relay: usize| free["relays"][relay]["x_m"].as_f64().unwrap();
    // The straight line from 40 m to 120 m is above the area. Relay 1 crosses the area at 40 m.
    let zone = |from: f64, to: f64, highest_m: f64| {
        format!(
            "{own}[[no_fly]]\narea = {{ rectangle = [[{from}, -30], [{to}, 30]] }}\nhighest_m = {highest_m}\n"
        )
    };
    let middle = 0.5 * (x(0) + x(1));
    write(&zone(middle, middle + 20.0, 60.0)).unwrap();
    let scenario = Scenario::load(&folder.join("flight.toml")).unwrap();
    let chain = [(x(0), 40.0), (x(1), 120.0)].map(|(x_m, h)| Placement::on_line(x_m as f32, h));
    let line = area::problem(&scenario, &chain, false, false).unwrap();
    let part = "the line from relay 1 to relay 2 crosses no_fly[0] (0 to 60 m) for 20.0 m from the altitude 40.0 m";
    assert!(line.contains(part), "{line}");
    // With free altitudes, too, relays 1 and 2 keep their own.
    assert!(
        area::problem(&scenario, &chain, true, false)
            .unwrap()
            .contains(part)
    );
    let free_ones = Scenario {
        relays: std::collections::BTreeMap::new(),
        ..scenario
    };
    assert_eq!(area::problem(&free_ones, &chain, true, false), None);
    // The planner searches for positions without such a path.
    let (status, around) = json(folder, base);
    let at = |relay: usize| around["relays"][relay]["x_m"].as_f64().unwrap();
    assert_eq!(status, 0, "{around}");
    assert!(at(0) >= middle + 19.9 || at(1) <= middle + 0.1, "{around}");
    // If relay 2 is lost, relay 1 flies 14.8 m: through an area, or into it.
    write(&zone(x(0) + 3.0, x(0) + 10.0, 60.0)).unwrap();
    let out = format!("{base} --allow-crossing --out out.toml --force");
    let (status, _, said) = cargo_plan(folder, &out);
    let part = "warning: without relay 2: relay 1 on its way from x = ";
    assert!(status == Some(0) && said.contains(part), "{said}");
    assert!(
        said.contains(" m crosses no_fly[0] (0 to 60 m) for 7.0 m"),
        "{said}"
    );
    let (succeeds, said) = provision(folder, "out.toml");
    assert!(succeeds && said.contains(part), "{said}");
    write(&zone(x(0) + 8.0, x(0) + 60.0, 60.0)).unwrap();
    let (status, _, said) = cargo_plan(folder, &out);
    let part = "without relay 2: relay 1 is ";
    assert!(status == Some(0) && said.contains(part), "{said}");
    assert!(said.contains(" m inside no_fly[0] (0 to 60 m)"), "{said}");
    // A message says that no-fly areas are not checked.
    let text = std::fs::read_to_string(folder.join("flight.toml")).unwrap();
    let (before, after) = text.split_once("[[interferer]]").unwrap();
    let (_, relays) = after.split_once("[[relay]]").unwrap();
    let unknown = format!("{before}[listen]\n[[relay]]{relays}");
    std::fs::write(folder.join("unknown.toml"), unknown).unwrap();
    let (succeeds, said) = provision(folder, "unknown.toml --force");
    let part = "unknown.toml: no-fly areas not checked: the relays' positions are not known before the flight";
    assert!(succeeds && said.contains(part), "{said}");
    let (succeeds, said) = provision(folder, "flight.toml --force --method adjust");
    let part = "no-fly areas not checked: the method adjust changes altitudes in flight";
    assert!(succeeds && said.contains(part), "{said}");
}

#[test]
fn wrong_areas_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write = |name: &str, text: &str| {
        std::fs::write(folder.join(format!("{name}.geojson")), text).unwrap();
    };
    write(
        "zones",
        r#"{ "type": "FeatureCollection", "features": [ { "type": "Feature", "properties": {},
        "geometry": { "type": "Polygon", "coordinates": [[[8.52, 47.199], [8.523, 47.199], [8.523, 47.201], [8.52, 47.199]]] } } ] }"#,
    );
    let good = r#"{ "type": "Polygon", "coordinates": [[[8.52, 47.199], [8.523, 47.199], [8.523, 47.201], [8.52, 47.199]]] }"#;
    let beside = |other: &str| {
        format!(r#"{{ "type": "GeometryCollection", "geometries": [{good}, {other}] }}"#)
    };
    for (name, damaged) in [
        ("keys", r#"{ "type": "Feature", "Geometry": {} }"#),
        ("empty", r#"{ "type": "Polygon", "coordinates": [] }"#),
        (
            "members",
            r#"{ "type": "MultiPolygon", "coordinates": [[]] }"#,
        ),
        (
            "object",
            r#"{ "type": "MultiPolygon", "coordinates": { "0": [] } }"#,
        ),
    ] {
        write(name, &beside(damaged));
    }
    // The ring of the hole before the boundary, and after it.
    let rings = [
        [8.521, 47.1992, 8.522, 47.1996],
        [8.52, 47.199, 8.523, 47.201],
    ]
    .map(|[w, s, e, n]| format!("[[{w}, {s}], [{e}, {s}], [{e}, {n}], [{w}, {n}], [{w}, {s}]]"));
    for (name, order) in [("inner", [0, 1]), ("outer", [1, 0])] {
        let [first, second] = order.map(|at: usize| &rings[at]);
        let polygon = format!(r#"{{ "type": "Polygon", "coordinates": [{first}, {second}] }}"#);
        write(name, &beside(&polygon));
    }
    write(
        "swapped",
        r#"{ "type": "Polygon", "coordinates": [[[47.199, 8.52], [47.199, 8.523], [47.201, 8.523], [47.199, 8.52]]] }"#,
    );
    let line = r#"{ "type": "LineString", "coordinates": [[8.5, 47.2]] }"#;
    write("line", line);
    let parse = |text: &str| {
        let file = folder.join("area.toml");
        std::fs::write(&file, text).unwrap();
        Scenario::load(&file)
    };
    let area = |area: &str| AREA.replace("area = { circle = [1300, 700, 300] }", area);
    let zone = |zone: &str| format!("{AREA}[[no_fly]]\n{zone}\n");
    let single = |place: &str| area(place).replace("[20, 30]", "20");
    let length = parse(AREA).unwrap().distance_m;
    let outer = parse(&zone("file = \"outer.geojson\"")).unwrap();
    assert_eq!(outer.no_fly.len(), 2);
    parse(&single("x_m = 0\ny_m = 1.1")).unwrap();
    let zones = parse(&zone("file = \"zones.geojson\"\nlowest_m = 10"))
        .unwrap()
        .no_fly;
    assert!(
        zones.len() == 1 && zones[0].depth_m([900.0, 20.0], 60.0).is_some(),
        "{zones:?}"
    );
    assert!(zones[0].depth_m([900.0, 20.0], 5.0).is_none());
    for by_degrees in [
        "polygon_deg = [[47.19, 8.52], [47.19, 8.525], [47.195, 8.52]]",
        "rectangle_deg = [[47.19, 8.52], [47.195, 8.525]]",
        "circle_deg = [47.19, 8.52, 200]",
    ] {
        parse(&area(&format!("area = {{ {by_degrees} }}"))).unwrap();
    }
    let name = folder.display().to_string();
    let mut all = String::new();
    for text in [
        area("area = { circle = [100, 100, 200] }"),
        area("area = { polygon = [[0, 9], [50, 40], [9, 40], [50, 9]] }"),
        area("area = { rectangle = [[5, 9], [5, 40]] }"),
        area("area = { polygon = [[5, 9], [5, 40]] }"),
        area("area = { polygon = [] }"),
        area("area = { circle = [5, 900, 0.5] }"),
        area("area = { circle = [5, 900] }"),
        area("area = { polygon_deg = [[8.52, 47.19], [8.525, 47.19], [8.52, 47.195]] }"),
        area("area = { circle = [5, 900, 5], polygon = [] }"),
        area("area = {}"),
        area("area = { square = [1, 2] }"),
        area("x_m = 5\narea = { circle = [5, 900, 5] }"),
        area("x_m = 5\ny_m = 900"),
        AREA.replace("[20, 30]", "[30, 20]"),
        AREA.replace("[20, 30]", "[20, 130]"),
        area("area = { circle = [100, 0, 99.9999] }"),
        single("x_m = 0\ny_m = 0"),
        single(&format!("x_m = {}\ny_m = 0.9", length - 0.2)),
        single("lat_deg = 47.2\nlon_deg = 8.536"),
        single("lat_deg = 8.52\nlon_deg = 47.2"),
        single("lat_deg = 8.2\nlon_deg = 47.2"),
        single("lat_deg = 47.9\nlon_deg = 8.5"),
        zone("file = \"inner.geojson\""),
        zone("lowest_m = 5"),
        zone("area = { circle = [5, 900, 5] }\nlowest_m = 50\nhighest_m = 50"),
        zone("file = \"none.geojson\""),
        zone("file = \"line.geojson\""),
        // A damaged part is an error, even beside a good part.
        zone("file = \"keys.geojson\""),
        zone("file = \"empty.geojson\""),
        zone("file = \"members.geojson\""),
        zone("file = \"object.geojson\""),
        zone("file = \"swapped.geojson\""),
    ] {
        let error = parse(&text).expect_err(&text).to_string();
        writeln!(all, "{}", error.replace(&name, "FOLDER")).unwrap();
    }
    insta::assert_snapshot!(all);
}
