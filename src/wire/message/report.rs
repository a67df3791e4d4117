//! Telemetry: a ground station's request for reports, and the reports of relays on their way to it.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::parts::{MessageError, PassId, Word, read, tag, write};
use crate::mission::MAX_RELAYS;
use crate::place::Placement;
use crate::time::{Duration, Instant};
use crate::wire::CANDIDATES;

/// Maximum number of relay states (entries) in one report.
const MOST_ENTRIES: usize = 4;

/// Coordinate that marks an unknown position, in quarters of a metre.
const UNKNOWN: i32 = -(1 << 23);

/// Number of values of a relay's combined state: see [`Entry::state`].
const STATES: u16 = 57_344;

/// Number of values of [`Entry::refusal`].
///
/// 0 means no refusal. Values 1 to 8 mean a refused node with another mission, 9 to 16 one with another key, 17 to 24
/// one with an old epoch. Each group has four values for nodes toward Tx and four for nodes toward Rx.
const REFUSALS: u16 = 25;

/// Upper 16 bits of the largest finite f32.
const LARGEST: u16 = 0x7F7F;

/// Position on the wire: x, y and altitude in quarters of a metre, 24 bits each.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Coarse([[u8; 3]; 3]);

impl Coarse {
    /// Rounds a position to quarters of a metre. A position farther than 2000 km from Tx counts as unknown.
    pub fn of(at: Option<Placement>) -> Self {
        let axes = at.map_or([f32::NAN; 3], |at| [at.x_m, at.y_m, at.altitude_m]);
        let is_known = axes.iter().all(|metres| metres.abs() <= 2e6);
        #[expect(clippy::cast_possible_truncation, reason = "at most 8e6")]
        let quarters = axes.map(|metres| libm::roundf(metres * 4.0) as i32);
        Self::new(if is_known { quarters } else { [UNKNOWN; 3] })
    }

    /// Creates a position from its coordinates in quarters of a metre, -2^23 to 2^23 - 1.
    ///
    /// A position with a coordinate of -2^23 is unknown.
    pub fn new(quarters: [i32; 3]) -> Self {
        Self(quarters.map(|axis| {
            let [a, b, c, _] = axis.to_le_bytes();
            [a, b, c]
        }))
    }

    /// Returns the position; `None` if it is unknown.
    pub fn place(self) -> Option<Placement> {
        let quarters = self
            .0
            .map(|[a, b, c]| i32::from_le_bytes([0, a, b, c]) >> 8);
        let [x_m, y_m, altitude_m] = quarters.map(|quarters| quarters as f32 / 4.0);
        (!quarters.contains(&UNKNOWN)).then_some(Placement {
            x_m,
            y_m,
            altitude_m,
        })
    }
}

/// State of one relay in a report of the relays' states.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Entry {
    relay: Word,
    /// Age of the reported state, in tenths of a second.
    pub age: u8,
    state: Word,
    /// Position of the drone at the time of the reported state.
    pub at: Coarse,
}

impl Entry {
    /// Creates an entry on a relay, whose state is `age` tenths of a second old.
    ///
    /// `relay` is the relay's number plus 1000 times the code of [`refusal`](Entry::refusal). `state` combines the
    /// relay's phase, hold reasons, control state and flags: see [`Entry::state`].
    pub const fn new(relay: u16, age: u8, state: u16, at: Coarse) -> Self {
        Self {
            relay: Word::new(relay),
            age,
            state: Word::new(state),
            at,
        }
    }

    /// Returns the time at which the relay was in this state, for an entry received at `now`.
    ///
    /// `None` if the age is too large for the entry's field, or if the time would be before the start of the
    /// receiver's clock.
    pub fn time(&self, now: Instant) -> Option<Instant> {
        let age = Duration::from_millis(100).times(self.age.into());
        let micros = now.as_micros().checked_sub(age.as_micros())?;
        (self.age < u8::MAX).then(|| Instant::from_micros(micros))
    }

    /// Returns the node number of the relay in the mission, 1 to N.
    pub const fn relay(&self) -> u16 {
        self.relay.number() - MAX_RELAYS * self.refusal()
    }

    /// Returns direction and distance of the nearest node that the relay refuses; 0 for none.
    ///
    /// 1 to 4: another mission, at a node whose number is smaller by 1 to 4 (toward Tx). 5 to 8: another mission, at a
    /// node whose number is larger by 1 to 4 (toward Rx). 9 to 16: the same for another key. 17 to 24: the same for an
    /// old epoch.
    pub const fn refusal(&self) -> u16 {
        self.relay.number().saturating_sub(1) / MAX_RELAYS
    }

    /// Returns the relay's combined state: a sum of six values, each multiplied by its unit.
    ///
    /// In order: phase (unit 1), two hold reasons (8 and 64), three flags (512), control state (4096), and one flag
    /// (28672).
    pub const fn state(&self) -> u16 {
        self.state.number()
    }

