//! Announced departures: a relay leaves while it holds its place, alone or after a spare has joined.

use uav_relay_sim::simulator::drones::{FlightSpec, Point};

use super::*;
use host_tests::flights::end_at;

/// Returns the time of the first event `what` at relay `relay`, s; `None` without one.
fn first(outcome: &Outcome, relay: u16, what: impl Fn(TimelineEvent) -> bool) -> Option<f64> {
    let moment = outcome
        .moments
        .iter()
        .find(|moment| moment.relay == relay && what(moment.what))?;
    Some(moment.at.as_micros() as f64 / 1e6)
}

fn is_free(what: TimelineEvent) -> bool {
    what == TimelineEvent::MayLeave
}

/// Runs a chain of eight in which the relays `leaves` request to leave at 60 s, and ends it at 300 s.
fn departing(leaves: &[u16]) -> (Setup, Outcome) {
    let mut setup = paper(8);
    setup.leaves = leaves.iter().map(|relay| (*relay, seconds(60))).collect();
    end_at(&mut setup, seconds(300));
    let outcome = run(setup.clone()).unwrap();
    (setup, outcome)
}

/// Checks that each relay can leave, and that no relay reports a loss or an expired lease.
#[test]
fn every_relay_leaves_without_a_timeout() {
    for leaver in ALL {
        let (setup, outcome) = departing(&[leaver]);
        for moment in &outcome.moments {
            println!(
                "{leaver}: {:?} relay {} {:?} {:?}",
                moment.at, moment.relay, moment.what, moment.other
            );
        }
        judge(&setup, &outcome, &without(&[leaver])).unwrap();
        let free = first(&outcome, leaver, is_free).unwrap();
        println!(
            "relay {leaver} may leave {:.1} s after its request",
            free - 60.0
        );
        let bad = |what| {
            matches!(
                what,
                TimelineEvent::Lost(_) | TimelineEvent::LeaseLapsed | TimelineEvent::NoQuorum
            )
        };
        assert!(
            !outcome.moments.iter().any(|moment| bad(moment.what)),
            "{leaver}"
        );
    }
}
