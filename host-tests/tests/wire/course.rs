//! What the joint method says: sweeps from beside the line, courses, and what came of them. Their ranges, number by number,
//! their counts, and what is refused.

use uav_relay::placement::PerTarget;
use uav_relay::placement::joint::Outlook;
use uav_relay::placement::ladder::Ladder;
use uav_relay::sir::{CrossSection, Station};
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::{
    Course, MAX_BODY, Message, MessageError, Sweep, TRIALS, Trial, Worth,
};
use uav_relay::{Instant, Interference, MissionConfig, Placement, Port, Wiring};

use super::codec::Said;
use super::receive::{FIELD, counted, paper, relay_of};
use super::sequence::{FIRST, framed, one_of_each};
use super::strategies::pad;

const ENCODING: Result<(), MessageError> = Err(MessageError::Encoding);
const VALUE: Result<(), MessageError> = Err(MessageError::Value);

/// What a receiver makes of a body; whatever it takes it writes as it was.
fn verdict_on(body: &[u8]) -> Result<(), MessageError> {
    let message = Message::decode(body)?;
    assert_eq!(written(&message), body);
    Ok(())
}

fn written(message: &Message) -> Vec<u8> {
    let mut body = [0; MAX_BODY];
    let len = message.encode(&mut body).unwrap();
    body[..len].to_vec()
}

fn aside() -> Said {
    Said::Aside {
        number: 1,
        mission: 2,
        anchor: 1.5,
        gap: 0,
        growth: 0,
        altitude_m: 20.0,
        power_w: 1.0,
        y_m: -12.5,
        reaches: vec![100.0],
    }
}

fn course(trials: usize) -> Said {
    Said::Course {
        number: 1,
        mission: 2,
        power_w: 1.0,
        trials: vec![[1.5, 100.0, -12.5, 20.0]; trials],
    }
}

fn worth(trial: Option<u8>) -> Said {
    Said::Worth {
        number: 1,
        mission: 2,
        trial,
        outlook: [0.5; 17],
    }
}

/// Puts `number` at `at` of a body.
fn with(said: &Said, at: usize, number: f32) -> Vec<u8> {
    let mut body = said.body();
    body[at..at + 4].copy_from_slice(&number.to_le_bytes());
    body
}

/// Numbers that are none.
const STRANGE: [f32; 5] = [
    f32::NAN,
    -f32::NAN,
    f32::from_bits(0x7F80_0001),
    f32::INFINITY,
    f32::NEG_INFINITY,
];

#[test]
fn numbers_are_accepted_up_to_their_bounds_and_no_farther() {
    let (aside, course) = (aside(), course(TRIALS));
    let mut ranges = vec![
        (&aside, 5, f32::MIN_POSITIVE, f32::MAX, "anchor"),
        (&aside, 11, 0.1, 1e5, "altitude"),
        (&aside, 15, 1e-6, 1e6, "power"),
        (&aside, 19, -1e5, 1e5, "y"),
        (&aside, 24, 0.0, 2e9, "reach"),
        (&course, 5, 1e-6, 1e6, "power of a course"),
    ];
    for trial in (10..74).step_by(16) {
        ranges.extend([
            (&course, trial, f32::MIN_POSITIVE, 1e30, "target"),
            (&course, trial + 4, 0.0, 1e6, "x of a trial"),
            (&course, trial + 8, -1e5, 1e5, "y of a trial"),
            (&course, trial + 12, 0.1, 1e5, "altitude of a trial"),
        ]);
    }
    for (said, at, least, most, what) in ranges {
        for good in [least, most] {
            assert_eq!(verdict_on(&with(said, at, good)), Ok(()), "{what} {good}");
        }
        let beyond = [least.next_down(), most.next_up(), f32::MIN];
        for bad in beyond.into_iter().chain(STRANGE) {
            assert_eq!(verdict_on(&with(said, at, bad)), VALUE, "{what} {bad}");
        }
        for zero in [0.0, -0.0] {
            let fits = (least..=most).contains(&zero);
            let read = verdict_on(&with(said, at, zero));
            assert_eq!(read.is_ok(), fits, "{what} {zero}");
        }
    }
}

#[test]
fn every_number_of_an_outlook_is_finite_and_may_be_any_such() {
    for trial in [None, Some(0)] {
        let (said, first) = (worth(trial), 6 + usize::from(trial.is_some()));
        assert_eq!(said.body().len(), first + 4 * 17);
        for at in (first..first + 68).step_by(4) {
            for good in [f32::MAX, f32::MIN, 0.0, -0.0, f32::from_bits(1)] {
                assert_eq!(verdict_on(&with(&said, at, good)), Ok(()), "{at}: {good}");
            }
            for bad in STRANGE {
                assert_eq!(verdict_on(&with(&said, at, bad)), VALUE, "{at}: {bad}");
            }
        }
    }
}

#[test]
fn a_course_has_up_to_four_trials() {
    for count in 0..=u8::MAX {
        let mut body = course(1).body();
        let one = body.split_off(10);
        body[9] = count;
        body.extend(one.repeat(usize::from(count)));
        let read = verdict_on(&body);
        assert_eq!(read.is_ok(), usize::from(count) <= TRIALS, "{count}");
        assert!(read.is_ok() || read == ENCODING);
    }
}

