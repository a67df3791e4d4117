//! Random messages from either side in any order: a relay stays within its bounds.

use std::cell::Cell;
use std::collections::BTreeMap;

use host_tests::fixtures::paper;
use host_tests::make;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use serde_json::json;
use uav_relay::wire::frame::MAX_FRAME;
use uav_relay::{Interference, MissionConfig, Port, ViewId, Wiring};
use uav_relay_decode::envelope::unsigned;

use super::bench::Bench;
use super::config;
use super::kinds::{FIELD, FIRST, WEAK, WILD, mission, one_of_each, place, source, ways};
use super::message::{WireMessage, plain_of};
use super::strategies::messages;
use super::votes::mark;

/// Sets the number and the mission digest of a message, in messages that have these fields.
///
/// The number counts the rounds of messages along the chain.
fn renamed(message: &WireMessage, number: u16, mission: u16) -> WireMessage {
    // The view of that number proposed by relay 1; proposed numbers are above 0.
    let view = u32::from(number.max(1)) << 10 | 1;
    message.with(match message.name() {
        "Claim" | "Busy" => json!({ "number": number }),
        "Heartbeat" | "Level" => json!({ "mission": mission }),
        "Watch" | "Report" => json!({ "number": number, "mission": mission }),
        // A fence's number is that of its association, never 0.
        "Fence" => json!({ "line_digest": mission }),
        "Offer" => json!({ "base": mission }),
        "Hello" => json!({ "mission": mission, "latest_view": view }),
        // The view has the loaded mission; no earlier view is known.
        "Proposal" => json!({
            "mission": mission, "version": 0, "proposed_view": view, "agreed_view": 0, "successor": null,
        }),
        "Decision" => {
            // An accepted view is at most the proposed one.
            let mut accepted = json!(message.fields())["accepted"].take();
            if let Some(accepted) = accepted.as_object_mut() {
                let least = view.min(accepted["view"].as_u64().unwrap() as u32);
                accepted["view"] = least.into();
            }
            json!({
                "mission": mission, "version": 0, "proposed_view": view, "base_view": 0, "accepted": accepted,
            })
        }
        _ => json!({ "number": number, "view_digest": mission }),
    })
}

/// Returns the message with some fields changed to values that are plausible in the test's mission.
fn with_plausible_values(message: &WireMessage) -> WireMessage {
    let within = |numbers: Vec<f32>| numbers.into_iter().map(|number| number % 1000.0);
    match message.name() {
        "Sweep" | "Aside" => {
            let gap = if message.is("Aside") {
                0
            } else {
                (message.number("gap") as u8).min(140)
            };
            let growth = (message.number("growth") as u8).min(if gap == 0 { 0 } else { 4 });
            let mut reaches: Vec<f32> = within(message.list("reach_m")).collect();
            reaches.truncate(if gap == 0 { 1 } else { 16 });
            let tame = message.with(json!({
                "anchor": 1.0_f64.copysign(message.number("anchor")), "gap": gap, "growth": growth,
                "reach_m": reaches,
            }));
            if message.is("Sweep") {
                return tame;
            }
            tame.with(json!({ "power_w": 1.0, "y_m": message.number("y_m") % 100.0 }))
        }
        "Verdict" => {
            let slack = message.list("slack_m").first().map(|slack| slack.abs());
            let commit = slack.map(|_| 0);
            message.with(
                json!({ "slack_m": Vec::from_iter(slack), "commit": commit, "required_x_m": null }),
            )
        }
        "Gather" => {
            let fields = json!(message.fields());
            let mut seats = fields["seats"].as_array().unwrap().clone();
            seats.truncate(2);
            for (seat, index) in seats.iter_mut().zip(1..) {
                seat["relay"] = index.into();
            }
            message.with(json!({ "after": 0, "seats": seats }))
        }
        "Proposal" => {
            let relays = message.number("agreed_relays").min(8.0) as u16;
            let votes = (message.number("votes") as u16).min(relays);
            message.with(json!({ "place": 3, "agreed_relays": relays, "votes": votes }))
        }
        _ => message.clone(),
    }
}

