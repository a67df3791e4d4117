//! Exchange between the link and the relay of one drone.

use uav_relay::flight::autopilot::{Autopilot, WaitReason};
use uav_relay::flight::axis::Axis;
use uav_relay::{
    Event, GuardConfig, Mission, MissionConfig, Port, Relay, Settings, Side, Sites, Upload,
};

use host_tests::make;
use host_tests::{bench, fixtures};
use mavlink::dialects::common::{
    COMMAND_LONG_DATA, MavCmd, MavLandedState, MavMessage, RADIO_STATUS_DATA,
};

use super::*;
use crate::vehicle::{Target, axis};

/// Creates the only relay of a chain, with a motion guard. The mission's Tx and Rx are as far apart as those of `vehicle::sites`.
fn relay(settings: Settings) -> Relay {
    of(1, 1, settings)
}

/// Creates relay `index` of `relays` relays with a motion guard. The mission's Tx and Rx are as far apart as those of `vehicle::sites`.
pub(crate) fn of(relays: u16, index: u16, settings: Settings) -> Relay {
    let mut config = fixtures::paper(relays);
    config.distance_m = 1343.795;
    let mission = Mission::try_new(config).unwrap();
    let guard = GuardConfig::of(&mission, config.common);
    let settings = Settings {
        guard: Some(guard),
        sited: true,
        ..settings
    };
    fixtures::relay(mission, index, settings)
}

/// Returns a copy of the autopilot link `link` after the relay's outputs were passed to the copy again.
///
/// If the copy equals `link`, then `link` already had the newest outputs of the relay.
fn with_repeated_outputs(link: &Autopilot, relay: &Relay, now: Instant) -> Autopilot {
    let mut link = link.clone();
    link.handle_ready(now, relay.is_ready());
    let holds = [Side::Upstream, Side::Downstream].map(|side| relay.hold_reason(side));
    link.handle_hold(now, holds);
    link.handle_setpoint(now, relay.setpoint());
    let sir_db = relay.target().map(|target| 10.0 * libm::log10f(target));
    link.handle_values(now, sir_db, relay.setpoint());
    link
}

/// Runs the vehicle for `ms`, and checks every exchange of autopilot link and relay. Returns the positions that the
/// relay received.
fn run(vehicle: &mut Vehicle, relay: &mut Relay, ms: u64) -> Vec<Placement> {
    let mut positions = Vec::new();
    for _ in 0..ms / 20 {
        vehicle.step_without_exchange();
        let now = vehicle.now;
        if relay.poll_timeout().is_some_and(|at| at <= now) {
            relay.handle_timeout(now);
        }
        let mut expected = relay.clone();
        let (is_news, position) = vehicle.link.exchange(relay, now);
        // Control is reported first, because a relay starts at the first position after its drone is engaged.
        expected.handle_control(now, vehicle.link.is_flown());
        expected.report_control(vehicle.link.state(), false);
        if let Some(position) = position {
            assert!(is_news);
            expected.handle_position(now, position.place, position.at);
            positions.push(position.place);
        }
        assert!(format!("{relay:?}") == format!("{expected:?}"));
        // The link has what the relay has computed from the newest position.
        let told = with_repeated_outputs(&vehicle.link, relay, now);
        assert_eq!(format!("{:?}", vehicle.link), format!("{told:?}"));
        let before = format!("{:?} {relay:?}", vehicle.link);
        let again = vehicle.link.exchange(relay, now);
        assert_eq!(again, (false, None));
        assert_eq!(before, format!("{:?} {relay:?}", vehicle.link), "no effect");
        vehicle.answer();
    }
    positions
}

fn flies(kind: Kind, settings: Settings) -> (Vehicle, Relay) {
    let (mut vehicle, mut relay) = (Vehicle::new(kind), relay(settings));
    run(&mut vehicle, &mut relay, 2_000);
    vehicle.armed = true;
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    run(&mut vehicle, &mut relay, 2_000);
    (vehicle, relay)
}

