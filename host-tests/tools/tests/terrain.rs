//! `cargo plan` over terrain: the search for positions, and the program with elevation files.
#![cfg(test)]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::too_many_lines
)]

#[path = "../../terrain/tests/terrain/files.rs"]
#[allow(dead_code)]
mod files;

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use files::Raster;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::Value;
use uav_relay::Placement;
use uav_relay_scenario::{PlannedMethod, Scenario, TerrainSpec};
use uav_relay_terrain::profile::State;
use uav_relay_tools::plan::flown::flown;
use uav_relay_tools::plan::over_terrain::{self, Candidate, Search};
use uav_relay_tools::plan::terrain::Elevation;
use uav_relay_tools::plan::terrain_flight::{Flight, with_altitudes};
use uav_relay_tools::plan::{PlanRequest, plan};

const EXAMPLE: &str = "../../examples/hills.toml";

/// Writes random hills along a line of 5 km, and a scenario above them that contains `more`.
fn scene(folder: &Path, rng: &mut impl rand::Rng, more: &str) -> Scenario {
    let mut wave = || {
        let [east, north] = [(); 2].map(|()| rng.random_range(-1.0_f64..1.0) / 250.0);
        [
            east,
            north,
            rng.random_range(0.0..6.3),
            rng.random_range(5.0..30.0),
        ]
    };
    let waves: Vec<[f64; 4]> = (0..6).map(|_| wave()).collect();
    let height = |lon: f64, lat: f64| {
        let (x, y) = ((lon - 8.5) * 75_600.0, (lat - 47.2) * 111_200.0);
        500.0
            + waves
                .iter()
                .map(|[a, b, c, h]| h * (a * x + b * y + c).sin())
                .sum::<f64>()
    };
    let raster = Raster::geographic(8.495, 47.205, 1.0 / 3600.0, [280, 37]);
    raster.write(&folder.join("hills.tif"), height);
    let [tx, rx] = [8.5, 8.566].map(|lon| {
        format!(
            "{{ lat_deg = 47.2, lon_deg = {lon}, amsl_m = {:.1} }}",
            height(lon, 47.2)
        )
    });
    let text = format!(
        "[geometry]\naltitude_m = 120\naltitude_min_m = 20\naltitude_max_m = 120\nmin_separation_m = 4\n\
         [site]\ntx = {tx}\nrx = {rx}\n[power]\ntx_w = 5\nuav_w = 1\n[noise]\nbandwidth_hz = 1e7\n\
         [terrain]\nfiles = [\"hills.tif\"]\nmast_m = 5\nabove_ground_m = 30\nabove_ground_max_m = 120\n{more}\
         [[interferer]]\npower_w = {:?}\nx_m = {:?}\ny_m = {:?}\n",
        10_f64.powf(rng.random_range(-2.0..1.0)),
        rng.random_range(-1000.0..6000.0),
        rng.random_range(300.0..2000.0)
    );
    let file = folder.join("scene.toml");
    std::fs::write(&file, text).unwrap();
    Scenario::load(&file).unwrap()
}

fn rng(seed: u64) -> chacha20::ChaCha8Rng {
    chacha20::ChaCha8Rng::seed_from_u64(seed)
}

fn elevation(scenario: &Scenario) -> Elevation {
    Elevation::load(scenario, &[], 1.0).unwrap().unwrap()
}

/// Returns the SIR of the best chain over all combinations of the relays' candidate positions.
fn brute_force(
    search: &mut Search<'_>,
    candidates: &[Vec<Candidate>],
    chain: &mut Vec<Candidate>,
    apart_m: f64,
) -> f64 {
    let Some(own) = candidates.get(chain.len()) else {
        return search.worst_sir(chain);
    };
    let mut best: f64 = 0.0;
    for at in own {
        let is_apart = chain.last().is_none_or(|last| {
            at.x_m > last.x_m && (at.x_m - last.x_m).hypot(at.h_m - last.h_m) >= apart_m
        });
        if is_apart {
            chain.push(*at);
            best = best.max(brute_force(search, candidates, chain, apart_m));
            chain.pop();
        }
    }
    best
}

#[test]
fn the_search_finds_the_best_chain_of_a_small_grid() {
    let folder = tempfile::tempdir().unwrap();
    for (seed, relays, columns, levels) in [
        (1, 1, 30, 5),
        (2, 2, 12, 4),
        (3, 3, 7, 3),
        (4, 2, 12, 4),
        (5, 3, 7, 3),
    ] {
        // Both directions, and a relay with a fixed altitude and another power.
        let more = if seed > 3 {
            "[link]\nreverse = 0.5\n[[relay]]\nindex = 2\naltitude_m = 90\npower_w = 0.3\n"
        } else {
            ""
        };
        let scenario = scene(folder.path(), &mut rng(seed), more);
        let elevation = elevation(&scenario);
        let scene = elevation.scene(&scenario, relays).unwrap().unwrap();
        let mut search = Search::new(&scenario, &scene, &elevation).unwrap();
        let grid = search.grid(columns, levels).unwrap();
        let (chain, sir) = search.best(&grid, 0.0).unwrap();
        // A floor up to the result's SIR does not change the result.
        assert_eq!(
            search.best(&grid, sir),
            Some((chain.clone(), sir)),
            "seed {seed}"
        );
        assert_eq!(search.best(&grid, sir * (1.0 + 1e-9)), None);
        assert_eq!(chain.len(), usize::from(relays));
        let all = brute_force(
            &mut search,
            &grid,
            &mut Vec::new(),
            scenario.min_separation_m,
        );
        assert!((sir / all - 1.0).abs() < 1e-12, "seed {seed}: {sir} {all}");
        assert!(
            (search.worst_sir(&chain) / all - 1.0).abs() < 1e-12,
            "seed {seed}"
        );
    }
}

