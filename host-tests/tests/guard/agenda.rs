//! Random events of a flight and their times.

use chacha20::ChaCha8Rng;
use rand::RngExt;
use uav_relay::GuardConfig;
use uav_relay::Side;

use uav_relay_sim::simulator::drones::Point;

use crate::drone::node;
use crate::world::{World, beside};

pub(crate) const ROUGH_S: f64 = 200.0;
pub(crate) const SLOWEST: f64 = 2.0;
pub(crate) const FASTEST: f64 = 40.0;

/// Random event of a simulated flight. The first field is the index of the drone.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FlightEvent {
    Setpoint(usize, Point),
    Off(usize),
    On(usize),
    Mute(usize),
    Unmute(usize),
    Vanish(usize),
    /// The drone's relay skips its silent neighbour on one side and links to the next relay. The fields are the drone,
    /// the side, the silent relay, and the new neighbour, if any.
    Around(usize, Side, usize, Option<usize>),
    Back(usize, Side, usize),
    Forget(usize, Side),
    Speed(usize, f64),
    /// The drone's pilot takes control of the drone.
    PilotTakesOver(usize),
    /// The drone's motion guard is informed that its pilot has control.
    GuardLearnsOfPilot(usize),
    /// The pilot moves the drone across the line. The second field has the axis (1 for y, 2 for altitude), the
    /// direction (true for positive), and the largest distance, m.
    Aside(usize, (usize, bool, f64)),
    /// The pilot moves the drone along the line. The second field is the target x as a fraction of the permitted range
    /// of x, counted from Tx.
    Along(usize, f64),
    /// The pilot gives control back to the motion guard.
    PilotHandsBack(usize),
    /// The drone's motion guard is informed of the order to leave. The second field is the number of the relay that
    /// must leave; 0 for none.
    Leaver(usize, u16),
}

/// Plans orders to leave. The relays receive an order at different times, and some never.
pub(crate) fn orders(rng: &mut ChaCha8Rng, relays: usize) -> Vec<(f64, FlightEvent)> {
    let mut plan = Vec::new();
    for _ in 0..rng.random_range(0..=6) {
        let at_s = rng.random_range(0.0..ROUGH_S - 20.0);
        let leaver = if rng.random_bool(0.3) {
            0
        } else {
            node(rng.random_range(0..relays))
        };
        for k in 0..relays {
            if rng.random_bool(0.9) {
                let late_s = 20.0 * rng.random_range(0.0..=1.0_f64).powi(3);
                plan.push((at_s + late_s, FlightEvent::Leaver(k, leaver)));
            }
        }
    }
    plan
}

pub(crate) fn agreements(rng: &mut ChaCha8Rng, world: &World) -> Vec<(f64, FlightEvent)> {
    let mut plan = Vec::new();
    for _ in 0..rng.random_range(0..=6) {
        let at_s = rng.random_range(0.0..ROUGH_S - 60.0);
        let mut config = world.config;
        if rng.random_bool(0.2) {
            config.separation_m *= rng.random_range(0.0..=1.0);
        }
        let mut agreed = places(rng, &config, world.drones.len());
        if rng.random_bool(0.5) {
            let wild = rng.random_bool(0.3);
            agreed = closer(rng, &world.config, agreed, wild);
        }
        for (k, at) in agreed.into_iter().enumerate() {
            if rng.random_bool(0.8) {
                plan.push((
                    at_s + 60.0 * rng.random_range(0.0..=1.0_f64).powi(3),
                    FlightEvent::Setpoint(k, at),
                ));
            }
        }
    }
    plan
}

pub(crate) fn speeds(rng: &mut ChaCha8Rng, relays: usize) -> Vec<(f64, FlightEvent)> {
    let mut plan = Vec::new();
    for k in 0..relays {
        let mut at_s = 0.0;
        while at_s < ROUGH_S {
            let speed = if rng.random_bool(0.25) {
                0.0
            } else {
                FASTEST.powf(rng.random_range(0.0..=1.0))
            };
            plan.push((at_s, FlightEvent::Speed(k, speed)));
            at_s += rng.random_range(1.0..=40.0);
        }
    }
    plan
}

/// Plans reboots, silent relays and removed drones. Of three relays in a row, at most one falls silent or is removed.
pub(crate) fn failures(rng: &mut ChaCha8Rng, relays: usize) -> Vec<(f64, FlightEvent)> {
    let mut plan = Vec::new();
    let mut left_out = 0;
    for k in 0..relays {
        let at_s = rng.random_range(5.0..ROUGH_S - 90.0);
        match rng.random_range(0..10) {
            0..=3 => {
                plan.push((at_s, FlightEvent::Off(k)));
                plan.push((at_s + rng.random_range(0.0..=15.0), FlightEvent::On(k)));
            }
            kind @ 4..=6 if relays > 2 && left_out < k => {
                left_out = k + 2;
                around(rng, &mut plan, (k, relays), at_s, kind == 6);
            }
            _ => {}
        }
    }
    plan
}

