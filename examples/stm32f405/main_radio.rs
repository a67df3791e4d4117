//! Firmware of a relay on an STM32F405 that shares one radio channel with all relays. `stm32f405` with one serial port to the
//! radio.
//!
//! ```text
//! cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405_radio     # flashes, with probe-rs
//! ```
//! `radio.rs` has the pins; everything else, and the configuration of a drone, is that of `main.rs`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cfg_attr(not(feature = "flight"), path = "no_autopilot.rs")]
mod autopilot;
#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod chip;
#[cfg(target_os = "none")]
mod clock;
#[cfg(target_os = "none")]
mod drone;
#[cfg(target_os = "none")]
mod flash;
#[cfg(target_os = "none")]
#[cfg_attr(not(feature = "defmt"), path = "no_log.rs")]
mod log;
#[cfg(target_os = "none")]
mod main_loop;
#[cfg(target_os = "none")]
mod persistent;
#[cfg(target_os = "none")]
mod port;
#[cfg(target_os = "none")]
mod radio;
#[cfg(all(target_os = "none", feature = "upload"))]
#[expect(unreachable_pub, reason = "the tests on the ground have it public")]
mod uploads;

#[cfg(target_os = "none")]
use uav_relay_block as config;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use uav_relay::Wiring;

    let Some((mut clock, channel, uart)) = connect() else {
        board::stop()
    };
    // A drone without a valid configuration sleeps for good.
    let Some(drone) = drone::begin(Wiring::Shared, uart, clock.now()) else {
        board::stop()
    };
    main_loop::fly(clock, channel, drone)
}

/// Creates the link in static RAM; not inlined, so that its stack frame is released.
#[cfg(target_os = "none")]
#[inline(never)]
fn connect() -> Option<(clock::Clock, &'static mut Channel, autopilot::Uart)> {
    use uav_relay::serial::{SerialLink, Shared};

    let (clock, channel, driver_enable, uart) = radio::start()?;
    let channel = cortex_m::singleton!(
        CHANNEL: Channel = Shared::new(SerialLink::half_duplex(channel, port::BAUD, driver_enable))
    )?;
    Some((clock, channel, uart))
}

#[cfg(target_os = "none")]
type Channel = uav_relay::serial::Shared<port::Port, radio::DriverEnable>;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405, with one serial port to a radio that all relays share.\n\
         Flash it with: cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405_radio\n\
         The head of examples/stm32f405/main.rs says how to configure a drone."
    );
}