/// Step of a random test: a message that the relay receives from a neighbour.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is drawn by itself")]
struct Step {
    message: WireMessage,
    right_side: bool,
    right_mission: bool,
    /// Difference between the number of the message's pass and the expected number.
    ///
    /// A pass is a message along the chain. An onward pass is expected to have the next number, its answer the number
    /// of the onward pass sent last.
    off: i16,
    tame: bool,
    /// Time until the next step of the test, ms.
    wait_ms: u64,
    /// True if a neighbour's answer follows a message that travels along the chain.
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
        |(message, right_side, right_mission, off, tame, wait_ms, answered)| Step {
            message,
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

/// State of a random test, in which a relay receives random messages.
struct Flight {
    bench: Bench,
    /// Messages of the test, one of each tag, in the order of the tags.
    kinds: Vec<WireMessage>,
    ports: (Port, Port),
    /// True once the test has sent a pass (message along the chain) that the relay can accept.
    begun: bool,
    /// Number of the last pass (message that travels along the chain) that was sent to the relay.
    pass: u16,
    /// Number of the last pass (message along the chain) sent to the relay that the relay can accept.
    last: u16,
    view: ViewId,
}

impl Flight {
    /// Returns the messages of a step with the ports at which they arrive.
    ///
    /// The first is the step's message. If it starts a round along the chain, and `answered` is true, the next
    /// neighbour's answer follows.
    fn messages(&mut self, step: &Step) -> Vec<(Port, WireMessage)> {
        let (from, to) = self.ports;
        let tag = step.message.tag();
        let onward = [0, 4, 5, 6, 8, 11, 15, 17].contains(&tag);
        let port = if onward == step.right_side { from } else { to };
        // These relays do not measure: collection passes do not count.
        if onward && ![11, 15, 17].contains(&tag) {
            self.pass = if self.begun {
                self.last + 1
            } else {
                (self.last / 64 + 1) * 64
            };
            if port == from && step.right_mission && step.off == 0 {
                (self.begun, self.last) = (true, self.pass);
            }
        }
        let base = self.bench.mission;
        let of_view = base.wrapping_add(mark(self.view.bits()));
        let (number, mission) = match tag {
            10..=12 => ((self.view.number() as u16).wrapping_add(1), base),
            3 | 13 | 14 => (0, base),
            15 | 16 => (0, of_view),
            _ => (self.pass, of_view),
        };
        let number = number.wrapping_add_signed(step.off);
        let wrong = if step.right_mission { 0 } else { 0x4000 };
        let message = renamed(&step.message, number, mission ^ wrong);
        let message = if step.tame {
            with_plausible_values(&message)
        } else {
            message
        };
        let answer = match tag {
            0 | 4 | 5 => 1,
            6 => 7,
            11 => 12,
            15 => 16,
            17 => 18,
            _ => 9,
        };
        let answer = renamed(&self.kinds[answer], number, mission);
        let answer = (onward && step.answered).then_some((to, answer));
        [(port, message)].into_iter().chain(answer).collect()
    }
}

/// Sends random messages to relay `own` of eight. Checks that its setpoint stays within the mission's limits.
///
/// `expected` has the causes of a change of setpoint or view that must occur, each several times.
fn led_by_anything(mission: MissionConfig, own: u16, expected: &[&str]) {
    let seen: Cell<BTreeMap<&str, u32>> = Cell::new(BTreeMap::new());
    let ports = ways(mission.interference);
    let kinds = one_of_each(FIRST, 0);
    TestRunner::new(config(1500))
        .run(&(steps(), any::<bool>()), |(steps, with_place)| {
            let mut bench = Bench::of(mission, own, Wiring::Pair);
            if with_place && own == 4 {
                place(&mut bench, ports, FIRST);
            }
            let mut counts = seen.take();
            let mut held = bench.setpoint();
            let begun = held.is_some();
            let pass = if begun { FIRST } else { 0 };
            let mut flight = Flight {
                bench,
                kinds: kinds.clone(),
                ports,
                begun,
                pass,
                last: pass,
                view: ViewId::LOADED,
            };
            for step in steps {
                let view = flight.bench.view();
                if view != flight.view {
                    *counts.entry("view").or_insert(0) += 1;
                    (flight.view, flight.begun) = (view, false);
                }
                for (port, message) in flight.messages(&step) {
                    for pause in 0..=step.wait_ms {
                        let bench = &mut flight.bench;
                        if pause == 0 {
                            bench.receive(port, &message);
                        } else {
                            bench.sent();
                        }
                        bench.events();
                        prop_assert!((1..=bench.mission().relays()).contains(&bench.index()));
                        if let Some(at) = bench.setpoint() {
                            let (band, lateral) = (mission.band, mission.lateral);
                            prop_assert!((0.0..=1000.0).contains(&at.x_m), "{at:?}");
                            prop_assert!(
                                (lateral.least_m..=lateral.most_m).contains(&at.y_m),
                                "{at:?}"
                            );
                            prop_assert!(
                                (band.least_m..=band.most_m).contains(&at.altitude_m),
                                "{at:?}"
                            );
                        }
                        if bench.setpoint() != held {
                            let cause = match (message.tag(), pause) {
                                (1, 0) => "verdict",
                                (8, _) => "turn",
                                (0 | 4 | 5, 0) => "sweep at the last",
                                _ => "work",
                            };
                            *counts.entry(cause).or_insert(0) += 1;
                            held = bench.setpoint();
                        }
                        bench.advance_1_ms();
                    }
                }
            }
            prop_assert_eq!(flight.bench.stats().malformed, 0);
            seen.set(counts);
            Ok(())
        })
        .unwrap();
    let seen = seen.take();
    println!("relay {own}: the setpoint moved by {seen:?}");
    for cause in expected {
        let count = seen.get(cause).copied().unwrap_or(0);
        assert!(
            count > 5,
            "relay {own}: {count} changes by \"{cause}\", at least 6 are needed: draw more (config)"
        );
    }
}

#[test]
fn any_messages_keep_a_relay_within_its_limits() {
    led_by_anything(source(), 4, &["verdict", "turn", "view"]);
    led_by_anything(source(), 1, &[]);
    led_by_anything(source(), 8, &["work", "view"]);
}

#[test]
fn any_messages_keep_a_relay_on_the_line_in_its_limits() {
    led_by_anything(paper(8), 4, &["verdict", "view"]);
    led_by_anything(paper(8), 8, &["sweep at the last", "view"]);
}

#[test]
fn any_messages_keep_a_relay_in_a_field_in_its_limits() {
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

/// Checks the headers of the leader's first frames. The frame counter must rise by one from frame to frame.
#[test]
fn a_relays_frames_have_its_header_and_a_rising_counter() {
    let mut head = Bench::new(1, 8, Wiring::Pair);
    let mut buffer = [0; MAX_FRAME];
    let mut counter = 0;
    while counter < 3 {
        head.now = head.poll_timeout().unwrap();
        let now = head.now;
        head.handle_timeout(now);
        head.persist(|_| true);
        while let Some(transmit) = head.poll_transmit(now, &mut buffer) {
            let plain = plain_of(&buffer[..transmit.len]);
            let message = WireMessage::read(&plain[10..plain.len() - 4]).unwrap();
            let header = make::header(1, 2, counter);
            assert_eq!(plain, unsigned(header, message.body()), "frame {counter}");
            if message.is("Sweep") {
                assert_eq!(message.number("view_digest"), f64::from(head.mission));
            }
            counter += 1;
        }
    }
}