#[test]
fn an_engaged_drone_flies_to_its_relays_setpoint() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let (mut vehicle, mut relay) = flies(kind, Settings::default());
        assert_eq!(vehicle.link.state(), State::Standby);
        assert!(relay.agreed_place().is_some());
        assert_eq!(relay.setpoint(), None, "its pilot flies");

        vehicle.mode = Mode::Companion;
        let positions = run(&mut vehicle, &mut relay, 2_000);
        assert!(positions.len() >= 9, "{positions:?}");
        assert_eq!(vehicle.link.state(), State::Engaged);
        run(&mut vehicle, &mut relay, 120_000);
        let (place, agreed) = (vehicle.place, relay.agreed_place().unwrap());
        assert_eq!(relay.setpoint(), Some(agreed));
        assert!(
            (place.x_m - agreed.x_m).abs() < 0.05,
            "{place:?}, {agreed:?}"
        );
        let value = |of: &str| {
            let mut newest = vehicle.received.iter().rev();
            newest.find_map(|(_, said)| match said {
                LinkMessage::Value { name, value } if name == of => Some(*value),
                _ => None,
            })
        };
        assert_eq!(value("relay_x"), Some(agreed.x_m));
        let sir_db = relay.target().map(|target| 10.0 * libm::log10f(target));
        assert_eq!(value("sir_db"), sir_db);

        vehicle.mode = Mode::Position;
        run(&mut vehicle, &mut relay, 1_100);
        assert_eq!(relay.setpoint(), None, "its pilot flies again");

        vehicle.mode = Mode::Companion;
        run(&mut vehicle, &mut relay, 2_000);
        assert!(relay.setpoint().is_some());
        vehicle.mute = true;
        run(&mut vehicle, &mut relay, 4_000);
        assert_eq!(vehicle.link.state(), State::Silent);
        assert_eq!(relay.setpoint(), None, "nobody knows who flies");
    }
}

/// Checks that the yaw of each target points from the drone to the chosen neighbour, relative to north.
#[test]
fn the_yaw_points_an_antenna_to_the_neighbour() {
    for side in [Side::Upstream, Side::Downstream] {
        let (mut vehicle, mut relay) = flies(Kind::Px4, Settings::default());
        vehicle.link.point_antenna(Some(side));
        vehicle.mode = Mode::Companion;
        run(&mut vehicle, &mut relay, 2_000);
        let from = vehicle.now;
        run(&mut vehicle, &mut relay, 2_000);
        let along = axis().to_ned(0.0, [1.0, 0.0, 0.0]);
        let line_rad = along[1].atan2(along[0]);
        let expected = match side {
            Side::Upstream => line_rad - core::f32::consts::PI,
            Side::Downstream => line_rad,
        };
        let targets = vehicle.targets_since(from);
        assert!(targets.len() > 5);
        for (_, target) in targets {
            assert_eq!(target.type_mask & 1 << 10, 0, "it has a yaw");
            let error = (target.yaw_rad - expected).abs();
            assert!(
                error < 0.01,
                "{side:?}: {} instead of {expected}",
                target.yaw_rad
            );
        }
        vehicle.link.point_antenna(None);
        vehicle.link.handle_bearing(None);
        let from = vehicle.now;
        run(&mut vehicle, &mut relay, 1_000);
        let free = |(_, target): &(Instant, Target)| target.type_mask & 1 << 10 != 0;
        assert!(vehicle.targets_since(from).iter().skip(1).all(free));
    }
}

/// Checks that the autopilot link passes the radio's noise sample to the relay.
///
/// The relay of this test does not measure interference, so it counts the sample as rejected.
#[test]
fn exchange_passes_the_radios_noise_to_the_relay() {
    let (mut vehicle, mut relay) = flies(Kind::ArduCopter, Settings::default());
    assert_eq!(relay.stats().samples_rejected, 0);
    let said = RADIO_STATUS_DATA {
        noise: 100,
        ..RADIO_STATUS_DATA::DEFAULT
    };
    vehicle.send_from([b'3', b'D'], &MavMessage::RADIO_STATUS(said));
    assert!(vehicle.link.exchange(&mut relay, vehicle.now).0);
    assert_eq!(relay.stats().samples_rejected, 1);
}

/// Exchanges frames between two neighbouring relays with motion guards.
///
/// The second relay's drone is at the relay's setpoint, or at x = `start_m` before the first setpoint. If `is_silent`
/// is true, the second relay neither receives nor sends frames.
fn exchange_fences(
    first: &mut Relay,
    second: &mut Relay,
    now: Instant,
    start_m: f32,
    is_silent: bool,
) {
    for (port, bytes) in bench::sent(first, now) {
        if port == Port::Downstream && !is_silent {
            second.handle_bytes(now, Port::Upstream, &bytes);
        }
    }
    if is_silent {
        return;
    }
    second.handle_timeout(now);
    let at = second.setpoint().unwrap_or(place(start_m));
    second.handle_position(now, at, now);
    for (port, bytes) in bench::sent(second, now) {
        if port == Port::Upstream {
            first.handle_bytes(now, Port::Downstream, &bytes);
        }
    }
}

