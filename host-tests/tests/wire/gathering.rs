//! Messages of the joint method (lateral sweeps, profile collections): ranges, counts and refusals.

use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::message::{MOST_NAMED, Message, OwnSeat, Roster, Sweep};

use super::bodies::{
    ENCODING, VALUE, assert_ranges, assert_refused_cut_and_longer, assert_refused_padded, single,
    verdict_on, with, written, zeros,
};
use super::codec::{Said, Seats};

pub(crate) fn aside() -> Said {
    Said::Aside {
        sweep: single(1.5),
        y_m: -12.5,
    }
}

/// Returns a collection with the profiles of `count` relays.
pub(crate) fn seats(count: u16) -> Seats {
    Seats {
        number: 1,
        mission: 2,
        after: 0,
        seats: (1..=count).map(|index| (index, 30.0, 0.5)).collect(),
    }
}

#[test]
fn numbers_are_accepted_up_to_their_bounds_and_no_farther() {
    let (aside, gather, gathered) = (aside(), Said::Gather(seats(2)), Said::Gathered(seats(2)));
    assert_ranges(&[
        (&aside, 5, f32::MIN_POSITIVE, f32::MAX, "anchor"),
        (&aside, 5, f32::MIN, -f32::MIN_POSITIVE, "anchor, plain"),
        (&aside, 11, 0.1, 1e5, "altitude"),
        (&aside, 15, 1e-6, 1e6, "power"),
        (&aside, 19, -1e5, 1e5, "y"),
        (&aside, 24, 0.0, 2e9, "reach"),
        (&gather, 14, 1e-6, 1e6, "power of a seat"),
        (&gather, 24, 1e-6, 1e6, "power of a second seat"),
        (&gathered, 14, 1e-6, 1e6, "power of a seat"),
    ]);
    // Zero is the altitude of relays that choose one.
    for said in [gather, gathered] {
        for (altitude_m, expected) in [
            (0.0, Ok(())),
            (0.1, Ok(())),
            (1e5, Ok(())),
            (-0.0, VALUE),
            (0.1_f32.next_down(), VALUE),
            (1e5_f32.next_up(), VALUE),
            (f32::NAN, VALUE),
        ] {
            assert_eq!(
                verdict_on(&with(&said, 10, altitude_m)),
                expected,
                "{altitude_m}"
            );
        }
    }
}

#[test]
fn seats_are_in_order_and_after_those_of_the_passes_before() {
    for (after, indices, expected) in [
        (0, &[1, 2, 1000][..], Ok(())),
        (8, &[9], Ok(())),
        (u16::MAX, &[], Ok(())),
        (0, &[0], VALUE),
        (0, &[1001], VALUE),
        (9, &[9], VALUE),
        (0, &[2, 2], VALUE),
        (0, &[3, 2], VALUE),
    ] {
        let seats = Seats {
            after,
            seats: indices.iter().map(|&index| (index, 0.0, 1.0)).collect(),
            ..seats(0)
        };
        for said in [Said::Gather(seats.clone()), Said::Gathered(seats)] {
            assert_eq!(verdict_on(&said.body()), expected, "{said:?}");
        }
    }
}

#[test]
fn a_roster_has_up_to_eight_seats() {
    for count in 0..=u8::MAX {
        let mut body = Said::Gather(seats(0)).body();
        body[7] = count;
        for index in 1..=u16::from(count) {
            body.extend(index.to_le_bytes());
            body.extend([0.0_f32, 1.0].map(f32::to_le_bytes).as_flattened());
        }
        let expected = if usize::from(count) <= MOST_NAMED {
            Ok(())
        } else {
            ENCODING
        };
        assert_eq!(verdict_on(&body), expected, "{count}");
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
    let rosters = [0, 1, 8].map(|count| [Said::Gather(seats(count)), Said::Gathered(seats(count))]);
    for said in rosters.as_flattened().iter().chain([&aside()]) {
        assert_refused_cut_and_longer(&said.body(), &format!("{said:?}"));
        assert_refused_padded(&said.body(), true);
    }
}

/// Checks that the receiver refuses out-of-range values, whatever a sender encodes.
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
    for (y_m, expected) in [(1.0, Ok(())), (2e5, VALUE), (f32::NAN, VALUE)] {
        assert_eq!(verdict_on(&written(&sweep(y_m))), expected, "{y_m}");
    }
    for (index, held_m, power_w, expected) in [
        (1, 20.0, 1.0, Ok(())),
        (0, 20.0, 1.0, VALUE),
        (1, f32::NAN, 1.0, VALUE),
        (1, 0.0, 0.0, VALUE),
    ] {
        let seat = OwnSeat {
            index,
            held_m,
            power_w,
        };
        let roster = Roster {
            number: 0,
            mission: 0,
            after: 0,
            seats: [seat].into_iter().collect(),
        };
        for message in [Message::Gather(roster.clone()), Message::Gathered(roster)] {
            assert_eq!(verdict_on(&written(&message)), expected, "{seat:?}");
        }
    }
}

/// Checks that a chosen position on the line differs from a given one, and excludes measured values.
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
