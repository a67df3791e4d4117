//! Scenario files: what a good one means, and that every mistake in one is told in one line that helps.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use uav_relay_sim::scenario::{
    AirGround, BetaPoint, ChannelSpec, Field, Interference, Problem, RelayOverride, Scenario,
    ScenarioError, Source,
};

/// Smallest files that parse: one with an interferer, one with a field.
const GEOMETRY: &str = "[geometry]\ndistance_m = 1000\naltitude_m = 20\n";
const POWER: &str = "[power]\ntx_w = 80\nuav_w = 1\n";
const INTERFERER: &str = "[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";
const FIELD: &str = "[field]\ni_max_w = 1e-9\nbeta = [{ x_m = 0, alpha = 4, beta = 2 }]\n";

fn small(extra: &str) -> String {
    format!("{GEOMETRY}{POWER}{INTERFERER}{extra}")
}

fn parse(text: &str) -> Result<Scenario, ScenarioError> {
    Scenario::parse("flight.toml", text)
}

/// Asserts that `text` is refused for `problem`, in one line with the file and all of `parts`.
fn refused(text: &str, problem: Problem, parts: &[&str]) {
    let error = parse(text).expect_err(text);
    one_line(&error, "flight.toml", parts);
    assert_eq!(error.problem, problem, "{error}\n{text}");
}

fn one_line(error: &ScenarioError, file: &str, parts: &[&str]) {
    let line = error.to_string();
    assert_eq!(line.lines().count(), 1, "{line:?}");
    assert!(!line.chars().any(char::is_control), "{line:?}");
    assert!(line.chars().count() < 400, "too long to read: {line}");
    assert!(line.starts_with(&format!("{file}: ")), "{line}");
    for part in parts {
        assert!(line.contains(part), "no {part:?} in: {line}");
    }
}

/// Every scalar key: where it is, the file around it (`@` stands for its value), a value just below the range, one
/// just above it, both ends that are allowed, and how a message tells the range.
struct Row {
    key: &'static str,
    file: String,
    below: &'static str,
    low: &'static str,
    high: &'static str,
    above: &'static str,
    range: &'static str,
}

type Values = [&'static str; 4];

const ALTITUDES: (Values, &str) = (["0.0999", "0.1", "1e5", "100000.1"], "0.1 to 1e5 m");
const POWERS: (Values, &str) = (["0.9e-6", "1e-6", "1e6", "1000001"], "1e-6 to 1e6 W");
const PLACES: (Values, &str) = (["-10000001", "-1e7", "1e7", "1.01e7"], "-1e7 to 1e7 m");
const LOSSES: (Values, &str) = (["-0.01", "0.0", "200.0", "200.1"], "0 to 200 dB");

fn row(key: &'static str, file: String, values: (Values, &'static str)) -> Row {
    let ([below, low, high, above], range) = values;
    Row {
        key,
        file,
        below,
        low,
        high,
        above,
        range,
    }
}

fn geometry_and_power_rows() -> Vec<Row> {
    let geometry = |lines: &str| format!("[geometry]\n{lines}\n{POWER}{INTERFERER}");
    let power = |lines: &str| format!("{GEOMETRY}{INTERFERER}[power]\n{lines}\n");
    let distances = (["0.99", "1", "1e6", "1000000.5"], "1 to 1e6 m");
    let separations = (["-1e-9", "0", "1e5", "100001"], "0 to 1e5 m");
    let low = "distance_m = 9\naltitude_m = 1e5\naltitude_min_m = @";
    let high = "distance_m = 9\naltitude_m = 0.1\naltitude_max_m = @";
    let left = "distance_m = 9\naltitude_m = 9\nlateral_min_m = @";
    let right = "distance_m = 9\naltitude_m = 9\nlateral_max_m = @";
    let lefts = (["-100001", "-1e5", "0", "0.5"], "-1e5 to 0 m");
    let rights = (["-0.5", "0", "1e5", "100001"], "0 to 1e5 m");
    let apart = "distance_m = 9\naltitude_m = 9\nmin_separation_m = @";
    vec![
        row(
            "geometry.distance_m",
            geometry("distance_m = @\naltitude_m = 20"),
            distances,
        ),
        row(
            "geometry.altitude_m",
            geometry("distance_m = 9\naltitude_m = @"),
            ALTITUDES,
        ),
        row("geometry.altitude_min_m", geometry(low), ALTITUDES),
        row("geometry.altitude_max_m", geometry(high), ALTITUDES),
        row("geometry.lateral_min_m", geometry(left), lefts),
        row("geometry.lateral_max_m", geometry(right), rights),
        row("geometry.min_separation_m", geometry(apart), separations),
        row("power.tx_w", power("tx_w = @\nuav_w = 1"), POWERS),
        row("power.uav_w", power("tx_w = 1\nuav_w = @"), POWERS),
    ]
}

