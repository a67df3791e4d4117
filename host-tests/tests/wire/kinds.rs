//! Messages of each kind, and missions in which a relay receives them.

use host_tests::fixtures::paper;
use host_tests::make;
use serde_json::json;
use uav_relay::{Field, FieldPoint, Interference, MissionConfig, Port, Wiring};

use super::bench::Bench;
use super::message::WireMessage;
use super::offer::upload;
use super::votes::{FLIES, granted, id, loaded_hello, proposed};

const fn at(x_m: f32, upsilon_per_w: f32) -> FieldPoint {
    FieldPoint { x_m, upsilon_per_w }
}

/// Field of interference (Upsilon = E[1/I] along x) with a target SIR that eight relays can meet.
pub(crate) const FIELD: Field = Field::new(&[at(-100.0, 1e8), at(500.0, 3e7), at(900.0, 2e8)]);

/// Field of interference that is as weak as the format permits.
pub(crate) const WEAK: Field = Field::new(&[at(0.0, 1e32)]);

/// Field of interference from the weakest to the strongest that the format permits.
pub(crate) const WILD: Field = Field::new(&[at(0.0, 1e32), at(1000.0, 1e-9)]);

/// Number of a leader's first pass (a round of messages along the chain) in the tests.
pub(crate) const FIRST: u16 = 64;
/// Number of a leader's second pass (a round of messages along the chain) in the tests.
pub(crate) const SECOND: u16 = 65;

/// Returns the paper's scenario with the given interference. Altitudes are 20 m to 300 m, lateral offsets -60 m to 40
/// m.
pub(crate) fn mission(interference: Interference) -> MissionConfig {
    MissionConfig {
        interference,
        band: make::band(20.0, 300.0),
        lateral: make::band(-60.0, 40.0),
        ..paper(8)
    }
}

/// Returns the paper's scenario with its interferer. Altitudes are 20 m to 300 m, and lateral offsets are permitted.
pub(crate) fn source() -> MissionConfig {
    mission(paper(8).interference)
}

