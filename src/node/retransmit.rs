//! How long what comes back of a message sent onward is awaited before that message is sent again.

use super::round_trip::Took;
use crate::jitter::Jitter;
use crate::time::{Duration, Instant};

/// How many times longer than a sweep a pass may take on which relays compute: its frames are more than twice as long, and
/// a relay's share of it takes up to thirty portions.
const SLOW: u32 = 4;

/// A message of which nothing is heard is repeated every eight hops' time: a run of lost frames is over the sooner.
const LOG_MOST: u32 = 2;

/// So often it is repeated before the spans between the repetitions double: that many may get lost where every other frame does.
const FREE: u8 = 6;

/// How often they double.
const DOUBLINGS: u8 = 3;

/// Within this many hops' time a neighbour that has got a message again says so.
const SOON: u32 = 4;

/// For so many messages it is remembered that a frame was lost.
const MEMORY: u8 = 8;

/// What is known of the current message's getting through.
#[derive(Clone, Debug)]
pub(crate) struct Retransmit {
    /// How often it has been sent again since anything was heard of it.
    unheard: u8,
    /// Whether it has been sent again, and what comes of that may come yet.
    repeated: bool,
    /// Whether the neighbour has said that it has arrived.
    arrived: bool,
    /// Whether frames get lost on its way, by what this relay or the one before has seen.
    lossy: bool,
    /// Of how many messages from now on that is to be expected.
    doubt: u8,
    /// How often what came of it is said again unasked.
    answers: u8,
    /// How often that was asked for.
    asks: u8,
    jitter: Jitter,
    /// When it was sent last, µs, wrapping.
    sent_at: u32,
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

/// What the time has come for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Again {
    /// Sending the message onward again.
    Onward,
    /// Saying again what came of it.
    Back,
}

/// The time in µs, wrapping after 71 minutes.
#[expect(clippy::cast_possible_truncation, reason = "as it says")]
const fn micros(at: Instant) -> u32 {
    at.as_micros() as u32
}

impl Retransmit {
    pub(crate) const fn new(seed: u32) -> Self {
        Self {
            unheard: 0,
            repeated: false,
            arrived: false,
            lossy: false,
            doubt: 0,
            answers: 0,
            asks: 0,
            jitter: Jitter::new(seed),
            sent_at: 0,
            at: None,
        }
    }

    /// There is a new message.
    pub(crate) const fn begin(&mut self) {
        self.unheard = 0;
        self.repeated = false;
        self.asks = 0;
        self.arrived = false;
        self.lossy = self.doubt > 0;
        self.doubt = self.doubt.saturating_sub(1);
        self.stop();
    }

    /// A neighbour has said that the message has arrived. What is missing is the answer, and that may take its time.
    pub(crate) fn arrived(&mut self, now: Instant, trip: Trip) -> Took {
        let took = Duration::from_micros(u64::from(micros(now).wrapping_sub(self.sent_at)));
        // Nobody says that the first one has arrived.
        let took = match (self.unheard, self.arrived) {
            (1, false) => Took::Exactly(took),
            _ => Took::AtLeast(took),
        };
        self.unheard = 0;
        self.arrived = true;
        self.wait(now, trip);
        took
    }

    /// What came of the message has come back over `hops` hops each way. Where it was sent once that says how long one takes at most.
    pub(crate) fn went_through(&self, now: Instant, hops: u16) -> Option<Took> {
        let clean = self.unheard == 0 && !self.arrived && self.at.is_some();
        let took = micros(now).wrapping_sub(self.sent_at);
        let took = took.checked_div(u32::from(hops)).filter(|_| clean)?;
        Some(Took::AtMost(Duration::from_micros(u64::from(took))))
    }

    /// What came of the message has come once more. Where it was sent again, that is what came of the last one.
    pub(crate) fn came_twice(&mut self, now: Instant) -> Option<Took> {
        let took = micros(now).wrapping_sub(self.sent_at);
        let first = core::mem::take(&mut self.repeated);
        first.then_some(Took::AtLeast(Duration::from_micros(u64::from(took))))
    }

