//! How long what comes back of a message sent onward is awaited before that message is sent again.

use crate::jitter::Jitter;
use crate::time::{Duration, Instant};

/// How many times longer than a sweep a pass may take on which relays compute: its frames are more than twice as long, and
/// a relay's share of it takes up to thirty portions.
const SLOW: u32 = 4;

/// A message of which nothing is heard is repeated every eight hops' time: a run of lost frames is over the sooner.
const LOG_MOST: u32 = 2;

/// Within this many hops' time a neighbour that has got a message again says so.
const SOON: u32 = 4;

/// For so many messages it is remembered that a frame was lost.
const MEMORY: u8 = 8;

/// What is known of the current message's getting through.
#[derive(Clone, Debug)]
pub(crate) struct Retransmit {
    /// How often it has been sent again since anything was heard of it.
    unheard: u8,
    /// Whether the neighbour has said that it has arrived.
    arrived: bool,
    /// Whether frames get lost on its way, by what this relay or the one before has seen.
    lossy: bool,
    /// Of how many messages from now on that is to be expected.
    doubt: u8,
    /// How often what came of it is said again unasked.
    answers: u8,
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

/// What the time has come for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Again {
    /// Sending the message onward again.
    Onward,
    /// Saying again what came of it.
    Back,
}

impl Retransmit {
    pub(crate) const fn new(seed: u32) -> Self {
        Self {
            unheard: 0,
            arrived: false,
            lossy: false,
            doubt: 0,
            answers: 0,
            jitter: Jitter::new(seed),
            at: None,
        }
    }

    /// There is a new message.
    pub(crate) const fn begin(&mut self) {
        self.unheard = 0;
        self.arrived = false;
        self.lossy = self.doubt > 0;
        self.doubt = self.doubt.saturating_sub(1);
        self.stop();
    }

    /// A neighbour has said that the message has arrived. What is missing is the answer, and that may take its time.
    pub(crate) fn arrived(&mut self, now: Instant, trip: Trip) {
        self.unheard = 0;
        self.arrived = true;
        self.sent(now, trip);
    }

    /// The relay before has sent the message again: frames get lost on its way, and it may be lost to the next one, too.
    pub(crate) fn came_again(&mut self, now: Instant, hop_time: Duration) {
        self.lossy = true;
        let soon = now + self.jitter.spread(hop_time.times(SOON));
        if !self.arrived && self.at.is_some_and(|at| at > soon) {
            self.at = Some(soon);
        }
    }

    /// The message goes out at `now`.
    ///
    /// The answer may take as long as there and back over the hops that are left, and two to spare; [`SLOW`] times as long where relays
    /// compute on the way. The relay next to a lost frame runs out of patience first, so one loss costs one repetition. From then on it is
    /// known that frames get lost here: this message and the next ones are repeated sooner, first after four hops' time and then after
    /// eight, until a neighbour says that it has arrived. The neighbour learns by the repetition that frames get lost, and does the same:
    /// so a loss is waited for the whole way once, and not at every hop of a long chain. A random eighth keeps relays on a shared channel
    /// from repeating in step.
    pub(crate) fn sent(&mut self, now: Instant, trip: Trip) {
        let answer = (2 * u32::from(trip.hops) + 2) * if trip.slow { SLOW } else { 1 };
        let hops = match self.unheard {
            0 if self.lossy && !self.arrived => answer.min(SOON),
            0 => answer,
            again => answer.min(2 << u32::from(again).min(LOG_MOST)),
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
        self.answered(now, trip);
    }

    fn say_again(&mut self, now: Instant, hop_time: Duration) {
        self.at = (self.answers > 0).then(|| now + self.jitter.spread(hop_time.times(SOON)));
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
        Some(Again::Onward)
    }

    pub(crate) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }
}

#[cfg(test)]
mod tests {
    use super::{Again, MEMORY, Retransmit, SOON, Trip};
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
