//! Algorithm 2 for both directions, compared with a grid search in f64: moves of one relay, and chains.

use core::task::Poll;

use chacha20::ChaCha8Rng;
use host_tests::flights::settle;
use host_tests::placing::{generator, setpoints};
use rand::RngExt;
use uav_relay::optimiser::local::{HopEnd, Hops, LocalSearch};
use uav_relay::{Adjust, Band, Local, Method, Mission, MissionConfig, Placement};
use uav_relay_oracle::random::count;
use uav_relay_sim::simulator::setup::Setup;

use super::judge::Chain;
use super::scenes::{ENDS, adversarial, in_noise, log_uniform, mission, narrow, usual};
use super::shares::Shares;

/// Position of a node: x along the line Tx-Rx, and altitude, both in m.
type Place = [f64; 2];

/// Number of rounds of Algorithm 2 in a simulated chain; in each round every relay moves once.
const ROUNDS: u16 = 6;

/// Numbers of grid points along x and in altitude that the reference search tries for a relay.
const GRID: [usize; 2] = [240, 25];

/// Returns the power of interference plus noise that `node` receives at the position (x, h), W.
fn disturbance_w(chain: &Chain, node: usize, [x, h]: Place) -> f64 {
    let [power_w, xi, yi] = chain.interferer;
    let on_ground = node == 0 || node > chain.relays();
    let loss = chain.loss[usize::from(on_ground)];
    power_w / (loss * ((x - xi).powi(2) + yi * yi + h * h)) + chain.noise_w
}

/// Returns the two-way SIR of the hop to `node`, from position `from` to position `to`. It is the smaller of the
/// forward SIR and the backward SIR divided by the chain's `reverse`.
fn hop(chain: &Chain, node: usize, from: Place, to: Place) -> f64 {
    let squared = (to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2);
    let gain = 1.0 / (chain.loss[0] * squared);
    let there = chain.powers_w[node - 1] * gain / disturbance_w(chain, node, to);
    let back = chain.powers_w[node] * gain / disturbance_w(chain, node - 1, from);
    there.min(back / chain.reverse)
}

/// Returns the position of `node`: 0 is Tx, then come the relays at `places`, and last Rx.
fn place_of(chain: &Chain, places: &[Place], node: usize) -> Place {
    match node.checked_sub(1) {
        None => [0.0, 0.0],
        Some(at) => places.get(at).copied().unwrap_or([chain.distance_m, 0.0]),
    }
}

/// Returns the two-way SIR of the worst hop of a chain whose relays are at `places`.
///
/// The two-way SIR of a hop is the smaller of its forward SIR and its backward SIR divided by the chain's `reverse`.
fn value(chain: &Chain, places: &[Place]) -> f64 {
    let hops = (1..=places.len() + 1).map(|node| {
        let [from, to] = [node - 1, node].map(|node| place_of(chain, places, node));
        hop(chain, node, from, to)
    });
    hops.fold(f64::INFINITY, f64::min)
}

