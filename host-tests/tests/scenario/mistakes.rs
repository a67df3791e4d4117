//! Missing, unknown, contradictory and unreadable contents; the error lines are in `snapshots`.

use std::path::{Path, PathBuf};

use super::*;

fn in_field(text: &str) -> String {
    format!("{GEOMETRY}{POWER}{text}")
}

#[test]
fn every_table_refuses_unknown_keys_and_lists_its_own() {
    insta::assert_snapshot!(refusals(&[
        small("").replacen("[geometry]", "speed = 3\n[geometry]", 1),
        small("[channnel]\ncarrier_hz = 2e9\n"),
        small("").replacen("distance_m", "distnce_m = 5\ndistance_m", 1),
        small("").replacen("tx_w", "tx_mw = 5\ntx_w", 1),
        small("[channel]\neta = 'x'\n"),
        small("z_m = 1\n"),
        small("[[relay]]\nindex = 1\nx = 2\n"),
        in_field("[field]\nmax = 1\n"),
        in_field("[field]\ni_max_w = 1\nbeta = [{ gamma = 1 }]\n"),
        small("[noise]\nfloor_dbm = -100\n"),
        small("[link]\nrate = 3\n"),
        small("[link]\nsteps = [{ sinr = 3 }]\n"),
        // Keys that are nearly right, and one that is not.
        small("").replace("distance_m", "distnce_m"),
        small("").replace("[geometry]", "[geometri]"),
        small("[[relays]]\nindex = 1\npower_w = 1\n"),
        small("").replace("tx_w", "txw"),
        in_field(FIELD).replace("alpha", "alfa"),
        small("[wind]\nspeed = 3\n"),
    ]));
}

#[test]
fn a_table_is_not_a_list_and_a_list_is_not_a_table() {
    insta::assert_snapshot!(refusals(&[
        format!("geometry = [1000, 20]\n{POWER}{INTERFERER}"),
        format!("geometry = 3\n{POWER}{INTERFERER}"),
        small("").replace("[[interferer]]", "[interferer]"),
        small("[relay]\nindex = 1\n"),
        format!("relay = [4]\n{}", small("")),
        format!("[[field]]\n{GEOMETRY}{POWER}"),
        in_field("[field]\ni_max_w = 1\nbeta = 2\n"),
        format!("interferer = []\n{GEOMETRY}{POWER}"),
        in_field("[field]\ni_max_w = 1\nbeta = []\n"),
    ]));
}

#[test]
fn keys_that_contradict_each_other_are_refused() {
    let field = |x: &str| {
        let entry = format!("beta = 2 }}, {{ x_m = {x}, alpha = 4, beta = 2 }}]");
        in_field(FIELD).replace("beta = 2 }]", &entry)
    };
    insta::assert_snapshot!(refusals(&[
        small(FIELD),
        in_field(""),
        small("[[relay]]\nindex = 3\npower_w = 1\n[[relay]]\nindex = 3\naltitude_m = 1\n"),
        small("[[relay]]\nindex = 3\n"),
        field("-1"),
        field("0"),
        field("0.0"),
    ]));
}

#[test]
fn an_impossible_data_link_is_refused() {
    let steps = |second: &str| {
        small(&format!(
            "[link]\nsteps = [{{ sinr_db = 2, bits_per_hz = 0.5 }}, {second}]\n"
        ))
    };
    insta::assert_snapshot!(refusals(&[
        small("[link]\naccess = \"fdma\"\n"),
        small("[link]\nbandwidth_hz = 0\n"),
        small("[link]\nbandwidth_hz = 1e7\n[noise]\nbandwidth_hz = 2e7\n"),
        small("[link]\ngap_db = -1\n"),
        small("[link]\nsteps = []\n"),
        small("[link]\ngap_db = 3\nsteps = [{ sinr_db = 2, bits_per_hz = 0.5 }]\n"),
        steps("{ sinr_db = 2, bits_per_hz = 1 }"),
        steps("{ sinr_db = 5, bits_per_hz = 0.5 }"),
        steps("{ sinr_db = 5, bits_per_hz = 0 }"),
        steps("{ sinr_db = nan, bits_per_hz = 1 }"),
        small("[link]\nreverse = 1.5\n"),
        small("[link]\nreverse = -0.1\n"),
        small("[link]\nreverse = nan\n"),
    ]));
    let both = parse(&small("[link]\nreverse = 0.5\n")).unwrap();
    assert!(both.link.is_none() && (both.reverse - 0.5).abs() < 1e-12);
    // Without noise its bandwidth may be 0.
    let silent = parse(&small(
        "[link]\nbandwidth_hz = 1e7\n[noise]\nbandwidth_hz = 0\n",
    ))
    .unwrap();
    assert_eq!(silent.bandwidth_hz(), Some(1e7));
    let of_noise = parse(&small("[link]\n[noise]\nbandwidth_hz = 2e7\n")).unwrap();
    assert_eq!(of_noise.bandwidth_hz(), Some(2e7));
}

