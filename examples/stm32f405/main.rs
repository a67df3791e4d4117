//! Firmware of a relay on an STM32F405 with a serial port to each neighbour.
//!
//! ```text
//! cargo build --profile firmware --target thumbv7em-none-eabihf --example stm32f405
//! cargo run   --profile firmware --target thumbv7em-none-eabihf --example stm32f405     # flashes, with probe-rs
//! ```
//! Every drone gets the same image. Index and mission are in a configuration block with a flash sector of its own. It
//! is written once, and updates preserve it (here for relay 3 of 5):
//! ```text
//! cargo provision --uavs 5 --index 3 --network 7 --out relay3.bin
//! probe-rs download --chip STM32F405RGTx --binary-format bin --base-address 0x080E0000 relay3.bin
//! ```
//! A drone without a block does not join the chain. With `--features defmt` it logs this and all events.
//!
//! | file | content |
//! | --- | --- |
//! | `main.rs` | entry point with a serial port to each neighbour |
//! | `main_radio.rs` | entry point of `stm32f405_radio`, with one serial port to a radio |
//! | `main_async.rs` | entry point of `stm32f405_async`, on asynchronous ports |
//! | `wires.rs` | pins of the second neighbour's port |
//! | `main_loop.rs` | main loop |
//! | `executor.rs`, `ports.rs` | executor and asynchronous ports of `stm32f405_async` |
//! | `autopilot.rs`, `no_autopilot.rs` | autopilot link with the feature `flight`, and its replacement |
//! | `firmware/pins.rs` | pins of every image |
//! | `firmware/drone.rs` | drone as defined by its configuration block, for either wiring |
//! | `firmware/persistent.rs` | storing and restoring of uploads and votes |
//! | `firmware/uploads.rs` | journal of uploaded missions, with the feature `upload` |
//! | `firmware/flash.rs` | flash sectors of the journals, with their unsafe code |
//! | `firmware/port.rs` | interrupt-driven serial port |
//! | `firmware/chip.rs` | clocks, watchdog, cause of the last reset |
//! | `firmware/clock.rs` | time and sleep |
//! | `firmware/log.rs` | log, with `--features defmt` |
//! | `firmware/uart_log.rs` | log output over a spare UART, unless the debug probe has it (`--features rtt`) |
//! | `firmware/board.rs` | all other unsafe code |
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cfg_attr(not(feature = "flight"), path = "no_autopilot.rs")]
mod autopilot;
#[cfg(target_os = "none")]
mod firmware;
#[cfg(target_os = "none")]
mod main_loop;
#[cfg(target_os = "none")]
mod wires;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use firmware::{board, drone};
    use uav_relay::Wiring;

    let Some((mut clock, links, uart)) = connect() else {
        board::stop()
    };
    // A drone without a valid configuration block sleeps forever.
    let Some(drone) = drone::begin(Wiring::Pair, uart, clock.now()) else {
        board::stop()
    };
    main_loop::fly(clock, links, drone)
}

/// Creates the clock, the links to both neighbours and the autopilot's UART.
///
/// The links are in static RAM. This function is not inlined, so that its stack frame is freed.
#[cfg(target_os = "none")]
#[inline(never)]
fn connect() -> Option<(firmware::clock::Clock, &'static mut Links, autopilot::Uart)> {
    use firmware::port;
    use uav_relay::serial::{Pair, SerialLink};

    let (clock, upstream, downstream, uart) = wires::start()?;
    let links = cortex_m::singleton!(
        LINKS: Links =
            Pair::new(SerialLink::new(upstream, port::BAUD), SerialLink::new(downstream, port::BAUD))
    )?;
    Some((clock, links, uart))
}

#[cfg(target_os = "none")]
type Links = uav_relay::serial::Pair<firmware::port::Port, firmware::port::Port>;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405, with a serial port to each neighbour.\n\
         Flash it with: cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405\n\
         The head of examples/stm32f405/main.rs says how to configure a drone."
    );
}