/// Checks that positions for the terrain are no worse than positions that ignore the terrain.
///
/// The latter are the joint method's positions, and positions at 120 m. If these can be flown, the positions for the
/// terrain may lose less than 0.01 dB. The median gain over all scenes must be above -0.1 dB.
#[test]
fn positions_over_terrain_are_no_worse_than_those_that_ignore_it() {
    let folder = tempfile::tempdir().unwrap();
    let number =
        |name: &str, default| std::env::var(name).map_or(default, |text| text.parse().unwrap());
    let (first, count) = (number("SEED", 1), number("COUNT", 6));
    let (mut gains, mut flyable): ([Vec<f64>; 2], [u32; 3]) = Default::default();
    for seed in first..first + count {
        let rng = &mut rng(seed);
        let scenario = scene(folder.path(), rng, "");
        let elevation = elevation(&scenario);
        let relays = rng.random_range(2..=8);
        let known = over_terrain::best(&scenario, &elevation, relays, 1e-4).unwrap();
        let report = elevation.report(&scenario, &known).unwrap();
        // The report has more terrain points than the search.
        let scene = elevation.scene(&scenario, relays).unwrap().unwrap();
        assert!(
            report.terrain_sir
                <= scene.chain_sir(
                    &known
                        .places
                        .iter()
                        .map(|(place, _)| *place)
                        .collect::<Vec<_>>()
                ) * (1.0 + 1e-5)
        );
        assert!(report.too_low(30.0).is_none(), "seed {seed}: {report:?}");
        assert!(report.too_high(120.0).is_none(), "seed {seed}: {report:?}");
        flyable[0] += u32::from(elevation.problem(&report, false).is_none());
        for (other, free_altitude) in [true, false].into_iter().enumerate() {
            let blind = plan(&scenario, &PlanRequest::of(relays, free_altitude, 1e-4)).unwrap();
            let blind = elevation.report(&scenario, &blind).unwrap();
            let gain = report.terrain_sir_db - blind.terrain_sir_db;
            let is_flyable = elevation.problem(&blind, false).is_none();
            assert!(!is_flyable || gain > -0.01, "seed {seed}: {gain}");
            flyable[other + 1] += u32::from(is_flyable);
            gains[other].push(gain);
        }
    }
    for (name, gains) in ["the joint method", "all at 120 m"].iter().zip(&mut gains) {
        gains.sort_by(f64::total_cmp);
        let at = |share: f64| gains[(share * (gains.len() - 1) as f64).round() as usize];
        println!(
            "gain over {name}: 10 % {:.2}, median {:.2}, 90 % {:.2} dB",
            at(0.1),
            at(0.5),
            at(0.9)
        );
        assert!(at(0.5) > -0.1, "{gains:?}");
    }
    println!(
        "of {count} plans can be flown: {} over terrain, {} by the joint method, {} at 120 m",
        flyable[0], flyable[1], flyable[2]
    );
}

/// Checks that relays reach the reported positions, rooms and SIRs when they fly over terrain.
///
/// A relay's room is an interval of x. At random positions in the rooms no hop may become worse.
#[test]
fn relays_fly_over_the_terrain_by_themselves() {
    let folder = tempfile::tempdir().unwrap();
    let count = std::env::var("COUNT").map_or(8, |text| text.parse().unwrap());
    let (mut losses, mut clear, mut rooms_m, mut warned) = (Vec::new(), 0_u64, Vec::new(), 0);
    let (mut confined, mut low_ways) = (0, 0);
    for seed in 1..=count {
        let rng = &mut rng(seed);
        let scenario = scene(folder.path(), rng, "");
        let elevation = elevation(&scenario);
        let relays = rng.random_range(2..=8);
        let known = over_terrain::best(&scenario, &elevation, relays, 1e-4).unwrap();
        let best = elevation.report(&scenario, &known).unwrap();
        let own = with_altitudes(&scenario, &elevation, &known, 1e-4).unwrap();
        assert_eq!(own.relays.len(), usize::from(relays));
        let by_themselves = flown(&own, relays, PlannedMethod::Align, 1e-4).unwrap();
        let how = (PlannedMethod::Align, 1e-4);
        let flight = Flight::new(&own, &elevation, &by_themselves.plan, how, false).unwrap();
        for (relay, (place, _)) in flight.relays.iter().zip(&by_themselves.plan.places) {
            // The SIR has a relative tolerance of 1e-4, so the positions differ slightly.
            let off_m = (relay.x_m - place.x_m).abs();
            assert!(off_m < 0.5, "seed {seed}: {relay:?} {place:?}");
            assert_eq!(relay.altitude_m.to_bits(), place.altitude_m.to_bits());
        }
        let flight = flight.compared(&known, best.terrain_sir_db);
        losses.push(flight.loss_db.unwrap());
        warned += flight.warnings().count();
        for relay in &flight.relays {
            let part = format!("relay {} has no room: ", relay.index);
            let is_warned = flight.warnings().any(|line| line.starts_with(&part));
            assert_eq!(is_warned, relay.room_m.is_none(), "seed {seed}: {relay:?}");
            confined += u32::from(is_warned);
        }
        // Paths reported as too low: the height above the ground is computed again on the level path.
        for line in flight.without.iter().filter_map(|one| one.problem.as_ref()) {
            for part in line
                .split("; ")
                .filter(|part| part.contains(" on its way from x = "))
            {
                let words: Vec<&str> = part.split(' ').collect();
                let number = |after: &str| -> f64 {
                    let at = words.windows(2).position(|two| two[0] == after).unwrap();
                    words[at + 1].parse().unwrap()
                };
                let altitude_m = flight.relays[number("relay") as usize - 1].altitude_m;
                let x_m: f64 = words
                    .iter()
                    .skip_while(|word| **word != "ground")
                    .nth(4)
                    .unwrap()
                    .parse()
                    .unwrap();
                let place = Placement::on_line(x_m as f32, altitude_m);
                let above = elevation.ground(&own).unwrap().relay(place).unwrap().amsl_m
                    - elevation.ground(&own).unwrap().height_m(x_m, 0.0).unwrap();
                assert!(
                    number("is") < 30.0 && (above - number("is")).abs() < 0.5,
                    "{part}: {above}"
                );
                low_ways += 1;
            }
        }
        match &flight.problem {
            Some(problem) => println!("seed {seed}, {relays} relays: {problem}"),
            None => clear += 1,
        }
        assert_eq!(flight.without.len(), usize::from(relays));
        // After a loss the other relays form a chain, unless too few are left to agree.
        for lost in flight.without.iter().filter(|_| relays > 2) {
            let mut others = own.clone();
            let left = own.relays.iter().filter(|(index, _)| **index != lost.lost);
            let left = (1..).zip(left.map(|(_, relay)| relay.clone()));
            others.relays = left.collect();
            let closed = flown(&others, relays - 1, PlannedMethod::Align, 1e-4).unwrap();
            let below = elevation.report(&others, &closed.plan).unwrap();
            let off_db = below.terrain_sir_db - lost.terrain_sir_db.unwrap();
            assert!(off_db.abs() < 0.3, "seed {seed}: {lost:?} {off_db}");
            let is_low = lost
                .problem
                .as_ref()
                .is_some_and(|line| line.contains(" is blocked: "));
            assert_eq!(is_low, below.blocked().is_some(), "seed {seed}: {lost:?}");
        }
        let ground = elevation.ground(&own).unwrap();
        let report = elevation.report(&own, &by_themselves.plan).unwrap();
        for _ in 0..50 {
            let somewhere = flight.relays.iter().map(|relay| {
                let [from, to] = relay.room_m.unwrap_or([f64::from(relay.x_m); 2]);
                // Often an end of the room. The altitude is as low as the position error allows.
                let x_m = match rng.random_range(0..4) {
                    0 => from,
                    1 => to,
                    _ => rng.random_range(from..=to),
                };
                let mut error = || rng.random_range(-0.57..0.57);
                let [dx, dy]: [f64; 2] = [error(), error()];
                let place = Placement {
                    x_m: (x_m + dx) as f32,
                    y_m: dy as f32,
                    altitude_m: relay.altitude_m - 0.57,
                };
                (relay.room_m, ground.relay(place).unwrap())
            });
            let [tx, rx] = ground.ends;
            let at = |node| (Some([0.0; 2]), node);
            let nodes = [vec![at(tx)], somewhere.collect(), vec![at(rx)]].concat();
            for (pair, hop) in nodes.windows(2).zip(&report.hops) {
                let now = ground
                    .profile([pair[0].1, pair[1].1])
                    .unwrap()
                    .clearance(0.1499);
                let holds = match hop.state {
                    State::Clear => now.state == State::Clear,
                    State::Grazing => now.state != State::Blocked,
                    State::Blocked => true,
                };
                let has_rooms = pair.iter().all(|(room, _)| room.is_some());
                assert!(holds || !has_rooms, "seed {seed}: {hop:?} {now:?}");
            }
        }
        rooms_m.extend(
            flight
                .relays
                .iter()
                .filter_map(|relay| relay.room_m)
                .map(|[from, to]| to - from),
        );
    }
    for numbers in [&mut losses, &mut rooms_m] {
        numbers.sort_by(f64::total_cmp);
    }
    let at = |numbers: &[f64], share: f64| numbers[(share * (numbers.len() - 1) as f64) as usize];
    println!(
        "{clear} of {count} flights clear; loss: median {:.2}, 90 % {:.2} dB; {} rooms, median {:.0} m; {warned} warnings",
        at(&losses, 0.5),
        at(&losses, 0.9),
        rooms_m.len(),
        at(&rooms_m, 0.5)
    );
    println!("{confined} relays without a room, {low_ways} low ways");
    assert!(count < 8 || confined > 0 && low_ways > 0);
    assert!(2 * clear > count, "{clear}");
}

