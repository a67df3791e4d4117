//! Uploads with sites: refusals, the sites in use, and separation of positions along different lines.

use host_tests::fixtures::paper;
use host_tests::make;
use serde_json::json;
use uav_relay::{
    Duration, Event, Geofence, GuardConfig, Instant, LineError, Mission, MissionConfig, Placement,
    Settings, Sites, Upload, UploadError, Wiring,
};

use super::adopted::adopts;
use super::bench::events;
use super::kinds::one_of_each;
use super::message::WireMessage;
use super::offer::{between, kept, mission_id, upload, with_sites};
use super::signed::{NOW, SignedBench, settings};
use super::uploads::fourth;
use super::votes::{FLIES, REFUSED, WHOLE, hello};

/// Latitude, longitude and height of Tx, then of Rx, in units of 1e-7 degrees and mm. Their distance is 1000.000 m.
const A_KILOMETRE: [i32; 6] = [
    474_000_000,
    85_400_000,
    420_000,
    474_000_000,
    85_532_474,
    431_000,
];

fn sites([a, b, c, d, e, f]: [i32; 6]) -> Sites {
    let at = |lat_e7, lon_e7, amsl_mm| make::geodetic(lat_e7, lon_e7, amsl_mm);
    Sites {
        tx: at(a, b, c),
        rx: at(d, e, f),
    }
}

/// Returns an upload of version 2 with positions of Tx and Rx, and these positions. The positions are a kilometre
/// apart, except that Rx is moved east by `east` units of 1e-7 degrees.
fn farther(base: u16, east: i32) -> (WireMessage, [i32; 6]) {
    let mut sites = A_KILOMETRE;
    sites[4] += east;
    (with_sites(&upload(2, base), sites), sites)
}

/// Checks that an upload is refused if its positions of Tx and Rx do not fit its Tx-Rx distance.
///
/// Relays that do not use these positions refuse the upload, too, because all relays of a chain must decide alike.
#[test]
fn an_upload_whose_sites_do_not_fit_its_distance_is_refused() {
    for sited in [false, true] {
        let settings = Settings {
            sited,
            ..settings(Wiring::Pair)
        };
        let mut met = SignedBench::fourth_with(settings);
        let near = |east| farther(met.base, east);
        // A unit is 7.5 mm: 4.5 cm are tolerated, 6 cm are not.
        let (longer, kilometre) = near(0);
        let longer = longer.with(json!({ "distance_m": 1100.0 }));
        let none = [474_000_000, 85_400_000, 0, 474_000_000, 85_400_900, 0];
        let cases = [
            (near(8), LineError::Distance),
            (near(-8), LineError::Distance),
            ((longer, kilometre), LineError::Distance),
            (
                (with_sites(&upload(2, met.base), none), none),
                LineError::Sites,
            ),
        ];
        let good = [near(6), near(-6)];
        for (refused, ((offer, six), why)) in (1..).zip(cases) {
            for told in [vec![Event::UploadRefused { why }], vec![]] {
                let out = met.receive(1, &offer);
                assert_eq!(met.events(), told, "{offer:?}");
                // The relay answers with a hello that names the refused mission.
                assert_eq!(out.len(), 1, "{out:?}");
                let message = &out[0].1;
                let holds = ["latest_mission", "latest_mission_version"]
                    .map(|name| message.number(name) as u16);
                assert_eq!((holds[0], holds[1]), mission_id(&offer));
                assert!(message.has(REFUSED) && !message.has(FLIES) && !message.has(WHOLE));
                assert_eq!(met.held(), None);
            }
            assert_eq!(met.stats().mission, 2 * refused);
            let upload = Upload::decode(&kept(&offer)).unwrap();
            let line = Err(UploadError::Line(why));
            assert_eq!(met.relay.clone().handle_upload(NOW, &upload), line);
            assert_eq!(fourth(settings).resume(&upload), line);
            // The ground station does not create such an upload either.
            let plain = Upload::decode(&kept(&with_sites(&offer, [0; 6]))).unwrap();
            assert_eq!(plain.with_sites(sites(six)).map(|_| ()), line);
        }
        for (good, _) in good {
            let mut after = met.clone();
            after.receive(1, &good);
            assert_eq!(after.events(), [Event::Uploaded]);
            assert_eq!(after.held(), Some(mission_id(&good)));
        }
    }
}

#[test]
fn the_sites_are_those_of_the_mission_that_is_flown() {
    let mut met = SignedBench::fourth();
    let base = met.base;
    let (first, _) = farther(base, 0);
    let of = mission_id(&first);
    assert_ne!(of, mission_id(&upload(2, base)), "it is another mission");
    met.receive(0, &first);
    assert_eq!((met.sites(), met.held()), (None, Some(of)));
    adopts(&mut met, &first);
    assert_eq!(met.sites(), Some(sites(A_KILOMETRE)));
    // A newer mission that is held is not flown.
    met.receive(0, &upload(3, base));
    assert_eq!(met.sites(), Some(sites(A_KILOMETRE)));
    // The stored mission applies after a reboot.
    for (stored, expected) in [(first, Some(sites(A_KILOMETRE))), (upload(3, base), None)] {
        let mut again = fourth(settings(Wiring::Pair));
        let upload = Upload::decode(&kept(&stored)).unwrap();
        assert_eq!(again.resume(&upload), Ok(()));
        assert_eq!(again.sites(), expected);
    }
}

