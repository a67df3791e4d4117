//! Valid values of turns, views and lease renewals, and node numbers that fit.

use uav_relay::optimiser::ladder::Ladder;
use uav_relay::optimiser::{PerTarget, pass::Verdict};
use uav_relay::wire::frame::{self, Header, MAX_FRAME};
use uav_relay::wire::message::{Answer, Message, MessageError};

use super::bodies::{HEADER, VALUE, verdict_on, written};
use super::codec::Said;

use super::reject::*;

#[test]
fn a_turn_is_written_in_one_way() {
    let sound = |turn, explore_m, columns, rows| match verdict_on(
        &token(turn, explore_m, columns, rows).body(),
    ) {
        Ok(()) => true,
        Err(error) => {
            assert_eq!(error, MessageError::Value);
            false
        }
    };
    for turn in 0..=u8::MAX {
        assert_eq!(sound(turn, 0.0, 0, 0), turn <= 2, "{turn}");
        for (explore_m, columns, rows) in [(10.0, 0, 0), (0.0, 2, 2), (1e5, 255, 255), (-0.0, 0, 0)]
        {
            assert_eq!(sound(turn, explore_m, columns, rows), turn == 2, "{turn}");
        }
    }
    for columns in 0..=u8::MAX {
        for rows in 0..=u8::MAX {
            let grid = columns >= 2 && rows >= 2;
            assert_eq!(
                sound(2, 1.0, columns, rows),
                grid || columns == 0 && rows == 0
            );
            assert_eq!(sound(1, 0.0, columns, rows), columns == 0 && rows == 0);
        }
    }
}

/// Returns the values that a message accepts at offset `at` of its body; others must be out of range.
fn taken(mut body: Vec<u8>, at: usize) -> Vec<u16> {
    let fits = |number: &u16| {
        body[at..at + 2].copy_from_slice(&number.to_le_bytes());
        let read = verdict_on(&body);
        assert!(read == Ok(()) || read == VALUE, "{read:?}");
        read.is_ok()
    };
    (0..=u16::MAX).filter(fits).collect()
}

#[test]
fn a_chain_has_up_to_a_thousand_relays() {
    let any: Vec<u16> = (0..=u16::MAX).collect();
    let (from_0, from_1) = (any[..=1000].to_vec(), any[1..=1000].to_vec());
    let votes = PROPOSAL.agreed.relays;
    for (said, at, numbers) in [
        (Said::Hello(HELLO), 1, &any),
        (Said::Hello(HELLO), 3, &from_0),
        (Said::Hello(HELLO), 5, &from_1),
        (Said::Hello(HELLO), 11, &any),
        (Said::Hello(HELLO), 13, &any),
        (Said::Hello(HELLO), 15, &any),
        (Said::Proposal(PROPOSAL), 1, &any),
        (Said::Proposal(PROPOSAL), 3, &any),
        (Said::Proposal(PROPOSAL), 9, &from_1),
        (Said::Proposal(PROPOSAL), 15, &from_1),
        (Said::Proposal(PROPOSAL), 17, &any[..=votes.into()].to_vec()),
        (Said::Proposal(PROPOSAL), 19, &any),
        (Said::Proposal(PROPOSAL), 21, &any),
        (Said::Proposal(PROPOSAL), 33, &from_1),
        (Said::Decision(DECISION), 1, &any),
        (Said::Decision(DECISION), 3, &any),
        (Said::Decision(DECISION), 9, &from_1),
        (Said::Decision(DECISION), 15, &from_1),
        (Said::Decision(DECISION), 22, &from_1),
        (Said::Decision(DECISION), 24, &from_1),
        (Said::Decision(DECISION), 26, &any),
    ] {
        let body = said.body();
        assert_eq!(&taken(body.clone(), at), numbers, "tag {}, {at}", body[0]);
    }
    for (at, most) in [(17, 15), (18, 127)] {
        for byte in 0..=u8::MAX {
            let mut body = Said::Hello(HELLO).body();
            body[at] = byte;
            let expected = if byte <= most { Ok(()) } else { VALUE };
            assert_eq!(verdict_on(&body), expected, "{at}: {byte}");
        }
    }
}

