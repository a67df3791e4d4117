//! Placement compared with the f64 reference, on random and degenerate links.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::optimiser::plan::{self, Agreed};
use uav_relay::optimiser::spacing::{Hop, receiver_reach};
use uav_relay::sir::Sender;
use uav_relay::{Mission, Placement, Profile, Schedule};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, Style, log_uniform};
use uav_relay_oracle::reference::Link;
use uav_relay_sim::report::hop_sirs;

mod published;

const SINGLE: f64 = f32::EPSILON as f64;

fn profile_of(mission: &Mission, own: &[(u16, Profile)], index: u16) -> Profile {
    own.iter()
        .find(|(of, _)| *of == index)
        .map_or(mission.config().common, |(_, profile)| *profile)
}

fn solve(mission: &Mission, own: &[(u16, Profile)]) -> Option<Agreed> {
    plan::solve(mission, Schedule::Bracketed, |index| {
        profile_of(mission, own, index)
    })
    .ok()
}

fn places(mission: &Mission, own: &[(u16, Profile)], target: f32) -> Vec<Placement> {
    let of = |index| profile_of(mission, own, index);
    (1..=mission.relays())
        .map(|index| plan::place(mission, target, index, of).unwrap())
        .collect()
}

fn xs(places: &[Placement]) -> Vec<f64> {
    places.iter().map(|place| f64::from(place.x_m)).collect()
}

fn random_links(
    default_seed: u64,
    count: usize,
    style: &Style,
) -> impl Iterator<Item = (usize, Link)> {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(default_seed));
    let links: Vec<_> = (0..count)
        .map(|at| (at, as_relays_know_it(&random::link(&mut rng, style))))
        .collect();
    links.into_iter()
}

#[test]
fn hop_sirs_agree_with_the_reference() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(11));
    let mut worst = 0.0_f64;
    for _ in 0..4_000 {
        let link = as_relays_know_it(&random::link(&mut rng, &Style::ANY));
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
        let mut x: Vec<f32> = link
            .relays
            .iter()
            .map(|_| (rng.random_range(0.0..=link.distance_m)) as f32)
            .collect();
        x.sort_by(f32::total_cmp);
        let at: Vec<_> = (1..)
            .zip(&x)
            .map(|(index, &x_m)| {
                let profile = profile_of(&mission, &own, index);
                (profile.on_line().at.at(x_m), profile)
            })
            .collect();
        let reference = link.sir_hops(&x.iter().map(|&x| f64::from(x)).collect::<Vec<_>>());
        for (ours, theirs) in hop_sirs(&mission, &at).into_iter().zip(reference) {
            if theirs > 0.0 && theirs < f64::from(f32::MAX) {
                worst = worst.max((ours / theirs - 1.0).abs());
            }
        }
    }
    println!("largest relative error of a hop's SIR: {worst:.2e}");
    assert!(worst < 1e-6, "{worst}");
}

/// Checks that a reach is within the exact reaches of targets a millionth apart, and two f32 steps.
#[test]
fn reaches_agree_with_the_reference() {
    const NEAR: f64 = 1e-6;
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(12));
    let (mut compared, mut infeasible, mut inside) = (0, 0, 0);
    while compared < 20_000 {
        let link = as_relays_know_it(&random::link(
            &mut rng,
            &Style {
                relays: 1..=4,
                chain: Chain::Any,
            },
        ));
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
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
        // A third of the targets are near the hop's gain, where the printed formulas lose their digits.
        let gain = f64::from(if index == 1 {
            mission.tx_gain().value()
        } else {
            mission.relay_gain(profile.power_w).value()
        });
        let target = if rng.random_bool(0.33) {
            gain * (1.0 + f64::from(rng.random_range(-3..=3)) * log_uniform(&mut rng, 1e-9, 1e-3))
        } else {
            gain * log_uniform(&mut rng, 1e-3, 1e5)
        } as f32;
        let hop = Hop::new(
            &mission,
            mission.interferer().unwrap(),
            sender,
            index,
            profile.on_line().at,
            0.0,
        );
        let ours = hop.reach(target, from);
        let k = usize::from(index);
        let exact = |target: f64| link.farthest(k, f64::from(from), target);
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
                let short = high.is_none_or(|high| high - f64::from(from) < spare);
                assert!(
                    short,
                    "{target} from {from}: none against {high:?} in {link:?}"
                );
            }
            Some(place) => {
                let place = f64::from(place);
                let step = 2.0 * link.distance_m * SINGLE;
                let far = low.expect("a target that is met is met when it is lower");
                assert!(
                    place <= far + step,
                    "{target} from {from}: {place} beyond {far} in {link:?}"
                );
                let near = high.map_or(f64::from(from), |high| high.min(link.distance_m - room));
                assert!(
                    place >= near - step - room,
                    "{target} from {from}: {place} short of {near} in {link:?}"
                );
                inside += u32::from(place < link.distance_m - room);
            }
        }
    }
    println!("{compared} reaches: {inside} inside, {infeasible} infeasible");
    assert!(
        inside > 4_000 && infeasible > 500,
        "{inside} {infeasible}: the draw has gone stale"
    );
}

