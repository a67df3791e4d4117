//! Intact messages in any order from either side, in a mission with an interferer and one with a field.

use serde_json::json;
use uav_relay::{Interference, MissionConfig, Port, Wiring};

use super::bench::Bench;
use super::kinds::*;
use super::message::WireMessage;
use super::votes::{ASKS, FRESH, loaded_hello, with_neighbours};

fn missions() -> [MissionConfig; 2] {
    [source(), mission(Interference::Field(FIELD))]
}

/// Asserts that the relay counts a message as stale and ignores it, so that nothing else changes.
fn is_stale(bench: &Bench, port: Port, message: &WireMessage) {
    let mut after = bench.clone();
    let before = bench.stats().stale;
    assert_eq!(after.receive(port, message), [], "{message:?}");
    assert_eq!(after.counted(), ["received", "stale"], "{message:?}");
    assert_eq!(after.stats().stale, before + 1);
    assert_eq!(after.phase(), bench.phase());
}

#[test]
fn a_message_from_the_wrong_side_is_only_misdirected() {
    for config in missions() {
        for with_place in [false, true] {
            let (mut bench, from, to) = relay_4(config);
            if with_place {
                place(&mut bench, (from, to), FIRST);
            }
            for message in one_of_each(SECOND, bench.mission) {
                let wrong = match message.tag() {
                    0 | 4..=6 | 8 | 11 | 15 | 17 => to,
                    1 | 2 | 7 | 9 | 12 | 16 | 18 => from,
                    _ => continue,
                };
                let mut after = bench.clone();
                assert_eq!(after.receive(wrong, &message), []);
                let (before, stats) = (bench.stats(), after.stats());
                assert_eq!(stats.misdirected, before.misdirected + 1, "{message:?}");
                assert_eq!(stats.received, before.received + 1);
                assert_eq!(stats.rejected(), before.rejected() + 1);
                assert_eq!(after.setpoint(), bench.setpoint());
                assert_eq!(after.phase(), bench.phase());
            }
        }
    }
}

#[test]
fn a_message_of_another_mission_leads_to_a_hello_at_most() {
    for config in missions() {
        let (bench, from, to) = relay_4(config);
        let hello = |port| {
            let neighbour = if port == Port::Upstream { 3 } else { 5 };
            // The relay is fresh, so it is alone.
            with_neighbours(
                1,
                1,
                &loaded_hello(0, bench.mission, neighbour, ASKS | FRESH),
            )
        };
        let others = one_of_each(FIRST, bench.mission ^ 0x4000).into_iter();
        for message in
            others.filter(|message| !["Busy", "Level", "Claim"].contains(&message.name()))
        {
            for port in [from, to] {
                let mut after = bench.clone();
                let out = after.receive(port, &message);
                // Hellos and heartbeats reveal another mission; a pass may only be of another view.
                let of_a_mission = ["Heartbeat", "Hello", "Fence", "Offer", "Watch", "Report"]
                    .contains(&message.name());
                let (expected, greeted) = if of_a_mission {
                    (["mission", "received"], None)
                } else {
                    (["received", "view"], Some((port, hello(port))))
                };
                assert_eq!(after.counted(), expected, "{message:?}");
                assert_eq!(out, Vec::from_iter(greeted), "{message:?}");
                assert_eq!(after.phase(), bench.phase());
            }
        }
    }
}

#[test]
fn a_sweep_goes_from_the_leader_and_its_verdict_back() {
    for config in missions() {
        for kind in [0, 4] {
            let (mut bench, from, to) = relay_4(config);
            let kinds = one_of_each(FIRST, bench.mission);
            let out = bench.receive(from, &kinds[kind]);
            assert_eq!((out.len(), out[0].0), (1, to), "{out:?}");
            let sweep = &out[0].1;
            assert!(sweep.is("Sweep") && sweep.number("number") == f64::from(FIRST));
            let reach = sweep.list("reach_m")[0];
            assert_eq!(reach > 400.0, to == Port::Downstream, "a step onward");
            assert_eq!(
                bench.receive(from, &kinds[kind]),
                [(from, kinds[2].clone())],
                "busy"
            );
            assert_eq!(bench.receive(to, &kinds[1]), [(from, kinds[1].clone())]);
            assert_eq!(bench.setpoint().unwrap().x_m, reach);
            assert_eq!(bench.counted(), ["received", "repeated"]);
        }
    }
}