/// Returns one message of each tag, in the order of the tags.
///
/// Messages that travel along the chain have the number `number`. All digests in the messages are `mission`, also the
/// digests of the view and of the line.
pub(crate) fn one_of_each(number: u16, mission: u16) -> Vec<WireMessage> {
    let pass = json!({ "number": number, "view_digest": mission });
    let of = |name: &str, more: serde_json::Value| {
        let mut fields = pass.clone();
        let more = more.as_object().unwrap().clone();
        fields.as_object_mut().unwrap().extend(more);
        WireMessage::new(name, &fields)
    };
    let sweep = |name: &str, extra: &str, number: f64| {
        let mut more = json!({
            "anchor": 1.0, "gap": 0, "growth": 0, "altitude_m": 20.0, "power_w": 1.0, "reach_m": [400.0],
        });
        if !extra.is_empty() {
            more[extra] = number.into();
        }
        of(name, more)
    };
    let gather = |name: &str, relay: u16| {
        let seat = json!({ "relay": relay, "altitude_m": 30.0, "power_w": 0.5 });
        of(name, json!({ "after": 0, "seats": [seat] }))
    };
    // Measurements of two relays, and an estimate of the source that all relays have in common.
    let heard = json!({
        "estimate_number": 1, "estimate": 4, "source_power_w": 62.5, "source_x_m": 600.0, "source_y_m": -250.0,
        "source_at_rx_w": 1e-6, "sum_ab": [2, 0, 0, 0, 0, 0, 0, 0, 0, 0], "sum_av": [0, 0, 0, 0], "sum_vv": 0.5,
        "places": 2, "measurements": 64, "age_s": 3, "rx_power_w": 1e-6, "rx_measurements": 32, "excluded": 0,
    });
    let token = json!({
        "x_m": 400.0, "altitude_m": 20.0, "power_w": 1.0, "turn": 2, "explore_m": 10.0, "columns": 0, "rows": 0,
        "sir": 1.0,
    });
    let moved = json!({
        "x_m": 600.0, "altitude_m": 20.0, "position_changed": true, "worst_sir": 1.0, "power_w": 1.0,
    });
    let verdict = json!({ "own": false, "commit": 0, "slack_m": [1.0], "required_x_m": null });
    let fence = json!({
        "association": 1, "line_digest": mission, "echo": 0, "number": 1, "x_m": 400.0, "target_m": 400.0, "y_m": 1.0,
        "altitude_m": 1.0, "apart_m": 1.0, "flags": 3,
    });
    let view = id(u32::from(number).max(1), 1);
    vec![
        sweep("Sweep", "", 0.0),
        of("Verdict", verdict),
        WireMessage::new("Busy", &json!({ "number": number })),
        beat(mission, 0, 0),
        sweep("Measured", "upsilon_per_w", 1e8),
        sweep("Aside", "y_m", -12.5),
        gather("Gather", 3),
        gather("Gathered", 5),
        of("Token", token),
        of("Moved", moved),
        loaded_hello(view, mission, 4, FLIES).with(json!({ "hears": 1 })),
        proposed(view, (mission, 0), 3, 8),
        granted(view, (mission, 0), 5, 8),
        WireMessage::new("Fence", &fence),
        upload(2, mission),
        of(
            "Pulse",
            json!({ "lease_ds": 150, "in_place": false, "leavers": [], "joiners": [] }),
        ),
        of(
            "Pulsed",
            json!({ "in_place": false, "done": true, "requests": [], "spares": [] }),
        ),
        of("Sense", heard.clone()),
        of("Sensed", heard),
        level(mission),
        // The echo of a claim to the receiver's number.
        claim(1, 0, 2),
        WireMessage::new("Watch", &json!({ "number": number, "mission": mission })),
        WireMessage::new(
            "Report",
            &json!({ "number": number, "mission": mission, "detail": null, "entries": [] }),
        ),
    ]
}

/// Returns a heartbeat with the numbers of its request and of its reply; 0 for none.
pub(crate) fn beat(mission: u16, ask: u16, answer: u16) -> WireMessage {
    let fields = json!({ "mission": mission, "request": ask, "reply": answer });
    WireMessage::new("Heartbeat", &fields)
}

/// Returns an interference report as a ground station sends it.
pub(crate) fn level(mission: u16) -> WireMessage {
    WireMessage::new("Level", &json!({ "mission": mission, "power_w": 1e-9 }))
}

/// Returns the index claim `number`, by a node that has received a claim with the number `other`.
pub(crate) fn claim(number: u32, other: u32, flags: u8) -> WireMessage {
    let fields = json!({ "number": number, "other_number": other, "flags": flags });
    WireMessage::new("Claim", &fields)
}

/// Returns relay 4 of 8, and two ports for messages along the chain: to receive and to forward them.
pub(crate) fn relay_4(config: MissionConfig) -> (Bench, Port, Port) {
    let bench = Bench::of(config, 4, Wiring::Pair);
    let (from, to) = ways(config.interference);
    (bench, from, to)
}

/// Returns a relay's two ports for messages along the chain: to receive and to forward them.
pub(crate) fn ways(interference: Interference) -> (Port, Port) {
    match interference {
        Interference::Source(_) | Interference::Unknown => (Port::Upstream, Port::Downstream),
        Interference::Field(_) => (Port::Downstream, Port::Upstream),
    }
}

/// Gives the relay a position. Delivers the sweep message `number` at the port `from`, and then its result at `to`.
pub(crate) fn place(bench: &mut Bench, (from, to): (Port, Port), number: u16) {
    let kinds = one_of_each(number, bench.mission);
    bench.receive(from, &kinds[0]);
    bench.receive(to, &kinds[1]);
    bench.events();
    assert!(bench.setpoint().is_some());
}
