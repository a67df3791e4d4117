//! Single relay with an upload, and the ground station with its answers.

use host_tests::bench;
use host_tests::make;
use uav_relay::MAX_FRAME;
use uav_relay::UploadError;
use uav_relay::ground::Progress;
use uav_relay::{
    Auth, Event, Field, FieldPoint, Ground, Identity, Port, Relay, Settings, ViewId, Wiring,
};

use super::*;

static POINTS: [FieldPoint; 2] = [
    FieldPoint {
        x_m: 0.0,
        upsilon_per_w: 1e6,
    },
    FieldPoint {
        x_m: 1000.0,
        upsilon_per_w: 2e6,
    },
];

const IDENTITY: Identity = make::identity(1);

fn auth(epoch: u32) -> Auth {
    make::auth([7; 32], epoch)
}

fn settings(wiring: Wiring) -> Settings {
    Settings {
        wiring,
        auth: Some(auth(1)),
        ..Settings::default()
    }
}

fn alone(base: Mission, wiring: Wiring) -> Relay {
    Relay::new(base, IDENTITY, settings(wiring), 1, Instant::ZERO).unwrap()
}

fn new_place(base: &Mission, version: u16) -> Upload {
    Upload::new(base, version, moved(base, 700.0, -300.0)).unwrap()
}

/// Exchanges frames between the ground station and one relay for two seconds. Returns the relay's events.
fn exchange(ground: &mut Ground, relay: &mut Relay, port: Port, from_ms: u64) -> Vec<Event> {
    let mut events = Vec::new();
    let mut frame = [0; MAX_FRAME];
    for ms in from_ms..from_ms + 2_000 {
        let now = Instant::from_millis(ms);
        ground.handle_timeout(now);
        while let Some(len) = ground.poll_transmit(&mut frame) {
            relay.handle_bytes(now, port, &frame[..len]);
        }
        relay.handle_timeout(now);
        let sent = bench::sent(relay, now).into_iter();
        for (_, bytes) in sent.filter(|(by, _)| *by == port) {
            ground.handle_bytes(&bytes);
        }
        events.extend(bench::events(relay));
    }
    events
}

#[test]
fn an_upload_reports_its_errors() {
    let base = mission(3);
    let of = |version, config| Upload::new(&base, version, config).map(|_| ());
    let good = moved(&base, 1.0, 2.0);
    assert_eq!(of(1, good), Ok(()));
    assert_eq!(of(0, good), Err(UploadError::Version));
    let more = MissionConfig { relays: 4, ..good };
    assert_eq!(of(1, more), Err(UploadError::Relays));
    let far = moved(&base, 2e7, 0.0);
    let error = of(1, far).unwrap_err();
    assert_eq!(
        error.to_string(),
        "interferer.x_m and y_m must be within -1e7 to 1e7"
    );
    let field = MissionConfig {
        interference: Interference::Field(Field::new(&POINTS)),
        ..good
    };
    assert_eq!(of(1, field), Err(UploadError::Field));
    let in_a_field = Mission::try_new(field).unwrap();
    assert_eq!(
        Upload::new(&in_a_field, 1, good).map(|_| ()),
        Err(UploadError::Field)
    );
}

#[test]
fn only_stored_bytes_decode_to_the_upload() {
    let base = mission(3);
    let stored = new_place(&base, 9);
    let mut bytes = [0; Upload::LENGTH];
    assert_eq!(stored.encode(&mut bytes), Some(Upload::LENGTH));
    assert_eq!(stored.encode(&mut [0; Upload::LENGTH - 1]), None);
    assert_eq!(Upload::decode(&bytes), Some(stored));
    for len in 0..Upload::LENGTH {
        assert_eq!(Upload::decode(&bytes[..len]), None);
    }
    let mut longer = bytes.to_vec();
    longer.push(0);
    assert_eq!(Upload::decode(&longer), None);
}

