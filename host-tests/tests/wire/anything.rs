//! Random messages from either side in any order: a relay stays within its bounds.

use std::cell::Cell;
use std::collections::BTreeMap;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use uav_relay::wire::digest::digest;
use uav_relay::{
    Duration, Field, FieldPoint, Instant, Interference, MissionConfig, Port, ViewId, Wiring,
};

use super::codec::{Judged, Proposed, Said, SizedView};
use super::config;
use super::kinds::{FIRST, WEAK, framed, mission, one_of_each, placed, source};
use super::lies::renamed;
use super::receive::{FIELD, drain, relay_of};
use super::strategies::messages;
use super::votes::mark;

/// Field of the strongest and the weakest interference.
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

/// Changes a message so that it is plausible in this mission.
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
            view_digest: mission,
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
                view_digest: mission,
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

/// Message of a neighbour in one step.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is drawn by itself")]
struct Step {
    said: Said,
    right_side: bool,
    right_mission: bool,
    /// Offset of its number from that of the next pass, or of the last one that it answers.
    off: i16,
    tame: bool,
    /// Time until the next step, ms.
    wait_ms: u64,
    /// True if a pass is then answered.
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

/// Sends a relay of 8 any messages and checks its bounds; all causes in `expected` must occur.
#[expect(clippy::too_many_lines, reason = "all that is looked at in one flight")]
fn led_by_anything(mission: MissionConfig, own: u16, expected: &[&str]) {
    let seen: Cell<BTreeMap<&str, u32>> = Cell::new(BTreeMap::new());
    let (from, to) = match mission.interference {
        Interference::Source(_) | Interference::Unknown => (Port::Upstream, Port::Downstream),
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
            // Number of the pass sent, and of the last one that the relay may have accepted.
            let mut pass = if begun { FIRST } else { 0 };
            let mut last = pass;
            let mut view = ViewId::LOADED;
            for step in steps {
                if relay.view() != view {
                    *counts.entry("view").or_insert(0) += 1;
                    (view, begun) = (relay.view(), false);
                }
                let kind = step.said.body()[0];
                let onward = [0, 4, 5, 6, 8, 11, 15, 17].contains(&kind);
                let port = if onward == step.right_side { from } else { to };
                // These relays do not measure: collection passes do not count.
                if onward && ![11, 15, 17].contains(&kind) {
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
                    17 => 18,
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
