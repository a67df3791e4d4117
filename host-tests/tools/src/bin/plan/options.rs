use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum};
use uav_relay_sim::command::{number, whole};
use uav_relay_tools::plan::{Number, Unit};

/// Computes how many relays a target SIR needs, or the best places for a given number. No messages are simulated.
#[derive(Parser, Debug)]
#[command(name = "plan", bin_name = "cargo plan", disable_version_flag = true)]
pub(crate) struct Options {
    /// Scenario file (TOML); without it the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    pub(crate) scenario: Option<PathBuf>,
    #[command(flatten)]
    wanted: Wanted,
    /// Altitudes of the relays: fixed, or free in the scenario's band. A fixed relay stays above the line at its altitude of the
    /// scenario. A free one may choose an altitude (geometry.altitude_min_m to altitude_max_m) and a place beside the line
    /// (geometry.lateral_min_m to lateral_max_m)
    #[arg(long, value_name = "A", value_enum, default_value_t = Altitude::Given)]
    pub(crate) altitude: Altitude,
    /// Required place of the only relay, metres from Tx; its altitude is chosen from the band. Needs --uavs 1
    #[arg(long, value_name = "X", allow_negative_numbers = true, conflicts_with = "altitude", value_parser = along)]
    pub(crate) x_m: Option<f64>,
    /// Bandwidth of the one frequency that all hops share, hertz, 1 to 1e12. Adds the data rate: log2(1 + SIR) bit/s per hertz of
    /// the worst hop, divided by the N + 1 time slots; and the number of relays with the largest data rate
    #[arg(long, value_name = "B", value_parser = |text: &str| number(text, 1.0, 1e12))]
    pub(crate) bandwidth_hz: Option<f64>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1
    #[arg(long, value_name = "T", default_value_t = 1e-4, value_parser = |text: &str| number(text, 1e-6, 0.1))]
    pub(crate) tolerance: f64,
    /// Print one JSON object on standard output and nothing else there
    #[arg(long)]
    pub(crate) json: bool,
    /// Draw the chain from the side, with each hop's SIR. A view from above is added where there is room or an interferer beside
    /// the line
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
    /// Write sites, relays, hops and interferers with geographic coordinates for a map (GeoJSON). Needs a scenario with a site
    #[arg(long, value_name = "FILE")]
    pub(crate) geojson: Option<PathBuf>,
    /// Write the same for a globe (KML), with altitudes above the sea
    #[arg(long, value_name = "FILE")]
    pub(crate) kml: Option<PathBuf>,
    /// Write the scenario with its plan, for cargo provision --scenario FILE --all
    #[arg(long, value_name = "FILE")]
    pub(crate) out: Option<PathBuf>,
    /// Overwrite the file of --out
    #[arg(long, requires = "out")]
    pub(crate) force: bool,
}

/// Request: exactly one of these.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
struct Wanted {
    /// The best places for this number of relays, 1 to 1000
    #[arg(long, value_name = "N", value_parser = whole::<u16>(1, 1000))]
    uavs: Option<u16>,
    /// Find the fewest relays that give every hop this SIR, linear, 1e-9 to 1e9
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-9, 1e9))]
    target_sir: Option<f64>,
    /// --target-sir in dB, -90 to 90
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = |text: &str| number(text, -90.0, 90.0))]
    target_sir_db: Option<f64>,
    /// Find the fewest relays that carry this data rate, bit/s, 1e-9 to 1e15. All hops share one frequency. Needs --bandwidth-hz
    #[arg(long, value_name = "R", requires = "bandwidth_hz", value_parser = |text: &str| number(text, 1e-9, 1e15))]
    target_rate_bps: Option<f64>,
}

/// Parses a position along the line; its range depends on the scenario.
fn along(text: &str) -> Result<f64, String> {
    text.parse()
        .map_err(|_| "must be a number, metres from Tx".to_owned())
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Altitude {
    /// Altitudes of the scenario
    Given,
    /// Free within the scenario's band, and beside the line within its limits
    Free,
}

impl Options {
    pub(crate) fn file(&self) -> String {
        self.scenario.as_ref().map_or_else(
            || "default scenario".into(),
            |file| file.display().to_string(),
        )
    }

    pub(crate) const fn unit(&self) -> Unit {
        match self.wanted.target_sir_db {
            Some(_) => Unit::Decibels,
            None => Unit::Linear,
        }
    }

    /// Returns the requested data rate, bit/s, and the bandwidth, hertz.
    pub(crate) fn target_rate(&self) -> Option<(f64, f64)> {
        self.wanted.target_rate_bps.zip(self.bandwidth_hz)
    }

    /// Returns the requested number of relays; for a data rate see [`target_rate`](Self::target_rate).
    pub(crate) fn number(&self) -> Number {
        let wanted = &self.wanted;
        match (wanted.uavs, wanted.target_sir, wanted.target_sir_db) {
            (Some(uavs), ..) => Number::Of(uavs),
            (_, Some(target), _) => Number::Meeting(target),
            (_, _, Some(db)) => Number::Meeting(10_f64.powf(db / 10.0)),
            (None, None, None) => Number::Of(1),
        }
    }
}
