//! Whether and how the chain finds its interferer, as options give it.

use clap::Args;
use uav_relay::{Duration, Listen};

use uav_relay_linux::command::number;

/// The options of listening.
#[derive(Args, Debug)]
#[command(next_help_heading = "Listening")]
pub(crate) struct ListenOptions {
    /// The chain finds its interferer by what its relays hear: a SiK radio by its RADIO_STATUS on the link of --autopilot, or whatever writes
    /// lines with a power into the FIFO of --positions. --interferer is a guess then, or `unknown`. All relays are given it, or none is
    #[arg(long, conflicts_with = "field")]
    listen: bool,
    /// The interferer moves: its velocity is found, too, and what was heard is forgotten sooner
    #[arg(long, requires = "listen")]
    following: bool,
    /// How long after an agreement the first relay asks what is heard, s, 0.01 to 1e5; without it 5, with --following 1
    #[arg(long, value_name = "S", requires = "listen", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.01, 1e5))]
    listen_every: Option<f32>,
    /// After so long what was heard counts half, s, 0.01 to 1e12; without it 60, with --following 16 over the number of relays
    #[arg(long, value_name = "S", requires = "listen", allow_negative_numbers = true, value_parser = |text: &str| number(text, 0.01, 1e12))]
    listen_half_life: Option<f32>,
    /// By how much one measurement is off, relative, 0.001 to 1; without it 0.03, for a SiK radio rather 0.1
    #[arg(long, value_name = "E", requires = "listen", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-3, 1.0))]
    listen_error: Option<f32>,
}

impl ListenOptions {
    /// Whether the relays listen.
    pub(crate) const fn is_on(&self) -> bool {
        self.listen
    }

    /// What they say for so many relays; `None` where the relays do not listen.
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
