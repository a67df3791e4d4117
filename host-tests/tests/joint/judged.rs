//! Stored optima of numbered scenarios.

use std::time::Instant;

use rayon::prelude::*;
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::random::joint::judged::{COUNT, PATH, numbered, optima};
use uav_relay_oracle::reference::joint::Effort;

use crate::checked;

/// Two searches without a common random draw.
const EFFORTS: [Effort; 2] = [Effort { seed: 1, rounds: 1 }, Effort { seed: 2, rounds: 2 }];

/// Searches for all optima and stores them; takes about ten minutes on two cores.
#[test]
#[ignore = "writes the file that others read"]
fn optima_are_stored() {
    let start = Instant::now();
    let judged = |number| {
        let of = numbered(number);
        EFFORTS.map(|effort| checked(&of, effort).sir)
    };
    let all: Vec<[f64; 2]> = (0..COUNT).into_par_iter().map(judged).collect();
    let gaps = all.iter().map(|[one, other]| (one / other - 1.0).abs());
    let gaps: Vec<f64> = gaps.collect();
    for tolerance in [1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2] {
        let apart = gaps.iter().filter(|gap| **gap > tolerance).count();
        println!("{apart} of {COUNT} apart by more than {tolerance:e}");
    }
    for (number, gap) in gaps.iter().enumerate().filter(|(_, gap)| **gap > 1e-6) {
        println!("number {number}: {gap:e}");
    }
    let mut file = csv::Writer::from_path(PATH).unwrap();
    file.write_record(["number", "sir"]).unwrap();
    for (number, [one, other]) in all.iter().enumerate() {
        let sir = format!("{:.9e}", one.max(*other));
        file.write_record([number.to_string(), sir]).unwrap();
    }
    file.flush().unwrap();
    println!("{:.0} s", start.elapsed().as_secs_f64());
}

#[test]
fn the_stored_optima_are_found_again() {
    let stored = optima().unwrap();
    assert_eq!(stored.len(), COUNT as usize);
    for number in (17..COUNT).step_by(50) {
        let found = checked(&numbered(number), Effort::usual(3)).sir;
        let was = stored[number as usize];
        assert!((found / was - 1.0).abs() < 1e-6, "{number}: {found} {was}");
    }
}

/// Checks that the scenarios are diverse and valid missions.
#[test]
fn the_numbered_scenarios_are_of_many_kinds() {
    let (mut narrow, mut one_sided, mut level, mut apart, mut few, mut right) = (0, 0, 0, 0, 0, 0);
    for number in 0..COUNT {
        let of = numbered(number);
        assert_eq!(of, of.as_relays_know_it());
        assert!(of_link(&of.link, 1e-4).is_some(), "{of:?}");
        let room = of.corridor;
        assert!(room.left_m <= 0.0 && room.right_m >= 0.0 && room.least_m <= room.most_m);
        let sides = u32::from(room.left_m < 0.0) + u32::from(room.right_m > 0.0);
        narrow += u32::from(sides == 0);
        one_sided += u32::from(sides == 1);
        level += u32::from(room.least_m >= room.most_m);
        apart += u32::from(of.link.min_separation_m > 0.0);
        few += u32::from(of.link.len() <= 10);
        right += u32::from(of.link.y_i > 0.0);
    }
    assert!((650..780).contains(&narrow), "{narrow}");
    assert!((280..400).contains(&one_sided), "{one_sided}");
    assert!((150..250).contains(&level), "{level}");
    assert!((930..1070).contains(&apart), "{apart}");
    assert!((550..700).contains(&few), "{few}");
    assert!((930..1070).contains(&right), "{right}");
}