/// Plans takeovers of drones by their pilots. Removed drones, and drones next to these, are not taken over. `troubles`
/// has the planned removals and silent relays.
pub(crate) fn pilots(
    rng: &mut ChaCha8Rng,
    relays: usize,
    troubles: &[(f64, FlightEvent)],
) -> Vec<(f64, FlightEvent)> {
    let mut plan = Vec::new();
    if rng.random_bool(0.5) {
        return plan;
    }
    for k in 0..relays {
        let beside_gone = troubles
            .iter()
            .any(|(_, what)| matches!(what, FlightEvent::Vanish(gone) if gone.abs_diff(k) <= 1));
        if beside_gone || rng.random_bool(0.7) {
            continue;
        }
        let mut at_s = rng.random_range(1.0..ROUGH_S - 20.0);
        for _ in 0..rng.random_range(1..=2) {
            plan.push((at_s, FlightEvent::PilotTakesOver(k)));
            let told_s = at_s + rng.random_range(0.0..=1.5);
            plan.push((told_s, FlightEvent::GuardLearnsOfPilot(k)));
            if rng.random_bool(0.5) {
                let most_m = rng.random_range(1.0..=30.0);
                let way = (rng.random_range(1..=2), rng.random(), most_m);
                plan.push((told_s, FlightEvent::Aside(k, way)));
            }
            let is_alone = troubles.iter().all(|(_, what)| {
                !matches!(what, FlightEvent::Mute(other) | FlightEvent::Vanish(other) if other.abs_diff(k) <= 3)
            });
            if is_alone && rng.random_bool(0.5) {
                let later_s = told_s + rng.random_range(0.5..=15.0);
                plan.push((later_s, FlightEvent::Along(k, rng.random_range(0.0..=1.0))));
            }
            if rng.random_bool(0.2) {
                break;
            }
            let back_s = at_s + rng.random_range(5.0..=60.0);
            plan.push((back_s, FlightEvent::PilotHandsBack(k)));
            at_s = back_s + 20.0 * rng.random_range(0.01..=1.0_f64).powi(2);
        }
    }
    plan
}

/// Plans that relay `k` falls silent at `at_s`, and that its neighbours then link to each other. The relay's radio works again later,
/// except if the drone is `gone`.
pub(crate) fn around(
    rng: &mut ChaCha8Rng,
    plan: &mut Vec<(f64, FlightEvent)>,
    (k, relays): (usize, usize),
    at_s: f64,
    gone: bool,
) {
    let [before, after] = beside(k, relays);
    plan.push((
        at_s,
        if gone {
            FlightEvent::Vanish(k)
        } else {
            FlightEvent::Mute(k)
        },
    ));
    let back_s = at_s + rng.random_range(10.0..=60.0);
    for (who, side, other) in [
        (before, Side::Downstream, after),
        (after, Side::Upstream, before),
    ] {
        let Some(who) = who else { continue };
        plan.push((
            at_s + rng.random_range(0.0..=10.0),
            FlightEvent::Around(who, side, k, other),
        ));
        let then_s = back_s + rng.random_range(0.0..=10.0);
        plan.push(if gone {
            (then_s, FlightEvent::Forget(who, side))
        } else {
            (then_s, FlightEvent::Back(who, side, k))
        });
    }
    if !gone {
        plan.push((back_s, FlightEvent::Unmute(k)));
    }
}

/// Returns random positions in order along x, with the minimum separation or more between neighbours.
pub(crate) fn places(rng: &mut ChaCha8Rng, config: &GuardConfig, relays: usize) -> Vec<Point> {
    let distance = f64::from(config.geofence.most_x_m);
    let step = f64::from(config.separation_m) + 5e-7 * distance;
    let slack = distance - step * (relays - 1) as f64;
    let (from, to) = match rng.random_range(0..4) {
        0 => (0.0, 0.05),
        1 => (0.95, 1.0),
        2 => (0.4, 0.5),
        _ => (0.0, 1.0),
    };
    let mut spare: Vec<f64> = (0..relays)
        .map(|_| slack * rng.random_range(from..=to))
        .collect();
    spare.sort_by(f64::total_cmp);
    (0..relays)
        .map(|k| {
            let x = spare[k] + step * k as f64;
            let (y, h): (f32, f32) = (
                rng.random_range(-80.0..=40.0),
                rng.random_range(20.0..=120.0),
            );
            [x as f32, y, h].map(f64::from)
        })
        .collect()
}

/// Moves random pairs of neighbours closer along x, but keeps their minimum separation in space.
///
/// Relays that are not neighbours keep the minimum separation along x, unless `wild` is true.
pub(crate) fn closer(
    rng: &mut ChaCha8Rng,
    config: &GuardConfig,
    mut at: Vec<Point>,
    wild: bool,
) -> Vec<Point> {
    let rounding = 5e-7 * f64::from(config.geofence.most_x_m);
    let apart = 1.0001 * f64::from(config.separation_m) + rounding;
    let fence = config.geofence;
    let inside = |y: f64, h: f64| {
        (f64::from(fence.least_y_m)..=f64::from(fence.most_y_m)).contains(&y)
            && (f64::from(fence.least_altitude_m)..=f64::from(fence.most_altitude_m)).contains(&h)
    };
    let mut before = apart;
    for k in 1..at.len() {
        let [x, y, h] = at[k - 1];
        let most = (at[k][0] - x).min(apart);
        let least = if wild { 0.0 } else { (apart - before).max(0.0) };
        before = at[k][0] - x;
        if rng.random_bool(0.5) || least >= most {
            continue;
        }
        let step = if rng.random_bool(0.3) {
            least
        } else {
            rng.random_range(least..=most)
        };
        let aside = (apart * apart - step * step).max(0.0).sqrt();
        let turn = rng.random_range(0.0..=std::f64::consts::TAU);
        let (y, h) = (y + aside * turn.sin(), h + aside * turn.cos());
        if wild && k > 1 && rng.random_bool(0.5) {
            at[k] = [x + step, at[k - 2][1], at[k - 2][2]].map(|part| f64::from(part as f32));
            before = step;
        } else if inside(y, h) {
            at[k] = [x + step, y, h].map(|part| f64::from(part as f32));
            before = step;
        }
    }
    at
}
