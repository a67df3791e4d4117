//! Chains by Algorithm 1 with receiver noise.

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::optimiser::plan;
use uav_relay::{Method, Schedule};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, Style, in_noise};
use uav_relay_oracle::reference::Link;
use uav_relay_sim::report::hop_sirs;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

use super::{count, profile_of};

/// Draws a link in the relays' precision, in one of ten cases without noise.
fn drawn(rng: &mut impl Rng, style: &Style) -> Link {
    let link = random::link(rng, style);
    as_relays_know_it(&if rng.random_bool(0.1) {
        link
    } else {
        in_noise(rng, &link)
    })
}

/// Returns the fraction of noise in the worst hop's noise and interference.
fn share(link: &Link, x: &[f64]) -> f64 {
    let silent = Link {
        noise_w: 0.0,
        ..link.clone()
    };
    1.0 - link.chain_sir(x) / silent.chain_sir(x)
}

#[test]
fn hop_sinrs_agree_with_the_reference() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1101));
    let mut worst = 0.0_f64;
    for _ in 0..4_000 {
        let link = drawn(&mut rng, &Style::ANY);
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
    println!("largest relative error of a hop's SINR: {worst:.2e}");
    assert!(worst < 1e-6, "{worst}");
}

/// Compares chains of 1 to 50 identical relays in noise with the optimum: within 1e-4, never above.
#[test]
fn the_optimum_is_found_in_noise() {
    let count = count(1_000);
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1102));
    let (mut solved, mut hopeless, mut worst, mut most_sweeps) = (0, 0, 0.0_f64, 0);
    let mut drowned = [0_u32; 4];
    for at in 0..count {
        let link = drawn(&mut rng, &Style::ALIKE);
        let Some((mission, own)) = of_link(&link, 1e-5) else {
            continue;
        };
        let of = |index| profile_of(&mission, &own, index);
        let agreed = plan::solve(&mission, Schedule::Bracketed, of);
        let Some(best) = link.optimum() else {
            hopeless += 1;
            assert!(agreed.is_err(), "link {at}: {link:?}");
            continue;
        };
        let agreed = agreed.unwrap_or_else(|_| panic!("link {at} has {best}: {link:?}"));
        let x: Vec<f64> = (1..=mission.relays())
            .map(|index| plan::place(&mission, agreed.target, index, of).unwrap())
            .map(|place| f64::from(place.x_m))
            .collect();
        let reached = link.chain_sir(&x);
        let short = 1.0 - reached / best;
        solved += 1;
        worst = worst.max(short);
        most_sweeps = most_sweeps.max(agreed.sweeps);
        assert!(short <= 1e-4, "link {at}: {reached} of {best} in {link:?}");
        assert!(
            short >= -1e-6,
            "link {at}: {reached} above {best} in {link:?}"
        );
        let share = share(&link, &x);
        drowned
            [usize::from(share > 0.01) + usize::from(share > 0.5) + usize::from(share > 0.99)] += 1;
    }
    println!(
        "{solved} solved, {hopeless} without SIR, worst short of the optimum by {worst:.2e}, at most {most_sweeps} sweeps; \
         of what the worst hop hears up to 1 %, half, 99 % and more is noise in {drowned:?}"
    );
    assert!(
        drowned.iter().all(|&seen| seen > solved / 50),
        "{drowned:?}"
    );
}

/// Checks that unlike relays meet their agreed target, which is not above the optimum.
#[test]
fn mixed_chains_in_noise_meet_what_they_agree_on() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1103));
    let (mut solved, mut best_of) = (0, 0);
    let style = Style {
        relays: 2..=30,
        chain: Chain::Own,
    };
    for at in 0..count(400) {
        let link = drawn(&mut rng, &style);
        let Some((mission, own)) = of_link(&link, 1e-4) else {
            continue;
        };
        let of = |index| profile_of(&mission, &own, index);
        let (Some(best), Ok(agreed)) = (
            link.optimum(),
            plan::solve(&mission, Schedule::Bracketed, of),
        ) else {
            continue;
        };
        let x: Vec<f64> = (1..=mission.relays())
            .map(|index| plan::place(&mission, agreed.target, index, of).unwrap())
            .map(|place| f64::from(place.x_m))
            .collect();
        let (reached, promised) = (link.chain_sir(&x), f64::from(agreed.target));
        assert!(
            reached >= promised * (1.0 - 2e-5),
            "link {at}: {reached} of {promised} in {link:?}"
        );
        assert!(
            reached <= best * (1.0 + 1e-6),
            "link {at}: {reached} above {best} in {link:?}"
        );
        solved += 1;
        best_of += u32::from(reached >= best * (1.0 - 2e-4));
    }
    println!("{solved} mixed chains, {best_of} of them at the optimum");
    assert!(best_of * 10 > solved * 8, "{best_of} of {solved}");
}

/// Checks faults on chains with noise, and that zero noise changes no bit of a position.
#[test]
fn chains_in_noise_settle_to_the_bit_whatever_happens_to_frames() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(1104));
    let mut injected = 0;
    for round in 0..60 {
        let link = as_relays_know_it(&random::link(
            &mut rng,
            &Style {
                relays: 1..=12,
                chain: Chain::Any,
            },
        ));
        let link = as_relays_know_it(&in_noise(&mut rng, &link));
        let Some((mission, profiles)) = of_link(&link, 1e-4) else {
            continue;
        };
        let mut setup = Setup::new(mission);
        setup.profiles = profiles;
        setup.settings.method = Method::Align;
        let clean = run(setup.clone()).unwrap();
        setup.faults = Faults::BAD_DAY;
        setup.seed = round;
        let faulty = run(setup).unwrap();
        assert_eq!(clean.ending, faulty.ending, "round {round}");
        assert_eq!(clean.bits(), faulty.bits(), "round {round}");
        if clean.ending == Ending::Settled {
            injected += faulty.injected.lost + faulty.injected.corrupted;
        }
    }
    println!("{injected} frames lost or corrupted");
    assert!(injected > 500, "{injected}");
}
