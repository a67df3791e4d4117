//! Table of all keys of a scenario file and their allowed values.
//!
//! Checks and error messages use the same table, so they cannot disagree.

use core::fmt;

use Rule::{Choice, LinkOrNumber, Number, Text, Whole};
use toml::Table;

use super::endpoint::FORM;
use super::link::Access;
use super::number::brief;
use super::spec::PlannedMethod;

/// Range of a number in a scenario file: `low` to `high`.
///
/// Both ends belong to the range, except that `low` does not if `open` is true.
pub(super) struct Range {
    low: f64,
    high: f64,
    open: bool,
    unit: &'static str,
}

pub(super) enum Rule {
    Number(Range),
    Whole(Range),
    /// Text "los" (line of sight) or "nlos" (obstructed), or a number within the given range.
    LinkOrNumber(Range),
    Flag,
    /// A number within this range, or a list of two numbers: the least and the greatest.
    NumberOrTwo(Range),
    /// List with one number for each of these ranges.
    Numbers(&'static [Range]),
    /// List of points, each with one number for each range.
    ///
    /// The pair has the least and the greatest number of points.
    Points(&'static [Range], [usize; 2]),
    Choice(&'static [&'static str]),
    Text,
    /// Non-empty list of non-empty texts.
    Texts,
    /// Text that names a serial port or the UDP address of an autopilot.
    TtyOrUdp,
    Table(Keys),
    /// List of tables with these keys. The number is the smallest number of tables.
    Tables(Keys, usize),
}

/// Condition under which a key is required.
pub(super) enum Need {
    Always,
    Never,
    /// The key is required if its table has none of the keys with these names.
    Unless(&'static [&'static str]),
}

pub(super) struct Key {
    pub(super) name: &'static str,
    pub(super) need: Need,
    /// Keys that must not be given together with this key.
    pub(super) without: &'static [&'static str],
    pub(super) rule: Rule,
}

pub(super) type Keys = &'static [Key];

pub(super) const fn range(low: f64, high: f64, unit: &'static str) -> Range {
    Range {
        low,
        high,
        open: false,
        unit,
    }
}

const fn above(low: f64, high: f64) -> Range {
    Range {
        low,
        high,
        open: true,
        unit: "",
    }
}

const fn required(name: &'static str, rule: Rule) -> Key {
    Key {
        name,
        need: Need::Always,
        without: &[],
        rule,
    }
}

pub(super) const fn optional(name: &'static str, rule: Rule) -> Key {
    Key {
        name,
        need: Need::Never,
        without: &[],
        rule,
    }
}

/// Creates a key that is required if the table has none of the keys `others`. The key must not be given together with
/// any of them.
const fn unless(others: &'static [&'static str], name: &'static str, rule: Rule) -> Key {
    Key {
        need: Need::Unless(others),
        ..without(others, name, rule)
    }
}

/// Creates an optional key that must not be given together with any of the keys `others`.
const fn without(others: &'static [&'static str], name: &'static str, rule: Rule) -> Key {
    Key {
        name,
        need: Need::Never,
        without: others,
        rule,
    }
}

// The upper limit is about the altitude of airliners.
const ALTITUDE: Range = range(0.1, 1e4, "m");
const POWER: Range = range(1e-6, 1e6, "W");
const POWER_DBM: Range = range(-30.0, 90.0, "dBm");
const SOURCE_DBM: Range = range(-30.0, 120.0, "dBm");
const GAIN: Range = range(-30.0, 60.0, "dBi");
const LATITUDE: Range = range(-90.0, 90.0, "degrees");
const LONGITUDE: Range = range(-180.0, 180.0, "degrees");
const AMSL: Range = range(-1e3, 1e4, "m");
const PLACE: Range = range(-1e7, 1e7, "m");
const LOSS: Range = range(0.0, 200.0, "dB");

pub(super) const FILE: Keys = &[
    required("geometry", Rule::Table(GEOMETRY)),
    required("power", Rule::Table(POWERS)),
    optional("channel", Rule::Table(CHANNEL)),
    optional("interferer", Rule::Tables(INTERFERER, 1)),
    optional("no_fly", Rule::Tables(NO_FLY, 1)),
    optional("relay", Rule::Tables(RELAY, 0)),
    optional("field", Rule::Table(FIELD)),
    optional("noise", Rule::Table(NOISE)),
    optional("link", Rule::Table(LINK)),
    optional("site", Rule::Table(SITES)),
    optional("terrain", Rule::Table(TERRAIN)),
    optional("listen", Rule::Table(LISTEN)),
    optional("plan", Rule::Table(PLAN)),
];

