//! Number of groups that fly different agreements.

use uav_relay::{Phase, ViewId};
use uav_relay_sim::simulator::watch::{ObservedState, groups, has_agreed};

/// Returns the state of relay `index` of `relays`, with a valid position, in membership view `view`.
fn seen(view: u32, relays: u16, index: u16) -> ObservedState {
    ObservedState {
        is_on: true,
        phase: Phase::Holding,
        view: ViewId::from_bits(view),
        leased: true,
        relays,
        index,
        version: 0,
        target: Some(2.0),
        place: Some([1.0, 0.0, 20.0]),
    }
}

#[test]
fn relays_of_one_view_are_one_group_and_of_two_views_two() {
    let mut all: Vec<ObservedState> = (1..=4).map(|index| seen(0, 4, index)).collect();
    assert_eq!(groups(&all), 1);
    all[3] = seen(1, 1, 1);
    assert_eq!(groups(&all), 2);
    // Both parts use the same view number, each for its own view.
    let parts = [(2, 1), (2, 2), (3, 1), (3, 2), (3, 3)];
    let parts = parts.map(|(relays, index)| seen(1, relays, index));
    assert_eq!(groups(&parts), 2);
    let halves = [1, 2, 1, 2].map(|index| seen(1, 2, index));
    assert_eq!(groups(&halves), 2);
}

/// Function that changes one field of a relay's observed state, so that its position becomes invalid.
type Change = fn(&mut ObservedState);

#[test]
fn without_power_position_or_lease_no_relay_flies() {
    let all = || vec![seen(0, 2, 1), seen(1, 1, 1)];
    let changes: [Change; 3] = [
        |one| one.is_on = false,
        |one| one.place = None,
        |one| one.leased = false,
    ];
    for change in changes {
        let mut all = all();
        change(&mut all[1]);
        assert_eq!(groups(&all), 1, "{all:?}");
    }
    // A relay flies until its lease has expired, whatever its phase is.
    let mut part = vec![seen(0, 3, 1), seen(0, 3, 2)];
    part[0].phase = Phase::NoQuorum;
    assert_eq!(groups(&part), 1);
}

#[test]
fn an_agreement_needs_all_relays_of_a_view_at_one_target() {
    let all = || vec![seen(0, 2, 1), seen(0, 2, 2)];
    assert!(has_agreed(&all()));
    assert!(!has_agreed(&all()[..1]));
    let mut other = all();
    other[1].target = Some(1.0);
    assert!(!has_agreed(&other));
    let mut busy = all();
    busy[0].phase = Phase::Waiting;
    assert!(!has_agreed(&busy));
}
