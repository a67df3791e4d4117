//! What the joint method says: sweeps from beside the line, courses, and what came of them. Their ranges, number by number,
//! their counts, what is refused, and what a relay does with them.

use host_tests::fixtures::paper;
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::joint::Outlook;
use uav_relay::optimiser::joint::outlook::PARTS;
use uav_relay::optimiser::joint::trial::{Bar, TRIALS, Trial};
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::{Course, Message, Sweep, Worth};
use uav_relay::{Instant, Interference, MissionConfig, Placement, Port, Relay, Wiring};

use super::bodies::{
    ENCODING, STRANGE, VALUE, assert_ranges, assert_refused_cut_and_longer, assert_refused_padded,
    single, verdict_on, with, written, zeros,
};
use super::codec::Said;
use super::receive::{FIELD, counted, relay_of};
use super::sequence::{FIRST, SECOND, framed, one_of_each, sent, settle, source};

fn aside() -> Said {
    Said::Aside {
        sweep: single(1.5),
        y_m: -12.5,
    }
}

fn course(trials: usize) -> Said {
    Said::Course {
        number: 1,
        mission: 2,
        power_w: 1.0,
        bar: [0.5, -300.0, 0.25],
        trials: vec![[1.5, 0.5, 100.0, -12.5, 20.0]; trials],
    }
}

fn worth(trial: Option<u8>) -> Said {
    Said::Worth {
        number: 1,
        mission: 2,
        trial,
        slack_m: 0.5,
        outlook: [0.5; 12],
    }
}

#[test]
fn numbers_are_accepted_up_to_their_bounds_and_no_farther() {
    let (aside, course) = (aside(), course(TRIALS));
    let mut ranges = vec![
        (&aside, 5, f32::MIN_POSITIVE, f32::MAX, "anchor"),
        (&aside, 5, f32::MIN, -f32::MIN_POSITIVE, "anchor, plain"),
        (&aside, 11, 0.1, 1e5, "altitude"),
        (&aside, 15, 1e-6, 1e6, "power"),
        (&aside, 19, -1e5, 1e5, "y"),
        (&aside, 24, 0.0, 2e9, "reach"),
        (&course, 5, 1e-6, 1e6, "power of a course"),
        (&course, 9, 0.0, 1.0, "trust"),
        (&course, 13, f32::MIN, -f32::from_bits(1), "slope"),
        (&course, 17, -1e3, 1e3, "estimate"),
    ];
    for trial in (22..82).step_by(20) {
        ranges.extend([
            (&course, trial, f32::MIN_POSITIVE, 1e30, "target"),
            (&course, trial + 4, 0.0, f32::MAX, "penalty"),
            (&course, trial + 8, 0.0, 1e6, "x of a trial"),
            (&course, trial + 12, -1e5, 1e5, "y of a trial"),
            (&course, trial + 16, 0.1, 1e5, "altitude of a trial"),
        ]);
    }
    assert_ranges(&ranges);
}

