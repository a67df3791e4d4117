//! Options for links and the radio channel: access, speed, losses, one-way failures and soaks.

use crate::command::{Failure, carries, number, whole};
use crate::simulator::bursts::Bursts;
use crate::simulator::medium::Access;
use crate::simulator::one_way::OneWayFailure;
use crate::simulator::setup::Setup;
use clap::{Args, ValueEnum};
use uav_relay::{Duration, Instant, Wiring};

use super::times::{instant, span};

/// Command-line options for links and the radio channel.
#[derive(Args, Debug)]
#[command(next_help_heading = "Links and the air")]
pub struct Air {
    /// Access method of the shared channel, which reaches four relays far; default csma
    #[arg(long = "air", value_name = "A", value_enum, conflicts_with = "wires")]
    sharing: Option<Sharing>,
    /// Bits per second of every link or of the channel, 300 to 10000000; a byte takes ten bits
    #[arg(long, value_name = "B", default_value_t = 115_200, allow_negative_numbers = true, value_parser = whole(300_u32, 10_000_000))]
    baud: u32,
    /// Silence after which a neighbour is probed, ms, 1 to 1200000; default 5000. After three times as long it counts as lost.
    /// Larger values allow more relays on a slow channel
    #[arg(long, value_name = "MS", value_parser = whole(1_u64, 1_200_000))]
    probe_after_ms: Option<u64>,
    /// Range of the radios on a shared channel, in relays, 1 to 1000; default 4
    #[arg(long, value_name = "K", conflicts_with = "wires", value_parser = whole(1_usize, 1_000))]
    reach: Option<usize>,
    /// Mean length of a burst of losses, frames, 1 to 1e6 (Gilbert-Elliott). It is independent for each direction of a link; --loss
    /// P is the mean share of lost frames. 1 for independent losses, otherwise at least 1 / (1 - P)
    #[arg(long, value_name = "L", default_value_t = 1.0, allow_negative_numbers = true, value_parser = |text: &str| number(text, 1.0, 1e6))]
    burst: f64,
    /// Relay J does not receive relay I from second S until E, or permanently. Repeatable
    #[arg(long, value_name = "J:I@S[-E]", value_parser = deaf)]
    deaf: Vec<OneWayFailure>,
    /// Run for S seconds, 1 to 1e6, with all events, and report the availability of the chain
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = soak)]
    soak: Option<Instant>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum Sharing {
    /// Half duplex: radios sense the channel before they send, and wait a random time
    Csma,
    /// Half duplex: radios send at once
    Aloha,
    /// Separate line for every sender: no collisions
    Ideal,
}

impl Air {
    /// Returns true if the options request a shared channel.
    pub fn is_chosen(&self) -> bool {
        self.sharing.is_some()
    }

    /// Returns true if the options can separate relays from the chain or fix the run's duration.
    pub fn is_eventful(&self) -> bool {
        !self.deaf.is_empty() || self.soak.is_some()
    }

    /// Returns the end of a soak, if requested.
    pub const fn soaked(&self) -> Option<Instant> {
        self.soak
    }

    /// Returns the failure options with their start times.
    pub fn begins(&self) -> impl Iterator<Item = (String, Instant)> {
        let name = |deaf: &OneWayFailure| (format!("--deaf {}:{}", deaf.by, deaf.of), deaf.from);
        self.deaf.iter().map(name)
    }

    /// Returns the times of all events.
    pub fn times(&self) -> impl Iterator<Item = Instant> {
        self.deaf
            .iter()
            .map(|deaf| deaf.until.unwrap_or(deaf.from))
            .chain(self.soak)
    }

    /// Checks the options against a chain of `uavs` relays.
    pub fn agree(&self, uavs: u16) -> Result<(), Failure> {
        let wrong = self.deaf.iter().find(|deaf| {
            !(1..=uavs).contains(&deaf.by.min(deaf.of)) || deaf.by.max(deaf.of) > uavs
        });
        if let Some(OneWayFailure { by, of, .. }) = wrong {
            let line = format!("--deaf {by}:{of}@..: relays must be within 1 to {uavs}");
            return Err(Failure::input(line));
        }
        Ok(())
    }

    /// Applies the options to a setup that loses `loss` of the frames. The wiring must already be set.
    pub fn prepare(&self, setup: &mut Setup, loss: f64) -> Result<(), Failure> {
        if self.burst > 1.0 && loss <= 0.0 {
            let line = format!("--burst {}: would be ignored without --loss", self.burst);
            return Err(Failure::input(line));
        }
        let least = Bursts::shortest(loss);
        if self.burst > 1.0 && self.burst < least {
            let line = format!(
                "--burst {}: must be 1, or {least:.4} to 1e6 with --loss {loss}: independent losses come in runs as long",
                self.burst
            );
            return Err(Failure::input(line));
        }
        setup.burst = self.burst;
        setup.link.baud = self.baud;
        if let Some(ms) = self.probe_after_ms {
            setup.settings.probe_after = Duration::from_millis(ms);
            setup.settings.dead_after = Duration::from_millis(3 * ms);
        }
        if let Some(reach) = self.reach {
            setup.radio_reach = reach;
        }
        setup.deaf.clone_from(&self.deaf);
        setup.access = match (setup.settings.wiring, self.sharing) {
            (Wiring::Pair, _) | (_, Some(Sharing::Ideal)) => Access::Ideal,
            (_, Some(Sharing::Aloha)) => Access::Aloha,
            (_, Some(Sharing::Csma) | None) => Access::Csma,
        };
        if let Some(load) = setup.load() {
            carries(self.baud, load, setup.settings.probe_after).map_err(Failure::input)?;
        }
        if let Some(until) = self.soak {
            setup.soak = Some(until);
            setup.deadline = until;
        }
        Ok(())
    }
}

fn deaf(text: &str) -> Result<OneWayFailure, String> {
    let form =
        "must be J:I@S or J:I@S-E, two relays (1 to N) and seconds after the start (0 to 1e6)";
    let (relays, times) = text.split_once('@').ok_or(form)?;
    let (by, of) = relays.split_once(':').ok_or(form)?;
    let by: u16 = by.parse().map_err(|_| form)?;
    let of: u16 = of.parse().map_err(|_| form)?;
    let (from, until) = span(times).ok_or(form)?;
    if until.is_some_and(|until| until <= from) {
        return Err("must be J:I@S-E with E after S".to_owned());
    }
    if by == of {
        return Err("must be J:I@S-E with two different relays".to_owned());
    }
    Ok(OneWayFailure {
        by,
        of,
        from,
        until,
    })
}

fn soak(text: &str) -> Result<Instant, String> {
    number(text, 1.0, 1e6)?;
    instant(text).ok_or_else(|| "must be a number within 1.0 to 1e6".to_owned())
}
