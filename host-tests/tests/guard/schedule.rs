//! Random schedule: a line of drones, random events, and a final check.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | relays | 1 to 12 |
//! | separation | log-uniform 1 m to 50 m; in 5 % 0 |
//! | distance from Tx to Rx | in 40 % 1.001 to 1.5 times the product of separation and number of relays; else 2 to 20 times that |
//! | error of reported positions | 0 in 70 %; else up to a twentieth of the separation |
//! | start and agreed positions | anywhere across the line; in order, the separation apart along x, crowded at Tx, at Rx, in the middle, or spread |
//! | neighbours | closer along x than the separation in half of the agreements, depending on their positions across the line |
//! | further agreements | when neighbours link past a relay: 40 s before on positions close along x, up to 5 s after on other positions |
//! | agreements | 0 to 6 in 200 s, each received by a relay with 80 %, up to 60 s late; 20 % closer along x than the separation |
//! | speed | changes every 20 s on average, 0 in 25 %, else 1 m/s to 40 m/s |
//! | acceleration | without a limit in 50 %, else 4 m/s^2 to 40 m/s^2 |
//! | medium | loses 0 to 50 %, duplicates 0 to 30 %, delays up to 0.1 s to 8 s |
//! | reports | every 0.1 s to 10 s, up to 0 to 5 s old |
//! | failures | a reboot of up to 15 s; silence of up to 60 s while the neighbours link past the relay; removal for good |
//! | pilots | in half of the schedules each takes its drone with 30 %, up to twice: for 5 s to 60 s, or until the end; it brakes and hovers, its guard is informed up to 1.5 s later; in half of the cases the pilot then moves it up to 30 m across the line, away from the others, and in half, once both neighbours know of the takeover, along the line, the separation clear of the others |
//!
//! In the final phase the medium loses up to 30 %, all drones fly, and all relays receive the same agreement.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{Duration, Side};
use uav_relay::{Geofence, GuardConfig};

use uav_relay_sim::simulator::drones::Point;

use crate::agenda::*;
use crate::drone::{Board, length, place, way};
use crate::medium::Faults;
use crate::world::{World, beside};

#[derive(Debug, Default)]
pub(crate) struct Report {
    pub(crate) steps: u64,
    pub(crate) heard: u64,
    pub(crate) reboots: u64,
    pub(crate) silences: u64,
    pub(crate) gone: u64,
    /// Number of drones that pilots took over.
    pub(crate) taken: u64,
    /// Number of drones that their pilots moved along the line.
    pub(crate) along: u64,
    /// Number of pairs of neighbours whose final positions are closer along x than the separation.
    pub(crate) close: u64,
    pub(crate) closest_m: f64,
    pub(crate) share_of_time: f64,
    pub(crate) messages: f64,
}

pub(crate) fn fly(seed: u64) -> Report {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x00C0_FFEE);
    let config = random_config(&mut rng);
    let relays = rng.random_range(1..=12);
    let (config, starts) = line(&mut rng, config, relays);
    let agile = rng.random_bool(0.5);
    let acceleration = if agile {
        f64::INFINITY
    } else {
        rng.random_range(4.0..=40.0)
    };
    let latency_s = config.lag.as_micros() as f64 / 1e6;
    let to_stop = Duration::from_micros((FASTEST / acceleration * 1e6) as u64);
    let config = GuardConfig {
        lag: Duration::from_micros(config.lag.as_micros() + to_stop.as_micros()),
        ..config
    };
    let mut world = World::new(seed, config, &starts);
    for drone in &mut world.drones {
        (drone.acceleration, drone.latency_s) = (acceleration, latency_s);
    }
    let mut report = Report::default();
    rough(&mut rng, &mut world, &mut report);
    calm(&mut rng, &mut world, &mut report);
    report.steps = world.steps;
    report.closest_m = world.closest_m;
    report
}

