//! Loss and return of relays on a good channel.

use host_tests::make;
use uav_relay::{Local, Method, MissionConfig};
use uav_relay_oracle::mission::of_stochastic_link;
use uav_relay_oracle::reference::Relay;
use uav_relay_oracle::reference::stochastic::StochasticLink;

use super::*;

/// Returns the time from the last loss report to the settled chain, and the number of passes. A pass is a round of
/// messages along the chain; the first `sweeps_before` passes are not counted.
fn recovery(outcome: &Outcome, sweeps_before: u32) -> (Duration, u32) {
    let lost = |what| matches!(what, TimelineEvent::Lost(_));
    let last = outcome
        .moments
        .iter()
        .filter(|moment| lost(moment.what))
        .map(|moment| moment.at)
        .max()
        .unwrap();
    let all: u32 = outcome
        .relays
        .iter()
        .map(|relay| relay.stats.passes_begun)
        .sum();
    (outcome.ended.since(last), all - sweeps_before)
}

fn sets_of_up_to_three(of: u16) -> Vec<Vec<u16>> {
    let mut sets = Vec::new();
    for one in 1..=of {
        sets.push(vec![one]);
        for other in one + 1..=of {
            sets.push(vec![one, other]);
            sets.extend((other + 1..=of).map(|third| vec![one, other, third]));
        }
    }
    sets
}

#[test]
fn any_one_two_or_three_of_eight_may_be_lost_at_once() {
    let mut slowest = Duration::from_millis(0);
    let mut most = 0;
    for gone in sets_of_up_to_three(8) {
        let mut setup = paper(8);
        setup.kills = gone.iter().map(|index| (*index, seconds(20))).collect();
        setup.deadline = seconds(120);
        let left = without(&gone);
        let outcome = settles(&setup, &left, &format!("{gone:?} lost"));
        let (took, sweeps) = recovery(&outcome, 1);
        slowest = slowest.max(took);
        most = most.max(sweeps);
        for index in left {
            assert_eq!(views(&outcome, index), 1, "{gone:?} lost: views of {index}");
        }
    }
    println!(
        "settled within {} ms of the last detection, by at most {most} sweeps",
        ms(slowest)
    );
    // The search at an end of the chain takes `lost` less `quiet`; requests, counting and sweeps the rest.
    assert!(ms(slowest) < 10_000 + 2_000);
    assert!(most <= 6);
}

#[test]
fn a_relay_that_returns_gets_its_position_again() {
    for index in 1..=8 {
        // The relay returns before the loss is noticed, just when it is, or long after.
        for off in [1_000, 9_990, 10_020, 60_000] {
            let mut setup = paper(8);
            setup.kills = vec![(index, seconds(20))];
            setup.boots = vec![(index, Instant::from_millis(20_000 + off))];
            setup.deadline = seconds(200);
            settles(&setup, &ALL, &format!("{index} off for {off} ms"));
        }
    }
}

/// Checks that one of two adjacent lost relays returns into the gap that the others have closed. The second lost
/// relay stays off.
#[test]
fn one_of_two_lost_neighbours_returns_into_the_gap() {
    for (index, off) in [(2, 3), (3, 2), (4, 5), (5, 4), (6, 7), (7, 6)] {
        for seconds_off in [15, 17, 20, 30, 60] {
            let mut setup = paper(8);
            setup.kills = vec![(index, seconds(20)), (off, seconds(20))];
            setup.boots = vec![(index, seconds(20 + seconds_off))];
            setup.deadline = seconds(300);
            let left = without(&[off]);
            settles(&setup, &left, &format!("{index} off for {seconds_off} s"));
        }
    }
}

#[test]
fn relays_are_switched_on_again_one_by_one() {
    let mut setup = paper(8);
    for index in 1..=8 {
        let at = 20 + 40 * u64::from(index);
        setup.kills.push((index, seconds(at)));
        setup.boots.push((index, seconds(at + 3)));
    }
    setup.deadline = seconds(700);
    settles(&setup, &ALL, "all");
}

#[test]
fn relays_are_lost_one_by_one_until_two_remain() {
    let mut setup = paper(8);
    let order = [4, 1, 8, 5, 3, 7];
    setup.kills = (1..)
        .zip(order)
        .map(|(n, index)| (index, seconds(60 * n)))
        .collect();
    setup.deadline = seconds(600);
    settles(&setup, &[2, 6], "two are left");
}

#[test]
fn on_wires_a_break_is_reported_and_a_reboot_recovered() {
    let mut setup = Setup::new(mission(8));
    setup.kills = vec![(4, seconds(20))];
    let outcome = run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Broken);
    assert!(
        outcome
            .relays
            .iter()
            .all(|relay| relay.view == 0 && relay.setpoint.is_some())
    );
    for index in 1..=8 {
        let mut setup = Setup::new(mission(8));
        setup.kills = vec![(index, seconds(20))];
        setup.boots = vec![(index, seconds(21))];
        setup.deadline = seconds(100);
        settles(&setup, &ALL, &format!("{index} rebooted"));
    }
}

#[test]
fn a_chain_in_a_field_recovers_from_the_other_end() {
    let link = StochasticLink {
        distance_m: 1_000.0,
        tx_w: 80.0,
        mu_los: 1.0,
        eta: 3.0,
        upsilon: vec![(0.0, 2e4), (400.0, 5e3), (1_000.0, 4e4)],
        relays: vec![
            Relay {
                altitude_m: 20.0,
                power_w: 1.0
            };
            8
        ],
    };
    for gone in sets_of_up_to_three(8) {
        let mut setup = Setup::on_shared_channel(of_stochastic_link(&link, 2.0).unwrap());
        setup.kills = gone.iter().map(|index| (*index, seconds(20))).collect();
        setup.deadline = seconds(120);
        settles(&setup, &without(&gone), &format!("{gone:?} lost"));
    }
}

#[test]
fn a_chain_with_free_altitudes_or_turns_recovers() {
    let band = make::band(20.0, 300.0);
    let config = MissionConfig {
        band,
        ..*mission(5).config()
    };
    let adjust = make::adjust(20, 30.0, Local::Fine);
    for method in [Method::Joint, Method::Adjust(adjust)] {
        for index in 1..=5 {
            let mut setup = Setup::on_shared_channel(Mission::try_new(config).unwrap());
            setup.settings.method = method;
            setup.kills = vec![(index, seconds(60))];
            setup.deadline = seconds(400);
            let left: Vec<u16> = (1..=5).filter(|number| *number != index).collect();
            settles(&setup, &left, &format!("{method:?}, {index} lost"));
        }
    }
}
