//! Half-duplex radio channel: senders receive nothing, and overlapping frames are lost.
//!
//! Frames that overlap are lost at the nodes that are in range of both senders. The medium has no clock: each call appends its
//! future events to an [`Agenda`], and the caller passes them to [`Medium::happen`] when due.

use std::collections::VecDeque;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use uav_relay::{Duration, Instant};

use super::faults::LinkSpec;

/// Event of a node's radio.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum AirEvent {
    /// End of the back-off: the radio senses the channel.
    Sense(usize),
    /// Start of a transmission.
    Begin(usize),
    /// End of a transmission.
    End(usize),
}

/// Scheduled events and their times.
pub type Agenda = Vec<(Instant, AirEvent)>;

/// Completed transmission.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sent {
    /// Sending node.
    pub from: usize,
    /// Bytes of the frame.
    pub frame: Vec<u8>,
    /// Nodes that received the frame intact.
    pub heard_by: Vec<usize>,
    /// Number of nodes in range that did not receive it.
    pub missed: usize,
}

/// Reception of a frame at one node.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Reception {
    Clean,
    Collided,
    /// Lost because the node itself was sending.
    Unheard,
}

#[derive(Debug)]
struct OnAir {
    from: usize,
    frame: Vec<u8>,
    ends: Instant,
    hearers: Vec<(usize, Reception)>,
}

/// Channel with a radio for every node.
#[derive(Debug)]
pub struct Medium {
    access: Access,
    link: LinkSpec,
    radios: Vec<Radio>,
    on_air: Vec<OnAir>,
    /// Separate generator, so that back-offs do not change other draws.
    rng: ChaCha8Rng,
    counts: AirCounts,
}

/// Random-number stream of the back-offs.
const BACKOFFS: u64 = 3;

impl Medium {
    /// Free channel with the data rate of `link` and `nodes` radios. [`Access::Ideal`] is treated as ALOHA.
    pub fn new(access: Access, link: LinkSpec, nodes: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(BACKOFFS);
        Self {
            access,
            link,
            radios: (0..nodes).map(|_| Radio::default()).collect(),
            on_air: Vec::new(),
            rng,
            counts: AirCounts::default(),
        }
    }

    /// Returns the counters.
    pub fn counts(&self) -> AirCounts {
        self.counts
    }

    /// Returns the time on the air of a frame of `bytes` bytes.
    pub fn air_time(&self, bytes: usize) -> Duration {
        self.link.line_time(HEADER + bytes)
    }

    /// Queues a frame at the radio of `node`. Returns false if the queue is full.
    pub fn offer(&mut self, now: Instant, node: usize, frame: &[u8], agenda: &mut Agenda) -> bool {
        let Some(radio) = self.radios.get_mut(node) else {
            return false;
        };
        if radio.held() >= QUEUE {
            self.counts.dropped += 1;
            return false;
        }
        radio.queue.push_back(frame.to_vec());
        if radio.state == State::Idle {
            self.next(now, node, agenda);
        }
        true
    }

    /// Processes a due event. Returns the frame whose transmission it ends; `hearers` returns the nodes in range of a sender.
    pub fn happen(
        &mut self,
        now: Instant,
        event: AirEvent,
        hearers: impl FnOnce(usize) -> Vec<usize>,
        agenda: &mut Agenda,
    ) -> Option<Sent> {
        match event {
            AirEvent::Sense(node) => self.sense(now, node, agenda),
            AirEvent::Begin(node) => self.begin(now, node, hearers, agenda),
            AirEvent::End(node) => return self.end(now, node, agenda),
        }
        None
    }

    /// Switches off the radio of `node`: its queue is lost, and its current transmission is cut short.
    pub fn switch_off(&mut self, node: usize) {
        if let Some(radio) = self.radios.get_mut(node) {
            radio.queue.clear();
            if radio.state != State::Sending {
                radio.state = State::Idle;
            }
        }
        for frame in self.on_air.iter_mut().filter(|frame| frame.from == node) {
            for (_, fate) in &mut frame.hearers {
                *fate = Reception::Unheard;
            }
        }
    }

