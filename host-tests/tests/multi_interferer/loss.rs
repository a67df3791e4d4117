//! SIR lost by placing a chain with the hypothetical interferer. `COUNT` scenes of each kind (30 if unset).

use chacha20::ChaCha8Rng;
use host_tests::placing::profile_of;
use rand::SeedableRng;
use uav_relay::Schedule;
use uav_relay::optimiser::plan::solve;
use uav_relay_oracle::random::{count, seed};
use uav_relay_scenario::hypothetical::hypothetical;
use uav_relay_scenario::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Scenario};
use uav_relay_sim::report::place;
use uav_relay_tools::multi_interferer::optimum;

use super::scenes::{Sources, scenario};

/// Relative tolerance of the target SIR on which the relays agree.
const TOLERANCE: f64 = 1e-5;

/// Upper limits of the classes of a fitted interferer's relative error.
const CLASSES: [f64; 6] = [0.001, 0.01, 0.03, 0.1, 0.3, 1.0];

/// Relative error of a fitted single interferer, and its cost. The cost is the fraction of the best SIR that a chain loses by this error.
struct Outcome {
    error: f64,
    lost: f64,
}

/// Returns x and altitude of each relay in a scenario with one interferer, m; `None` if no chain fits.
fn placed(scenario: &Scenario, n: u16) -> Option<Vec<(f64, f64)>> {
    let (mission, own) = mission::mission(scenario, n, TOLERANCE).ok()?;
    let of = |index: u16| profile_of(&mission, &own, index);
    let agreed = solve(&mission, Schedule::Bracketed, of).ok()?;
    (1..=n)
        .map(|index| {
            let at = place(&mission, agreed.target, index, of)?;
            Some((f64::from(at.x_m), f64::from(at.altitude_m)))
        })
        .collect()
}

fn outcomes(default_seed: u64, kind: Sources) -> Vec<Outcome> {
    let count = count(30);
    let mut rng = ChaCha8Rng::seed_from_u64(seed(default_seed));
    let mut outcomes = Vec::new();
    while outcomes.len() < count {
        let (mut scenario, n) = scenario(&mut rng, 1..=20, 2..=5, kind);
        scenario.min_separation_m = 0.0;
        let scene = Scene::new(&scenario, n).unwrap();
        let best = optimum(&scene).unwrap().sir;
        let stand_in = hypothetical(&scene).unwrap();
        scenario.interference = Interference::Sources(vec![stand_in.source()]);
        let places = placed(&scenario, n).expect("the relays know a place");
        let lost = 1.0 - scene.chain_sir(&places) / best;
        assert!((-1e-6..=1.0).contains(&lost), "{lost} in {scene:?}");
        outcomes.push(Outcome {
            error: stand_in.relative_error,
            lost,
        });
    }
    outcomes
}

/// Returns the number of outcomes whose loss is more than the fraction `limit` of the best SIR.
fn losing(outcomes: &[&Outcome], limit: f64) -> usize {
    outcomes
        .iter()
        .filter(|outcome| outcome.lost > limit)
        .count()
}

fn print(what: &str, outcomes: &[Outcome]) {
    println!(
        "{what}: relative error, scenes, of those that lose more than 1 %, 5 %, 20 %, the median loss"
    );
    let mut low = 0.0;
    for high in CLASSES {
        let class = |outcome: &&Outcome| (low..high).contains(&outcome.error);
        let mut class: Vec<&Outcome> = outcomes.iter().filter(class).collect();
        class.sort_by(|a, b| a.lost.total_cmp(&b.lost));
        let [one, five, twenty] = [0.01, 0.05, 0.2].map(|limit| losing(&class, limit));
        let median = class.get(class.len() / 2).map_or(0.0, |middle| middle.lost);
        println!(
            "{low:>6}..{high:<6}{:>5}{one:>5}{five:>5}{twenty:>5}{median:>9.4}",
            class.len()
        );
        low = high;
    }
}

#[test]
fn placing_by_the_hypothetical_interferer_costs_sir() {
    let any = outcomes(83, Sources::Any);
    let aloof = outcomes(84, Sources::Aloof);
    print("sources anywhere", &any);
    print("sources well beside the line", &aloof);
    let share = |outcomes: &[Outcome], limit: f64| {
        let all: Vec<&Outcome> = outcomes.iter().collect();
        losing(&all, limit) as f64 / all.len() as f64
    };
    // The loss follows the fit: a small relative error goes with a small loss.
    assert!(share(&aloof, 0.05) < share(&any, 0.05));
    let halves = |outcomes: &[Outcome]| {
        let mut sorted: Vec<&Outcome> = outcomes.iter().collect();
        sorted.sort_by(|a, b| a.error.total_cmp(&b.error));
        let (well, badly) = sorted.split_at(sorted.len() / 2);
        (losing(well, 0.05), losing(badly, 0.05))
    };
    let (well, badly) = halves(&any);
    assert!(well < badly, "{well} {badly}");
}
