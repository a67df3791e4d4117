//! Algorithm 2: it never lowers the chain's SIR, and its fine search gains more than a coarse grid.

use core::task::Poll;

use chacha20::ChaCha8Rng;
use host_tests::flights::settle;
use host_tests::make;
use host_tests::placing::{reference, setpoints};
use rand::{RngExt, SeedableRng};
use uav_relay::optimiser::local::{HopEnd, Hops, LocalSearch};
use uav_relay::sir::{Sender, at_receiver};
use uav_relay::{Adjust, Local, Method, Mission, MissionConfig, Placement};
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::random;
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{Place, sir};
use uav_relay_sim::simulator::outcome::Outcome;
use uav_relay_sim::simulator::setup::Setup;

/// Returns a chain of `relays` relays at an altitude of 220 m, as reference model and simulation setup. The
/// interferer is at (500, 150) m, altitudes may be 20 m to 300 m, and the minimum separation is 4 m.
fn setup(relays: usize, adjust: Adjust) -> (Link, Setup) {
    let mut link = Link {
        y_i: 150.0,
        min_separation_m: 4.0,
        ..Link::paper(relays)
    };
    for relay in &mut link.relays {
        relay.altitude_m = 220.0;
    }
    let (mission, _) = of_link(&link, 1e-4).unwrap();
    let config = MissionConfig {
        band: make::band(20.0, 300.0),
        ..*mission.config()
    };
    let mut setup = Setup::new(Mission::try_new(config).unwrap());
    setup.settings.method = Method::Adjust(adjust);
    (link, setup)
}

/// Returns the SIR of the worst hop in `outcome`, and the least distance of neighbouring relays, m.
///
/// The SIR is computed by the f64 reference model.
fn judged(link: &Link, outcome: &Outcome) -> (f64, f64) {
    let places: Vec<Place> = setpoints(outcome).into_iter().map(reference).collect();
    let apart = places.windows(2).map(|pair| pair[0].distance_m(&pair[1]));
    let apart = apart.fold(f64::INFINITY, f64::min);
    (sir(link, &places).unwrap(), apart)
}

/// Runs one relay's search for a better position (a turn of Algorithm 2) to its end.
///
/// Returns a position better than the relay's present position, if found.
fn searched(mut search: LocalSearch) -> Option<Placement> {
    loop {
        if let Poll::Ready(found) = search.step(500) {
            return found;
        }
    }
}

fn rises(outcome: &Outcome) -> bool {
    outcome.rounds.windows(2).all(|pair| pair[1] >= pair[0])
}

/// Checks that Algorithm 2 raises the SIR of fifty relays by its fine search, but not by a coarse grid.
///
/// The optimum, an SIR of 6.49838, is 19.4 % above that of the starting positions.
#[test]
fn fine_search_gains_sir_over_a_coarse_grid() {
    let of = |rounds, local| {
        let (link, setup) = setup(50, make::adjust(rounds, 10.0, local));
        let outcome = settle(setup);
        let (sir, apart) = judged(&link, &outcome);
        println!(
            "{local:?}, at most {rounds} rounds: {} rounds, SIR {:.5} to {sir:.5}; {} messages, {} bytes",
            outcome.rounds.len() - 1,
            outcome.rounds[0],
            outcome.messages,
            outcome.bytes
        );
        assert!(rises(&outcome), "a round has made the chain worse");
        assert!(apart >= 4.0 - 1e-3, "{apart} m");
        assert!((sir / f64::from(*outcome.rounds.last().unwrap()) - 1.0).abs() < 1e-5);
        (sir, outcome.rounds[0])
    };
    let (sir, begin) = of(500, Local::Fine);
    assert!((6.40..=6.498_377_7).contains(&sir), "{sir}");
    assert!((f64::from(begin) / 5.442_6 - 1.0).abs() < 1e-4);
    let grid = Local::Grid {
        columns: 41,
        rows: 21,
    };
    let (sir, begin) = of(500, grid);
    assert!((sir / f64::from(begin) - 1.0).abs() < 1e-6, "{sir}");
    let (ten, _) = of(10, Local::Fine);
    assert!((ten / 5.555 - 1.0).abs() < 1e-3, "{ten}");
}

/// Checks that the paper's grid search makes the same moves as a separate reference program.
///
/// The SIRs of the hops differ much at the start positions.
#[test]
fn grid_search_moves_as_the_reference_program() {
    let link = Link {
        y_i: 150.0,
        min_separation_m: 4.0,
        ..Link::paper(4)
    };
    let (mission, _) = of_link(&link, 1e-4).unwrap();
    let mut places = [300.0_f32, 400.0, 500.0, 600.0].map(|x_m| Placement::on_line(x_m, 100.0));
    let how = Local::Grid {
        columns: 41,
        rows: 21,
    };
    let chain = |places: &[Placement]| {
        let mut sender = Sender::transmitter(&mission);
        let (mut worst, mut from) = (f32::INFINITY, 0.0);
        for place in places {
            worst = worst.min(sender.sir_at(&mission, from, *place));
            from = place.x_m;
            sender = Sender::relay(
                &mission,
                uav_relay::place::Station {
                    cross_section: place.cross_section(),
                    power_w: 1.0,
                },
            );
        }
        worst.min(at_receiver(&mission, places[3], 1.0))
    };
    let mut history = vec![chain(&places)];
    for _ in 0..5 {
        for at in 0..4 {
            let hops = hops_of(&mission, &places, at);
            let found = searched(LocalSearch::new(how, hops, places[at], 10.0, (20.0, 300.0)));
            if let Some(better) = found {
                assert!(hops.worse(better) > hops.worse(places[at]));
                places[at] = better;
            }
        }
        history.push(chain(&places));
    }
    let theirs = [
        0.040_625,
        0.073_272_789,
        0.144_227_248,
        0.233_182_708,
        0.233_182_708,
        0.241_606_825,
    ];
    println!("{history:?}");
    for (ours, theirs) in history.iter().zip(theirs) {
        assert!(
            (f64::from(*ours) / theirs - 1.0).abs() < 1e-5,
            "{ours} against {theirs}"
        );
    }
}

