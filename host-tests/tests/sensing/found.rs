//! Static sources: fraction of the optimum by number of agreements.

use uav_relay::{Interference, Interferer};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_tools::figures::sheet::FigureError;
use uav_relay_tools::listening::{
    self, LAST, RandomScene, Shares, hypothetical, quantile, shadowed, unknown,
};

use crate::count;

fn shares(
    relays: u16,
    sources: usize,
    setup: impl Fn(&RandomScene) -> Result<Setup, FigureError> + Sync,
) -> Shares {
    listening::shares(count(200), relays, sources, setup).unwrap()
}

fn print(what: &str, shares: &mut Shares) {
    for at in [0, 1, 2, 3, 5, LAST] {
        let shares = &mut shares[at];
        let [least, tenth, median] = [0.0, 0.1, 0.5].map(|part| quantile(shares, part));
        println!("{what}, after {at}: median {median:.4}, 10 % {tenth:.4}, least {least:.4}");
    }
}

#[test]
fn one_source_is_found() {
    for relays in [3, 5, 8, 20] {
        let mut shares = shares(relays, 1, unknown);
        print(&format!("N = {relays}"), &mut shares);
        assert!(quantile(&mut shares[1], 0.5) >= 0.98);
        assert!(quantile(&mut shares[5], 0.5) >= 0.99);
        assert!(quantile(&mut shares[5], 0.1) >= 0.97);
        assert!(quantile(&mut shares[5], 0.0) >= 0.5);
    }
}

#[test]
fn one_or_two_relays_fly_to_learn() {
    for relays in [1, 2] {
        let mut shares = shares(relays, 1, unknown);
        print(&format!("N = {relays}"), &mut shares);
        assert!(quantile(&mut shares[5], 0.5) >= 0.98);
    }
}

#[test]
fn places_with_a_shadow_of_their_own() {
    let mut hovering = shares(8, 1, shadowed);
    print("N = 8, 1 dB, hovering alone", &mut hovering);
    let mut flown = shares(8, 1, |wild| {
        let mut setup = wild.flown(Interference::Unknown)?;
        setup.sky.as_mut().unwrap().shadow_db = 1.0;
        Ok(setup)
    });
    print("N = 8, 1 dB, on their way too", &mut flown);
    assert!(quantile(&mut hovering[5], 0.5) >= 0.94);
    assert!(quantile(&mut flown[LAST], 0.5) >= 0.95);
}

#[test]
fn two_sources_are_met_by_the_one_that_comes_nearest() {
    let mut heard = shares(8, 2, unknown);
    print("N = 8, two sources", &mut heard);
    let mut told = shares(8, 2, hypothetical);
    print("N = 8, two sources, the paper's way", &mut told);
    assert!(quantile(&mut heard[5], 0.5) >= 0.98);
    assert!(quantile(&mut heard[5], 0.1) >= 0.9);
}

#[test]
fn a_wrong_guess_is_unlearned() {
    for relays in [3, 8] {
        let mut shares = shares(relays, 1, |wild| {
            // The guess is mirrored, a hundred times as strong, and nearer.
            let source = wild.scene()?.sources[0].clone();
            wild.setup(Interference::Source(Interferer {
                power_w: (100.0 * source.power_w) as f32,
                x_m: (1_000.0 - source.x_m) as f32,
                y_m: (-0.3 * source.y_m) as f32,
            }))
        });
        print(&format!("N = {relays}, a wrong guess"), &mut shares);
        assert!(quantile(&mut shares[3], 0.5) >= 0.98);
        assert!(quantile(&mut shares[5], 0.5) >= 0.99);
        assert!(quantile(&mut shares[5], 0.1) >= 0.97);
        assert!(quantile(&mut shares[5], 0.0) >= 0.9);
    }
}
