//! Replayed handshakes: at most they delay a first contact until the genuine handshake arrives.

use host_tests::bench;
use rand::seq::IndexedRandom;
use uav_relay::{Event, Instant, Port, Side, Wiring};

use super::frames::plain;
use super::kinds::{Attacker, raised};
use super::net::{Net, RecordedFrame, ScheduledEvent, relay};

fn is_handshake(heard: &RecordedFrame) -> bool {
    plain(&heard.wire).is_handshake()
}

/// Checks that replayed handshakes change no position, even while relays authenticate each other again.
#[test]
fn replayed_handshakes_change_no_position() {
    let mut events = vec![(6_000, ScheduledEvent::Reboot(4))];
    for second in 7..30 {
        let index = 1 + second * 5 % 8;
        events.push((
            1_000 * second,
            ScheduledEvent::Reboot(u16::try_from(index).unwrap()),
        ));
    }
    events.push((31_000, ScheduledEvent::Restart));
    let end = Instant::from_millis(40_000);
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut calm = Net::new(8, wiring, &events);
        calm.run(end);
        let mut net = Net::new(8, wiring, &events);
        let mut attacker = Attacker::new(2);
        let (mut answered, mut taken, mut refused) = (0, 0, 0);
        while net.step(end) {
            for _ in 0..20 {
                let heard = net.recorded.choose(&mut attacker.rng).unwrap().clone();
                if !is_handshake(&heard) || !net.has_arrived(&heard) {
                    continue;
                }
                let RecordedFrame { from, to, wire, .. } = heard;
                let before = net.stats(to);
                let sent = net.deliver_bytes(to, net.port(from, to), &wire);
                match raised(&before, &net.stats(to)) {
                    Some("replayed") => {
                        assert_eq!(sent, 0);
                        refused += 1;
                    }
                    Some("handshakes") => {
                        // An accepted handshake is answered at most once.
                        assert!(sent <= 1);
                        answered += sent;
                        taken += 1;
                    }
                    other => panic!("{other:?}"),
                }
            }
        }
        println!("{taken} taken for new, {answered} answered, {refused} refused");
        assert!(taken > 0 && answered > 0 && refused > 1_000);
        assert_eq!(net.bits(), calm.bits());
        assert!(net.bits().iter().all(Option::is_some));
        for index in 1..=8 {
            assert_eq!(
                net.stats(index).received,
                net.genuine[usize::from(index) - 1]
            );
        }
    }
}

/// Checks that a rebooted relay accepts each replayed handshake at most once.
///
/// After that it accepts a genuine handshake.
#[test]
fn replayed_handshakes_are_answered_once_and_superseded() {
    let mut net = Net::new(2, Wiring::Pair, &[]);
    for start in 2..=9 {
        net.run(Instant::from_millis(u64::from(start) * 1_000));
        net.reboot(1, start);
    }
    net.run(Instant::from_millis(10_000));
    let recorded: Vec<Vec<u8>> = net
        .recorded
        .iter()
        .filter(|heard| heard.to == 2 && is_handshake(heard))
        .map(|heard| heard.wire.clone())
        .collect();
    net.reboot(2, 2);
    let (mut answers, mut taken) = (0, 0);
    for round in 0..100 {
        for wire in &recorded {
            let before = net.stats(2);
            let sent = net.deliver_bytes(2, Port::Upstream, wire);
            let new = raised(&before, &net.stats(2)) == Some("handshakes");
            assert!(!new || round == 0, "taken twice");
            assert!(sent <= usize::from(new));
            taken += usize::from(new);
            answers += sent;
        }
    }
    println!(
        "{} recorded, {taken} taken, {answers} answers to {}",
        recorded.len(),
        100 * recorded.len()
    );
    assert!((9..=recorded.len()).contains(&taken));
    assert_eq!(net.stats(2).received, 0);
    // The result is the same as without the flood: the chain agrees, and relay 2 holds its position.
    net.relay(1).restart(Instant::from_millis(10_000));
    net.run(Instant::from_millis(12_000));
    assert!(net.bits().iter().all(Option::is_some));
    assert!(net.stats(2).received > 0);
}

/// Checks that a relay authenticates its neighbour even after it was deceived by a replayed handshake. The relay has answered the replay,
/// and the answer is lost.
#[test]
fn a_relay_recovers_from_a_replayed_handshake() {
    let mut net = Net::new(2, Wiring::Pair, &[]);
    net.run(Instant::from_millis(1_000));
    let old = net
        .recorded
        .iter()
        .find(|heard| heard.to == 2 && is_handshake(heard))
        .unwrap()
        .wire
        .clone();
    net.reboot(1, 2);
    net.run(Instant::from_millis(2_000));
    let start = Instant::from_millis(2_000);
    let mut fresh = relay(2, 2, Wiring::Pair, (2, start));
    fresh.handle_bytes(start, Port::Upstream, &old);
    bench::sent(&mut fresh, start);
    *net.relay(2) = fresh;
    net.genuine[1] = 0;
    net.starts[1] = 2;
    // The relays are silent until the first heartbeat request. It leads to handshakes; the next request is answered.
    net.run(Instant::from_millis(14_000));
    assert!(net.is_proven(1, 2) && net.is_proven(2, 1));
    assert_eq!(net.stats(2).received, net.genuine[1]);
}

/// Checks that replayed handshakes do not keep a silent neighbour from being declared lost.
#[test]
fn a_silent_neighbour_is_lost_despite_replays() {
    let mut net = Net::new(2, Wiring::Pair, &[]);
    for start in 2..=60 {
        net.run(Instant::from_millis(u64::from(start) * 1_000));
        net.reboot(2, start);
    }
    let mut recorded = net
        .recorded
        .iter()
        .filter(|heard| heard.to == 1 && is_handshake(heard))
        .map(|heard| heard.wire.clone());
    let (control, _) = lost_after(&mut std::iter::empty());
    let (lost_after, handshakes) = lost_after(&mut recorded);
    assert!(handshakes > 40, "{handshakes}");
    assert_eq!(lost_after, control, "as if nothing were played back");
    assert!((15_000..15_100).contains(&lost_after), "{lost_after}");
}

/// Returns the time, ms, until relay 1 reports its silent neighbour as lost in spite of replays.
///
/// An attacker replays the handshakes of `recorded` to relay 1. The second value returned is the number of handshakes
/// that relay 1 accepts.
fn lost_after(recorded: &mut dyn Iterator<Item = Vec<u8>>) -> (u64, u32) {
    let mut lonely = relay(2, 1, Wiring::Pair, (2, Instant::ZERO));
    let mut lost_after = None;
    for ms in 0..20_000 {
        let now = Instant::from_millis(ms);
        if ms % 300 == 0
            && let Some(wire) = recorded.next()
        {
            lonely.handle_bytes(now, Port::Downstream, &wire);
        }
        lonely.handle_timeout(now);
        bench::sent(&mut lonely, now);
        for event in bench::events(&mut lonely) {
            if let Event::NeighbourLost { side, .. } = event {
                assert_eq!(side, Side::Downstream);
                lost_after.get_or_insert(ms);
            }
            assert!(!matches!(event, Event::NeighbourBack { .. }));
        }
    }
    (lost_after.unwrap(), lonely.stats().handshakes)
}