/// Checks that a proposed view names a node of a chain and a number above 0. Other views may be any.
#[test]
fn a_view_is_named_by_a_relay_that_may_propose_it() {
    let fits = |said: &Said, at: usize, view: u32| {
        let mut body = said.body();
        body[at..at + 4].copy_from_slice(&view.to_le_bytes());
        let read = verdict_on(&body);
        assert!(read == Ok(()) || read == VALUE, "{read:?}");
        read.is_ok()
    };
    for number in [0, 1, 2, 4_194_303] {
        for node in 0..1024 {
            let view = number << 10 | node;
            let proposed = number > 0 && (1..=1000).contains(&node);
            for (said, at, expected) in [
                (Said::Hello(HELLO), 7, true),
                // The reported views were proposed earlier, and the accepted view is no later than the proposal that decided it.
                (Said::Proposal(PROPOSAL), 5, proposed && view > VIEW.id),
                (
                    Said::Proposal(PROPOSAL),
                    11,
                    (proposed || view == 0) && view < PROPOSAL.call.view,
                ),
                (
                    Said::Proposal(PROPOSAL),
                    25,
                    proposed && (VIEW.id..PROPOSAL.call.view).contains(&view),
                ),
                (Said::Proposal(PROPOSAL), 29, proposed && view <= VIEW.id),
                (Said::Decision(DECISION), 5, proposed && view > VIEW.id),
                // The base may be the chain as loaded.
                (
                    Said::Decision(DECISION),
                    11,
                    (proposed || view == 0) && view < DECISION.call.view,
                ),
                (Said::Decision(DECISION), 18, proposed),
            ] {
                assert_eq!(fits(&said, at, view), expected, "{said:?}, {at}: {view:x}");
            }
        }
    }
}

/// Checks that a lease of zero is refused.
#[test]
fn a_pulse_gives_a_lease() {
    let pulse = vec![15, 0, 0, 0, 0, 1, 0];
    let any: Vec<u16> = (0..=u16::MAX).collect();
    assert_eq!(taken(pulse.clone(), 5), any[1..]);
    for at in [1, 3] {
        assert_eq!(taken(pulse.clone(), at), any);
        assert_eq!(taken(vec![16, 0, 0, 0, 0, 1], at), any);
        assert_eq!(taken(vec![3, 0, 0, 1, 0, 2, 0], at), any);
    }
}

#[test]
fn node_numbers_that_do_not_fit_are_not_written() {
    let message = Message::Busy { sweep: 1 };
    for (number, fits) in [(4094, true), (4095, false), (4096, false), (65535, false)] {
        for header in [
            Header {
                sender: number,
                ..HEADER
            },
            Header {
                destination: number,
                ..HEADER
            },
        ] {
            let mut out = [0; MAX_FRAME];
            let len = frame::encode(header, &message, &mut out);
            assert_eq!(len, if fits { 19 } else { 0 }, "{number}");
        }
    }
}

#[test]
fn what_the_crate_writes_out_of_range_it_refuses_to_read() {
    let answer = |slack, stand| {
        Message::Verdict(Answer {
            number: 0,
            mission: 0,
            verdict: Verdict {
                commit: None,
                slacks: PerTarget::from_slice(&[slack]).unwrap(),
            },
            own: true,
            stand,
        })
    };
    for (slack, stand, fits) in [
        (1.0, None, true),
        (1.0, Some(1.0), true),
        (f32::NAN, None, false),
        (3e9, None, false),
        (1.0, Some(f32::NAN), false),
        (1.0, Some(-1.0), false),
        (1.0, Some(2e6), false),
    ] {
        let read = verdict_on(&written(&answer(slack, stand)));
        assert_eq!(read.is_ok(), fits, "{slack} {stand:?}");
    }
    assert!(Ladder::from_parts(1.0, 255, 255).is_none());
}
