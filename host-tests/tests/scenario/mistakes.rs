//! Missing, unknown, contradictory and unreadable contents.

use std::path::{Path, PathBuf};

use uav_relay_scenario::endpoint::EndpointError;

use super::*;

#[test]
fn every_table_refuses_unknown_keys_and_lists_its_own() {
    let field = |body: &str| format!("{GEOMETRY}{POWER}{body}");
    let table = [
        (
            small("").replacen("[geometry]", "speed = 3\n[geometry]", 1),
            "speed = 3",
            "geometry, power, channel, interferer, relay, field",
        ),
        (
            small("[channnel]\ncarrier_hz = 2e9\n"),
            "channnel = { carrier_hz",
            "geometry, power, channel",
        ),
        (
            small("").replacen("distance_m", "distnce_m = 5\ndistance_m", 1),
            "geometry.distnce_m = 5",
            "distance_m, altitude_m, altitude_min_m, altitude_max_m, lateral_min_m, lateral_max_m, min_separation_m",
        ),
        (
            small("").replacen("tx_w", "tx_mw = 5\ntx_w", 1),
            "power.tx_mw = 5",
            "tx_w, tx_dbm, tx_gain_dbi, tx_eirp_dbm, uav_w, uav_dbm, uav_gain_dbi, rx_gain_dbi",
        ),
        (
            small("[channel]\neta = 'x'\n"),
            "channel.eta = \"x\"",
            "carrier_hz, excess_loss_los_db, excess_loss_nlos_db, air_ground",
        ),
        (
            small("z_m = 1\n"),
            "interferer[0].z_m = 1",
            "power_w, power_dbm, gain_dbi, eirp_dbm, x_m, y_m, lat_deg, lon_deg, amsl_m",
        ),
        (
            small("[[relay]]\nindex = 1\nx = 2\n"),
            "relay[0].x = 2",
            "index, altitude_m, power_w",
        ),
        (
            field("[field]\nmax = 1\n"),
            "field.max = 1",
            "i_max_w, beta",
        ),
        (
            field("[field]\ni_max_w = 1\nbeta = [{ gamma = 1 }]\n"),
            "field.beta[0].gamma = 1",
            "x_m, alpha, beta",
        ),
    ];
    for (text, key, keys) in table {
        refused(
            &text,
            Problem::UnknownKey,
            &[key, &format!("the keys {keys}")],
        );
    }
}

#[test]
fn a_key_that_is_nearly_right_is_named() {
    let field = format!("{GEOMETRY}{POWER}{FIELD}");
    for (text, meant) in [
        (small("").replace("distance_m", "distnce_m"), "distance_m"),
        (small("").replace("[geometry]", "[geometri]"), "geometry"),
        (small("[[relays]]\nindex = 1\npower_w = 1\n"), "relay"),
        (small("").replace("tx_w", "txw"), "tx_w"),
        (field.replace("alpha", "alfa"), "alpha"),
    ] {
        let meant = format!("; did you mean {meant}?");
        refused(&text, Problem::UnknownKey, &[&meant]);
    }
    let line = parse(&small("[wind]\nspeed = 3\n"))
        .unwrap_err()
        .to_string();
    assert!(!line.contains("did you mean"), "{line}");
}

#[test]
fn a_table_is_not_a_list_and_a_list_is_not_a_table() {
    let wrong = |text: &str, parts: &[&str]| refused(text, Problem::WrongType, parts);
    wrong(
        &format!("geometry = [1000, 20]\n{POWER}{INTERFERER}"),
        &["geometry = [1000, 20]", "distance_m, altitude_m"],
    );
    wrong(
        &format!("geometry = 3\n{POWER}{INTERFERER}"),
        &["geometry = 3", "a table"],
    );
    refused(
        &small("").replace("[[interferer]]", "[interferer]"),
        Problem::NoList,
        &[
            "interferer = {",
            "[[interferer]] in place of [interferer], a list of 1 or more tables",
        ],
    );
    refused(
        &small("[relay]\nindex = 1\n"),
        Problem::NoList,
        &[
            "relay = {",
            "[[relay]] in place of [relay], a list of tables",
            "index",
        ],
    );
    wrong(
        &format!("relay = [4]\n{}", small("")),
        &["relay[0] = 4", "a table with the keys index"],
    );
    refused(
        &format!("[[field]]\n{GEOMETRY}{POWER}"),
        Problem::NoTable,
        &[
            "field = [{}]",
            "[field] in place of [[field]], a table with the keys i_max_w, beta",
        ],
    );
    wrong(
        &format!("{GEOMETRY}{POWER}[field]\ni_max_w = 1\nbeta = 2\n"),
        &["field.beta = 2", "x_m, alpha, beta"],
    );
    refused(
        &format!("interferer = []\n{GEOMETRY}{POWER}"),
        Problem::EmptyList,
        &["interferer = []", "1 or more"],
    );
    let no_points = format!("{GEOMETRY}{POWER}[field]\ni_max_w = 1\nbeta = []\n");
    refused(
        &no_points,
        Problem::EmptyList,
        &["field.beta = []", "1 or more tables", "alpha"],
    );
}

