//! What relays that listen are simulated with.

use super::{json, refusal};

const TOML: &str =
    "[geometry]\ndistance_m = 1000\naltitude_m = 20\n[power]\ntx_w = 80\nuav_w = 1\n[listen]\n";

#[test]
fn what_is_heard_comes_from_an_interferer() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("listen.toml");
    std::fs::write(&file, TOML).unwrap();
    let name = file.to_str().unwrap();
    let (status, text) = refusal(&["--scenario", name, "--uavs", "3", "--listen"]);
    assert_eq!(status, 2, "{text}");
    assert!(text.contains("interferer: is missing"), "{text}");
    let source = "[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";
    std::fs::write(&file, format!("{TOML}following = true\n{source}")).unwrap();
    let options = [
        "--scenario",
        name,
        "--uavs",
        "3",
        "--listen",
        "--listen-for",
        "30",
    ];
    assert!(json(&options)["sir"].is_number());
}
