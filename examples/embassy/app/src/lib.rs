//! Application of every board here: creates the relay from the configuration block, and runs its ports.
//!
//! It also logs events and setpoints.
//!
//! | file | content |
//! | --- | --- |
//! | [`board`] | hardware of a board besides its ports: block, seed, flash |
//! | [`drone`] | drone as defined by its block; reasons why it takes no part |
//! | `votes` | votes of the relay, persisted across a reboot |
//! | `log` | log lines |
//! | `lib.rs` | application for wires and for a radio |
//!
//! With a key in the block the relay signs; the epoch in the board's flash rises at every start. With Tx and Rx
//! positions it flies an autopilot, PX4 or ArduCopter, on a port of its own, and the guard keeps drones apart. Votes
//! survive a reboot in flight. Uploads do not; with `examples/stm32f405` they do.
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
use static_cell::StaticCell;
use uav_relay::asynch::{AsyncAutopilot, AsyncLink, AsyncPair, AsyncRelay, AsyncShared, Clock};
use uav_relay::{Instant, Relay, ViewRecord, Wiring};
use uav_relay_chip::watchdog;

use board::Board;
use drone::{Drone, DroneStorage, Refused};

/// Bit rate of every port, bit/s, 8N1.
pub use uav_relay_block::BAUD;

/// Size of a UART driver's buffers, bytes: 22 ms of traffic. A call of the relay takes at most 3 ms, so no byte is
/// lost.
pub const BUFFER: usize = 256;

/// Clock of the relay, based on Embassy's time driver.
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

/// Size of the receive buffer of the autopilot's UART, bytes. An autopilot sends bursts.
pub const BURST: usize = 512;

/// Static buffers of a UART driver: [`BUFFER`] bytes to send, `IN` bytes to receive.
pub struct Buffers<const IN: usize = BUFFER> {
    sent: StaticCell<[u8; BUFFER]>,
    received: StaticCell<[u8; IN]>,
}

impl<const IN: usize> Buffers<IN> {
    /// Creates buffers that no UART driver uses yet.
    #[expect(clippy::new_without_default, reason = "they are statics")]
    pub const fn new() -> Self {
        Self {
            sent: StaticCell::new(),
            received: StaticCell::new(),
        }
    }

    /// Returns the send buffer and the receive buffer. Panics at a second call.
    pub fn take(&'static self) -> (&'static mut [u8], &'static mut [u8]) {
        (self.sent.init([0; BUFFER]), self.received.init([0; IN]))
    }
}

/// Interval at which the watchdog is fed, unless the relay's timers are late.
pub const TURN: Duration = Duration::from_millis(watchdog::TURN_MS);

/// Feeds the watchdog every [`TURN`], forever. For a drone that does not join the chain.
pub async fn rest(mut feed: impl FnMut()) -> Infallible {
    loop {
        feed();
        Timer::after(TURN).await;
    }
}

/// Feeds the watchdog every [`TURN`], forever, unless the relay's timers are late. See [`watchdog::may_feed`].
///
/// This future runs in the task of the ports and timers. If that task hangs, panics or faults, the feeding stops.
async fn watch(relay: &AsyncRelay<'_>, feed: &mut dyn FnMut()) -> Infallible {
    loop {
        let now = EmbassyClock.now().as_micros();
        let due = |relay: &Relay| relay.poll_timeout().map(Instant::as_micros);
        if relay
            .look(due)
            .is_some_and(|due| watchdog::may_feed(now, due))
        {
            feed();
        }
        Timer::after(TURN).await;
    }
}

/// Runs the relay of `board` on a UART to each neighbour, and on a UART to the autopilot, if any.
///
/// If the drone joins the chain, this never completes. While the relay makes progress, `feed` is called every [`TURN`].
///
/// # Errors
/// The reason why the drone does not join the chain. It is also logged.
pub async fn fly<F: NorFlash, UR: Read, UW: Write, DR: Read, DW: Write, AR: Read, AW: Write>(
    store: &'static mut DroneStorage,
    board: Board<F>,
    (up_rx, up_tx): (UR, UW),
    (down_rx, down_tx): (DR, DW),
    autopilot: Option<(AR, AW)>,
    feed: &mut dyn FnMut(),
) -> Result<Infallible, Refused> {
    let mut ports = AsyncPair::new(
        AsyncLink::new(up_rx, up_tx, BAUD),
        AsyncLink::new(down_rx, down_tx, BAUD),
    );
    fly_over(
        store,
        board,
        Wiring::Pair,
        autopilot,
        feed,
        async |relay, store| ports.run(relay, &EmbassyClock, store).await,
    )
    .await
}

/// Runs the relay of `board` on one radio that all relays share. `pin` is high while this relay sends.
///
/// # Errors
/// Those of [`fly`].
pub async fn fly_shared<F: NorFlash, R: Read, W: Write, D: OutputPin, AR: Read, AW: Write>(
    store: &'static mut DroneStorage,
    board: Board<F>,
    (rx, tx): (R, W),
    pin: D,
    autopilot: Option<(AR, AW)>,
    feed: &mut dyn FnMut(),
) -> Result<Infallible, Refused> {
    let mut ports = AsyncShared::new(AsyncLink::half_duplex(rx, tx, BAUD, pin));
    fly_over(
        store,
        board,
        Wiring::Shared,
        autopilot,
        feed,
        async |relay, store| ports.run(relay, &EmbassyClock, store).await,
    )
    .await
}

/// Runs the relay of `board` on the ports that the function `run` reads and writes.
///
/// Changed votes on the chain's membership are stored before the relay sends.
async fn fly_over<F: NorFlash, AR: Read, AW: Write>(
    store: &'static mut DroneStorage,
    board: Board<F>,
    wiring: Wiring,
    autopilot: Option<(AR, AW)>,
    feed: &mut dyn FnMut(),
    run: impl AsyncFnOnce(&AsyncRelay<'_>, &mut dyn FnMut(&ViewRecord) -> bool) -> Infallible,
) -> Result<Infallible, Refused> {
    let drone = drone::begin(
        store,
        board,
        wiring,
        autopilot.is_some(),
        EmbassyClock.now(),
    );
    let Drone {
        relay,
        mut votes,
        autopilot: link,
    } = drone.inspect_err(|why| log::refused(*why))?;
    let relay = AsyncRelay::new(relay);
    let mut store = |record: &ViewRecord| {
        if let Some(votes) = &mut votes {
            votes.store(record);
        }
        true
    };
    let runs = run(&relay, &mut store);
    let beside = beside(&relay, link.as_ref(), autopilot);
    Ok(join3(runs, beside, watch(&relay, feed)).await.0)
}

/// Logs events, and serves the autopilot's port, if any, forever.
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