#[test]
fn a_token_is_forwarded_and_its_result_returned() {
    let (mut bench, from, to) = relay_4(source());
    place(&mut bench, (from, to), FIRST);
    let kinds = one_of_each(SECOND, bench.mission);
    let mut out = bench.receive(from, &kinds[8]);
    out.extend(bench.advance_1_s());
    let second = f64::from(SECOND);
    assert!(out[0].0 == to && out[0].1.is("Token"), "{out:?}");
    assert_eq!(out[0].1.number("number"), second);
    // A result beyond Rx does not fit.
    let beyond = kinds[9].with(json!({ "x_m": 1000.0_f32.next_up() }));
    is_stale(&bench, to, &beyond);
    let out = bench.receive(to, &kinds[9]);
    assert_eq!((out.len(), out[0].0), (1, from), "{out:?}");
    let moved = &out[0].1;
    assert!(moved.is("Moved") && moved.number("worst_sir") <= 1.0);
    assert_eq!(
        (moved.number("number"), moved.number("position_changed")),
        (second, 1.0)
    );
    assert_eq!(bench.counted(), ["received"]);
}

/// Checks that messages that the relay does not await are stale.
///
/// The relay does not await answers to other messages, messages of another kind, or messages of a round that is over. A
/// token (message of Algorithm 2) is stale if the relay has no position, if the interference is a field, or if the
/// token's position is beyond Rx.
#[test]
fn unexpected_or_unfit_messages_are_stale() {
    for config in missions() {
        for with_sweep in [false, true] {
            let (mut bench, from, to) = relay_4(config);
            let mission = bench.mission;
            if with_sweep {
                bench.receive(from, &one_of_each(FIRST, mission)[0]);
            }
            is_stale(&bench, from, &one_of_each(SECOND, mission)[8]);
            is_stale(&bench, to, &one_of_each(SECOND, mission)[1]);
            let number = if with_sweep { FIRST } else { SECOND };
            is_stale(&bench, to, &one_of_each(number, mission)[9]);
            for kind in [0, 4, 8].into_iter().filter(|_| with_sweep) {
                is_stale(&bench, from, &one_of_each(FIRST - 1, mission)[kind]);
            }
        }
        let (mut bench, from, to) = relay_4(config);
        place(&mut bench, (from, to), FIRST);
        let token = &one_of_each(SECOND, bench.mission)[8];
        let beyond = token.with(json!({ "x_m": 1000.0_f32.next_up() }));
        is_stale(&bench, from, &beyond);
        if matches!(config.interference, Interference::Field(_)) {
            is_stale(&bench, from, token);
            bench.receive(from, token);
            assert_eq!(bench.advance_1_s(), [], "the pass in progress goes on");
        }
    }
}

/// Checks that a sweep message drops the target SIRs that would put its sender beyond Rx.
///
/// In a field of interference, the message lists the position that its sender needs for each target SIR. Here no target
/// remains, so that the relay forwards an empty list.
#[test]
fn a_reach_beyond_rx_leaves_no_feasible_target() {
    let (mut bench, from, to) = relay_4(mission(Interference::Field(FIELD)));
    let beyond = json!({ "reach_m": [1000.0_f32.next_up()] });
    let sweep = one_of_each(FIRST, bench.mission)[0].with(beyond);
    let out = bench.receive(from, &sweep);
    assert_eq!((out.len(), out[0].0), (1, to), "{out:?}");
    assert!(out[0].1.is("Sweep") && out[0].1.list("reach_m").is_empty());
}

/// Checks that the smallest target SIRs are met in a field of interference. This must hold although intermediate values
/// exceed the range of f32.
#[test]
fn the_smallest_targets_are_met_in_a_field() {
    for (field, anchor) in [
        (FIELD, 1e-9),
        (FIELD, f32::MIN_POSITIVE),
        (WEAK, f32::MIN_POSITIVE),
    ] {
        for own in [4, 1] {
            let mut bench = Bench::of(mission(Interference::Field(field)), own, Wiring::Pair);
            let sweep = one_of_each(FIRST, bench.mission)[0].with(json!({ "anchor": anchor }));
            let out = bench.receive(Port::Downstream, &sweep);
            assert_eq!(out.len(), 1, "{out:?}");
            let (port, message) = &out[0];
            if own == 4 {
                assert!(*port == Port::Upstream && message.is("Sweep"), "{out:?}");
                let reach = message.list("reach_m")[0];
                // As far as this relay knows, the three before it may be above each other, without distance along x.
                assert!((1e-4..1e-2).contains(&reach), "{reach}");
            } else {
                assert!(
                    *port == Port::Downstream && message.is("Verdict"),
                    "{out:?}"
                );
                assert_eq!(message.number("commit"), 0.0);
                let slack = message.list("slack_m")[0];
                assert!((1e5..=1e9).contains(&slack), "{slack}");
                assert_eq!(bench.setpoint().unwrap().x_m, 0.0);
            }
        }
    }
}
