//! Chains of unlike relays (held altitudes, own powers, fixed bands), and faults.

use std::task::Poll;

use chacha20::ChaCha8Rng;
use host_tests::flights::unharmed;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::optimiser::joint::{Seat, Solver};
use uav_relay::{Adjust, Method, Mission, MissionConfig, Profile};
use uav_relay_oracle::mission::as_relays_know_it;
use uav_relay_oracle::random::joint::{CROWDED, ROOMY, Scenario, scenario, with_own};
use uav_relay_oracle::random::{self, log_uniform};
use uav_relay_oracle::recorded::optimum;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{self, Corridor, Place};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

use super::*;

/// Draws a chain in the vertical plane in which some relays have their own power or a fixed altitude. Returns `None` if
/// all relays have the same power and none has a fixed altitude.
fn mixed(rng: &mut ChaCha8Rng) -> Option<(Scenario, Setup)> {
    let drawn = scenario(rng, &(2..=20), ROOMY);
    let mut drawn = with_own(rng, drawn).as_relays_know_it();
    let common = drawn.link.relays.iter().map(|relay| relay.power_w);
    // Relay 1 has the mission's profile, so it does not count as different.
    let first = common.clone().next()?;
    if drawn.held.is_empty() && common.into_iter().all(|power_w| power_w == first) {
        return None;
    }
    for hold in &drawn.held {
        drawn.link.relays[hold.relay].altitude_m = hold.altitude_m;
    }
    let alike = Link {
        relays: vec![drawn.link.relays[0]; drawn.link.len()],
        ..drawn.link.clone()
    };
    let mut setup = setup(&alike, drawn.corridor)?;
    let config = MissionConfig {
        common: make::profile(drawn.corridor.least_m as f32, first as f32),
        ..*setup.mission.config()
    };
    setup.mission = Mission::try_new(config).ok()?;
    for (relay, index) in drawn.link.relays.iter().zip(1..) {
        let own = make::profile(relay.altitude_m as f32, relay.power_w as f32);
        if own != config.common {
            setup.profiles.push((index, own));
        }
    }
    setup.held = drawn
        .held
        .iter()
        .map(|hold| hold.relay as u16 + 1)
        .collect();
    Some((drawn, setup))
}

/// Checks that chains with different powers or fixed altitudes come near the joint optimum. The SIR of a chain is
/// never below its SIR at the configured altitudes.
#[test]
fn different_relays_come_near_the_joint_optimum() {
    let count = count(200);
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(45));
    let (mut results, mut below) = (Vec::new(), Vec::new());
    while results.len() < count {
        let Some((drawn, joint_setup)) = mixed(&mut rng) else {
            continue;
        };
        let (link, corridor) = (&drawn.link, drawn.corridor);
        let Some(best) = optimum(link, corridor, &drawn.held).unwrap() else {
            continue;
        };
        let mut given = joint_setup.clone();
        given.settings.method = Method::Align;
        let given = run(given).unwrap();
        let outcome = run(joint_setup).unwrap();
        let list = |places: &[Place]| -> Vec<String> {
            let d = link.distance_m;
            let short = |at: &Place| format!("{:.3}/{:.4}", at.x_m / d, at.altitude_m / d);
            places.iter().map(short).collect()
        };
        let powers = link.relays.iter().map(|relay| relay.power_w);
        let of = format!(
            "{}, held {:?}, W {:.2?}\n   best {:?}\n   ours {:?}",
            described(link, corridor),
            drawn.held.iter().map(|h| h.relay + 1).collect::<Vec<_>>(),
            powers.collect::<Vec<_>>(),
            list(&best.places),
            list(&places(&outcome)),
        );
        assert_eq!(outcome.ending, Ending::Settled, "{of}");
        let sir = joint::sir(link, &places(&outcome)).unwrap();
        if given.ending == Ending::Settled
            && sir < joint::sir(link, &places(&given)).unwrap() * (1.0 - 1e-4)
        {
            below.push(of.clone());
        }
        results.push(Result {
            ratio: sir / best.sir,
            of,
            sweeps: outcome.sweeps,
            bytes: outcome.bytes,
        });
    }
    let (near, _, best, passes) = summary(&mut results);
    assert!(below.is_empty(), "{below:?}");
    assert!(near * 100 >= 98 * count, "{near} of {count}");
    assert!(best <= 1.0 + 1e-5, "{best}");
    assert!(f64::from(passes) <= 3.5 * count as f64, "{passes}");
}

/// Checks that a relay that is configured to keep its altitude does so. Its neighbours choose other altitudes.
#[test]
fn one_relay_may_have_a_fixed_altitude() {
    let (link, corridor) = close_by(6);
    let mut setup = setup(&link, corridor).unwrap();
    let own = make::profile(77.7, 1.0);
    setup.profiles.push((3, own));
    setup.held.push(3);
    let outcome = settle(setup);
    let altitudes: Vec<f32> = outcome
        .relays
        .iter()
        .map(|relay| relay.setpoint.unwrap().altitude_m)
        .collect();
    assert_eq!(altitudes[2], 77.7);
    assert!(
        altitudes[1] != 20.0 && altitudes[3] != 20.0,
        "{altitudes:?}"
    );
}