#[test]
fn keys_that_contradict_each_other_are_refused() {
    let both = small(FIELD);
    refused(
        &both,
        Problem::TwoInterferences,
        &[
            "field = ",
            "1 [[interferer]]",
            "either one [field] or one or more",
        ],
    );
    let none = format!("{GEOMETRY}{POWER}");
    refused(
        &none,
        Problem::NoInterference,
        &["interferer is missing", "either one [field] or one or more"],
    );
    let twice = small("[[relay]]\nindex = 3\npower_w = 1\n[[relay]]\nindex = 3\naltitude_m = 1\n");
    refused(
        &twice,
        Problem::DuplicateRelay,
        &[
            "relay[1].index = 3 is already used",
            "1 to 1000",
            "one [[relay]] only",
        ],
    );
    let idle = small("[[relay]]\nindex = 3\n");
    refused(
        &idle,
        Problem::NothingDiffers,
        &["relay[0].index = 3", "altitude_m, power_w"],
    );
    for x in ["-1", "0", "0.0"] {
        let entry = format!("beta = 2 }}, {{ x_m = {x}, alpha = 4, beta = 2 }}]");
        let text = format!("{GEOMETRY}{POWER}{FIELD}").replace("beta = 2 }]", &entry);
        let key = format!(
            "field.beta[1].x_m = {} is not in increasing order",
            x.trim_end_matches(".0")
        );
        refused(&text, Problem::Unsorted, &[&key, "above 0 ", "to 1e7 m"]);
    }
}

#[test]
fn the_band_holds_the_common_altitude() {
    let band =
        |lines: &str| small("").replace("altitude_m = 20\n", &format!("altitude_m = 20\n{lines}"));
    let min = band("altitude_min_m = 20.5\n");
    refused(
        &min,
        Problem::OutOfRange,
        &["geometry.altitude_min_m = 20.5", "at most altitude_m, 20 m"],
    );
    let max = band("altitude_min_m = 5\naltitude_max_m = 19\n");
    refused(
        &max,
        Problem::OutOfRange,
        &["geometry.altitude_max_m = 19", "at least altitude_m, 20 m"],
    );
    let wide = parse(&band("altitude_min_m = 5\naltitude_max_m = 90\n")).unwrap();
    assert_eq!((wide.altitude_min_m, wide.altitude_max_m), (5.0, 90.0));
    let half = parse(&band("altitude_max_m = 90\n")).unwrap();
    assert_eq!((half.altitude_min_m, half.altitude_max_m), (20.0, 90.0));
    // A relay's own altitude may be outside the band.
    let own = parse(&small("[[relay]]\nindex = 1\naltitude_m = 300\n")).unwrap();
    assert_eq!(own.relays[&1].altitude_m, Some(300.0));
}

