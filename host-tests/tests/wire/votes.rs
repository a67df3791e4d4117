//! Hellos, proposals and decisions to write, and what a relay says in return.

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

/// What node `sender` says to node `destination`, on network 7.
pub(crate) fn between(sender: u16, destination: u16, said: &Said) -> Vec<u8> {
    let header = Header {
        network: NETWORK,
        sender,
        destination,
        counter: 0,
    };
    wire(&plain(header, &said.body()))
}

/// The view of that number which `node` proposes.
pub(crate) const fn id(number: u32, node: u16) -> u32 {
    number << 10 | node as u32
}

/// What a view adds to the digest of the mission that it flies.
pub(crate) fn mark(view: u32) -> u16 {
    let low = view & 0xFFFF;
    let (top, next) = (view >> 24, view >> 16 & 0xFF);
    u16::try_from((low + (next << 8) + top) & 0xFFFF).unwrap()
}

/// How long a relay that has just been switched on may be relied on, in tenths of a second: for `dead_after`.
pub(crate) const RELIED: u16 = 150;

/// What the relay at `place` hands on of a proposal of `view`, where all up to there have just been switched on and are members of
/// the chain of `relays` as it was loaded.
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

/// The decision for the view that was proposed, of so many relays, whose places are to be taken at once.
pub(crate) fn granted(view: u32, of: (u16, u16), place: u16, relays: u16) -> Said {
    Said::Decision(Decided {
        call: Call { of, view, place },
        base: SizedView { id: 0, relays },
        view: Some(SizedView { id: view, relays }),
        there: relays,
        lease_left: 0,
    })
}

/// The decision that `there` of eight relays are too few.
pub(crate) fn refused(view: u32, of: (u16, u16), place: u16, there: u16) -> Said {
    Said::Decision(Decided {
        call: Call { of, view, place },
        base: SizedView { id: 0, relays: 8 },
        view: None,
        there,
        lease_left: 0,
    })
}

/// The hello of a node that hears nobody, flies the mission that was loaded before flight, and has no other.
pub(crate) fn a_hello(newest: u32, mission: u16, neighbour: u16, flags: u8) -> Said {
    Said::Hello(Greeting {
        mission,
        neighbour,
        behind: 1,
        newest,
        holds: (mission, 0),
        nonce: 0,
        hears: 0,
        flags: flags | FLIES,
    })
}

/// The same hello of a node that hears these, bit 0 for the nearest.
pub(crate) fn hearing(hears: u8, said: Said) -> Said {
    match said {
        Said::Hello(greeting) => Said::Hello(Greeting { hears, ..greeting }),
        other => other,
    }
}

/// The same hello of a node from which so many relays hang together on, itself included.
pub(crate) fn long(behind: u16, said: Said) -> Said {
    match said {
        Said::Hello(greeting) => Said::Hello(Greeting { behind, ..greeting }),
        other => other,
    }
}

/// What a relay with a key says, but for the number of a hello, which is never 0 there.
pub(crate) fn unnumbered(mut said: Said) -> Said {
    if let Said::Hello(greeting) = &mut said {
        assert_ne!(greeting.nonce, 0);
        greeting.nonce = 0;
    }
    said
}

/// What `relay` sends at `now` or a millisecond later.
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

/// The one message that `relay` sends at `now`.
pub(crate) fn only(relay: &mut Relay, now: Instant) -> (Port, Said) {
    let mut out = sent(relay, now);
    let said = out.pop().unwrap();
    assert!(out.is_empty(), "{out:?}");
    said
}
