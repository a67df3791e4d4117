//! Profile collection at a relay: forwarding, results, and stale messages.

use host_tests::fixtures::{self, paper};
use uav_relay::wire::digest::digest;
use uav_relay::{
    Instant, Interference, Method, Mission, MissionConfig, Port, Profile, Relay, Settings, Wiring,
};

use super::codec::{Said, Seats};
use super::kinds::{FIRST, SECOND, framed, one_of_each, sent, settle, source};
use super::receive::{FIELD, counted, relay_of};

/// Returns the counters that a message of the due pass, received at `port`, increments at relay 4 of 8.
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

/// Returns relay 4 of 8; with `differs` it holds 33 m.
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

/// Returns a collection, or its result, with profiles of the relays `indices`.
fn of(relay: &Relay, number: u16, after: u16, indices: &[u16]) -> Seats {
    Seats {
        number,
        view_digest: digest(relay.mission()),
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

        // The collection is repeated while its result is pending.
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
        // No relay moves.
        assert_eq!(relay.setpoint(), None);

        // The collection is repeated after its result.
        hear(&mut relay, now, Port::Upstream, &Said::Gather(told));
        assert_eq!(sent(&mut relay, now), back);
        assert_eq!(counted(relay.stats()), ["received", "repeated"]);
    }
}

/// Checks that a full roster is forwarded unchanged, and that the next pass continues behind it.
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
    // Some relays have not been asked, so a sweep is too early.
    let mut early = relay.clone();
    let aside = &one_of_each(SECOND, digest(relay.mission()))[5];
    assert_eq!(say(&mut early, Port::Upstream, aside), []);
    assert_eq!(counted(early.stats()), ["received", "stale"]);
    // A collection behind other relays is stale.
    let mut other = relay.clone();
    let later = Said::Gather(of(&relay, SECOND, 7, &[8]));
    assert_eq!(say(&mut other, Port::Upstream, &later), []);
    assert_eq!(counted(other.stats()), ["received", "stale"]);
    let out = say(&mut relay, Port::Upstream, &Said::Gather(next.clone()));
    let mut own = next;
    own.seats.push((10, 20.0, 1.0));
    assert_eq!(out, [(Port::Downstream, Said::Gather(own))]);
}

/// Checks that the number alone does not identify a collection.
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

/// Checks a relay that missed the others' profiles, as after a reboot.
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

/// Asserts that the relay soon requests a view, by the second flag of a hello.
fn assert_asks_for_a_view(relay: &mut Relay, now: &mut Instant) {
    let out = settle(relay, now);
    let calls = |said: &Said| matches!(said, Said::Hello(hello) if hello.flags & 2 > 0);
    assert!(out.iter().any(|(_, said)| calls(said)), "{out:?}");
}

/// Checks that earlier relays never report a relay's own profile or a later one.
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

/// Checks invalid rosters: another pass, other relays, incomplete, beyond the chain, duplicates.
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
