//! Reach of a hop in noise, compared with bisection of the SINR, and its monotony in target and start.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::optimiser::spacing::Hop;
use uav_relay::sir::Sender;
use uav_relay::{Mission, Profile};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, Style, in_noise, log_uniform};
use uav_relay_oracle::reference::Link;

use super::{count, profile_of};

const SINGLE: f64 = f32::EPSILON as f64;

/// Hop of a random link in noise, its sender's position, and its gain.
struct Drawn {
    link: Link,
    mission: Mission,
    hop: Hop,
    index: u16,
    from: f32,
    gain: f64,
}

fn drawn(rng: &mut impl Rng) -> Option<Drawn> {
    let style = Style {
        relays: 1..=4,
        chain: Chain::Any,
    };
    let link = as_relays_know_it(&random::link(rng, &style));
    let link = as_relays_know_it(&in_noise(rng, &link));
    let (mission, own): (Mission, Vec<(u16, Profile)>) = of_link(&link, 1e-4)?;
    let index = rng.random_range(1..=mission.relays());
    let profile = profile_of(&mission, &own, index);
    let sender = match index {
        1 => Sender::transmitter(&mission),
        _ => Sender::relay(&mission, profile_of(&mission, &own, index - 1).on_line()),
    };
    let from = if index == 1 {
        0.0
    } else {
        rng.random_range(0.0..0.95) * mission.config().distance_m
    };
    let gain = f64::from(if index == 1 {
        mission.tx_gain().value()
    } else {
        mission.relay_gain(profile.power_w).value()
    });
    let interferer = mission.interferer()?;
    let hop = Hop::new(
        &mission,
        interferer,
        sender,
        index,
        profile.on_line().at,
        0.0,
    );
    Some(Drawn {
        link,
        mission,
        hop,
        index,
        from,
        gain,
    })
}

/// Draws a target that some positions meet: the SINR along the hop, or a value near the gain.
fn target(rng: &mut impl Rng, of: &Drawn) -> f32 {
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

/// Checks that a reach is within the exact reaches of targets a millionth apart, and two f32 steps.
#[test]
fn reaches_in_noise_agree_with_the_reference() {
    const NEAR: f64 = 1e-6;
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1111));
    let (mut compared, mut infeasible, mut inside, mut leaps) = (0, 0, 0, 0);
    while compared < count(20_000) {
        let Some(of) = drawn(&mut rng) else {
            continue;
        };
        let target = target(&mut rng, &of);
        let Drawn {
            link,
            mission,
            hop,
            index,
            from,
            ..
        } = &of;
        let k = usize::from(*index);
        let exact = |target: f64| link.farthest(k, f64::from(*from), target);
        let ours = hop.reach(target, *from);
        let (low, high) = (
            exact(f64::from(target) * (1.0 - NEAR)),
            exact(f64::from(target) * (1.0 + NEAR)),
        );
        compared += 1;
        // Each relay behind keeps a millionth of the distance, which is also the shortest hop.
        let spare = link.distance_m * 1.1e-6;
        let room = spare * f64::from(mission.relays() - index + 1);
        match ours {
            None => {
                infeasible += 1;
                let short = high.is_none_or(|high| high - f64::from(*from) < spare);
                assert!(
                    short,
                    "{target} from {from}: none against {high:?} of {index} in {link:?}"
                );
            }
            Some(place) => {
                let place = f64::from(place);
                let step = 2.0 * link.distance_m * SINGLE;
                let far = low.expect("a target that is met is met when it is lower");
                assert!(
                    place <= far + step,
                    "{target} from {from}: {place} beyond {far} of {index} in {link:?}"
                );
                let near = high.map_or(f64::from(*from), |high| high.min(link.distance_m - room));
                assert!(
                    place >= near - step - room,
                    "{target} from {from}: {place} short of {near} of {index} in {link:?}"
                );
                inside += u32::from(place < link.distance_m - room);
                // Positions in between that miss the target: the reach is beyond the interferer.
                let between = f64::from(*from)..place;
                let missed = (1..40).any(|part| {
                    let x = between.start + f64::from(part) / 40.0 * (place - between.start);
                    link.sir_relay(k, f64::from(*from), x).unwrap() < f64::from(target) * 0.999
                });
                leaps += u32::from(missed && place < link.distance_m - room);
            }
        }
    }
    println!(
        "{compared} reaches: {inside} inside, {leaps} of them beyond places that miss the target, {infeasible} infeasible"
    );
    assert!(
        inside > 10_000 && infeasible > 200 && leaps > 20,
        "{inside} {infeasible} {leaps}: the draw has gone stale"
    );
}

/// Checks that the reach falls with the target and rises with the start, within two f32 steps.
#[test]
fn the_reach_in_noise_falls_with_the_target_and_rises_with_the_start() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1112));
    let (mut lower, mut farther) = (0, 0);
    for _ in 0..count(50_000) {
        let Some(of) = drawn(&mut rng) else {
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
        // A start without room for a hop has none.
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
