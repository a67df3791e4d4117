//! Constructors of hellos, proposals and decisions, and a relay's responses.

use host_tests::fixtures::NETWORK;
use uav_relay::wire::frame::Header;
use uav_relay::{Duration, Event, Instant, Port, Relay};

use super::codec::{Call, Decided, Greeting, Proposed, Said, SizedView, plain, wire};
use super::kinds::sent;

pub(crate) const ASKS: u8 = 1;
pub(crate) const FORMS: u8 = 2;
pub(crate) const FRESH: u8 = 4;
pub(crate) const READY: u8 = 8;
pub(crate) const FLIES: u8 = 16;
pub(crate) const WHOLE: u8 = 32;
pub(crate) const REFUSED: u8 = 64;

/// Encodes a frame of node `sender` to node `destination`, on network 7.
pub(crate) fn between(sender: u16, destination: u16, said: &Said) -> Vec<u8> {
    let header = Header {
        network: NETWORK,
        sender,
        destination,
        counter: 0,
    };
    wire(&plain(header, &said.body()))
}

/// Returns the identifier of view `number` proposed by `node`.
pub(crate) const fn id(number: u32, node: u16) -> u32 {
    number << 10 | node as u32
}

/// Returns a view's contribution to the digest of its mission.
pub(crate) fn mark(view: u32) -> u16 {
    let low = view & 0xFFFF;
    let (top, next) = (view >> 24, view >> 16 & 0xFF);
    u16::try_from((low + (next << 8) + top) & 0xFFFF).unwrap()
}

/// Time for which a booted relay may be relied on, in tenths of a second: `dead_after`.
pub(crate) const RELIED: u16 = 150;

/// Returns the proposal of `view` forwarded at `place`, with votes of all booted relays up to there.
pub(crate) fn proposed(view: u32, of: (u16, u16), place: u16, relays: u16) -> Proposed {
    Proposed {
        call: Call { of, view, place },
        agreed: SizedView { id: 0, relays },
        votes: place,
        lease_left: RELIED,
        rest: 0,
        proposer: true,
        successor: None,
    }
}

/// Returns the decision for the proposed view of `relays`, whose positions may be used at once.
pub(crate) fn granted(view: u32, of: (u16, u16), place: u16, relays: u16) -> Said {
    Said::Decision(Decided {
        call: Call { of, view, place },
        base: SizedView { id: 0, relays },
        view: Some(SizedView { id: view, relays }),
        reached: relays,
        usable_in: 0,
    })
}

/// Returns the decision that `there` of eight relays are too few.
pub(crate) fn refused(view: u32, of: (u16, u16), place: u16, there: u16) -> Said {
    Said::Decision(Decided {
        call: Call { of, view, place },
        base: SizedView { id: 0, relays: 8 },
        view: None,
        reached: there,
        usable_in: 0,
    })
}

/// Returns the hello of a node that receives no others and holds and flies the loaded mission.
pub(crate) fn a_hello(newest: u32, mission: u16, neighbour: u16, flags: u8) -> Said {
    Said::Hello(Greeting {
        mission,
        neighbour,
        behind: 1,
        latest_view: newest,
        latest_mission: (mission, 0),
        offer_number: 0,
        hears: 0,
        flags: flags | FLIES,
    })
}

/// Sets the nodes that a hello's sender receives, bit 0 for the nearest.
pub(crate) fn hearing(hears: u8, said: Said) -> Said {
    match said {
        Said::Hello(greeting) => Said::Hello(Greeting { hears, ..greeting }),
        other => other,
    }
}

/// Changes a hello to one with `behind` connected relays, the sender included.
pub(crate) fn long(behind: u16, said: Said) -> Said {
    match said {
        Said::Hello(greeting) => Said::Hello(Greeting { behind, ..greeting }),
        other => other,
    }
}

/// Removes a hello's number, which is never 0 at a relay with a key.
pub(crate) fn unnumbered(mut said: Said) -> Said {
    if let Said::Hello(greeting) = &mut said {
        assert_ne!(greeting.offer_number, 0);
        greeting.offer_number = 0;
    }
    said
}

/// Returns the messages that `relay` sends at `now` or a millisecond later.
pub(crate) fn soon(relay: &mut Relay, now: Instant) -> Vec<(Port, Said)> {
    let mut out = sent(relay, now);
    let later = now + Duration::from_millis(1);
    relay.handle_timeout(later);
    out.extend(sent(relay, later));
    out
}

pub(crate) fn events(relay: &mut Relay) -> Vec<Event> {
    std::iter::from_fn(|| relay.poll_event()).collect()
}

pub(crate) fn only(relay: &mut Relay, now: Instant) -> (Port, Said) {
    let mut out = sent(relay, now);
    let said = out.pop().unwrap();
    assert!(out.is_empty(), "{out:?}");
    said
}
