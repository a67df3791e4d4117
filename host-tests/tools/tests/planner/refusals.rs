//! Error messages, which state what is allowed.

use super::{example, refusal, said};

#[test]
fn what_is_not_there_is_not_planned() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map");
    let map = map.to_str().unwrap();
    let scenario = example("scenario.toml");
    for (arguments, words) in [
        (
            &["--uavs", "3", "--geojson", map][..],
            "default scenario: site: is missing, which --geojson needs; allowed: [site] with tx and rx",
        ),
        (
            &["--uavs", "3", "--kml", map],
            "default scenario: site: is missing, which --kml needs",
        ),
        (
            &["--uavs", "3", "--scenario", &scenario],
            "[[relay]] index = 5: there is no such relay in a chain of 3; allowed: 1 to 3",
        ),
        (
            &["--uavs", "1", "--x-m", "3", "--altitude", "free"],
            "'--x-m <X>'",
        ),
        (
            &["--uavs", "1", "--x-m", "far"],
            "must be a number, metres from Tx",
        ),
        (
            &["--uavs", "1", "--x-m", "3", "--out", map],
            "--x-m 3.0 is not for --out: a relay chooses its place",
        ),
        (
            &[
                "--uavs",
                "3",
                "--altitude",
                "free",
                "--out",
                map,
                "--scenario",
                &example("field.toml"),
            ],
            "--altitude free is not for --out with a [field]",
        ),
        (
            &["--uavs", "3", "--out", "/no/such/folder/plan.toml"],
            "--out /no/such/folder/plan.toml: ",
        ),
        (
            &[
                "--uavs",
                "3",
                "--scenario",
                &example("site.toml"),
                "--kml",
                "/no/such/folder/x.kml",
            ],
            "--kml /no/such/folder/x.kml: ",
        ),
        (&["--uavs", "3", "--force"], "--out"),
        (
            &["--uavs", "ten"],
            "must be a whole number within 1 to 1000",
        ),
        (
            &["--uavs", "99999999999999999999"],
            "must be a whole number within 1 to 1000",
        ),
        (
            &["--uavs", "3", "--altitude", "fre"],
            "must be one of given, free; did you mean free?",
        ),
        (&["--uavs", "3", "--jsn"], "did you mean --json?"),
    ] {
        let (status, line) = refusal(arguments);
        assert_eq!(status, 2, "{arguments:?}: {line}");
        assert!(line.contains(words), "{arguments:?}: {line}");
        assert!(!line.contains("invalid digit"), "{line}");
    }
    assert!(!std::path::Path::new(map).exists());
    // Without a scenario file the message names the numbers and the keys of such a file.
    let (status, line) = refusal(&["--uavs", "300"]);
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
    said(&[
        "--scenario",
        &example("site.toml"),
        "--uavs",
        "3",
        "--geojson",
        &geojson,
        "--kml",
        &kml,
    ]);
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