fn channel_and_interferer_rows() -> Vec<Row> {
    let channel = |lines: &str| small(&format!("[channel]\n{lines}\n"));
    let source = |lines: &str| small(&format!("[[interferer]]\n{lines}\n"));
    let carriers = (["999999", "1e6", "1e12", "1.1e12"], "1e6 to 1e12 Hz");
    let links = (
        ["-0.01", "0", "1", "1.01"],
        "\"los\", \"nlos\" or a number, 0 to 1",
    );
    let powers = (["0", "1e-6", "1e9", "1e10"], "1e-6 to 1e9 W");
    let los = "excess_loss_los_db = @\nexcess_loss_nlos_db = 200";
    let nlos = "excess_loss_los_db = 0\nexcess_loss_nlos_db = @";
    vec![
        row("channel.carrier_hz", channel("carrier_hz = @"), carriers),
        row("channel.excess_loss_los_db", channel(los), LOSSES),
        row("channel.excess_loss_nlos_db", channel(nlos), LOSSES),
        row("channel.air_ground", channel("air_ground = @"), links),
        row(
            "interferer[1].power_w",
            source("power_w = @\nx_m = 0\ny_m = 0"),
            powers,
        ),
        row(
            "interferer[1].x_m",
            source("power_w = 1\nx_m = @\ny_m = 0"),
            PLACES,
        ),
        row(
            "interferer[1].y_m",
            source("power_w = 1\nx_m = 0\ny_m = @"),
            PLACES,
        ),
    ]
}

fn relay_and_field_rows() -> Vec<Row> {
    let first = "[[relay]]\nindex = 7\naltitude_m = 9\n";
    let relay = |lines: &str| small(&format!("{first}[[relay]]\n{lines}\n"));
    let field = |lines: &str| format!("{GEOMETRY}{POWER}[field]\n{lines}\n");
    let beta = |entry: &str| field(&format!("i_max_w = 1\nbeta = [{entry}]"));
    let indices = (["0", "1", "1000", "1001"], "a whole number, 1 to 1000");
    let bounds = (["0", "1e-30", "1e6", "1.1e6"], "1e-30 to 1e6 W");
    let alphas = (["1.0", "1.0000001", "1e6", "1.1e6"], "above 1 to 1e6");
    let betas = (["0.0", "1e-9", "1e6", "1.1e6"], "above 0 to 1e6");
    let bound = "i_max_w = @\nbeta = [{ x_m = 0, alpha = 4, beta = 2 }]";
    vec![
        row("relay[1].index", relay("index = @\npower_w = 1"), indices),
        row(
            "relay[1].altitude_m",
            relay("index = 1\naltitude_m = @"),
            ALTITUDES,
        ),
        row("relay[1].power_w", relay("index = 1\npower_w = @"), POWERS),
        row("field.i_max_w", field(bound), bounds),
        row(
            "field.beta[0].x_m",
            beta("{ x_m = @, alpha = 2, beta = 2 }"),
            PLACES,
        ),
        row(
            "field.beta[0].alpha",
            beta("{ x_m = 0, alpha = @, beta = 2 }"),
            alphas,
        ),
        row(
            "field.beta[0].beta",
            beta("{ x_m = 0, alpha = 2, beta = @ }"),
            betas,
        ),
    ]
}

