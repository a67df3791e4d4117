//! Numbers of passes: new, late, or from before the leader's reboot. Equal numbers are compared by content.

use uav_relay::wire::message::{Message, Sweep};
use uav_relay::{Duration, Instant, Phase, Port, Relay};

use crate::{drain, encode, first_sweep, message, mission, relay};

fn sweep_in(bytes: &[u8]) -> Sweep {
    match message(bytes) {
        Message::Sweep(sweep) => sweep,
        other => panic!("no sweep: {other:?}"),
    }
}

/// Returns the last relay after it received a sweep message and a copy with another message number.
///
/// `off` is added to the number of the copy.
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

/// Returns true if the relay requests a new membership view, at once or a millisecond later.
fn requests_view(relay: &mut Relay, now: Instant) -> bool {
    let mut said = drain(relay, now);
    let later = now + Duration::from_millis(1);
    relay.handle_timeout(later);
    said.extend(drain(relay, later));
    said.iter().any(|(port, message, _)| {
        *port == Port::Upstream
            && matches!(message, Message::Hello(hello) if hello.requests_view && hello.requests_reply)
    })
}

#[test]
fn only_the_next_pass_number_is_new() {
    let (now, sweep) = first_sweep(&mut relay(mission(2), 1));
    let number = sweep_in(&sweep).number;
    assert!(number.is_multiple_of(64), "{number}");
    let mut found = [0; 3];
    for off in 1..=u16::MAX {
        let mut tail = after_two(&sweep, now, off);
        let stale = tail.stats().stale;
        match off {
            1 => {
                let said = drain(&mut tail, now);
                assert!(
                    matches!(&said[..], [(_, Message::Verdict(answer), _)]
                        if answer.number == number.wrapping_add(off)),
                    "{off}"
                );
                assert_eq!(stale, 0, "{off}");
                found[0] += 1;
            }
            // Numbers 1 to 32 below the last one: late passes.
            0xFFE0.. => {
                assert!(!requests_view(&mut tail, now), "{off}");
                assert_eq!(stale, 1, "{off}");
                found[1] += 1;
            }
            _ => {
                assert!(requests_view(&mut tail, now), "{off}");
                assert_eq!(stale, 1, "{off}");
                found[2] += 1;
            }
        }
        assert_eq!(tail.phase(), Phase::Holding, "{off}");
    }
    assert_eq!(found, [1, 32, 65_502]);
}

#[test]
fn the_first_pass_after_a_reboot_is_never_the_next_one() {
    let (now, sweep) = first_sweep(&mut relay(mission(2), 1));
    // There are `last` passes after the first. A rebooted leader may begin 64 above the old first number.
    for last in [32, 62, 63] {
        let mut tail = after_two(&sweep, now, 0);
        (1..=last).for_each(|off| again(&mut tail, &sweep, now, off));
        drain(&mut tail, now);
        assert_eq!(tail.stats().stale, 0, "{last}");
        again(&mut tail, &sweep, now, 64);
        assert_eq!(tail.stats().stale, 1, "{last}");
        assert!(requests_view(&mut tail, now), "{last}");
        // A leader that did not reboot skips that number.
        again(&mut tail, &sweep, now, 65);
        let expected = if last == 63 { 1 } else { 2 };
        assert_eq!(tail.stats().stale, expected, "{last}");
    }
}

/// Checks that a rebooted relay takes no part in a later pass, a round of messages along the chain.
///
/// After its reboot, the relay has received a delayed copy of the first pass, which must not suffice to take part.
#[test]
fn a_delayed_first_pass_admits_no_relay_to_a_later_one() {
    let (now, sweep) = first_sweep(&mut relay(mission(3), 1));
    let mut rebooted = relay(mission(3), 2);
    again(&mut rebooted, &sweep, now, 0);
    drain(&mut rebooted, now);
    again(&mut rebooted, &sweep, now, 5);
    assert_eq!(rebooted.stats().stale, 1);
    assert!(requests_view(&mut rebooted, now));
    assert_eq!(rebooted.setpoint(), None);
}

/// Checks that a sweep message with the same number but other content counts as another message.
///
/// A relay closer to the leader sends such a message if it has rebooted.
#[test]
fn the_same_number_with_other_content_is_another_pass() {
    let changes: [fn(&mut Sweep); 4] = [
        |_| {},
        |sweep| sweep.reaches[0] += 1.0,
        |sweep| sweep.relay.power_w *= 2.0,
        |sweep| sweep.measured_per_w = Some(2.0),
    ];
    for (which, change) in changes.into_iter().enumerate() {
        let (now, bytes) = first_sweep(&mut relay(mission(2), 1));
        let mut tail = after_two(&bytes, now, 0);
        let before = *tail.stats();
        let setpoint = tail.setpoint();
        let mut sweep = sweep_in(&bytes);
        change(&mut sweep);
        tail.handle_bytes(now, Port::Upstream, &encode(1, 2, &Message::Sweep(sweep)));
        // The measured value may have changed since the sweep was first sent: it is still the same pass.
        let other = which == 1 || which == 2;
        assert_eq!(tail.stats().stale - before.stale, u32::from(other));
        assert_eq!(tail.stats().repeated - before.repeated, u32::from(!other));
        assert_eq!(requests_view(&mut tail, now), other, "{which}");
        assert_eq!(tail.setpoint(), setpoint);
    }
}

#[test]
fn the_fourth_late_pass_in_a_row_requests_a_view() {
    let (mut now, sweep) = first_sweep(&mut relay(mission(2), 1));
    let mut tail = after_two(&sweep, now, 1);
    for round in 0..3 {
        for _ in 0..3 {
            again(&mut tail, &sweep, now, 0);
            assert!(!requests_view(&mut tail, now), "{round}");
            now = now + Duration::from_millis(1);
        }
        // The next pass follows, so the three late passes were only delayed frames.
        again(&mut tail, &sweep, now, 2 + round);
        drain(&mut tail, now);
    }
    for _ in 0..3 {
        again(&mut tail, &sweep, now, 0);
        assert!(!requests_view(&mut tail, now));
        now = now + Duration::from_millis(1);
    }
    again(&mut tail, &sweep, now, 0);
    assert!(requests_view(&mut tail, now));
    assert_eq!(tail.stats().stale, 13);
}

#[test]
fn a_relay_that_missed_the_first_pass_requests_a_view() {
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
        assert_eq!(requests_view(&mut tail, now), !first, "{off}");
    }
}
