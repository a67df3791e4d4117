// Start of the examples in the documentation: the paper's mission, and a relay of it that has just been switched on.

pub const MISSION: uav_relay::Mission = uav_relay::Mission::new(uav_relay::MissionConfig {
    relays: 1,
    distance_m: 1000.0,
    min_separation_m: 4.0,
    tx_power_w: 80.0,
    common: uav_relay::Profile {
        altitude_m: 20.0,
        power_w: 1.0,
    },
    channel: match uav_relay::Channel::new(2e9, 1.02, 126.0, uav_relay::channel::AirGround::Los) {
        Ok(channel) => channel,
        Err(_) => panic!("a parameter of the channel is out of its range"),
    },
    band: uav_relay::Band::at(20.0),
    lateral: uav_relay::Band::NONE,
    interference: uav_relay::Interference::Source(uav_relay::Interferer {
        power_w: 80.0,
        x_m: 500.0,
        y_m: 400.0,
    }),
    noise_w: 0.0,
    reverse: 0.0,
    rx_power_w: 80.0,
    fitted_gap: 0.0,
    tolerance: 1e-4,
});

pub fn relay(settings: uav_relay::Settings) -> uav_relay::Relay {
    let identity = uav_relay::Identity {
        network: 1,
        index: 1,
    };
    uav_relay::Relay::new(MISSION, identity, settings, 1, uav_relay::Instant::ZERO)
        .expect("the mission and its index fit")
}