fn run(arguments: &str) -> (Option<i32>, String, String) {
    run_as(env!("CARGO_BIN_EXE_plan"), arguments)
}

fn provision(arguments: &str) -> (Option<i32>, String, String) {
    run_as(env!("CARGO_BIN_EXE_provision"), arguments)
}

fn run_as(program: &str, arguments: &str) -> (Option<i32>, String, String) {
    let output = Command::new(program)
        .args(arguments.split_whitespace())
        .output()
        .unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code(), out, err)
}

#[test]
fn a_blocked_plan_is_refused_with_the_hop_the_place_and_the_metres() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (status, table, line) = run(&format!(
        "--scenario {EXAMPLE} --uavs 6 --out {}",
        path("plan.toml")
    ));
    assert_eq!(status, Some(1), "{line}");
    assert!(
        table.contains("terrain:  hop    state")
            && table.contains("BLOCKED")
            && table.contains("buildings and trees"),
        "{table}"
    );
    assert!(line.contains("hop 2 (relay 1 to relay 2) is blocked: the ground at x = 1473 m, y = 0 m (latitude 47.200"), "{line}");
    assert!(
        line.contains(" is 34.7 m above the line of sight")
            && line.contains("relay 1 is -13.0 m, ")
            && line.trim_end().ends_with("--allow-blocked accepts it"),
        "{line}"
    );
    assert!(!Path::new(&path("plan.toml")).exists());
    let [svg, geojson, kml] = ["profile.svg", "plan.geojson", "plan.kml"].map(path);
    let files = format!("--profile {svg} --geojson {geojson} --kml {kml}");
    let (status, json, line) = run(&format!(
        "--scenario {EXAMPLE} --uavs 6 --allow-blocked --json {files}"
    ));
    // --allow-blocked does not accept a relay below the ground.
    assert!(
        status == Some(1) && line.contains("relay 1 is -13.0 m, ") && !line.contains("blocked"),
        "{line}"
    );
    let report: Value = serde_json::from_str(&json).unwrap();
    let hops = report["hops"].as_array().unwrap();
    assert_eq!(hops.len(), 7);
    assert_eq!(
        (&hops[1]["state"], &hops[1]["clear"]),
        (&"blocked".into(), &false.into())
    );
    assert!(
        hops[1]["diffraction_db"].as_f64().unwrap() > 60.0
            && hops[1]["clearance_m"].as_f64().unwrap() < -34.0
    );
    assert!(hops[3]["clear"].as_bool().unwrap() && hops[3]["diffraction_db"].as_f64() == Some(0.0));
    let worst = hops
        .iter()
        .map(|hop| hop["sir_db"].as_f64().unwrap())
        .fold(f64::INFINITY, f64::min);
    assert!((report["terrain_sir_db"].as_f64().unwrap() - worst).abs() < 1e-9);
    assert_eq!(report["heights"].as_array().unwrap().len(), 6);
    let read = |file: &str| std::fs::read_to_string(file).unwrap();
    let svg = read(&svg);
    roxmltree::Document::parse(&svg).unwrap();
    for part in [
        "blocked hop",
        "first Fresnel zone",
        "ground",
        "Tx, relays, Rx",
    ] {
        assert!(svg.contains(part), "{part}");
    }
    let map: Value = serde_json::from_str(&read(&geojson)).unwrap();
    let features = map["features"].as_array().unwrap();
    let ground: Vec<&Value> = features
        .iter()
        .filter(|one| one["properties"]["kind"] == "ground")
        .collect();
    assert_eq!(ground.len(), 7);
    let heights = ground[1]["properties"]["amsl_m"].as_array().unwrap();
    assert_eq!(
        heights.len(),
        ground[1]["geometry"]["coordinates"]
            .as_array()
            .unwrap()
            .len()
    );
    // This is the summit of the example's hills.
    assert!(
        heights
            .iter()
            .any(|height| (height.as_f64().unwrap() - 582.0).abs() < 1.5),
        "{heights:?}"
    );
    let hop = features
        .iter()
        .find(|one| one["properties"]["kind"] == "hop")
        .unwrap();
    assert!(
        hop["properties"]["diffraction_db"].as_f64().unwrap() > 40.0,
        "{hop}"
    );
    let kml = read(&kml);
    roxmltree::Document::parse(&kml).unwrap();
    let count = |part: &str| kml.matches(part).count();
    assert_eq!(
        (
            count("clampToGround"),
            count("ground of hop"),
            count("track of hop")
        ),
        (7, 7, 7)
    );
}

