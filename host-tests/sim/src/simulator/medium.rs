//! Half-duplex radio channel: senders receive nothing, and overlapping frames are lost.
//!
//! Frames that overlap are lost at the nodes that are in range of both senders. The medium has no clock: each call appends its
//! future events to an [`Agenda`], and the caller gives them to [`Medium::happen`] when due.

use std::collections::VecDeque;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use uav_relay::{Duration, Instant};

use super::faults::LinkSpec;

/// Event of a node's radio on the channel, with the node's index from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum AirEvent {
    /// The random wait (back-off) ends, and the radio senses whether the channel is free.
    Sense(usize),
    /// The radio begins to send a frame.
    Begin(usize),
    /// The radio ends the frame that it sends.
    End(usize),
}

/// List of radio events that are due later. The caller gives each to [`Medium::happen`] at its time.
pub type Agenda = Vec<(Instant, AirEvent)>;

/// Frame whose transmission has ended, with its receivers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Sent {
    /// Index of the node that sent the frame, from 0.
    pub from: usize,
    /// Bytes of the frame that was sent.
    pub frame: Vec<u8>,
    /// Indices, from 0, of the nodes that received the frame intact.
    pub heard_by: Vec<usize>,
    /// Number of nodes in range that did not receive the frame.
    ///
    /// At such a node a different frame overlapped with it, or the node's own radio was sending or turning to sending.
    /// Also counted if the sender was switched off.
    pub missed: usize,
}

/// Result of the reception of a frame at one node in radio range of the sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Reception {
    Clean,
    Collided,
    /// The node does not receive the frame, because its own radio sends or turns to sending.
    ///
    /// Also used if the sender is switched off during the transmission.
    Unheard,
}

#[derive(Debug)]
struct OnAir {
    from: usize,
    frame: Vec<u8>,
    ends: Instant,
    hearers: Vec<(usize, Reception)>,
}

/// Half-duplex radio channel with a radio for every node.
#[derive(Debug)]
pub struct Medium {
    access: Access,
    link: LinkSpec,
    radios: Vec<Radio>,
    on_air: Vec<OnAir>,
    /// Random-number generator that is used only for back-offs, so that they change no other random draws.
    rng: ChaCha8Rng,
    counts: AirCounts,
}

/// Number of the random-number stream from which the radios' back-offs (random waits) are drawn.
const BACKOFFS: u64 = 3;

impl Medium {
    /// Creates a free channel with the data rate of `link` and `nodes` radios.
    ///
    /// [`Access::Ideal`] is treated as ALOHA.
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

    /// Returns the counters of the frames on the shared channel.
    pub fn counts(&self) -> AirCounts {
        self.counts
    }

    /// Returns the time for which a frame of `bytes` bytes, with its preamble, occupies the channel.
    pub fn air_time(&self, bytes: usize) -> Duration {
        self.link.line_time(HEADER + bytes)
    }

    /// Queues a frame at the radio of `node` (from 0). Returns false, and drops the frame, if the queue is full.
    ///
    /// Appends the radio's next event to `agenda`.
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

    /// Processes an event whose time has come. If it is the end of a frame, returns this frame.
    ///
    /// `hearers` returns the nodes in range of a sending node. Events that result from this event are appended to
    /// `agenda`.
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

    /// Switches off the radio of `node` (from 0). The frames in its queue are lost. A frame that it is sending is
    /// received by no node.
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

    /// Makes the radio of `node` prepare to send the next frame of its queue, if any.
    ///
    /// Appends the radio's next event to `agenda`.
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

    /// Starts the random wait of a radio before it senses the channel: fewer than 2^`exponent` slots.
    ///
    /// Appends the end of the wait to `agenda`.
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

    /// Starts the turnaround of the radio of `node` from receiving to sending.
    ///
    /// This radio loses the frames that it was receiving. Appends the end of the turnaround to `agenda`.
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
    /// Returns true if the frame is still being sent at `now`, and `node` is in range of its sender. False if the frame
    /// ends exactly at `now`.
    fn is_heard(&self, node: usize, now: Instant) -> bool {
        self.ends > now && self.hearers.iter().any(|(by, _)| *by == node)
    }

    /// Marks the frame as lost at `node`, with the result `how` of the reception. Does nothing if the frame has ended,
    /// or was already lost at this node.
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

/// Access method of a radio channel that all nodes share.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Access {
    /// Separate line for every sender, so that frames do not collide.
    #[default]
    Ideal,
    /// Half-duplex channel without sensing. A radio sends at once unless it is already sending.
    Aloha,
    /// Half-duplex channel with sensing. A radio waits a random time, and then sends if the channel is free.
    Csma,
}

/// Number of bytes sent before a frame: preamble, start of frame and length (SHR and PHR).
pub const HEADER: usize = 6;

/// Time in which a radio turns from receiving to sending, in byte times: `aTurnaroundTime`, 12 symbols.
///
/// The radio neither sends nor receives meanwhile.
pub const TURNAROUND: usize = 6;

/// Time on the air that a frame takes in addition to its own bytes, in byte times.
pub const OVERHEAD: usize = HEADER + TURNAROUND;

/// Unit of the random wait before sending, in byte times: `aUnitBackoffPeriod`, 20 symbols.
///
/// It is longer than the turnaround, so a radio that senses the channel in a later slot detects the sender.
pub const SLOT: usize = 10;

/// Back-off exponent of a radio's first wait for a free channel, `macMinBE`: 0 to 2^3 - 1 slots.
pub const LEAST_EXPONENT: u32 = 3;

/// Largest back-off exponent, `macMaxBE`: a wait of at most 2^5 - 1 slots.
///
/// The exponent grows by 1 each time that the channel is busy. The number of retries is not limited.
pub const MOST_EXPONENT: u32 = 5;

/// Largest number of frames that a radio queues, including the one that it sends. A full queue drops new frames.
pub const QUEUE: usize = 4;

/// Counters of a half-duplex radio channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct AirCounts {
    /// Number of frames sent by all nodes.
    pub sent: u64,
    /// Number of receptions that failed because frames overlapped. A frame that is lost at two nodes counts twice.
    pub collided: u64,
    /// Number of receptions lost because the receiver was sending or turning to sending. Receptions also count here if
    /// their sender was switched off during the transmission.
    pub unheard: u64,
    /// Number of times that a node found the channel busy and waited again.
    pub deferred: u64,
    /// Number of frames dropped because a radio's queue was full.
    pub dropped: u64,
    /// Total time of all frames on the channel, µs.
    pub air_time_us: u64,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    /// The radio can receive, and has nothing to send.
    #[default]
    Idle,
    /// The radio can receive, and waits until the time `until` before it senses the channel.
    ///
    /// `exponent` is the back-off exponent of this wait.
    Waiting { until: Instant, exponent: u32 },
    /// The radio turns from receiving to sending until the time `until`.
    Turnaround { until: Instant },
    /// The radio sends a frame.
    Sending,
}

#[derive(Debug, Default)]
struct Radio {
    state: State,
    /// Frames that wait to be sent, without the frame that is being sent.
    queue: VecDeque<Vec<u8>>,
}

impl Radio {
    /// Returns true while the radio cannot receive, because it sends or turns to sending.
    fn is_deaf(&self) -> bool {
        matches!(self.state, State::Turnaround { .. } | State::Sending)
    }

    /// Returns the number of frames in the radio's queue, including the one that it sends.
    fn held(&self) -> usize {
        self.queue.len() + usize::from(self.state == State::Sending)
    }
}