const GEOMETRY: Keys = &[
    optional("distance_m", Number(range(1.0, 1e6, "m"))),
    required("altitude_m", Number(ALTITUDE)),
    optional("altitude_min_m", Number(ALTITUDE)),
    optional("altitude_max_m", Number(ALTITUDE)),
    optional("lateral_min_m", Number(range(-1e5, 0.0, "m"))),
    optional("lateral_max_m", Number(range(0.0, 1e5, "m"))),
    optional("min_separation_m", Number(range(0.0, 1e5, "m"))),
];

const PLAN: Keys = &[
    required("uavs", Whole(range(1.0, 1000.0, ""))),
    required("method", Choice(PlannedMethod::NAMES)),
    required("tolerance", Number(range(1e-6, 0.1, ""))),
    required("sir_db", Number(range(-400.0, 400.0, "dB"))),
    required("places", Rule::Tables(PLANNED_PLACE, 1)),
];

const PLANNED_PLACE: Keys = &[
    required("x_m", Number(PLACE)),
    required("y_m", Number(PLACE)),
    required("altitude_m", Number(ALTITUDE)),
];

const LISTEN: Keys = &[
    optional("following", Rule::Flag),
    optional("every_s", Number(range(0.01, 1e5, "s"))),
    optional("half_life_s", Number(range(0.01, 1e12, "s"))),
    optional("relative_error", Number(range(1e-3, 1.0, ""))),
];

const SITES: Keys = &[
    required("tx", Rule::Table(SITE)),
    required("rx", Rule::Table(SITE)),
    optional("geoid_m", Number(range(-120.0, 100.0, "m"))),
];

const SITE: Keys = &[
    required("lat_deg", Number(LATITUDE)),
    required("lon_deg", Number(LONGITUDE)),
    required("amsl_m", Number(AMSL)),
];

const TERRAIN: Keys = &[
    required("files", Rule::Texts),
    optional("mast_m", Number(range(0.0, 200.0, "m"))),
    optional("above_ground_m", Number(range(0.0, 1e4, "m"))),
    optional("above_ground_max_m", Number(range(0.1, 1e4, "m"))),
    optional("error_m", Number(range(0.0, 100.0, "m"))),
];

const POWERS: Keys = &[
    unless(&["tx_dbm", "tx_eirp_dbm"], "tx_w", Number(POWER)),
    without(&["tx_eirp_dbm"], "tx_dbm", Number(POWER_DBM)),
    without(&["tx_eirp_dbm"], "tx_gain_dbi", Number(GAIN)),
    optional("tx_eirp_dbm", Number(POWER_DBM)),
    unless(&["uav_dbm"], "uav_w", Number(POWER)),
    optional("uav_dbm", Number(POWER_DBM)),
    optional("uav_gain_dbi", Number(GAIN)),
    without(&["rx_dbm"], "rx_w", Number(POWER)),
    optional("rx_dbm", Number(POWER_DBM)),
    optional("rx_gain_dbi", Number(GAIN)),
];

const CHANNEL: Keys = &[
    optional("carrier_hz", Number(range(1e6, 1e12, "Hz"))),
    optional("excess_loss_los_db", Number(LOSS)),
    optional("excess_loss_nlos_db", Number(LOSS)),
    optional("air_ground", LinkOrNumber(range(0.0, 1.0, ""))),
];

const NOISE: Keys = &[
    without(
        &["power_dbm"],
        "bandwidth_hz",
        Number(range(0.0, 1e12, "Hz")),
    ),
    without(&["power_dbm"], "figure_db", Number(range(0.0, 60.0, "dB"))),
    optional("power_dbm", Number(range(-200.0, 0.0, "dBm"))),
];

const LINK: Keys = &[
    optional("access", Choice(Access::NAMES)),
    optional("bandwidth_hz", Number(range(1.0, 1e12, "Hz"))),
    without(&["steps"], "gap_db", Number(range(0.0, 30.0, "dB"))),
    optional("steps", Rule::Tables(RATE_STEP, 1)),
    optional("reverse", Number(range(0.0, 1.0, ""))),
];

const RATE_STEP: Keys = &[
    required("sinr_db", Number(range(-60.0, 90.0, "dB"))),
    required(
        "bits_per_hz",
        Number(Range {
            unit: "bit/s/Hz",
            ..above(0.0, 100.0)
        }),
    ),
];

