//! Report of a shared channel.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::Wiring;

use crate::simulator::medium::{Access, AirCounts};
use crate::simulator::outcome::Outcome;
use crate::simulator::setup::Setup;

/// Channel parameters and counters.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct AirReport {
    /// Access method: `csma` or `aloha`.
    pub access: &'static str,
    /// Bits per second.
    pub baud: u32,
    /// Counters of the channel.
    #[serde(flatten)]
    pub counts: AirCounts,
}

impl AirReport {
    /// Report of a run of `setup`; `None` without a shared channel, or with an ideal one.
    pub fn of(setup: &Setup, outcome: &Outcome) -> Option<Self> {
        let access = match (setup.settings.wiring, setup.access) {
            (Wiring::Shared, Access::Csma) => "csma",
            (Wiring::Shared, Access::Aloha) => "aloha",
            _ => return None,
        };
        Some(Self {
            access,
            baud: setup.link.baud,
            counts: outcome.air,
        })
    }

    /// Formats the report as a line; `virtual_s` is the duration of the run.
    pub(super) fn text(&self, virtual_s: f64) -> String {
        let counts = self.counts;
        let load = counts.air_time_us as f64 / 1e6 / virtual_s.max(1e-6);
        let mut text = String::new();
        _ = writeln!(
            text,
            "air ({}, {} baud): load {load:.3}, {} frames sent, {} not for want of room; receptions lost: {} to collisions, {} to sending",
            self.access, self.baud, counts.sent, counts.dropped, counts.collided, counts.unheard
        );
        text
    }
}
