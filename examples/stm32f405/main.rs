//! What is flashed: a relay on an STM32F405 with a serial port to each neighbour.
//!
//! ```text
//! cargo build --release --target thumbv7em-none-eabihf --example stm32f405
//! cargo run   --release --target thumbv7em-none-eabihf --example stm32f405     # flashes, with probe-rs
//! ```
//! Every drone gets the same image. Which relay it is, 1 to N counted from the transmitter, stands in a sector of its own,
//! written once and kept by updates (relay 3, for instance):
//! ```text
//! printf '\3\0\0\0' > index.bin
//! probe-rs download --chip STM32F405RGTx --binary-format bin --base-address 0x080E0000 index.bin
//! ```
//! A drone without a number takes no part. `board.rs` has the pins. To make this firmware yours, set [`MISSION`] and
//! [`NETWORK`], and hand the setpoint to your autopilot in `fly_to`.
#![cfg_attr(target_os = "none", no_std, no_main)]

use uav_relay::channel::{AirGround, Channel};
use uav_relay::{Interferer, Mission, MissionConfig, Profile};

#[cfg(target_os = "none")]
mod board;

/// What all relays agree on before take-off. A number out of range fails the build.
const MISSION: Mission = Mission::new(MissionConfig {
    relays: 3,
    distance_m: 1000.0,
    min_separation_m: 4.0,
    tx_power_w: 80.0,
    common: Profile {
        altitude_m: 20.0,
        power_w: 1.0,
    },
    channel: CHANNEL,
    interferer: Interferer {
        power_w: 80.0,
        x_m: 500.0,
        y_m: 400.0,
    },
    tolerance: 1e-4,
});

/// 2 GHz; the excess losses are 0.1 dB with line of sight and 21 dB without, as factors: 10^0.01 and
/// 10^2.1. A number out of range fails the build.
const CHANNEL: Channel = match Channel::new(
    2e9,
    1.023_292_992_280_754,
    125.892_541_179_416_73,
    AirGround::Los,
) {
    Ok(channel) => channel,
    Err(_) => panic!("a channel parameter is out of range"),
};

/// Relays of other networks on the same wires or frequency are ignored.
const NETWORK: u16 = 7;

#[cfg(target_os = "none")]
mod firmware {
    use uav_relay::serial::{Pair, SerialLink, byte_time};
    use uav_relay::{Event, Identity, Placement, Relay, Settings};

    use super::{MISSION, NETWORK, board};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let Some((mut clock, upstream, downstream)) = board::start() else {
            board::stop();
        };
        let Some(index) = board::relay_index() else {
            board::stop();
        };
        let identity = Identity {
            network: NETWORK,
            index,
        };
        let relay = Relay::new(
            MISSION,
            identity,
            Settings::default(),
            board::seed(),
            clock.now(),
        );
        let Ok(mut relay) = relay else { board::stop() };
        let byte_time = byte_time(board::BAUD);
        let mut ports = Pair::new(
            SerialLink::new(upstream, byte_time),
            SerialLink::new(downstream, byte_time),
        );
        loop {
            let wake = ports.poll(clock.now(), &mut relay);
            while let Some(event) = relay.poll_event() {
                if event == Event::SetpointChanged
                    && let Some(place) = relay.setpoint()
                {
                    fly_to(place);
                }
            }
            clock.sleep(wake);
        }
    }

    /// Replace this by what your autopilot wants to hear: `place.x_m` metres from the transmitter toward the receiver, at
    /// `place.altitude_m` above the ground.
    fn fly_to(place: Placement) {
        core::hint::black_box(place);
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405: network {NETWORK}, {} relays over {} m.\n\
         Flash it with: cargo run --release --target thumbv7em-none-eabihf --example stm32f405\n\
         The head of examples/stm32f405/main.rs says how to number a drone.",
        MISSION.relays(),
        MISSION.config().distance_m,
    );
}
