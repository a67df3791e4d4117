//! Facade over serial ports that hold few bytes, fail, or are never read.

mod chain;
mod driver_enable;
mod pipe;
mod uart;

use chain::{BYTE_TIME, Kind, Node, chain, has_lost, run, setpoints};
use host_tests::bench::agreed;
use host_tests::fixtures::{self, wired};
use pipe::{End, ReadErrors};
use uav_relay::serial::{READ_LIMIT, SerialStats};
use uav_relay::{Instant, Mission, Placement, Side, Wiring};

/// Returns the positions on which relays agree if their frames do not pass through serial ports.
fn bare(relays: u16) -> Vec<Option<Placement>> {
    agreed(Mission::try_new(fixtures::paper(relays)).unwrap())
}

const KINDS: [Kind; 2] = [Kind::Nb, Kind::Io];

#[test]
fn a_chain_on_ports_of_any_size_settles_like_bare_relays() {
    let expected = bare(3);
    assert!(expected.iter().all(Option::is_some));
    for kind in KINDS {
        for wiring in [Wiring::Pair, Wiring::Shared] {
            for capacity in [1, 3, 16, 1000] {
                let (mut nodes, _far) = chain(kind, wiring, 3, capacity, &ReadErrors::default());
                run(&mut nodes, Instant::ZERO, Instant::from_millis(2_000));
                let name = format!("{kind:?} {wiring:?} {capacity}");
                assert_eq!(setpoints(&nodes), expected, "{name}");
                for node in &nodes {
                    assert_eq!(node.relay.stats().rejected(), 0, "{name}");
                    for stats in node.driver.stats() {
                        assert_eq!(stats, SerialStats::default(), "{name}");
                    }
                }
            }
        }
    }
}

#[test]
fn an_unread_link_does_not_starve_the_other_link() {
    for kind in KINDS {
        // Relay 2 of 3; its wire toward relay 1 is never read, relay 3 works.
        let [nobody, deaf] = End::wire(3);
        let [up, down] = End::wire(16);
        let [last, _rx] = End::wire(16);
        let none = ReadErrors::default();
        let mut nodes = vec![
            Node::new(kind, wired(3, 2, Wiring::Pair), &[deaf, up], &none),
            Node::new(kind, wired(3, 3, Wiring::Pair), &[down, last], &none),
        ];
        let now = run(&mut nodes, Instant::ZERO, Instant::from_millis(300_000));
        assert_eq!(nobody.waiting(), 3, "{kind:?}: the wire is full");
        assert!(has_lost(&nodes[0], Side::Upstream), "{kind:?}");
        assert!(!has_lost(&nodes[0], Side::Downstream), "{kind:?}");
        assert!(!has_lost(&nodes[1], Side::Upstream), "{kind:?}");
        let stats = nodes[0].driver.stats();
        assert!(
            stats[0].dropped > 0,
            "{kind:?}: what cannot be sent is counted"
        );
        assert_eq!(stats[1], SerialStats::default(), "{kind:?}");
        // Attempts at the blocked end are 128 byte times apart, plus a few polls for the other end.
        assert!(
            nodes[0].polls < 35_000,
            "{kind:?}: {} polls",
            nodes[0].polls
        );
        // Frames are sent, dropped, in the wire or in the link, but none is lost.
        let sent = nodes[0].relay.stats().sent;
        assert!(sent > stats[0].dropped + 2, "{kind:?}: {sent}");

        // Once the end is read, whole frames arrive, the next one included.
        let mut heard = Vec::new();
        let mut now = now;
        for _ in 0..400 {
            heard.extend(std::iter::from_fn(|| nobody.get()));
            now = run(&mut nodes, now, now + BYTE_TIME);
        }
        let frames: Vec<&[u8]> = heard.split_inclusive(|&byte| byte == 0).collect();
        assert!(frames.len() >= 2, "{kind:?}: {heard:?}");
        assert!(
            frames
                .iter()
                .all(|frame| [23, 26, 35].contains(&frame.len())),
            "{kind:?}: claims, heartbeats, and hellos that call for a view"
        );
        let before = nodes[0].driver.stats()[0].dropped;
        for _ in 0..3_000 {
            while nobody.get().is_some() {}
            now = run(&mut nodes, now, now + BYTE_TIME.times(100));
        }
        assert_eq!(
            nodes[0].driver.stats()[0].dropped,
            before,
            "{kind:?}: no more"
        );
    }
}

#[test]
fn on_a_shared_channel_frames_wait_and_none_is_dropped() {
    for kind in KINDS {
        let mut ends = End::channel(2, 3);
        let (nobody, end) = (ends.remove(0), ends.remove(0));
        let relay = wired(2, 1, Wiring::Shared);
        let mut nodes = [Node::new(kind, relay, &[end], &ReadErrors::default())];
        let now = run(&mut nodes, Instant::ZERO, Instant::from_millis(60_000));
        assert_eq!(nobody.waiting(), 3);
        assert_eq!(nodes[0].driver.stats()[0], SerialStats::default());
        // At most two frames are in the link, and a retransmission waits for room.
        assert!(nodes[0].relay.stats().sent <= 3, "{kind:?}");

        let mut now = now;
        let before = nodes[0].relay.stats().sent;
        for _ in 0..2_000 {
            while nobody.get().is_some() {}
            now = run(&mut nodes, now, now + BYTE_TIME);
        }
        assert!(nodes[0].relay.stats().sent > before, "{kind:?}: it goes on");
    }
}