#[test]
fn exchange_passes_an_operators_clearance_to_the_relay() {
    let [mut first, mut second] = [1, 2].map(|index| of(2, index, Settings::default()));
    let mut vehicle = Vehicle::new(Kind::Px4);
    vehicle.armed = true;
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    let side = Side::Downstream;
    let mut lost = None;
    for tenths in 0..600 {
        if tenths == 50 {
            vehicle.mode = Mode::Companion;
        }
        run(&mut vehicle, &mut first, 100);
        if tenths == 250 {
            // The pilot of the second drone takes the sticks, and its relay is switched off later.
            second.handle_control(vehicle.now, false);
        }
        exchange_fences(&mut first, &mut second, vehicle.now, 900.0, tenths > 300);
        while let Some(event) = first.poll_event() {
            vehicle.link.handle_event(event);
            if matches!(event, Event::NeighbourLost { .. }) {
                lost = Some(event);
            }
        }
    }
    assert_eq!(vehicle.link.state(), State::Engaged);
    assert_eq!(lost, Some(Event::NeighbourLost { side, node: 2 }));
    let command = MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        param1: 2.0,
        command: MavCmd::MAV_CMD_USER_1,
        target_system: vehicle::SYSTEM,
        target_component: 191,
        ..COMMAND_LONG_DATA::DEFAULT
    });
    let before = first.clone();
    vehicle.send_from([255, 190], &command);
    assert!(vehicle.link.exchange(&mut first, vehicle.now).0);
    // The guard forgets where the second drone may be.
    let mut expected = before.clone();
    expected.clear_lost(vehicle.now, side);
    assert!(format!("{before:?}") != format!("{expected:?}"));
    assert!(format!("{first:?}") == format!("{expected:?}"));
}

/// Checks that a relay's bearings point to its neighbour's agreed position and to the transmitter.
#[test]
fn bearings_lead_to_the_neighbours_agreed_position() {
    let [mut first, mut second] = [1, 2].map(|index| of(2, index, Settings::default()));
    let mut vehicle = Vehicle::new(Kind::Px4);
    vehicle.armed = true;
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    assert_eq!(first.bearing(Side::Downstream), None);
    for tenths in 0..1_200 {
        if tenths == 50 {
            vehicle.mode = Mode::Companion;
        }
        run(&mut vehicle, &mut first, 100);
        exchange_fences(&mut first, &mut second, vehicle.now, 900.0, false);
    }
    let [own, next] = [&first, &second].map(|relay| relay.setpoint().unwrap());
    let ahead = first.bearing(Side::Downstream).unwrap();
    assert!(
        (ahead.distance_m - (next.x_m - own.x_m)).abs() < 0.1,
        "{ahead:?}"
    );
    assert!(ahead.azimuth_rad.abs() < 0.01, "{ahead:?}");
    let behind = first.bearing(Side::Upstream).unwrap();
    let to_tx = (own.x_m.powi(2) + own.altitude_m.powi(2)).sqrt();
    assert!((behind.distance_m - to_tx).abs() < 0.1, "{behind:?}");
    let back = second.bearing(Side::Upstream).unwrap();
    assert!((back.distance_m - ahead.distance_m).abs() < 0.1, "{back:?}");
}

/// Checks that a drone comes under setpoint control only on the right side of its neighbour's drone.
///
/// The order along the line from Tx to Rx must be that of the relays in the chain.
#[test]
fn a_drone_out_of_sequence_cannot_be_engaged() {
    let [mut first, mut second] = [1, 2].map(|index| of(2, index, Settings::default()));
    let mut vehicle = Vehicle::new(Kind::Px4);
    vehicle.armed = true;
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
    for _ in 0..200 {
        run(&mut vehicle, &mut first, 100);
        exchange_fences(&mut first, &mut second, vehicle.now, 50.0, false);
    }
    assert!(!first.is_ready());
    let waits = AutopilotEvent::Waits(WaitReason::NotReady);
    assert_eq!(vehicle.events.last(), Some(&waits));
}

/// Checks that the autopilot link uses the new Tx-Rx line if its relay adopts a mission that moves Tx.
///
/// A second mission then moves Tx back.
#[test]
fn the_link_follows_the_relay_to_the_line_of_a_new_mission() {
    let auth = Some(make::auth([7; 32], 1));
    let settings = Settings {
        auth,
        ..Settings::default()
    };
    let (mut vehicle, mut relay) = flies(Kind::Px4, settings);
    let base = *relay.mission();
    let loaded = vehicle::sites();
    let tx = axis().point(Placement::on_line(-60.0, 0.0)).unwrap();
    let moved = Sites { tx, ..loaded };
    let longer = Axis::between(moved).unwrap();
    let config = MissionConfig {
        distance_m: longer.distance_m() as f32,
        ..*base.config()
    };
    let uploads = [
        (
            Upload::new(&base, 1, config)
                .unwrap()
                .with_sites(moved)
                .unwrap(),
            longer,
        ),
        (Upload::new(&base, 2, *base.config()).unwrap(), axis()),
    ];
    for (upload, line) in uploads {
        relay.handle_upload(vehicle.now, &upload).unwrap();
        run(&mut vehicle, &mut relay, 2_000);
        assert_eq!(relay.version(), upload.version());
        let positions = run(&mut vehicle, &mut relay, 1_000);
        let at = axis().point(vehicle.place).unwrap();
        assert_eq!(positions.last(), line.place(at).as_ref());
    }
}
