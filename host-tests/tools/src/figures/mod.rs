//! The paper's evaluation, computed by the code that flies, as pictures, tables and a page that shows them.
//!
//! Every figure is a file here with a pure `data`, which gives typed rows, and a `sheet`, which draws them. The numbers come
//! from `uav_relay` or from the simulated chain that runs it; the baselines from [`baseline`](crate::baseline). The f64
//! judge in `uav_relay_oracle` is what the tests hold them against.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`locus`], [`single`], [`single_gains`], [`single_sheet`], [`aside`] | one relay |
//! | [`fewest`], [`convergence`], [`gain`], [`cost`] | chains at one altitude |
//! | [`beta`], [`stochastic`] | fields of interference |
//! | [`altitude`], [`adjust`], [`joint`] | altitudes |
//! | [`sensing`] | an interferer that nobody told of |
//! | [`paper`] | the paper's scenarios, as missions |
//! | [`walk`], [`flight`] | a chain without a message, for figures that need thousands; one that is flown |
//! | [`chart`], [`scale`], [`draw`] | what a chart shows, its axes, its SVG |
//! | [`sheet`], [`page`] | a figure with its tables and words; the page with all of them |
//! | [`trouble`] | why a figure could not be made |

pub mod adjust;
pub mod altitude;
pub mod aside;
pub mod beta;
pub mod chart;
pub mod convergence;
pub mod cost;
pub mod draw;
pub mod fewest;
pub mod flight;
pub mod gain;
pub mod joint;
pub mod locus;
pub mod page;
pub mod paper;
pub mod scale;
pub mod sensing;
pub mod sheet;
mod signs;
pub mod single;
pub mod single_gains;
pub mod single_sheet;
pub mod stochastic;
pub mod trouble;
pub mod walk;

use sheet::Sheet;
use trouble::Trouble;

/// A figure that can be made.
#[derive(Clone, Copy, Debug)]
pub struct Figure {
    /// What it is called on the command line, and its file without `.svg`.
    pub name: &'static str,
    /// Makes it.
    pub make: fn() -> Result<Sheet, Trouble>,
}

/// Every figure, in the order of the paper, then this project's own.
pub const ALL: [Figure; 16] = [
    figure("locus", locus::sheet),
    figure("single", single_sheet::sheet),
    figure("fewest-by-place", fewest::by_place_sheet),
    figure("fewest-by-power", fewest::by_power_sheet),
    figure("convergence", convergence::sheet),
    figure("gain", gain::sheet),
    figure("beta", beta::sheet),
    figure("stochastic", stochastic::sheet),
    figure("altitude", altitude::sheet),
    figure("shapes", adjust::shapes_sheet),
    figure("rounds", adjust::rounds_sheet),
    figure("cost", cost::sheet),
    figure("joint", joint::sheet),
    figure("aside", aside::places_sheet),
    figure("aside-gain", aside::gains_sheet),
    figure("sensing", sensing::sheet),
];

const fn figure(name: &'static str, make: fn() -> Result<Sheet, Trouble>) -> Figure {
    Figure { name, make }
}