/// Returns the best position of relay `node` between its neighbours, and the lower SIR of its two hops.
///
/// The position is found by a grid search with altitudes within `altitudes_m`.
fn turn(chain: &Chain, places: &[Place], node: usize, altitudes_m: [f64; 2]) -> (Place, f64) {
    let [from, to] = [node - 1, node + 1].map(|node| place_of(chain, places, node));
    let worse = |at: Place| hop(chain, node, from, at).min(hop(chain, node + 1, at, to));
    let bounds = [[from[0], to[0]], altitudes_m];
    let point = |[least, most]: [f64; 2], at: usize, of: usize| {
        least + (most - least) * at as f64 / (of - 1) as f64
    };
    let mut all = Vec::new();
    for i in 0..GRID[0] {
        for j in 0..GRID[1] {
            let at = [point(bounds[0], i, GRID[0]), point(bounds[1], j, GRID[1])];
            all.push((worse(at), at));
        }
    }
    // Positions next to the neighbours and to the interferer.
    for about in [from[0], chain.interferer[1], to[0]] {
        for i in 0..28 {
            let off = (to[0] - from[0]) * 1e-6 * 1.6_f64.powi(i);
            for x in [about - off, about + off] {
                for j in 0..GRID[1] {
                    let at = [x.clamp(from[0], to[0]), point(bounds[1], j, GRID[1])];
                    all.push((worse(at), at));
                }
            }
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut best = all[0];
    for start in all.iter().take(60).step_by(12) {
        let mut found = *start;
        let mut width = [
            (to[0] - from[0]) / 100.0,
            (altitudes_m[1] - altitudes_m[0]) / 10.0,
        ];
        for _ in 0..200 {
            let before = found.0;
            for dx in -3..=3 {
                for dh in -3..=3 {
                    let at = [
                        (found.1[0] + width[0] * f64::from(dx) / 3.0).clamp(from[0], to[0]),
                        (found.1[1] + width[1] * f64::from(dh) / 3.0)
                            .clamp(altitudes_m[0], altitudes_m[1]),
                    ];
                    let sir = worse(at);
                    if sir > found.0 {
                        found = (sir, at);
                    }
                }
            }
            if !(found.0 > before * (1.0 + 1e-7)) {
                width = width.map(|width| width * 0.6);
            }
        }
        if found.0 > best.0 {
            best = found;
        }
    }
    (best.1, best.0)
}

fn draw(rng: &mut ChaCha8Rng, round: usize) -> Chain {
    let reverse = [1.0, log_uniform(rng, 0.01, 1.0)][round % 2];
    let chain = if round % 4 < 2 {
        usual(rng, ENDS[round % 3], reverse)
    } else {
        adversarial(rng, ENDS[round % 3], reverse)
    };
    if round % 8 < 4 {
        chain
    } else {
        in_noise(rng, chain)
    }
}

/// Checks that one relay's search in Algorithm 2 is as good as a dense grid search.
///
/// The relays are at random positions. Both searches have the same ranges of x and altitude.
#[test]
fn a_turn_is_as_good_as_a_dense_grid() {
    let mut rng = generator(3313);
    let [mut silent, mut noisy] = [Shares::default(), Shares::default()];
    for round in 0..count(400) {
        let mut chain = draw(&mut rng, round);
        let relays = 1 + round % 3;
        chain.powers_w.drain(1..chain.powers_w.len() - 1);
        for _ in 0..relays {
            chain
                .powers_w
                .insert(1, narrow(log_uniform(&mut rng, 0.3, 3.0)));
        }
        let node = rng.random_range(1..=relays);
        let mut x: Vec<f64> = (0..relays).map(|_| rng.random_range(0.0..1000.0)).collect();
        x.sort_by(f64::total_cmp);
        let places: Vec<Place> = x
            .iter()
            .map(|x| [narrow(*x), narrow(rng.random_range(20.0..120.0))])
            .collect();
        let mission = mission(&chain);
        let interferer = *mission.interferer().unwrap();
        let end = |node: usize| {
            (1..=relays).contains(&node).then(|| HopEnd {
                place: Placement::on_line(places[node - 1][0] as f32, places[node - 1][1] as f32),
                apart_m: 0.0,
                power_w: chain.powers_w[node] as f32,
            })
        };
        let own = end(node).unwrap();
        let hops = Hops::new(
            &mission,
            &interferer,
            end(node - 1),
            own.power_w,
            end(node + 1),
        );
        let now = {
            let [from, to] = [node - 1, node + 1].map(|node| place_of(&chain, &places, node));
            let at = places[node - 1];
            hop(&chain, node, from, at).min(hop(&chain, node + 1, at, to))
        };
        let rounding = f64::from(hops.worse(own.place)) / now - 1.0;
        assert!(rounding.abs() < 2e-5, "{rounding} {places:?} of {chain:?}");
        let mut search = LocalSearch::new(Local::Fine, hops, own.place, 30.0, (20.0, 120.0));
        let mut steps = 0;
        let found = loop {
            steps += 1;
            if let Poll::Ready(found) = search.step(600) {
                break found.unwrap_or(own.place);
            }
        };
        assert!(steps <= 15, "{steps}");
        let at = [f64::from(found.x_m), f64::from(found.altitude_m)];
        let [from, to] = [node - 1, node + 1].map(|node| place_of(&chain, &places, node));
        let ours = hop(&chain, node, from, at).min(hop(&chain, node + 1, at, to));
        let altitude_m = places[node - 1][1];
        let altitudes_m = [
            (altitude_m - 30.0).max(20.0),
            (altitude_m + 30.0).min(120.0),
        ];
        let (place, best) = turn(&chain, &places, node, altitudes_m);
        let share = ours / best;
        if share < 0.999 {
            println!(
                "{share:.5}: {at:?} instead of {place:?}, node {node} of {places:?} in {chain:?}"
            );
        }
        let shares = if chain.noise_w > 0.0 {
            &mut noisy
        } else {
            &mut silent
        };
        shares.push(share);
    }
    silent.report("turns without noise");
    noisy.report("turns in noise");
    assert!(silent.worst() > 0.99 && noisy.worst() > 0.99);
    assert!(silent.percentile(0.5) > 0.9999 && noisy.percentile(0.5) > 0.9999);
}

/// Checks that Algorithm 2 in simulated chains gains as much SIR as a grid search of the same rounds.
///
/// Both searches start from the same positions.
#[test]
fn flown_turns_gain_what_turns_by_a_dense_grid_gain() {
    let mut rng = generator(3314);
    let [mut shares, mut gains, mut one_way] = [(); 3].map(|()| Shares::default());
    let mut messages = 0;
    let mut all = 0;
    for round in 0..count(24) {
        let mut chain = draw(&mut rng, round);
        let relays = 1 + round % 8;
        chain.powers_w.drain(1..chain.powers_w.len() - 1);
        for _ in 0..relays {
            chain.powers_w.insert(1, 1.0);
        }
        let flown = |reverse: f64, rounds: u16| {
            let config = MissionConfig {
                band: Band {
                    least_m: 20.0,
                    most_m: 120.0,
                },
                reverse: reverse as f32,
                ..*mission(&chain).config()
            };
            let mut setup = Setup::new(Mission::try_new(config).unwrap());
            setup.settings.method = Method::Adjust(Adjust {
                rounds,
                explore_m: 30.0,
                local: Local::Fine,
            });
            let outcome = settle(setup);
            let rises = outcome.rounds.windows(2).all(|pair| pair[1] >= pair[0]);
            assert!(rises, "{:?} {chain:?}", outcome.rounds);
            let places: Vec<Place> = setpoints(&outcome)
                .iter()
                .map(|place| [f64::from(place.x_m), f64::from(place.altitude_m)])
                .collect();
            (outcome, places)
        };
        let (outcome, ours) = flown(chain.reverse, ROUNDS);
        let reached = value(&chain, &ours);
        let promised = f64::from(*outcome.rounds.last().unwrap());
        assert!(
            (promised / reached - 1.0).abs() < 3e-5,
            "{promised} {reached} {chain:?}"
        );
        let passes = outcome.rounds.len() as u64 + 1;
        all += 1;
        messages += u32::from(outcome.messages == 2 * (relays as u64 - 1) * (passes + 1));
        let start = {
            let mut setup = Setup::new(mission(&chain));
            setup.settings.method = Method::Align;
            let places = setpoints(&settle(setup));
            let place = |place: &Placement| [f64::from(place.x_m), f64::from(place.altitude_m)];
            places.iter().map(place).collect::<Vec<Place>>()
        };
        let mut theirs = start.clone();
        for _ in 0..ROUNDS {
            for node in 1..=relays {
                let altitude_m = theirs[node - 1][1];
                let altitudes_m = [
                    (altitude_m - 30.0).max(20.0),
                    (altitude_m + 30.0).min(120.0),
                ];
                theirs[node - 1] = turn(&chain, &theirs, node, altitudes_m).0;
            }
        }
        shares.push(reached / value(&chain, &theirs));
        gains.push(reached / value(&chain, &start));
        one_way.push(value(&chain, &flown(0.0, ROUNDS).1) / reached);
    }
    shares.report("chains, of turns by a grid search");
    gains.report("chains, of Algorithm 1's places");
    one_way.report("one-way turns, of turns both ways");
    println!("{messages} of {all} with the messages of one sweep and of the turns alone");
    assert!(gains.worst() >= 1.0 - 1e-5);
    assert!(shares.percentile(50.0) > 0.995);
}