    /// Starts the next frame of `node`, if any.
    fn next(&mut self, now: Instant, node: usize, agenda: &mut Agenda) {
        let Some(radio) = self.radios.get_mut(node) else {
            return;
        };
        radio.state = State::Idle;
        if radio.queue.is_empty() {
            return;
        }
        if self.access == Access::Csma {
            self.back_off(now, node, LEAST_EXPONENT, agenda);
        } else {
            self.turn(now, node, agenda);
        }
    }

    /// Waits a random number of slots below 2^`exponent`.
    fn back_off(&mut self, now: Instant, node: usize, exponent: u32, agenda: &mut Agenda) {
        let slots = self.rng.random_range(0..1_u32 << exponent);
        let until = now + self.link.line_time(SLOT).times(slots);
        if let Some(radio) = self.radios.get_mut(node) {
            radio.state = State::Waiting { until, exponent };
            agenda.push((until, AirEvent::Sense(node)));
        }
    }

    fn sense(&mut self, now: Instant, node: usize, agenda: &mut Agenda) {
        let Some(State::Waiting { until, exponent }) = self.radios.get(node).map(|it| it.state)
        else {
            return;
        };
        if until != now {
            return;
        }
        if self.on_air.iter().any(|frame| frame.is_heard(node, now)) {
            self.counts.deferred += 1;
            let exponent = (exponent + 1).min(MOST_EXPONENT);
            self.back_off(now, node, exponent, agenda);
        } else {
            self.turn(now, node, agenda);
        }
    }

    /// Turns from receiving to sending; frames that the node was receiving are lost there.
    fn turn(&mut self, now: Instant, node: usize, agenda: &mut Agenda) {
        let until = now + self.link.line_time(TURNAROUND);
        if let Some(radio) = self.radios.get_mut(node) {
            radio.state = State::Turnaround { until };
            agenda.push((until, AirEvent::Begin(node)));
        }
        for frame in &mut self.on_air {
            frame.spoil(node, now, Reception::Unheard);
        }
    }

    fn begin(
        &mut self,
        now: Instant,
        node: usize,
        hearers: impl FnOnce(usize) -> Vec<usize>,
        agenda: &mut Agenda,
    ) {
        let Some(radio) = self.radios.get_mut(node) else {
            return;
        };
        if radio.state != (State::Turnaround { until: now }) {
            return;
        }
        let frame = radio.queue.pop_front().unwrap_or_default();
        let ends = now + self.link.line_time(HEADER + frame.len());
        radio.state = State::Sending;
        let mut heard = Vec::new();
        for by in hearers(node) {
            let mut fate = Reception::Clean;
            for other in &mut self.on_air {
                if other.is_heard(by, now) {
                    other.spoil(by, now, Reception::Collided);
                    fate = Reception::Collided;
                }
            }
            if self.radios.get(by).is_some_and(Radio::is_deaf) {
                fate = Reception::Unheard;
            }
            heard.push((by, fate));
        }
        self.counts.sent += 1;
        self.counts.air_time_us += ends.since(now).as_micros();
        self.on_air.push(OnAir {
            from: node,
            frame,
            ends,
            hearers: heard,
        });
        agenda.push((ends, AirEvent::End(node)));
    }

    fn end(&mut self, now: Instant, node: usize, agenda: &mut Agenda) -> Option<Sent> {
        let at = self
            .on_air
            .iter()
            .position(|frame| frame.from == node && frame.ends == now)?;
        let over = self.on_air.swap_remove(at);
        let count = |fate| over.hearers.iter().filter(|(_, it)| *it == fate).count();
        let (collided, unheard) = (count(Reception::Collided), count(Reception::Unheard));
        self.counts.collided += collided as u64;
        self.counts.unheard += unheard as u64;
        self.next(now, node, agenda);
        let clean = over
            .hearers
            .iter()
            .filter(|(_, fate)| *fate == Reception::Clean);
        Some(Sent {
            from: node,
            frame: over.frame,
            heard_by: clean.map(|(by, _)| *by).collect(),
            missed: collided + unheard,
        })
    }
}

