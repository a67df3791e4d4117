//! What is flashed where the relays share one radio channel: the relay of `stm32f405`, with one serial port to the radio.
//!
//! ```text
//! cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405_radio     # flashes, with probe-rs
//! ```
//! `radio.rs` has its pins; everything else, and how to configure a drone, is that of `examples/stm32f405`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[path = "../stm32f405/board.rs"]
mod board;
#[cfg(target_os = "none")]
#[path = "../stm32f405/clock.rs"]
mod clock;
#[cfg(target_os = "none")]
#[path = "../stm32f405/config.rs"]
#[expect(unreachable_pub, reason = "the tools on the ground have it public")]
mod config;
#[cfg(target_os = "none")]
#[path = "../stm32f405/drone.rs"]
mod drone;
#[cfg(target_os = "none")]
#[cfg_attr(feature = "defmt", path = "../stm32f405/log.rs")]
#[cfg_attr(not(feature = "defmt"), path = "../stm32f405/silent.rs")]
mod log;
#[cfg(target_os = "none")]
#[path = "../stm32f405/port.rs"]
mod port;
#[cfg(target_os = "none")]
mod radio;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use uav_relay::serial::{SerialLink, Shared, byte_time};

    let Some((clock, channel, driver_enable)) = radio::start() else {
        board::stop();
    };
    let byte_time = byte_time(port::BAUD);
    let link = SerialLink::half_duplex(channel, byte_time, driver_enable);
    drone::fly(clock, Shared::new(link))
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405, with one serial port to a radio that all relays share.\n\
         Flash it with: cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405_radio\n\
         The head of examples/stm32f405/main.rs says how to configure a drone."
    );
}
