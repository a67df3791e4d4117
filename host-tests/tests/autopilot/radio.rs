//! Noise measured by a SiK radio, with the drone's position.

use mavlink::dialects::common::{MavLandedState, MavMessage, RADIO_STATUS_DATA};
use mavlink::{MAVLinkV2MessageRaw, MavHeader};
use uav_relay::Sample;
use uav_relay::flight::mavlink::incoming::noise_w;

use super::*;

fn sample_of_noise(vehicle: &mut Vehicle, noise: u8) -> Option<Sample> {
    let header = MavHeader {
        system_id: u32::from(b'3'),
        component_id: b'D',
        sequence: 0,
    };
    let said = RADIO_STATUS_DATA {
        noise,
        ..RADIO_STATUS_DATA::DEFAULT
    };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, &MavMessage::RADIO_STATUS(said));
    vehicle.link.handle_bytes(vehicle.now, raw.raw_bytes());
    let sample = vehicle.link.poll_sample();
    assert_eq!(vehicle.link.poll_sample(), None, "once");
    sample
}

#[test]
fn an_airborne_radios_noise_reaches_the_relay() {
    let mut vehicle = Vehicle::new(Kind::ArduCopter);
    vehicle.run(2_000);
    assert_eq!(sample_of_noise(&mut vehicle, 100), None, "on the ground");
    vehicle.fly_off();
    let Some(Sample::Heard { at, power_w }) = sample_of_noise(&mut vehicle, 100) else {
        panic!("nothing was heard");
    };
    let (_, known) = vehicle.positions.last().unwrap();
    assert_eq!(at, known.place);
    // The power is (100 / 1.9 - 127) dBm.
    assert!((power_w / 3.657_e-11 - 1.0).abs() < 1e-3, "{power_w:e}");
    assert_eq!(noise_w(100), Some(power_w));
    for unknown in [0, 255] {
        assert_eq!(
            sample_of_noise(&mut vehicle, unknown),
            None,
            "{unknown} says nothing"
        );
    }
    vehicle.position_every_ms = u64::MAX;
    vehicle.run(2_000);
    assert_eq!(
        sample_of_noise(&mut vehicle, 100),
        None,
        "it may be anywhere"
    );
    vehicle.position_every_ms = 200;
    vehicle.run(1_000);
    assert!(sample_of_noise(&mut vehicle, 100).is_some());
    vehicle.landed = MavLandedState::MAV_LANDED_STATE_ON_GROUND;
    vehicle.run(1_000);
    assert_eq!(
        sample_of_noise(&mut vehicle, 100),
        None,
        "on the ground again"
    );
}
