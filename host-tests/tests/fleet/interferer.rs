//! Numbers of relays with one interferer.

use chacha20::ChaCha8Rng;
use host_tests::make;
use host_tests::placing::profile_of;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay::{Mission, Profile};
use uav_relay_oracle::mission::{as_relays_know_it, of_link};
use uav_relay_oracle::random::{self, Chain, count, log_uniform};
use uav_relay_oracle::reference::Link;
use uav_relay_tools::fewest::{Fewest, Most};

use super::{ROUNDING, chain, round};

/// Returns the mission of `link`, and a function from a relay's index to its altitude and power.
///
/// A relay with a larger index than those of `link` has the common profile of the mission.
pub(crate) fn briefed(link: &Link) -> (Mission, impl Fn(u16) -> Profile + use<>) {
    let (mission, own) = of_link(link, 1e-4).unwrap();
    let of = move |index: u16| profile_of(&mission, &own, index);
    (mission, of)
}

/// Returns `link` with `relays` relays. Additional relays are like the first one.
fn with(link: &Link, relays: usize) -> Link {
    let mut link = link.clone();
    let common = link.relays[0];
    link.relays.resize(relays, common);
    link
}

/// Returns the fewest relays that meet `target`, by trying every number of relays in f64. Returns 0 if no number up
/// to `most` suffices.
fn exhaustive(link: &Link, target: f64, most: usize) -> usize {
    let all = with(link, most);
    let mut from = 0.0;
    for n in 1..=most {
        let Some(x) = all.farthest(n, from, target) else {
            return 0;
        };
        if with_rx(&all, n, x) >= target {
            return n;
        }
        from = x;
    }
    0
}

fn with_rx(all: &Link, n: usize, x: f64) -> f64 {
    let mut last = all.clone();
    last.relays = vec![all.relays[n - 1]];
    last.sir_rx(x).unwrap()
}

/// Draws a target SIR: 1e-4 to 1.2 times the highest SIR that the first and the last hop both can have.
///
/// This range gives targets that need one to several dozen relays, and some that no chain meets. Returns `None` if the
/// last hop has no SIR.
fn target(rng: &mut impl Rng, link: &Link) -> Option<f64> {
    let d = link.distance_m;
    let first = (0..200)
        .map(|i| link.sir_relay(1, 0.0, d * f64::from(i) / 200.0).unwrap())
        .fold(0.0, f64::max);
    let most = first.min(link.sir_rx(d)?);
    let target = round(most * log_uniform(rng, 1e-4, 1.2));
    (target > 0.0).then_some(target)
}

#[test]
fn the_fewest_are_those_of_an_exhaustive_search() {
    const MOST: usize = 300;
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(601));
    let (mut met, mut none, mut ties, mut largest, mut fewer) = (0, 0, 0, 0, 0);
    while met + none < count(10_000) {
        let kind = if rng.random_bool(0.3) {
            Chain::OwnPower
        } else {
            Chain::Alike
        };
        let style = make::style(1..=20, kind);
        let link = as_relays_know_it(&random::link(&mut rng, &style));
        let Some(target) = target(&mut rng, &link) else {
            continue;
        };
        let expected = exhaustive(&link, target, MOST);
        let (mission, profile_of) = briefed(&link);
        let found = Fewest::of(&mission, target as f32, &profile_of);
        let told = found.map_or(0, |found| usize::from(found.relays));
        if expected == 0 {
            assert!(
                told == 0 || told > MOST || {
                    ties += 1;
                    exhaustive(&link, target * (1.0 - ROUNDING), MOST) == told
                }
            );
            none += 1;
            continue;
        }
        met += 1;
        if told != expected {
            // The last relay meets or misses the target by f32 rounding.
            ties += 1;
            let either =
                [1.0 - ROUNDING, 1.0 + ROUNDING].map(|by| exhaustive(&link, target * by, MOST));
            assert!(
                either.contains(&told),
                "{told} {expected} {either:?} {target} {link:?}"
            );
            continue;
        }
        assert!(found.unwrap().proven);
        largest = largest.max(told);
        // The positions form such a chain.
        let x = chain(&mission, found.unwrap().relays, target, &profile_of);
        let sir = with(&link, told).chain_sir(&x);
        assert!(sir >= target * (1.0 - ROUNDING), "{sir} {target} {link:?}");
        // One relay fewer is not enough; this follows from the sets of positions that each relay can have.
        if told > 1 && told <= 40 {
            fewer += 1;
            let fewer = with(&link, told - 1).placement(target * (1.0 + ROUNDING));
            assert!(fewer.is_none(), "{told} {target} {link:?}");
        }
    }
    println!(
        "{met} targets met, by up to {largest} relays, {none} not; one relay fewer refused {fewer} times by all places; \
         {ties} on the very border"
    );
    assert!(met > none && largest > 100 && ties < 20);
}