#[test]
fn positions_over_terrain_are_reported_with_their_gain() {
    let (status, json, line) = run(&format!(
        "--scenario {EXAMPLE} --uavs 6 --altitude terrain --json"
    ));
    assert_eq!((status, line.as_str()), (Some(0), ""));
    let report: Value = serde_json::from_str(&json).unwrap();
    let number = |key: &str| report[key].as_f64().unwrap();
    assert!(
        (number("terrain_sir_db") - number("blind_sir_db") - number("terrain_gain_db")).abs()
            < 1e-9
    );
    assert!(
        number("terrain_gain_db") > -0.1 && number("terrain_sir_db") > 20.0,
        "{report}"
    );
    assert_eq!(report["how"], "a search over the terrain");
    let problem = report["blind_problem"].as_str().unwrap();
    assert!(
        problem
            .contains(" m above the ground; allowed: at most 120 m (terrain.above_ground_max_m)"),
        "{problem}"
    );
    assert!(
        report["heights"]
            .as_array()
            .unwrap()
            .iter()
            .all(|relay| relay["above_obstacle_m"].as_f64().unwrap() >= 29.99)
    );
}

/// Checks SIRs with interferers on hills. The test computes these SIRs itself from the heights of the hills.
#[test]
fn interferers_stand_on_the_ground() {
    let folder = tempfile::tempdir().unwrap();
    let height =
        |x: f64, y: f64| 500.0 + 0.06 * x + 80.0 * (-(x - 2000.0).hypot(y + 400.0) / 500.0).exp();
    let metres = |lon: f64, lat: f64| ((lon - 8.5) * 75_744.0, (47.2 - lat) * 111_180.0);
    let raster = Raster::geographic(8.495, 47.21, 1.0 / 3600.0, [280, 73]);
    raster.write(&folder.path().join("hills.tif"), |lon, lat| {
        let (x, y) = metres(lon, lat);
        height(x, y)
    });
    let text = |place: &str| {
        format!(
            "[geometry]\naltitude_m = 150\naltitude_max_m = 300\nmin_separation_m = 50\n[site]\ntx = {{ lat_deg = 47.2, lon_deg = 8.5, amsl_m = {:.2} }}\n\
         rx = {{ lat_deg = 47.2, lon_deg = 8.566, amsl_m = {:.2} }}\n[power]\ntx_w = 5\nuav_w = 1\n[terrain]\nfiles = [\"hills.tif\"]\n\
         above_ground_m = 40\n[link]\nreverse = 0.7\n{place}",
            height(0.0, 0.0),
            height(5000.0, 0.0)
        )
    };
    let read = |place: &str| {
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, text(place)).unwrap();
        Scenario::load(&file).unwrap()
    };
    let scenario = read(
        "[[interferer]]\npower_w = 3\nx_m = 1900\ny_m = -150\nmast_m = 25\n[[interferer]]\npower_w = 0.5\nx_m = 3000\ny_m = 300\n\
         [[interferer]]\npower_w = 2\nx_m = 2500\ny_m = 4000\n",
    );
    let elevation = elevation(&scenario);
    let known = over_terrain::best(&scenario, &elevation, 3, 1e-4).unwrap();
    let report = elevation.report(&scenario, &known).unwrap();
    // The elevation files do not cover the third interferer.
    assert_eq!(report.interferers[2].altitude_m, None);
    assert!(
        report
            .table()
            .contains("interferer 3: not covered by the elevation files")
    );
    let line = |x: f64| {
        height(0.0, 0.0) + (height(5000.0, 0.0) - height(0.0, 0.0)) * x / scenario.distance_m
    };
    let sources = [
        (3.0, 1900.0, -150.0, height(1900.0, -150.0) + 25.0),
        (0.5, 3000.0, 300.0, height(3000.0, 300.0)),
        (2.0, 2500.0, 4000.0, line(2500.0)),
    ];
    assert!(
        (report.interferers[0].altitude_m.unwrap()[0] - (sources[0].3 - line(1900.0))).abs() < 3.0
    );
    let free =
        |d: f64| (4.0 * std::f64::consts::PI * d * 2e9 / 299_792_458.0).powi(2) * 10_f64.powf(0.01);
    let heard = |x: f64, amsl: f64| -> f64 {
        let each = sources.iter();
        each.map(|(w, sx, sy, sz)| w / free((x - sx).hypot(*sy).hypot(amsl - sz)))
            .sum()
    };
    // Eight relays at 150 m pass close to the first interferer.
    let level = plan(&scenario, &PlanRequest::of(8, false, 1e-4)).unwrap();
    let level_report = elevation.report(&scenario, &level).unwrap();
    let mut effect_db: f64 = 0.0;
    for (plan, report) in [(&known, &report), (&level, &level_report)] {
        let relays = plan.places.iter().map(|(place, _)| {
            let [x, h] = [place.x_m, place.altitude_m].map(f64::from);
            (x, line(x) + h)
        });
        let mut from = (0.0, line(0.0), 5.0);
        for (hop, (x, amsl)) in report.hops.iter().zip(relays) {
            let signal = from.2 / free((x - from.0).hypot(amsl - from.1));
            let sir_db = 10.0 * (signal / heard(x, amsl)).log10() - hop.diffraction_db;
            // The heights in the file differ from the hill's by some metres.
            let (own_db, hop_db) = (hop.sir_db, hop.diffraction_db);
            assert!((own_db - sir_db).abs() < 0.3, "{own_db} {sir_db}");
            let flat: f64 = sources
                .iter()
                .map(|(w, sx, sy, _)| w / free((x - sx).hypot(*sy).hypot(amsl - line(*sx))))
                .sum();
            let flat_db = 10.0 * (signal / flat).log10() - hop_db;
            effect_db = effect_db.max((flat_db - sir_db).abs());
            from = (x, amsl, 1.0);
        }
    }
    assert!(effect_db > 1.0, "{effect_db}");
    let scene = elevation.scene(&scenario, 3).unwrap().unwrap();
    let mut search = Search::new(&scenario, &scene, &elevation).unwrap();
    let grid = search.grid(7, 3).unwrap();
    let (chain, sir) = search.best(&grid, 0.0).unwrap();
    let all = brute_force(
        &mut search,
        &grid,
        &mut Vec::new(),
        scenario.min_separation_m,
    );
    assert!(
        (sir / all - 1.0).abs() < 1e-12 && chain.len() == 3,
        "{sir} {all}"
    );
    // For an area, the altitude of its ground nearest to the receiver's altitude counts.
    let scenario = read(
        "[[interferer]]\npower_w = 3\narea = { circle = [2000.0, -400.0, 200.0] }\nmast_m = 5\n",
    );
    let scene = elevation.scene(&scenario, 3).unwrap().unwrap();
    let [low, high] = scene.heights_m[&0];
    let top = height(2000.0, -400.0) - line(2000.0) + 5.0;
    assert!(
        (high - top).abs() < 6.0 && low < high - 20.0,
        "{low} {high} {top}"
    );
    let near = scene.interference_w(uav_relay_scenario::scene::Place {
        x: 2000.0,
        y: -400.0,
        h: high + 50.0,
    });
    assert!((near / (3.0 / free(50.0)) - 1.0).abs() < 1e-3, "{near}");
}

