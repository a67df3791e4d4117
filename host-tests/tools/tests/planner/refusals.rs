//! Error messages, which state what is allowed.

use std::fmt::Write as _;

use super::{example, refusal, said};

#[test]
fn what_is_not_there_is_not_planned() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map");
    let map = map.to_str().unwrap();
    let examples = example("");
    let mut all = String::new();
    for case in [
        "--uavs 3 --geojson MAP",
        "--uavs 3 --kml MAP",
        "--uavs 3 --scenario EXAMPLES/scenario.toml",
        "--uavs 1 --x-m 3 --altitude free",
        "--uavs 1 --x-m far",
        "--uavs 1 --x-m 3 --out MAP",
        "--uavs 3 --altitude free --out MAP --scenario EXAMPLES/field.toml",
        "--uavs 3 --out /no/such/folder/plan.toml",
        "--uavs 3 --scenario EXAMPLES/site.toml --kml /no/such/folder/x.kml",
        "--uavs 3 --force",
        "--uavs ten",
        "--uavs 99999999999999999999",
        "--uavs 3 --altitude fre",
        "--uavs 3 --jsn",
    ] {
        let options = case.replace("MAP", map).replace("EXAMPLES/", &examples);
        let (status, line) = refusal(&options);
        assert_eq!(status, 2, "{case}: {line}");
        let line = line.replace(map, "MAP").replace(&examples, "EXAMPLES/");
        writeln!(all, "{case}\n    {}", line.trim_end()).unwrap();
    }
    insta::assert_snapshot!(all);
    assert!(!std::path::Path::new(map).exists());
    // Without a scenario file the message names the numbers and the keys of such a file.
    let (status, line) = refusal("--uavs 300");
    assert_eq!(status, 1);
    assert!(
        line.starts_with("no placement: 300 relays that stay 4 m apart need 1196 m, and there are 1000 m from Tx to Rx: fewer relays, or geometry.min_separation_m and geometry.distance_m of a --scenario FILE"),
        "{line}"
    );
}

#[test]
fn maps_are_written_where_there_is_an_earth() {
    let folder = tempfile::tempdir().unwrap();
    let [geojson, kml] = ["plan.geojson", "plan.kml"]
        .map(|name| folder.path().join(name).to_str().unwrap().to_owned());
    said(&format!(
        "--scenario {} --uavs 3 --geojson {geojson} --kml {kml}",
        example("site.toml")
    ));
    let geojson: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(geojson).unwrap()).unwrap();
    // Tx, Rx, three relays, the interferer, four hops.
    assert_eq!(geojson["features"].as_array().unwrap().len(), 10);
    let kml = std::fs::read_to_string(kml).unwrap();
    let kml = roxmltree::Document::parse(&kml).unwrap();
    let places = kml
        .descendants()
        .filter(|node| node.has_tag_name(("http://www.opengis.net/kml/2.2", "Placemark")));
    assert_eq!(places.count(), 10);
}