/// Checks that the fine search of Algorithm 2 for one relay is as good as a dense grid search.
///
/// The lower SIR of the relay's two hops is compared. Both searches keep the minimum separation from the neighbours.
#[test]
fn the_fine_search_is_as_good_as_a_dense_grid() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(71));
    let (mut lower, mut higher, mut far) = (0.0_f64, 0, 0);
    // So large a separation that it limits the best position in some scenes.
    let apart_m = 120.0;
    let mut nearest = f32::INFINITY;
    for _ in 0..300 {
        let link = Link {
            x_i: rng.random_range(-200.0..1200.0),
            y_i: rng.random_range(0.0..300.0),
            ..Link::paper(3)
        };
        let (mission, _) = of_link(&link, 1e-4).unwrap();
        let interferer = *mission.interferer().unwrap();
        let mut place = |low: f32, high: f32| {
            Placement::on_line(rng.random_range(low..high), rng.random_range(30.0..200.0))
        };
        let (a, b, c) = (place(50.0, 250.0), place(380.0, 550.0), place(680.0, 950.0));
        let beside = |place| {
            Some(HopEnd {
                place,
                apart_m,
                power_w: 1.0,
            })
        };
        let hops = Hops::new(&mission, &interferer, beside(a), 1.0, beside(c));
        let mut find = |local| {
            let search = LocalSearch::new(local, hops, b, 20.0, (30.0, 200.0));
            let to = searched(search).unwrap_or(b);
            for neighbour in [a, c] {
                let (dx, dh) = (to.x_m - neighbour.x_m, to.altitude_m - neighbour.altitude_m);
                nearest = nearest.min(dx.hypot(dh));
            }
            hops.worse(to)
        };
        let fine = find(Local::Fine);
        let grid = find(Local::Grid {
            columns: 255,
            rows: 255,
        });
        lower = lower.max(1.0 - f64::from(fine / grid));
        far += u32::from(f64::from(fine) < 0.99 * f64::from(grid));
        higher += u32::from(fine > grid);
    }
    println!("higher than the grid in {higher} of 300, lower by at most {lower:.1e}");
    println!("nearest neighbour at {nearest} m");
    assert!((apart_m - 1e-2..apart_m + 5.0).contains(&nearest));
    assert!(higher > 200);
    // At one altitude near the interferer the SIR may have two maxima along x, of which bisection finds one.
    assert!(far <= 3, "{far}");
}

/// Returns the two hops that begin or end at relay `at` (from 0) in a chain of 1 W relays at `places`.
fn hops_of(mission: &Mission, places: &[Placement], at: usize) -> Hops {
    let beside = |place: &Placement| HopEnd {
        place: *place,
        apart_m: mission.config().min_separation_m,
        power_w: 1.0,
    };
    let before = at.checked_sub(1).map(|before| beside(&places[before]));
    let after = places.get(at + 1).map(beside);
    Hops::new(mission, mission.interferer().unwrap(), before, 1.0, after)
}

/// Checks that Algorithm 2 ends where no move of a single relay would raise the SIR.
///
/// The algorithm must end before its last permitted round.
#[test]
fn adjusting_ends_in_a_local_optimum() {
    let local = Local::Grid {
        columns: 21,
        rows: 11,
    };
    for relays in 2..8 {
        let adjust = make::adjust(2_000, 10.0, local);
        let (_, mut setup) = setup(relays, adjust);
        // The start is far from the final positions, except perhaps for the first relay.
        let low = make::profile(60.0, 1.0);
        setup.profiles.push((relays as u16, low));
        let mission = setup.mission;
        let outcome = settle(setup);
        let rounds = outcome.rounds.len() - 1;
        assert!(rounds < 2_000, "it never ended");
        let places = setpoints(&outcome);
        for at in 0..relays {
            let hops = hops_of(&mission, &places, at);
            let better = searched(LocalSearch::new(
                local,
                hops,
                places[at],
                10.0,
                (20.0, 300.0),
            ));
            assert_eq!(
                better,
                None,
                "relay {} of {relays} after {rounds} rounds",
                at + 1
            );
        }
    }
}

/// Checks that the fine search and the grid search keep the minimum separation.
///
/// They must do so even where a smaller separation would give a higher SIR.
#[test]
fn relays_keep_their_separation_where_it_costs_sir() {
    for local in [
        Local::Fine,
        Local::Grid {
            columns: 41,
            rows: 21,
        },
    ] {
        let adjust = make::adjust(60, 30.0, local);
        let (link, mut setup) = setup(12, adjust);
        let config = MissionConfig {
            min_separation_m: 24.0,
            ..*setup.mission.config()
        };
        setup.mission = Mission::try_new(config).unwrap();
        let outcome = settle(setup);
        let (sir, apart) = judged(&link, &outcome);
        println!("{local:?}: {apart:.3} m apart, SIR {sir:.4}");
        assert!(apart >= 24.0 - 1e-3, "{apart}");
        assert!(
            apart < 26.0,
            "{apart}: it does not bind, and the test tests nothing"
        );
        assert!(rises(&outcome));
    }
}
