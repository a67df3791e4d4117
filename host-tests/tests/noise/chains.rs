//! Chains by Algorithm 1 with receiver noise.

use host_tests::flights::unharmed;
use host_tests::make;
use host_tests::placing::{Mixed, generator, hop_sirs_agree, optimum_is_found};
use rand::{Rng, RngExt};
use uav_relay::Method;
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, Style, count, in_noise};
use uav_relay_oracle::reference::Link;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

/// Draws a chain of relays, in nine of ten cases with receiver noise. Numbers are rounded to f32.
fn drawn(rng: &mut impl Rng, style: &Style) -> Link {
    let link = random::link(rng, style);
    as_relays_know_it(&if rng.random_bool(0.1) {
        link
    } else {
        in_noise(rng, &link)
    })
}

/// Returns the noise at the worst hop as a fraction of noise plus interference.
fn share(link: &Link, x: &[f64]) -> f64 {
    let silent = Link {
        noise_w: 0.0,
        ..link.clone()
    };
    1.0 - link.chain_sir(x) / silent.chain_sir(x)
}

#[test]
fn hop_sinrs_agree_with_the_reference() {
    hop_sirs_agree(&mut generator(1101), |rng| drawn(rng, &Style::ANY));
}

/// Checks that the SIR of 1 to 50 equal relays with noise is close to the optimum. It may be at most 1e-4 (relative) below the optimal SIR,
/// and never above it.
#[test]
fn the_optimum_is_found_in_noise() {
    let mut rng = generator(1102);
    let (mut solved, mut hopeless, mut worst, mut most_sweeps) = (0, 0, 0.0_f64, 0);
    let mut drowned = [0_u32; 4];
    for _ in 0..count(1_000) {
        let link = drawn(&mut rng, &Style::ALIKE);
        let Some(mission) = of_link(&link, 1e-5) else {
            continue;
        };
        let Some(found) = optimum_is_found(&link, &mission, 1e-4) else {
            hopeless += 1;
            continue;
        };
        solved += 1;
        worst = worst.max(found.short);
        most_sweeps = most_sweeps.max(found.sweeps);
        let share = share(&link, &found.x);
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

/// Checks that different relays in noise meet their agreed target SIR. The target must never be above the optimum.
#[test]
fn different_relays_in_noise_meet_the_agreed_target() {
    let mut rng = generator(1103);
    let mut all = Mixed::default();
    let style = make::style(2..=30, Chain::Own);
    for _ in 0..count(400) {
        all.meet_what_they_agree_on(&drawn(&mut rng, &style));
    }
    println!("{all:?}");
    assert!(all.best * 10 > all.solved * 8, "{all:?}");
}

/// Checks that chains with receiver noise agree on bit-identical positions despite message faults.
#[test]
fn chains_in_noise_settle_to_the_bit_despite_faults() {
    let mut rng = generator(1104);
    let mut injected = 0;
    for round in 0..60 {
        let link = as_relays_know_it(&random::link(&mut rng, &make::style(1..=12, Chain::Any)));
        let link = as_relays_know_it(&in_noise(&mut rng, &link));
        let Some((mission, profiles)) = of_link(&link, 1e-4) else {
            continue;
        };
        let mut setup = Setup::new(mission);
        setup.profiles = profiles;
        setup.settings.method = Method::Align;
        let faulty = unharmed(setup, round);
        if faulty.ending == Ending::Settled {
            injected += faulty.injected.lost + faulty.injected.corrupted;
        }
    }
    println!("{injected} frames lost or corrupted");
    assert!(injected > 500, "{injected}");
}