/// Checks that a plan over a long line uses narrow hills between the columns of the first grid.
///
/// Without relays on these hilltops a hop would be blocked.
#[test]
fn long_lines_have_relays_on_narrow_hilltops() {
    let folder = tempfile::tempdir().unwrap();
    let rng = &mut rng(2);
    let mut wave = || {
        let [length, phase] =
            [(250.0, 1500.0), (0.0, 6.3)].map(|(low, high)| rng.random_range(low..high));
        [length, phase, rng.random_range(4.0..25.0)]
    };
    let waves: Vec<[f64; 3]> = (0..8).map(|_| wave()).collect();
    let height = |x: f64| {
        let each = waves.iter();
        300.0
            + each
                .map(|[l, p, a]| a * (std::f64::consts::TAU * x / l + p).sin())
                .sum::<f64>()
    };
    let raster = Raster::geographic(8.495, 47.202, 1.0 / 3600.0, [1925, 15]);
    raster.write(&folder.path().join("hills.tif"), |lon, _| {
        height((lon - 8.5) * 75_744.0)
    });
    let file = folder.path().join("scene.toml");
    let text = format!(
        "[geometry]\naltitude_m = 100\n[site]\ntx = {{ lat_deg = 47.2, lon_deg = 8.5, amsl_m = {:.1} }}\n\
         rx = {{ lat_deg = 47.2, lon_deg = 9.02, amsl_m = {:.1} }}\n[power]\ntx_w = 5\nuav_w = 5\n[noise]\nbandwidth_hz = 1e6\n\
         [terrain]\nfiles = [\"hills.tif\"]\nmast_m = 20\nabove_ground_m = 20\nabove_ground_max_m = 80\n\
         [[interferer]]\npower_w = 0.01\nx_m = 20000\ny_m = 4000\n",
        height(0.0),
        height(0.52 * 75_744.0)
    );
    std::fs::write(&file, text).unwrap();
    let scenario = Scenario::load(&file).unwrap();
    let elevation = elevation(&scenario);
    let plan = over_terrain::best(&scenario, &elevation, 12, 1e-4).unwrap();
    let report = elevation.report(&scenario, &plan).unwrap();
    // The files do not cover the interferer. Without candidates on hilltops a hop would be blocked.
    assert!(report.interferers[0].altitude_m.is_none());
    assert!(
        elevation.problem(&report, false).is_none(),
        "{}",
        report.table()
    );
}

/// Checks that the planner adds the assumed error of the heights to the ground.
#[test]
fn the_error_of_the_heights_is_a_margin() {
    let folder = tempfile::tempdir().unwrap();
    let known = scene(folder.path(), &mut rng(1), "");
    let of = elevation(&known);
    let unsure = Scenario {
        terrain: known.terrain.clone().map(|spec| TerrainSpec {
            error_m: 8.0,
            ..spec
        }),
        ..known.clone()
    };
    let raised = elevation(&unsure);
    let best = over_terrain::best(&known, &of, 4, 1e-4).unwrap();
    let [report, same] =
        [of.report(&known, &best), raised.report(&unsure, &best)].map(Result::unwrap);
    let is_inside = |x_m: f64| (200.0..known.distance_m - 200.0).contains(&x_m);
    let mut compared = 0;
    for (hop, other) in report.hops.iter().zip(&same.hops) {
        if is_inside(hop.obstacle_x_m) && (hop.obstacle_x_m - other.obstacle_x_m).abs() < 1e-6 {
            assert!(
                (hop.clearance_m - other.clearance_m - 8.0).abs() < 1e-6,
                "{hop:?} {other:?}"
            );
            compared += 1;
        }
        assert!(other.diffraction_db >= hop.diffraction_db - 1e-9);
    }
    assert!(compared > 0);
    for (relay, other) in report.heights.iter().zip(&same.heights) {
        assert!((relay.above_obstacle_m - other.above_obstacle_m - 8.0).abs() < 1e-6);
        assert!((relay.above_ground_m - other.above_ground_m).abs() < 1e-9);
    }
    let careful = over_terrain::best(&unsure, &raised, 4, 1e-4).unwrap();
    let report = raised.report(&unsure, &careful).unwrap();
    assert!(
        report.too_low(30.0).is_none()
            && report
                .heights
                .iter()
                .all(|relay| relay.above_ground_m >= 37.99)
    );
    // In its room a relay is neither too low, with the assumed error of the heights, nor too high.
    let own = with_altitudes(&unsure, &raised, &careful, 1e-4).unwrap();
    let flown = flown(&own, 4, PlannedMethod::Align, 1e-4).unwrap();
    let how = (PlannedMethod::Align, 1e-4);
    let flight = Flight::new(&own, &raised, &flown.plan, how, true).unwrap();
    let ground = raised.ground(&own).unwrap();
    let (mut rooms, mut highest_m) = (0, 0.0_f64);
    for relay in flight.relays.iter().filter(|relay| relay.room_m.is_some()) {
        let [from, to] = relay.room_m.unwrap();
        for step in 0..=50 {
            let x_m = (from + (to - from) * f64::from(step) / 50.0) as f32;
            let place = Placement::on_line(x_m, relay.altitude_m);
            let node = ground.relay(place).unwrap();
            let above_m = node.amsl_m - ground.height_m(node.x_m, 0.0).unwrap();
            let lowest_m = node.amsl_m - ground.highest_m(node, 1.0).unwrap();
            assert!(
                above_m < 120.1 && lowest_m > 29.9,
                "{relay:?} {x_m} {above_m} {lowest_m}"
            );
            highest_m = highest_m.max(above_m);
        }
        rooms += 1;
    }
    assert!(
        rooms > 0 && highest_m > 119.0,
        "{highest_m} {:?}",
        flight.relays
    );
    let text = std::fs::read_to_string(folder.path().join("scene.toml")).unwrap();
    let text = text.replace("mast_m = 5\n", "mast_m = 5\nerror_m = 101\n");
    std::fs::write(folder.path().join("wrong.toml"), text).unwrap();
    let wrong = Scenario::load(&folder.path().join("wrong.toml"))
        .unwrap_err()
        .to_string();
    assert!(
        wrong.contains("terrain.error_m = 101") && wrong.contains("0 to 100 m"),
        "{wrong}"
    );
}