#[test]
fn a_relay_accepts_a_newer_upload_from_its_firmware() {
    let base = mission(3);
    let now = Instant::ZERO;
    let mut relay = alone(base, Wiring::Shared);
    assert_eq!((relay.version(), relay.upload()), (0, None));
    let other = Mission::try_new(moved(&base, 1.0, 2.0)).unwrap();
    let stray = new_place(&other, 5);
    assert_eq!(relay.handle_upload(now, &stray), Err(UploadError::Base));
    let (four, five) = (new_place(&base, 4), new_place(&base, 5));
    assert_eq!(relay.handle_upload(now, &five), Ok(()));
    assert_eq!(relay.poll_event(), Some(Event::Uploaded));
    assert_eq!(relay.handle_upload(now, &four), Err(UploadError::Old));
    assert_eq!(relay.handle_upload(now, &five), Err(UploadError::Old));
    assert_eq!(relay.poll_event(), None);
    // The relay holds the mission, but does not fly it before the others hold it.
    assert_eq!((relay.version(), relay.upload()), (0, Some(&five)));
    let unsigned = Settings::default();
    let mut relay = Relay::new(base, IDENTITY, unsigned, 1, now).unwrap();
    assert_eq!(relay.handle_upload(now, &five), Err(UploadError::Unsigned));
}

#[test]
fn a_relay_resumes_an_upload_for_its_mission_only() {
    let base = mission(3);
    let five = new_place(&base, 5);
    let mut relay = alone(base, Wiring::Pair);
    assert_eq!(relay.resume(&five), Ok(()));
    assert_eq!((relay.version(), relay.upload()), (5, Some(&five)));
    assert_eq!(relay.mission().config(), five.config());
    assert_eq!(relay.resume(&five), Err(UploadError::Begun));
    let other = Mission::try_new(moved(&base, 1.0, 2.0)).unwrap();
    let mut relay = alone(other, Wiring::Pair);
    assert_eq!(relay.resume(&five), Err(UploadError::Base));
    assert_eq!((relay.version(), relay.upload()), (0, None));
    // A relay that has started cannot resume.
    let mut relay = alone(base, Wiring::Pair);
    relay.handle_timeout(seconds(1));
    assert_eq!(relay.resume(&five), Err(UploadError::Begun));
    assert_eq!((relay.version(), relay.upload()), (0, None));
}

#[test]
fn a_single_relay_flies_an_upload_and_reports_it() {
    let base = mission(1);
    for (wiring, port, end) in [
        (Wiring::Pair, Port::Upstream, Side::Upstream),
        (Wiring::Pair, Port::Downstream, Side::Downstream),
        (Wiring::Shared, Port::Shared, Side::Upstream),
    ] {
        let mut relay = alone(base, wiring);
        let mut ground = Ground::new(&base, end, IDENTITY.network, wiring, auth(1));
        assert_eq!(exchange(&mut ground, &mut relay, port, 0).len(), 2);
        assert_eq!(ground.progress(), Progress::Idle);
        let now = Instant::from_millis(2_000);
        ground.upload(now, new_place(&base, 2)).unwrap();
        let events = exchange(&mut ground, &mut relay, port, 2_000);
        for event in [
            Event::Uploaded,
            Event::Adopted,
            Event::ViewAccepted,
            Event::Converged,
        ] {
            assert!(events.contains(&event), "{event:?} of {events:?}");
        }
        assert_eq!(
            ground.progress(),
            Progress::Flown {
                by: 1,
                view: ViewId::from_bits(1 << 10 | 1),
                relays: 1,
            }
        );
        assert_eq!(ground.poll_timeout(), None);
        assert_eq!(relay.version(), 2);
        // An older version is refused, and the ground station learns the reason.
        ground
            .upload(Instant::from_millis(4_000), new_place(&base, 1))
            .unwrap();
        let events = exchange(&mut ground, &mut relay, port, 4_000);
        assert_eq!(events, []);
        assert_eq!(ground.progress(), Progress::Outdated { version: 2 });
        assert_eq!(relay.version(), 2);
    }
}

