//! `cargo decode` on encoded frames: every field has the encoded value.

use std::collections::BTreeMap;

use proptest::strategy::{Strategy as _, ValueTree as _};
use proptest::test_runner::TestRunner;
use serde_json::{Value, json};
use uav_relay::wire::frame::{self, MAX_FRAME};
use uav_relay_decode::format::Format;

use super::codec::{Call, Fenced, Greeting, Heard, Said, Seats, Swept};
use super::config;
use super::offer::Offer;
use super::strategies::{headers, messages};

const EACH: usize = 10_000;

const TAGS: u8 = 21;

fn digest(number: u16) -> Value {
    format!("{number:04x}").into()
}

/// Returns the fields of a sweep, with `more` before the reaches.
fn sweep(said: &Swept, more: Option<(&str, f32)>) -> Value {
    let mut value = json!({
        "number": said.number, "view": digest(said.mission), "anchor": said.anchor, "gap": said.gap, "growth": said.growth,
        "altitude_m": said.altitude_m, "power_w": said.power_w, "reach_m": said.reaches,
    });
    if let Some((name, number)) = more {
        value[name] = json!(number);
    }
    value
}

fn seats(said: &Seats) -> Value {
    let seat = |&(relay, altitude_m, power_w): &(u16, f32, f32)| json!({"relay": relay, "altitude_m": altitude_m, "power_w": power_w});
    json!({
        "number": said.number, "view": digest(said.mission), "after": said.after,
        "seats": said.seats.iter().map(seat).collect::<Vec<_>>(),
    })
}

fn heard(said: &Heard) -> Value {
    let [power_w, x_m, y_m, at_rx_w] = said.source;
    let (ab, rest) = said.sums.split_at(10);
    json!({
        "number": said.number, "view": digest(said.mission), "belief_number": said.told, "belief": said.kind,
        "source_power_w": power_w, "source_x_m": x_m, "source_y_m": y_m, "source_at_rx_w": at_rx_w,
        "sum_ab": ab, "sum_av": rest[..4], "sum_vv": rest[4], "places": rest[5], "measurements": rest[6], "age_s": rest[7],
        "rx_power_w": said.receiver[0], "rx_measurements": said.receiver[1], "left_out": said.off,
    })
}

fn flags<const N: usize>(bits: u8, names: [&str; N]) -> Value {
    let set = (0..).zip(names).filter(|(bit, _)| bits >> bit & 1 == 1);
    set.map(|(_, name)| name).collect::<Vec<_>>().into()
}

fn call(call: &Call, more: Value) -> Value {
    let mut value = json!({
        "mission": digest(call.of.0), "version": call.of.1, "proposed_view": call.view, "place": call.place,
    });
    let Value::Object(more) = more else { panic!() };
    value.as_object_mut().unwrap().extend(more);
    value
}

fn offer(said: &Offer) -> Value {
    json!({
        "version": said.version, "base": digest(said.base), "relays": said.relays, "distance_m": said.distance_m,
        "min_separation_m": said.min_separation_m, "tx_power_w": said.tx_power_w, "altitude_m": said.altitude_m,
        "power_w": said.power_w, "interferer_power_w": said.interferer_w, "interferer_x_m": said.x_m,
        "interferer_y_m": said.y_m, "tolerance": said.tolerance, "mu_los": said.mu_los, "mu_nlos": said.mu_nlos,
        "eta": said.eta, "altitude_min_m": said.least_m, "altitude_max_m": said.most_m, "lateral_min_m": said.left_m,
        "lateral_max_m": said.right_m, "noise_w": said.noise_w, "tx_lat_e7": said.sites[0], "tx_lon_e7": said.sites[1],
        "tx_amsl_mm": said.sites[2], "rx_lat_e7": said.sites[3], "rx_lon_e7": said.sites[4],
        "rx_amsl_mm": said.sites[5], "answers": said.answer,
    })
}

fn fence(said: &Fenced) -> Value {
    json!({
        "association": said.number, "line": digest(said.mission), "echo": said.echo, "fence": said.fence,
        "x_m": said.places[0], "target_m": said.places[1], "y_m": said.places[2], "altitude_m": said.places[3],
        "apart_m": said.places[4], "flags": flags(said.flags, ["arrived", "agrees", "needs", "needed", "left", "halts", "unplaced"]),
    })
}

fn hello(said: &Greeting) -> Value {
    json!({
        "mission": digest(said.mission), "neighbour": said.neighbour, "behind": said.behind, "newest_view": said.newest,
        "holds": digest(said.holds.0), "holds_version": said.holds.1, "offer_number": said.nonce, "hears": said.hears,
        "flags": flags(said.flags, ["ask", "form", "fresh", "ready", "flies", "whole", "refused"]),
    })
}

fn claim(number: u32, heard: u32, flags: u8) -> Value {
    let names = [(1, "passive"), (2, "echo")];
    let set = names.iter().filter(|(bit, _)| flags & bit != 0);
    let flags: Vec<&str> = set.map(|(_, name)| *name).collect();
    json!({"claim": number, "other_claim": heard, "flags": flags})
}

