//! Uploads to a chain on good links.

use host_tests::make;
use uav_relay::{Band, Local, Method, Profile, Schedule};

use super::*;

const AT: Instant = seconds(20);

/// Runs `setup` with an upload of `config`. Returns the time from the upload to the last event `Converged`, ms, and the
/// number of bytes that are sent because of the upload.
fn fly(mut setup: Setup, end: Side, config: MissionConfig) -> (u64, u64) {
    let mut calm = setup.clone();
    calm.partitions.clear();
    let before = run(calm).unwrap();
    setup.uploads = vec![upload(&setup.mission, end, AT, 1, config)];
    setup.deadline = seconds(200);
    let outcome = flies(&setup, 1, config, "uploaded");
    assert_ne!(outcome.bits(), before.bits(), "nothing to fly to");
    let refused = |outcome: &Outcome| -> u32 {
        let relays = outcome.relays.iter();
        relays.map(|relay| relay.stats.rejected()).sum()
    };
    // A renewal in transit at the time of the proposal, and its retransmission, are stale at each relay at most once.
    let most = refused(&before) + u32::from(setup.mission.relays());
    assert!(refused(&outcome) <= most, "{}", refused(&outcome));
    let settled = |moment: &&Moment| moment.what == TimelineEvent::Converged;
    let last = outcome.moments.iter().rfind(settled).unwrap();
    let took = last.at.since(AT).as_micros() / 1_000;
    (took, outcome.bytes - before.bytes)
}

#[test]
fn an_uploaded_interferer_is_flown_from_either_end() {
    for relays in [1, 2, 3, 8, 20] {
        for shared in [true, false] {
            for end in [Side::Upstream, Side::Downstream] {
                let base = mission(relays);
                let config = moved(&base, 700.0, -300.0);
                let (took, bytes) = fly(signed(base, shared), end, config);
                println!("{relays} relays, shared {shared}, {end:?}: {took} ms, {bytes} bytes");
                // An offer, a hello, a proposal, a decision, a sweep and a verdict per hop, each within two hop times.
                assert!(took < 200 * u64::from(relays) + 300, "{took} ms");
            }
        }
    }
}

/// Checks that all relays fly an uploaded mission that adds, removes or changes the direction Rx to Tx.
///
/// The change is another transmit power of Rx.
#[test]
fn a_way_back_is_uploaded_and_flown_by_all() {
    let back = |base: MissionConfig, reverse: f32, rx_power_w: f32| MissionConfig {
        reverse,
        rx_power_w,
        ..base
    };
    let one_way = *mission(5).config();
    for (loaded, uploaded) in [
        (one_way, back(one_way, 0.5, 5.0)),
        (back(one_way, 1.0, 5.0), one_way),
        (back(one_way, 0.5, 5.0), back(one_way, 0.5, 80.0)),
    ] {
        for shared in [true, false] {
            let base = Mission::try_new(loaded).unwrap();
            fly(signed(base, shared), Side::Upstream, uploaded);
        }
    }
}

/// Checks that all relays with the joint method fly an upload that adds or removes fitted slots.
///
/// Fitted slots are time slots that are as long as each hop needs.
#[test]
fn fitted_slots_are_uploaded_and_flown_by_all() {
    let equal = *mission(5).config();
    let fitted = MissionConfig {
        fitted_gap: 2.0,
        ..equal
    };
    for (loaded, uploaded) in [(equal, fitted), (fitted, equal)] {
        let mut setup = signed(Mission::try_new(loaded).unwrap(), true);
        setup.settings.method = Method::Joint;
        fly(setup, Side::Upstream, uploaded);
    }
}

#[test]
fn a_new_altitude_band_is_flown_to() {
    let base = MissionConfig {
        band: make::band(15.0, 60.0),
        ..*mission(5).config()
    };
    let base = Mission::try_new(base).unwrap();
    let config = MissionConfig {
        band: make::band(90.0, 180.0),
        common: Profile {
            altitude_m: 120.0,
            ..base.config().common
        },
        ..*base.config()
    };
    for method in [
        Method::Joint,
        Method::Adjust(make::adjust(20, 10.0, Local::Fine)),
    ] {
        let mut setup = signed(base, true);
        setup.settings.method = method;
        // One relay keeps its own altitude and power, whatever the mission.
        setup.profiles = vec![(2, make::profile(100.0, 1.5))];
        setup.held = vec![2];
        fly(setup, Side::Upstream, config);
    }
}

