use std::path::PathBuf;

use clap::Parser;
use uav_relay_tools::figures::ALL;

/// Computes every figure of the paper's evaluation, and this project's own, with the code that flies. Pictures (SVG), their numbers
/// (CSV), and index.html with all of them.
#[derive(Parser, Debug)]
#[command(name = "figures", bin_name = "cargo figures", disable_version_flag = true, after_help = figures())]
pub(crate) struct Options {
    /// Output folder; created if necessary
    #[arg(long, value_name = "DIR", default_value = "target/figures")]
    pub(crate) out: PathBuf,
    /// Make only this figure; repeatable. index.html then shows only the requested ones
    #[arg(long, value_name = "NAME", value_parser = name)]
    pub(crate) only: Vec<String>,
}

fn names() -> String {
    ALL.map(|figure| figure.name).join(", ")
}

fn figures() -> String {
    format!("Figures: {}", names())
}

fn name(text: &str) -> Result<String, String> {
    if ALL.iter().any(|figure| figure.name == text) {
        Ok(text.to_owned())
    } else {
        Err(format!("must be one of {}", names()))
    }
}
