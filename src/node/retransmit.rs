//! How long what comes back of a message sent onward is awaited before that message is sent again.

use super::context::Effects;
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
    pub(crate) fn arrived(&mut self, now: Instant, trip: Trip) -> Effects {
        let took = Duration::from_micros(u64::from(micros(now).wrapping_sub(self.sent_at)));
        // Nobody says that the first one has arrived.
        let took = match (self.unheard, self.arrived) {
            (1, false) => Took::Exactly(took),
            _ => Took::AtLeast(took),
        };
        self.unheard = 0;
        self.arrived = true;
        self.wait(now, trip);
        Effects {
            took: Some(took),
            ..Effects::NONE
        }
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
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::{Again, DOUBLINGS, FREE, MEMORY, Retransmit, SOON, Trip};
    use crate::node::round_trip::Took;
    use crate::time::{Duration, Instant};

    const HOP: Duration = Duration::from_millis(10);

    const WAY: Trip = Trip {
        hop_time: HOP,
        hops: 49,
        slow: false,
    };

    /// Hops' time from `now` until it does something again.
    fn wait(retransmit: &Retransmit, now: Instant) -> u64 {
        let at = retransmit.next_timeout().unwrap();
        at.since(now).as_micros() / HOP.as_micros()
    }

    fn around(hops: u32) -> core::ops::RangeInclusive<u64> {
        u64::from(hops)..=u64::from(hops + hops / 8)
    }

    /// A message was sent, and nothing was heard for as long as is waited: `again` in a row.
    fn silence(retransmit: &mut Retransmit, mut now: Instant, again: u32) -> Instant {
        for _ in 0..again {
            now = retransmit.next_timeout().unwrap();
            assert_eq!(retransmit.take_due(now, HOP), Some(Again::Onward));
            retransmit.sent(now, WAY);
        }
        now
    }

    #[test]
    fn the_whole_way_is_waited_for_once() {
        let (mut one, start) = (Retransmit::new(1), Instant::from_millis(1_000));
        one.begin();
        one.sent(start, WAY);
        assert!(around(100).contains(&wait(&one, start)));
        let now = silence(&mut one, start, 1);
        assert!(around(4).contains(&wait(&one, now)));
        let now = silence(&mut one, now, 1);
        assert!(around(8).contains(&wait(&one, now)));
        // It has arrived: the answer may take its time.
        one.arrived(now, WAY);
        assert!(around(100).contains(&wait(&one, now)));
        for message in 0..=MEMORY {
            one.begin();
            one.sent(now, WAY);
            let hops = if message < MEMORY { SOON } else { 100 };
            assert!(around(hops).contains(&wait(&one, now)), "{message}");
        }
    }

    /// On a channel that loses nothing the first repetition is answered: nothing follows from it.
    #[test]
    fn a_repetition_that_is_answered_keeps_nobody_in_doubt() {
        let (mut one, now) = (Retransmit::new(1), Instant::from_millis(1_000));
        one.begin();
        one.sent(now, WAY);
        silence(&mut one, now, 1);
        for message in 0..=MEMORY {
            one.begin();
            one.sent(now, WAY);
            assert_eq!(one.lossy, message < MEMORY, "{message}");
            if one.lossy {
                let now = silence(&mut one, now, 1);
                one.arrived(now, WAY);
            }
        }
    }

    #[test]
    fn what_comes_again_may_be_lost_to_the_next_one_too() {
        let (mut one, now) = (Retransmit::new(1), Instant::from_millis(1_000));
        one.begin();
        one.sent(now, WAY);
        one.came_again(now, HOP);
        assert!(around(SOON).contains(&wait(&one, now)));
        one.arrived(now, WAY);
        one.came_again(now, HOP);
        assert!(around(100).contains(&wait(&one, now)));
        // That is no proof of a loss of its own.
        one.begin();
        one.sent(now, WAY);
        assert!(around(100).contains(&wait(&one, now)));
    }

    #[test]
    fn what_stays_unheard_is_repeated_less_and_less_often() {
        let (mut one, mut now) = (Retransmit::new(1), Instant::from_millis(1_000));
        one.begin();
        one.sent(now, WAY);
        let spans: Vec<u64> = (0..FREE + DOUBLINGS + 2)
            .map(|_| {
                now = silence(&mut one, now, 1);
                wait(&one, now)
            })
            .collect();
        let expected = [4, 8, 8, 8, 8, 8, 16, 32, 64, 64, 64];
        assert_eq!(spans.len(), expected.len());
        for (span, hops) in spans.iter().zip(expected) {
            assert!(around(hops).contains(span), "{spans:?}");
        }
        // Even where an answer would be back at once.
        let next = Trip { hops: 1, ..WAY };
        one.sent(now, next);
        assert!(around(32).contains(&wait(&one, now)));
        one.arrived(now, WAY);
        assert!(around(100).contains(&wait(&one, now)));
    }

    #[test]
    fn that_of_one_repetition_is_a_sample_and_that_of_several_a_bound() {
        let after = |repetitions| {
            let mut one = Retransmit::new(1);
            let now = Instant::from_millis(1_000);
            one.begin();
            one.sent(now, WAY);
            let now = silence(&mut one, now, repetitions);
            (one, now + HOP)
        };
        let (mut one, now) = after(1);
        assert_eq!(one.arrived(now, WAY).took, Some(Took::Exactly(HOP)));
        // The next one may answer either.
        assert_eq!(one.arrived(now, WAY).took, Some(Took::AtLeast(HOP)));
        let (mut one, now) = after(2);
        assert_eq!(one.arrived(now, WAY).took, Some(Took::AtLeast(HOP)));
        // What came of it comes as often as it was asked for, and then as often as it is said unasked: the first one tells something.
        assert_eq!(one.came_twice(now + HOP), Some(Took::AtLeast(HOP.times(2))));
        assert_eq!(one.came_twice(now + HOP), None);
        let (mut one, now) = after(0);
        assert_eq!(one.came_twice(now), None);
    }

    #[test]
    fn what_was_sent_once_takes_no_longer_than_until_it_came_back() {
        let (mut one, start) = (Retransmit::new(1), Instant::from_millis(1_000));
        assert_eq!(one.went_through(start, 49), None, "nothing was sent");
        one.begin();
        one.sent(start, WAY);
        let back = start + HOP.times(98);
        assert_eq!(one.went_through(back, 49), Some(Took::AtMost(HOP.times(2))));
        assert_eq!(one.went_through(back, 0), None);
        let now = silence(&mut one, start, 1);
        assert_eq!(one.went_through(now, 49), None, "it was repeated");
        one.arrived(now, WAY);
        assert_eq!(one.went_through(now, 49), None, "it was repeated");
    }

    /// Who asks may only be slow to hear.
    #[test]
    fn who_asks_again_and_again_is_told_unasked_less_and_less_often() {
        let (mut one, mut now) = (Retransmit::new(1), Instant::from_millis(1_000));
        let way = Trip { hops: 1, ..WAY };
        one.begin();
        for hops in [4, 8, 16, 32, 32] {
            one.asked(now, way);
            let due = one.next_timeout();
            one.asked(now, way);
            assert_eq!(one.next_timeout(), due, "what is to be said stays due");
            assert!(around(hops).contains(&wait(&one, now)), "{hops}");
            now = due.unwrap();
            assert_eq!(one.take_due(now, HOP), Some(Again::Back));
        }
    }

    #[test]
    fn what_is_repeated_already_is_repeated_no_sooner_for_coming_again() {
        let (mut one, now) = (Retransmit::new(1), Instant::from_millis(1_000));
        one.begin();
        one.sent(now, WAY);
        let now = silence(&mut one, now, 3);
        let due = one.next_timeout();
        one.came_again(now, HOP);
        assert_eq!(one.next_timeout(), due);
    }

    #[test]
    fn an_answer_is_said_once_or_where_frames_get_lost_as_often_as_the_way_has_digits() {
        for (hops, digits) in [(0, 0), (1, 1), (7, 3), (8, 4), (49, 6), (199, 8)] {
            for lossy in [false, true] {
                let (mut one, mut now) = (Retransmit::new(1), Instant::from_millis(1_000));
                let way = Trip { hops, ..WAY };
                one.begin();
                if lossy {
                    one.asked(now, way);
                } else {
                    one.answered(now, way);
                }
                let mut times = 0;
                while let Some(at) = one.next_timeout() {
                    assert!(around(SOON).contains(&wait(&one, now)));
                    now = at;
                    assert_eq!(one.take_due(now, HOP), Some(Again::Back));
                    times += 1;
                }
                assert_eq!(times, if lossy { digits } else { 0 }, "{hops}");
                assert_eq!(one.take_due(now, HOP), None);
            }
        }
    }
}
