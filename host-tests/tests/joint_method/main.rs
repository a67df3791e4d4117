//! Joint choice of x, lateral offset and altitude: quality, cost, and independence from faults.

use chacha20::ChaCha8Rng;
use host_tests::flights::{settle, with_room};
use host_tests::placing::{reference, setpoints};
use rand::SeedableRng;
use uav_relay::{Instant, Method, Side};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::joint::{CROWDED, ROOMY, scenario};
use uav_relay_oracle::random::{self, count};
use uav_relay_oracle::recorded;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{self, Corridor, Place};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::Setup;

mod own;

/// Returns the setup of a chain whose altitudes and lateral offsets are limited by `corridor`. Returns `None` if a
/// relay would reject the mission.
fn setup(link: &Link, corridor: Corridor) -> Option<Setup> {
    let (mission, profiles) = of_link(link, 1e-4)?;
    let mut setup = Setup::new(with_room(mission.config(), corridor)?);
    setup.profiles = profiles;
    setup.settings.method = Method::Joint;
    Some(setup)
}

/// Asserts that a run took `messages` messages, apart from index claims.
///
/// Relays send claims at fixed times after the start. At each of these times, a relay may send two: its own claim, and
/// its echo of another claim.
fn assert_messages(outcome: &Outcome, relays: u64, messages: u64) {
    let seconds = outcome.ended.as_micros() as f64 * 1e-6;
    let times = [2.25, 2.75, 3.75, 5.75, 9.75, 17.75];
    let claims = times.iter().filter(|at| **at <= seconds).count() as u64;
    assert!(
        (messages..=messages + 2 * claims * relays).contains(&outcome.messages),
        "{relays} relays: {} and not {messages} in {seconds} s",
        outcome.messages
    );
}

fn places(outcome: &Outcome) -> Vec<Place> {
    setpoints(outcome).into_iter().map(reference).collect()
}

/// Returns a scenario whose results are in the documentation. The interferer is at (500, 150) m, altitudes are 20 m to
/// 300 m, and the separation is 4 m.
fn close_by(relays: usize) -> (Link, Corridor) {
    roomy(relays, 500.0, 150.0, 0.0, 300.0)
}

/// Result of the joint method in a random scenario.
struct Result {
    of: String,
    /// SIR of the chain as a fraction of the optimum.
    ratio: f64,
    sweeps: u32,
    bytes: u64,
}

/// Describes a random scene as text, with lengths as multiples of the distance from Tx to Rx.
fn described(link: &Link, corridor: Corridor) -> String {
    let d = link.distance_m;
    format!(
        "N = {}, D = {d:.0}, X = {:.3} D, Y = {:.4} D, band {:.4} D to {:.4} D, d_min {:.4} D",
        link.len(),
        link.x_i / d,
        link.y_i / d,
        corridor.least_m / d,
        corridor.most_m / d,
        link.min_separation_m / d,
    )
}

fn random_results(count: usize, seed: u64, apart: (f64, f64)) -> Vec<Result> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut results = Vec::new();
    while results.len() < count {
        let drawn = scenario(&mut rng, &(1..=50), apart);
        let link = as_relays_know_it(&drawn.link);
        let corridor = Corridor::plane(
            f64::from(drawn.corridor.least_m as f32),
            f64::from(drawn.corridor.most_m as f32),
        );
        let Some(setup) = setup(&link, corridor) else {
            continue;
        };
        let Some(best) = recorded::optimum(&link, corridor, &[]).unwrap() else {
            continue;
        };
        let outcome = run(setup).unwrap();
        let of = described(&link, corridor);
        assert_eq!(outcome.ending, Ending::Settled, "{of}");
        assert_eq!(outcome.unsafe_setpoints, 0, "{of}");
        let places = places(&outcome);
        // The f32 rounding of two positions reduces the separation.
        let rounded = Link {
            min_separation_m: (link.min_separation_m - 1e-6 * link.distance_m).max(0.0),
            ..link.clone()
        };
        assert!(joint::keeps_rules(&rounded, corridor, &[], &places), "{of}");
        results.push(Result {
            ratio: joint::sir(&link, &places).unwrap() / best.sir,
            of,
            sweeps: outcome.sweeps,
            bytes: outcome.bytes,
        });
    }
    results
}