const INTERFERER: Keys = &[
    unless(
        &["power_dbm", "eirp_dbm"],
        "power_w",
        Rule::NumberOrTwo(range(1e-6, 1e9, "W")),
    ),
    without(&["eirp_dbm"], "power_dbm", Rule::NumberOrTwo(SOURCE_DBM)),
    without(&["eirp_dbm"], "gain_dbi", Number(GAIN)),
    optional("eirp_dbm", Rule::NumberOrTwo(SOURCE_DBM)),
    unless(&["lat_deg", "area"], "x_m", Number(PLACE)),
    unless(&["lon_deg", "area"], "y_m", Number(PLACE)),
    without(&["y_m", "area"], "lat_deg", Number(LATITUDE)),
    without(&["x_m", "area"], "lon_deg", Number(LONGITUDE)),
    without(&["x_m", "y_m", "area"], "amsl_m", Number(AMSL)),
    optional("area", Rule::Table(AREA)),
    optional("mast_m", Number(range(0.0, 1000.0, "m"))),
];

/// Largest number of corners of a polygon in a file.
pub(super) const MOST_CORNERS: usize = 500;
const XY: &[Range] = &[PLACE, PLACE];
const ON_EARTH: &[Range] = &[LATITUDE, LONGITUDE];
const RADIUS: Range = range(1.0, 1e6, "m");

// A kind of area must not be given together with a kind that follows it.
const AREA: Keys = &[
    unless(
        &[
            "polygon",
            "circle",
            "rectangle_deg",
            "polygon_deg",
            "circle_deg",
        ],
        "rectangle",
        Rule::Points(XY, [2, 2]),
    ),
    without(
        &["circle", "rectangle_deg", "polygon_deg", "circle_deg"],
        "polygon",
        Rule::Points(XY, [3, MOST_CORNERS]),
    ),
    without(
        &["rectangle_deg", "polygon_deg", "circle_deg"],
        "circle",
        Rule::Numbers(&[PLACE, PLACE, RADIUS]),
    ),
    without(
        &["polygon_deg", "circle_deg"],
        "rectangle_deg",
        Rule::Points(ON_EARTH, [2, 2]),
    ),
    without(
        &["circle_deg"],
        "polygon_deg",
        Rule::Points(ON_EARTH, [3, MOST_CORNERS]),
    ),
    optional("circle_deg", Rule::Numbers(&[LATITUDE, LONGITUDE, RADIUS])),
];

const NO_FLY: Keys = &[
    optional("area", Rule::Table(AREA)),
    unless(&["area"], "file", Text),
    optional("lowest_m", Number(range(0.0, 1e4, "m"))),
    optional("highest_m", Number(range(0.0, 1e4, "m"))),
];

const RELAY: Keys = &[
    required("index", Whole(range(1.0, 1000.0, ""))),
    optional("altitude_m", Number(ALTITUDE)),
    without(&["power_dbm"], "power_w", Number(POWER)),
    optional("power_dbm", Number(POWER_DBM)),
];

const FIELD: Keys = &[
    required("i_max_w", Number(range(1e-30, 1e6, "W"))),
    required("beta", Rule::Tables(BETA, 1)),
];

const BETA: Keys = &[
    required("x_m", Number(PLACE)),
    required("alpha", Number(above(1.0, 1e6))),
    required("beta", Number(above(0.0, 1e6))),
];

impl Key {
    /// Returns true if `table` must have this key. The caller has checked that the key is absent.
    pub(super) fn is_missed(&self, table: &Table) -> bool {
        match self.need {
            Need::Always => true,
            Need::Never => false,
            Need::Unless(others) => !others.iter().any(|name| table.contains_key(*name)),
        }
    }

    /// Returns the keys among `keys` that a table may have in place of this required key.
    pub(super) fn alternatives(
        &self,
        keys: impl IntoIterator<Item = &'static Key>,
    ) -> impl Iterator<Item = &'static Key> {
        let names = match self.need {
            Need::Unless(names) => names,
            _ => &[],
        };
        keys.into_iter().filter(|key| names.contains(&key.name))
    }
}

impl Range {
    pub(super) fn holds(&self, value: f64) -> bool {
        // NaN fails the first comparison; an infinity fails one of the two.
        let low = if self.open {
            value > self.low
        } else {
            value >= self.low
        };
        low && value <= self.high
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gap = if self.unit.is_empty() { "" } else { " " };
        let low = if self.open { "above " } else { "" };
        write!(
            f,
            "{low}{} to {}{gap}{}",
            brief(self.low),
            brief(self.high),
            self.unit
        )
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Number(range) => write!(f, "a number, {range}"),
            Whole(range) => write!(f, "a whole number, {range}"),
            LinkOrNumber(range) => write!(f, "\"los\", \"nlos\" or a number, {range}"),
            Rule::NumberOrTwo(range) => write!(
                f,
                "a number, {range}; with the key area also a list [LEAST, GREATEST]"
            ),
            Rule::Numbers(ranges) => write!(f, "a list of {}", listed(ranges)),
            Rule::Points(ranges, [least, most]) => {
                let count = if least == most {
                    format!("{least}")
                } else {
                    format!("{least} to {most}")
                };
                write!(f, "{count} lists, each of {}", listed(ranges))
            }
            Rule::Flag => f.write_str("true or false"),
            Text => f.write_str("a string that is not empty"),
            Rule::Texts => f.write_str("a list of 1 or more strings that are not empty"),
            Rule::TtyOrUdp => write!(f, "a string: a tty, or {FORM}"),
            Choice(texts) => write!(f, "\"{}\"", texts.join("\" or \"")),
            Rule::Table(keys) => write!(f, "a table with the keys {}", names(*keys)),
            Rule::Tables(keys, 0) => write!(f, "a list of tables with the keys {}", names(*keys)),
            Rule::Tables(keys, least) => write!(
                f,
                "a list of {least} or more tables with the keys {}",
                names(*keys)
            ),
        }
    }
}

