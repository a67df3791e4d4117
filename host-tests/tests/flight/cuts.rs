//! Two overlapping cuts of the chain.

use rand::SeedableRng;
use uav_relay_sim::simulator::chain::run;

use super::*;

/// Longest time from the last repair of the chain until all relays are in one membership view, s.
const SOON_S: f64 = 120.0;

/// Returns all pairs of different links to cut. A link has the index of the relay at its end toward Tx.
///
/// The first link of a pair is cut first.
fn pairs() -> impl Iterator<Item = (u16, u16)> {
    (1..8)
        .flat_map(|first| (1..8).map(move |second| (first, second)))
        .filter(|(first, second)| first != second)
}

/// Checks that all relays are in one membership view soon after two cuts that overlap in time.
///
/// The four numbers of a row are times in s: begin and end of the first cut, then begin and end of the second cut. In
/// the last row, the cuts heal within a second of each other.
#[test]
fn all_relays_are_in_one_view_soon_after_two_cuts() {
    let all = [
        [20, 120, 60, 160],
        [20, 60, 40, 90],
        [20, 200, 100, 150],
        [30, 200, 31, 201],
    ];
    let mut took = Vec::new();
    let mut failed = Vec::new();
    let mut least_m = f64::INFINITY;
    for times in all {
        for (first, second) in pairs() {
            let mut rng = ChaCha8Rng::seed_from_u64(number("SEED", 1));
            let mut setup = eight(&mut rng);
            let [from, until, then, healed] = times.map(seconds);
            for (after, from, until) in [(first, from, until), (second, then, healed)] {
                let until = Some(until);
                setup.partitions.push(Partition { after, from, until });
            }
            end_at(&mut setup, seconds(times[3] + 300));
            let outcome = run(setup).unwrap();
            least_m = least_m.min(outcome.nearest_m());
            let watched = outcome.watched.unwrap();
            let at = together(&outcome);
            let after = at.map(|at| at.since(healed).as_micros() as f64 / 1e6);
            if after.is_none_or(|after| after > SOON_S)
                || watched.most_flying > 1
                || outcome.nearest_m() < floor_m(1)
            {
                let nearest = outcome.nearest;
                failed.push((times, first, second, after, watched.most_flying, nearest));
            }
            took.extend(after);
        }
    }
    took.sort_by(f64::total_cmp);
    println!(
        "{} pairs of cuts: all in one view after {:.1} s in the median, {:.1} s at most; never nearer than {least_m:.2} m",
        took.len(),
        took[took.len() / 2],
        took[took.len() - 1],
    );
    for failed in &failed {
        println!("{failed:?}");
    }
    assert!(failed.is_empty(), "{} failed", failed.len());
}
