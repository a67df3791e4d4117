//! Plans as map files, read by independent libraries and compared with GeographicLib.

use std::path::Path;

use host_tests::python;
use serde_json::{Value, json};
use uav_relay::Placement;
use uav_relay_scenario::Scenario;
use uav_relay_tools::plan::map::{Map, geojson, kml};
use uav_relay_tools::plan::{Plan, PlanRequest, plan};

/// Largest permitted error of a position in the map files, m.
const ALLOWED_M: f64 = 0.01;

fn best(scenario: &Scenario, relays: u16) -> Plan {
    let ask = PlanRequest::of(relays, scenario.lateral_max_m > 0.0, 1e-4);
    plan(scenario, &ask).unwrap()
}

/// Writes the plan as GeoJSON and KML, and checks both files. Returns the values that independent libraries read from the files.
fn read(scenario: &Scenario, plan: &Plan) -> Value {
    let line = scenario.line.unwrap();
    let map = Map::new(scenario, plan).unwrap();
    assert!(map.left_out.is_empty());
    let degrees = |unit: i32| f64::from(unit) / 1e7;
    let ends = line
        .sites
        .map(|at| [degrees(at.lat_e7), degrees(at.lon_e7)]);
    let mut places = vec![[0.0, 0.0], [line.axis.distance_m(), 0.0]];
    let f64s = |place: &Placement| [place.x_m, place.y_m].map(f64::from);
    places.extend(plan.places.iter().map(|(place, _)| f64s(place)));
    places.extend(scenario.sources().iter().map(|(_, x, y)| [*x, *y]));
    let given = json!({
        "geojson": geojson(&map),
        "kml": kml(&map, "a <plan> & \"more\"").unwrap(),
        "line": ends,
        "places": places,
    });
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/map/check.py");
    let found = python::output(&script, &[], &given.to_string());
    let found: Value = serde_json::from_str(&found).unwrap();

    assert_eq!(found["type"], "FeatureCollection");
    assert_eq!(found["geojson_errors"], json!([]));
    assert_eq!(found["kml_valid"], true, "{found}");
    for off in ["geojson_off_m", "kml_off_m"] {
        let off_m = found[off].as_f64().unwrap();
        println!("{off}: {off_m:.4}");
        assert!(off_m < ALLOWED_M, "{off}: {off_m}");
    }
    assert_eq!(found["kml_modes"], json!(["absolute"]));
    assert_eq!(found["finite"], true);
    let hops = plan.places.len() + 1;
    assert_eq!(found["kml_hops"], hops);
    assert_eq!(found["lines"].as_array().unwrap().len(), hops);
    // The map and `flight` give the same coordinates.
    let text = geojson(&map);
    for (place, _) in &plan.places {
        let at = line.axis.point(*place).unwrap();
        for unit in [at.lat_e7, at.lon_e7] {
            let number = format!("{}", degrees(unit));
            assert!(text.contains(&number), "{number} is not in {text}");
        }
    }
    found
}

fn example(file: &str) -> Scenario {
    Scenario::load(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../examples")
            .join(file),
    )
    .unwrap()
}

#[test]
fn other_programs_read_the_plan_at_its_position() {
    let scenario = example("decibels.toml");
    let plan = best(&scenario, 7);
    let found = read(&scenario, &plan);
    let kinds = [&["tx", "rx"][..], &["relay"; 7], &["interferer"]].concat();
    assert_eq!(found["geojson_kinds"], json!(kinds));
    // With the geoid there is a third number, the height above the ellipsoid.
    assert_eq!(found["geojson_dimensions"], json!([3]));
    let line = scenario.line.unwrap();
    let amsl: Vec<f64> = plan
        .places
        .iter()
        .map(|(place, _)| f64::from(line.axis.point(*place).unwrap().amsl_mm) / 1e3)
        .collect();
    let shown = found["kml_amsl_m"].as_array().unwrap();
    for (shown, amsl) in shown[2..].iter().zip(&amsl) {
        assert!(
            (shown.as_f64().unwrap() - amsl).abs() < 1e-3,
            "{shown} {amsl}"
        );
    }
    let [from, to] = [
        &found["lines"][3]["coordinates"][0],
        &found["lines"][3]["coordinates"][1],
    ];
    assert!(
        (from[2].as_f64().unwrap() - amsl[2] - 47.3).abs() < 1e-6,
        "{from}"
    );
    assert!(
        (to[2].as_f64().unwrap() - amsl[3] - 47.3).abs() < 1e-6,
        "{to}"
    );
}

#[test]
fn without_a_geoid_no_height_is_written() {
    let scenario = example("site.toml");
    let found = read(&scenario, &best(&scenario, 4));
    assert_eq!(found["geojson_dimensions"], json!([2]));
}

/// Checks that a chain across the antimeridian is drawn with its middle hop cut in two.
#[test]
fn a_line_across_the_antimeridian_is_cut() {
    let text = "[geometry]\naltitude_m = 30\naltitude_max_m = 90\nlateral_min_m = -200\nlateral_max_m = 200\n\
        [site]\ntx = { lat_deg = -17, lon_deg = 179.99, amsl_m = 3 }\nrx = { lat_deg = -17.01, lon_deg = -179.99, amsl_m = 40 }\n\
        [power]\ntx_dbm = 49\nuav_dbm = 30\n[[interferer]]\npower_dbm = 45\nx_m = 900\ny_m = 150\n";
    let scenario = Scenario::parse("antimeridian.toml", text).unwrap();
    let found = read(&scenario, &best(&scenario, 5));
    let lines = found["lines"].as_array().unwrap();
    let cut: Vec<&Value> = lines
        .iter()
        .filter(|line| line["type"] == "MultiLineString")
        .collect();
    assert_eq!(cut.len(), 1, "{lines:?}");
    let parts = &cut[0]["coordinates"];
    let lon = |part: usize, end: usize| parts[part][end][0].as_f64().unwrap();
    assert_eq!((lon(0, 1), lon(1, 0)), (180.0, -180.0));
    assert!(lon(0, 0) > 179.98 && lon(1, 1) < -179.98, "{parts}");
    for line in lines.iter().filter(|line| line["type"] == "LineString") {
        let [from, to] = [0, 1].map(|end| line["coordinates"][end][0].as_f64().unwrap());
        assert!((from - to).abs() < 1.0, "{line}");
    }
}

#[test]
fn a_line_without_sites_is_on_no_map() {
    let scenario = Scenario::default();
    let why = Map::new(&scenario, &best(&scenario, 2)).unwrap_err();
    assert!(
        why.starts_with("site: is missing; allowed: [site] with tx and rx"),
        "{why}"
    );
}

#[test]
fn an_interferer_too_far_to_draw_is_left_out_with_a_note() {
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/site.toml"),
    )
    .unwrap();
    let scenario =
        Scenario::parse("far.toml", &text.replace("y_m = 400.0", "y_m = 40000.0")).unwrap();
    let map = Map::new(&scenario, &best(&scenario, 2)).unwrap();
    assert_eq!(map.left_out, [1]);
    assert!(
        map.features
            .iter()
            .all(|feature| feature.kind != "interferer")
    );
}
