//! Positions of Algorithm 1 with a way back, compared with the judge.

use chacha20::ChaCha8Rng;
use host_tests::placing::{generator, places, solve, xs};
use uav_relay_oracle::random::count;

use super::judge::Chain;
use super::scenes::{ENDS, LOS, NLOS, adversarial, in_noise, log_uniform, mission, narrow, usual};

/// Returns the worst hop's two-way SIR at the relays' agreed positions, and these positions.
///
/// The SIR is 0 without an agreement. The two-way SIR of a hop is the smaller of its forward SIR and its backward SIR
/// divided by the chain's `reverse`.
pub(crate) fn reached(chain: &Chain) -> (f64, Vec<f64>) {
    let mission = mission(chain);
    let Some(agreed) = solve(&mission, &[]) else {
        return (0.0, Vec::new());
    };
    let x = xs(&places(&mission, &[], agreed.target));
    (chain.value(&x), x)
}

type Draw<R> = fn(&mut R, [f64; 2], f64) -> Chain;

/// Checks in random scenes that the agreed positions are as good as the best ones of a grid search.
///
/// The SIR of a scene is that of its worst hop, in the worse direction. At least 99.5 % of the scenes must be within
/// 1e-4 of the best SIR of the grid search, and all within 1 %.
fn as_good_as_the_judge(seed: u64, scenes: usize, noisy: bool, draw: Draw<ChaCha8Rng>) {
    let mut rng = generator(seed);
    for ends in ENDS {
        for drawn in [true, false] {
            let (mut all, mut short, mut worst) = (0, Vec::new(), 1.0_f64);
            for _ in 0..count(scenes) {
                let reverse = if drawn {
                    log_uniform(&mut rng, 0.01, 1.0)
                } else {
                    1.0
                };
                let mut chain = draw(&mut rng, ends, reverse);
                if noisy {
                    chain = in_noise(&mut rng, chain);
                }
                let (ours, x) = reached(&chain);
                let (mut best, mut places) = chain.best();
                if !x.is_empty() {
                    let (from_ours, refined) = chain.refined(&x);
                    if from_ours > best {
                        (best, places) = (from_ours, refined);
                    }
                }
                all += 1;
                let share = ours / best;
                worst = worst.min(share);
                if share < 1.0 - 1e-4 {
                    println!("{share:.6}: {x:?} instead of {places:?} in {chain:?}");
                    short.push(share);
                }
            }
            println!(
                "{ends:?} r drawn {drawn}: {} of {all} short, worst {worst:.6}",
                short.len()
            );
            assert!(worst >= 0.99, "{worst}");
            assert!(short.len() * 200 <= all.max(200), "{short:?}");
        }
    }
}

#[test]
fn the_best_places_of_usual_scenes_are_found() {
    as_good_as_the_judge(3302, 60, false, usual);
}

#[test]
fn the_best_places_in_noise_are_found() {
    as_good_as_the_judge(3303, 60, true, usual);
}

#[test]
fn the_best_places_near_an_interferer_are_found() {
    as_good_as_the_judge(3304, 60, false, adversarial);
}

#[test]
fn the_best_places_near_an_interferer_in_noise_are_found() {
    as_good_as_the_judge(3305, 60, true, adversarial);
}

/// Checks that relays stay at Tx if an interferer lies between Tx and a weak Rx.
///
/// The SIR of a chain is that of its worst hop in the worse direction. A chain whose last relay is above Rx, beyond the
/// interferer, has less than 0.3 of the SIR of a chain with all relays at Tx.
#[test]
fn relays_stay_at_tx_where_an_interferer_is_between_them_and_a_weak_rx() {
    let chain = Chain {
        distance_m: 1000.0,
        powers_w: vec![1.0; 4],
        altitude_m: 20.0,
        altitudes_m: Vec::new(),
        apart_m: 0.0,
        interferer: [32.0, 440.0, 111.0],
        others: Vec::new(),
        field: Vec::new(),
        loss: [LOS, NLOS],
        noise_w: 0.0,
        reverse: narrow(0.1),
    };
    let (ours, x) = reached(&chain);
    assert!(x.iter().all(|x| *x < 1.0), "{x:?}");
    let parked = chain.value(&[266.0, 1000.0]);
    assert!(parked / ours < 0.3, "{parked} {ours}");
    assert!(ours / chain.best().0 > 1.0 - 1e-4);
}
