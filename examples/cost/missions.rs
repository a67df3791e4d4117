//! Missions of the measured chains.

use uav_relay::channel::AirGround;
use uav_relay::channel::Channel;
use uav_relay::{
    Band, Field, FieldPoint, Interference, Interferer, Mission, MissionConfig, Profile,
};

/// Channel at 2 GHz with line of sight. The excess losses are 0.1 dB with line of sight and 21 dB without, given as
/// factors.
pub(crate) const CHANNEL: Channel = match Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los) {
    Ok(channel) => channel,
    Err(_) => panic!("a channel parameter is out of range"),
};

pub(crate) const fn mission(relays: u16) -> Mission {
    Mission::new(MissionConfig {
        relays,
        distance_m: 1000.0,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        common: Profile {
            altitude_m: 20.0,
            power_w: 1.0,
        },
        channel: CHANNEL,
        band: Band::at(20.0),
        lateral: Band::NONE,
        interference: Interference::Source(Interferer {
            power_w: 80.0,
            x_m: 500.0,
            y_m: 400.0,
        }),
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: 80.0,
        fitted_gap: 0.0,
        tolerance: 1e-4,
    })
}

pub(crate) const MISSION: Mission = mission(8);

pub(crate) const INTERFERER: Interferer = Interferer {
    power_w: 80.0,
    x_m: 500.0,
    y_m: 150.0,
};

/// Mission of three relays that may choose altitudes of 20 to 300 m.
pub(crate) const HIGH: Mission = Mission::new(MissionConfig {
    band: Band {
        least_m: 20.0,
        most_m: 300.0,
    },
    interference: Interference::Source(INTERFERER),
    ..*mission(3).config()
});

/// Mission of three relays that carries data from Tx to Rx and back. The relays may choose altitudes of 20 to 300 m.
pub(crate) const BOTH: Mission = Mission::new(MissionConfig {
    reverse: 1.0,
    ..*HIGH.config()
});

/// Mission of three relays at one altitude, with data to Rx and back in fitted slots.
///
/// A fitted slot is as long as its hop needs.
pub(crate) const FITTED: Mission = Mission::new(MissionConfig {
    band: Band::at(20.0),
    fitted_gap: 2.0,
    ..*BOTH.config()
});

/// Mission of three relays at altitudes of 20 to 300 m, with data to Rx and back in fitted slots.
pub(crate) const FITTED_HIGH: Mission = Mission::new(MissionConfig {
    fitted_gap: 2.0,
    ..*BOTH.config()
});

/// Mission of three relays that may choose altitudes, and lateral offsets up to 280 m left and right.
pub(crate) const WIDE: Mission = Mission::new(MissionConfig {
    lateral: Band {
        least_m: -280.0,
        most_m: 280.0,
    },
    ..*HIGH.config()
});

pub(crate) const POINTS: [FieldPoint; 4] = [
    FieldPoint {
        x_m: 0.0,
        upsilon_per_w: 2.0e6,
    },
    FieldPoint {
        x_m: 300.0,
        upsilon_per_w: 5.0e6,
    },
    FieldPoint {
        x_m: 600.0,
        upsilon_per_w: 1.1e6,
    },
    FieldPoint {
        x_m: 1000.0,
        upsilon_per_w: 3.0e6,
    },
];

/// Mission of three relays with an interference that varies along x and is known.
pub(crate) const UNEVEN: Mission = Mission::new(MissionConfig {
    interference: Interference::Field(Field::new(&POINTS)),
    ..*mission(3).config()
});