#[test]
fn a_worth_names_one_of_four_trials() {
    for trial in 0..=u8::MAX {
        let expected = if trial < 4 { Ok(()) } else { VALUE };
        assert_eq!(verdict_on(&worth(Some(trial)).body()), expected, "{trial}");
    }
    for option in 2..=u8::MAX {
        let mut body = worth(Some(0)).body();
        body[5] = option;
        assert_eq!(verdict_on(&body), ENCODING, "Option {option}");
    }
}

#[test]
fn a_single_target_takes_one_reach_from_beside_the_line_too() {
    for count in 0..=17_u8 {
        let mut body = aside().body();
        body.truncate(23);
        body.push(count);
        body.extend(vec![0; 4 * usize::from(count)]);
        let expected = match count {
            0 | 1 => Ok(()),
            2..=16 => VALUE,
            _ => ENCODING,
        };
        assert_eq!(verdict_on(&body), expected, "{count} reaches");
    }
}

#[test]
fn cut_longer_and_padded_ones_are_refused() {
    for said in [
        aside(),
        course(0),
        course(1),
        course(4),
        worth(None),
        worth(Some(3)),
    ] {
        let body = said.body();
        assert_eq!(verdict_on(&body), Ok(()));
        for len in 0..body.len() {
            assert_eq!(verdict_on(&body[..len]), ENCODING, "{len} of {said:?}");
        }
        for extra in 0..=u8::MAX {
            assert_eq!(verdict_on(&[&body[..], &[extra]].concat()), ENCODING);
        }
        let counted = !matches!(said, Said::Worth { .. });
        for tag in [true, false].into_iter().filter(|&tag| tag || counted) {
            for more in 0..9 {
                let mut padded = body.clone();
                pad(&mut padded, tag, more);
                assert_eq!(padded.len(), body.len() + 1 + more);
                assert_eq!(verdict_on(&padded), ENCODING, "{padded:x?}");
            }
        }
    }
}

/// Whatever a relay has in memory, only what is in range is taken at the other end.
#[test]
fn what_the_crate_writes_out_of_range_it_refuses_to_read() {
    let sweep = |y_m| {
        Message::Sweep(Sweep {
            number: 0,
            mission: 0,
            ladder: Ladder::single(1.0),
            relay: Station {
                at: CrossSection {
                    y_m,
                    altitude_m: 20.0,
                },
                power_w: 1.0,
            },
            chosen: true,
            measured_per_w: None,
            reaches: PerTarget::new(),
        })
    };
    let course = |y_m| {
        let trial = Trial {
            target: 1.0,
            place: Placement {
                x_m: 1.0,
                y_m,
                altitude_m: 20.0,
            },
        };
        Message::Course(Course {
            number: 0,
            mission: 0,
            power_w: 1.0,
            trials: [trial].into_iter().collect(),
        })
    };
    for (y_m, expected) in [(1.0, Ok(())), (2e5, VALUE), (f32::NAN, VALUE)] {
        assert_eq!(verdict_on(&written(&sweep(y_m))), expected, "{y_m}");
        assert_eq!(verdict_on(&written(&course(y_m))), expected, "{y_m}");
    }
    for (trial, expected) in [(3, Ok(())), (4, VALUE)] {
        let worth = Message::Worth(Worth {
            number: 0,
            mission: 0,
            trial: Some(trial),
            outlook: Outlook::from_parts([0.0; 17]).unwrap(),
        });
        assert_eq!(verdict_on(&written(&worth)), expected, "{trial}");
    }
}

/// A relay on the line that was given its place there, and one that is there by choice, are told apart; what is measured has no
/// place in the latter.
#[test]
fn a_sweep_by_the_joint_method_is_an_aside_even_on_the_line() {
    let sweep = |chosen, measured_per_w| Sweep {
        number: 1,
        mission: 2,
        ladder: Ladder::single(1.5),
        relay: Station {
            at: CrossSection::on_line(20.0),
            power_w: 1.0,
        },
        chosen,
        measured_per_w,
        reaches: PerTarget::new(),
    };
    for (chosen, measured, tag) in [
        (false, None, 0),
        (false, Some(1e9), 4),
        (true, None, 5),
        (true, Some(1e9), 5),
    ] {
        let body = written(&Message::Sweep(sweep(chosen, measured)));
        assert_eq!(body[0], tag);
        let measured = measured.filter(|_| !chosen);
        let read = Message::decode(&body).unwrap();
        assert_eq!(read, Message::Sweep(sweep(chosen, measured)));
    }
}

/// What relay 4 of 8 counts of a message of the pass that is due, from this side.
fn counted_of(interference: Interference, port: Port, tag: usize) -> Vec<&'static str> {
    let mission = MissionConfig {
        interference,
        ..paper(8)
    };
    let mut relay = relay_of(mission, 4, Wiring::Pair);
    let said = &one_of_each(FIRST, digest(relay.mission()))[tag];
    relay.handle_bytes(Instant::ZERO, port, &framed(4, port, said));
    assert_eq!(relay.setpoint(), None);
    counted(relay.stats())
}

#[test]
#[ignore = "relays take no part in courses yet"]
fn what_came_of_a_course_that_is_not_awaited_is_stale() {
    let source = paper(8).interference;
    let read = counted_of(source, Port::Downstream, 7);
    assert_eq!(read, ["received", "stale"]);
}

#[test]
#[ignore = "relays take no part in courses yet"]
fn courses_and_asides_are_stale_in_a_field() {
    for tag in [5, 6] {
        let field = Interference::Field(FIELD);
        let read = counted_of(field, Port::Downstream, tag);
        assert_eq!(read, ["received", "stale"], "{tag}");
    }
}
