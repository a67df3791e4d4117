//! The application of every board here: it reads the configuration block, makes the relay, runs its ports, and logs where to fly.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`board`] | what a board brings beside its ports: its block, a seed, a flash |
//! | [`drone`] | what a drone is by its block; why it takes no part |
//! | `votes` | what the relay has said in votes, kept across a reboot |
//! | `log` | what is logged |
//! | this one | all of it together, for wires and for a radio |
//!
//! With a key in the block the relay signs, by an epoch in the board's flash that rises at every start. With sites in it an autopilot, a PX4 or
//! ArduCopter on a port of its own, is told where to fly, and the guard keeps drones apart. What it has said in votes survives a reboot in
//! flight. What it does not have: uploads that do, which `examples/stm32f405` has.
#![no_std]
#![forbid(unsafe_code)]

pub mod board;
pub mod drone;
mod log;
mod votes;

use core::convert::Infallible;
use core::future::Future;

use embassy_futures::join::join3;
use embassy_time::{Duration, Timer};
use embedded_hal::digital::OutputPin;
use embedded_io_async::{Read, Write};
use embedded_storage::nor_flash::NorFlash;
use uav_relay::asynch::{AsyncAutopilot, AsyncLink, AsyncPair, AsyncRelay, AsyncShared, Clock};
use uav_relay::serial::byte_time;
use uav_relay::{Instant, Relay, Wiring};
use uav_relay_chip::watchdog;

use board::Board;
use drone::{Drone, Refused, Room};

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

/// Bytes that the driver of an autopilot's UART holds of what comes in: it sends bursts.
pub const BURST: usize = 512;

/// Longest time between two feedings of the watchdog while the relay makes progress.
pub const TURN: Duration = Duration::from_millis(watchdog::TURN_MS);

/// A timer of the relay may be overdue for so long.
const LATE: uav_relay::Duration = uav_relay::Duration::from_millis(watchdog::LATE_MS);

/// Calls `feed` every [`TURN`], for a board that takes no part: the watchdog restarts nobody whose configuration is refused.
pub async fn rest(mut feed: impl FnMut()) -> Infallible {
    loop {
        feed();
        Timer::after(TURN).await;
    }
}

/// Calls `feed` every [`TURN`] while the relay's timers are served. It is a part of the task that serves ports and timers, so a turn of that task that
/// does not end, a panic and a fault feed nobody.
async fn watch(relay: &AsyncRelay<'_>, feed: &mut dyn FnMut()) -> Infallible {
    loop {
        let now = EmbassyClock.now();
        let served = |relay: &Relay| relay.poll_timeout().is_none_or(|due| now < due + LATE);
        if relay.look(served) == Some(true) {
            feed();
        }
        Timer::after(TURN).await;
    }
}

/// Flies the relay of `board` with a UART to each neighbour, given as reader and writer, and one to the autopilot if the board has one to
/// spare. It never completes where it takes part, and calls `feed`, the watchdog's, every [`TURN`] while the relay makes progress.
///
/// # Errors
/// Why it takes no part, which is logged.
pub async fn fly<F: NorFlash, UR: Read, UW: Write, DR: Read, DW: Write, AR: Read, AW: Write>(
    room: &'static mut Room,
    board: Board<F>,
    (up_rx, up_tx): (UR, UW),
    (down_rx, down_tx): (DR, DW),
    autopilot: Option<(AR, AW)>,
    feed: &mut dyn FnMut(),
) -> Result<Infallible, Refused> {
    let Drone {
        relay,
        mut votes,
        autopilot: link,
    } = begin(room, board, Wiring::Pair, autopilot.is_some())?;
    let relay = AsyncRelay::new(relay);
    let mut ports = AsyncPair::new(
        AsyncLink::new(up_rx, up_tx, byte_time(BAUD)),
        AsyncLink::new(down_rx, down_tx, byte_time(BAUD)),
    );
    let beside = beside(&relay, link.as_ref(), autopilot);
    let mut keep = |relay: &Relay| votes.iter_mut().for_each(|votes| votes.keep(relay));
    let runs = ports.run_keeping(&relay, &EmbassyClock, &mut keep);
    Ok(join3(runs, beside, watch(&relay, feed)).await.0)
}

/// The same with one UART to a radio that all relays share; `pin` is high while this one sends.
///
/// # Errors
/// As [`fly`].
pub async fn fly_shared<F: NorFlash, R: Read, W: Write, D: OutputPin, AR: Read, AW: Write>(
    room: &'static mut Room,
    board: Board<F>,
    (rx, tx): (R, W),
    pin: D,
    autopilot: Option<(AR, AW)>,
    feed: &mut dyn FnMut(),
) -> Result<Infallible, Refused> {
    let Drone {
        relay,
        mut votes,
        autopilot: link,
    } = begin(room, board, Wiring::Shared, autopilot.is_some())?;
    let relay = AsyncRelay::new(relay);
    let mut ports = AsyncShared::new(AsyncLink::half_duplex(rx, tx, byte_time(BAUD), pin));
    let beside = beside(&relay, link.as_ref(), autopilot);
    let mut keep = |relay: &Relay| votes.iter_mut().for_each(|votes| votes.keep(relay));
    let runs = ports.run_keeping(&relay, &EmbassyClock, &mut keep);
    Ok(join3(runs, beside, watch(&relay, feed)).await.0)
}

fn begin<F: NorFlash>(
    room: &'static mut Room,
    board: Board<F>,
    wiring: Wiring,
    flies: bool,
) -> Result<Drone<F>, Refused> {
    let now = EmbassyClock.now();
    drone::begin(room, board, wiring, flies, now).inspect_err(|why| log::refused(*why))
}

/// What runs beside the ports of the relay: the autopilot's, of a drone with sites, and the log.
async fn beside<R: Read, W: Write>(
    relay: &AsyncRelay<'_>,
    link: Option<&AsyncAutopilot>,
    port: Option<(R, W)>,
) -> Infallible {
    match (link, port) {
        (Some(link), Some((mut rx, mut tx))) => {
            let flies = link.run(relay, &EmbassyClock, &mut rx, &mut tx);
            let logs = log::events(relay, Some(link));
            join3(flies, logs, log::autopilot(link)).await.0
        }
        _ => log::events(relay, None).await,
    }
}
