//! Reach of a hop in noise, compared with bisection of the SINR, and its monotony in target and start.

use host_tests::placing::{DrawnHop, SINGLE, drawn_hop, generator, reaches_agree};
use rand::{Rng, RngExt};
use uav_relay_oracle::random::{count, log_uniform};

/// Draws a target SIR for a hop: just above the SIR at a random position, or near the hop's gain.
///
/// The gain is the SIR if the hop's sender and the interferer are equally far from the receiver.
fn target(rng: &mut impl Rng, of: &DrawnHop) -> f32 {
    if rng.random_bool(0.2) {
        let by = f64::from(rng.random_range(-3..=3)) * log_uniform(rng, 1e-9, 1e-3);
        return (of.gain * (1.0 + by)) as f32;
    }
    let (from, end) = (f64::from(of.from), of.link.distance_m);
    let part = log_uniform(rng, 1e-4, 1.0);
    let place = from + part * (end - from);
    let sir = of
        .link
        .sir_relay(usize::from(of.index), from, place)
        .unwrap();
    (sir * (1.0 + log_uniform(rng, 1e-6, 1e-2))).min(1e30) as f32
}

#[test]
fn reaches_in_noise_agree_with_the_reference() {
    let seen = reaches_agree(&mut generator(1111), count(20_000), true, target);
    assert!(
        seen.inside > 10_000 && seen.infeasible > 200 && seen.leaps > 20,
        "{seen:?}: the draw has gone stale"
    );
}

/// Checks that a hop's reach falls with the target SIR, and rises with the x of the hop's sender. The reach is the
/// receiver's farthest x that meets the target; the tolerance is two f32 steps.
#[test]
fn the_reach_in_noise_is_monotonic() {
    let mut rng = generator(1112);
    let (mut lower, mut farther) = (0, 0);
    for _ in 0..count(50_000) {
        let Some(of) = drawn_hop(&mut rng, true) else {
            continue;
        };
        let step = (2.0 * of.link.distance_m * SINGLE) as f32;
        let first = target(&mut rng, &of);
        let higher = (f64::from(first) * (1.0 + log_uniform(&mut rng, 1e-5, 1.0))) as f32;
        if let Some(of_higher) = of.hop.reach(higher, of.from) {
            let reach = of.hop.reach(first, of.from);
            assert!(
                reach.is_some_and(|reach| reach >= of_higher - step),
                "{first} {reach:?}, {higher} {of_higher} from {} in {:?}",
                of.from,
                of.link
            );
            lower += 1;
        }
        let (Some(reach), true) = (of.hop.reach(first, of.from), of.index > 1) else {
            continue;
        };
        let start = of.from + rng.random_range(0.0..=1.0) * (reach - of.from);
        // A start this close to the reach leaves no room for a hop.
        if reach - start < 2e-6 * of.link.distance_m as f32 {
            continue;
        }
        let from_start = of
            .hop
            .reach((f64::from(first) * (1.0 - 1e-6)) as f32, start);
        assert!(
            from_start.is_some_and(|from_start| from_start >= reach - step),
            "{first}: {reach} from {}, {from_start:?} from {start} in {:?}",
            of.from,
            of.link
        );
        farther += 1;
    }
    println!("{lower} pairs of targets, {farther} of starts");
    assert!(lower > 1_000 && farther > 1_000, "{lower} {farther}");
}