#[test]
fn read_errors_are_counted_by_kind_and_survived() {
    let expected = bare(3);
    for kind in KINDS {
        for wiring in [Wiring::Pair, Wiring::Shared] {
            let (mut nodes, _far) = chain(kind, wiring, 3, 16, &ReadErrors::times(10, 40));
            run(&mut nodes, Instant::ZERO, Instant::from_millis(30_000));
            assert_eq!(setpoints(&nodes), expected, "{kind:?} {wiring:?}");
            // The second relay receives both neighbours.
            let stats = nodes[1].driver.stats()[0];
            let counted = [stats.overrun, stats.framing, stats.parity, stats.noise];
            match kind {
                Kind::Nb => assert!(counted.iter().all(|&count| count >= 1), "{stats:?}"),
                // These ports do not tell the kind of error, and may return earlier bytes instead.
                Kind::Io => assert!(counted == [0; 4] && stats.other >= 1, "{stats:?}"),
            }
            let rejected: u32 = nodes.iter().map(|node| node.relay.stats().rejected()).sum();
            assert!(rejected > 0, "{kind:?} {wiring:?}: frames were hurt");
        }
    }
}

#[test]
fn a_failing_port_does_not_starve_the_others() {
    let dead = ReadErrors::times(usize::MAX, 1);
    let [up, _] = End::wire(16);
    let [down, _] = End::wire(16);
    up.add_received(&[1; 10_000]);
    let mut node = Node::new(Kind::Nb, wired(2, 1, Wiring::Pair), &[up, down], &dead);
    let now = Instant::from_millis(1);
    let wake = node.driver.poll(now, &mut node.relay);
    let stats = node.driver.stats()[0];
    let counted = stats.overrun + stats.framing + stats.parity + stats.noise + stats.other;
    assert_eq!(usize::try_from(counted).unwrap(), READ_LIMIT);
    assert_eq!(wake, Some(now + BYTE_TIME));
}

#[test]
fn a_poll_reads_up_to_its_limit_and_asks_to_be_called_soon() {
    for kind in KINDS {
        let [up, _] = End::wire(16);
        let [down, _] = End::wire(16);
        up.add_received(&[7; 3 * READ_LIMIT]);
        let ends = [up.clone(), down];
        let mut node = Node::new(
            kind,
            wired(2, 1, Wiring::Pair),
            &ends,
            &ReadErrors::default(),
        );
        let mut now = Instant::ZERO;
        for left in [2 * READ_LIMIT, READ_LIMIT, 0] {
            let wake = node.driver.poll(now, &mut node.relay);
            assert_eq!(up.waiting(), left, "{kind:?}");
            let soon = node
                .relay
                .poll_timeout()
                .map(|due| due.min(now + BYTE_TIME));
            assert_eq!(wake, soon, "{kind:?}");
            now = now + BYTE_TIME;
        }
        // With idle ports only the relay's own timer is left.
        let wake = node.driver.poll(now, &mut node.relay);
        assert_eq!(wake, node.relay.poll_timeout(), "{kind:?}");
    }
}

#[test]
fn an_idle_facade_has_only_the_relays_timeouts() {
    for kind in KINDS {
        // A single settled relay only renews its lease, without frames.
        let (mut nodes, far) = chain(kind, Wiring::Pair, 1, 16, &ReadErrors::default());
        let now = run(&mut nodes, Instant::ZERO, Instant::from_millis(1_000));
        assert!(nodes[0].relay.setpoint().is_some());
        let Node { driver, relay, .. } = &mut nodes[0];
        let wake = driver.poll(now, relay);
        assert_eq!(wake, relay.poll_timeout(), "{kind:?}");
        assert!(
            wake.is_none_or(|wake| wake > now + BYTE_TIME.times(1_000)),
            "{kind:?}"
        );
        assert!(far.iter().all(|end| end.carried() == 0));

        // A settled chain of three wakes up for heartbeats only: a few polls a second.
        let (mut nodes, _far) = chain(kind, Wiring::Pair, 3, 1000, &ReadErrors::default());
        let now = run(&mut nodes, Instant::ZERO, Instant::from_millis(1_000));
        for node in &mut nodes {
            let wake = node.driver.poll(now, &mut node.relay);
            assert_eq!(wake, node.relay.poll_timeout(), "{kind:?}");
            assert!(
                wake.is_some_and(|wake| wake > now + BYTE_TIME.times(1_000)),
                "{kind:?}"
            );
        }
    }
}

#[test]
fn frames_for_an_absent_port_are_counted() {
    let [end, far] = End::wire(1000);
    let relay = wired(2, 1, Wiring::Pair);
    let mut nodes = [Node::new(Kind::Nb, relay, &[end], &ReadErrors::default())];
    run(&mut nodes, Instant::ZERO, Instant::from_millis(1_000));
    let stats = nodes[0].driver.stats()[0];
    assert!(stats.unrouted > 0);
    assert_eq!(stats.unrouted, nodes[0].relay.stats().sent);
    assert_eq!(far.waiting(), 0);
}
