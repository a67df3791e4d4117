//! How a chain forms anew, frame by frame: hellos, a proposal through three relays, the count back, and what is refused.

use host_tests::fixtures::{NETWORK, paper};
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::Header;
use uav_relay::{
    Duration, Event, Identity, Instant, Mission, Phase, Port, Relay, Settings, Wiring,
};

use super::codec::{Forming, Said, plain, wire};
use super::receive::{counted, relay};
use super::sequence::{FIRST, framed, one_of_each, sent};

pub(crate) const ASKS: u8 = 1;
pub(crate) const FORMS: u8 = 2;
pub(crate) const FRESH: u8 = 4;
pub(crate) const READY: u8 = 8;
pub(crate) const FLIES: u8 = 16;

/// What node `sender` says to node `destination`, on network 7.
pub(crate) fn between(sender: u16, destination: u16, said: &Said) -> Vec<u8> {
    let header = Header {
        network: NETWORK,
        sender,
        destination,
        counter: 0,
    };
    wire(&plain(header, &said.body()))
}

/// What a proposal or a count says of a view that is to fly the mission that was loaded before flight.
pub(crate) fn forming(number: u16, mission: u16, numbers: [u16; 3], flags: u8) -> Forming {
    let [place, relays, before] = numbers;
    Forming {
        number,
        mission,
        numbers: [place, relays, before, 0],
        flags,
    }
}

/// The hello of a node that flies the mission that was loaded before flight, and has no other.
pub(crate) fn a_hello(newest: u16, mission: u16, neighbour: u16, flags: u8) -> Said {
    Said::Hello(Forming {
        number: newest,
        mission,
        numbers: [neighbour, 0, mission, 0],
        flags: flags | FLIES,
    })
}

/// What `relay` sends at `now` or a millisecond later.
pub(crate) fn soon(relay: &mut Relay, now: Instant) -> Vec<(Port, Said)> {
    let mut out = sent(relay, now);
    let later = now + Duration::from_millis(1);
    relay.handle_timeout(later);
    out.extend(sent(relay, later));
    out
}

pub(crate) fn events(relay: &mut Relay) -> Vec<Event> {
    std::iter::from_fn(|| relay.poll_event()).collect()
}

/// The one message that `relay` sends at `now`.
pub(crate) fn only(relay: &mut Relay, now: Instant) -> (Port, Said) {
    let mut out = sent(relay, now);
    let said = out.pop().unwrap();
    assert!(out.is_empty(), "{out:?}");
    said
}

#[test]
fn a_proposal_goes_through_three_relays_and_the_count_back() {
    let mut chain: Vec<Relay> = (1..=3).map(|own| relay(own, 3, Wiring::Pair)).collect();
    let [head, middle, tail] = &mut chain[..] else {
        panic!("three relays");
    };
    let mission = digest(head.mission());
    let now = Instant::ZERO;
    // Somebody wants a view: the head, whom nobody is before, calls for the first one.
    let hello = a_hello(0, mission, 1, FORMS | READY);
    head.handle_bytes(now, Port::Downstream, &framed(1, Port::Downstream, &hello));
    let proposal = |place| Said::Proposal(forming(1, mission, [place, 3, 0], 1));
    let count = |place| Said::Decision(forming(1, mission, [place, 3, 0], 0));
    assert_eq!(soon(head, now), [(Port::Downstream, proposal(1))]);
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(only(middle, now), (Port::Downstream, proposal(2)));
    assert_eq!(middle.view(), 0, "not before it is counted");
    // It comes again: what has become of it is not known yet.
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(
        only(middle, now),
        (Port::Upstream, Said::Busy { number: 1 })
    );
    tail.handle_bytes(now, Port::Upstream, &between(2, 3, &proposal(2)));
    assert_eq!(only(tail, now), (Port::Upstream, count(3)));
    middle.handle_bytes(now, Port::Downstream, &between(3, 2, &count(3)));
    assert_eq!(only(middle, now), (Port::Upstream, count(2)));
    // The answer was lost: it is given again.
    middle.handle_bytes(now, Port::Upstream, &between(1, 2, &proposal(1)));
    assert_eq!(only(middle, now), (Port::Upstream, count(2)));
    head.handle_bytes(now, Port::Downstream, &between(2, 1, &count(2)));
    for (relay, index) in [head, middle, tail].into_iter().zip(1..) {
        assert_eq!((relay.view(), relay.index()), (1, index));
        assert_eq!(relay.stats().views, 1);
        assert_eq!(events(relay), [Event::Reformed]);
        assert_eq!(relay.stats().rejected(), 0);
    }
}