fn rows() -> Vec<Row> {
    let mut rows = geometry_and_power_rows();
    rows.extend(channel_and_interferer_rows());
    rows.extend(relay_and_field_rows());
    rows
}

#[test]
fn every_key_has_a_row() {
    // The tables tell their own keys when asked for one they do not have.
    let field = format!("{GEOMETRY}{POWER}[field]\n");
    let beta = format!("{field}i_max_w = 1\nbeta = [{{ nil = 1 }}]\n");
    let mut keys = Vec::new();
    for (table, text) in [
        (
            "geometry.",
            small("").replace("[geometry]", "[geometry]\nnil = 1"),
        ),
        ("power.", small("").replace("[power]", "[power]\nnil = 1")),
        ("channel.", small("[channel]\nnil = 1\n")),
        ("interferer[1].", small("[[interferer]]\nnil = 1\n")),
        ("relay[1].", small("[[relay]]\nnil = 1\n")),
        ("field.", format!("{field}nil = 1\n")),
        ("field.beta[0].", beta),
    ] {
        let error = parse(&text).unwrap_err();
        let names = error.allowed.strip_prefix("the keys ").unwrap();
        keys.extend(names.split(", ").map(|name| format!("{table}{name}")));
    }
    // Not a scalar.
    keys.retain(|key| key != "field.beta");
    assert_eq!(keys, rows().iter().map(|row| row.key).collect::<Vec<_>>());
}

#[test]
fn every_key_takes_both_ends_of_its_range() {
    for row in rows() {
        for value in [row.low, row.high] {
            let text = row.file.replace('@', value);
            if let Err(error) = parse(&text) {
                panic!("{} = {value}: {error}\n{text}", row.key);
            }
        }
    }
}

#[test]
fn every_key_refuses_what_is_out_of_its_range() {
    for row in rows() {
        for value in [row.below, row.above, "nan", "inf", "-inf"] {
            let problem = match value {
                // A relay's number is a whole one: these are not even of its type.
                "nan" | "inf" | "-inf" if row.key.ends_with("index") => Problem::WrongType,
                _ => Problem::OutOfRange,
            };
            let shown = toml::Value::to_string(
                &format!("v = {value}").parse::<toml::Table>().unwrap()["v"],
            );
            let parts = [&format!("{} = {shown} ", row.key), row.range];
            refused(&row.file.replace('@', value), problem, &parts);
        }
    }
}

#[test]
fn every_key_refuses_another_type() {
    for row in rows() {
        for value in [
            "\"ten\"",
            "true",
            "[1.0]",
            "{ a = 1 }",
            "1979-05-27",
            "[]",
            "\"\"\"two\nlines\"\"\"",
        ] {
            // A line break in a value is told as an escape.
            let first = value.lines().next().unwrap().trim_start_matches("\"\"\"");
            let parts = [&format!("{} = ", row.key), first, row.range];
            refused(&row.file.replace('@', value), Problem::WrongType, &parts);
        }
    }
    let index = small("[[relay]]\nindex = 1.0\npower_w = 1\n");
    refused(
        &index,
        Problem::WrongType,
        &["relay[0].index = 1.0", "a whole number, 1 to 1000"],
    );
}

