//! Intact messages of every kind, in any order and from either side: what a relay takes them for in a mission with an
//! interferer and in one with a field, and that none of them leads it out of bounds.

use std::cell::Cell;
use std::collections::BTreeMap;

use host_tests::fixtures::{NETWORK, paper};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::{
    Band, Duration, Field, FieldPoint, Instant, Interference, MissionConfig, Port, Relay, ViewId,
    Wiring,
};

use super::codec::{
    Fenced, Greeting, Handed, Judged, Proposed, Said, Seats, Shifted, SizedView, Swept, plain, wire,
};
use super::config;
use super::forming::{ASKS, FRESH, a_hello, granted, hearing, id, long, mark, proposed};
use super::lies::renamed;
use super::offer::{Offer, offer};
use super::receive::{FIELD, counted, drain, relay_of};
use super::strategies::messages;
use super::stream::unstuffed;

/// A field as strong and as weak as one may be.
const WILD: Field = Field::new(&[
    FieldPoint {
        x_m: 0.0,
        upsilon_per_w: 1e32,
    },
    FieldPoint {
        x_m: 1000.0,
        upsilon_per_w: 1e-9,
    },
]);

/// A field of next to no interference.
const WEAK: Field = Field::new(&[FieldPoint {
    x_m: 0.0,
    upsilon_per_w: 1e32,
}]);

/// The number of the first pass of a leader's life, and of the one after it.
pub(crate) const FIRST: u16 = 64;
pub(crate) const SECOND: u16 = 65;

/// The paper's scenario with this interference, between 20 m and 300 m, with room to both sides.
fn mission(interference: Interference) -> MissionConfig {
    MissionConfig {
        interference,
        band: Band {
            least_m: 20.0,
            most_m: 300.0,
        },
        lateral: Band {
            least_m: -60.0,
            most_m: 40.0,
        },
        ..paper(8)
    }
}

/// The same with the paper's interferer.
pub(crate) fn source() -> MissionConfig {
    mission(paper(8).interference)
}

/// The stream of one frame to relay `own` from the side of `port`.
pub(crate) fn framed(own: u16, port: Port, said: &Said) -> Vec<u8> {
    let header = Header {
        network: NETWORK,
        sender: if port == Port::Upstream {
            own - 1
        } else {
            own + 1
        },
        destination: own,
        counter: 0,
    };
    wire(&plain(header, &said.body()))
}

/// What `relay` sends at `now`: ports, and bodies as the rules read them.
pub(crate) fn sent(relay: &mut Relay, now: Instant) -> Vec<(Port, Said)> {
    let mut out = Vec::new();
    let mut buffer = [0; MAX_FRAME];
    while let Some(transmit) = relay.poll_transmit(now, &mut buffer) {
        let plain = unstuffed(&buffer[..transmit.len - 1]).unwrap();
        assert!(frame::decode(&plain).is_ok());
        let said = Said::read(&plain[10..plain.len() - 4]).unwrap();
        out.push((transmit.port, said));
    }
    out
}

/// Lets time pass until `relay` has no work to do, at most a second; what it sends on the way.
pub(crate) fn settle(relay: &mut Relay, now: &mut Instant) -> Vec<(Port, Said)> {
    let mut out = sent(relay, *now);
    for _ in 0..1000 {
        *now = *now + Duration::from_millis(1);
        relay.handle_timeout(*now);
        out.extend(sent(relay, *now));
    }
    out
}

/// What relay `index` brings along.
pub(crate) fn seats(number: u16, mission: u16, index: u16) -> Seats {
    Seats {
        number,
        mission,
        after: 0,
        seats: vec![(index, 30.0, 0.5)],
    }
}

