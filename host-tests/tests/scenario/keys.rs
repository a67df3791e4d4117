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

type Values = [&'static str; 4];

const ALTITUDES: (Values, &str) = (["0.0999", "0.1", "1e4", "10000.1"], "0.1 to 10000 m");
const POWERS: (Values, &str) = (["0.9e-6", "1e-6", "1e6", "1000001"], "1e-6 to 1e6 W");
const POWERS_DBM: (Values, &str) = (["-30.1", "-30", "90", "90.1"], "-30 to 90 dBm");
const SOURCES_DBM: (Values, &str) = (["-30.1", "-30", "120", "120.1"], "-30 to 120 dBm");
const GAINS: (Values, &str) = (["-30.1", "-30", "60", "60.1"], "-30 to 60 dBi");
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
    let distances = (["0.99", "1", "1e6", "1000000.5"], "1 to 1e6 m");
    let separations = (["-1e-9", "0", "1e5", "100001"], "0 to 1e5 m");
    let low = "distance_m = 9\naltitude_m = 1e4\naltitude_min_m = @";
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
    ]
}

fn power_rows() -> Vec<Row> {
    let power = |lines: &str| format!("{GEOMETRY}{INTERFERER}[power]\n{lines}\n");
    let both = |line: &str| power(&format!("tx_w = 1\nuav_w = 1\n{line} = @"));
    vec![
        row("power.tx_w", power("tx_w = @\nuav_w = 1"), POWERS),
        row("power.tx_dbm", power("tx_dbm = @\nuav_w = 1"), POWERS_DBM),
        row("power.tx_gain_dbi", both("tx_gain_dbi"), GAINS),
        row(
            "power.tx_eirp_dbm",
            power("tx_eirp_dbm = @\nuav_w = 1"),
            POWERS_DBM,
        ),
        row("power.uav_w", power("tx_w = 1\nuav_w = @"), POWERS),
        row("power.uav_dbm", power("tx_w = 1\nuav_dbm = @"), POWERS_DBM),
        row("power.uav_gain_dbi", both("uav_gain_dbi"), GAINS),
        row("power.rx_w", both("rx_w"), POWERS),
        row("power.rx_dbm", both("rx_dbm"), POWERS_DBM),
        row("power.rx_gain_dbi", both("rx_gain_dbi"), GAINS),
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
            source("power_w = @\nx_m = 0\ny_m = 9"),
            powers,
        ),
        row(
            "interferer[1].power_dbm",
            source("power_dbm = @\nx_m = 0\ny_m = 9"),
            SOURCES_DBM,
        ),
        row(
            "interferer[1].gain_dbi",
            source("power_w = 1\ngain_dbi = @\nx_m = 0\ny_m = 9"),
            GAINS,
        ),
        row(
            "interferer[1].eirp_dbm",
            source("eirp_dbm = @\nx_m = 0\ny_m = 9"),
            SOURCES_DBM,
        ),
        row(
            "interferer[1].x_m",
            source("power_w = 1\nx_m = @\ny_m = 9"),
            PLACES,
        ),
        row(
            "interferer[1].y_m",
            source("power_w = 1\nx_m = 9\ny_m = @"),
            PLACES,
        ),
        row(
            "interferer[1].mast_m",
            source("power_w = 1\nx_m = 0\ny_m = 9\nmast_m = @"),
            (["-0.1", "0", "1000", "1000.1"], "0 to 1000 m"),
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
        row(
            "relay[1].power_dbm",
            relay("index = 1\npower_dbm = @"),
            POWERS_DBM,
        ),
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
    rows.extend(power_rows());
    rows.extend(channel_and_interferer_rows());
    rows.extend(relay_and_field_rows());
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
