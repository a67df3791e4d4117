//! Which pass is new, over, or of another life of its leader: by its number alone.

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::wire::message::{Message, Sweep};
use uav_relay::{Duration, Instant, Phase, Port, Relay};

use crate::{drain, encode, first_sweep, mission, relay};

/// The sweep in these bytes.
fn sweep_in(bytes: &[u8]) -> Sweep {
    let mut deframer = Deframer::new();
    let plain = bytes.iter().find_map(|&byte| {
        let plain = deframer.push(byte)?.unwrap();
        Some(plain.to_vec())
    });
    match frame::decode(&plain.unwrap()).unwrap() {
        (_, Message::Sweep(sweep)) => sweep,
        other => panic!("no sweep: {other:?}"),
    }
}

/// A tail that has agreed to `sweep`, and then gets it again with its number moved by `off`.
fn after_two(sweep: &[u8], now: Instant, off: u16) -> Relay {
    let mut tail = relay(mission(2), 2);
    tail.handle_bytes(now, Port::Upstream, sweep);
    drain(&mut tail, now);
    again(&mut tail, sweep, now, off);
    tail
}

fn again(tail: &mut Relay, sweep: &[u8], now: Instant, off: u16) {
    let mut sweep = sweep_in(sweep);
    sweep.number = sweep.number.wrapping_add(off);
    tail.handle_bytes(now, Port::Upstream, &encode(1, 2, &Message::Sweep(sweep)));
}

/// Whether the relay says at once, or a millisecond later, that it wants a new view.
fn calls(relay: &mut Relay, now: Instant) -> bool {
    let mut said = drain(relay, now);
    let later = now + Duration::from_millis(1);
    relay.handle_timeout(later);
    said.extend(drain(relay, later));
    said.iter().any(|(port, message, _)| {
        *port == Port::Upstream && matches!(message, Message::Hail(hail) if hail.form && hail.ask)
    })
}

#[test]
fn the_next_numbers_are_new_those_before_are_over_and_all_others_are_of_another_life() {
    let (now, sweep) = first_sweep(&mut relay(mission(2), 1));
    let number = sweep_in(&sweep).number;
    assert!(number.is_multiple_of(64), "{number}");
    let mut found = [0; 3];
    for off in 1..=u16::MAX {
        let mut tail = after_two(&sweep, now, off);
        let stale = tail.stats().stale;
        match off {
            1..=32 => {
                let said = drain(&mut tail, now);
                assert!(
                    matches!(&said[..], [(_, Message::Verdict(answer), _)]
                        if answer.number == number.wrapping_add(off)),
                    "{off}"
                );
                assert_eq!(stale, 0, "{off}");
                found[0] += 1;
            }
            // 32 to 1 behind.
            0xFFE0.. => {
                assert!(!calls(&mut tail, now), "{off}");
                assert_eq!(stale, 1, "{off}");
                found[1] += 1;
            }
            _ => {
                assert!(calls(&mut tail, now), "{off}");
                assert_eq!(stale, 1, "{off}");
                found[2] += 1;
            }
        }
        assert_eq!(tail.phase(), Phase::Holding, "{off}");
    }
    assert_eq!(found, [32, 32, 65_471]);
}

#[test]
fn the_first_pass_of_another_life_is_never_taken_for_the_next_one() {
    let (now, sweep) = first_sweep(&mut relay(mission(2), 1));
    // The chain has gone on to 32, 62 and 63 after its first; the next first one is 64 after it.
    for steps in [vec![32], vec![32, 62], vec![32, 63]] {
        let mut tail = after_two(&sweep, now, 0);
        for &off in &steps {
            again(&mut tail, &sweep, now, off);
        }
        drain(&mut tail, now);
        assert_eq!(tail.stats().stale, 0, "{steps:?}");
        again(&mut tail, &sweep, now, 64);
        assert_eq!(tail.stats().stale, 1, "{steps:?}");
        assert!(calls(&mut tail, now), "{steps:?}");
        // The leader leaves that number out.
        again(&mut tail, &sweep, now, 65);
        let expected = if steps.len() > 1 { 1 } else { 2 };
        assert_eq!(tail.stats().stale, expected, "{steps:?}");
    }
}

#[test]
fn the_fourth_straggler_in_a_row_is_a_leader_that_insists() {
    let (now, sweep) = first_sweep(&mut relay(mission(2), 1));
    let mut tail = after_two(&sweep, now, 5);
    for round in 0..3 {
        for _ in 0..3 {
            again(&mut tail, &sweep, now, 0);
            assert!(!calls(&mut tail, now), "{round}");
        }
        // The chain goes on: those were late, all three of them.
        again(&mut tail, &sweep, now, 6 + round);
        drain(&mut tail, now);
    }
    for _ in 0..3 {
        again(&mut tail, &sweep, now, 0);
        assert!(!calls(&mut tail, now));
    }
    again(&mut tail, &sweep, now, 0);
    assert!(calls(&mut tail, now));
    assert_eq!(tail.stats().stale, 13);
}

#[test]
fn a_relay_that_missed_the_beginning_calls_for_another() {
    let (now, sweep) = first_sweep(&mut relay(mission(2), 1));
    for (off, first) in [
        (0, true),
        (1, false),
        (63, false),
        (64, true),
        (0xFFFF, false),
    ] {
        let mut tail = relay(mission(2), 2);
        again(&mut tail, &sweep, now, off);
        assert_eq!(tail.setpoint().is_some(), first, "{off}");
        assert_eq!(calls(&mut tail, now), !first, "{off}");
    }
}