/// Returns a message's name and expected fields, by its content and not its bytes.
fn wanted(said: &Said) -> (&'static str, Value) {
    match said {
        Said::Sweep(said) => ("Sweep", sweep(said, None)),
        Said::Verdict(said) => (
            "Verdict",
            json!({
                "number": said.number, "view": digest(said.mission), "own": said.own, "commit": said.commit, "slack_m": said.slacks,
                "stand_m": said.stand,
            }),
        ),
        Said::Busy { number } => ("Busy", json!({"number": number})),
        Said::Heartbeat {
            mission,
            ask,
            answer,
        } => (
            "Heartbeat",
            json!({"mission": digest(*mission), "asks": ask, "answers": answer}),
        ),
        Said::Measured {
            sweep: said,
            upsilon_per_w,
        } => (
            "Measured",
            sweep(said, Some(("upsilon_per_w", *upsilon_per_w))),
        ),
        Said::Aside { sweep: said, y_m } => ("Aside", sweep(said, Some(("y_m", *y_m)))),
        Said::Gather(said) => ("Gather", seats(said)),
        Said::Gathered(said) => ("Gathered", seats(said)),
        Said::Token(said) => (
            "Token",
            json!({
                "number": said.number, "view": digest(said.mission), "x_m": said.x_m, "altitude_m": said.altitude_m,
                "power_w": said.power_w, "turn": said.turn, "explore_m": said.explore_m, "columns": said.columns,
                "rows": said.rows, "sir": said.sir,
            }),
        ),
        Said::Moved(said) => (
            "Moved",
            json!({
                "number": said.number, "view": digest(said.mission), "x_m": said.x_m, "altitude_m": said.altitude_m,
                "moved": said.any, "worst_sir": said.worst,
            }),
        ),
        Said::Hello(said) => ("Hello", hello(said)),
        Said::Proposal(said) => (
            "Proposal",
            call(
                &said.call,
                json!({
                    "agreed_view": said.agreed.id, "agreed_relays": said.agreed.relays, "votes": said.votes,
                    "lease_left_ds": said.lease_left, "rest_ds": said.rest, "proposer": said.proposer,
                    "successor": said.successor.map(|(proposal, view)| json!({
                        "proposal": proposal, "view": view.id, "relays": view.relays,
                    })),
                }),
            ),
        ),
        Said::Decision(said) => (
            "Decision",
            call(
                &said.call,
                json!({
                    "base_view": said.base.id, "base_relays": said.base.relays, "there": said.there, "rest_ds": said.lease_left,
                    "accepted": said.view.map(|view| json!({"view": view.id, "relays": view.relays})),
                }),
            ),
        ),
        Said::Fence(said) => ("Fence", fence(said)),
        Said::Offer(said) => ("Offer", offer(said)),
        Said::Pulse {
            number,
            mission,
            lease,
        } => (
            "Pulse",
            json!({"number": number, "view": digest(*mission), "lease_ds": lease}),
        ),
        Said::Pulsed {
            number,
            mission,
            done,
        } => (
            "Pulsed",
            json!({"number": number, "view": digest(*mission), "back": done}),
        ),
        Said::Sense(said) => ("Sense", heard(said)),
        Said::Sensed(said) => ("Sensed", heard(said)),
        Said::Level { mission, power_w } => (
            "Level",
            json!({"mission": digest(*mission), "power_w": power_w}),
        ),
        Said::Claim {
            number,
            heard,
            flags,
        } => ("Claim", claim(*number, *heard, *flags)),
    }
}

#[test]
fn every_field_of_ten_thousand_frames_of_each_tag_is_decoded_as_it_was_encoded() {
    let format = Format::load().unwrap();
    assert_eq!(format.messages.len(), usize::from(TAGS));
    let mut runner = TestRunner::new(config(1));
    let (said, heads) = (messages(), headers());
    let mut done: BTreeMap<u8, usize> = (0..TAGS).map(|tag| (tag, 0)).collect();
    while done.values().any(|count| *count < EACH) {
        let said = said.new_tree(&mut runner).unwrap().current();
        let tag = said.body()[0];
        if done[&tag] >= EACH {
            continue;
        }
        let head = heads.new_tree(&mut runner).unwrap().current();
        let mut bytes = [0; MAX_FRAME];
        let len = frame::encode(head, &said.message(), &mut bytes);
        let decoded = uav_relay_decode::frame::read(&format, &bytes[..len], len);
        assert_eq!(
            (&decoded.refusal, decoded.header),
            (&None, Some(head)),
            "{said:?}"
        );
        let (name, fields) = wanted(&said);
        assert_eq!(decoded.name, Some(name));
        assert_eq!(
            serde_json::to_value(&decoded.fields).unwrap(),
            fields,
            "{said:?}"
        );
        done.entry(tag).and_modify(|count| *count += 1);
    }
}