impl OnAir {
    /// Returns true if `node` is in range and the frame has not ended. A frame ending now does not interfere.
    fn is_heard(&self, node: usize, now: Instant) -> bool {
        self.ends > now && self.hearers.iter().any(|(by, _)| *by == node)
    }

    /// Marks the frame as lost at `node`, unless it already was.
    fn spoil(&mut self, node: usize, now: Instant, how: Reception) {
        if self.ends <= now {
            return;
        }
        for (by, fate) in &mut self.hearers {
            if *by == node && *fate == Reception::Clean {
                *fate = how;
            }
        }
    }
}

// Channel access of the radios and its timing.
//
// Values of IEEE 802.15.4-2006 at 250 kbit/s (unslotted CSMA-CA, 6.4 and 7.5.1.4) in bytes, so that they scale with the data
// rate: a symbol is half a byte.

/// Access method of a shared channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Access {
    /// Separate line per sender: no collisions.
    #[default]
    Ideal,
    /// Half-duplex channel; a radio sends at once unless it is already sending.
    Aloha,
    /// Half-duplex channel; a radio waits a random time and sends if the channel is free.
    Csma,
}

/// Bytes sent before a frame: preamble, start of frame, length (SHR and PHR).
pub const HEADER: usize = 6;

/// Turnaround from receiving to sending, in bytes: `aTurnaroundTime`, 12 symbols. The radio neither sends nor receives meanwhile.
pub const TURNAROUND: usize = 6;

/// Overhead of a frame on the air, bytes.
pub const OVERHEAD: usize = HEADER + TURNAROUND;

/// Length of a back-off slot, bytes: `aUnitBackoffPeriod`, 20 symbols. It is longer than the turnaround, so that later slots sense
/// the sender.
pub const SLOT: usize = 10;

/// Initial back-off exponent, `macMinBE`: the first wait is 0 to 2^3 - 1 slots.
pub const LEAST_EXPONENT: u32 = 3;

/// Largest back-off exponent, `macMaxBE`: each busy channel doubles the bound, up to 2^5 - 1 slots. Retries are unlimited.
pub const MOST_EXPONENT: u32 = 5;

/// Number of frames that a radio queues, including the frame in transmission. A full queue drops the newest frame, as modems do.
pub const QUEUE: usize = 4;

/// Counters of a channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct AirCounts {
    /// Frames sent.
    pub sent: u64,
    /// Receptions lost because frames overlapped.
    pub collided: u64,
    /// Receptions lost because the receiving node was sending.
    pub unheard: u64,
    /// Back-offs because of a busy channel.
    pub deferred: u64,
    /// Frames dropped because the radio's queue was full.
    pub dropped: u64,
    /// Total time of all frames on the air, µs.
    pub air_time_us: u64,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    /// Receiving, with an empty queue.
    #[default]
    Idle,
    /// Receiving until the back-off ends; `exponent` is the back-off exponent.
    Waiting { until: Instant, exponent: u32 },
    /// Turnaround from receiving to sending.
    Turnaround { until: Instant },
    /// Sending.
    Sending,
}

#[derive(Debug, Default)]
struct Radio {
    state: State,
    /// Queued frames, without the frame in transmission.
    queue: VecDeque<Vec<u8>>,
}

impl Radio {
    /// Returns true while the radio cannot receive.
    fn is_deaf(&self) -> bool {
        matches!(self.state, State::Turnaround { .. } | State::Sending)
    }

    /// Returns the number of queued frames, including the frame in transmission.
    fn held(&self) -> usize {
        self.queue.len() + usize::from(self.state == State::Sending)
    }
}
