//! What is flashed: a relay on an STM32F405 with a serial port to each neighbour.
//!
//! ```text
//! cargo build --profile firmware --target thumbv7em-none-eabihf --example stm32f405
//! cargo run   --profile firmware --target thumbv7em-none-eabihf --example stm32f405     # flashes, with probe-rs
//! ```
//! Every drone gets the same image. Which relay it is and what it flies stands in a sector of its own, written once and kept
//! by updates (relay 3 of 5, for instance):
//! ```text
//! cargo provision --uavs 5 --index 3 --network 7 --out relay3.bin
//! probe-rs download --chip STM32F405RGTx --binary-format bin --base-address 0x080E0000 relay3.bin
//! ```
//! A drone without that takes no part. With `--features defmt` the log says so, and whatever else happens.
//!
//! | file | one idea |
//! | --- | --- |
//! | `main.rs` | this variant, put together |
//! | `wires.rs` | its pins and interrupts |
//! | `drone.rs` | what a drone is by its configuration, whatever its links are |
//! | `turns.rs` | its main loop |
//! | `autopilot.rs`, `grounded.rs` | the autopilot with the feature `flight`, and without |
//! | `uploads.rs` | with the feature `upload`, the missions that were uploaded in flight |
//! | `kept.rs` | when they, and what the relay has said in votes, are written and read |
//! | `flash.rs` | the sectors of the logs of the crate `uav-relay-kept`, and everything unsafe about them |
//! | `port.rs` | a serial port that an interrupt serves |
//! | `chip.rs` | clocks, watchdog, cause of the last reset |
//! | `clock.rs` | time and sleep |
//! | `log.rs`, `silent.rs` | the log with `--features defmt`, and without |
//! | `sink_uart.rs`, `sink_rtt.rs` | where it goes: a spare UART, or the debug probe with `--features rtt` |
//! | `board.rs` | everything else unsafe |
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[cfg_attr(not(feature = "flight"), path = "grounded.rs")]
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
mod kept;
#[cfg(target_os = "none")]
#[cfg_attr(not(feature = "defmt"), path = "silent.rs")]
mod log;
#[cfg(target_os = "none")]
mod port;
#[cfg(target_os = "none")]
mod turns;
#[cfg(all(target_os = "none", feature = "upload"))]
#[expect(unreachable_pub, reason = "the tests on the ground have it public")]
mod uploads;
#[cfg(target_os = "none")]
mod wires;

#[cfg(target_os = "none")]
use uav_relay_block as config;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use uav_relay::Wiring;

    let Some((mut clock, links, uart)) = connect() else {
        board::stop()
    };
    // Without a configuration to fly by a drone sleeps for good.
    let Some(drone) = drone::begin(Wiring::Pair, uart, clock.now()) else {
        board::stop()
    };
    turns::fly(clock, links, drone)
}

/// The links, in a place of their own in RAM; a function of its own, so that the stack it needs is given back.
#[cfg(target_os = "none")]
#[inline(never)]
fn connect() -> Option<(clock::Clock, &'static mut Links, autopilot::Uart)> {
    use uav_relay::serial::{Pair, SerialLink, byte_time};

    let (clock, upstream, downstream, uart) = wires::start()?;
    let byte_time = byte_time(port::BAUD);
    let links = cortex_m::singleton!(
        LINKS: Links =
            Pair::new(SerialLink::new(upstream, byte_time), SerialLink::new(downstream, byte_time))
    )?;
    Some((clock, links, uart))
}

/// A port to each neighbour.
#[cfg(target_os = "none")]
type Links = uav_relay::serial::Pair<port::Port, port::Port>;

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405, with a serial port to each neighbour.\n\
         Flash it with: cargo run --profile firmware --target thumbv7em-none-eabihf --example stm32f405\n\
         The head of examples/stm32f405/main.rs says how to configure a drone."
    );
}