#[test]
fn with_a_separation_a_proven_number_is_the_fewest() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(602));
    let (mut proven, mut not, mut none) = (0, 0, 0);
    for _ in 0..count(10_000) / 5 {
        let style = make::style(1..=1, Chain::Alike);
        let mut link = random::link(&mut rng, &style);
        link.min_separation_m = link.distance_m * log_uniform(&mut rng, 1e-3, 0.3);
        let link = as_relays_know_it(&link);
        let Some(target) = target(&mut rng, &link) else {
            continue;
        };
        let (mission, profile_of) = briefed(&link);
        let Some(found) = Fewest::of(&mission, target as f32, &profile_of) else {
            none += 1;
            continue;
        };
        let n = usize::from(found.relays);
        if found.proven {
            proven += 1;
            let freely = exhaustive(&link, target * (1.0 - ROUNDING), 1000);
            assert!(freely == n || exhaustive(&link, target * (1.0 + ROUNDING), 1000) == n);
        } else {
            not += 1;
        }
        let x = chain(&mission, found.relays, target, &profile_of);
        let sir = with(&link, n).chain_sir(&x);
        assert!(
            sir >= target * (1.0 - ROUNDING),
            "{} {x:?} {link:?}",
            sir / target
        );
        for pair in x.windows(2) {
            assert!(pair[1] - pair[0] >= link.min_separation_m, "{x:?} {link:?}");
        }
    }
    println!("{proven} proven, {not} not, {none} with no such chain");
    assert!(proven > 500 && none > 100);
}

/// Checks that [`Most`] reports the highest target SIR over all numbers of relays.
///
/// A chain meets this target. Without a minimum separation, no number of relays meets a target that is 0.1 % higher.
#[test]
fn no_number_of_relays_exceeds_the_reported_maximum() {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(603));
    let (mut met, mut exceeded) = (0, 0);
    for _ in 0..300 {
        let style = make::style(1..=1, Chain::Alike);
        let mut link = random::link(&mut rng, &style);
        // A separation limits the number of relays and the work.
        link.min_separation_m = if rng.random_bool(0.5) {
            link.distance_m * log_uniform(&mut rng, 0.01, 0.3)
        } else {
            0.0
        };
        let link = as_relays_know_it(&link);
        let (mission, profile_of) = briefed(&link);
        let Some(most) = Most::of(&mission, &profile_of) else {
            assert!(link.sir_rx(0.0).unwrap() <= 0.0, "{link:?}");
            continue;
        };
        met += 1;
        let found = Fewest::of(&mission, most.target, &profile_of).unwrap();
        assert_eq!(found.relays, most.relays);
        if link.min_separation_m > 0.0 {
            // With a separation, a chain may meet a higher target although it does not meet a lower one.
            exceeded += u32::from(Fewest::of(&mission, most.target * 1.001, &profile_of).is_some());
            continue;
        }
        assert!(Fewest::of(&mission, most.target * 1.001, &profile_of).is_none());
        if most.relays < 900 {
            // Only the outer hops limit the target.
            let d = link.distance_m;
            let first =
                (0..=20_000).map(|i| link.sir_relay(1, 0.0, d * f64::from(i) / 2e4).unwrap());
            let outer = first.fold(0.0, f64::max).min(link.sir_rx(d).unwrap());
            assert!(
                (f64::from(most.target) / outer - 1.0).abs() < 1e-4,
                "{} {outer}",
                most.target
            );
        }
    }
    println!("{met} met; with a separation more is met in {exceeded}");
    assert!(met > 200 && exceeded < 10);
}