/// Returns a scenario whose results are in the documentation. The interferer is at (`x_m`, `y_m`), m. Lateral offsets
/// are up to `lateral_m` to either side, altitudes 20 m to `most_m`.
fn roomy(relays: usize, x_m: f64, y_m: f64, lateral_m: f64, most_m: f64) -> (Link, Corridor) {
    let link = Link {
        x_i: x_m,
        y_i: y_m,
        min_separation_m: 4.0,
        ..Link::paper(relays)
    };
    let corridor = Corridor {
        least_m: 20.0,
        most_m,
        left_m: -lateral_m,
        right_m: lateral_m,
    };
    (link, corridor)
}

/// Checks that the joint method reaches known optima in one round trip.
///
/// An independent program has computed the optima.
#[test]
fn the_joint_optima_are_reached_in_one_round_trip() {
    for (relays, x_m, y_m, lateral_m, most_m, best) in [
        (2, 500.0, 150.0, 0.0, 300.0, 0.881_533_886_7),
        (5, 500.0, 150.0, 0.0, 300.0, 1.047_463_457_8),
        (8, 500.0, 150.0, 0.0, 300.0, 1.235_783_782_6),
        (50, 500.0, 150.0, 0.0, 300.0, 6.498_377_624_4),
        (3, 500.0, 150.0, 0.0, 300.0, 0.937_863_772),
        (3, 300.0, 50.0, 0.0, 300.0, 1.122_591_008),
        (8, 500.0, 400.0, 0.0, 300.0, 2.465_561_744),
        (3, 500.0, 150.0, 280.0, 300.0, 1.073_203_411),
        (8, 500.0, 150.0, 280.0, 300.0, 1.543_032_046),
        (8, 500.0, 400.0, 280.0, 300.0, 2.983_117_645),
        (3, 300.0, 50.0, 280.0, 300.0, 1.176_055_555),
        (8, 500.0, 150.0, 30.0, 120.0, 1.268_920_082),
        (8, 500.0, 150.0, 100.0, 120.0, 1.379_038_560),
        (50, 500.0, 150.0, 280.0, 300.0, 9.002_614_360),
    ] {
        let (link, corridor) = roomy(relays, x_m, y_m, lateral_m, most_m);
        let outcome = settle(setup(&link, corridor).unwrap());
        let places = places(&outcome);
        let sir = joint::sir(&link, &places).unwrap();
        println!(
            "N = {relays}, X = {x_m}, Y = {y_m}, to the side {lateral_m}: {sir:.7} of {best}; {} passes, {} messages, {} bytes, {:.3} s",
            outcome.sweeps,
            outcome.messages,
            outcome.bytes,
            outcome.ended.as_micros() as f64 / 1e6
        );
        assert!(
            sir >= best * (1.0 - 1e-4) && sir <= best * (1.0 + 1e-6),
            "{sir}"
        );
        assert_eq!(outcome.sweeps, 1);
        assert_messages(&outcome, relays as u64, 2 * (relays as u64 - 1));
        let corridor = Corridor {
            least_m: corridor.least_m - 1e-9,
            most_m: corridor.most_m + 1e-9,
            ..corridor
        };
        assert!(joint::keeps_rules(&link, corridor, &[], &places));
    }
}