#[test]
fn the_reach_of_the_last_hop_agrees_with_the_reference() {
    let mut met = 0;
    for (at, link) in random_links(
        13,
        4_000,
        &Style {
            relays: 1..=1,
            chain: Chain::Alike,
        },
    ) {
        let Some((mission, _)) = of_link(&link, 1e-4) else {
            continue;
        };
        let above = link.sir_rx(link.distance_m).unwrap();
        for part in [1.000_01, 0.999_99, 0.5, 1e-3] {
            let target = (above * part) as f32;
            let ours = receiver_reach(&mission, mission.config().common.on_line(), target);
            let band = [1.0 - 1e-6, 1.0 + 1e-6].map(|f| link.rx_reach(f64::from(target) * f));
            match (ours, band) {
                (None, [_, tighter]) => assert_eq!(tighter, None, "link {at}"),
                (Some(ours), [looser, tighter]) => {
                    met += 1;
                    let ours = f64::from(ours);
                    assert!(
                        ours <= looser.unwrap() * (1.0 + 1e-6),
                        "link {at}: {ours} {looser:?}"
                    );
                    assert!(
                        tighter.is_none_or(|t| ours >= t * (1.0 - 1e-6)),
                        "link {at}: {ours} {tighter:?}"
                    );
                }
            }
        }
    }
    assert!(met > 5_000, "{met}");
}

/// Compares 1 to 50 identical relays with the optimum, D 10 m to 100 km, the interferer anywhere.
#[test]
fn the_optimum_is_found_on_random_links() {
    let (mut solved, mut hopeless, mut most_sweeps, mut worst) = (0, 0, 0, 0.0_f64);
    for (at, link) in random_links(14, 4_000, &Style::ALIKE) {
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
        let Some(best) = link.optimum() else {
            hopeless += 1;
            assert!(solve(&mission, &own).is_none(), "link {at}: {link:?}");
            continue;
        };
        let agreed =
            solve(&mission, &own).unwrap_or_else(|| panic!("link {at} has {best}: {link:?}"));
        let reached = link.chain_sir(&xs(&places(&mission, &own, agreed.target)));
        let short = 1.0 - reached / best;
        solved += 1;
        worst = worst.max(short);
        most_sweeps = most_sweeps.max(agreed.sweeps);
        assert!(short <= 2e-4, "link {at}: {reached} of {best} in {link:?}");
        assert!(
            short >= -1e-6,
            "link {at}: {reached} above {best} in {link:?}"
        );
    }
    println!(
        "{solved} solved, {hopeless} without SIR, worst short of the optimum by {worst:.2e}, at most {most_sweeps} sweeps"
    );
    assert!(solved > 3_500 && hopeless > 10);
    assert!(most_sweeps <= 7, "{most_sweeps} sweeps");
}

