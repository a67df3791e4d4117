//! Attacker without the key: receives every frame, and sends forged and replayed frames to any relay.

use std::collections::{BTreeMap, VecDeque};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::wire::frame::MAX_SWEEP;
use uav_relay::{Instant, Port, Stats};

use super::link::LinkSpec;

/// Attack plan. Half of the frames are sent back to back from the start, the others at random times.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Attack {
    /// Number of forged frames.
    pub forged: u32,
    /// Number of replayed frames.
    pub replayed: u32,
    /// Time of the last frame; back-to-back frames may end slightly later.
    pub until: Instant,
}

/// Kind of an attacker's frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum AttackKind {
    /// A forged frame.
    Forge,
    /// A received frame, sent again.
    Replay,
}

/// Counts of the attacker's frames by how the receiving relays classified them.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Struck {
    /// Frames by kind and by the name of the counter in [`Stats`]. `received` counts frames accepted as a neighbour's.
    pub counted: BTreeMap<(AttackKind, &'static str), u64>,
}

#[derive(Clone, Debug)]
pub(super) struct Recorded {
    /// Arrival time at the intended receiver; sending it earlier would not be a replay.
    pub(super) arrived: Instant,
    /// Port at which the receiver gets it.
    pub(super) port: Port,
    pub(super) bytes: Vec<u8>,
}

#[derive(Debug)]
pub(super) struct Attacker {
    pub(super) attack: Attack,
    /// Separate generator, so that the attacker's draws do not change those of relays and links.
    pub(super) rng: ChaCha8Rng,
    recorded: VecDeque<Recorded>,
}

const ATTACKER: u64 = 2;

/// Largest number of recorded frames; older ones are discarded.
const MEMORY: usize = 65_536;

/// Random picks before the search for an arrived frame is given up.
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

    /// Times and kinds of all frames, unsorted.
    pub(super) fn plan(&mut self, link: &LinkSpec) -> Vec<(Instant, AttackKind)> {
        let Attack {
            forged,
            replayed,
            until,
        } = self.attack;
        let pause = link.line_time(MAX_SWEEP);
        let mut free = Instant::ZERO;
        let kinds = [(AttackKind::Forge, forged), (AttackKind::Replay, replayed)];
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

    pub(super) fn record(&mut self, frame: Recorded) {
        if self.recorded.len() >= MEMORY {
            self.recorded.pop_front();
        }
        self.recorded.push_back(frame);
    }

    /// Returns a random recorded frame that has arrived before `now`; `None` if [`TRIES`] picks find none.
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

/// Returns the name of the first counter that grew from `before` to `after`.
pub(super) fn fate(before: &Stats, after: &Stats) -> &'static str {
    type Counter = (&'static str, fn(&Stats) -> u32);
    // A received but rejected frame increments two counters; the reason for the rejection comes first.
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
