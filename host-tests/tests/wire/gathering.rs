//! What the joint method says: sweeps from beside the line, and what relays bring along. Their ranges, number by number, their counts,
//! what is refused, and what a relay does with them.

use host_tests::fixtures::{self, paper};
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::digest::digest;
use uav_relay::wire::message::{MOST_NAMED, Message, OwnSeat, Roster, Sweep};
use uav_relay::{
    Instant, Interference, Method, Mission, MissionConfig, Port, Profile, Relay, Settings, Wiring,
};

use super::bodies::{
    ENCODING, VALUE, assert_ranges, assert_refused_cut_and_longer, assert_refused_padded, single,
    verdict_on, with, written, zeros,
};
use super::codec::{Said, Seats};
use super::kinds::{FIRST, SECOND, framed, one_of_each, sent, settle, source};
use super::receive::{FIELD, counted, relay_of};

fn aside() -> Said {
    Said::Aside {
        sweep: single(1.5),
        y_m: -12.5,
    }
}

/// What `count` relays bring along.
fn seats(count: u16) -> Seats {
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
    // Zero is for relays that choose.
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
fn what_came_of_a_gathering_that_is_not_awaited_is_stale() {
    let read = counted_of(paper(8).interference, Port::Downstream, 7);
    assert_eq!(read, ["received", "stale"]);
}

#[test]
fn gatherings_and_asides_are_stale_in_a_field() {
    for tag in [5, 6] {
        let field = Interference::Field(FIELD);
        let read = counted_of(field, Port::Downstream, tag);
        assert_eq!(read, ["received", "stale"], "{tag}");
    }
}

fn hear(relay: &mut Relay, now: Instant, port: Port, said: &Said) {
    relay.handle_bytes(now, port, &framed(4, port, said));
}

/// Relay 4 of 8; one that `differs` keeps to 33 m.
fn fourth(differs: bool) -> Relay {
    let mission = Mission::try_new(source()).unwrap();
    let common = mission.config().common;
    let settings = Settings {
        method: Method::Joint,
        hold_altitude: differs,
        profile: differs.then_some(Profile {
            altitude_m: 33.0,
            ..common
        }),
        ..Settings::default()
    };
    fixtures::relay(mission, 4, settings)
}

/// A gathering, or what came of one, of these relays.
fn of(relay: &Relay, number: u16, after: u16, indices: &[u16]) -> Seats {
    Seats {
        number,
        mission: digest(relay.mission()),
        after,
        seats: indices.iter().map(|&index| (index, 30.0, 0.5)).collect(),
    }
}

#[test]
fn a_gathering_goes_onward_with_who_differs_and_what_came_of_it_back() {
    let now = Instant::ZERO;
    for differs in [false, true] {
        let mut relay = fourth(differs);
        let told = of(&relay, FIRST, 0, &[1, 3]);
        let mut own = told.clone();
        if differs {
            own.seats.push((4, 33.0, 1.0));
        }
        hear(&mut relay, now, Port::Upstream, &Said::Gather(told.clone()));
        assert_eq!(
            sent(&mut relay, now),
            [(Port::Downstream, Said::Gather(own.clone()))]
        );

        // The same again: it is under way.
        hear(&mut relay, now, Port::Upstream, &Said::Gather(told.clone()));
        let busy = Said::Busy { number: FIRST };
        assert_eq!(sent(&mut relay, now), [(Port::Upstream, busy)]);

        let mut all = own.clone();
        all.seats.push((6, 0.0, 2.0));
        let back = [(Port::Upstream, Said::Gathered(all.clone()))];
        hear(
            &mut relay,
            now,
            Port::Downstream,
            &Said::Gathered(all.clone()),
        );
        assert_eq!(sent(&mut relay, now), back);
        // Nobody moves by it.
        assert_eq!(relay.setpoint(), None);

        // And the same again: what came of it is known.
        hear(&mut relay, now, Port::Upstream, &Said::Gather(told));
        assert_eq!(sent(&mut relay, now), back);
        assert_eq!(counted(relay.stats()), ["received", "repeated"]);
    }
}

/// A full roster is taken as it is; the next pass asks who had no room in it, and no one before.
#[test]
fn who_finds_no_room_is_asked_by_the_next_pass() {
    let mission = MissionConfig {
        band: uav_relay::Band {
            least_m: 20.0,
            most_m: 300.0,
        },
        ..paper(20)
    };
    let mission = Mission::try_new(mission).unwrap();
    let settings = Settings {
        hold_altitude: true,
        ..Settings::default()
    };
    let mut relay = fixtures::relay(mission, 10, settings);
    let now = Instant::ZERO;
    let full = of(&relay, FIRST, 0, &[1, 2, 3, 4, 5, 6, 7, 8]);
    let next = of(&relay, SECOND, 8, &[9]);
    let say = |relay: &mut Relay, port, said: &Said| {
        relay.handle_bytes(now, port, &framed(10, port, said));
        sent(relay, now)
    };
    let out = say(&mut relay, Port::Upstream, &Said::Gather(full.clone()));
    assert_eq!(out, [(Port::Downstream, Said::Gather(full.clone()))]);
    let out = say(&mut relay, Port::Downstream, &Said::Gathered(full.clone()));
    assert_eq!(out, [(Port::Upstream, Said::Gathered(full))]);
    // Not all have been asked: it is no time for a sweep.
    let mut early = relay.clone();
    let aside = &one_of_each(SECOND, digest(relay.mission()))[5];
    assert_eq!(say(&mut early, Port::Upstream, aside), []);
    assert_eq!(counted(early.stats()), ["received", "stale"]);
    // And not for those after others.
    let mut other = relay.clone();
    let later = Said::Gather(of(&relay, SECOND, 7, &[8]));
    assert_eq!(say(&mut other, Port::Upstream, &later), []);
    assert_eq!(counted(other.stats()), ["received", "stale"]);
    let out = say(&mut relay, Port::Upstream, &Said::Gather(next.clone()));
    let mut own = next;
    own.seats.push((10, 20.0, 1.0));
    assert_eq!(out, [(Port::Downstream, Said::Gather(own))]);
}

/// The number alone does not make it the same.
#[test]
fn a_gathering_of_others_does_not_repeat_and_asks_for_a_new_view() {
    let mut now = Instant::ZERO;
    let mut relay = fourth(false);
    let said = Said::Gather(of(&relay, FIRST, 0, &[2]));
    hear(&mut relay, now, Port::Upstream, &said);
    assert_eq!(sent(&mut relay, now).len(), 1);
    let said = Said::Gather(of(&relay, FIRST, 0, &[3]));
    hear(&mut relay, now, Port::Upstream, &said);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_asks_for_a_view(&mut relay, &mut now);
}

/// As one that was switched on again in the midst of it: what the others brought along it has not been told.
#[test]
fn a_sweep_of_places_chosen_asks_a_relay_for_a_new_view_that_was_told_nothing() {
    let mut now = Instant::ZERO;
    let mut relay = fourth(false);
    let said = Said::Gather(of(&relay, FIRST, 0, &[2]));
    hear(&mut relay, now, Port::Upstream, &said);
    assert_eq!(sent(&mut relay, now).len(), 1);
    let aside = &one_of_each(SECOND, digest(relay.mission()))[5];
    hear(&mut relay, now, Port::Upstream, aside);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_asks_for_a_view(&mut relay, &mut now);
}

#[test]
fn a_relay_that_missed_the_gatherings_before_asks_for_a_new_view() {
    let mut now = Instant::ZERO;
    let mut relay = fourth(false);
    let said = Said::Gather(of(&relay, FIRST, 2, &[3]));
    hear(&mut relay, now, Port::Upstream, &said);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_asks_for_a_view(&mut relay, &mut now);
}

/// All that it says before long are hellos that call for a view, the second flag of five.
fn assert_asks_for_a_view(relay: &mut Relay, now: &mut Instant) {
    let out = settle(relay, now);
    let calls = |said: &Said| matches!(said, Said::Hello(hello) if hello.flags & 2 > 0);
    assert!(out.iter().any(|(_, said)| calls(said)), "{out:?}");
}

/// Nobody before a relay speaks for it, or for who comes after it.
#[test]
fn a_gathering_with_a_seat_of_its_receiver_is_stale() {
    for index in [4, 5] {
        let mut relay = fourth(false);
        let said = Said::Gather(of(&relay, FIRST, 0, &[index]));
        hear(&mut relay, Instant::ZERO, Port::Upstream, &said);
        assert_eq!(sent(&mut relay, Instant::ZERO), []);
        assert_eq!(counted(relay.stats()), ["received", "stale"]);
    }
}

/// Of another pass, after other relays, without what was handed on, beyond the chain, or twice.
#[test]
fn a_roster_that_does_not_fit_is_stale_and_changes_nothing() {
    let now = Instant::ZERO;
    let mut relay = fourth(false);
    let said = Said::Gather(of(&relay, FIRST, 0, &[2]));
    hear(&mut relay, now, Port::Upstream, &said);
    assert_eq!(sent(&mut relay, now).len(), 1);
    for seats in [
        of(&relay, SECOND, 0, &[2, 6]),
        of(&relay, FIRST, 1, &[2, 6]),
        of(&relay, FIRST, 0, &[6]),
        of(&relay, FIRST, 0, &[]),
        of(&relay, FIRST, 0, &[2, 9]),
    ] {
        let mut after = relay.clone();
        hear(
            &mut after,
            now,
            Port::Downstream,
            &Said::Gathered(seats.clone()),
        );
        assert_eq!(counted(after.stats()), ["received", "stale"], "{seats:?}");
        assert_eq!(sent(&mut after, now), []);
        assert_eq!(after.phase(), relay.phase());
    }
    let fits = Said::Gathered(of(&relay, FIRST, 0, &[2, 8]));
    hear(&mut relay, now, Port::Downstream, &fits);
    assert_eq!(sent(&mut relay, now), [(Port::Upstream, fits.clone())]);
    hear(&mut relay, now, Port::Downstream, &fits);
    assert_eq!(counted(relay.stats()), ["received", "stale"]);
    assert_eq!(sent(&mut relay, now), []);
}
