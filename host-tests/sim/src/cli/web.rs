//! Options for a page in a browser that shows the run while it is simulated.

use std::net::SocketAddr;

use clap::Args;
use uav_relay::Instant;

use crate::command::number;
use crate::simulator::setup::Setup;

/// Command-line options for the browser page that shows the flight live.
#[derive(Args, Debug)]
#[command(next_help_heading = "Screen")]
pub struct Web {
    /// Show the flight in a browser, live and in real time, until Ctrl-C or the end of --soak. The run does not end when the drones
    /// hover. Use 127.0.0.1:8080 for this computer alone; port 0 takes any free port. Everyone who reaches another address sees the flight
    #[arg(long = "web", value_name = "ADDRESS:PORT", requires = "fly", value_parser = address,
        conflicts_with_all = ["json", "svg", "capture", "closed_loop", "traffic", "forge", "replay"])]
    pub address: Option<SocketAddr>,
    /// Seconds of virtual time in a second of real time, 0.1 to 100; default 1. With --web
    #[arg(long, value_name = "X", requires = "address", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.1, 100.0))]
    speed: Option<f64>,
}

impl Web {
    /// Removes the deadline of a run that is shown in a browser, unless `--soak` sets its end.
    pub(super) fn prepare(&self, setup: &mut Setup) {
        if self.address.is_some() && setup.soak.is_none() {
            setup.deadline = Instant::from_micros(u64::MAX);
        }
    }

    /// Returns the seconds of virtual time in a second of real time.
    pub fn speed(&self) -> f64 {
        self.speed.unwrap_or(1.0)
    }
}

fn address(text: &str) -> Result<SocketAddr, String> {
    uav_relay_screen::address(text).map_err(|error| error.to_string())
}