    /// The relay before has sent the message again: frames get lost on its way, and it may be lost to the next one, too.
    pub(crate) fn came_again(&mut self, now: Instant, hop_time: Duration) {
        self.lossy = true;
        let soon = now + self.jitter.spread(hop_time.times(SOON));
        if self.unheard == 0 && !self.arrived && self.at.is_some_and(|at| at > soon) {
            self.at = Some(soon);
        }
    }

    /// The message goes out at `now`.
    ///
    /// The answer may take as long as there and back over the hops that are left, and two to spare; [`SLOW`] times as long where relays
    /// compute on the way. The relay next to a lost frame runs out of patience first, so one loss costs one repetition. From then on it is
    /// known that frames get lost here: this message and the next ones are repeated sooner, first after four hops' time and then after
    /// eight, until a neighbour says that it has arrived; after [`FREE`] of them less and less often, as the link may only be slow. The neighbour learns by the repetition that frames get lost, and does the same:
    /// so a loss is waited for the whole way once, and not at every hop of a long chain. A random eighth keeps relays on a shared channel
    /// from repeating in step.
    pub(crate) fn sent(&mut self, now: Instant, trip: Trip) {
        self.sent_at = micros(now);
        self.wait(now, trip);
    }

    fn wait(&mut self, now: Instant, trip: Trip) {
        let answer = (2 * u32::from(trip.hops) + 2) * if trip.slow { SLOW } else { 1 };
        let hops = match self.unheard {
            0 if self.lossy && !self.arrived => answer.min(SOON),
            0 => answer,
            again => {
                let doublings = again.saturating_sub(FREE).min(DOUBLINGS);
                answer.min(2 << u32::from(again).min(LOG_MOST)) << doublings
            }
        };
        self.answers = 0;
        self.at = Some(now + self.jitter.spread(trip.hop_time.times(hops)));
    }

    /// What came of the message is known and goes back, over as many hops as it has come.
    ///
    /// Nobody says that it has arrived. Where frames get lost it is said again as many times as that number of hops has binary digits: then
    /// it is seldom that it has to be asked for, which takes the relay before as long as it waits for an answer.
    #[inline(never)] // called from many places
    pub(crate) fn answered(&mut self, now: Instant, trip: Trip) {
        self.stop();
        if self.lossy {
            let digits = u16::BITS - trip.hops.leading_zeros();
            self.answers = u8::try_from(digits).unwrap_or(u8::MAX);
            self.say_again(now, trip.hop_time);
        }
    }

    /// The relay before asks for what came of the message: it was lost on the way back.
    pub(crate) fn asked(&mut self, now: Instant, trip: Trip) {
        self.lossy = true;
        // Who asks again and again may only be slow to hear.
        if self.answers == 0 {
            self.asks = self.asks.saturating_add(1);
            self.answered(now, trip);
        }
    }

    fn say_again(&mut self, now: Instant, hop_time: Duration) {
        let span = hop_time.times(SOON << self.asks.saturating_sub(1).min(DOUBLINGS));
        self.at = (self.answers > 0).then(|| now + self.jitter.spread(span));
    }

    /// Nothing is awaited any more.
    pub(crate) const fn stop(&mut self) {
        self.answers = 0;
        self.at = None;
    }

    /// What is to be sent again now.
    pub(crate) fn take_due(&mut self, now: Instant, hop_time: Duration) -> Option<Again> {
        self.at.filter(|at| *at <= now)?;
        self.at = None;
        if self.answers > 0 {
            self.answers -= 1;
            self.say_again(now, hop_time);
            return Some(Again::Back);
        }
        // The first repetition where frames get lost shows nothing: the neighbour has not been asked before whether it has arrived.
        if self.unheard > 0 || self.arrived || !self.lossy {
            self.lossy = true;
            self.doubt = MEMORY;
        }
        self.unheard = self.unheard.saturating_add(1);
        self.repeated = true;
        Some(Again::Onward)
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }
}

#[cfg(test)]
mod tests;