#[test]
fn every_parameter_but_the_number_of_relays_may_change() {
    let base = mission(4);
    let changed: [fn(&mut MissionConfig); 6] = [
        |c| c.distance_m *= 1.3,
        |c| c.min_separation_m = 200.0,
        |c| c.tx_power_w *= 2.0,
        |c| c.common.power_w *= 3.0,
        |c| {
            c.common.altitude_m = 55.0;
            c.band = Band::at(55.0);
        },
        |c| {
            c.channel = uav_relay::Channel::from_db(
                2e9,
                0.1,
                21.0,
                uav_relay::channel::AirGround::Weighted(0.5),
            )
            .unwrap();
        },
    ];
    for change in changed {
        let mut config = *base.config();
        change(&mut config);
        fly(signed(base, true), Side::Upstream, config);
    }
}

#[test]
fn a_newer_version_overtakes_an_older_one() {
    let base = mission(8);
    let (one, two) = (moved(&base, 700.0, -300.0), moved(&base, 100.0, 500.0));
    // The newer version comes from the same or the other end, at every stage of the first upload.
    for ms in (0..600).step_by(20) {
        for other in [Side::Upstream, Side::Downstream] {
            let mut setup = signed(base, true);
            let later = Instant::from_millis(20_000 + ms);
            setup.uploads = vec![
                upload(&base, Side::Upstream, AT, 1, one),
                upload(&base, other, later, 2, two),
            ];
            setup.deadline = seconds(200);
            let outcome = flies(&setup, 2, two, &format!("{ms} {other:?}"));
            let cut = |moment: &Moment| moment.what == TimelineEvent::NoQuorum;
            assert!(!outcome.moments.iter().any(cut), "{ms} {other:?}");
        }
    }
}

#[test]
fn an_older_version_has_no_effect() {
    let base = mission(8);
    let (one, two) = (moved(&base, 700.0, -300.0), moved(&base, 100.0, 500.0));
    let mut setup = signed(base, true);
    setup.uploads = vec![
        upload(&base, Side::Upstream, AT, 7, one),
        upload(&base, Side::Downstream, seconds(30), 6, two),
    ];
    setup.deadline = seconds(200);
    flies(&setup, 7, one, "uploaded");
    // Two operators upload at the same time.
    for ms in (0..400).step_by(40) {
        let at = Instant::from_millis(20_000 + ms);
        setup.uploads = vec![
            upload(&base, Side::Upstream, AT, 1, one),
            upload(&base, Side::Downstream, at, 1, two),
        ];
        let outcome = run(setup.clone()).unwrap();
        let mission_id = |spec: &UploadSpec| spec.upload.id();
        let newer = setup
            .uploads
            .iter()
            .max_by_key(|spec| mission_id(spec))
            .unwrap();
        judge(&setup, &outcome, 1, *newer.upload.config()).unwrap();
    }
}

#[test]
fn an_infeasible_mission_is_followed_by_a_feasible_one() {
    let base = mission(3);
    // With fixed steps of 0.2, no target is feasible in the mission with the strong interferer.
    let mut setup = signed(base, true);
    setup.settings.schedule = Schedule::FixedStep { step: 0.2 };
    let mut hopeless = moved(&base, 500.0, 0.0);
    if let Interference::Source(interferer) = &mut hopeless.interference {
        interferer.power_w = 1e6;
    }
    let good = moved(&base, 700.0, -300.0);
    setup.uploads = vec![
        upload(&base, Side::Upstream, AT, 1, hopeless),
        upload(&base, Side::Upstream, seconds(40), 2, good),
    ];
    setup.deadline = seconds(200);
    let outcome = run(setup.clone()).unwrap();
    let given_up = |moment: &Moment| moment.what == TimelineEvent::Infeasible;
    assert!(outcome.moments.iter().any(given_up));
    judge(&setup, &outcome, 2, good).unwrap();
}

#[test]
fn an_upload_during_a_view_change_is_not_lost() {
    let base = mission(6);
    let config = moved(&base, 700.0, -300.0);
    let mut setup = signed(base, true);
    setup.kills = vec![(3, AT)];
    setup.deadline = seconds(200);
    let calm = run(setup.clone()).unwrap();
    let formed = |moment: &&Moment| matches!(moment.what, TimelineEvent::ViewAccepted { .. });
    let at = calm.moments.iter().find(formed).unwrap().at;
    for ms in (0..600).step_by(10) {
        for end in [Side::Upstream, Side::Downstream] {
            let begin = Instant::from_micros(at.as_micros() - 500_000 + 1_000 * ms);
            setup.uploads = vec![upload(&base, end, begin, 1, config)];
            flies(&setup, 1, config, &format!("{ms} {end:?}"));
        }
    }
}
