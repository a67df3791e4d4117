//! Missions with a way back (Rx to Tx): refused numbers, and refused relay settings.

use host_tests::fixtures::paper;
use uav_relay::mission::MissionError;
use uav_relay::{
    Identity, Instant, Listen, Method, Mission, MissionConfig, Relay, Settings, SetupError,
};

fn both_ways() -> MissionConfig {
    MissionConfig {
        reverse: 1.0,
        ..paper(3)
    }
}

#[test]
fn a_way_back_out_of_range_is_refused() {
    let with = |reverse: f32, rx_power_w: f32| {
        let config = MissionConfig {
            reverse,
            rx_power_w,
            ..paper(3)
        };
        Mission::try_new(config).err()
    };
    for reverse in [0.0, f32::MIN_POSITIVE, 1.0] {
        assert_eq!(with(reverse, 80.0), None, "{reverse}");
    }
    for reverse in [-1e-9, 1.0_f32.next_up(), f32::NAN, f32::INFINITY] {
        assert_eq!(
            with(reverse, 80.0),
            Some(MissionError::Reverse),
            "{reverse}"
        );
    }
    for rx_power_w in [0.0, -1.0, 1e-6_f32.next_down(), 1e6_f32.next_up(), f32::NAN] {
        for reverse in [0.0, 0.5] {
            let error = with(reverse, rx_power_w);
            assert_eq!(error, Some(MissionError::RxPower), "{rx_power_w}");
        }
    }
    assert!(
        MissionError::Reverse
            .to_string()
            .contains("must be within 0 to 1")
    );
}

#[test]
fn the_joint_method_of_relays_that_listen_is_refused() {
    let mission = Mission::try_new(both_ways()).unwrap();
    let with = |settings: Settings| {
        let identity = Identity {
            network: 1,
            index: 2,
        };
        Relay::new(mission, identity, settings, 1, Instant::ZERO).err()
    };
    assert_eq!(with(Settings::default()), None);
    let joint = Settings {
        method: Method::Joint,
        ..Settings::default()
    };
    assert_eq!(with(joint), None);
    let listening = Settings {
        listen: Some(Listen::default()),
        ..joint
    };
    assert_eq!(with(listening), Some(SetupError::Reverse));
    for settings in [
        Settings {
            method: Method::Adjust(uav_relay::Adjust::default()),
            ..Settings::default()
        },
        Settings {
            listen: Some(Listen::default()),
            ..Settings::default()
        },
    ] {
        assert_eq!(with(settings), None, "{settings:?}");
    }
    let line = SetupError::Reverse.to_string();
    assert!(
        line.contains("reverse") && line.contains("listen"),
        "{line}"
    );
}