fn random_config(rng: &mut ChaCha8Rng) -> GuardConfig {
    let separation = if rng.random_bool(0.05) {
        0.0
    } else {
        50.0_f64.powf(rng.random_range(0.0..=1.0))
    };
    let hover = if rng.random_bool(0.7) {
        0.0
    } else {
        separation * rng.random_range(0.0..=0.05)
    };
    GuardConfig {
        geofence: Geofence {
            least_x_m: 0.0,
            most_x_m: 0.0,
            least_y_m: -80.0,
            most_y_m: 40.0,
            least_altitude_m: 20.0,
            most_altitude_m: 120.0,
        },
        separation_m: separation as f32,
        relays: 1,
        hover_m: hover as f32,
        lag: Duration::from_millis(rng.random_range(0..=600)),
    }
}

/// Draws the line's length. Returns the guard's configuration with this length, and the drones' start positions.
fn line(rng: &mut ChaCha8Rng, mut config: GuardConfig, relays: usize) -> (GuardConfig, Vec<Point>) {
    let taken = f64::from(config.separation_m) * relays as f64;
    let distance = if rng.random_bool(0.4) {
        taken * rng.random_range(1.001..=1.5)
    } else {
        taken * rng.random_range(2.0..=20.0)
    };
    config.geofence.most_x_m = distance.max(10.0) as f32;
    config.relays = relays as u16;
    let starts = places(rng, &config, relays);
    (config, starts)
}

/// Runs the first phase of the flight, with all random faults and events.
fn rough(rng: &mut ChaCha8Rng, world: &mut World, report: &mut Report) {
    world.faults = Faults {
        loss: rng.random_range(0.0..=0.5),
        twice: rng.random_range(0.0..=0.3),
        delay_s: 80.0_f64.powf(rng.random_range(0.0..=1.0)) / 10.0,
    };
    world.board = Board {
        every_s: 100.0_f64.powf(rng.random_range(0.0..=1.0)) / 10.0,
        stale_s: rng.random_range(0.0..=5.0),
    };
    let mut plan = agreements(rng, world);
    plan.extend(speeds(rng, world.drones.len()));
    let troubles = failures(rng, world.drones.len());
    let around_s: Vec<f64> = troubles
        .iter()
        .filter(|(_, what)| matches!(what, FlightEvent::Around(..)))
        .map(|(at_s, _)| *at_s)
        .collect();
    // The remaining relays agree twice: first on positions close to the silent relay, then on others.
    for at_s in around_s {
        let before = places(rng, &world.config, world.drones.len());
        let before = closer(rng, &world.config, before, false);
        let after = places(rng, &world.config, world.drones.len());
        for (k, (before, after)) in before.into_iter().zip(after).enumerate() {
            plan.push((at_s - 40.0, FlightEvent::Setpoint(k, before)));
            plan.push((
                at_s + rng.random_range(0.0..=5.0),
                FlightEvent::Setpoint(k, after),
            ));
        }
    }
    let pilots = pilots(rng, world.drones.len(), &troubles);
    plan.extend(troubles);
    plan.extend(pilots);
    plan.extend(orders(rng, world.drones.len()));
    plan.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut plan = plan.into_iter().peekable();
    while world.now_s < ROUGH_S {
        while let Some((_, what)) = plan.next_if(|(at_s, _)| *at_s <= world.now_s) {
            apply(world, what, report);
        }
        world.step();
    }
    for (_, what) in plan {
        apply(world, what, report);
    }
}

