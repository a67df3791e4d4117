//! Golden vectors, both ways: `data/vectors.json`, made by a Python program of its own (bodies by the byte tables, those of
//! the tags 0 and 2 again by the postcard implementation pohlednice 0.2.1, CRC bit by bit, COBS by its definition, ladders
//! with each step rounded).

use serde::Deserialize;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::{MAX_BODY, Message};

use super::codec::{
    self, Call, Decided, Greeting, Handed, Heard, Judged, Proposed, Said, Shifted, SizedView, Swept,
};
use super::offer::Offer;

#[derive(Deserialize)]
pub(crate) struct Vectors {
    pub(crate) frames: Vec<Frame>,
    pub(crate) ladders: Vec<LadderVector>,
}

#[derive(Deserialize)]
pub(crate) struct Frame {
    pub(crate) name: String,
    header: Addresses,
    pub(crate) message: Said,
    body: String,
    plain: String,
    wire: String,
}

#[derive(Deserialize)]
struct Addresses {
    network: u16,
    sender: u16,
    destination: u16,
    counter: u32,
}

#[derive(Deserialize)]
pub(crate) struct LadderVector {
    anchor: String,
    gap: u8,
    growth: u8,
    pub(crate) targets: Vec<String>,
}

impl Frame {
    pub(crate) fn header(&self) -> Header {
        let Addresses {
            network,
            sender,
            destination,
            counter,
        } = self.header;
        Header {
            network,
            sender,
            destination,
            counter,
        }
    }

    pub(crate) fn plain(&self) -> Vec<u8> {
        bytes(&self.plain)
    }

    pub(crate) fn wire(&self) -> Vec<u8> {
        bytes(&self.wire)
    }
}

/// The vectors of the file.
pub(crate) fn vectors() -> Vectors {
    let vectors: Vectors = serde_json::from_str(include_str!("../data/vectors.json")).unwrap();
    assert!(vectors.frames.len() >= 69 && vectors.ladders.len() >= 10);
    vectors
}

/// The bytes that pairs of hexadecimal digits stand for.
pub(crate) fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u32> = hex
        .chars()
        .filter(|digit| !digit.is_whitespace())
        .map(|digit| digit.to_digit(16).unwrap())
        .collect();
    assert_eq!(digits.len() % 2, 0, "{hex}");
    digits
        .chunks(2)
        .map(|pair| u8::try_from(pair[0] << 4 | pair[1]).unwrap())
        .collect()
}

/// The one frame that the deframer finds in `wire`, at its last byte.
pub(crate) fn only_frame(wire: &[u8]) -> Vec<u8> {
    let mut deframer = Deframer::new();
    let (end, before) = wire.split_last().unwrap();
    for &byte in before {
        assert!(deframer.push(byte).is_none());
    }
    deframer.push(*end).unwrap().unwrap().to_vec()
}

#[test]
fn the_vectors_follow_from_the_rules() {
    for vector in vectors().frames {
        let name = &vector.name;
        assert_eq!(vector.message.body(), bytes(&vector.body), "{name}");
        let plain = codec::plain(vector.header(), &bytes(&vector.body));
        assert_eq!(plain, vector.plain(), "{name}");
        assert_eq!(codec::wire(&plain), vector.wire(), "{name}");
    }
}

#[test]
fn the_crate_writes_the_vectors() {
    for vector in vectors().frames {
        let name = &vector.name;
        let message = vector.message.message();
        let mut body = [0; MAX_BODY];
        let len = message.encode(&mut body).unwrap();
        assert_eq!(body[..len], bytes(&vector.body), "{name}");
        let mut frame = [0xAA; MAX_FRAME];
        let len = frame::encode(vector.header(), &message, &mut frame);
        assert_eq!(frame[..len], vector.wire(), "{name}");
        assert!(frame[len..].iter().all(|&byte| byte == 0xAA), "{name}");
    }
}

