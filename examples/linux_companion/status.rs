//! State and counters of a relay as one JSON object.

use serde_json::{Value, json};
use uav_relay::{Placement, Relay, Side, SlotShares};
use uav_relay_linux::counters::counted;

use crate::hold_reasons;
use crate::lost::Lost;

pub(crate) fn at(place: Placement) -> Value {
    json!({ "x_m": place.x_m, "y_m": place.y_m, "altitude_m": place.altitude_m })
}

/// Returns begin and end of the relay's fitted time slots as JSON.
///
/// The values are fractions of the frame, which is the period of all slots.
pub(crate) fn slots(of: SlotShares) -> Value {
    json!({
        "from_tx": of.from_tx, "to_rx": of.to_rx, "from_rx": of.from_rx, "to_tx": of.to_tx,
        "bits_per_hz": of.bits_per_hz,
    })
}

/// Returns the relay's state as JSON. `index` is the relay's number at the start.
pub(crate) fn of_relay(
    relay: &Relay,
    index: u16,
    lost: &Lost,
    name: impl Fn(u16) -> String,
) -> Value {
    let [upstream, downstream] = relay
        .neighbours()
        .map(|node| node.map(|node| json!({ "node": node, "name": name(node) })));
    json!({
        "index": index,
        "place": relay.index(),
        "relays": relay.mission().relays(),
        "view": relay.view().number(),
        "version": relay.version(),
        "setpoint": relay.setpoint().map(at),
        "target_sir": relay.target(),
        "slots": relay.slot_shares().map(slots),
        "transmitter_w": relay.level_w(Side::Upstream),
        "receiver_w": relay.level_w(Side::Downstream),
        "is_passive": relay.is_passive(),
        "ready": relay.is_ready(),
        "waits": hold_reasons::reasons(relay).map(|reason| reason.map(hold_reasons::word)),
        "lost": lost.nodes(),
        "has_lease": relay.lease().is_some(),
        "upstream": upstream,
        "downstream": downstream,
        "counters": counted(relay.stats()),
    })
}