#[test]
fn every_required_key_is_missed() {
    let optional = [
        "altitude_min_m",
        "altitude_max_m",
        "lateral_min_m",
        "lateral_max_m",
        "min_separation_m",
        "channel.",
        "relay[1].a",
        "relay[1].p",
    ];
    let mut missed = 0;
    for row in rows() {
        let name = row.key.rsplit('.').next().unwrap();
        let inline = row
            .file
            .replace(&format!("{name} = @,"), "")
            .replace(&format!(", {name} = @ "), "");
        let text = inline.replace(&format!("{name} = @\n"), "");
        assert!(!text.contains('@'), "{text}");
        if optional.iter().any(|key| row.key.contains(key)) {
            continue;
        }
        refused(
            &text,
            Problem::Missing,
            &[&format!("{} is missing", row.key), row.range],
        );
        missed += 1;
    }
    assert_eq!(missed, 12);
    refused(
        &format!("{POWER}{INTERFERER}"),
        Problem::Missing,
        &["geometry.altitude_m is missing", "0.1 to 1e5 m"],
    );
    refused(
        &format!("{GEOMETRY}{INTERFERER}"),
        Problem::Missing,
        &["power.tx_w is missing", "1e-6 to 1e6 W"],
    );
    let text = format!("{GEOMETRY}{POWER}[field]\ni_max_w = 1\n");
    refused(
        &text,
        Problem::Missing,
        &["field.beta is missing", "x_m, alpha, beta"],
    );
}

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
            "tx_w, uav_w",
        ),
        (
            small("[channel]\neta = 'x'\n"),
            "channel.eta = \"x\"",
            "carrier_hz, excess_loss_los_db, excess_loss_nlos_db, air_ground",
        ),
        (
            small("z_m = 1\n"),
            "interferer[0].z_m = 1",
            "power_w, x_m, y_m",
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
    wrong(
        &small("").replace("[[interferer]]", "[interferer]"),
        &["interferer = {", "a list of 1 or more tables"],
    );
    wrong(
        &small("[relay]\nindex = 1\n"),
        &["relay = {", "a list of tables", "index"],
    );
    wrong(
        &format!("relay = [4]\n{}", small("")),
        &["relay[0] = 4", "a table with the keys index"],
    );
    wrong(
        &format!("[[field]]\n{GEOMETRY}{POWER}"),
        &["field = [{}]", "a table with the keys i_max_w, beta"],
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
            "relay[1].index = 3 is taken",
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
    // One relay's own altitude is no business of the band.
    let own = parse(&small("[[relay]]\nindex = 1\naltitude_m = 300\n")).unwrap();
    assert_eq!(own.relays[&1].altitude_m, Some(300.0));
}

#[test]
fn the_obstructed_loss_is_the_larger() {
    let both = small("[channel]\nexcess_loss_los_db = 9\nexcess_loss_nlos_db = 8.5\n");
    refused(
        &both,
        Problem::OutOfRange,
        &[
            "channel.excess_loss_nlos_db = 8.5",
            "9 (excess_loss_los_db) to 200 dB",
        ],
    );
    // The only key given gets the blame, not the default that it collides with.
    let los = small("[channel]\nexcess_loss_los_db = 22\n");
    refused(
        &los,
        Problem::OutOfRange,
        &["channel.excess_loss_los_db = 22", "0 to 21 dB"],
    );
    let equal = parse(&small("[channel]\nexcess_loss_los_db = 21\n")).unwrap();
    assert_eq!(
        equal.channel.excess_loss_los_db,
        equal.channel.excess_loss_nlos_db
    );
}

#[test]
fn the_words_of_air_ground_are_exact() {
    let read = |value: &str| parse(&small(&format!("[channel]\nair_ground = {value}\n")));
    assert_eq!(read("'los'").unwrap().channel.air_ground, AirGround::Los);
    assert_eq!(read("'nlos'").unwrap().channel.air_ground, AirGround::Nlos);
    assert_eq!(
        read("0.25").unwrap().channel.air_ground,
        AirGround::Weight(0.25)
    );
    assert_eq!(
        read("1").unwrap().channel.air_ground,
        AirGround::Weight(1.0)
    );
    for word in ["\"LOS\"", "\"mixed\"", "\"\""] {
        let text = small(&format!("[channel]\nair_ground = {word}\n"));
        refused(
            &text,
            Problem::WrongType,
            &[
                "channel.air_ground",
                word,
                "\"los\", \"nlos\" or a number, 0 to 1",
            ],
        );
    }
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
    // Depth is bounded by the reader, not by the stack.
    refused(
        &format!("a = {}", "[".repeat(100_000)),
        Problem::Syntax,
        &["line 1, column"],
    );
    // A number too large for its notation is a mistake like any other, whichever pass sees it.
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

/// A file that is gone when the test is.
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
fn a_file_with_every_key_means_what_it_says() {
    let text = "
        [geometry]
        distance_m = 1500.0
        altitude_m = 25            # no decimal point needed
        altitude_min_m = 20.0
        altitude_max_m = 120.0
        lateral_min_m = -30
        lateral_max_m = 45.0
        min_separation_m = 4.5
        [power]
        tx_w = 80.0
        uav_w = 2
        [channel]
        carrier_hz = 2.4e9
        excess_loss_los_db = 0.2
        excess_loss_nlos_db = 22.0
        air_ground = 0.75
        [[interferer]]
        power_w = 40.0
        x_m = -100.0
        y_m = 400.0
        [[interferer]]
        power_w = 60
        x_m = 1700
        y_m = -300
        [[relay]]
        index = 3
        altitude_m = 30.0
        power_w = 0.5
        [[relay]]
        index = 1
        power_w = 4
    ";
    let expected = Scenario {
        axis: None,
        distance_m: 1500.0,
        altitude_m: 25.0,
        altitude_min_m: 20.0,
        altitude_max_m: 120.0,
        lateral_min_m: -30.0,
        lateral_max_m: 45.0,
        min_separation_m: 4.5,
        tx_w: 80.0,
        uav_w: 2.0,
        channel: ChannelSpec {
            carrier_hz: 2.4e9,
            excess_loss_los_db: 0.2,
            excess_loss_nlos_db: 22.0,
            air_ground: AirGround::Weight(0.75),
        },
        interference: Interference::Sources(vec![
            Source {
                power_w: 40.0,
                x_m: -100.0,
                y_m: 400.0,
            },
            Source {
                power_w: 60.0,
                x_m: 1700.0,
                y_m: -300.0,
            },
        ]),
        relays: BTreeMap::from([
            (
                3,
                RelayOverride {
                    altitude_m: Some(30.0),
                    power_w: Some(0.5),
                },
            ),
            (
                1,
                RelayOverride {
                    altitude_m: None,
                    power_w: Some(4.0),
                },
            ),
        ]),
    };
    assert_eq!(parse(text).unwrap(), expected);
}

#[test]
fn the_paper_scenario_as_a_file_is_the_default() {
    let text = "
        [geometry]
        distance_m = 1000.0
        altitude_m = 20.0
        altitude_min_m = 20.0
        altitude_max_m = 20.0
        min_separation_m = 4.0
        [power]
        tx_w = 80.0
        uav_w = 1.0
        [channel]
        carrier_hz = 2e9
        excess_loss_los_db = 0.1
        excess_loss_nlos_db = 21.0
        air_ground = 'los'
        [[interferer]]
        power_w = 80.0
        x_m = 500.0
        y_m = 400.0
    ";
    assert_eq!(parse(text).unwrap(), Scenario::default());
}

#[test]
fn what_a_file_leaves_out_has_its_default() {
    let expected = Scenario {
        min_separation_m: 0.0,
        ..Scenario::default()
    };
    assert_eq!(parse(&small("")).unwrap(), expected);
    assert_eq!(parse(&small("[channel]\n")).unwrap(), expected);
}

#[test]
fn a_field_takes_the_place_of_the_interferers() {
    let text = format!(
        "{GEOMETRY}{POWER}[field]\ni_max_w = 1.0e-9\nbeta = [\n  {{ x_m = 0.0, alpha = 4.0, beta = 2.0 }},\n  \
         {{ x_m = 1000, alpha = 3, beta = 2 }},\n]\n"
    );
    let beta = vec![
        BetaPoint {
            x_m: 0.0,
            alpha: 4.0,
            beta: 2.0,
        },
        BetaPoint {
            x_m: 1000.0,
            alpha: 3.0,
            beta: 2.0,
        },
    ];
    let expected = Interference::Field(Field {
        i_max_w: 1e-9,
        beta,
    });
    assert_eq!(parse(&text).unwrap().interference, expected);
}
