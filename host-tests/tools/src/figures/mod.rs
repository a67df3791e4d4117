//! The paper's evaluation, computed by the on-board code: pictures, tables and a page.
//!
//! Every figure is a file with two functions: `data` returns typed rows, and `sheet` draws them. The numbers come from
//! `uav_relay`, or from a simulated chain of it. Baselines are in [`baseline`](crate::baseline). The tests compare the
//! numbers with the independent f64 reference `uav_relay_oracle`.
//!
//! | file | content |
//! | --- | --- |
//! | [`locus`], [`single`], [`aside`] | one relay |
//! | [`fewest`], [`convergence`], [`gain`], [`cost`] | chains at one altitude |
//! | [`beta`], [`stochastic`] | fields of interference |
//! | [`altitude`], [`adjust`], [`joint`] | altitudes |
//! | [`sensing`] | an unknown interferer |
//! | [`link`] | both directions, and data rates |
//! | [`paper`] | the paper's scenarios, as missions |
//! | [`walk`] | a chain computed without messages, for figures with thousands of chains; a simulated chain |
//! | [`chart`], [`draw`] | a chart, its axes, its SVG |
//! | [`sheet`] | a figure with its tables and text; the page of all figures; errors |

pub mod adjust;
pub mod altitude;
pub mod aside;
pub mod beta;
pub mod chart;
pub mod convergence;
pub mod cost;
pub mod draw;
pub mod fewest;
pub mod gain;
pub mod joint;
pub mod link;
pub mod locus;
pub mod paper;
pub mod sensing;
pub mod sheet;
pub mod single;
pub mod stochastic;
pub mod walk;

use sheet::{FigureError, Sheet};

/// Figure that `cargo figures` can make, with its name.
#[derive(Clone, Copy, Debug)]
pub struct Figure {
    /// Name of the figure on the command line, and of its file without `.svg`.
    pub name: &'static str,
    /// Function that computes the figure.
    pub make: fn() -> Result<Sheet, FigureError>,
}

/// Figures that `cargo figures` can make: the paper's figures in its order, then further ones.
pub const ALL: [Figure; 17] = [
    figure("locus", locus::sheet),
    figure("single", single::sheet),
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
    figure("link", link::sheet),
];

const fn figure(name: &'static str, make: fn() -> Result<Sheet, FigureError>) -> Figure {
    Figure { name, make }
}