#[test]
fn the_crate_reads_the_vectors() {
    for vector in vectors().frames {
        let name = &vector.name;
        let body = bytes(&vector.body);
        let message = Message::decode(&body).unwrap();
        assert_eq!(message, vector.message.message(), "{name}");
        let plain = only_frame(&vector.wire());
        assert_eq!(plain, vector.plain(), "{name}");
        assert_eq!(
            frame::decode(&plain),
            Ok((vector.header(), message)),
            "{name}"
        );
    }
}

#[test]
#[expect(clippy::too_many_lines, reason = "a line or more for each message")]
fn the_vectors_hold_every_kind_and_every_extreme() {
    let frames = vectors().frames;
    let some = |what: fn(&Said) -> bool| {
        assert!(frames.iter().any(|vector| what(&vector.message)));
    };
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.reaches.len() == 16));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.gap == 0 && sweep.reaches.len() == 1));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.reaches.is_empty()));
    some(|said| matches!(said, Said::Sweep(Swept { gap: 255, .. })));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.anchor == f32::MIN_POSITIVE));
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.anchor == f32::MAX));
    some(
        |said| matches!(said, Said::Verdict(Judged { commit: None, slacks, .. }) if slacks.is_empty()),
    );
    some(
        |said| matches!(said, Said::Verdict(Judged { commit: Some(15), slacks, .. }) if slacks.len() == 16),
    );
    some(|said| matches!(said, Said::Busy { .. }));
    some(|said| {
        matches!(
            said,
            Said::Heartbeat {
                ask: 1..,
                answer: 0,
                ..
            }
        )
    });
    some(|said| {
        matches!(
            said,
            Said::Heartbeat {
                ask: 0,
                answer: 1..,
                ..
            }
        )
    });
    some(|said| {
        matches!(
            said,
            Said::Heartbeat {
                ask: u16::MAX,
                answer: u16::MAX,
                ..
            }
        )
    });
    some(|said| matches!(said, Said::Pulse { lease: 1, .. }));
    some(|said| {
        matches!(
            said,
            Said::Pulse {
                lease: u16::MAX,
                ..
            }
        )
    });
    some(|said| matches!(said, Said::Pulsed { done: true, .. }));
    some(|said| matches!(said, Said::Pulsed { done: false, .. }));
    some(|said| matches!(said, Said::Measured { sweep, .. } if sweep.reaches.len() == 16));
    some(|said| matches!(said, Said::Measured { upsilon_per_w, .. } if *upsilon_per_w == 1e-9));
    some(|said| matches!(said, Said::Measured { upsilon_per_w, .. } if *upsilon_per_w == 1e32));
    some(|said| matches!(said, Said::Aside { sweep, .. } if sweep.reaches.len() == 16));
    some(
        |said| matches!(said, Said::Aside { y_m, sweep } if *y_m == -1e5 && sweep.reaches.is_empty()),
    );
    some(|said| matches!(said, Said::Aside { y_m, .. } if *y_m == 1e5));
    for count in [0, 1, 8] {
        assert!(frames.iter().any(
            |vector| matches!(&vector.message, Said::Gather(seats) if seats.seats.len() == count)
        ));
        assert!(frames.iter().any(
            |vector| matches!(&vector.message, Said::Gathered(seats) if seats.seats.len() == count)
        ));
    }
    some(|said| matches!(said, Said::Gather(seats) if seats.after > 0));
    some(|said| matches!(said, Said::Gather(seats) if seats.seats.contains(&(1000, 1e5, 1e6))));
    some(|said| matches!(said, Said::Gathered(seats) if seats.seats.contains(&(1, 0.1, 1e-6))));
    some(
        |said| matches!(said, Said::Gathered(seats) if seats.seats.iter().any(|seat| seat.1 == 0.0)),
    );
    some(|said| matches!(said, Said::Sweep(sweep) if sweep.anchor < 0.0));
    some(|said| matches!(said, Said::Verdict(Judged { stand: None, .. })));
    some(|said| matches!(said, Said::Verdict(Judged { stand: Some(x_m), .. }) if *x_m == 0.0));
    some(|said| matches!(said, Said::Verdict(Judged { stand: Some(x_m), .. }) if *x_m == 1e6));
    some(|said| matches!(said, Said::Verdict(Judged { own: true, .. })));
    some(|said| matches!(said, Said::Verdict(Judged { own: false, .. })));
    some(|said| matches!(said, Said::Token(Handed { turn: 0, .. })));
    some(|said| matches!(said, Said::Token(Handed { turn: 1, .. })));
    some(|said| {
        matches!(
            said,
            Said::Token(Handed {
                turn: 2,
                columns: 0,
                ..
            })
        )
    });
    some(|said| {
        matches!(
            said,
            Said::Token(Handed {
                turn: 2,
                columns: 2,
                rows: 255,
                ..
            })
        )
    });
    some(|said| matches!(said, Said::Moved(Shifted { any: true, .. })));
    some(|said| matches!(said, Said::Moved(Shifted { worst, .. }) if *worst == f32::MAX));
    let longest = |of_four: bool| {
        let known = frames
            .iter()
            .filter(|vector| !of_four || bytes(&vector.body)[0] < 4);
        known.map(|vector| vector.wire().len()).max()
    };
    assert_eq!(longest(true), Some(100));
    assert_eq!(longest(false), Some(129));
}

