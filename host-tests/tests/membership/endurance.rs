//! Departures that relays request by themselves, by the endurance of their drones.

use host_tests::flights::end_at;

use uav_relay_sim::simulator::drones::FlightSpec;

use super::leaves::{AT_S, departing, freed, on_line, times};
use super::*;

/// Endurance that every relay keeps as a reserve in these tests, s. A further 180 s are reserved for the replacement of
/// a relay.
const RESERVE_S: u16 = 180;

/// Returns the setup of a simulation of `seconds_s` whose relays have an endurance reserve. `left_s` returns the
/// endurance that a drone has in addition to its way home, s. Its arguments are the relay and the time in s. If it
/// returns `None`, the drone reports no new endurance.
fn drained(relays: u16, seconds_s: u16, left_s: impl Fn(u16, u16) -> Option<u16>) -> Setup {
    let mut setup = departing(relays, &[]);
    setup.reserve = Some(Duration::from_millis(1_000 * u64::from(RESERVE_S)));
    for at_s in 1..seconds_s {
        for relay in 1..=relays {
            let at = seconds(u64::from(at_s));
            setup
                .endurances
                .extend(left_s(relay, at_s).map(|left_s| (relay, at, left_s)));
        }
    }
    end_at(&mut setup, seconds(u64::from(seconds_s)));
    setup
}

/// Returns the first time at which each relay's pilot is told to leave, s; `None` if never.
fn told(outcome: &Outcome, relays: u16) -> Vec<Option<f64>> {
    let told = |relay| times(outcome, relay, |what| what == TimelineEvent::MustLeave);
    (1..=relays)
        .map(|relay| told(relay).first().copied())
        .collect()
}

/// Checks that relays leave one by one if all reach the limit of the endurance at the same time.
///
/// The pilot of the last relay is told to leave when only the reserve is left.
#[test]
fn a_fleet_of_equal_endurance_leaves_one_by_one() {
    let end_s = 2 * RESERVE_S + AT_S as u16;
    let setup = drained(8, 300, |_, at_s| Some(end_s - at_s));
    let outcome = run(setup).unwrap();
    let free: Vec<Option<f64>> = ALL.iter().map(|relay| freed(&outcome, *relay)).collect();
    println!("free {free:?}, told {:?}", told(&outcome, 8));
    assert_eq!(free.iter().flatten().count(), 7);
    let mut order: Vec<f64> = free.iter().flatten().copied().collect();
    order.sort_by(f64::total_cmp);
    assert!(
        order.windows(2).all(|pair| pair[0] + 10.0 < pair[1]),
        "{order:?}"
    );
    let floor_s = f64::from(end_s - RESERVE_S);
    for (relay, (free, told)) in (1..).zip(free.iter().zip(told(&outcome, 8))) {
        let floor_s = floor_s - 10.0 * f64::from(8 - relay);
        // A relay that may leave is switched off in this simulation.
        let told = told.filter(|_| free.is_none());
        assert!(
            told.is_none_or(|told| (15.0..17.0).contains(&(told - floor_s))),
            "{told:?}"
        );
    }
}

/// Checks that no two pilots are told to leave within 3 s, although departures take long. They take long because no drone arrives at its
/// position.
#[test]
fn a_slow_fleet_of_equal_endurance_leaves_one_by_one() {
    let end_s = 2 * RESERVE_S + AT_S as u16;
    let mut setup = drained(8, 300, |_, at_s| Some(end_s - at_s));
    setup.flight = Some(FlightSpec::multicopters(on_line(), 0.0, 8.0));
    let outcome = run(setup).unwrap();
    let may = |relay| times(&outcome, relay, |what| what == TimelineEvent::MayLeave);
    let free: Vec<Option<f64>> = ALL
        .iter()
        .map(|relay| may(*relay).first().copied())
        .collect();
    let told = told(&outcome, 8);
    println!("free {free:?}, told {told:?}");
    let first = free
        .iter()
        .zip(&told)
        .filter_map(|(free, told)| free.or(*told));
    let mut order: Vec<f64> = first.collect();
    order.sort_by(f64::total_cmp);
    assert_eq!(order.len(), 8);
    assert!(
        order.windows(2).all(|pair| pair[0] + 3.0 < pair[1]),
        "{order:?}"
    );
}

/// Checks that pilots are told to leave one by one if the chain refuses all departures. The chain refuses them because the relays have no
/// motion guard.
#[test]
fn a_refused_fleet_is_told_one_by_one() {
    let end_s = 2 * RESERVE_S + AT_S as u16;
    let mut setup = drained(8, 300, |_, at_s| Some(end_s - at_s));
    setup.settings.leave_without_guard = false;
    let outcome = run(setup).unwrap();
    let mut order: Vec<f64> = told(&outcome, 8).into_iter().flatten().collect();
    order.sort_by(f64::total_cmp);
    println!("told at {order:?} s");
    assert_eq!(order.len(), 8);
    assert!(
        order.windows(2).all(|pair| pair[0] + 20.0 < pair[1]),
        "{order:?}"
    );
    let floor_s = f64::from(end_s - RESERVE_S);
    assert!((15.0..17.0).contains(&(order[7] - floor_s)), "{order:?}");
}

