//! Static sources: fraction of the optimum by number of agreements.

use host_tests::make;
use uav_relay::Interference;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_tools::figures::sheet::FigureError;
use uav_relay_tools::listening::{
    self, LAST, RandomScene, hypothetical, quantile, shadowed, unknown,
};

use crate::count;

type Setups = fn(&RandomScene) -> Result<Setup, FigureError>;

/// Limits of a test: number of agreements, quantile of the scenes, least fraction of the optimum SIR.
///
/// For example (5, 0.5, 0.99): after five agreements, the median SIR is at least 0.99 of the optimum.
type Limits = &'static [(usize, f64, f64)];

/// Returns a setup whose mission has a wrong interferer: mirrored, 100 times as strong, and nearer.
fn guessed(wild: &RandomScene) -> Result<Setup, FigureError> {
    let source = wild.scene()?.sources[0].clone();
    wild.setup(Interference::Source(make::interferer(
        (100.0 * source.power_w) as f32,
        (1_000.0 - source.x_m) as f32,
        (-0.3 * source.y_m) as f32,
    )))
}

/// Returns a setup with 1 dB of shadowing at each position, whose relays also measure in flight.
fn flown(wild: &RandomScene) -> Result<Setup, FigureError> {
    let mut setup = wild.flown(Interference::Unknown)?;
    setup.true_interference.as_mut().unwrap().shadow_db = 1.0;
    Ok(setup)
}

const ONE: Limits = &[
    (1, 0.5, 0.98),
    (5, 0.5, 0.99),
    (5, 0.1, 0.97),
    (5, 0.0, 0.5),
];
const GUESS: Limits = &[
    (3, 0.5, 0.98),
    (5, 0.5, 0.99),
    (5, 0.1, 0.97),
    (5, 0.0, 0.9),
];

/// Checks that relays find interferers and come near the optimum SIR. Cases are unknown sources, few relays, a wrong
/// mission, shadowing, and two sources.
#[test]
fn sources_are_found() {
    let rows: [(&str, &[u16], usize, Setups, Limits); 7] = [
        ("one source", &[3, 5, 8, 20], 1, unknown, ONE),
        ("few relays", &[1, 2], 1, unknown, &[(5, 0.5, 0.98)]),
        ("a wrong guess", &[3, 8], 1, guessed, GUESS),
        ("1 dB, hovering alone", &[8], 1, shadowed, &[(5, 0.5, 0.94)]),
        (
            "1 dB, on their way too",
            &[8],
            1,
            flown,
            &[(LAST, 0.5, 0.95)],
        ),
        // The relays estimate the one source that fits both best.
        (
            "two sources",
            &[8],
            2,
            unknown,
            &[(5, 0.5, 0.98), (5, 0.1, 0.9)],
        ),
        ("two sources, the paper's way", &[8], 2, hypothetical, &[]),
    ];
    for (what, chains, sources, setup, limits) in rows {
        for &relays in chains {
            let mut shares = listening::shares(count(200), relays, sources, setup).unwrap();
            for at in [0, 1, 2, 3, 5, LAST] {
                let [least, tenth, median] =
                    [0.0, 0.1, 0.5].map(|part| quantile(&mut shares[at], part));
                println!(
                    "N = {relays}, {what}, after {at}: median {median:.4}, 10 % {tenth:.4}, least {least:.4}"
                );
            }
            for &(at, part, least) in limits {
                let share = quantile(&mut shares[at], part);
                assert!(share >= least, "N = {relays}, {what}, after {at}: {share}");
            }
        }
    }
}
