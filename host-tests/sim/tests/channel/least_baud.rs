//! Agreement and availability at the lowest permitted data rate.

use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::parallel::run_seeds;
use uav_relay_sim::simulator::setup::Setup;

use super::*;

/// Ten-minute soak of signed relays, all in one range, with CSMA at the lowest permitted data rate.
fn at_least_baud(relays: u16, loss: f64) -> Setup {
    let mut setup = Setup::on_air(close(relays), Access::Csma);
    setup.auth = true;
    setup.radio_reach = usize::from(relays);
    setup.faults.loss = loss;
    let load = setup.load().unwrap();
    assert_eq!(load.in_range, relays);
    setup.link.baud = load.least_baud(setup.settings.probe_after);
    setup.soaked(Instant::from_millis(600_000))
}

fn agree_and_hold(relays: u16, loss: f64, seeds: u64) {
    let setup = at_least_baud(relays, loss);
    let ends = run_seeds(&setup, 1..=seeds, |_, outcome| {
        (outcome.watched.unwrap(), outcome.air)
    });
    let ends = ends.unwrap();
    let firsts: Vec<f64> = ends
        .iter()
        .filter_map(|(end, _)| end.first_agreement)
        .map(seconds)
        .collect();
    let load = ends
        .iter()
        .map(|(_, air)| air.air_time_us as f64 / 6e8)
        .fold(0.0, f64::max);
    println!(
        "{relays} relays in one range at {} baud, loss {loss}: first agreement {firsts:.1?} s, load {load:.3}",
        setup.link.baud
    );
    for (end, _) in ends {
        assert_eq!(end.availability, Some(1.0), "{relays} relays, loss {loss}");
        assert_eq!(end.most_flying, 1, "{relays} relays, loss {loss}");
    }
}

#[test]
fn up_to_twenty_agree_and_hold_even_where_30_percent_are_lost() {
    for relays in [2, 8, 20] {
        for loss in [0.0, 0.3] {
            agree_and_hold(relays, loss, 4);
        }
    }
}

#[test]
fn a_hundred_agree_and_hold() {
    agree_and_hold(100, 0.0, 1);
}

#[test]
fn fifty_agree_and_hold_even_where_30_percent_are_lost() {
    agree_and_hold(50, 0.3, 4);
}

/// Known failure: after the agreement the relays' own requests fill the channel.
#[test]
#[ignore = "fails"]
fn a_hundred_agree_and_hold_even_where_30_percent_are_lost() {
    agree_and_hold(100, 0.3, 2);
}
