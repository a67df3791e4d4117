//! How long what comes back of a message sent onward is awaited before that message is sent again.

use crate::jitter::Jitter;
use crate::time::{Duration, Instant};

/// How many times longer than a sweep a pass may take on which relays compute: its frames are more than twice as long, and
/// a relay's share of it takes up to thirty portions.
const SLOW: u32 = 4;

/// A message of which nothing is heard is repeated every eight hops' time: a run of lost frames is over the sooner.
const LOG_MOST: u32 = 2;

/// What is known of the current message's getting through.
#[derive(Clone, Debug)]
pub(crate) struct Retransmit {
    /// How often it has been sent again since anything was heard of it.
    unheard: u8,
    jitter: Jitter,
    at: Option<Instant>,
}

/// What an answer has to travel.
#[derive(Clone, Copy)]
pub(crate) struct Trip {
    /// How long one hop takes.
    pub(crate) hop_time: Duration,
    /// Hops to the relay that answers.
    pub(crate) hops: u16,
    /// Whether relays compute on the way.
    pub(crate) slow: bool,
}

impl Retransmit {
    pub(crate) const fn new(seed: u32) -> Self {
        Self {
            unheard: 0,
            jitter: Jitter::new(seed),
            at: None,
        }
    }

    /// A neighbour has said that the message has arrived, or there is a new one.
    pub(crate) const fn heard(&mut self) {
        self.unheard = 0;
    }

    /// The message goes out at `now`.
    ///
    /// The answer may take as long as there and back over the hops that are left, and two to spare; [`SLOW`] times as long where relays
    /// compute on the way. The relay next to a lost frame runs out of patience first, so one loss costs one repetition. From then on it is
    /// known that frames get lost here, and the message is repeated sooner, first after four hops' time and then after
    /// eight, until a neighbour says that it has arrived. A random eighth keeps relays on a shared channel from
    /// repeating in step.
    pub(crate) fn sent(&mut self, now: Instant, trip: Trip) {
        let answer = (2 * u32::from(trip.hops) + 2) * if trip.slow { SLOW } else { 1 };
        let hops = match self.unheard {
            0 => answer,
            again => answer.min(2 << u32::from(again).min(LOG_MOST)),
        };
        self.at = Some(now + self.jitter.spread(trip.hop_time.times(hops)));
    }

    /// Nothing is awaited any more.
    pub(crate) const fn stop(&mut self) {
        self.at = None;
    }

    /// Whether the message is to be sent again now.
    pub(crate) fn is_due(&mut self, now: Instant) -> bool {
        let due = self.at.is_some_and(|at| at <= now);
        if due {
            self.at = None;
            self.unheard = self.unheard.saturating_add(1);
        }
        due
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }
}
