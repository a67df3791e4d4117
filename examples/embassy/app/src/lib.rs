//! The application of every board here: it reads the configuration block, makes the relay, runs its ports, and logs where to fly.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`board`] | what a board brings beside its ports: its block, a seed, a flash |
//! | [`drone`] | what a drone is by its block; why it takes no part |
//! | `log` | what is logged |
//! | this one | all of it together, for wires and for a radio |
//!
//! With a key in the block the relay signs, by an epoch in the board's flash that rises at every start. What it does not have: an autopilot,
//! votes that survive a reboot in flight, and uploads that do. `examples/stm32f405` has all three.
#![no_std]
#![forbid(unsafe_code)]

pub mod board;
pub mod drone;
mod log;

use core::convert::Infallible;
use core::future::Future;

use embassy_futures::join::join;
use embassy_time::Timer;
use embedded_hal::digital::OutputPin;
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, AsyncShared, Clock};
use uav_relay::serial::byte_time;
use uav_relay::{Instant, Wiring};

use board::Board;
use drone::{Refused, Room};

/// Bits a second on every port, 8N1.
pub use uav_relay_block::BAUD;

/// Bytes that the driver of a UART holds each way: 22 ms of them, where a call of the relay takes 3.
pub const BUFFER: usize = 256;

/// Embassy's clock.
#[derive(Clone, Copy, Debug)]
pub struct EmbassyClock;

impl Clock for EmbassyClock {
    fn now(&self) -> Instant {
        Instant::from_micros(embassy_time::Instant::now().as_micros())
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        Timer::at(embassy_time::Instant::from_micros(at.as_micros()))
    }
}

/// Flies the relay of `board` with a UART to each neighbour, given as reader and writer. It never completes where it takes part.
///
/// # Errors
/// Why it takes no part, which is logged.
pub async fn fly<F: NorFlash, UR: Read, UW: Write, DR: Read, DW: Write>(
    room: &'static mut Room,
    mut board: Board<F>,
    (up_rx, up_tx): (UR, UW),
    (down_rx, down_tx): (DR, DW),
) -> Result<Infallible, Refused> {
    let relay = drone::begin(room, &mut board, Wiring::Pair, EmbassyClock.now());
    let relay = AsyncRelay::new(relay.inspect_err(|why| log::refused(*why))?);
    let mut ports = AsyncPair::new(
        AsyncLink::new(up_rx, up_tx, byte_time(BAUD)),
        AsyncLink::new(down_rx, down_tx, byte_time(BAUD)),
    );
    Ok(join(ports.run(&relay, &EmbassyClock), log::events(&relay))
        .await
        .0)
}

/// The same with one UART to a radio that all relays share; `pin` is high while this one sends.
///
/// # Errors
/// As [`fly`].
pub async fn fly_shared<F: NorFlash, R: Read, W: Write, D: OutputPin>(
    room: &'static mut Room,
    mut board: Board<F>,
    (rx, tx): (R, W),
    pin: D,
) -> Result<Infallible, Refused> {
    let relay = drone::begin(room, &mut board, Wiring::Shared, EmbassyClock.now());
    let relay = AsyncRelay::new(relay.inspect_err(|why| log::refused(*why))?);
    let mut ports = AsyncShared::new(AsyncLink::half_duplex(rx, tx, byte_time(BAUD), pin));
    Ok(join(ports.run(&relay, &EmbassyClock), log::events(&relay))
        .await
        .0)
}
