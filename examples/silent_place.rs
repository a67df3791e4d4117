//! A relay under radio silence computes its own position from the mission alone.
//!
//! `cargo run --example silent_place` prints the positions of a chain of five, each computed separately. With
//! messages, the relays would agree on the same positions.
#![cfg_attr(target_os = "none", no_std, no_main)]

use uav_relay::channel::{AirGround, Channel};
use uav_relay::{Band, Interference, Interferer, Mission, MissionConfig, Profile};

/// Channel at 2 GHz. The excess losses are 0.1 dB with line of sight and 21 dB without it, given as factors. The build
/// fails if a value is out of range.
const CHANNEL: Channel = match Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los) {
    Ok(channel) => channel,
    Err(_) => panic!("a channel parameter is out of range"),
};

const MISSION: Mission = Mission::new(MissionConfig {
    relays: 5,
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
});

#[cfg(not(target_os = "none"))]
fn main() {
    for index in 1..=MISSION.relays() {
        match MISSION.silent_place(index) {
            Some(place) => println!(
                "relay {index}: {:.3} m from Tx, {} m high",
                place.x_m, place.altitude_m
            ),
            None => println!("relay {index}: no target SIR can be met by this chain"),
        }
    }
}

#[cfg(target_os = "none")]
use panic_halt as _;
#[cfg(target_os = "none")]
use stm32f4xx_hal as _;

/// Computes the position of relay 3 on the target chip, where a debugger can read the result.
#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    let place = MISSION.silent_place(3);
    loop {
        core::hint::black_box(&place);
        cortex_m::asm::wfi();
    }
}
