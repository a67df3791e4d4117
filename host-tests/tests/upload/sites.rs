//! Uploads that move the receiver: adopted by all relays or none, in spite of losses and reboots.

use host_tests::make;
use uav_relay::flight::axis::Axis;
use uav_relay::{Sites, Wiring};
use uav_relay_sim::simulator::fleet::somewhere;

use super::*;

/// Returns positions of Tx and Rx. Compared with `base`, Rx is `on_m` farther along the line and `right_m` to the
/// right, m.
fn ends(base: &Mission, on_m: f32, right_m: f32) -> Sites {
    let distance_m = base.config().distance_m;
    let axis = somewhere(f64::from(distance_m)).unwrap();
    let at = |x_m, y_m| {
        let place = make::placement(x_m, y_m, 0.0);
        axis.point(place).unwrap()
    };
    Sites {
        tx: at(0.0, 0.0),
        rx: at(distance_m + on_m, right_m),
    }
}

/// Returns an upload of mission `version` that moves the receiver, from the ground station at `end`.
fn to_another_place(base: &Mission, at: Instant, version: u16, end: Side) -> UploadSpec {
    let sites = ends(base, 150.0, 200.0);
    let mut config = moved(base, 700.0, -300.0);
    config.distance_m = Axis::between(sites).unwrap().distance_m() as f32;
    let spec = upload(base, end, at, version, config);
    UploadSpec {
        upload: spec.upload.with_sites(sites).unwrap(),
        ..spec
    }
}

fn sited(relays: u16, shared: bool) -> (Mission, Setup) {
    let base = mission(relays);
    let mut setup = signed(base, shared);
    setup.settings.sited = true;
    setup.deadline = seconds(300);
    (base, setup)
}

/// Checks a run with [`judge`], and that all relays use the Tx and Rx positions of mission `version`.
///
/// If this mission was not uploaded or has no such positions, the positions from before flight apply.
fn judge_between(setup: &Setup, outcome: &Outcome, version: u16) -> Result<(), String> {
    let spec = setup
        .uploads
        .iter()
        .find(|spec| spec.upload.version() == version);
    let config = spec.map_or(*setup.mission.config(), |spec| *spec.upload.config());
    judge(setup, outcome, version, config)?;
    let sites = spec.and_then(|spec| spec.upload.sites());
    match outcome.relays.iter().find(|relay| relay.sites != sites) {
        Some(relay) => Err(format!("{:?} is between {:?}", relay.index, relay.sites)),
        None => Ok(()),
    }
}

#[test]
fn all_relays_follow_a_moved_receiver_there_and_back() {
    for shared in [false, true] {
        for end in [Side::Upstream, Side::Downstream] {
            let (base, mut setup) = sited(8, shared);
            setup.uploads = vec![to_another_place(&base, seconds(20), 1, end)];
            let outcome = run(setup.clone()).unwrap();
            judge_between(&setup, &outcome, 1).unwrap();
            // The next mission has no sites, so the loaded ones apply.
            let back = moved(&base, 300.0, 250.0);
            setup.uploads.push(upload(&base, end, seconds(40), 2, back));
            let outcome = run(setup.clone()).unwrap();
            judge_between(&setup, &outcome, 2).unwrap();
        }
    }
}

#[test]
fn all_relays_follow_a_moved_receiver_despite_losses() {
    for seed in 1..=60 {
        let (base, mut setup) = sited(8, seed % 2 == 0);
        setup.seed = seed;
        setup.faults.loss = 0.3;
        setup.faults.corrupt = 0.1;
        let end = if seed % 3 == 0 {
            Side::Upstream
        } else {
            Side::Downstream
        };
        setup.uploads = vec![to_another_place(&base, seconds(20), 1, end)];
        let outcome = run(setup.clone()).unwrap();
        judge_between(&setup, &outcome, 1).unwrap_or_else(|what| panic!("SEED={seed}: {what}"));
    }
}

#[test]
fn a_relay_rebooted_while_the_receiver_moves_flies_to_it() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        for relay in 1..=5 {
            for ms in (0..400).step_by(40) {
                for forgetful in [vec![], vec![relay]] {
                    let (base, mut setup) = sited(5, wiring == Wiring::Shared);
                    setup.uploads = vec![to_another_place(&base, seconds(20), 1, Side::Upstream)];
                    setup.kills = vec![(relay, Instant::from_millis(20_000 + ms))];
                    setup.boots = vec![(relay, Instant::from_millis(20_100 + ms))];
                    setup.forgetful.clone_from(&forgetful);
                    let outcome = run(setup.clone()).unwrap();
                    judge_between(&setup, &outcome, 1).unwrap_or_else(|what| {
                        panic!("{wiring:?} {relay} at {ms} {forgetful:?}: {what}")
                    });
                }
            }
        }
    }
}

#[test]
fn a_rebooted_chain_flies_to_the_receivers_last_site() {
    for shared in [false, true] {
        let (base, mut setup) = sited(8, shared);
        setup.uploads = vec![to_another_place(&base, seconds(20), 1, Side::Upstream)];
        for relay in 1..=8 {
            setup.kills.push((relay, seconds(40)));
            setup.boots.push((relay, seconds(41)));
        }
        let outcome = run(setup.clone()).unwrap();
        judge_between(&setup, &outcome, 1).unwrap();
        // Relays that forgot the mission forgot its sites too.
        setup.forgetful = (1..=8).collect();
        let outcome = run(setup.clone()).unwrap();
        judge_between(&setup, &outcome, 0).unwrap();
    }
}