#[test]
fn a_plan_over_terrain_is_flown_and_each_loss_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let plan = path("plan.toml");
    let arguments = format!("--scenario {EXAMPLE} --uavs 4 --altitude terrain --json --out {plan}");
    let (status, json, line) = run(&arguments);
    assert_eq!((status, line.as_str()), (Some(0), ""));
    let report: Value = serde_json::from_str(&json).unwrap();
    let flight = &report["flight"];
    let sir_db = flight["terrain_sir_db"].as_f64().unwrap();
    let loss_db = report["terrain_sir_db"].as_f64().unwrap() - sir_db;
    assert!(
        (flight["loss_db"].as_f64().unwrap() - loss_db).abs() < 1e-9 && loss_db < 12.0,
        "{flight}"
    );
    let without = flight["without"].as_array().unwrap();
    // After the loss of relay 1 the last hop would be blocked.
    let blocked = without[0]["problem"].as_str().unwrap();
    assert!(
        blocked.starts_with("hop 4 (relay 4 to Rx) is blocked: the ground at x = 4399 m"),
        "{blocked}"
    );
    let blocks = path("blocks");
    let provision = |more: &str| provision(&format!("--scenario {plan} {more}"));
    let (status, said, line) = provision(&format!("--all --out-dir {blocks}"));
    assert_eq!(status, Some(0), "{line}");
    assert!(
        line.contains(blocked) && said.contains(blocked),
        "{line} {said}"
    );
    assert!(
        said.contains(&format!("worst hop {sir_db:.3} dB with terrain")),
        "{said}"
    );
    assert!(said.contains("relay 2: x "), "{said}");
    // Each relay has its own altitude.
    let written = Scenario::load(Path::new(&plan)).unwrap();
    for (relay, own) in flight["relays"]
        .as_array()
        .unwrap()
        .iter()
        .zip(written.relays.values())
    {
        let altitude = own.altitude_m.unwrap();
        assert!((relay["altitude_m"].as_f64().unwrap() - altitude).abs() < 1e-3);
        assert!(
            said.contains(&format!(" {altitude:.2} ")),
            "{altitude} {said}"
        );
    }
    let bundle = path("bundle");
    let (status, _, line) = provision(&format!("--bundle {bundle}"));
    assert_eq!(status, Some(0), "{line}");
    let page = std::fs::read_to_string(path("bundle/relay3/page.txt")).unwrap();
    assert!(
        page.contains("room over the terrain: x ") && page.contains(blocked),
        "{page}"
    );
    // The mission's range of altitudes ignores the terrain. The page must not call it a room.
    assert!(
        page.contains("altitude 20.0 to 160.0 m above the line from Tx to Rx; these limits consider neither the ground nor no-fly areas")
            && !page.contains("box:"),
        "{page}"
    );
    // At its own altitudes the scenario has relays below the terrain.
    let low = std::fs::read_to_string(&plan).unwrap();
    let low = low.split("\n[[relay]]").next().unwrap();
    std::fs::write(&plan, low).unwrap();
    let (status, _, line) = provision(&format!("--uavs 6 --all --out-dir {blocks} --force"));
    assert!(
        status == Some(2)
            && line.contains("plan.toml: relay 1 is -13.0 m, ")
            && line.contains("hop 2 (relay 1 to relay 2) is blocked"),
        "{line}"
    );
    let of = |more: &str| provision(&format!("--uavs 6 --index 1 --out {} {more}", path("one")));
    let (status, _, line) = of("--method adjust");
    assert!(
        status == Some(0) && line.contains("terrain not checked: the method adjust"),
        "{line}"
    );
    let (_, _, line) = of("--allow-blocked");
    assert!(
        line.contains("relay 1 is -13.0 m, ") && !line.contains("is blocked"),
        "{line}"
    );
    let arguments = format!(
        "--scenario {EXAMPLE} --uavs 3 --altitude terrain --out {}",
        path("three.toml")
    );
    let (status, _, line) = run(&arguments);
    assert!(
        status == Some(1)
            && line.contains("hop 4 (relay 3 to Rx) is blocked")
            && line.contains("give another --uavs"),
        "{line}"
    );
    assert!(!Path::new(&path("three.toml")).exists());
}

