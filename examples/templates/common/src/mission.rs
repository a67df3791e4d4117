//! The mission, which all relays share, and the number of this relay.

use uav_relay::channel::AirGround;
use uav_relay::{
    Band, Channel, Identity, Interference, Interferer, Mission, MissionConfig, Profile,
};

/// Bit rate of both links, bit/s, 8N1.
pub const BAUD: u32 = 115_200;

/// Mission of five relays over 1 km at 2 GHz. The excess losses are 0.1 dB with line of sight and 21 dB without, given
/// as factors.
pub const MISSION: Mission = match Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los) {
    Ok(channel) => Mission::new(MissionConfig {
        relays: 5,
        distance_m: 1000.0,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        common: Profile {
            altitude_m: 20.0,
            power_w: 1.0,
        },
        channel,
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
    }),
    Err(_) => panic!("a channel parameter is out of range"),
};

/// Network number of the chain, and index of this relay: 1 is next to the transmitter.
pub const IDENTITY: Identity = Identity {
    network: 7,
    index: 3,
};