#[test]
fn the_vectors_hold_every_hello_proposal_and_decision() {
    const MOST: SizedView = SizedView {
        id: u32::MAX - 0x17,
        relays: 1000,
    };
    const BEFORE: SizedView = SizedView {
        id: MOST.id - 1,
        ..MOST
    };
    const LAST: Call = Call {
        of: (u16::MAX, u16::MAX),
        view: MOST.id,
        place: 1000,
    };
    let frames = vectors().frames;
    let some = |what: fn(&Said) -> bool| {
        assert!(frames.iter().any(|vector| what(&vector.message)));
    };
    for flags in [0, 9, 21, 25, 27, 31] {
        assert!(
            frames
                .iter()
                .any(|vector| matches!(vector.message, Said::Hello(hello) if hello.flags == flags))
        );
    }
    some(|said| {
        matches!(said, Said::Hello(hello) if *hello == Greeting {
            mission: u16::MAX,
            neighbour: 1000,
            behind: 1000,
            newest: u32::MAX,
            holds: (u16::MAX, u16::MAX),
            nonce: u16::MAX,
            hears: 15,
            flags: 31,
        })
    });
    some(|said| matches!(said, Said::Hello(hello) if hello.holds.1 == 0 && hello.flags & 16 != 0));
    some(|said| matches!(said, Said::Hello(hello) if hello.holds.1 > 0 && hello.flags & 16 == 0));
    some(|said| matches!(said, Said::Hello(hello) if hello.hears == 5));
    some(
        |said| matches!(said, Said::Proposal(proposal) if proposal.agreed.id == 0 && !proposal.proposer),
    );
    some(|said| matches!(said, Said::Proposal(proposal) if proposal.successor.is_none()));
    some(|said| {
        matches!(said, Said::Proposal(proposal) if *proposal == Proposed {
            call: LAST,
            agreed: BEFORE,
            votes: 1000,
            lease_left: u16::MAX,
            rest: u16::MAX,
            proposer: true,
            successor: Some((BEFORE.id, BEFORE)),
        })
    });
    some(|said| matches!(said, Said::Hello(hello) if hello.behind == 1 && hello.nonce == 0));
    some(|said| matches!(said, Said::Proposal(proposal) if proposal.rest == 0));
    some(|said| matches!(said, Said::Decision(decision) if decision.view.is_none()));
    some(|said| matches!(said, Said::Decision(decision) if decision.base.id == 0));
    some(|said| {
        matches!(
            said,
            Said::Decision(Decided { call, view: Some(view), .. }) if view.id != call.view
        )
    });
    some(|said| {
        matches!(said, Said::Decision(decision) if *decision == Decided {
            call: LAST,
            base: BEFORE,
            view: Some(MOST),
            there: 1000,
            lease_left: u16::MAX,
        })
    });
}