#[test]
fn a_slack_and_every_number_of_an_outlook_are_finite_and_may_be_any_such() {
    for trial in [None, Some(0)] {
        let (said, first) = (worth(trial), 6 + usize::from(trial.is_some()));
        let len = first + 4 * (1 + PARTS);
        assert_eq!(said.body().len(), len);
        for at in (first..len).step_by(4) {
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
fn a_course_has_up_to_three_trials() {
    for count in 0..=u8::MAX {
        let mut body = course(1).body();
        let one = body.split_off(22);
        body[21] = count;
        body.extend(one.repeat(usize::from(count)));
        let read = verdict_on(&body);
        assert_eq!(read.is_ok(), usize::from(count) <= TRIALS, "{count}");
        assert!(read.is_ok() || read == ENCODING);
    }
}

#[test]
fn a_worth_names_one_of_three_trials() {
    for trial in 0..=u8::MAX {
        let expected = if trial < 3 { Ok(()) } else { VALUE };
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
        let body = zeros(aside().body(), 23, count);
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
        course(3),
        worth(None),
        worth(Some(2)),
    ] {
        assert_refused_cut_and_longer(&said.body(), &format!("{said:?}"));
        assert_refused_padded(&said.body(), !matches!(said, Said::Worth { .. }));
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
    let course = |y_m, slope| {
        let trial = Trial {
            target: 1.0,
            penalty_m: 0.0,
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
            bar: Bar {
                trust: 0.5,
                slope,
                estimate: 0.0,
            },
            trials: [trial].into_iter().collect(),
        })
    };
    for (y_m, expected) in [(1.0, Ok(())), (2e5, VALUE), (f32::NAN, VALUE)] {
        assert_eq!(verdict_on(&written(&sweep(y_m))), expected, "{y_m}");
        assert_eq!(verdict_on(&written(&course(y_m, -1.0))), expected, "{y_m}");
    }
    assert_eq!(verdict_on(&written(&course(1.0, 0.0))), VALUE);
    for (trial, slack_m, expected) in [
        (2, 1.0, Ok(())),
        (3, 1.0, VALUE),
        (2, f32::NEG_INFINITY, VALUE),
    ] {
        let worth = Message::Worth(Worth {
            number: 0,
            mission: 0,
            trial: Some(trial),
            slack_m,
            outlook: Outlook::from_parts([0.0; PARTS]).unwrap(),
        });
        assert_eq!(verdict_on(&written(&worth)), expected, "{trial} {slack_m}");
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
fn what_came_of_a_course_that_is_not_awaited_is_stale() {
    let read = counted_of(paper(8).interference, Port::Downstream, 7);
    assert_eq!(read, ["received", "stale"]);
}

#[test]
fn courses_and_asides_are_stale_in_a_field() {
    for tag in [5, 6] {
        let field = Interference::Field(FIELD);
        let read = counted_of(field, Port::Downstream, tag);
        assert_eq!(read, ["received", "stale"], "{tag}");
    }
}

/// Relay 4 of 8 once it knows where it is to be, with a place by the pass before the next; a course of the three before it, and
/// what comes back of that.
fn on_course(now: &mut Instant) -> (Relay, Said, Said) {
    let mut relay = relay_of(source(), 4, Wiring::Pair);
    let kinds = one_of_each(FIRST, digest(relay.mission()));
    hear(&mut relay, *now, Port::Upstream, &kinds[5]);
    let mut out = Vec::new();
    while out.is_empty() {
        assert!(*now < Instant::from_millis(60_000));
        out = settle(&mut relay, now);
    }
    let onward = |(port, said): &(Port, Said)| {
        *port == Port::Downstream && matches!(said, Said::Aside { .. })
    };
    assert!(out.iter().any(onward), "{out:?}");
    hear(&mut relay, *now, Port::Downstream, &kinds[1]);
    assert_eq!(sent(&mut relay, *now), [(Port::Upstream, kinds[1].clone())]);
    assert!(relay.setpoint().is_some());
    let mut kinds = one_of_each(SECOND, digest(relay.mission()));
    if let Said::Course { trials, .. } = &mut kinds[6] {
        let [target, _, x_m, y_m, altitude_m] = trials[0];
        trials.push([0.75 * target, 2.5, x_m, y_m, altitude_m]);
    }
    let mut worth = kinds[7].clone();
    if let Said::Worth { trial, outlook, .. } = &mut worth {
        *trial = Some(1);
        // As a tail sees it that has Rx far ahead.
        *outlook = [0.0; PARTS];
        (outlook[0], outlook[9]) = (1.0, -250.0);
    }
    (relay, kinds[6].clone(), worth)
}

fn hear(relay: &mut Relay, now: Instant, port: Port, said: &Said) {
    relay.handle_bytes(now, port, &framed(4, port, said));
}

#[test]
fn a_course_goes_onward_and_what_came_of_it_back() {
    let mut now = Instant::ZERO;
    let (mut relay, course, worth) = on_course(&mut now);
    let place = relay.setpoint();
    let Said::Course { bar, trials, .. } = &course else {
        panic!("{course:?}");
    };
    hear(&mut relay, now, Port::Upstream, &course);
    let out = sent(&mut relay, now);
    let [
        (
            Port::Downstream,
            Said::Course {
                number: SECOND,
                power_w,
                bar: own_bar,
                trials: own,
                ..
            },
        ),
    ] = &out[..]
    else {
        panic!("{out:?}");
    };
    assert_eq!((*power_w, own_bar), (1.0, bar));
    assert_eq!(own.len(), trials.len());
    for ([target, penalty_m, x_m, ..], told) in own.iter().zip(trials) {
        assert_eq!(*target, told[0]);
        assert!(*penalty_m >= told[1], "penalties add up");
        assert!(*x_m > told[2], "a step onward");
    }
    assert!(own[1][2] > own[0][2], "farther for a lower target");

    // The same again: it is under way.
    hear(&mut relay, now, Port::Upstream, &course);
    let busy = Said::Busy { number: SECOND };
    assert_eq!(sent(&mut relay, now), [(Port::Upstream, busy)]);

    hear(&mut relay, now, Port::Downstream, &worth);
    let out = sent(&mut relay, now);
    let [(Port::Upstream, back)] = &out[..] else {
        panic!("{out:?}");
    };
    let Said::Worth {
        number: SECOND,
        trial: Some(1),
        slack_m: 1.0,
        outlook,
        ..
    } = back
    else {
        panic!("{back:?}");
    };
    // The relay before sees it through one hop more: from farther along the rest is worth more, for a higher target less.
    assert!(outlook[0] > 0.0 && outlook[9] < -250.0, "{outlook:?}");
    // Nobody moves by a course.
    assert_eq!(relay.setpoint(), place);

    // And the same again: what came of it is known.
    hear(&mut relay, now, Port::Upstream, &course);
    assert_eq!(sent(&mut relay, now), [(Port::Upstream, back.clone())]);
    assert_eq!(relay.stats().repeated, 2);
    assert_eq!(counted(relay.stats()), ["received", "repeated"]);
}

/// From far aside, the room of relay 4 is to be had for some targets by a hop alone that ends before Tx.
#[test]
fn a_trial_that_would_lead_back_before_tx_is_not_handed_on() {
    let mut now = Instant::ZERO;
    let (relay, course, _) = on_course(&mut now);
    let mut kept = Vec::new();
    for step in 1..=200_u16 {
        let mut relay = relay.clone();
        let mut course = course.clone();
        if let Said::Course { trials, .. } = &mut course {
            trials[1] = [0.001 * f32::from(step), 2.5, 0.0, -400.0, 20.0];
        }
        hear(&mut relay, now, Port::Upstream, &course);
        let out = sent(&mut relay, now);
        let [(Port::Downstream, Said::Course { trials, .. })] = &out[..] else {
            panic!("{out:?}");
        };
        kept.push(trials.len());
    }
    println!("{kept:?}");
    assert!(kept.contains(&2) && kept.contains(&1) && kept.is_sorted_by(|a, b| a >= b));
}

/// The number alone does not make it the same course.
#[test]
fn a_course_with_other_trials_does_not_repeat_and_asks_for_a_new_view() {
    let mut now = Instant::ZERO;
    let (mut relay, course, _) = on_course(&mut now);
    hear(&mut relay, now, Port::Upstream, &course);
    assert_eq!(sent(&mut relay, now).len(), 1);
    let mut other = course.clone();
    if let Said::Course { trials, .. } = &mut other {
        trials[1][1] += 0.5;
    }
    hear(&mut relay, now, Port::Upstream, &other);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_asks_for_a_view(&mut relay, now);
}

#[test]
fn a_course_asks_a_relay_for_a_new_view_that_does_not_know_where_it_is_to_be() {
    let mut relay = relay_of(source(), 4, Wiring::Pair);
    let course = &one_of_each(FIRST, digest(relay.mission()))[6];
    hear(&mut relay, Instant::ZERO, Port::Upstream, course);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_asks_for_a_view(&mut relay, Instant::ZERO);
}

/// All that it says before long are hellos that call for a view, the second flag of five.
fn assert_asks_for_a_view(relay: &mut Relay, mut now: Instant) {
    let out = settle(relay, &mut now);
    let calls = |said: &Said| matches!(said, Said::Hello(hello) if hello.flags & 2 > 0);
    assert!(out.iter().any(|(_, said)| calls(said)), "{out:?}");
}

/// Of another pass, of a trial that the course did not have, of the side that it cannot come from, or twice.
#[test]
fn a_worth_that_does_not_fit_is_stale_and_changes_nothing() {
    let mut now = Instant::ZERO;
    let (mut relay, course, worth) = on_course(&mut now);
    hear(&mut relay, now, Port::Upstream, &course);
    assert_eq!(sent(&mut relay, now).len(), 1);
    let with = |as_number: u16, as_trial| {
        let mut said = worth.clone();
        if let Said::Worth { number, trial, .. } = &mut said {
            (*number, *trial) = (as_number, as_trial);
        }
        said
    };
    for said in [
        with(FIRST, Some(1)),
        with(SECOND + 1, None),
        with(SECOND, Some(2)),
    ] {
        let mut after = relay.clone();
        hear(&mut after, now, Port::Downstream, &said);
        assert_eq!(counted(after.stats()), ["received", "stale"], "{said:?}");
        assert_eq!(sent(&mut after, now), []);
        assert_eq!(after.phase(), relay.phase());
    }
    hear(&mut relay, now, Port::Downstream, &with(SECOND, None));
    let out = sent(&mut relay, now);
    assert!(
        matches!(out[..], [(Port::Upstream, Said::Worth { trial: None, .. })]),
        "{out:?}"
    );
    assert_eq!(counted(relay.stats()), ["received"]);
    hear(&mut relay, now, Port::Downstream, &worth);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_eq!(sent(&mut relay, now), []);
}
