//! Intact messages in any order from either side, in a mission with an interferer and one with a field.

use uav_relay::wire::digest::digest;
use uav_relay::{Instant, Interference, Port, Wiring};

use super::codec::{Handed, Judged, Said, Shifted, Swept};
use super::kinds::{
    FIRST, SECOND, WEAK, framed, mission, one_of_each, placed, relay_4, sent, settle, source,
};
use super::receive::{FIELD, counted, drain, relay_of};
use super::votes::{ASKS, FRESH, a_hello, hearing, long};

#[test]
fn a_message_from_the_wrong_side_for_the_heading_is_misdirected_and_nothing_else() {
    for config in [source(), mission(Interference::Field(FIELD))] {
        for with_place in [false, true] {
            let (mut relay, from, to) = relay_4(config);
            let mut now = Instant::ZERO;
            if with_place {
                placed(&mut relay, (from, to), &mut now, FIRST);
            }
            for said in one_of_each(SECOND, digest(relay.mission())) {
                let wrong = match said.body()[0] {
                    0 | 4..=6 | 8 | 11 | 15 | 17 => to,
                    1 | 2 | 7 | 9 | 12 | 16 | 18 => from,
                    _ => continue,
                };
                let mut after = relay.clone();
                let before = *after.stats();
                after.handle_bytes(now, wrong, &framed(4, wrong, &said));
                let stats = after.stats();
                assert_eq!(stats.misdirected, before.misdirected + 1, "{said:?}");
                assert_eq!(stats.received, before.received + 1);
                assert_eq!(stats.rejected(), before.rejected() + 1);
                assert_eq!(sent(&mut after, now), []);
                assert_eq!(after.setpoint(), relay.setpoint());
                assert_eq!(after.phase(), relay.phase());
            }
        }
    }
}

#[test]
fn a_message_of_another_mission_leads_to_a_hello_at_most() {
    for config in [source(), mission(Interference::Field(FIELD))] {
        let (relay, from, to) = relay_4(config);
        let own = digest(relay.mission());
        let other = own ^ 0x4000;
        let hello = |port| {
            let neighbour = if port == Port::Upstream { 3 } else { 5 };
            // The relay is fresh, so it is alone.
            long(1, hearing(1, a_hello(0, own, neighbour, ASKS | FRESH)))
        };
        for said in one_of_each(FIRST, other) {
            if matches!(
                said,
                Said::Busy { .. } | Said::Level { .. } | Said::Claim { .. }
            ) {
                continue;
            }
            for port in [from, to] {
                let mut after = relay.clone();
                after.handle_bytes(Instant::ZERO, port, &framed(4, port, &said));
                // Hellos and heartbeats reveal another mission; a pass may only be of another view.
                let of_a_view = !matches!(said.body()[0], 3 | 10 | 13 | 14);
                let (expected, greeted) = if of_a_view {
                    (["received", "view"], Some((port, hello(port))))
                } else {
                    (["mission", "received"], None)
                };
                assert_eq!(counted(after.stats()), expected, "{said:?}");
                let greeted: Vec<_> = greeted.into_iter().collect();
                assert_eq!(sent(&mut after, Instant::ZERO), greeted, "{said:?}");
                assert_eq!(after.phase(), relay.phase());
            }
        }
    }
}

#[test]
fn a_sweep_goes_the_way_of_the_mission_and_its_verdict_back() {
    for config in [source(), mission(Interference::Field(FIELD))] {
        for kind in [0, 4] {
            let (mut relay, from, to) = relay_4(config);
            let kinds = one_of_each(FIRST, digest(relay.mission()));
            let now = Instant::ZERO;
            relay.handle_bytes(now, from, &framed(4, from, &kinds[kind]));
            let out = sent(&mut relay, now);
            let [
                (
                    port,
                    Said::Sweep(Swept {
                        number, reaches, ..
                    }),
                ),
            ] = &out[..]
            else {
                panic!("{out:?}");
            };
            assert_eq!((*port, *number), (to, FIRST));
            assert_eq!(reaches[0] > 400.0, to == Port::Downstream, "a step onward");
            relay.handle_bytes(now, from, &framed(4, from, &kinds[kind]));
            assert_eq!(
                sent(&mut relay, now),
                [(from, Said::Busy { number: FIRST })]
            );
            relay.handle_bytes(now, to, &framed(4, to, &kinds[1]));
            let out = sent(&mut relay, now);
            assert_eq!(out, [(from, kinds[1].clone())]);
            assert_eq!(relay.setpoint().unwrap().x_m, reaches[0]);
            assert_eq!(counted(relay.stats()), ["received", "repeated"]);
        }
    }
}

#[test]
fn a_token_goes_onward_and_what_came_of_it_back() {
    let (mut relay, from, to) = relay_4(source());
    let mut now = Instant::ZERO;
    placed(&mut relay, (from, to), &mut now, FIRST);
    let kinds = one_of_each(SECOND, digest(relay.mission()));
    relay.handle_bytes(now, from, &framed(4, from, &kinds[8]));
    let out = settle(&mut relay, &mut now);
    assert!(
        matches!(out[0], (port, Said::Token(Handed { number: SECOND, .. })) if port == to),
        "{out:?}"
    );
    relay.handle_bytes(now, to, &framed(4, to, &kinds[9]));
    let out = sent(&mut relay, now);
    let [
        (
            port,
            Said::Moved(Shifted {
                number: SECOND,
                any: true,
                worst,
                ..
            }),
        ),
    ] = &out[..]
    else {
        panic!("{out:?}");
    };
    assert_eq!(*port, from);
    assert!(*worst <= 1.0);
    assert_eq!(counted(relay.stats()), ["received"]);
}