/// Returns the names of all keys of a scenario file, as `table.key`.
///
/// The keys of a list of tables appear once.
pub fn all() -> Vec<String> {
    let mut names = Vec::new();
    collect("", FILE, &mut names);
    names
}

fn collect(table: &str, keys: Keys, names: &mut Vec<String>) {
    for key in keys {
        let name = format!("{table}{}", key.name);
        match key.rule {
            Rule::Table(inner) | Rule::Tables(inner, _) => {
                collect(&format!("{name}."), inner, names);
            }
            _ => names.push(name),
        }
    }
}

fn listed(ranges: &[Range]) -> String {
    let each: Vec<String> = ranges.iter().map(ToString::to_string).collect();
    format!("{} numbers: {}", each.len(), each.join(", "))
}

pub(super) fn names<'a>(keys: impl IntoIterator<Item = &'a Key>) -> String {
    keys.into_iter()
        .map(|key| key.name)
        .collect::<Vec<_>>()
        .join(", ")
}

const BAUD: Range = range(1_200.0, 4e6, "bit/s");
const SILENCE: Range = range(1.0, 3.6e6, "ms");

pub(super) const SECTIONS: Keys = &[
    optional("network", Rule::Table(NETWORK)),
    optional("fleet", Rule::Table(FLEET)),
    optional("companion", Rule::Table(COMPANION)),
    optional("ground", Rule::Table(GROUND)),
];

const NETWORK: Keys = &[
    optional("id", Whole(range(0.0, 65_535.0, ""))),
    optional("relays", Whole(range(1.0, 1_000.0, ""))),
    optional("key_file", Text),
    optional("method", Choice(&["align", "joint", "adjust"])),
    optional("baud", Whole(BAUD)),
    optional("probe_after_ms", Whole(SILENCE)),
    optional("dead_after_ms", Whole(SILENCE)),
];

const FLEET: Keys = &[
    optional("flying", Whole(range(1.0, 1_000.0, ""))),
    optional("respacing_s", Number(range(0.0, 3_600.0, "s"))),
];

const COMPANION: Keys = &[
    optional("index", Whole(range(1.0, 1_000.0, ""))),
    optional("upstream", Text),
    optional("downstream", Text),
    optional("shared", Text),
    optional("epoch_file", Text),
    optional("upload_file", Text),
    optional("view_file", Text),
    optional("autopilot", Rule::TtyOrUdp),
    optional("autopilot_baud", Whole(BAUD)),
    optional("autopilot_key_file", Text),
    optional("speed_m_s", Number(range(0.1, 20.0, "m/s"))),
    optional("reserve_s", Number(range(0.0, 3_600.0, "s"))),
    optional("flight_time_s", Number(range(1.0, 21_600.0, "s"))),
    optional("return_speed_m_s", Number(range(0.1, 20.0, "m/s"))),
    optional("descent_m_s", Number(range(0.1, 20.0, "m/s"))),
    optional("spare", Rule::Flag),
    optional("positions", Text),
    optional("position_error_m", Number(range(0.0, 1_000.0, "m"))),
    optional("json", Rule::Flag),
    optional("log_file", Text),
    optional("status_socket", Text),
    optional("capture", Text),
];

const GROUND: Keys = &[
    optional("tty", Text),
    optional("shared", Rule::Flag),
    optional("end", Choice(&["tx", "rx"])),
    optional("epoch_file", Text),
    optional("timeout_s", Whole(range(1.0, 86_400.0, "s"))),
    optional("stand", Rule::Flag),
    optional("measurements", Text),
    optional("web", Text),
    optional("web_password", Text),
    optional("tiles", Text),
    optional("json", Rule::Flag),
    optional("log_file", Text),
    optional("status_socket", Text),
    optional("capture", Text),
];