    /// Control state of a drone whose autopilot is not received.
    pub(crate) const SILENT: u16 = 1;
    /// Control state of a drone that the relay controls.
    pub(crate) const ENGAGED: u16 = 4;
    /// Control state of a drone that the relay controls, without a position.
    pub(crate) const BLIND: u16 = 5;
    /// Control state of a drone that the relay controls, but whose autopilot does not fly to the setpoint.
    pub(crate) const REFUSED: u16 = 6;

    /// Returns the number of the drone's control state, from 1; 0 without an autopilot.
    ///
    /// In the states 3 to 6 the drone is in the air: 3 standby, 4 engaged, 5 blind, 6 engaged with a refused setpoint.
    #[doc(hidden)]
    pub const fn control(&self) -> u16 {
        self.state.number() / 4096 % 7
    }
}

/// Additional state of one relay in a report: the relay of the first entry. A relay adds these details to every
/// eighth entry that it sends about itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Detail {
    /// Setpoint of the drone, and the agreed position of the relay.
    pub places: [Coarse; 2],
    /// Differences of node numbers to the neighbours toward Tx and toward Rx: 1 to 4, 0 for no neighbour.
    pub neighbours: [u8; 2],
    power: Word,
    version: Word,
}

impl Detail {
    /// Creates details with the measured interference in W, 0 for none, and the version of the mission.
    pub fn new(places: [Coarse; 2], neighbours: [u8; 2], power_w: f32, version: u16) -> Self {
        let [_, _, a, b] = power_w.to_le_bytes();
        Self {
            places,
            neighbours,
            power: Word::new(u16::from_le_bytes([a, b])),
            version: Word::new(version),
        }
    }

    /// Returns the measured interference, W; 0 for none. Its relative error is at most 0.8 %.
    pub const fn power_w(&self) -> f32 {
        f32::from_bits((self.power.number() as u32) << 16)
    }

    /// Returns the version of the mission that the relay flies.
    pub const fn version(&self) -> u16 {
        self.version.number()
    }
}

/// Report: states of relays, on their way to the ground station.
#[cfg(feature = "telemetry")]
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Reports {
    pass: PassId,
    /// Details of the relay in the first entry; `None` in most reports.
    pub detail: Option<Detail>,
    /// States of up to four relays.
    pub entries: Vec<Entry, MOST_ENTRIES>,
}

#[cfg(feature = "telemetry")]
impl Reports {
    /// Creates a report without entries, which answers the request `number`.
    pub const fn new(number: u16, mission: u16) -> Self {
        Self {
            pass: PassId::new(number, mission),
            detail: None,
            entries: Vec::new(),
        }
    }

    /// Returns the number of the newest request that the sender has received.
    pub const fn number(&self) -> u16 {
        self.pass.number()
    }

    /// Returns the digest of the mission that the sender loaded before flight.
    pub const fn mission(&self) -> u16 {
        self.pass.digest()
    }

    /// Returns the details of the relay in the first entry, and the states of up to four relays.
    pub(crate) fn states(&self) -> (Option<Detail>, &[Entry]) {
        (self.detail, &self.entries)
    }

    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        write(&(tag::REPORT, self), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let report: Self = read(body)?;
        let detail = report.detail.map_or(0, |_| size_of::<Detail>());
        // The count has no empty varint bytes: see `take_targets`.
        if body.len() != 6 + detail + size_of::<Entry>() * report.entries.len() {
            return Err(MessageError::Encoding);
        }
        let is_sound = |detail: Detail| {
            let [before, after] = detail.neighbours.map(u16::from);
            before.max(after) <= CANDIDATES && detail.power.number() <= LARGEST
        };
        let mut entries = report.entries.iter();
        let are_sound = entries.all(|entry| {
            (1..=REFUSALS * MAX_RELAYS).contains(&entry.relay.number()) && entry.state() < STATES
        });
        if are_sound && report.detail.is_none_or(is_sound) {
            Ok(report)
        } else {
            Err(MessageError::Value)
        }
    }
}

/// Report whose content a relay without the feature `telemetry` forwards without decoding it.
#[cfg(not(feature = "telemetry"))]
#[derive(Clone, PartialEq, Debug)]
pub struct Reports(Vec<u8, 86>);

#[cfg(not(feature = "telemetry"))]
impl Reports {
    /// Returns the digest of the mission that the sender loaded before flight.
    pub fn mission(&self) -> u16 {
        let digest = self.0.get(2..4).and_then(<[u8]>::first_chunk);
        digest.map_or(0, |digest| u16::from_le_bytes(*digest))
    }

    /// Returns an empty list, because a relay without the feature `telemetry` does not decode reports.
    #[expect(clippy::unused_self, reason = "as with the feature")]
    pub(crate) const fn states(&self) -> (Option<Detail>, &[Entry]) {
        (None, &[])
    }

    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let (first, rest) = buffer.split_first_mut()?;
        *first = tag::REPORT;
        rest.get_mut(..self.0.len())?.copy_from_slice(&self.0);
        Some(1 + self.0.len())
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let is_long = body.len() >= 6;
        let body = Vec::from_slice(body).ok().filter(|_| is_long);
        body.map(Self).ok_or(MessageError::Encoding)
    }
}