/// Checks that the chain needs one round trip, without queries to neighbours that are still computing.
#[test]
fn a_chain_of_any_length_needs_one_round_trip() {
    println!("| N | to the side | sweeps | messages | bytes | virtual time |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for relays in [2, 5, 8, 50, 100] {
        for lateral_m in [0.0, 280.0] {
            let (link, corridor) = roomy(relays, 500.0, 150.0, lateral_m, 300.0);
            let outcome = settle(setup(&link, corridor).unwrap());
            println!(
                "| {relays} | {lateral_m} m | {} | {} | {} | {:.2} s |",
                outcome.sweeps,
                outcome.messages,
                outcome.bytes,
                outcome.ended.as_micros() as f64 / 1e6
            );
            assert_eq!(outcome.sweeps, 1);
            assert_messages(&outcome, relays as u64, 2 * (relays as u64 - 1));
        }
    }
}

/// Checks that if a relay stops while all relays compute, both its neighbours report it as lost.
#[test]
fn a_relay_that_stops_while_all_compute_is_reported_lost() {
    let (link, corridor) = roomy(50, 500.0, 150.0, 280.0, 300.0);
    let mut setup = setup(&link, corridor).unwrap();
    let lost = setup.settings.dead_after;
    setup.kills.push((25, Instant::from_millis(1_000)));
    let clean = Setup {
        kills: Vec::new(),
        ..setup.clone()
    };
    let solved_by = settle(clean).ended;
    let outcome = run(setup).unwrap();
    for neighbour in [(24, Side::Downstream), (26, Side::Upstream)] {
        let missed = outcome.noticed[&neighbour];
        assert!(missed > Instant::from_millis(0) + lost, "{missed:?}");
        assert!(missed <= solved_by + lost, "{missed:?}");
    }
}

/// Prints the results. Returns the number of results within 0.1 % of the optimum, the worst and the best ratio, and the
/// total number of sweeps (messages along the chain).
fn summary(results: &mut [Result]) -> (usize, f64, f64, u32) {
    results.sort_by(|a, b| a.ratio.total_cmp(&b.ratio));
    for result in results.iter().take_while(|result| result.ratio < 0.999) {
        println!(
            "{:.5} in {} passes: {}",
            result.ratio, result.sweeps, result.of
        );
    }
    let near = results
        .iter()
        .filter(|result| result.ratio >= 0.999)
        .count();
    let passes: u32 = results.iter().map(|result| result.sweeps).sum();
    let (worst, best) = (results[0].ratio, results.last().unwrap().ratio);
    println!(
        "{near} of {} within 0.1 %, worst {worst:.5}, best {best:.8}; {:.1} passes, at most {}; at most {} bytes",
        results.len(),
        f64::from(passes) / results.len() as f64,
        results.iter().map(|result| result.sweeps).max().unwrap(),
        results.iter().map(|result| result.bytes).max().unwrap(),
    );
    (near, worst, best, passes)
}

/// Checks that random chains come near the recorded optimal SIRs of the joint problem. 98 % of the chains must be within 0.1 %.
#[test]
fn random_chains_come_near_the_joint_optimum() {
    let count = count(100);
    let mut results = random_results(count, random::seed(41), ROOMY);
    let (near, worst, best, passes) = summary(&mut results);
    // A search that adapts to the first rise takes 8.5 passes on average.
    assert!(f64::from(passes) <= 10.0 * count as f64, "{passes}");
    assert!(near * 100 >= 98 * count, "{near} of {count}");
    assert!(worst >= 0.94, "{worst}");
    assert!(best <= 1.0 + 1e-5, "{best}");
}

/// Checks that 95 % of random chains with a wide minimum separation are within 0.1 % of the optimum.
///
/// At the optimum, a relay may have to be nearer to Tx than the farthest x that the target SIR permits. The joint
/// method does not consider such positions.
#[test]
fn crowded_chains_are_seldom_far_from_the_joint_optimum() {
    let count = count(60);
    let mut results = random_results(count, random::seed(43), CROWDED);
    let (near, worst, best, _) = summary(&mut results);
    assert!(near * 100 >= 95 * count, "{near} of {count}");
    assert!(worst >= 0.5 && best <= 1.0 + 1e-5, "{worst} {best}");
}