/// One message of each tag, of this pass.
pub(crate) fn one_of_each(number: u16, mission: u16) -> Vec<Said> {
    let x_m = 400.0;
    let altitude_m = 20.0;
    let power_w = 1.0;
    let view = id(u32::from(number).max(1), 1);
    let sweep = Swept {
        number,
        mission,
        anchor: 1.0,
        gap: 0,
        growth: 0,
        altitude_m,
        power_w,
        reaches: vec![x_m],
    };
    vec![
        Said::Sweep(sweep.clone()),
        Said::Verdict(Judged {
            number,
            mission,
            own: false,
            commit: Some(0),
            slacks: vec![1.0],
            stand: None,
        }),
        Said::Busy { number },
        Said::Heartbeat {
            mission,
            ask: 0,
            answer: 0,
        },
        Said::Measured {
            sweep: sweep.clone(),
            upsilon_per_w: 1e8,
        },
        Said::Aside { sweep, y_m: -12.5 },
        Said::Gather(seats(number, mission, 3)),
        Said::Gathered(seats(number, mission, 5)),
        Said::Token(Handed {
            number,
            mission,
            x_m,
            altitude_m,
            power_w,
            turn: 2,
            explore_m: 10.0,
            columns: 0,
            rows: 0,
            sir: 1.0,
        }),
        Said::Moved(Shifted {
            number,
            mission,
            x_m: 600.0,
            altitude_m,
            any: true,
            worst: 1.0,
        }),
        Said::Hello(Greeting {
            mission,
            neighbour: 4,
            behind: 1,
            newest: view,
            holds: (mission, 0),
            nonce: 0,
            hears: 1,
            flags: 16,
        }),
        Said::Proposal(proposed(view, (mission, 0), 3, 8)),
        granted(view, (mission, 0), 5, 8),
        Said::Fence(Fenced {
            number: 1,
            mission,
            echo: 0,
            fence: 1,
            x_m,
            target_m: x_m,
        }),
        Said::Offer(Offer {
            base: mission,
            ..offer()
        }),
        Said::Pulse {
            number,
            mission,
            lease: 150,
        },
        Said::Pulsed {
            number,
            mission,
            done: true,
        },
    ]
}

/// Relay 4 of 8 and the ports that a pass comes from and goes to.
fn relay_4(config: MissionConfig) -> (Relay, Port, Port) {
    let relay = relay_of(config, 4, Wiring::Pair);
    match config.interference {
        Interference::Source(_) => (relay, Port::Upstream, Port::Downstream),
        Interference::Field(_) => (relay, Port::Downstream, Port::Upstream),
    }
}