/// Checks the number of round trips if some relays have a power or altitude of their own.
///
/// In the first round trip the relays find that some of them differ. Each further round trip collects the data of up to eight of these
/// relays. The last round trip confirms the new solution. If the leader is one of the different relays, there is no first round trip.
#[test]
fn different_relays_take_three_round_trips_or_more() {
    for (relays, own, trips) in [
        (5, &[3][..], 3),
        (5, &[1], 2),
        (1, &[1], 2),
        (8, &[2, 5, 7], 3),
        (20, &[2, 4, 6, 8, 10, 12, 14], 3),
        (20, &[2, 4, 6, 8, 10, 12, 14, 16], 4),
        (20, &[1, 2, 4, 6, 8, 10, 12, 14, 16], 3),
        (20, &[6, 8, 10, 12, 14, 16, 18, 20], 3),
    ] {
        let (link, corridor) = roomy(relays, 500.0, 150.0, 280.0, 300.0);
        let mut setup = setup(&link, corridor).unwrap();
        for &index in own {
            let own = make::profile(80.0, 1.25);
            setup.profiles.push((index, own));
            if index % 4 < 2 {
                setup.held.push(index);
            }
        }
        let outcome = settle(setup);
        println!(
            "{relays} relays, {own:?} differ: {} passes, {} messages, {} bytes",
            outcome.sweeps, outcome.messages, outcome.bytes
        );
        assert_eq!(outcome.sweeps, trips, "{relays}: {own:?}");
        let messages = u64::from(trips) * 2 * (relays as u64 - 1);
        assert_messages(&outcome, relays as u64, messages);
    }
}

/// Checks that relays with powers unknown to the leader find altitudes within 1 % of the optimum.
#[test]
fn powers_unknown_to_the_leader_are_collected() {
    let (link, corridor) = close_by(8);
    let mut setup = setup(&link, corridor).unwrap();
    for (index, power_w) in [(2, 0.4), (5, 2.5), (7, 0.7)] {
        let own = make::profile(20.0, power_w);
        setup.profiles.push((index, own));
    }
    let mut real = link.clone();
    for (index, own) in &setup.profiles {
        real.relays[usize::from(*index) - 1].power_w = f64::from(own.power_w);
    }
    let outcome = settle(setup);
    let best = optimum(&real, corridor, &[]).unwrap().unwrap();
    let ratio = joint::sir(&real, &places(&outcome)).unwrap() / best.sir;
    println!("{ratio:.6} of the optimum in {} passes", outcome.sweeps);
    assert!((0.99..=1.0 + 1e-6).contains(&ratio), "{ratio}");
}

#[test]
fn a_band_of_one_altitude_is_algorithm_1() {
    let (link, _) = close_by(5);
    let corridor = Corridor::plane(20.0, 20.0);
    let outcome = settle(setup(&link, corridor).unwrap());
    assert_eq!(outcome.sweeps, 1);
    let mut align = setup(&link, corridor).unwrap();
    align.settings.method = Method::Align;
    assert_eq!(outcome.bits(), settle(align).bits());
}

/// Checks that message faults do not change the positions by the methods Joint and Adjust. Some relays have powers or altitudes of their
/// own.
#[test]
fn faults_change_nothing_on_random_links() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(44));
    let mut injected = 0;
    for round in 0..160 {
        let drawn = scenario(&mut rng, &(1..=12), CROWDED);
        let link = as_relays_know_it(&drawn.link);
        let Some(mut setup) = setup(&link, drawn.corridor) else {
            continue;
        };
        let common = setup.mission.config().common;
        for index in 1..=setup.mission.relays() {
            if rng.random_bool(0.15) {
                let own = Profile {
                    power_w: (f64::from(common.power_w) * log_uniform(&mut rng, 0.3, 3.0)) as f32,
                    ..common
                };
                setup.profiles.push((index, own));
            }
            if rng.random_bool(0.1) {
                setup.held.push(index);
            }
        }
        if round % 3 == 0 {
            setup.settings.method = Method::Adjust(Adjust {
                rounds: 5,
                explore_m: 0.1 * drawn.corridor.most_m as f32,
                ..Adjust::default()
            });
        }
        setup.settings.predict = rng.random();
        let faulty = unharmed(setup, round);
        injected += faulty.injected.lost + faulty.injected.corrupted;
    }
    println!("{injected} frames lost or corrupted");
    assert!(injected > 10_000);
}

/// Checks that the joint solver reaches the optimum in few computation steps. For this the solver must abandon hopeless
/// start points, but keep the best start point.
#[test]
fn few_portions_lead_to_the_joint_optimum() {
    for (relays, lateral_m, most, best) in [
        (8, 0.0, 500, 1.235_783_782_6),
        (50, 0.0, 3_300, 6.498_377_624_4),
        (8, 280.0, 1_200, 1.543_032_046),
    ] {
        let (link, corridor) = roomy(relays, 500.0, 150.0, lateral_m, 300.0);
        let mission = setup(&link, corridor).unwrap().mission;
        let mut solver = Solver::<100, 10>::new(&mission).unwrap();
        let seat = Seat::common(&mission);
        let mut portions = 1;
        let target = loop {
            if let Poll::Ready(solved) = solver.step(&mission, |_| seat) {
                break f64::from(solved.unwrap());
            }
            portions += 1;
        };
        println!(
            "{relays} relays: {portions} portions, {:e}",
            1.0 - target / best
        );
        assert!(portions <= most, "{relays}: {portions}");
        assert!(target >= best * (1.0 - 1e-5), "{relays}: {target}");
    }
}
