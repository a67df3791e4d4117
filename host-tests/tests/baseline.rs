//! Baseline placements, compared with values of a separate program and with brute force.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::SeedableRng;
use uav_relay_oracle::cases;
use uav_relay_oracle::mission::scene_of;
use uav_relay_oracle::random::{self, Chain};
use uav_relay_oracle::reference::Link;
use uav_relay_scenario::scene::Scene;
use uav_relay_tools::baseline::{blind_places, equal_places, mean};

fn scene(link: &Link) -> Scene {
    scene_of(link).unwrap()
}

fn off(got: f64, want: f64) -> f64 {
    (got / want - 1.0).abs()
}

#[test]
fn a_single_relay_has_the_reference_position() {
    let cases = cases::of("baseline_single").unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let mut link = case.link(1);
        link.relays[0].altitude_m = case.arg("h").unwrap();
        let places = blind_places(&scene(&link));
        assert!(off(places[0], case.part("chen_x").unwrap()) < case.rtol);
        assert!(off(link.chain_sir(&places), case.part("chen_sir").unwrap()) < case.rtol);
        let middle = link.chain_sir(&equal_places(&scene(&link)));
        assert!(off(middle, case.part("midpoint_sir").unwrap()) < case.rtol);
        let random = mean(&scene(&link), 200_000, 1);
        let want = case.part("random_mean").unwrap();
        assert!(random.error < 2e-3 * want, "{random:?}");
        assert!(
            (random.sir - want).abs() < 4.0 * random.error,
            "{random:?} against {want}"
        );
    }
}

#[test]
fn chains_have_the_reference_positions() {
    let cases = cases::of("baseline_multi").unwrap();
    assert!(!cases.is_empty());
    for case in cases {
        let link = case.link(case.relays().unwrap());
        let places = blind_places(&scene(&link));
        for (got, want) in places.iter().zip(case.part_list("chen_x").unwrap()) {
            assert!(off(*got, want) < case.rtol, "{got} against {want}");
        }
        assert!(off(link.chain_sir(&places), case.part("chen_sir").unwrap()) < case.rtol);
        let equal = link.chain_sir(&equal_places(&scene(&link)));
        assert!(off(equal, case.part("equal_sir").unwrap()) < case.rtol);
    }
}

/// Returns the weakest received signal on the hops of a chain, W. Interference is ignored.
fn weakest_signal(link: &Link, places: &[f64]) -> f64 {
    let relay = link.relays[0];
    let height2 = relay.altitude_m * relay.altitude_m;
    let (first, last) = (places[0], link.distance_m - places[places.len() - 1]);
    let mut weakest = link.tx_w / (link.eta * (first * first + height2));
    for pair in places.windows(2) {
        let step = pair[1] - pair[0];
        weakest = weakest.min(relay.power_w / (link.mu_los * step * step));
    }
    weakest.min(relay.power_w / (link.eta * (last * last + height2)))
}

/// Returns the largest possible value of a chain's weakest signal with relays at grid points, W.
///
/// The grid divides the line into `points` steps. `chosen` has the positions of the first relays. The other `left`
/// relays are not nearer to Tx than those first relays.
fn best_of_grid(link: &Link, points: u32, left: usize, chosen: &mut Vec<f64>) -> f64 {
    if left == 0 {
        return weakest_signal(link, chosen);
    }
    let mut best = 0.0_f64;
    for k in 0..=points {
        let place = link.distance_m * f64::from(k) / f64::from(points);
        if chosen.last().is_none_or(|last| *last <= place) {
            chosen.push(place);
            best = best.max(best_of_grid(link, points, left - 1, chosen));
            chosen.pop();
        }
    }
    best
}

/// Checks that positions on a grid have no stronger weakest signal than those of `blind_places`.
///
/// `blind_places` maximises the weakest signal of a chain. The random links have 1 to 3 relays. Interference is
/// ignored.
#[test]
fn no_grid_has_a_stronger_weakest_signal() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(11));
    let mut capped = 0;
    for (relays, points, links) in [(1, 2000, 60), (2, 200, 60), (3, 60, 30)] {
        let style = make::style(relays..=relays, Chain::Alike);
        for _ in 0..links {
            let link = random::link(&mut rng, &style);
            let places = blind_places(&scene(&link));
            assert_eq!(places.len(), link.len());
            assert!(places.windows(2).all(|pair| pair[0] <= pair[1]));
            assert!((0.0..=link.distance_m).contains(&places[0]));
            assert!(places[places.len() - 1] <= link.distance_m);
            let got = weakest_signal(&link, &places);
            let grid = best_of_grid(&link, points, link.len(), &mut Vec::new());
            assert!(got >= grid * (1.0 - 1e-9), "{got} against {grid}: {link:?}");
            // A grid step is a small fraction of the longest hop, and the signal falls with its square.
            assert!(grid >= 0.8 * got, "{got} against {grid}: {link:?}");
            let relay = link.relays[0];
            let cap = link.tx_w.min(relay.power_w) / (link.eta * relay.altitude_m.powi(2));
            capped += u32::from(off(got, cap) < 1e-12);
        }
    }
    // Some links, but not all, have a relay right above Tx or Rx and shortened hops.
    println!("{capped} of 150 with a relay above a ground station");
    assert!((5..145).contains(&capped), "{capped}");
}