/// Has `relay` take its place by pass `number`.
fn placed(relay: &mut Relay, (from, to): (Port, Port), now: &mut Instant, number: u16) {
    let kinds = one_of_each(number, digest(relay.mission()));
    for (port, said) in [(from, &kinds[0]), (to, &kinds[1])] {
        relay.handle_bytes(*now, port, &framed(4, port, said));
        drain(relay, *now);
    }
    assert!(relay.setpoint().is_some());
}

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
                    0 | 4..=6 | 8 | 11 | 15 => to,
                    1 | 2 | 7 | 9 | 12 | 16 => from,
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
            // Fresh: it is alone.
            long(1, hearing(1, a_hello(0, own, neighbour, ASKS | FRESH)))
        };
        for said in one_of_each(FIRST, other) {
            if matches!(said, Said::Busy { .. }) {
                continue;
            }
            for port in [from, to] {
                let mut after = relay.clone();
                after.handle_bytes(Instant::ZERO, port, &framed(4, port, &said));
                // That is for hellos and heartbeats to tell: of a view it may be another view alone.
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
            // An answer to another pass, or of another kind; a token for a relay without a place; a pass that is over.
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

/// Nobody stands beyond Rx, whatever a neighbour says.
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

/// In a field there are no turns: such a pass changes nothing about the one under way.
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

/// Makes a message one that may well be of this mission.
fn tamed(said: Said) -> Said {
    let into = |reach: f32| reach % 1000.0;
    match said {
        Said::Sweep(mut sweep) => {
            sweep.anchor = 1.0_f32.copysign(sweep.anchor);
            sweep.growth = if sweep.gap == 0 {
                0
            } else {
                sweep.growth.min(4)
            };
            sweep.gap = sweep.gap.min(140);
            sweep.reaches = sweep.reaches.into_iter().map(into).collect();
            Said::Sweep(sweep)
        }
        Said::Verdict(Judged {
            number,
            mission,
            own,
            mut slacks,
            stand,
            ..
        }) => {
            slacks.truncate(1);
            for slack in &mut slacks {
                *slack = slack.abs();
            }
            Said::Verdict(Judged {
                number,
                mission,
                own,
                commit: (!slacks.is_empty()).then_some(0),
                slacks,
                stand: stand.map(into),
            })
        }
        Said::Aside { mut sweep, y_m } => {
            (sweep.anchor, sweep.gap, sweep.growth) = (1.0, 0, 0);
            sweep.power_w = 1.0;
            sweep.reaches = sweep.reaches.into_iter().take(1).map(into).collect();
            Said::Aside {
                sweep,
                y_m: y_m % 100.0,
            }
        }
        Said::Gather(mut seats) => {
            seats.after = 0;
            seats.seats.truncate(2);
            for (seat, index) in seats.seats.iter_mut().zip(1..) {
                seat.0 = index;
            }
            Said::Gather(seats)
        }
        Said::Proposal(mut proposed) => {
            proposed.call.place = 3;
            let SizedView { id, relays } = proposed.agreed;
            let relays = relays.min(8);
            Said::Proposal(Proposed {
                agreed: SizedView { id, relays },
                votes: proposed.votes.min(relays),
                ..proposed
            })
        }
        other => other,
    }
}

/// However far below a chain's best a target is, it is met: what is too large for an f32 on the way is no obstacle.
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
                    // Three relays before it may be above each other, as far as this one knows, and those then keep no distance along x.
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

/// What neighbours may say in one step.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is drawn by itself")]
struct Step {
    said: Said,
    /// Whether it comes from the side that it should come from.
    right_side: bool,
    right_mission: bool,
    /// How far its number is from that of the next pass, or of the last one that it answers.
    off: i16,
    tame: bool,
    /// For how long the relay is left alone afterwards.
    wait_ms: u64,
    /// Whether a pass is then answered as it might be.
    answered: bool,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let mostly = || prop_oneof![9 => Just(true), 1 => Just(false)];
    let waits = prop_oneof![3 => Just(0), 4 => 1..8_u64, 2 => 0..100_u64];
    let drawn = (
        messages(),
        mostly(),
        mostly(),
        prop_oneof![4 => Just(0), 1 => -20..20_i16],
        prop_oneof![3 => Just(true), 1 => Just(false)],
        waits,
        any::<bool>(),
    );
    let step = drawn.prop_map(
        |(said, right_side, right_mission, off, tame, wait_ms, answered)| Step {
            said,
            right_side,
            right_mission,
            off,
            tame,
            wait_ms,
            answered,
        },
    );
    vec(step, 1..40)
}

/// Leads a relay of 8 by any messages, from a place or from none: it must be drained at any time, asleep until later, its
/// setpoint between Tx and Rx and within the band, its place in the chain one of those that there are. `expected` names what
/// must have happened at times: what moved the setpoint, and new views.
#[expect(clippy::too_many_lines, reason = "all that is looked at in one flight")]
fn led_by_anything(mission: MissionConfig, own: u16, expected: &[&str]) {
    let seen: Cell<BTreeMap<&str, u32>> = Cell::new(BTreeMap::new());
    let (from, to) = match mission.interference {
        Interference::Source(_) => (Port::Upstream, Port::Downstream),
        Interference::Field(_) => (Port::Downstream, Port::Upstream),
    };
    TestRunner::new(config(1500))
        .run(&(steps(), any::<bool>()), |(steps, with_place)| {
            let mut relay = relay_of(mission, own, Wiring::Pair);
            let digest = digest(relay.mission());
            let mut now = Instant::ZERO;
            if with_place && own == 4 {
                placed(&mut relay, (from, to), &mut now, FIRST);
            }
            let mut counts = seen.take();
            let mut place = relay.setpoint();
            let mut begun = place.is_some();
            // The pass that is said, and the last one that the relay may have taken up.
            let mut pass = if begun { FIRST } else { 0 };
            let mut last = pass;
            let mut view = ViewId::LOADED;
            for step in steps {
                if relay.view() != view {
                    *counts.entry("view").or_insert(0) += 1;
                    (view, begun) = (relay.view(), false);
                }
                let kind = step.said.body()[0];
                let onward = [0, 4, 5, 6, 8, 11, 15].contains(&kind);
                let port = if onward == step.right_side { from } else { to };
                if onward && ![11, 15].contains(&kind) {
                    pass = if begun {
                        last + 1
                    } else {
                        (last / 64 + 1) * 64
                    };
                    if port == from && step.right_mission && step.off == 0 {
                        (begun, last) = (true, pass);
                    }
                }
                let (number, mission) = match kind {
                    10..=12 => {
                        let low = u16::try_from(view.number() & 0xFFFF).unwrap();
                        (low.wrapping_add(1), digest)
                    }
                    3 | 13 | 14 => (0, digest),
                    15 | 16 => (0, digest.wrapping_add(mark(view.bits()))),
                    _ => (pass, digest.wrapping_add(mark(view.bits()))),
                };
                let number = number.wrapping_add_signed(step.off);
                let wrong = if step.right_mission { 0 } else { 0x4000 };
                let said = renamed(step.said, number, mission ^ wrong);
                let said = if step.tame { tamed(said) } else { said };
                let answer = match kind {
                    0 | 4 | 5 => 1,
                    6 => 7,
                    11 => 12,
                    15 => 16,
                    _ => 9,
                };
                let answer = one_of_each(number, mission)[answer].clone();
                let mut heard = vec![(port, said)];
                if onward && step.answered {
                    heard.push((to, answer));
                }
                for ((port, said), pause) in heard.iter().flat_map(|message| {
                    let pauses = 0..=step.wait_ms;
                    pauses.map(move |pause| (message, pause))
                }) {
                    if pause == 0 {
                        relay.handle_bytes(now, *port, &framed(own, *port, said));
                    }
                    drain(&mut relay, now);
                    prop_assert!((1..=relay.mission().relays()).contains(&relay.index()));
                    if let Some(at) = relay.setpoint() {
                        prop_assert!((0.0..=1000.0).contains(&at.x_m), "{at:?}");
                        prop_assert!((-60.0..=40.0).contains(&at.y_m), "{at:?}");
                        prop_assert!((20.0..=300.0).contains(&at.altitude_m), "{at:?}");
                    }
                    if relay.setpoint() != place {
                        let cause = match (said.body()[0], pause) {
                            (1, 0) => "verdict",
                            (8, _) => "turn",
                            (0 | 4 | 5, 0) => "sweep at the last",
                            _ => "work",
                        };
                        *counts.entry(cause).or_insert(0) += 1;
                        place = relay.setpoint();
                    }
                    now = now + Duration::from_millis(1);
                    relay.handle_timeout(now);
                }
            }
            drain(&mut relay, now);
            prop_assert_eq!(relay.stats().malformed, 0);
            seen.set(counts);
            Ok(())
        })
        .unwrap();
    let seen = seen.take();
    println!("relay {own}: the setpoint moved by {seen:?}");
    for cause in expected {
        assert!(seen.get(cause).is_some_and(|&count| count > 5), "{cause}");
    }
}

#[test]
fn any_messages_leave_a_relay_in_bounds() {
    led_by_anything(source(), 4, &["verdict", "turn", "view"]);
    led_by_anything(source(), 1, &[]);
    led_by_anything(source(), 8, &["work", "view"]);
}

#[test]
fn any_messages_leave_a_relay_in_a_field_in_bounds() {
    let field = mission(Interference::Field(FIELD));
    led_by_anything(field, 4, &["verdict", "view"]);
    led_by_anything(field, 1, &["sweep at the last", "view"]);
    led_by_anything(field, 8, &[]);
    let wild = mission(Interference::Field(WILD));
    led_by_anything(wild, 4, &[]);
    led_by_anything(wild, 1, &[]);
    let weak = mission(Interference::Field(WEAK));
    led_by_anything(weak, 1, &[]);
}
