//! Uploads with sites: refusals, the sites in use, and separation of positions along different lines.

use host_tests::fixtures::paper;
use uav_relay::UploadError;
use uav_relay::wire::digest::digest;
use uav_relay::{
    Duration, Event, Geodetic, Instant, LineError, Mission, Placement, Port, Relay, Settings,
    Sites, Upload, Wiring,
};
use uav_relay::{Geofence, GuardConfig};

use super::adopted::adopts;
use super::codec::{Fenced, Said};
use super::offer::Offer;
use super::signed::{Peer, said, set};
use super::uploads::{NOW, held, hello, mission_id, relay_4, upload};
use super::votes::{FLIES, REFUSED, WHOLE, events};

/// Sites a kilometre apart, to the millimetre.
pub(crate) const A_KILOMETRE: [i32; 6] = [
    474_000_000,
    85_400_000,
    420_000,
    474_000_000,
    85_532_474,
    431_000,
];

fn sites([a, b, c, d, e, f]: [i32; 6]) -> Sites {
    let at = |lat_e7, lon_e7, amsl_mm| Geodetic {
        lat_e7,
        lon_e7,
        amsl_mm,
    };
    Sites {
        tx: at(a, b, c),
        rx: at(d, e, f),
    }
}

/// Returns an upload with the sites of `A_KILOMETRE`.
fn sited(version: u16, base: u16) -> Offer {
    Offer {
        sites: A_KILOMETRE,
        ..upload(version, base)
    }
}

/// Moves the receiver of an offer east by `east`, 1e-7 degrees.
fn farther(offer: Offer, east: i32) -> Offer {
    let mut sites = offer.sites;
    sites[4] += east;
    Offer { sites, ..offer }
}

const DISTANCE: Event = Event::UploadRefused {
    why: LineError::Distance,
};
const SITES: Event = Event::UploadRefused {
    why: LineError::Sites,
};

/// Checks refusals with and without a line on earth, so that a chain decides unanimously.
#[test]
fn an_upload_whose_sites_disagree_with_its_distance_is_refused_and_the_event_says_so() {
    for by_autopilot in [false, true] {
        let (identity, settings) = set(4, Wiring::Pair);
        let mission = Mission::try_new(paper(8)).unwrap();
        let settings = Settings {
            sited: by_autopilot,
            ..settings
        };
        let mut relay = Relay::new(mission, identity, settings, 1, NOW).unwrap();
        let mut peer = Peer::meets(&mut relay, 4, 5, Port::Downstream);
        said(&mut relay, NOW);
        events(&mut relay);
        let base = digest(&mission);
        let near = |east| farther(sited(2, base), east);
        // A unit is 7.5 mm: 4.5 cm are tolerated, 6 cm are not.
        let mut none = sited(2, base);
        none.sites = [474_000_000, 85_400_000, 0, 474_000_000, 85_400_900, 0];
        let longer = Offer {
            distance_m: 1100.0,
            ..sited(2, base)
        };
        let mut refused = 0;
        for (offer, why) in [
            (near(8), DISTANCE),
            (near(-8), DISTANCE),
            (longer, DISTANCE),
            (none, SITES),
        ] {
            refused += 1;
            for told in [vec![why], vec![]] {
                peer.says(&mut relay, NOW, &Said::Offer(offer));
                assert_eq!(events(&mut relay), told, "{offer:?}");
                // The relay answers with a hello that names the refused mission.
                let says = said(&mut relay, NOW);
                let [(_, Said::Hello(hello))] = says.as_slice() else {
                    panic!("{says:?}")
                };
                assert_eq!(hello.latest_mission, mission_id(&offer));
                assert_eq!(hello.flags & (FLIES | WHOLE | REFUSED), REFUSED);
                assert_eq!(held(&relay), None);
            }
            assert_eq!(relay.stats().mission, 2 * refused);
            let upload = Upload::decode(&offer.kept()).unwrap();
            let Event::UploadRefused { why } = why else {
                unreachable!()
            };
            let line = Err(UploadError::Line(why));
            assert_eq!(relay.clone().handle_upload(NOW, &upload), line);
            let mut begins = Relay::new(mission, identity, settings, 1, NOW).unwrap();
            assert_eq!(begins.resume(&upload), line);
            // The ground station does not create such an upload either.
            let plain = Upload::decode(
                &Offer {
                    sites: [0; 6],
                    ..offer
                }
                .kept(),
            )
            .unwrap();
            assert_eq!(plain.with_sites(sites(offer.sites)).map(|_| ()), line);
        }
        for good in [near(6), near(-6)] {
            let mut after = relay.clone();
            peer.clone().says(&mut after, NOW, &Said::Offer(good));
            assert_eq!(events(&mut after), [Event::Uploaded]);
            assert_eq!(held(&after), Some(mission_id(&good)));
        }
    }
}

