//! An attacker on the air: it hears every frame, knows the mission and lacks the key, and sends what it likes to any relay.

use std::collections::{BTreeMap, VecDeque};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::wire::frame::MAX_SWEEP;
use uav_relay::{Instant, Port, Stats};

use super::link::LinkSpec;

/// What an attacker does. Half of its frames it sends back to back from the start on, the rest at random times.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Attack {
    /// Forged frames.
    pub forged: u32,
    /// Recorded frames, sent again.
    pub replayed: u32,
    /// The last of them is sent at this time, or a little later.
    pub until: Instant,
}

/// One frame of an attacker.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Strike {
    /// One of its own making.
    Forge,
    /// One that it has heard.
    Replay,
}

/// What became of the frames of an attacker: how many of them the relays that they came to counted as what.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Struck {
    /// By kind, and by the name of the counter in [`Stats`]; `received` is a frame that was taken for a neighbour's.
    pub counted: BTreeMap<(Strike, &'static str), u64>,
}

/// A frame that was heard.
#[derive(Clone, Debug)]
pub(super) struct Recorded {
    /// When it has arrived at whoever it is for: before that it would be no replay.
    pub(super) arrived: Instant,
    /// The port it comes in by.
    pub(super) port: Port,
    pub(super) bytes: Vec<u8>,
}

/// The attacker in a run.
#[derive(Debug)]
pub(super) struct Attacker {
    pub(super) attack: Attack,
    /// Its own: what it draws changes nothing in what the relays and the links draw.
    pub(super) rng: ChaCha8Rng,
    recorded: VecDeque<Recorded>,
}

/// The stream of random numbers that an attacker draws from.
const ATTACKER: u64 = 2;

/// Frames that an attacker keeps: the latest.
const MEMORY: usize = 65_536;

/// How many frames it looks at to find one that has arrived.
const TRIES: usize = 64;

impl Attacker {
    pub(super) fn new(attack: Attack, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(ATTACKER);
        Self {
            attack,
            rng,
            recorded: VecDeque::new(),
        }
    }

    /// When it sends what, in no order.
    pub(super) fn plan(&mut self, link: &LinkSpec) -> Vec<(Instant, Strike)> {
        let Attack {
            forged,
            replayed,
            until,
        } = self.attack;
        let pause = link.line_time(MAX_SWEEP);
        let mut free = Instant::ZERO;
        let kinds = [(Strike::Forge, forged), (Strike::Replay, replayed)];
        let all = kinds
            .into_iter()
            .flat_map(|(kind, count)| (0..count).map(move |number| (kind, number)));
        let mut plan = Vec::new();
        for (kind, number) in all {
            let at = if number % 2 == 0 && free < until {
                free = free + pause;
                free
            } else {
                Instant::from_micros(self.rng.random_range(0..=until.as_micros()))
            };
            plan.push((at, kind));
        }
        plan
    }

    /// Hears a frame.
    pub(super) fn record(&mut self, frame: Recorded) {
        if self.recorded.len() >= MEMORY {
            self.recorded.pop_front();
        }
        self.recorded.push_back(frame);
    }

    /// One of the frames that have arrived by `now`; `None` if there are none, or next to none.
    pub(super) fn recall(&mut self, now: Instant) -> Option<Recorded> {
        if self.recorded.is_empty() {
            return None;
        }
        for _ in 0..TRIES {
            let pick = self.rng.random_range(0..self.recorded.len());
            let frame = self.recorded.get(pick)?;
            if frame.arrived < now {
                return Some(frame.clone());
            }
        }
        None
    }
}

/// The counter that tells what a frame was taken for: the first that has grown from `before` to `after`.
pub(super) fn fate(before: &Stats, after: &Stats) -> &'static str {
    /// A counter, by its name.
    type Counter = (&'static str, fn(&Stats) -> u32);
    // What was received and then refused has grown in two of them: why it was refused comes first.
    let counters: [Counter; 16] = [
        ("forged", |stats| stats.forged),
        ("unsigned", |stats| stats.unsigned),
        ("replayed", |stats| stats.replayed),
        ("handshakes", |stats| stats.handshakes),
        ("version", |stats| stats.version),
        ("malformed", |stats| stats.malformed),
        ("foreign", |stats| stats.foreign),
        ("overheard", |stats| stats.overheard),
        ("misaddressed", |stats| stats.misaddressed),
        ("misdirected", |stats| stats.misdirected),
        ("mission", |stats| stats.mission),
        ("view", |stats| stats.view),
        ("stale", |stats| stats.stale),
        ("truncated", |stats| stats.truncated),
        ("crc", |stats| stats.crc),
        ("received", |stats| stats.received),
    ];
    counters
        .into_iter()
        .find(|(_, count)| count(after) > count(before))
        .map_or("oversized", |(name, _)| name)
}
