//! Constructors of hellos, proposals and decisions.

use serde_json::json;

use super::message::WireMessage;

pub(crate) const ASKS: u8 = 1;
pub(crate) const FORMS: u8 = 2;
pub(crate) const FRESH: u8 = 4;
pub(crate) const READY: u8 = 8;
pub(crate) const FLIES: u8 = 16;
pub(crate) const WHOLE: u8 = 32;
pub(crate) const REFUSED: u8 = 64;

/// Returns the identifier of the membership view with `number` that `node` proposed.
pub(crate) const fn id(number: u32, node: u16) -> u32 {
    number << 10 | node as u32
}

/// Returns the number of a membership view that is added to the mission digest in this view's messages.
pub(crate) fn mark(view: u32) -> u16 {
    let low = view & 0xFFFF;
    let (top, next) = (view >> 24, view >> 16 & 0xFF);
    u16::try_from((low + (next << 8) + top) & 0xFFFF).unwrap()
}

/// Remaining lease that a relay states just after its start: `dead_after`, in units of 0.1 s. Other relays may rely on the agreement for
/// that long.
pub(crate) const RELIED: u16 = 150;

/// Returns the proposal of view `view`, as the relay at place `place` of the chain forwards it. A view is the agreed
/// membership of the chain. All relays up to this one have booted and voted for the view.
pub(crate) fn proposed(
    view: u32,
    (mission, version): (u16, u16),
    place: u16,
    relays: u16,
) -> WireMessage {
    let fields = json!({
        "mission": mission, "version": version, "proposed_view": view, "place": place,
        "agreed_view": 0, "agreed_relays": relays, "votes": place.min(relays), "lease_left_ds": RELIED,
        "earlier_lease_left_ds": 0, "proposer": true, "successor": null,
    });
    WireMessage::new("Proposal", &fields)
}

/// Returns the decision that accepts a proposed membership view of `relays` relays. The relay at place `place` of the
/// chain sends it. The view's positions may be used at once. `of` is the digest and the version of the view's mission.
pub(crate) fn granted(view: u32, of: (u16, u16), place: u16, relays: u16) -> WireMessage {
    let accepted = json!({ "view": view, "relays": relays });
    let changes = json!({ "base_relays": relays, "accepted": accepted });
    refused(view, of, place, relays).with(changes)
}

/// Returns the decision with which the relay at place `place` of the chain refuses a membership view.
///
/// The reason for the refusal is that only `there` of the eight relays have voted for the view.
pub(crate) fn refused(
    view: u32,
    (mission, version): (u16, u16),
    place: u16,
    there: u16,
) -> WireMessage {
    let fields = json!({
        "mission": mission, "version": version, "proposed_view": view, "place": place,
        "base_view": 0, "base_relays": 8, "accepted": null, "reached": there, "usable_in_ds": 0,
    });
    WireMessage::new("Decision", &fields)
}

/// Returns the hello of a node in membership view 0 that receives no other node.
///
/// `holds` has the digest and the version of the mission that the node has stored.
pub(crate) fn hello(mission: u16, neighbour: u16, holds: (u16, u16), flags: u8) -> WireMessage {
    let (digest, version) = holds;
    let fields = json!({
        "mission": mission, "neighbour": neighbour, "behind": 1, "latest_view": 0, "latest_mission": digest,
        "latest_mission_version": version, "offer_number": 0, "hears": 0, "flags": flags,
    });
    WireMessage::new("Hello", &fields)
}

/// Returns the hello of a node that uses the mission from before flight and receives no other node.
///
/// `newest` is the newest membership view that it knows.
pub(crate) fn loaded_hello(newest: u32, mission: u16, neighbour: u16, flags: u8) -> WireMessage {
    let hello = hello(mission, neighbour, (mission, 0), flags | FLIES);
    hello.with(json!({ "latest_view": newest }))
}

/// Returns a copy of a hello with other values for received nodes and connected relays.
///
/// Bit 0 of `hears` is the nearest node. `behind` is the number of relays that are connected in the direction away from
/// the destination, the sender included.
pub(crate) fn with_neighbours(hears: u8, behind: u16, hello: &WireMessage) -> WireMessage {
    hello.with(json!({ "hears": hears, "behind": behind }))
}