#[test]
fn the_band_holds_the_common_altitude() {
    let band =
        |lines: &str| small("").replace("altitude_m = 20\n", &format!("altitude_m = 20\n{lines}"));
    insta::assert_snapshot!(refusals(&[
        band("altitude_min_m = 20.5\n"),
        band("altitude_min_m = 5\naltitude_max_m = 19\n"),
    ]));
    let wide = parse(&band("altitude_min_m = 5\naltitude_max_m = 90\n")).unwrap();
    assert_eq!((wide.altitude_min_m, wide.altitude_max_m), (5.0, 90.0));
    let half = parse(&band("altitude_max_m = 90\n")).unwrap();
    assert_eq!((half.altitude_min_m, half.altitude_max_m), (20.0, 90.0));
    // A relay's own altitude may be outside the band.
    let own = parse(&small("[[relay]]\nindex = 1\naltitude_m = 300\n")).unwrap();
    assert_eq!(own.relays[&1].altitude_m, Some(300.0));
}

#[test]
fn toml_errors_have_line_and_column() {
    insta::assert_snapshot!(refusals(&[
        small("").replace("altitude_m = 20", "altitude_m = = 20"),
        small("").replace("uav_w = 1", "uav_w = 1\n uav_w = 2"),
        small("[geometry]\n"),
        small("[[relay]\nindex = 1\n"),
        "x = \"never closed".to_owned(),
        "# é\ny = \"é\" é".to_owned(),
        // The parser limits the depth.
        format!("a = {}", "[".repeat(100_000)),
        small("").replace("distance_m = 1000", "distance_m = 99999999999999999999"),
        small("").replace("distance_m = 1000", "distance_m = 1e999"),
    ]));
}

#[test]
fn an_empty_file_is_an_empty_scenario() {
    let files = ["", "\n\n", "  \t\r\n", "# only a remark\n", "\u{feff}"];
    insta::assert_snapshot!(refusals(&files.map(str::to_owned)));
}

#[test]
fn names_with_line_breaks_stay_on_one_line() {
    let error = Scenario::parse("two\nlines\u{2028}.toml", "\"a\\nb\" = 'x'").unwrap_err();
    one_line(
        &error,
        "two\\nlines\\u{2028}.toml",
        &["a\\nb = ", "is not a known key", "geometry"],
    );
    let long = format!("{} = \"{}\"", "k".repeat(5000), "v".repeat(5000));
    refused(&long, Problem::UnknownKey, &["kkk... = \"vvv"]);
}

/// Temporary file, removed on drop.
struct Temporary(PathBuf);

impl Temporary {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let path = std::env::temp_dir().join(format!("uav-relay-{}-{name}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        Self(path)
    }

    fn refused(path: &Path, problem: Problem, parts: &[&str]) {
        let error = Scenario::load(path).unwrap_err();
        one_line(&error, &path.display().to_string(), parts);
        assert_eq!(error.problem, problem, "{error}");
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let missing = std::env::temp_dir().join("uav-relay-there-is-no-such.toml");
    Temporary::refused(
        &missing,
        Problem::NoSuchFile,
        &["no such file", "a readable TOML file"],
    );
    Temporary::refused(
        &std::env::temp_dir(),
        Problem::Directory,
        &["is a directory", "a readable TOML file"],
    );
    let binary = Temporary::new("binary.toml", b"[geometry]\n\xff\xfe");
    Temporary::refused(
        &binary.0,
        Problem::NotUtf8,
        &["byte 0xff at offset 11", "UTF-8 text"],
    );
    let empty = Temporary::new("empty.toml", b"");
    Temporary::refused(&empty.0, Problem::Empty, &["is empty", "[geometry]"]);
    let long = Temporary::new("long.toml", &vec![b'#'; (1 << 20) + 1]);
    Temporary::refused(&long.0, Problem::TooLong, &["too long", "at most 1 MiB"]);
    let range = Temporary::new(
        "range.toml",
        small("").replace("tx_w = 80", "tx_w = -80").as_bytes(),
    );
    Temporary::refused(
        &range.0,
        Problem::OutOfRange,
        &["power.tx_w = -80", "1e-6 to 1e6 W"],
    );
    let good = Temporary::new("good.toml", small("").as_bytes());
    assert_eq!(Scenario::load(&good.0).unwrap(), parse(&small("")).unwrap());
}

#[test]
fn noise_out_of_range_is_refused_with_its_range() {
    let keys = [
        "bandwidth_hz = -1",
        "bandwidth_hz = 2e12",
        "bandwidth_hz = nan",
        "figure_db = -0.1",
        "figure_db = 61",
        "power_dbm = -200.1",
        "power_dbm = 0.1",
        "power_dbm = nan",
    ];
    insta::assert_snapshot!(refusals(
        &keys.map(|key| small(&format!("[noise]\n{key}\n")))
    ));
}

/// Checks that a scenario file with a wrong address of the autopilot is refused.
#[test]
fn an_autopilot_at_no_udp_port_is_refused() {
    let file = |autopilot: &str| small(&format!("[companion]\nautopilot = {autopilot}\n"));
    let wrong = [
        "'udp:'",
        "'udp::14580'",
        "'udp:fc'",
        "'udp:fc:0'",
        "'udp:fc:65536'",
        "'udp:fc:1@'",
        "'udp:fc:1@65536'",
        "'udp:fc:65000'",
        "''",
        "14580",
    ];
    insta::assert_snapshot!(refusals(&wrong.map(file)));
    for good in [
        "'/dev/ttyAMA0'",
        "'fc1'",
        "'udp:localhost:14580'",
        "'udp:[::1]:65535@1'",
        "'udp:10.0.0.2:5760@9000'",
    ] {
        assert!(parse(&file(good)).is_ok(), "{good}");
    }
}
