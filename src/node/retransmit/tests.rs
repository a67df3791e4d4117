//! When a message is sent again, and what that shows of the link.

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
    assert_eq!(one.arrived(now, WAY), Took::Exactly(HOP));
    // The next one may answer either.
    assert_eq!(one.arrived(now, WAY), Took::AtLeast(HOP));
    let (mut one, now) = after(2);
    assert_eq!(one.arrived(now, WAY), Took::AtLeast(HOP));
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