#[test]
fn a_count_that_is_not_awaited_is_stale() {
    let now = Instant::ZERO;
    let mut waiting = relay(4, 8, Wiring::Pair);
    let mission = digest(waiting.mission());
    let proposal = Said::Proposal(forming(2, mission, [3, 8, 0], 1));
    waiting.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
    sent(&mut waiting, now);
    for (number, place, relays) in [
        (2, 4, 8),
        (2, 6, 8),
        (1, 5, 8),
        (3, 5, 8),
        // Fewer than have been counted so far.
        (2, 5, 4),
        (2, 5, 1),
    ] {
        let mut after = waiting.clone();
        let count = Said::Decision(forming(number, mission, [place, relays, 0], 0));
        after.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, &count));
        assert_eq!(counted(after.stats()), ["received", "stale"], "{count:?}");
        assert_eq!(after.view(), 0);
        assert_eq!(sent(&mut after, now), []);
    }
    let count = Said::Decision(forming(2, mission, [5, 5, 0], 0));
    waiting.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, &count));
    assert_eq!((waiting.view(), waiting.mission().relays()), (2, 5));
    // Once more.
    waiting.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, &count));
    assert_eq!(waiting.stats().stale, 1);
}

/// What relay 20 of 20, the last, makes of a proposal from this place, after a view of so many with its leader there or not.
fn counted_by_the_last(place: u16, relays: u16, leader: bool, quorum: bool) -> Option<u16> {
    let mission = Mission::try_new(paper(20)).unwrap();
    let identity = Identity {
        network: NETWORK,
        index: 20,
    };
    let settings = Settings {
        quorum,
        ..Settings::default()
    };
    let now = Instant::ZERO;
    let mut last = Relay::new(mission, identity, settings, 1, now).unwrap();
    let mission = digest(last.mission());
    // A view that is newer than the one that it knows itself.
    let proposal = Said::Proposal(forming(9, mission, [place, relays, 8], u8::from(leader)));
    last.handle_bytes(now, Port::Upstream, &framed(20, Port::Upstream, &proposal));
    let (port, Said::Decision(count)) = only(&mut last, now) else {
        panic!("no count");
    };
    let said = count.numbers[1];
    assert_eq!(port, Port::Upstream);
    assert_eq!(count, forming(9, mission, [place + 1, said, 0], 0));
    let granted = (said > 0).then_some(said);
    let event = if granted.is_some() {
        Event::Reformed
    } else {
        Event::NoQuorum
    };
    assert_eq!(events(&mut last), [event]);
    assert_eq!(last.view(), if granted.is_some() { 9 } else { 0 });
    granted
}

#[test]
fn more_than_half_is_a_chain_and_half_of_it_with_its_leader() {
    for relays in 1..=20 {
        for place in 1..=19 {
            let there = place + 1;
            for leader in [false, true] {
                let enough = 2 * there + u16::from(leader) > relays;
                let counted = counted_by_the_last(place, relays, leader, true);
                assert_eq!(counted, enough.then_some(there), "{there} of {relays}");
                let counted = counted_by_the_last(place, relays, leader, false);
                assert_eq!(counted, Some(there), "without a quorum");
            }
        }
    }
}