/// Checks that unlike relays meet their agreed target, which is not always the optimum but never above.
#[test]
fn mixed_chains_meet_what_they_agree_on() {
    let (mut solved, mut best_of, mut most_sweeps) = (0, 0, 0);
    for (at, link) in random_links(
        15,
        1_500,
        &Style {
            relays: 2..=50,
            chain: Chain::Own,
        },
    ) {
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
        let (Some(best), Some(agreed)) = (link.optimum(), solve(&mission, &own)) else {
            continue;
        };
        let at_places = xs(&places(&mission, &own, agreed.target));
        let reached = link.chain_sir(&at_places);
        let promised = f64::from(agreed.target);
        let hops = link.sir_hops(&at_places);
        assert!(
            reached >= promised * (1.0 - 2e-5),
            "link {at}: {hops:?} of {promised} at {at_places:?} in {link:?}"
        );
        assert!(
            reached <= best * (1.0 + 1e-6),
            "link {at}: {reached} above {best}"
        );
        assert!(
            at_places.is_sorted()
                && at_places
                    .iter()
                    .all(|x| (0.0..=link.distance_m).contains(x))
        );
        solved += 1;
        best_of += u32::from(reached >= best * (1.0 - 2e-4));
        most_sweeps = most_sweeps.max(agreed.sweeps);
    }
    println!(
        "{solved} mixed chains, {best_of} of them at the optimum, at most {most_sweeps} sweeps"
    );
    assert!(
        solved > 1_000 && best_of * 10 > solved * 8,
        "{best_of} of {solved}"
    );
}

/// Checks a chain that meets 37 743 but misses 31 292, where the search once oscillated for ever.
#[test]
fn a_target_that_is_met_counts_though_a_lower_one_is_missed() {
    let mut rng = ChaCha8Rng::seed_from_u64(124);
    let style = Style {
        relays: 2..=50,
        chain: Chain::Own,
    };
    let link = (0..=667)
        .map(|_| random::link(&mut rng, &style))
        .last()
        .unwrap();
    let link = as_relays_know_it(&link);
    assert!(link.feasible(31_291.979).is_none() && link.feasible(37_742.727).is_some());
    let (mission, own) = of_link(&link, 1e-4).unwrap();
    let agreed = solve(&mission, &own).unwrap();
    let reached = link.chain_sir(&xs(&places(&mission, &own, agreed.target)));
    assert!(
        agreed.target > 37_000.0 && reached > 37_000.0,
        "{agreed:?} reaches {reached}"
    );
}

#[test]
fn power_alone_may_differ_and_the_optimum_is_still_found() {
    let mut solved = 0;
    for (at, link) in random_links(
        16,
        1_500,
        &Style {
            relays: 2..=50,
            chain: Chain::OwnPower,
        },
    ) {
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
        let (Some(best), Some(agreed)) = (link.optimum(), solve(&mission, &own)) else {
            continue;
        };
        let reached = link.chain_sir(&xs(&places(&mission, &own, agreed.target)));
        let short = 1.0 - reached / best;
        assert!(
            (-1e-6..=2e-4).contains(&short),
            "link {at}: {reached} of {best} in {link:?}"
        );
        solved += 1;
    }
    assert!(solved > 1_000, "{solved}");
}

#[test]
fn relays_keep_their_separation_even_where_it_costs_sir() {
    let mut binding = 0;
    for relays in [100_u16, 150, 194, 195, 200, 230, 245, 250] {
        let mut link = Link::paper(usize::from(relays));
        link.min_separation_m = 4.0;
        let (mission, own) = of_link(&link, 1e-4).unwrap();
        let agreed = solve(&mission, &own).unwrap();
        let x = xs(&places(&mission, &own, agreed.target));
        let least = x
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(f64::INFINITY, f64::min);
        let best = link.optimum().unwrap();
        let reached = link.chain_sir(&x);
        println!("{relays} relays: {reached:.4} of {best:.4}, least step {least:.4} m");
        assert!(least >= 4.0 * (1.0 - SINGLE), "{relays}: {least}");
        assert!(reached <= best * (1.0 + 1e-6));
        if reached < best * 0.999 {
            binding += 1;
        } else {
            assert!(reached >= best * (1.0 - 2e-4), "{relays}");
        }
    }
    assert!(binding >= 4, "the separation was meant to bind");
}
