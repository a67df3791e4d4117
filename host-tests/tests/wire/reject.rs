//! Refusals in spite of a valid CRC: versions, bodies, ranges; `document.rs` tests the document's rows.

use uav_relay::wire::frame::{self, FrameError};
use uav_relay::wire::message::MessageError;

use super::bodies::{
    ENCODING, HEADER, VALUE, assert_ranges, assert_refused_cut_and_longer, assert_refused_padded,
    single, verdict_on, with, zeros,
};
use super::codec::{
    Call, Decided, Greeting, Handed, Judged, Proposed, Said, Shifted, SizedView, Swept, plain,
    sealed,
};
use super::golden::vectors;
use super::offer::offer;

pub(crate) fn sweep() -> Said {
    Said::Sweep(Swept {
        gap: 100,
        growth: 2,
        reaches: vec![100.0, 50.0],
        ..single(1.5)
    })
}

pub(crate) fn verdict(commit: Option<u8>, slacks: &[f32]) -> Said {
    Said::Verdict(Judged {
        number: 1,
        mission: 2,
        own: false,
        commit,
        slacks: slacks.to_vec(),
        stand: None,
    })
}

/// Returns a verdict with a position, at offset 10.
pub(crate) fn stood(x_m: f32) -> Said {
    Said::Verdict(Judged {
        number: 1,
        mission: 2,
        own: false,
        commit: Some(0),
        slacks: Vec::new(),
        stand: Some(x_m),
    })
}

pub(crate) fn measured() -> Said {
    Said::Measured {
        sweep: single(1.5),
        upsilon_per_w: 1e9,
    }
}

pub(crate) fn token(turn: u8, explore_m: f32, columns: u8, rows: u8) -> Said {
    Said::Token(Handed {
        number: 1,
        mission: 2,
        x_m: 100.0,
        altitude_m: 20.0,
        power_w: 1.0,
        turn,
        explore_m,
        columns,
        rows,
        sir: 1.5,
    })
}

pub(crate) fn moved() -> Said {
    Said::Moved(Shifted {
        number: 1,
        mission: 2,
        x_m: 100.0,
        altitude_m: 20.0,
        any: false,
        worst: 1.5,
    })
}

pub(crate) const HELLO: Greeting = Greeting {
    mission: 2,
    neighbour: 1,
    behind: 1,
    newest: 0,
    holds: (2, 0),
    nonce: 0,
    hears: 0,
    flags: 0,
};

/// First view proposed by node 1.
pub(crate) const VIEW: SizedView = SizedView {
    id: 0x0401,
    relays: 1,
};

pub(crate) const CALL: Call = Call {
    of: (2, 0),
    view: VIEW.id,
    place: 1,
};

/// Next view of node 1000, the largest that may propose.
pub(crate) const PROPOSAL: Proposed = Proposed {
    call: Call {
        view: 0x0BE8,
        ..CALL
    },
    agreed: VIEW,
    votes: 0,
    lease_left: 0,
    rest: 0,
    proposer: false,
    successor: Some((VIEW.id, VIEW)),
};

pub(crate) const DECISION: Decided = Decided {
    call: PROPOSAL.call,
    base: VIEW,
    view: Some(VIEW),
    there: 1,
    lease_left: 0,
};

const NO_MESSAGE: FrameError = FrameError::Message(MessageError::Encoding);

#[test]
fn other_versions_and_flags_are_refused_before_the_body_is_read() {
    let good = plain(HEADER, &sweep().body());
    for nibble in 0..=15_u8 {
        for at in [1, 3] {
            let mut bad = good[..good.len() - 4].to_vec();
            bad[at] = bad[at] & 0x0F | nibble << 4;
            // With a tag the last bytes are not the body's, and a handshake is no message.
            let (read, short) = match (at, nibble) {
                (1, 1) | (3, 0) => (Ok(()), NO_MESSAGE),
                (3, 1 | 3) => (Err(NO_MESSAGE), FrameError::Short),
                _ => (Err(FrameError::Version), FrameError::Version),
            };
            let whole = sealed(bad.clone());
            assert_eq!(frame::decode(&whole).map(|_| ()), read, "{at}: {nibble}");
            bad.truncate(10);
            bad.push(0xFF);
            assert_eq!(frame::decode(&sealed(bad)), Err(short), "{at}: {nibble}");
        }
    }
}

