//! Keys of scenario files: ranges, types, and error messages.

use super::*;

/// Row of the table of numeric keys. A row has the key's path, a file with `@` for the value, a value below the
/// range, both limits, a value above, and the stated range.
struct Row {
    key: &'static str,
    file: String,
    below: &'static str,
    low: &'static str,
    high: &'static str,
    above: &'static str,
    range: &'static str,
}

/// Numeric keys: path, lines of the table with `@` for the value, four values, and the stated range.
///
/// The values are one below the range, its limits, and one above. Semicolons end lines.
const KEYS: &str = r#"
geometry.distance_m | distance_m = @; altitude_m = 20 | 0.99 1 1e6 1000000.5 | 1 to 1e6 m
geometry.altitude_m | distance_m = 9; altitude_m = @ | 0.0999 0.1 1e4 10000.1 | 0.1 to 10000 m
geometry.altitude_min_m | distance_m = 9; altitude_m = 1e4; altitude_min_m = @ | 0.0999 0.1 1e4 10000.1 | 0.1 to 10000 m
geometry.altitude_max_m | distance_m = 9; altitude_m = 0.1; altitude_max_m = @ | 0.0999 0.1 1e4 10000.1 | 0.1 to 10000 m
geometry.lateral_min_m | distance_m = 9; altitude_m = 9; lateral_min_m = @ | -100001 -1e5 0 0.5 | -1e5 to 0 m
geometry.lateral_max_m | distance_m = 9; altitude_m = 9; lateral_max_m = @ | -0.5 0 1e5 100001 | 0 to 1e5 m
geometry.min_separation_m | distance_m = 9; altitude_m = 9; min_separation_m = @ | -1e-9 0 1e5 100001 | 0 to 1e5 m
power.tx_w | tx_w = @; uav_w = 1 | 0.9e-6 1e-6 1e6 1000001 | 1e-6 to 1e6 W
power.tx_dbm | tx_dbm = @; uav_w = 1 | -30.1 -30 90 90.1 | -30 to 90 dBm
power.tx_gain_dbi | tx_w = 1; uav_w = 1; tx_gain_dbi = @ | -30.1 -30 60 60.1 | -30 to 60 dBi
power.tx_eirp_dbm | tx_eirp_dbm = @; uav_w = 1 | -30.1 -30 90 90.1 | -30 to 90 dBm
power.uav_w | tx_w = 1; uav_w = @ | 0.9e-6 1e-6 1e6 1000001 | 1e-6 to 1e6 W
power.uav_dbm | tx_w = 1; uav_dbm = @ | -30.1 -30 90 90.1 | -30 to 90 dBm
power.uav_gain_dbi | tx_w = 1; uav_w = 1; uav_gain_dbi = @ | -30.1 -30 60 60.1 | -30 to 60 dBi
power.rx_w | tx_w = 1; uav_w = 1; rx_w = @ | 0.9e-6 1e-6 1e6 1000001 | 1e-6 to 1e6 W
power.rx_dbm | tx_w = 1; uav_w = 1; rx_dbm = @ | -30.1 -30 90 90.1 | -30 to 90 dBm
power.rx_gain_dbi | tx_w = 1; uav_w = 1; rx_gain_dbi = @ | -30.1 -30 60 60.1 | -30 to 60 dBi
channel.carrier_hz | carrier_hz = @ | 999999 1e6 1e12 1.1e12 | 1e6 to 1e12 Hz
channel.excess_loss_los_db | excess_loss_los_db = @; excess_loss_nlos_db = 200 | -0.01 0.0 200.0 200.1 | 0 to 200 dB
channel.excess_loss_nlos_db | excess_loss_los_db = 0; excess_loss_nlos_db = @ | -0.01 0.0 200.0 200.1 | 0 to 200 dB
channel.air_ground | air_ground = @ | -0.01 0 1 1.01 | "los", "nlos" or a number, 0 to 1
interferer[1].power_w | power_w = @; x_m = 0; y_m = 9 | 0 1e-6 1e9 1e10 | 1e-6 to 1e9 W
interferer[1].power_dbm | power_dbm = @; x_m = 0; y_m = 9 | -30.1 -30 120 120.1 | -30 to 120 dBm
interferer[1].gain_dbi | power_w = 1; gain_dbi = @; x_m = 0; y_m = 9 | -30.1 -30 60 60.1 | -30 to 60 dBi
interferer[1].eirp_dbm | eirp_dbm = @; x_m = 0; y_m = 9 | -30.1 -30 120 120.1 | -30 to 120 dBm
interferer[1].x_m | power_w = 1; x_m = @; y_m = 9 | -10000001 -1e7 1e7 1.01e7 | -1e7 to 1e7 m
interferer[1].y_m | power_w = 1; x_m = 9; y_m = @ | -10000001 -1e7 1e7 1.01e7 | -1e7 to 1e7 m
interferer[1].mast_m | power_w = 1; x_m = 0; y_m = 9; mast_m = @ | -0.1 0 1000 1000.1 | 0 to 1000 m
relay[1].index | index = @; power_w = 1 | 0 1 1000 1001 | a whole number, 1 to 1000
relay[1].altitude_m | index = 1; altitude_m = @ | 0.0999 0.1 1e4 10000.1 | 0.1 to 10000 m
relay[1].power_w | index = 1; power_w = @ | 0.9e-6 1e-6 1e6 1000001 | 1e-6 to 1e6 W
relay[1].power_dbm | index = 1; power_dbm = @ | -30.1 -30 90 90.1 | -30 to 90 dBm
field.i_max_w | i_max_w = @; beta = [{ x_m = 0, alpha = 4, beta = 2 }] | 0 1e-30 1e6 1.1e6 | 1e-30 to 1e6 W
field.beta[0].x_m | { x_m = @, alpha = 2, beta = 2 } | -10000001 -1e7 1e7 1.01e7 | -1e7 to 1e7 m
field.beta[0].alpha | { x_m = 0, alpha = @, beta = 2 } | 1.0 1.0000001 1e6 1.1e6 | above 1 to 1e6
field.beta[0].beta | { x_m = 0, alpha = 2, beta = @ } | 0.0 1e-9 1e6 1.1e6 | above 0 to 1e6"#;