#[test]
fn the_sites_are_those_of_the_mission_that_is_flown() {
    let (mut relay, mut peers, base) = relay_4();
    let first = sited(2, base);
    assert_ne!(
        mission_id(&first),
        mission_id(&upload(2, base)),
        "it is another mission"
    );
    peers[0].says(&mut relay, NOW, &Said::Offer(first));
    assert_eq!(
        (relay.sites(), held(&relay)),
        (None, Some(mission_id(&first)))
    );
    adopts(&mut relay, &mut peers, &first);
    assert_eq!(relay.sites(), Some(sites(A_KILOMETRE)));
    // A newer mission that is held is not flown.
    peers[0].says(&mut relay, NOW, &Said::Offer(upload(3, base)));
    assert_eq!(relay.sites(), Some(sites(A_KILOMETRE)));
    // The stored mission applies after a reboot.
    let (identity, settings) = set(4, Wiring::Pair);
    let mission = Mission::try_new(paper(8)).unwrap();
    for (kept, expected) in [(first, Some(sites(A_KILOMETRE))), (upload(3, base), None)] {
        let mut again = Relay::new(mission, identity, settings, 1, NOW).unwrap();
        let upload = Upload::decode(&kept.kept()).unwrap();
        assert_eq!(again.resume(&upload), Ok(()));
        assert_eq!(again.sites(), expected);
    }
}

/// Returns relay 4 with a guard, its neighbours, and the digest of its mission.
fn guarded() -> (Relay, [Peer; 2], u16) {
    let (identity, settings) = set(4, Wiring::Pair);
    let mission = Mission::try_new(paper(8)).unwrap();
    // The geofence has room for all offers here.
    let mut guard = GuardConfig::of(&mission, mission.config().common);
    guard.fence = Geofence {
        least_y_m: -1e3,
        most_y_m: 1e3,
        least_altitude_m: 0.0,
        most_altitude_m: 1e3,
        ..guard.fence
    };
    let settings = Settings {
        guard: Some(guard),
        ..settings
    };
    let mut relay = Relay::new(mission, identity, settings, 1, NOW).unwrap();
    let mut peers = [(3, Port::Upstream), (5, Port::Downstream)]
        .map(|(node, port)| Peer::meets(&mut relay, 4, node, port));
    let base = digest(&mission);
    for peer in &mut peers {
        peer.says(&mut relay, NOW, &hello(base, 4, (base, 0), 0));
    }
    said(&mut relay, NOW);
    events(&mut relay);
    (relay, peers, base)
}

#[test]
fn a_fence_along_another_line_is_stale_and_has_no_effect() {
    let (mut relay, mut peers, base) = guarded();
    let fence = |mission| {
        Said::Fence(Fenced {
            association: 700,
            line_digest: mission,
            echo: 0,
            number: 0,
            places: [300.0, 310.0, 0.0, 20.0, 0.0],
            flags: 0,
        })
    };
    let first = sited(2, base);
    let line = first.between(base);
    assert_ne!(line, base);
    let stale = |relay: &Relay, peers: &[Peer; 2], mission| {
        let (mut after, before) = (relay.clone(), *relay.stats());
        peers[0].clone().says(&mut after, NOW, &fence(mission));
        let stats = after.stats();
        assert_eq!(events(&mut after.clone()), []);
        (stats.stale - before.stale, stats.mission - before.mission)
    };
    assert_eq!(stale(&relay, &peers, base), (0, 0));
    assert_eq!(stale(&relay, &peers, line), (1, 0));
    adopts(&mut relay, &mut peers, &first);
    events(&mut relay);
    assert_eq!(stale(&relay, &peers, base), (1, 0));
    assert_eq!(stale(&relay, &peers, line), (0, 0));
    // A mission without sites uses the loaded line.
    let (mut relay, mut peers, base) = guarded();
    adopts(&mut relay, &mut peers, &upload(2, base));
    events(&mut relay);
    assert_eq!(stale(&relay, &peers, base), (0, 0));
    assert_eq!(stale(&relay, &peers, line), (1, 0));
}

/// Checks a single relay, which has a position and a guard's setpoint until the line changes.
#[test]
fn a_relay_has_no_place_along_a_new_line_before_it_has_stopped_and_the_chain_has_agreed() {
    let config = paper(1);
    let mission = Mission::try_new(config).unwrap();
    let (identity, settings) = set(1, Wiring::Pair);
    let guard = GuardConfig::of(&mission, config.common);
    let settings = Settings {
        guard: Some(guard),
        ..settings
    };
    let mut relay = Relay::new(mission, identity, settings, 1, NOW).unwrap();
    let mut now = NOW;
    let mut until = |relay: &mut Relay, end: Instant, x_m: f32| {
        while now < end {
            now = now + Duration::from_millis(100);
            relay.handle_position(now, now, Placement::on_line(x_m, 20.0));
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
    let longer = Upload::new(
        &mission,
        1,
        uav_relay::MissionConfig {
            distance_m: 2000.0,
            ..config
        },
    );
    let mut to = A_KILOMETRE;
    to[4] += to[4] - to[1];
    let longer = longer.unwrap().with_sites(sites(to)).unwrap();
    relay.handle_upload(at, &longer).unwrap();
    let adopted = until(&mut relay, Instant::from_millis(3_000), 1_700.0);
    assert_eq!(relay.sites(), Some(sites(to)));
    assert!(events(&mut relay).contains(&Event::SetpointChanged));
    let agreed = relay.agreed_place().unwrap();
    assert_eq!(relay.setpoint(), None, "it may still be braking");
    until(
        &mut relay,
        adopted + guard.lag + Duration::from_millis(500),
        1_700.0,
    );
    assert_eq!(
        relay.setpoint(),
        Some(agreed),
        "beyond the old box, it is found there and sent on"
    );
    assert_eq!(relay.agreed_place(), Some(agreed));
}
