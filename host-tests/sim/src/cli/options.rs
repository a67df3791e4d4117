//! Options of `cargo chain` and their ranges.

use std::path::PathBuf;

use crate::command::{Failure, file, number, whole};
use clap::{Parser, ValueEnum};
use uav_relay_scenario::number::narrow;

use super::given::given;
use super::hostile::Hostile;
use super::listening::Listening;

/// Simulates N relays that exchange real frames and move to the positions with the best worst-hop SIR
#[derive(Parser, Debug)]
#[command(name = "chain", bin_name = "cargo chain", disable_version_flag = true)]
pub struct Options {
    /// Scenario file (TOML); default: the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = whole(1_u16, 1000))]
    pub uavs: u16,
    /// Planning method
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    pub method: Method,
    /// Step of the -step methods, linear SIR, 1e-6 to 1e6; default 0.1
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-6, 1e6))]
    pub epsilon: Option<f64>,
    /// Largest number of rounds of `adjust`, 1 to 65535; default 500
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = whole(1_u16, 65_535))]
    pub rounds: Option<u16>,
    /// Largest change of altitude in a round of `adjust`, m, 0 to 1e5; default 10
    #[arg(long = "explore", value_name = "M", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.0, 1e5).map(narrow))]
    pub explore_m: Option<f32>,
    /// Search a grid of columns by rows in `adjust`, 2 to 255 each, instead of from coarse to fine
    #[arg(long, value_name = "CxR", value_parser = grid)]
    pub grid: Option<uav_relay::Local>,
    /// Repeat a stochastic run R times, 1 to 100: fly, measure the true field, and agree again. The chain starts with the value of
    /// Upsilon at Rx everywhere
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = whole(1_u8, 100))]
    pub closed_loop: Option<u8>,
    /// Relative tolerance of the achieved SIR, 1e-6 to 0.1; default 1e-4. Not for the -step methods
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-6, 0.1))]
    pub tolerance: Option<f64>,
    /// Probability that a frame is lost, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub loss: f64,
    /// Probability that a frame is corrupted, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub corrupt: f64,
    /// Probability that a frame arrives twice, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub duplicate: f64,
    /// Probability that a frame is overtaken by others, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub reorder: f64,
    /// Bracket the target from scratch instead of from the leader's own prediction
    #[arg(long)]
    pub no_predict: bool,
    /// Seed of every random draw; the same seed gives the same run, byte for byte
    #[arg(long, value_name = "S", default_value_t = 1, allow_negative_numbers = true, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
    /// Print only one JSON object on standard output
    #[arg(long)]
    pub json: bool,
    /// Draw the chain with each hop's SIR. A side view, and a top view with room or an interferer beside the line
    #[arg(long, value_name = "FILE", value_parser = file)]
    pub svg: Option<PathBuf>,
    /// Write every transmitted frame to a pcapng capture with virtual times. `cargo decode` and Wireshark read it
    #[arg(long, value_name = "FILE", value_parser = file)]
    pub capture: Option<PathBuf>,
    /// Measurement options.
    #[command(flatten)]
    pub listening: Listening,
    /// Failure, attack and upload options.
    #[command(flatten)]
    pub hostile: Hostile,
}

/// Planning method.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Method {
    /// Algorithm 1 with bracketed targets
    Align,
    /// Algorithm 1 with the paper's fixed step
    AlignStep,
    /// Algorithm 1, then Algorithm 2
    Adjust,
    /// Positions, sides and altitudes together
    #[value(alias = "altitude")]
    Joint,
    /// Algorithm 4 with bracketed targets
    Stochastic,
    /// Algorithm 4 with the fixed step
    StochasticStep,
}

impl Options {
    /// Rejects options that the method would ignore.
    pub(super) fn agree(&self, method: &str) -> Result<(), Failure> {
        let is_step = matches!(self.method, Method::AlignStep | Method::StochasticStep);
        let is_adjust = self.method == Method::Adjust;
        let step = "has no fixed step; align-step and stochastic-step have";
        let rounds = "has no rounds; adjust has";
        let bracket = "has a fixed step, see --epsilon; the other methods bracket";
        let ignored: [(Option<String>, &str); 6] = [
            (given("--epsilon", self.epsilon.filter(|_| !is_step)), step),
            (
                given("--rounds", self.rounds.filter(|_| !is_adjust)),
                rounds,
            ),
            (
                given("--explore", self.explore_m.filter(|_| !is_adjust)),
                rounds,
            ),
            (self.grid.filter(|_| !is_adjust).map(grid_said), rounds),
            (
                given("--tolerance", self.tolerance.filter(|_| is_step)),
                bracket,
            ),
            (
                (is_step && self.no_predict).then(|| "--no-predict".to_owned()),
                bracket,
            ),
        ];
        for (option, why) in ignored {
            if let Some(option) = option {
                let line = format!("{option}: would be ignored: --method {method} {why}");
                return Err(Failure::input(line));
            }
        }
        if self.closed_loop.is_some() && !self.method.is_for_fields() {
            let line = format!("--closed-loop: there is nothing to measure with --method {method}");
            return Err(Failure::input(line));
        }
        Ok(())
    }
}

fn grid_said(grid: uav_relay::Local) -> String {
    match grid {
        uav_relay::Local::Grid { columns, rows } => format!("--grid {columns}x{rows}"),
        uav_relay::Local::Fine => "--grid".to_owned(),
    }
}

impl Method {
    /// Returns true if the method is for a field of interference instead of an interferer.
    pub const fn is_for_fields(self) -> bool {
        matches!(self, Self::Stochastic | Self::StochasticStep)
    }
}

fn probability(text: &str) -> Result<f64, String> {
    number(text, 0.0, 0.9)
}

fn grid(text: &str) -> Result<uav_relay::Local, String> {
    let form = "must be CxR, columns and rows, 2 to 255 each";
    let (columns, rows) = text.split_once('x').ok_or(form)?;
    let side = |text: &str| text.parse().ok().filter(|side| *side >= 2).ok_or(form);
    Ok(uav_relay::Local::Grid {
        columns: side(columns)?,
        rows: side(rows)?,
    })
}
