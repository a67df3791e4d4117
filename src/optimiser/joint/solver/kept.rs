//! Tests: stored cells of the best start against those of a repetition of that start.

use core::task::Poll;

use super::{Seat, Solver};
use crate::channel::{AirGround, Channel};
use crate::mission::{Band, Interference, Interferer, Mission, MissionConfig, Profile};

/// Uniform random numbers in 0..1: Knuth's MMIX generator.
struct Rng(u64);

impl Rng {
    fn next(&mut self) -> f32 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    fn between(&mut self, least: f32, most: f32) -> f32 {
        least + self.next() * (most - least)
    }
}

/// Returns a random mission, and the fixed altitudes of some of its relays.
fn random(rng: &mut Rng) -> (Mission, [Option<f32>; 50]) {
    let relays = [1, 2, 3, 5, 8, 13, 21, 50][(rng.next() * 8.0) as usize];
    let least_m = rng.between(10.0, 60.0);
    let side = if rng.next() < 0.5 {
        0.0
    } else {
        rng.between(20.0, 300.0)
    };
    let most_m = if side > 0.0 && rng.next() < 0.2 {
        least_m
    } else {
        rng.between(80.0, 300.0)
    };
    let channel = Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los).expect("in range");
    let mission = Mission::try_new(MissionConfig {
        relays,
        distance_m: rng.between(400.0, 4000.0),
        min_separation_m: rng.between(1.0, 12.0),
        tx_power_w: rng.between(1.0, 100.0),
        common: Profile {
            altitude_m: least_m,
            power_w: 1.0,
        },
        channel,
        band: Band { least_m, most_m },
        lateral: Band {
            least_m: -side,
            most_m: side,
        },
        interference: Interference::Source(Interferer {
            power_w: rng.between(5.0, 100.0),
            x_m: rng.between(-500.0, 4000.0),
            y_m: rng.between(10.0, 900.0),
        }),
        noise_w: 0.0,
        tolerance: 1e-4,
    });
    let holds = rng.next() < 0.3;
    let held = [(); 50].map(|()| (holds && rng.next() < 0.3).then(|| rng.between(least_m, most_m)));
    (mission.expect("in range"), held)
}

/// Returns the target and the positions, in bits, and the number of portions.
fn solved(mission: &Mission, held: &[Option<f32>; 50], once_more: bool) -> ([[u32; 2]; 51], u32) {
    let common = Seat::common(mission);
    let seat = |index: u16| match held[usize::from(index) - 1] {
        Some(altitude_m) => Seat {
            room: common.room.at_altitude(altitude_m),
            ..common
        },
        None => common,
    };
    let mut solver = Solver::<50, 5>::new(mission).expect("it fits");
    let mut portions = 1;
    let target = loop {
        if once_more {
            solver.best_judged = None;
        }
        if let Poll::Ready(target) = solver.step(mission, seat) {
            break target.unwrap_or(-1.0);
        }
        portions += 1;
    };
    let mut bits = [[0; 2]; 51];
    bits[0][0] = target.to_bits();
    for index in 1..=mission.relays() {
        let at = solver.at(index, seat(index));
        bits[usize::from(index)] = [at.y_m.to_bits(), at.altitude_m.to_bits()];
    }
    (bits, portions)
}

/// Random missions; their number is `UAV_RELAY_KEPT`, 150 by default.
#[test]
fn what_is_kept_of_the_best_start_is_what_it_comes_to_once_more() {
    extern crate std;
    let count =
        std::env::var("UAV_RELAY_KEPT").map_or(150, |count| count.parse().expect("a number"));
    let mut rng = Rng(28);
    let (mut kept, mut again, mut fewer) = (0_u64, 0_u64, 0);
    for number in 0..count {
        let (mission, held) = random(&mut rng);
        let (once, portions) = solved(&mission, &held, false);
        let (twice, more) = solved(&mission, &held, true);
        assert_eq!(once, twice, "mission {number}: {mission:?}");
        assert!(portions <= more, "mission {number}");
        kept += u64::from(portions);
        again += u64::from(more);
        fewer += u32::from(portions < more);
    }
    std::println!(
        "{kept} portions, {again} with the best start done once more; fewer in {fewer} of {count}"
    );
    assert!(fewer * 2 > count);
}