fn apply(world: &mut World, what: FlightEvent, report: &mut Report) {
    match what {
        FlightEvent::Setpoint(k, at) => {
            report.heard += 1;
            if let Some(guard) = &mut world.drones[k].guard {
                guard.set_goal(place(at));
            }
        }
        FlightEvent::Off(k) => {
            report.reboots += 1;
            world.drones[k].guard = None;
        }
        FlightEvent::On(k) => {
            if world.drones[k].guard.is_none() {
                world.boot(k);
            }
        }
        FlightEvent::Mute(k) => {
            report.silences += 1;
            world.drones[k].speaks = false;
        }
        FlightEvent::Unmute(k) => world.drones[k].speaks = true,
        FlightEvent::Vanish(k) => {
            report.gone += 1;
            world.drones[k].flies = false;
        }
        FlightEvent::Around(who, side, k, other) => {
            if !(world.drones[k].speaks && world.drones[k].flies) {
                world.link(who, side, other);
            }
        }
        FlightEvent::Back(who, side, k) => world.link(who, side, Some(k)),
        FlightEvent::Forget(k, side) => {
            if let Some(guard) = &mut world.drones[k].guard {
                guard.forget(side, false);
            }
        }
        FlightEvent::Speed(k, speed) => world.drones[k].speed = speed,
        FlightEvent::PilotTakesOver(k) => {
            report.taken += 1;
            world.drones[k].pilot_takes_over(world.now_s);
        }
        FlightEvent::GuardLearnsOfPilot(k) => world.drones[k].is_flown(world.now_s),
        FlightEvent::Aside(k, way) => world.aside(k, way),
        FlightEvent::Along(k, share) => report.along += u64::from(world.along(k, share)),
        FlightEvent::PilotHandsBack(k) => world.drones[k].pilot_hands_back(world.now_s),
        FlightEvent::Leaver(k, leaver) => {
            if let Some(guard) = &mut world.drones[k].guard {
                guard.set_leaver(leaver);
            }
        }
    }
}

/// Runs the final phase of the flight. All relays receive the same agreement and must reach their positions.
fn calm(rng: &mut ChaCha8Rng, world: &mut World, report: &mut Report) {
    world.faults = Faults {
        loss: rng.random_range(0.0..=0.3),
        twice: 0.1,
        delay_s: 0.5,
    };
    world.board = Board {
        every_s: 0.4,
        stale_s: 0.2,
    };
    let left: Vec<usize> = (0..world.drones.len())
        .filter(|k| world.drones[*k].flies)
        .collect();
    let mut targets = places(rng, &world.config, left.len());
    if rng.random_bool(0.5) {
        targets = closer(rng, &world.config, targets, false);
        let apart_m = f64::from(world.config.separation_m);
        let steps = targets.windows(2).map(|pair| pair[1][0] - pair[0][0]);
        report.close += steps.filter(|step| *step < 0.99 * apart_m).count() as u64;
    }
    for drone in &mut world.drones {
        drone.pilot_hands_back(world.now_s);
    }
    let relays = world.drones.len();
    let gone: Vec<bool> = world.drones.iter().map(|drone| !drone.flies).collect();
    for (k, target) in left.iter().zip(&targets) {
        let drone = &mut world.drones[*k];
        drone.messages = 0;
        drone.speed = rng.random_range(SLOWEST..=20.0);
        let guard = drone.guard.as_mut().unwrap();
        // A relay that was rebooted does not know which relays are gone.
        for (side, there) in [Side::Upstream, Side::Downstream]
            .into_iter()
            .zip(beside(*k, relays))
        {
            if there.is_some_and(|there| gone[there]) {
                guard.forget(side, false);
            }
        }
        guard.set_leaver(0);
        guard.set_goal(place(*target));
    }
    let distance = f64::from(world.config.geofence.most_x_m);
    let (begun_s, allowed_s) = (
        world.now_s,
        left.len() as f64 * (10.0 + length([distance, 120.0, 100.0]) / SLOWEST),
    );
    while !left
        .iter()
        .all(|k| world.drones[*k].guard.as_ref().unwrap().has_arrived())
    {
        assert!(
            world.now_s < begun_s + allowed_s,
            "SEED={}: not there within {allowed_s:.0} s: {:#?}",
            world.seed,
            left.iter()
                .map(|k| (
                    k,
                    world.drones[*k].body.at[0],
                    targets.len(),
                    world.drones[*k].guard
                ))
                .collect::<Vec<_>>()
        );
        world.step();
    }
    let off = f64::from(world.config.hover_m) + world.allowed_m();
    for (k, target) in left.iter().zip(&targets) {
        let at = world.drones[*k].body.at;
        assert!(
            way(at, *target).iter().all(|part| part.abs() <= off),
            "{at:?} {target:?}"
        );
    }
    report.share_of_time = (world.now_s - begun_s) / allowed_s;
    let messages: u64 = left.iter().map(|k| world.drones[*k].messages).sum();
    report.messages = messages as f64 / left.len() as f64 / (world.now_s - begun_s).max(1.0);
}