#[test]
fn bodies_that_are_no_message_are_refused() {
    for vector in vectors().frames {
        let body = vector.message.body();
        assert_refused_cut_and_longer(&body, &vector.name);
        for tag in 21..=u8::MAX {
            let mut other = body.clone();
            other[0] = tag;
            assert_eq!(verdict_on(&other), ENCODING, "{}", vector.name);
        }
    }
    let pulsed = [16, 0, 0, 0, 0];
    let verdict_head = [1, 0, 0, 0, 0];
    let option = [1, 0, 0, 0, 0, 0];
    for byte in 2..=u8::MAX {
        let bool_byte = [&pulsed[..], &[byte]].concat();
        assert_eq!(verdict_on(&bool_byte), ENCODING, "bool {byte}");
        let option_byte = [&option[..], &[byte, 0, 0]].concat();
        assert_eq!(verdict_on(&option_byte), ENCODING, "Option {byte}");
        let option_byte = [&option[..], &[byte, 0, 0, 0]].concat();
        assert_eq!(verdict_on(&option_byte), ENCODING, "Option {byte}");
        for stand in [verdict(None, &[]), stood(1.0)] {
            let mut option_byte = stand.body();
            let at = if option_byte[6] == 0 { 8 } else { 9 };
            option_byte[at] = byte;
            assert_eq!(verdict_on(&option_byte), ENCODING, "stand {byte}");
        }
        let bool_byte = [&verdict_head[..], &[byte, 0, 0, 0]].concat();
        assert_eq!(verdict_on(&bool_byte), ENCODING, "bool {byte}");
        let mut bool_byte = moved().body();
        bool_byte[13] = byte;
        assert_eq!(verdict_on(&bool_byte), ENCODING, "bool {byte}");
        for (mut body, at) in [
            (Said::Proposal(PROPOSAL).body(), 23),
            (Said::Proposal(PROPOSAL).body(), 24),
            (Said::Decision(DECISION).body(), 17),
        ] {
            body[at] = byte;
            assert_eq!(verdict_on(&body), ENCODING, "tag {}, {at}", body[0]);
        }
    }
    for count in 17..=127_u8 {
        let mut slacks = zeros(verdict(None, &[]).body(), 7, count);
        slacks.push(0);
        let reaches = zeros(sweep().body(), 19, count);
        let measured = zeros(measured().body(), 23, count);
        for body in [slacks, reaches, measured] {
            assert_eq!(verdict_on(&body), ENCODING, "{count} of tag {}", body[0]);
        }
    }
}

#[test]
fn padded_varints_are_refused() {
    let bodies = [
        sweep().body(),
        verdict(None, &[]).body(),
        verdict(Some(1), &[2.0, 1.0]).body(),
        measured().body(),
    ];
    for body in bodies {
        assert_refused_padded(&body, true);
    }
    for body in [
        Said::Busy { number: 9 }.body(),
        vec![3, 0, 0, 1, 0, 0, 0],
        token(0, 0.0, 0, 0).body(),
        moved().body(),
        Said::Hello(HELLO).body(),
        Said::Proposal(PROPOSAL).body(),
        Said::Decision(DECISION).body(),
        vec![15, 0, 0, 0, 0, 1, 0],
        vec![16, 0, 0, 0, 0, 1],
        Said::Offer(offer()).body(),
    ] {
        assert_refused_padded(&body, false);
    }
}