/// Checks that rooms end before no-fly areas, and that accepted blocked hops are named.
///
/// A relay's room is the interval of x in which it may drift.
#[test]
fn rooms_keep_out_of_no_fly_areas_and_accepted_hops_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let plan = path("plan.toml");
    let of = |uavs: u16, more: &str| {
        run(&format!(
            "--scenario {EXAMPLE} --uavs {uavs} --altitude terrain --json {more}"
        ))
    };
    let (_, json, line) = of(4, &format!("--out {plan}"));
    let report: Value = serde_json::from_str(&json).unwrap();
    let relays = report["flight"]["relays"].as_array().unwrap();
    let room = |relay: &Value| [0, 1].map(|end: usize| relay["room_m"][end].as_f64());
    let (at, [low, high]) = relays
        .iter()
        .enumerate()
        .filter_map(|(at, relay)| Some((at, [room(relay)[0]?, room(relay)[1]?])))
        .max_by(|a, b| (a.1[1] - a.1[0]).total_cmp(&(b.1[1] - b.1[0])))
        .expect(&line);
    let [x, h] = ["x_m", "altitude_m"].map(|key| relays[at][key].as_f64().unwrap());
    let text = std::fs::read_to_string(&plan).unwrap();
    let rooms = |zone: &str| {
        std::fs::write(path("zone.toml"), format!("{text}{zone}")).unwrap();
        let folder = path("blocks");
        let file = path("zone.toml");
        let options = format!("--scenario {file} --all --force --out-dir {folder}");
        let (status, said, line) = provision(&options);
        assert_eq!(status, Some(0), "{line}");
        let own = format!("relay {}: x ", at + 1);
        let own = said.lines().find(|line| line.starts_with(&own)).unwrap();
        (own.split_once("room: ").unwrap().1.to_owned(), line)
    };
    let between = |from: f64, to: f64| format!("x {from:.1} to {to:.1} m");
    let zone = |from: f64, to: f64, y: f64, lowest: f64| {
        format!(
            "[[no_fly]]\narea = {{ rectangle = [[{from}, {y}], [{to}, 60]] }}\nlowest_m = {lowest}\n"
        )
    };
    assert_eq!(rooms("").0, between(low, high));
    // The position error is 1 m, so an area counts up to 1 m away.
    let before = low + 0.25 * (x - low);
    assert!(x - before > 6.0, "{low} {x} {high}");
    let cut = between(before + 1.0, high);
    for (zone, expected) in [
        (zone(before - 5.0, before, -60.0, 0.0), &cut),
        (zone(before - 5.0, before, 0.9, h + 0.9), &cut),
        (zone(before - 5.0, before, 1.1, 0.0), &between(low, high)),
        (
            zone(before - 5.0, before, -60.0, h + 1.1),
            &between(low, high),
        ),
    ] {
        assert_eq!(rooms(&zone).0, *expected, "{zone}");
    }
    // The area begins less than the position error from the relay.
    let (room, line) = rooms(&zone(x + 0.5, x + 5.0, -60.0, 0.0));
    let part = format!(
        "warning: relay {} has no room: it is in no_fly[0] (0 to 10000 m) within the position error of 1 m (companion.position_error_m)",
        at + 1
    );
    assert!(room == "none" && line.contains(&part), "{room} {line}");
    // An accepted blocked hop is reported each time. The suggested next command accepts it, too.
    let three = path("three.toml");
    let (status, table, line) = run(&format!(
        "--scenario {EXAMPLE} --uavs 3 --altitude terrain --allow-blocked --out {three}"
    ));
    let blocked = "hop 4 (relay 3 to Rx) is blocked: the ground at x = ";
    let warning = format!("warning: {blocked}");
    assert!(
        status == Some(0)
            && table.contains(&warning)
            && table.contains(&format!(
                "--scenario {three} --all --out-dir DIR --allow-blocked"
            )),
        "{table} {line}"
    );
    let folder = path("three");
    let options = format!("--scenario {three} --all --allow-blocked --out-dir {folder}");
    let (status, _, line) = provision(&options);
    assert!(
        status == Some(0)
            && line.contains(&warning)
            && line.contains("above the line of sight; accepted by --allow-blocked"),
        "{line}"
    );
}

/// Checks that the altitudes for the return to launch are above the ground, too.
#[test]
fn drones_return_above_the_ground_beside_the_chain() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let cell = 1.0 / 3600.0;
    // A peak of 900 m at one grid point, 43 m north of the line Tx-Rx. The plain has 500 m, and a pit of 450 m.
    let north = 47.2 + 10.4 * cell;
    let raster = Raster::geographic(8.49, north, cell, [200, 21]);
    raster.write(&folder.path().join("plain.tif"), |lon, lat| {
        let is_at = |column: f64, row: f64| {
            (lon - 8.49 - column * cell).abs() < 0.1 * cell
                && (lat - north + row * cell).abs() < 0.1 * cell
        };
        if is_at(80.0, 9.0) {
            900.0
        } else if is_at(60.0, 11.0) {
            450.0
        } else {
            500.0
        }
    });
    let text = "[geometry]\naltitude_m = 60\naltitude_max_m = 100\nmin_separation_m = 4\n\
        [site]\ntx = { lat_deg = 47.2, lon_deg = 8.5, amsl_m = 500 }\nrx = { lat_deg = 47.2, lon_deg = 8.53, amsl_m = 500 }\n\
        [power]\ntx_w = 5\nuav_w = 1\n[terrain]\nfiles = [\"plain.tif\"]\nmast_m = 10\n\
        [[interferer]]\npower_w = 1\nx_m = 1000\ny_m = 800\n";
    std::fs::write(path("plain.toml"), text).unwrap();
    let bundle = path("bundle");
    let scenario = path("plain.toml");
    let options = format!("--scenario {scenario} --uavs 2 --bundle {bundle}");
    let (status, _, line) = provision(&options);
    assert_eq!(status, Some(0), "{line}");
    for relay in ["relay1", "relay2"] {
        let read = |name: &str| {
            std::fs::read_to_string(folder.path().join("bundle").join(relay).join(name)).unwrap()
        };
        let px4 = read("px4.params");
        let own = px4
            .lines()
            .find(|line| line.contains("RTL_RETURN_ALT"))
            .unwrap();
        let return_m: f64 = own.split('\t').nth(3).unwrap().parse().unwrap();
        // Also from the pit the altitude is above the peak.
        assert!(450.0 + return_m >= 910.0 && return_m < 520.0, "{own}");
        let page = read("page.txt");
        let said = format!("return to launch: {return_m:.0} m above home");
        assert!(
            page.contains(&said)
                && page.contains("lowest and highest ground on these ways home: 450.0 and 9"),
            "{page}"
        );
        assert!(read("ardupilot.parm").contains(&format!("RTL_ALT,{}\n", 100.0 * return_m)));
    }
    // Without terrain drones return above the chain.
    let (plain, _) = text.split_once("[terrain]").unwrap();
    let (_, interferer) = text.split_once("mast_m = 10\n").unwrap();
    std::fs::write(path("flat.toml"), format!("{plain}{interferer}")).unwrap();
    let [scenario, bundle] = ["flat.toml", "flat"].map(path);
    let options = format!("--scenario {scenario} --uavs 2 --bundle {bundle}");
    let (status, _, line) = provision(&options);
    assert_eq!(status, Some(0), "{line}");
    let px4 = std::fs::read_to_string(folder.path().join("flat/relay1/px4.params")).unwrap();
    assert!(px4.contains("RTL_RETURN_ALT\t110\t"), "{px4}");
}