/// Returns a scenario file in which the table of `key` has `lines`.
fn file_with(key: &str, lines: &str) -> String {
    let (table, _) = key.rsplit_once('.').unwrap();
    match table {
        "geometry" => format!("[geometry]\n{lines}\n{POWER}{INTERFERER}"),
        "power" => format!("{GEOMETRY}{INTERFERER}[power]\n{lines}\n"),
        "relay[1]" => small(&format!(
            "[[relay]]\nindex = 7\naltitude_m = 9\n[[relay]]\n{lines}\n"
        )),
        "interferer[1]" => small(&format!("[[interferer]]\n{lines}\n")),
        "field" => format!("{GEOMETRY}{POWER}[field]\n{lines}\n"),
        "field.beta[0]" => {
            format!("{GEOMETRY}{POWER}[field]\ni_max_w = 1\nbeta = [{lines}]\n")
        }
        _ => small(&format!("[{table}]\n{lines}\n")),
    }
}

fn rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for line in KEYS.trim_start().lines() {
        let [key, lines, values, range] = line.split(" | ").collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        let [below, low, high, above] = values.split(' ').collect::<Vec<_>>()[..] else {
            panic!("{line}");
        };
        rows.push(Row {
            key,
            file: file_with(key, &lines.replace("; ", "\n")),
            below,
            low,
            high,
            above,
            range,
        });
    }
    rows
}

#[test]
fn every_key_has_a_row() {
    // An unknown key makes each table list its own keys.
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
    // `beta` and `area` are no scalars, and `earth` tests the keys of a [site].
    keys.retain(|key| {
        let name = key.rsplit('.').next().unwrap();
        !["beta", "lat_deg", "lon_deg", "amsl_m", "area"].contains(&name)
            || key == "field.beta[0].beta"
    });
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
                // A relay's number is an integer, so these have the wrong type.
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
            // A line break in a value is shown as an escape.
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
fn every_missing_required_key_is_reported() {
    let optional = [
        "altitude_min_m",
        "altitude_max_m",
        "lateral_min_m",
        "lateral_max_m",
        "min_separation_m",
        "channel.",
        "mast_m",
        "rx_w",
        "relay[1].a",
        "relay[1].p",
        "_dbm",
        "_dbi",
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
        &["geometry.altitude_m is missing", "0.1 to 10000 m"],
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