#[test]
fn numbers_are_accepted_up_to_their_bounds_and_no_farther() {
    let plain = Said::Sweep(single(-1.5));
    let single = Said::Sweep(single(1.5));
    let slack = verdict(None, &[1.0]);
    let stood = stood(1.0);
    let (measured, moved) = (measured(), moved());
    let token = token(2, 10.0, 5, 5);
    assert_ranges(&[
        (&single, 5, f32::MIN_POSITIVE, f32::MAX, "anchor"),
        (&plain, 5, f32::MIN, -f32::MIN_POSITIVE, "anchor, plain"),
        (&single, 11, 0.1, 1e5, "altitude"),
        (&single, 15, 1e-6, 1e6, "power"),
        (&single, 20, 0.0, 2e9, "reach"),
        (&slack, 8, -2e9, 2e9, "slack"),
        (&stood, 10, 0.0, 1e6, "stand"),
        (
            &measured,
            5,
            f32::MIN_POSITIVE,
            f32::MAX,
            "anchor, measured",
        ),
        (&measured, 11, 0.1, 1e5, "altitude, measured"),
        (&measured, 15, 1e-6, 1e6, "power, measured"),
        (&measured, 19, 1e-9, 1e32, "Upsilon"),
        (&measured, 24, 0.0, 2e9, "reach, measured"),
        (&token, 5, 0.0, 1e6, "x of a token"),
        (&token, 9, 0.1, 1e5, "altitude of a token"),
        (&token, 13, 1e-6, 1e6, "power of a token"),
        (&token, 18, 0.0, 1e5, "how far"),
        (&token, 24, 0.0, f32::MAX, "SIR"),
        (&moved, 5, 0.0, 1e6, "x of one that moved"),
        (&moved, 9, 0.1, 1e5, "altitude of one that moved"),
        (&moved, 14, 0.0, f32::MAX, "worst"),
    ]);
}

#[test]
fn ladders_that_leave_the_normal_numbers_are_refused() {
    let ladder = |anchor: f32, gap: u8, growth: u8| {
        let mut body = with(&sweep(), 5, anchor);
        body[9..11].copy_from_slice(&[gap, growth]);
        verdict_on(&body)
    };
    // The ladder of a plain pass is that of the positive anchor.
    for sign in [1.0, -1.0] {
        let ladder = |anchor: f32, gap, growth| ladder(sign * anchor, gap, growth);
        assert_eq!(ladder(1.5, 100, 2), Ok(()));
        assert_eq!(ladder(1.0, 255, 255), VALUE, "overflows");
        assert_eq!(ladder(f32::MAX, 1, 0), VALUE, "overflows at the top");
        assert_eq!(ladder(f32::MIN_POSITIVE, 200, 0), VALUE, "underflows");
        assert_eq!(ladder(1e-30, 255, 0), VALUE, "underflows");
        for anchor in [0.0, f32::NAN, f32::INFINITY, f32::from_bits(1)] {
            assert_eq!(ladder(anchor, 100, 2), VALUE, "{anchor}");
        }
    }
}

#[test]
fn a_sweep_has_no_more_reaches_than_targets_and_a_single_target_no_growth() {
    let single = |growth, count: u8| {
        let mut body = sweep().body();
        body[9..11].copy_from_slice(&[0, growth]);
        verdict_on(&zeros(body, 19, count))
    };
    assert_eq!(single(0, 0), Ok(()));
    assert_eq!(single(0, 1), Ok(()));
    for count in 2..=16 {
        assert_eq!(single(0, count), VALUE, "{count} reaches");
    }
    for growth in 1..=u8::MAX {
        assert_eq!(single(growth, 1), VALUE, "growth {growth}");
    }
}

#[test]
fn a_commit_names_one_of_sixteen_targets() {
    for target in 0..=u8::MAX {
        let read = verdict_on(&verdict(Some(target), &[]).body());
        assert_eq!(read.is_ok(), target < 16, "{target}");
    }
}