#[test]
fn broken_toml_is_placed_by_line_and_column() {
    let broken = small("").replace("altitude_m = 20", "altitude_m = = 20");
    refused(
        &broken,
        Problem::Syntax,
        &["line 3, column 14: altitude_m = = 20", "valid TOML"],
    );
    let twice = small("").replace("uav_w = 1", "uav_w = 1\n uav_w = 2");
    refused(
        &twice,
        Problem::Syntax,
        &["line 7, column 2: uav_w = 2", "duplicate key"],
    );
    refused(
        &small("[geometry]\n"),
        Problem::Syntax,
        &["line 11, column", "duplicate key"],
    );
    refused(
        &small("[[relay]\nindex = 1\n"),
        Problem::Syntax,
        &["line 11, column"],
    );
    refused("x = \"never closed", Problem::Syntax, &["line 1, column"]);
    refused(
        "# é\ny = \"é\" é",
        Problem::Syntax,
        &["line 2, column 9: y = \"é\" é"],
    );
    // The parser limits the depth.
    refused(
        &format!("a = {}", "[".repeat(100_000)),
        Problem::Syntax,
        &["line 1, column"],
    );
    // A number too large for its notation is reported by whichever pass finds it.
    let huge = small("").replace("distance_m = 1000", "distance_m = 99999999999999999999");
    one_line(
        &parse(&huge).unwrap_err(),
        "flight.toml",
        &["distance_m", "99999999999999999999"],
    );
    let huge = small("").replace("distance_m = 1000", "distance_m = 1e999");
    one_line(&parse(&huge).unwrap_err(), "flight.toml", &["distance_m"]);
}

#[test]
fn a_file_of_nothing_is_empty() {
    for text in ["", "\n\n", "  \t\r\n", "# only a remark\n", "\u{feff}"] {
        refused(
            text,
            Problem::Empty,
            &[
                "is empty",
                "[geometry], [power] and [[interferer]] or [field]",
            ],
        );
    }
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
    for (text, key, range) in [
        (
            "bandwidth_hz = -1\n",
            "noise.bandwidth_hz = -1",
            "0 to 1e12 Hz",
        ),
        (
            "bandwidth_hz = 2e12\n",
            "noise.bandwidth_hz = 2000000000000.0",
            "0 to 1e12 Hz",
        ),
        ("bandwidth_hz = nan\n", "noise.bandwidth_hz", "0 to 1e12 Hz"),
        ("figure_db = -0.1\n", "noise.figure_db = -0.1", "0 to 60 dB"),
        ("figure_db = 61\n", "noise.figure_db = 61", "0 to 60 dB"),
    ] {
        let text = small(&format!("[noise]\n{text}"));
        refused(&text, Problem::OutOfRange, &[key, range]);
    }
    refused(
        &small("[noise]\nfloor_dbm = -100\n"),
        Problem::UnknownKey,
        &["noise.floor_dbm", "bandwidth_hz, figure_db, power_dbm"],
    );
    for value in ["-200.1", "0.1", "nan"] {
        refused(
            &small(&format!("[noise]\npower_dbm = {value}\n")),
            Problem::OutOfRange,
            &["noise.power_dbm = ", "-200 to 0 dBm"],
        );
    }
}

/// Checks that every program validates the address, before the flight.
#[test]
fn an_autopilot_at_no_udp_port_is_refused() {
    let file = |autopilot: &str| small(&format!("[companion]\nautopilot = {autopilot}\n"));
    for (autopilot, error, said) in [
        ("'udp:'", EndpointError::NoHost, "has no HOST"),
        ("'udp::14580'", EndpointError::NoHost, "has no HOST"),
        ("'udp:fc'", EndpointError::NoPort, "has no PORT"),
        ("'udp:fc:0'", EndpointError::NoPort, "has no PORT"),
        ("'udp:fc:65536'", EndpointError::NoPort, "has no PORT"),
        ("'udp:fc:1@'", EndpointError::NoLocal, "has a LOCAL"),
        ("'udp:fc:1@65536'", EndpointError::NoLocal, "has a LOCAL"),
        (
            "'udp:fc:65000'",
            EndpointError::NoDefault { port: 65_000 },
            "needs @LOCAL, because the default, PORT + 1000 = 66000, is no port",
        ),
    ] {
        let text = autopilot.replace('\'', "\"");
        let key = format!("companion.autopilot = {text} {said}");
        let allowed = "udp:HOST:PORT@LOCAL, PORT and LOCAL within 1 to 65535";
        refused(
            &file(autopilot),
            Problem::NoEndpoint(error),
            &[&key, "a tty, or udp:HOST:PORT", allowed],
        );
    }
    refused(
        &file("''"),
        Problem::OutOfRange,
        &["companion.autopilot = \"\"", "a tty, or"],
    );
    refused(
        &file("14580"),
        Problem::WrongType,
        &["companion.autopilot = 14580", "a tty, or"],
    );
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