/// The middle of a part that is too small to go on: it holds, hands that back, and asks for nothing any more.
#[test]
fn a_part_that_is_cut_off_stops_calling() {
    let mut relay = relay(4, 8, Wiring::Pair);
    let mission = digest(relay.mission());
    let mut now = Instant::ZERO;
    // It calls: it has missed a beginning.
    let sweep = &one_of_each(FIRST + 1, mission)[0];
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, sweep));
    let calls = a_hello(0, mission, 3, ASKS | FORMS | FRESH);
    assert_eq!(soon(&mut relay, now), [(Port::Upstream, calls)]);
    now = now + Duration::from_millis(1);
    let proposal = Said::Proposal(forming(1, mission, [1, 8, 0], 0));
    relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
    sent(&mut relay, now);
    let too_few = |place| Said::Decision(forming(1, mission, [place, 0, 0], 0));
    relay.handle_bytes(
        now,
        Port::Downstream,
        &framed(4, Port::Downstream, &too_few(3)),
    );
    assert_eq!(only(&mut relay, now), (Port::Upstream, too_few(2)));
    assert_eq!(events(&mut relay), [Event::NoQuorum]);
    assert_eq!((relay.view(), relay.setpoint()), (0, None));
    for _ in 0..200 {
        now = relay.poll_timeout().unwrap();
        relay.handle_timeout(now);
        for (_, said) in sent(&mut relay, now) {
            assert!(matches!(said, Said::Heartbeat { .. }), "{said:?}");
        }
    }
    assert!(now > Instant::from_millis(60_000));
}

#[test]
fn a_leader_whose_part_is_cut_off_holds_until_it_is_asked_again() {
    let mut head = relay(1, 8, Wiring::Pair);
    let mission = digest(head.mission());
    let now = Instant::ZERO;
    let hello = |newest| a_hello(newest, mission, 1, FORMS | READY);
    head.handle_bytes(
        now,
        Port::Downstream,
        &framed(1, Port::Downstream, &hello(0)),
    );
    soon(&mut head, now);
    let too_few = Said::Decision(forming(1, mission, [2, 0, 0], 0));
    head.handle_bytes(
        now,
        Port::Downstream,
        &framed(1, Port::Downstream, &too_few),
    );
    assert_eq!(head.phase(), Phase::NoQuorum);
    head.restart(now);
    assert_eq!(
        (head.phase(), soon(&mut head, now)),
        (Phase::NoQuorum, vec![])
    );
    // Somebody else is found there.
    let now = now + Duration::from_millis(5);
    head.handle_bytes(
        now,
        Port::Downstream,
        &framed(1, Port::Downstream, &hello(1)),
    );
    let proposal = Said::Proposal(forming(2, mission, [1, 8, 0], 1));
    assert_eq!(soon(&mut head, now), [(Port::Downstream, proposal)]);
}

#[test]
fn a_hello_is_answered_by_a_hello_if_it_asks_for_one() {
    let now = Instant::ZERO;
    for (asks, newest) in [(false, 0), (true, 0), (true, 6)] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let mission = digest(relay.mission());
        let flags = if asks { ASKS } else { 0 };
        let hello = a_hello(newest, mission, 4, flags);
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &hello));
        let out = soon(&mut relay, now);
        let answer = a_hello(newest, mission, 3, FRESH);
        let expected = asks.then_some((Port::Upstream, answer));
        assert_eq!(out, expected.into_iter().collect::<Vec<_>>());
        assert_eq!(counted(relay.stats()), ["received"]);
    }
}

/// No chain has more relays than its mission, and no relay says what none would read.
#[test]
fn more_relays_than_the_mission_has_are_stale() {
    let now = Instant::ZERO;
    for place in [1, 7, 8, 9, 999, 1000] {
        let mut relay = relay(4, 8, Wiring::Pair);
        let mission = digest(relay.mission());
        let proposal = Said::Proposal(forming(1, mission, [place, 8, 0], 1));
        relay.handle_bytes(now, Port::Upstream, &framed(4, Port::Upstream, &proposal));
        if place > 7 {
            assert_eq!(counted(relay.stats()), ["received", "stale"], "{place}");
            assert_eq!(sent(&mut relay, now), []);
            continue;
        }
        assert_eq!(counted(relay.stats()), ["received"], "{place}");
        assert_eq!(sent(&mut relay, now).len(), 1);
        let count = Said::Decision(forming(1, mission, [place + 1, 9, 0], 0));
        relay.handle_bytes(now, Port::Downstream, &framed(4, Port::Downstream, &count));
        assert_eq!(counted(relay.stats()), ["received", "stale"], "{place}");
        assert_eq!(relay.mission().relays(), 8);
    }
}
