//! Block with Tx and Rx positions: the autopilot gets targets once its pilot engages the relay.

use relay_app::drone::Refused;
use uav_relay::flight::course::CourseError;
use uav_relay::{Event, Placement};
use uav_relay_block::Sites;

use crate::bench::{Bench, SITES, alone, block_alone, refused_with_autopilot};
use crate::ram::Ram;
use crate::vehicle::Vehicle;

fn apart(a: Placement, b: Placement) -> f32 {
    let apart = [a.x_m - b.x_m, a.y_m - b.y_m, a.altitude_m - b.altitude_m];
    apart.map(|part| part * part).iter().sum::<f32>().sqrt()
}

/// Checks the targets that the autopilot receives.
///
/// On the ground there are none. While the pilot flies, they are the drone's position. Once the pilot chooses
/// OFFBOARD, the drone flies to its relay's position within the speed limit.
#[test]
fn a_drone_with_sites_is_flown_to_its_place_and_released() {
    let start = Placement::on_line(100.0, 20.0);
    let mut bench = Bench::with(Vehicle::new(start));
    bench.boot(Ram::blank().board(&block_alone(SITES), 1));
    bench.run(5_000);
    assert!(bench.vehicle().targets.is_empty(), "on the ground");

    bench.vehicle().flies = true;
    bench.run(5_000);
    let targets = std::mem::take(&mut bench.vehicle().targets);
    assert!(targets.len() > 10, "{targets:?}");
    assert!(targets.iter().all(|place| apart(*place, start) < 0.1));

    bench.vehicle().granted = true;
    let mut before = start;
    for _ in 0..150 {
        bench.run(1_000);
        // Speed limit 5 m/s.
        for place in std::mem::take(&mut bench.vehicle().targets) {
            assert!(apart(place, before) < 1.2, "{before:?}, then {place:?}");
            before = place;
        }
        bench.vehicle().targets.push(before);
    }
    let expected = alone(SITES);
    let place = bench.vehicle().place;
    println!("at {place:?}, its relay's place is {expected:?}");
    assert!(apart(start, expected) > 50.0, "a way to fly");
    assert!(apart(place, expected) < 0.1, "{place:?}, not {expected:?}");

    // The pilot takes over and moves the drone: no target leads it back.
    bench.vehicle().granted = false;
    bench.run(2_000);
    bench.vehicle().place.x_m += 60.0;
    bench.run(2_000);
    bench.vehicle().targets.clear();
    bench.run(5_000);
    let place = bench.vehicle().place;
    let targets = &bench.vehicle().targets;
    assert!(targets.len() > 10 && targets.iter().all(|to| apart(*to, place) < 0.1));
}

#[test]
fn sites_of_another_mission_are_refused() {
    let [tx, mut rx] = SITES.ends;
    rx[0] += 10_000;
    let sites = Sites {
        ends: [tx, rx],
        ..SITES
    };
    let why = refused_with_autopilot(Ram::blank().board(&block_alone(sites), 1));
    assert!(
        matches!(why, Refused::Course(CourseError::Distance(_))),
        "{why:?}"
    );
}

#[test]
fn a_chain_agrees_beside_an_autopilot() {
    let mut bench = Bench::with(Vehicle::new(Placement::on_line(100.0, 20.0)));
    bench.boot(Ram::blank().board(&crate::bench::block(Some(1), None), 1));
    assert!(bench.run(10_000).contains(&Event::Converged));
}
