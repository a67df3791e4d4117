//! Firmware of a relay on an STM32F405 that shares one radio channel with all relays.
//!
//! ```text
//! cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405_radio     # flashes, with probe-rs
//! ```
//! The radio, or the transceiver of a bus, is at USART2. PA1 is its driver enable, if it has one: high while this
//! relay sends. Everything else is as in `main.rs`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cfg_attr(not(feature = "flight"), path = "no_autopilot.rs")]
mod autopilot;
#[cfg(target_os = "none")]
mod firmware;
#[cfg(target_os = "none")]
mod main_loop;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use firmware::{board, drone};
    use uav_relay::Wiring;

    let Some((mut clock, channel, uart)) = connect() else {
        board::stop()
    };
    // A drone without a valid configuration block sleeps forever.
    let Some(drone) = drone::begin(Wiring::Shared, uart, clock.now()) else {
        board::stop()
    };
    main_loop::fly(clock, channel, drone)
}

/// Creates the clock, the radio channel and the autopilot's UART.
///
/// The channel is in static RAM. This function is not inlined, so that its stack frame is freed.
#[cfg(target_os = "none")]
#[inline(never)]
fn connect() -> Option<(
    firmware::clock::Clock,
    &'static mut Channel,
    autopilot::Uart,
)> {
    use firmware::{pins, port};
    use uav_relay::serial::{SerialLink, Shared};

    let board = pins::start()?;
    let driver_enable = board.pa1.into_push_pull_output();
    let channel = cortex_m::singleton!(
        CHANNEL: Channel = Shared::new(SerialLink::half_duplex(board.first, port::BAUD, driver_enable))
    )?;
    Some((board.clock, channel, board.uart))
}

#[cfg(target_os = "none")]
type Channel = uav_relay::serial::Shared<
    firmware::port::Port,
    stm32f4xx_hal::gpio::PA1<stm32f4xx_hal::gpio::Output>,
>;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405, with one serial port to a radio that all relays share.\n\
         Flash it with: cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405_radio\n\
         The head of examples/stm32f405/main.rs says how to configure a drone."
    );
}
