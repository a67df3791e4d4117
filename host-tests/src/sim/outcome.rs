//! What came of a simulated chain.

use std::collections::BTreeMap;

use uav_relay::{Instant, Placement, Profile, Side, Stats};

use super::faults::Injected;

/// How a run ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Ending {
    /// Every relay holds its place, for the same target.
    Settled,
    /// The head found that no target can be met.
    Infeasible,
    /// Relays went silent, and every neighbour of theirs has noticed.
    Broken,
    /// The deadline, or the limit on the work of a run.
    OutOfTime,
}

/// One relay when the run has ended.
#[derive(Clone, Debug)]
pub struct RelayEnd {
    /// Where it was told to fly, if anywhere.
    pub setpoint: Option<Placement>,
    /// The target it holds that place for.
    pub target: Option<f32>,
    /// What it brought along.
    pub profile: Profile,
    /// Its counters.
    pub stats: Stats,
    /// When it went silent, if it did.
    pub killed: Option<Instant>,
}

/// What came of a run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// The relays, from the head.
    pub relays: Vec<RelayEnd>,
    /// SIR of the chain after each round of Algorithm 2, linear; the first is that before any.
    pub rounds: Vec<f32>,
    /// Forward passes along the chain.
    pub sweeps: u32,
    /// Frames put on any link.
    pub messages: u64,
    /// Bytes put on any link.
    pub bytes: u64,
    /// When the run ended.
    pub ended: Instant,
    /// What was done to frames.
    pub injected: Injected,
    /// Who misses whom: by the index from 1 of the one that noticed and the side, since when.
    pub noticed: BTreeMap<(u16, Side), Instant>,
    /// Setpoints that were outside their limits, ever. Anything but 0 is a bug.
    pub unsafe_setpoints: u64,
}

impl Outcome {
    /// Where the relays were told to fly, to the bit: x and altitude; `None` for one that was told nothing.
    pub fn bits(&self) -> Vec<Option<(u32, u32)>> {
        self.relays
            .iter()
            .map(|relay| {
                relay
                    .setpoint
                    .map(|place| (place.x_m.to_bits(), place.altitude_m.to_bits()))
            })
            .collect()
    }
}