#[test]
fn the_vectors_hold_offers_of_every_extreme() {
    let frames = vectors().frames;
    let some = |what: fn(&Offer) -> bool| {
        assert!(
            frames
                .iter()
                .any(|vector| matches!(&vector.message, Said::Offer(offer) if what(offer)))
        );
    };
    some(|offer| offer.version == 1 && offer.relays == 1 && offer.distance_m == 1.0);
    some(|offer| offer.version == u16::MAX && offer.relays == 1000 && offer.distance_m == 1e6);
    some(|offer| offer.mu_los == 1e30 && offer.mu_nlos == 1e50);
    some(|offer| offer.mu_los == 1e-3 && offer.mu_nlos == offer.eta);
    some(|offer| offer.least_m < offer.most_m && offer.eta < offer.mu_nlos);
    some(|offer| offer.least_m == offer.most_m && offer.eta > offer.mu_los);
    some(|offer| offer.x_m < 0.0 && offer.interferer_w == 1e-6);
    some(|offer| offer.y_m < 0.0 && offer.interferer_w == 1e9);
    some(|offer| offer.left_m == -1e5 && offer.right_m == 1e5);
    some(|offer| offer.left_m == 0.0 && offer.right_m == 0.0);
    some(|offer| offer.left_m < 0.0 && offer.right_m == 0.0);
    some(|offer| offer.noise_w > 0.0);
    some(|offer| [offer.interferer_w, offer.x_m, offer.y_m] == [0.0; 3]);
    some(|offer| offer.sites == [0; 6]);
    some(|offer| offer.sites[..3] == [900_000_000, 1_800_000_000, i32::MAX]);
    some(|offer| offer.sites[3..] == [-900_000_000, -1_800_000_000, i32::MIN]);
    some(|offer| offer.sites[..3] != offer.sites[3..]);
    some(|offer| offer.answer == 0);
    some(|offer| offer.answer == u16::MAX);
}

#[test]
fn the_vectors_hold_hearings_of_every_belief_and_extreme() {
    let frames = vectors().frames;
    let some = |what: fn(&Heard) -> bool| {
        assert!(frames.iter().any(|vector| match &vector.message {
            Said::Sense(heard) | Said::Sensed(heard) => what(heard),
            _ => false,
        }));
    };
    some(|heard| heard.kind == 0 && heard.told == 0);
    some(|heard| heard.kind == 1);
    some(|heard| heard.kind == 2);
    some(|heard| heard.kind == 3);
    some(|heard| heard.kind == 4 && heard.source == [1e9, 1e7, -1e7, 1e6]);
    some(|heard| heard.kind == 4 && heard.source == [1e-6, -1e7, 1e7, 1e-30]);
    some(|heard| heard.kind == 4 && heard.source[3] == 0.0);
    some(|heard| heard.sums == [0.0; 18]);
    some(|heard| heard.sums.map(f32::abs) == [f32::MAX; 18] && heard.sums[2] < 0.0);
    // Each in its place.
    some(|heard| {
        let mut sums = heard.sums.map(f32::to_bits);
        sums.sort_unstable();
        sums.windows(2).all(|two| two[0] < two[1])
    });
    some(|heard| heard.receiver == [1e6, 1e9] && heard.off == 4094);
    some(|heard| heard.receiver[0] == 1e-30);
    some(|heard| heard.receiver == [0.0, 0.0] && heard.off == 0);
}

#[test]
fn the_ladders_of_the_file_are_met_to_the_bit() {
    for vector in vectors().ladders {
        let anchor = f32::from_bits(u32::from_str_radix(&vector.anchor, 16).unwrap());
        let ladder = Ladder::from_parts(anchor, vector.gap, vector.growth).unwrap();
        let hex = |targets: &[f32]| -> Vec<String> {
            let bits = targets.iter().map(|target| target.to_bits());
            bits.map(|bits| format!("{bits:08x}")).collect()
        };
        assert_eq!(hex(&ladder.targets()), vector.targets);
        let by_the_rules = codec::targets(anchor, vector.gap, vector.growth);
        assert_eq!(hex(&by_the_rules), vector.targets);
    }
}
