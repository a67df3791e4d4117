//! Film of a run: complete, and without influence on the run.
#![cfg(test)]

use std::collections::BTreeMap;

use uav_relay::{Instant, Side};
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::setup::Setup;

fn setup(uavs: u16) -> Setup {
    let (mission, _) = mission::mission(&Scenario::default(), uavs, 1e-4).unwrap();
    Setup::new(mission)
}

#[test]
fn an_animation_shows_an_agreement_from_start_to_end() {
    let plain = run(setup(8)).unwrap();
    let filmed = run(Setup {
        film: true,
        ..setup(8)
    })
    .unwrap();
    assert_eq!(plain.film, None);
    assert_eq!(plain.bits(), filmed.bits(), "a film changes nothing");
    assert_eq!(plain.messages, filmed.messages);
    let film = filmed.film.as_ref().unwrap();
    // Initially no relay has a setpoint; then each gets one once.
    let (first, rest) = film.shots.split_at(8);
    assert!(first.iter().all(|shot| shot.is_on && shot.place.is_none()));
    let taken: BTreeMap<u16, _> = rest.iter().map(|shot| (shot.relay, shot.place)).collect();
    assert_eq!((rest.len(), taken.len()), (8, 8));
    for (place, relay) in taken.values().zip(&filmed.relays) {
        assert_eq!(*place, relay.setpoint);
    }
    assert_eq!(film.sent.len() as u64, filmed.messages);
    let down = film
        .sent
        .iter()
        .filter(|it| it.to == Some(Side::Downstream));
    assert_eq!(down.count(), 7);
    assert!(film.shots.windows(2).all(|two| two[0].at <= two[1].at));
}

#[test]
fn an_animation_shows_a_relay_go_silent_and_return() {
    let (off, on) = (Instant::from_millis(20_000), Instant::from_millis(60_000));
    let mut setup = Setup {
        film: true,
        ..Setup::on_shared_channel(setup(5).mission)
    };
    setup.kills = vec![(3, off)];
    setup.boots = vec![(3, on)];
    let outcome = run(setup).unwrap();
    let film = outcome.film.unwrap();
    let of_three: Vec<_> = film.shots.iter().filter(|shot| shot.relay == 3).collect();
    let before = of_three.iter().rfind(|shot| shot.at < off).unwrap();
    let silent = of_three.iter().find(|shot| !shot.is_on).unwrap();
    assert_eq!(silent.at, off);
    assert_eq!(
        silent.place, before.place,
        "it stays where it was told last"
    );
    let again = of_three.iter().find(|shot| shot.at >= on).unwrap();
    assert!(again.is_on && again.place.is_none() && again.at == on);
    let last = of_three.last().unwrap();
    assert_eq!(last.place, outcome.relays[2].setpoint);
    assert!(last.place.is_some());
    let meanwhile = |shot: &&uav_relay_sim::simulator::outcome::Shot| (off..on).contains(&shot.at);
    assert!(film.shots.iter().filter(meanwhile).count() > 4);
    assert!(film.sent.iter().all(|it| it.to.is_none()));
    assert!(
        !film
            .sent
            .iter()
            .any(|it| it.relay == 3 && (off..on).contains(&it.at))
    );
}
