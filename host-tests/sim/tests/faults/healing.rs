//! Two partitions that heal, together or one after the other: all relays return to one chain.

use uav_relay_sim::simulator::outcome::TimelineEvent;
use uav_relay_sim::simulator::setup::Partition;

use super::*;

/// Time limit from the last healing to a common view, s.
const MOST_S: f64 = 120.0;

fn cut(after: u16, from: u64, until: u64) -> Partition {
    Partition {
        after,
        from: at(from),
        until: Some(at(until)),
    }
}

/// Returns all pairs of different partitions of eight relays, simultaneous and staggered.
fn cases() -> Vec<Setup> {
    let mut all = Vec::new();
    for one in 1..8 {
        for other in (1..8).filter(|other| *other != one) {
            for (from, until) in [(20, 120), (60, 160)] {
                let mut setup = by_radio(8, 57_600);
                setup.partitions = vec![cut(one, 20, 120), cut(other, from, until)];
                all.push(setup.soaked(at(until + 240)));
            }
        }
    }
    all
}

/// Returns the first time after `healed` at which all eight relays are in one view.
fn joined(outcome: &Outcome, healed: Instant) -> Option<Instant> {
    let mut views = [(0, 8); 8];
    for moment in &outcome.moments {
        if moment.at > healed && views.iter().all(|one| *one == (views[0].0, 8)) {
            return Some(healed);
        }
        if let TimelineEvent::ViewAccepted { view, relays, .. } = moment.what {
            views[usize::from(moment.relay - 1)] = (view, relays);
            if moment.at >= healed && views.iter().all(|one| *one == (view, 8)) {
                return Some(moment.at);
            }
        }
    }
    None
}

#[test]
fn after_two_cuts_all_come_back_into_one_view() {
    let cases = cases();
    assert_eq!(cases.len(), 84);
    let ends = run_all(&cases, |setup, outcome| {
        let healed = setup
            .partitions
            .iter()
            .filter_map(|cut| cut.until)
            .max()
            .unwrap();
        let joined = joined(&outcome, healed).map(|at| (seconds(at) - seconds(healed)).max(0.0));
        let cuts = setup.partitions.iter().map(|cut| {
            let until = seconds(cut.until.unwrap());
            format!("--partition {}@{}-{until}", cut.after, seconds(cut.from))
        });
        let cuts: Vec<String> = cuts.collect();
        (joined, outcome.watched.unwrap().most_flying, cuts.join(" "))
    });
    let times = ends.iter().filter_map(|(joined, ..)| *joined).collect();
    let (median, worst) = median_and_worst(times);
    println!("all in one view after the last healing: median {median:.1} s, worst {worst:.1} s");
    let wrong: Vec<_> = ends
        .iter()
        .filter(|(joined, most, _)| !joined.is_some_and(|after| after <= MOST_S) || *most > 1)
        .collect();
    assert!(wrong.is_empty(), "{} of 84: {wrong:#?}", wrong.len());
}