#[test]
fn a_cancelled_upload_is_not_offered_to_a_relay_that_comes_later() {
    let base = mission(1);
    let mut relay = alone(base, Wiring::Pair);
    let mut ground = Ground::new(&base, Side::Upstream, 7, Wiring::Pair, auth(1));
    ground.upload(Instant::ZERO, new_place(&base, 1)).unwrap();
    let mut frame = [0; MAX_FRAME];
    for ms in 0..10_000 {
        ground.handle_timeout(Instant::from_millis(ms));
        while ground.poll_transmit(&mut frame).is_some() {}
    }
    ground.cancel();
    assert_eq!(ground.poll_timeout(), None);
    let events = exchange(&mut ground, &mut relay, Port::Upstream, 10_000);
    assert_eq!(
        (events.contains(&Event::Uploaded), relay.version()),
        (false, 0)
    );
    assert_eq!(ground.progress(), Progress::Idle);
    // The next upload is not disturbed.
    let now = Instant::from_millis(12_000);
    ground.upload(now, new_place(&base, 1)).unwrap();
    exchange(&mut ground, &mut relay, Port::Upstream, 12_000);
    assert_eq!(relay.version(), 1);
}

#[test]
fn a_mission_of_another_station_is_not_replaced_by_one_with_its_version() {
    let base = mission(1);
    let uploads = [1.0, 2.0].map(|x_m| Upload::new(&base, 1, moved(&base, x_m, 0.0)).unwrap());
    for [first, second] in [uploads, [uploads[1], uploads[0]]] {
        let mut relay = alone(base, Wiring::Pair);
        let mut ground = Ground::new(&base, Side::Upstream, 7, Wiring::Pair, auth(1));
        let mut other = Ground::new(&base, Side::Downstream, 7, Wiring::Pair, auth(1));
        ground.upload(Instant::ZERO, first).unwrap();
        exchange(&mut ground, &mut relay, Port::Upstream, 0);
        other.upload(Instant::from_millis(2_000), second).unwrap();
        let events = exchange(&mut other, &mut relay, Port::Downstream, 2_000);
        assert!(!events.contains(&Event::Uploaded), "{events:?}");
        assert_eq!(other.progress(), Progress::Outdated { version: 1 });
    }
}

type Counter = fn(&Relay) -> u32;

#[test]
fn a_ground_of_another_key_network_or_mission_is_ignored() {
    let base = mission(1);
    let other = Mission::try_new(moved(&base, 1.0, 2.0)).unwrap();
    let stranger = make::auth([8; 32], 1);
    let grounds: Vec<(Ground, Mission, Counter)> = vec![
        (
            Ground::new(&base, Side::Upstream, 7, Wiring::Pair, stranger),
            base,
            |relay| relay.stats().forged,
        ),
        (
            Ground::new(&base, Side::Upstream, 8, Wiring::Pair, auth(1)),
            base,
            |relay| relay.stats().foreign,
        ),
        (
            Ground::new(&other, Side::Upstream, 7, Wiring::Pair, auth(1)),
            other,
            |relay| relay.stats().mission,
        ),
    ];
    for (mut ground, of, counter) in grounds {
        let mut relay = alone(base, Wiring::Pair);
        ground.upload(Instant::ZERO, new_place(&of, 1)).unwrap();
        exchange(&mut ground, &mut relay, Port::Upstream, 0);
        assert_eq!(ground.progress(), Progress::Offering);
        assert_eq!((relay.version(), relay.upload()), (0, None));
        assert!(counter(&relay) > 0, "{:?}", relay.stats());
    }
    let mut ground = Ground::new(&base, Side::Upstream, 7, Wiring::Pair, auth(1));
    let stray = ground.upload(Instant::ZERO, new_place(&other, 1));
    assert_eq!(stray, Err(UploadError::Base));
}

#[test]
fn the_ground_tries_the_next_relay_if_the_nearest_is_silent() {
    let base = mission(6);
    let mut ground = Ground::new(&base, Side::Downstream, 7, Wiring::Shared, auth(1));
    ground.upload(Instant::ZERO, new_place(&base, 1)).unwrap();
    let mut asked = Vec::new();
    let mut frame = [0; MAX_FRAME];
    for second in 0..20 {
        ground.handle_timeout(seconds(second));
        while let Some(len) = ground.poll_transmit(&mut frame) {
            // COBS adds one byte before the header, whose second word is the destination.
            assert!(len > 5);
            asked.push(frame[3]);
        }
    }
    asked.dedup();
    assert_eq!(asked, [6, 5, 4, 3, 6, 5, 4], "every three seconds");
}
