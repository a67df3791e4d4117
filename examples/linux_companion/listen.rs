//! Options of sensing: how the chain locates its interferer.

use clap::Args;
use uav_relay::{Duration, Listen};

use uav_relay_linux::command::number;

#[derive(Args, Debug)]
#[command(next_help_heading = "Listening")]
pub(crate) struct ListenOptions {
    /// Locate the interferer from measurements of the relays. RADIO_STATUS of a SiK radio on the link of --autopilot, or lines with
    /// a power in the FIFO of --positions. --interferer is then an initial guess, or `unknown`. Give it to all relays or to none
    #[arg(long, conflicts_with = "field")]
    listen: bool,
    /// Track a moving interferer: estimate its velocity, too, and forget measurements sooner
    #[arg(long, requires = "listen")]
    following: bool,
    /// Time from an agreement to the next collection of measurements by the first relay, s, 0.01 to 1e5. Default 5, with
    /// --following 1
    #[arg(long, value_name = "S", requires = "listen", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.01, 1e5))]
    listen_every: Option<f32>,
    /// Half-life of the weight of a measurement, s, 0.01 to 1e12. Default 60, with --following 16 over the number of relays
    #[arg(long, value_name = "S", requires = "listen", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.01, 1e12))]
    listen_half_life: Option<f32>,
    /// Relative error of one measurement, 0.001 to 1; default 0.03, for a SiK radio rather 0.1
    #[arg(long, value_name = "E", requires = "listen", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-3, 1.0))]
    listen_error: Option<f32>,
}

impl ListenOptions {
    pub(crate) const fn is_on(&self) -> bool {
        self.listen
    }

    /// Returns the sensing settings for `relays` relays; `None` if they do not listen.
    pub(crate) fn listen(&self, relays: u16) -> Option<Listen> {
        let default = if self.following {
            Listen::following(relays)
        } else {
            Listen::default()
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1e4 to 1e18"
        )]
        let micros = |seconds: f32| Duration::from_micros((f64::from(seconds) * 1e6) as u64);
        self.listen.then(|| Listen {
            every: self.listen_every.map_or(default.every, micros),
            half_life: self.listen_half_life.map_or(default.half_life, micros),
            relative_error: self.listen_error.unwrap_or(default.relative_error),
        })
    }
}