/// Returns relay 4 of eight with a motion guard and a large geofence.
fn guarded() -> SignedBench {
    let mission = Mission::try_new(paper(8)).unwrap();
    // The geofence has room for all offers here.
    let mut guard = GuardConfig::of(&mission, mission.config().common);
    guard.geofence = Geofence {
        least_y_m: -1e3,
        most_y_m: 1e3,
        least_altitude_m: 0.0,
        most_altitude_m: 1e3,
        ..guard.geofence
    };
    let mut met = SignedBench::fourth_with(Settings {
        guard: Some(guard),
        ..settings(Wiring::Pair)
    });
    for peer in [0, 1] {
        met.receive(peer, &hello(met.base, 4, (met.base, 0), 0));
    }
    met.events();
    met
}

#[test]
fn a_fence_along_another_line_is_stale_and_has_no_effect() {
    let mut met = guarded();
    let base = met.base;
    let (first, _) = farther(base, 0);
    let line = between(&first, base);
    assert_ne!(line, base);
    let stale = |met: &SignedBench, line: u16| {
        let fence = one_of_each(1, line)[13].with(json!({
            "association": 700, "number": 0, "x_m": 300.0, "target_m": 310.0, "y_m": 0.0,
            "altitude_m": 20.0, "apart_m": 0.0, "flags": 0,
        }));
        let mut after = met.clone();
        after.receive(0, &fence);
        assert_eq!(after.events(), []);
        let (before, stats) = (met.stats(), after.stats());
        (stats.stale - before.stale, stats.mission - before.mission)
    };
    assert_eq!(stale(&met, base), (0, 0));
    assert_eq!(stale(&met, line), (1, 0));
    adopts(&mut met, &first);
    met.events();
    assert_eq!(stale(&met, base), (1, 0));
    assert_eq!(stale(&met, line), (0, 0));
    // A mission without sites uses the loaded line.
    let mut met = guarded();
    adopts(&mut met, &upload(2, base));
    met.events();
    assert_eq!(stale(&met, base), (0, 0));
    assert_eq!(stale(&met, line), (1, 0));
}

/// Checks that a relay whose new mission is along another line waits long enough for its drone to stop. During this
/// time the relay has no setpoint.
#[test]
fn along_a_new_line_a_relay_stops_before_it_has_a_setpoint() {
    let config = paper(1);
    let mission = Mission::try_new(config).unwrap();
    let guard = GuardConfig::of(&mission, config.common);
    let settings = Settings {
        guard: Some(guard),
        ..settings(Wiring::Pair)
    };
    let mut relay = host_tests::fixtures::relay(mission, 1, settings);
    let mut now = NOW;
    let mut until = |relay: &mut uav_relay::Relay, end: Instant, x_m: f32| {
        while now < end {
            now = now + Duration::from_millis(100);
            relay.handle_position(now, Placement::on_line(x_m, 20.0), now);
            relay.handle_timeout(now);
            let mut frame = [0; uav_relay::MAX_FRAME];
            relay.persist(|_| true);
            while relay.poll_transmit(now, &mut frame).is_some() {}
        }
        now
    };
    let at = until(&mut relay, Instant::from_millis(2_000), 300.0);
    let place = relay.setpoint().unwrap();
    assert!((place.x_m - 349.8).abs() < 0.1);
    // 2 km, along another line.
    let config = MissionConfig {
        distance_m: 2000.0,
        ..config
    };
    let mut to = A_KILOMETRE;
    to[4] += to[4] - to[1];
    let longer = Upload::new(&mission, 1, config).unwrap();
    let longer = longer.with_sites(sites(to)).unwrap();
    relay.handle_upload(at, &longer).unwrap();
    let adopted = until(&mut relay, Instant::from_millis(3_000), 1_700.0);
    assert_eq!(relay.sites(), Some(sites(to)));
    assert!(events(&mut relay).contains(&Event::SetpointChanged));
    let agreed = relay.agreed_place().unwrap();
    assert_eq!(relay.setpoint(), None, "it may still be braking");
    let stopped = adopted + guard.lag + Duration::from_millis(500);
    until(&mut relay, stopped, 1_700.0);
    // The drone is beyond its old range of x. Its setpoint is nevertheless the agreed position.
    assert_eq!(relay.setpoint(), Some(agreed));
    assert_eq!(relay.agreed_place(), Some(agreed));
}