/// Checks that a relay withdraws its request to leave when its endurance recovers. A granted request is not withdrawn.
#[test]
fn a_request_is_withdrawn_until_it_is_granted() {
    // Relays 3 and 6 are low; 3 has the lower number and leaves first. Both recover right after the request.
    let recovers_s = AT_S as u16 + 16;
    let left_s = |relay, at_s| match relay {
        3 | 6 if (AT_S as u16..recovers_s).contains(&at_s) => Some(340 - at_s / 10),
        _ => Some(900),
    };
    let outcome = run(drained(8, 300, left_s)).unwrap();
    println!("told {:?}", told(&outcome, 8));
    assert!(freed(&outcome, 3).is_some());
    assert!(freed(&outcome, 6).is_none());
    assert_eq!(outcome.relays[5].killed, None);
}

/// Checks that an endurance that is low for less than 15 s causes no departure.
#[test]
fn a_short_low_endurance_causes_nothing() {
    for low_s in [1, 5, 10, 14] {
        let from_s = AT_S as u16;
        let left_s = |_, at_s| {
            Some(if (from_s..from_s + low_s).contains(&at_s) {
                0
            } else {
                900
            })
        };
        let setup = drained(8, 120, left_s);
        let outcome = run(setup.clone()).unwrap();
        judge(&setup, &outcome, &ALL).unwrap();
        assert!(told(&outcome, 8).iter().all(Option::is_none), "{low_s} s");
        assert!(views(&outcome, 4) <= 1);
    }
}

/// Checks that relays without a reserve never leave because of their endurance.
#[test]
fn without_a_reserve_no_relay_leaves_by_itself() {
    let mut setup = drained(8, 200, |_, at_s| Some(100_u16.saturating_sub(at_s)));
    setup.reserve = None;
    let outcome = run(setup.clone()).unwrap();
    judge(&setup, &outcome, &ALL).unwrap();
    assert!(told(&outcome, 8).iter().all(Option::is_none));
}

/// Checks that the initial leader stays outside the chain if it requests to leave at its restart.
#[test]
fn a_first_leader_that_restarts_and_leaves_stays_outside() {
    let mut setup = departing(8, &[]);
    let leader = setup.mission.leader();
    setup.kills = vec![(leader, seconds(AT_S - 5))];
    setup.boots = vec![(leader, seconds(AT_S - 3))];
    // Before the restarted relay handles any timeout, as the companion does.
    setup.leaves.push((leader, seconds(AT_S - 3), Some(60)));
    let outcome = run(setup.clone()).unwrap();
    judge(&setup, &outcome, &without(&[leader])).unwrap();
    assert!(freed(&outcome, leader).is_some());
    let since = AT_S as f64 - 3.0;
    let takes_part = |what| {
        matches!(
            what,
            TimelineEvent::ViewAccepted { .. } | TimelineEvent::Converged
        )
    };
    let taken = times(&outcome, leader, takes_part);
    assert!(taken.iter().all(|at| *at < since), "{taken:?}");
}

/// Checks that the initial leader rejoins the chain if it cancels its request to leave by `stay`. If it already has the
/// permission to leave, it stays outside the chain. The request comes at the chain's start or after a restart of the
/// leader.
#[test]
fn a_first_leader_that_left_joins_again() {
    for at_s in [0, AT_S - 3] {
        let mut setup = departing(8, &[]);
        let leader = setup.mission.leader();
        if at_s > 0 {
            setup.kills = vec![(leader, seconds(at_s - 2))];
            setup.boots = vec![(leader, seconds(at_s))];
        }
        setup.leaves = vec![(leader, seconds(at_s), None)];
        for stays_ms in [500, 3_000, 8_000] {
            let at = Instant::from_millis(1_000 * at_s + stays_ms);
            setup.stays = vec![(leader, at)];
            let outcome = run(setup.clone()).unwrap();
            let is_free = freed(&outcome, leader).is_some();
            let left = if is_free {
                without(&[leader])
            } else {
                ALL.to_vec()
            };
            println!("{at_s} s, {stays_ms} ms: free {is_free}");
            judge(&setup, &outcome, &left)
                .unwrap_or_else(|what| panic!("{at_s} s, {stays_ms} ms: {what}"));
        }
    }
}

/// Checks that a restarted relay that requests to leave rejoins if the others need it for a quorum.
#[test]
fn a_restarted_relay_that_is_needed_returns() {
    let mut setup = departing(4, &[]);
    setup.kills = vec![(4, seconds(60)), (3, seconds(100)), (1, seconds(150))];
    setup.boots = vec![(1, seconds(152))];
    setup.leaves.push((1, seconds(152), Some(60)));
    end_at(&mut setup, seconds(600));
    let outcome = run(setup).unwrap();
    let accepted = |what| matches!(what, TimelineEvent::ViewAccepted { .. });
    let times = times(&outcome, 2, accepted);
    println!("relay 2 accepts views at {times:?}");
    assert!(times.last().is_some_and(|at| *at > 152.0), "{times:?}");
    assert!(outcome.relays[1].observed.leased);
}