#[test]
fn what_is_not_awaited_or_does_not_fit_is_stale() {
    let now = Instant::ZERO;
    for config in [source(), mission(Interference::Field(FIELD))] {
        for with_sweep in [false, true] {
            let (mut relay, from, to) = relay_4(config);
            let digest = digest(relay.mission());
            if with_sweep {
                relay.handle_bytes(now, from, &framed(4, from, &one_of_each(FIRST, digest)[0]));
                drain(&mut relay, now);
            }
            // Answer to another pass or of another kind; token for a relay without a position; pass that is over.
            let mut stale = vec![(from, one_of_each(SECOND, digest)[8].clone())];
            for kind in [1, 9] {
                let number = if with_sweep && kind != 1 {
                    FIRST
                } else {
                    SECOND
                };
                stale.push((to, one_of_each(number, digest)[kind].clone()));
            }
            if with_sweep {
                for kind in [0, 4, 8] {
                    stale.push((from, one_of_each(FIRST - 1, digest)[kind].clone()));
                }
            }
            for (port, said) in stale {
                let mut after = relay.clone();
                after.handle_bytes(now, port, &framed(4, port, &said));
                assert_eq!(counted(after.stats()), ["received", "stale"], "{said:?}");
                assert_eq!(sent(&mut after, now), []);
                assert_eq!(after.phase(), relay.phase());
            }
        }
    }
}

/// Checks false positions beyond Rx.
#[test]
fn what_comes_from_beyond_rx_is_of_no_use() {
    let (mut relay, from, to) = relay_4(source());
    let mut now = Instant::ZERO;
    placed(&mut relay, (from, to), &mut now, FIRST);
    let mut kinds = one_of_each(SECOND, digest(relay.mission()));
    for said in &mut kinds {
        if let Said::Token(Handed { x_m, .. }) | Said::Moved(Shifted { x_m, .. }) = said {
            *x_m = 1000.0_f32.next_up();
        }
    }
    let mut after = relay.clone();
    after.handle_bytes(now, from, &framed(4, from, &kinds[8]));
    assert_eq!(counted(after.stats()), ["received", "stale"]);
    let token = one_of_each(SECOND, digest(relay.mission()))[8].clone();
    relay.handle_bytes(now, from, &framed(4, from, &token));
    settle(&mut relay, &mut now);
    relay.handle_bytes(now, to, &framed(4, to, &kinds[9]));
    assert_eq!(counted(relay.stats()), ["received", "stale"]);

    let (mut relay, from, to) = relay_4(mission(Interference::Field(FIELD)));
    let mut sweep = one_of_each(FIRST, digest(relay.mission()))[0].clone();
    if let Said::Sweep(sweep) = &mut sweep {
        sweep.reaches[0] = 1000.0_f32.next_up();
    }
    relay.handle_bytes(now, from, &framed(4, from, &sweep));
    let out = sent(&mut relay, now);
    let [(port, Said::Sweep(sweep))] = &out[..] else {
        panic!("{out:?}");
    };
    assert_eq!((*port, &sweep.reaches[..]), (to, &[][..]));
}

/// Checks that a token in a field does not affect the pass in progress.
#[test]
fn tokens_are_stale_in_a_field() {
    let (mut relay, from, to) = relay_4(mission(Interference::Field(FIELD)));
    let mut now = Instant::ZERO;
    placed(&mut relay, (from, to), &mut now, FIRST);
    let mut after = relay.clone();
    let kinds = one_of_each(SECOND, digest(relay.mission()));
    after.handle_bytes(now, from, &framed(4, from, &kinds[8]));
    assert_eq!(counted(after.stats()), ["received", "stale"]);
    assert_eq!(settle(&mut after, &mut now.clone()), []);
    assert_eq!(after.phase(), relay.phase());
}

/// Checks that tiny targets are met, although intermediate values exceed f32.
#[test]
fn the_smallest_targets_are_met_in_a_field() {
    for (field, anchor) in [
        (FIELD, 1e-9),
        (FIELD, f32::MIN_POSITIVE),
        (WEAK, f32::MIN_POSITIVE),
    ] {
        for own in [4, 1] {
            let mut relay = relay_of(mission(Interference::Field(field)), own, Wiring::Pair);
            let now = Instant::ZERO;
            let mut sweep = one_of_each(FIRST, digest(relay.mission()))[0].clone();
            if let Said::Sweep(sweep) = &mut sweep {
                sweep.anchor = anchor;
            }
            relay.handle_bytes(
                now,
                Port::Downstream,
                &framed(own, Port::Downstream, &sweep),
            );
            match &sent(&mut relay, now)[..] {
                [(Port::Upstream, Said::Sweep(Swept { reaches, .. }))] => {
                    // As far as this relay knows, the three before it may be above each other, without distance along x.
                    assert!((1e-4..1e-2).contains(&reaches[0]), "{reaches:?}");
                }
                [
                    (
                        Port::Downstream,
                        Said::Verdict(Judged {
                            commit: Some(0),
                            slacks,
                            ..
                        }),
                    ),
                ] => {
                    assert!((1e5..=1e9).contains(&slacks[0]), "{slacks:?}");
                    assert_eq!(relay.setpoint().unwrap().x_m, 0.0);
                }
                other => panic!("{other:?}"),
            }
        }
    }
}