/// Checks that surplus relays shorten all hops, and that the last relay is above Rx.
///
/// A relay is surplus if fewer relays give the same weakest signal, that of the hop from the last relay straight down
/// to Rx. All other hops are shortened by the same factor.
#[test]
fn surplus_relays_shorten_all_hops_in_proportion() {
    let link = Link::paper(50);
    let places = blind_places(&scene(&link));
    assert!(off(places[49], link.distance_m) < 1e-12);
    let first = (80.0_f64 - 1.0).sqrt() * 20.0;
    let (step, whole) = (20.0, first + 49.0 * 20.0);
    assert!(off(places[0], first * 1000.0 / whole) < 1e-9);
    assert!(off(places[1] - places[0], step * 1000.0 / whole) < 1e-9);
}

/// Checks that the first relay is placed straight above Tx if Tx has less power than the relays.
#[test]
fn the_relay_of_the_weaker_ground_station_is_above_it() {
    let mut link = Link::paper(60);
    link.tx_w = 0.5;
    let places = blind_places(&scene(&link));
    // At 0.5 W / (eta h^2) the steps are 0 to the first relay, sqrt(2) h between relays, h to Rx.
    let (step, last) = (20.0 * 2.0_f64.sqrt(), 20.0);
    let whole = 59.0 * step + last;
    assert!(places[0].abs() < 1e-9);
    assert!(off(places[1], step * 1000.0 / whole) < 1e-9);
    assert!(off(1000.0 - places[59], last * 1000.0 / whole) < 1e-9);
}

/// Checks that the mean SIR of two relays at random positions equals the integral over all positions.
#[test]
fn the_mean_of_random_chains_is_the_integral() {
    // With an interferer near Tx and relays with a long range, the order of relays matters.
    let mut link = Link {
        x_i: 150.0,
        y_i: 50.0,
        ..Link::paper(2)
    };
    for relay in &mut link.relays {
        relay.power_w = 40.0;
    }
    let points = 1000;
    let place = |k: i32| link.distance_m * (f64::from(k) + 0.5) / f64::from(points);
    let (mut sum, mut db, mut rate) = (0.0, 0.0, 0.0);
    for a in 0..points {
        for b in 0..points {
            // Half a cell off the diagonal, where the hop has no length.
            let (x, y) = (
                place(a.min(b)),
                place(a.max(b)) + 0.25 * link.distance_m / f64::from(points),
            );
            let sir = link.chain_sir(&[x, y.min(link.distance_m)]);
            sum += sir;
            db += 10.0 * sir.log10();
            rate += (1.0 + sir).log2();
        }
    }
    let cells = f64::from(points * points);
    let got = mean(&scene(&link), 200_000, 5);
    println!("{got:?}; {} {} {}", sum / cells, db / cells, rate / cells);
    assert!((got.sir - sum / cells).abs() < 4.0 * got.error, "{got:?}");
    assert!(got.error < 0.01 * got.sir);
    assert!((got.db - db / cells).abs() < 0.1, "{got:?}");
    assert!(off(got.rate, rate / cells) < 0.01, "{got:?}");
}

#[test]
fn the_same_seed_draws_the_same_chains_and_another_others() {
    let link = Link::paper(5);
    assert_eq!(mean(&scene(&link), 100, 1), mean(&scene(&link), 100, 1));
    assert_ne!(mean(&scene(&link), 100, 1), mean(&scene(&link), 100, 2));
}

#[test]
fn the_standard_error_is_the_scatter_of_means() {
    let link = Link::paper(8);
    let means: Vec<_> = (0..400)
        .map(|seed| mean(&scene(&link), 200, seed))
        .collect();
    let count = means.len() as f64;
    let centre = means.iter().map(|mean| mean.sir).sum::<f64>() / count;
    let scatter = (means
        .iter()
        .map(|mean| (mean.sir - centre).powi(2))
        .sum::<f64>()
        / (count - 1.0))
        .sqrt();
    let stated = means.iter().map(|mean| mean.error).sum::<f64>() / count;
    println!("scatter {scatter:.5}, stated {stated:.5}");
    assert!((0.85..1.15).contains(&(stated / scatter)));
}