/// Checks that a plan without `--out` also says if its relays can fly to it.
#[test]
fn a_plan_that_relays_cannot_fly_is_refused_without_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let of = |more: &str| run(&format!("--scenario {EXAMPLE} --altitude terrain {more}"));
    let (status, table, line) = of("--uavs 3");
    let blocked =
        "at the positions on which 3 relays would agree, hop 4 (relay 3 to Rx) is blocked";
    assert!(
        status == Some(1) && line.contains(blocked) && line.contains("give another --uavs"),
        "{line}"
    );
    assert!(table.contains("simulated flight: worst hop "), "{table}");
    let (status, json, _) = of("--uavs 3 --json");
    let report: Value = serde_json::from_str(&json).unwrap();
    assert!(status == Some(1) && report["error"].as_str().unwrap().starts_with(blocked));
    assert_eq!(report["flight"]["relays"].as_array().unwrap().len(), 3);
    let (status, _, line) = of("--uavs 3 --allow-blocked");
    assert_eq!((status, line.as_str()), (Some(0), ""));
    // The simulated flight is the same with and without a file.
    let [(status, json, _), (_, written, _)] =
        [String::new(), format!(" --out {}", path("four.toml"))]
            .map(|out| of(&format!("--uavs 4 --json{out}")));
    let [alone, written] =
        [json, written].map(|json| -> Value { serde_json::from_str(&json).unwrap() });
    assert_eq!(status, Some(0));
    assert!(alone["flight"].is_object() && alone == written, "{alone}");
    // Relays that use one hypothetical interferer fly to other positions than the planned ones.
    let text = std::fs::read_to_string(EXAMPLE).unwrap();
    let hills = std::path::absolute("../../examples/hills.tif").unwrap();
    let text = text.replace("hills.tif", hills.to_str().unwrap());
    let text = text
        .replace("\naltitude_m = 60.0", "\naltitude_m = 150.0")
        .replace("max_m = 120.0", "max_m = 300.0");
    let (sections, _) = text.split_once("[[interferer]]").unwrap();
    let interferer = |places: &[[f64; 2]]| {
        let each = places
            .iter()
            .map(|[x, y]| format!("[[interferer]]\npower_w = 2.0\nx_m = {x}\ny_m = {y}\n"));
        format!("{sections}{}", each.collect::<String>())
    };
    std::fs::write(
        path("two.toml"),
        interferer(&[[500.0, 900.0], [4500.0, 900.0]]),
    )
    .unwrap();
    let (_, json, line) = run(&format!(
        "--scenario {} --uavs 4 --altitude given --allow-blocked --json",
        path("two.toml")
    ));
    let report: Value = serde_json::from_str(&json).unwrap();
    let x = |at: &Value| at["x_m"].as_f64().unwrap();
    let places = report["relays"].as_array().unwrap().iter();
    let flown = report["flight"]["relays"].as_array().unwrap().iter();
    let off_m = places
        .zip(flown)
        .map(|(plan, flown)| (x(plan) - x(flown)).abs());
    assert!(off_m.fold(0.0, f64::max) > 1.0, "{json} {line}");
    // Relays cannot compute with an area: it has no single position.
    let area = "[[interferer]]\npower_w = 2.0\narea = { circle = [2000, 1500, 200] }\n";
    std::fs::write(path("area.toml"), format!("{sections}{area}")).unwrap();
    let area = format!(
        "--scenario {} --uavs 4 --altitude terrain",
        path("area.toml")
    );
    let why = "relays compute with one position of an interferer, and this scenario has an interferer.area";
    let (status, table, line) = run(&area);
    assert!(
        status == Some(0)
            && table.contains(&format!("flight over the terrain not simulated: {why}")),
        "{table} {line}"
    );
    let (_, json, _) = run(&format!("{area} --json"));
    let report: Value = serde_json::from_str(&json).unwrap();
    assert!(report["flight_not_simulated"] == why && report["flight"].is_null());
}

#[test]
fn wrong_elevation_files_and_options_are_named_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    Raster::geographic(8.495, 47.205, 1.0 / 3600.0, [100, 37])
        .write(&folder.path().join("half.tif"), |_, _| 490.0);
    let text = std::fs::read_to_string(EXAMPLE).unwrap();
    let write = |name: &str, from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        std::fs::write(folder.path().join(name), text.replace(from, to)).unwrap();
    };
    let swapped = "lat_deg = 8.510, lon_deg = 47.20";
    write("swapped.toml", "lat_deg = 47.20, lon_deg = 8.510", swapped);
    let both = text.replace(
        "lat_deg = 47.20, lon_deg = 8.5",
        "lon_deg = 47.20, lat_deg = 8.5",
    );
    std::fs::write(folder.path().join("both.toml"), both).unwrap();
    write("none.toml", "[\"hills.tif\"]", "[]");
    write("deep.toml", "amsl_m = 500.0", "amsl_m = 400.0");
    let most = "above_ground_max_m = 120.0";
    write("least.toml", most, "above_ground_max_m = 20.0");
    let narrow = "above_ground_max_m = 30.1\nerror_m = 50.0";
    write("narrow.toml", most, narrow);
    let hills = "../../examples/hills.tif";
    let scenario = format!("--scenario {EXAMPLE}");
    let of = |name: &str| format!("--scenario {}", path(name));
    let banded = text
        .replace("above_ground_max_m = 120.0\n", "")
        .replace("altitude_max_m = 160.0", "altitude_max_m = 21.0")
        .replace("\naltitude_m = 60.0", "\naltitude_m = 20.5");
    std::fs::write(folder.path().join("banded.toml"), banded).unwrap();
    let name = folder.path().display().to_string();
    let mut all = String::new();
    for arguments in [
        format!("--uavs 3 --dem {hills}"),
        format!("--uavs 3 {scenario} --dem {}", path("missing.tif")),
        format!("--uavs 3 {scenario} --dem {}", path("half.tif")),
        format!("--uavs 3 {}", of("swapped.toml")),
        format!("--uavs 3 {} --dem {hills}", of("both.toml")),
        format!("--uavs 3 {}", of("none.toml")),
        format!("--uavs 3 {}", of("least.toml")),
        format!("--uavs 3 {} --dem {hills}", of("deep.toml")),
        format!("--uavs 3 --profile {}", path("p.svg")),
        "--uavs 3 --altitude terrain".to_owned(),
        format!("--uavs 3 {scenario} --altitude terrain --bandwidth-hz 1e7"),
        format!("--target-sir 3 {scenario} --altitude terrain"),
        // These are requests that cannot be met: status 1.
        format!(
            "--uavs 3 --altitude terrain {} --dem {hills}",
            of("narrow.toml")
        ),
        format!(
            "--uavs 40 --altitude terrain {} --dem {hills}",
            of("banded.toml")
        ),
    ] {
        let (status, _, line) = run(&arguments);
        assert_eq!(line.trim_end().lines().count(), 1, "{arguments}: {line}");
        let line = line.replace(&name, "FOLDER");
        write!(all, "{} {line}", status.unwrap()).unwrap();
    }
    insta::assert_snapshot!(all);
}
