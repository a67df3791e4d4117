//! Shift of a chain with the smallest possible spacing, and the time it takes.

use uav_relay::HoldReason;
use uav_relay::{Duration, Side};
use uav_relay::{Geofence, GuardConfig};

use uav_relay_sim::simulator::drones::Point;

use crate::drone::{place, way};
use crate::world::World;

const SPEED: f64 = 10.0;

fn world(relays: usize, from_m: f64, step_m: f64) -> World {
    let config = GuardConfig {
        geofence: Geofence {
            least_x_m: 0.0,
            most_x_m: 1000.0,
            least_y_m: -100.0,
            most_y_m: 100.0,
            least_altitude_m: 20.0,
            most_altitude_m: 120.0,
        },
        separation_m: 10.0,
        relays: relays as u16,
        hover_m: 0.0,
        lag: Duration::from_millis(200),
    };
    let mut world = World::new(1, config, &row(relays, from_m, step_m));
    for drone in &mut world.drones {
        drone.speed = SPEED;
    }
    world
}

fn row(relays: usize, from_m: f64, step_m: f64) -> Vec<Point> {
    (0..relays)
        .map(|k| [from_m + step_m * k as f64, 0.0, 50.0])
        .collect()
}

fn commit(world: &mut World, places: &[Point]) {
    for (drone, at) in world.drones.iter_mut().zip(places) {
        drone.guard.as_mut().unwrap().set_goal(place(*at));
    }
}

/// Runs the flight until all drones have reached their agreed positions. Returns the time taken, s.
fn time(world: &mut World) -> f64 {
    let begun_s = world.now_s;
    while !world
        .drones
        .iter()
        .all(|drone| drone.guard.as_ref().unwrap().has_arrived())
    {
        assert!(world.now_s < begun_s + 1000.0, "they do not get there");
        world.step();
    }
    world.now_s - begun_s
}

#[test]
fn a_tight_row_of_drones_shifts_in_both_directions() {
    for shift_m in [4.0, -4.0, 100.0, -100.0] {
        let mut world = world(12, 400.0, 10.0);
        let start = row(12, 400.0, 10.0);
        commit(&mut world, &start);
        let agreed_s = time(&mut world);
        let targets: Vec<Point> = start
            .iter()
            .map(|[x, y, h]| [x + shift_m, *y, *h])
            .collect();
        commit(&mut world, &targets);
        let shifted_s = time(&mut world);
        println!(
            "12 relays 10 m apart: {agreed_s:.1} s to agree on the fences, {shifted_s:.1} s for {shift_m} m"
        );
        // In the worst case the drones fly one after the other, each with a second for its messages.
        assert!(shifted_s < 12.0 * (1.0 + shift_m.abs() / SPEED));
    }
}

/// Checks that drones come as near as the separation permits to agreed positions that are too close.
///
/// The positions of three drones are 4 m apart along x. The outer two positions are therefore 8 m apart, but these
/// drones must keep the separation of 10 m.
#[test]
fn drones_approach_positions_that_are_too_close() {
    let mut world = world(5, 100.0, 100.0);
    let targets = [
        [50.0, 10.0, 30.0],
        [300.0, -20.0, 40.0],
        [304.0, -8.0, 40.0],
        [308.0, -20.0, 40.0],
        [600.0, 50.0, 70.0],
    ];
    commit(&mut world, &targets);
    for _ in 0..3000 {
        world.step();
    }
    let ends: Vec<Point> = world.drones.iter().map(|drone| drone.body.at).collect();
    println!("{ends:?}");
    for k in [0, 4] {
        assert!(
            world.drones[k].guard.as_ref().unwrap().has_arrived(),
            "{ends:?}"
        );
    }
    for k in 1..4 {
        let [dx, dy, dh] = way(targets[k], ends[k]);
        assert!(dx.abs() < 3.0, "{ends:?}");
        assert!(dy.hypot(dh) < 0.1, "across the line is free: {ends:?}");
    }
    let [outer, _, other] = [1, 2, 3].map(|k| ends[k][0]);
    assert!((other - outer - 10.0).abs() < 0.01, "{ends:?}");
    let close = |k: usize, side| {
        world.drones[k].guard.as_ref().unwrap().hold_reason(side) == Some(HoldReason::Close)
    };
    let seen: Vec<[bool; 2]> = (0..5)
        .map(|k| [close(k, Side::Upstream), close(k, Side::Downstream)])
        .collect();
    assert!(seen.as_flattened().contains(&true), "{seen:?}");
    let before: Vec<Point> = ends;
    for _ in 0..600 {
        world.step();
    }
    let after: Vec<Point> = world.drones.iter().map(|drone| drone.body.at).collect();
    assert_eq!(before, after, "they stay");
}

/// Checks that drones reach positions above or beside each other, exchange places, and fly back.
#[test]
fn positions_above_each_other_are_reached_and_left() {
    let mut world = world(4, 300.0, 20.0);
    let stacked = [
        [300.0, 0.0, 50.0],
        [300.0, 0.0, 61.0],
        [311.0, -20.0, 50.0],
        [311.0, -9.0, 50.0],
    ];
    let turned = [
        [300.0, 0.0, 61.0],
        [300.0, 0.0, 50.0],
        [311.0, -9.0, 50.0],
        [311.0, -20.0, 50.0],
    ];
    let start = row(4, 300.0, 20.0);
    for targets in [&stacked[..], &turned, &stacked, &start] {
        commit(&mut world, targets);
        println!("{:.1} s", time(&mut world));
        for (drone, target) in world.drones.iter().zip(targets) {
            let off = way(drone.body.at, *target);
            assert!(off.iter().all(|part| part.abs() < 1e-3), "{off:?}");
        }
    }
}
