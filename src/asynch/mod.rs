//! Relay on asynchronous serial ports ([`embedded_io_async`]). Like [`serial`](crate::serial), for an executor.
//!
//! | file | content |
//! | --- | --- |
//! | [`relay`] | a relay that several tasks share |
//! | [`link`] | time and timers of an executor; one port: reader, writer, pending frames, driver-enable pin |
//! | `autopilot` | with the feature `flight`: link to an autopilot on another port |
//! | this file | the relay and its ports: [`AsyncPair`] for [`Wiring::Pair`](crate::Wiring::Pair), [`AsyncShared`] for [`Wiring::Shared`](crate::Wiring::Shared) |
//!
//! # One future
//! `run` never completes. Spawn it as a task, or join it with other futures. Any executor that polls it when its waker
//! is called will do. Other tasks of the same executor share the [`AsyncRelay`]: [`with`](AsyncRelay::with) for
//! positions and samples, [`next_event`](AsyncRelay::next_event) for events. The time comes from a [`Clock`] of two
//! functions.
//!
//! # Independent ports
//! Each port has its reader and its writer, like the halves of an Embassy UART. A writer whose `write` never completes
//! does not delay the other port, the readers or the relay's timers. Two frames of full length are queued per port in
//! addition to the one being written. With [`AsyncPair`] a frame that does not fit is dropped and counted in
//! [`SerialStats::dropped`](crate::serial::SerialStats::dropped). With [`AsyncShared`] it stays in the relay.
//!
//! Each poll of the future reads every port once (64 bytes at most), handles one timeout
//! of the relay, and passes pending frames to the writers. After an operation that was ready at once it yields to the executor.
//!
//! # Cancellation
//! `run` may be dropped at any `await`, and called again with the same links.
//! - *Received bytes*: none are lost in `run`, because the relay gets them before the next `await`. A dropped `read`
//!   loses bytes with some readers, but not with Embassy's buffered UARTs.
//! - *Frames*: the frame being written is lost, and the next one starts with a delimiter, so that no receiver joins the
//!   two. Queued frames are still sent. The relay retransmits what matters.
//! - *Pin*: it keeps its level until the next `run` sets it.
//!
//! A failed write is retried in the same way: a delimiter, and the whole frame.
//!
//! # Example
//! A relay and a task of the firmware on one executor; the ports stand in for those of a HAL.
//! ```
//! use core::future::{Future, ready};
//! use embassy_futures::select::{Either, select};
//! use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, Clock};
//! use uav_relay::channel::{AirGround, Channel};
//! use uav_relay::{Band, Event, Identity, Instant, Interference, Interferer, Mission, MissionConfig, Profile, Relay, Settings};
//!
//! # struct Uart;
//! # impl embedded_io::ErrorType for Uart { type Error = core::convert::Infallible; }
//! # impl embedded_io_async::Read for Uart {
//! #     async fn read(&mut self, _: &mut [u8]) -> Result<usize, Self::Error> { core::future::pending().await }
//! # }
//! # impl embedded_io_async::Write for Uart {
//! #     async fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> { Ok(bytes.len()) }
//! #     async fn flush(&mut self) -> Result<(), Self::Error> { Ok(()) }
//! # }
//! struct Time; // on a board: `embassy_time::Instant::now` and `Timer::at`
//!
//! impl Clock for Time {
//!     fn now(&self) -> Instant {
//! #       use std::{sync::OnceLock, time::Instant as Wall};
//! #       static START: OnceLock<Wall> = OnceLock::new();
//! #       Instant::from_micros(START.get_or_init(Wall::now).elapsed().as_micros() as u64)
//! #       /*
//!         ...
//! #       */
//!     }
//!
//!     fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
//! #       core::future::poll_fn(move |cx| {
//! #           if self.now() >= at { return core::task::Poll::Ready(()); }
//! #           cx.waker().wake_by_ref();
//! #           core::task::Poll::Pending
//! #       })
//! #       /*
//!         ...
//! #       */
//!     }
//! }
//!
//! let mission = Mission::try_new(MissionConfig {
//!     relays: 1,
//!     distance_m: 1000.0,
//!     min_separation_m: 4.0,
//!     tx_power_w: 80.0,
//!     common: Profile { altitude_m: 20.0, power_w: 1.0 },
//!     channel: Channel::from_db(2e9, 0.1, 21.0, AirGround::Los)?,
//!     band: Band::at(20.0),
//!     lateral: Band::NONE,
//!     interference: Interference::Source(Interferer { power_w: 80.0, x_m: 500.0, y_m: 400.0 }),
//!     noise_w: 0.0,
//!     reverse: 0.0,
//!     rx_power_w: 80.0,
//!     fitted_gap: 0.0,
//!     tolerance: 1e-4,
//! })?;
//! let identity = Identity { network: 7, index: 1 };
//! let mut relay = Relay::new(mission, identity, Settings::wires(115_200), 1, Time.now())?;
//! let relay = AsyncRelay::new(&mut relay);
//! let link = || AsyncLink::new(Uart, Uart, 115_200); // the halves of a UART
//! let mut ports = AsyncPair::new(link(), link());
//!
//! let firmware = async {
//!     while relay.next_event().await != Event::SetpointChanged {}
//!     relay.look(|relay| relay.setpoint()).flatten()
//! };
//! let Either::Second(place) = embassy_futures::block_on(select(ports.run(&relay, &Time, |_| true), firmware)) else {
//!     unreachable!("`run` never completes")
//! };
//! assert!((place.expect("agreed on").x_m - 349.8).abs() < 0.1);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

#[cfg(feature = "flight")]
pub mod autopilot;
pub mod link;
pub mod relay;

use core::cell::RefCell;
use core::convert::Infallible;

use embassy_futures::select::{Either3, Either5, select, select3, select5};
use embassy_futures::yield_now;
use embedded_hal::digital::OutputPin;
use embedded_io_async::{Read, Write};

pub use self::link::Clock;
#[cfg(feature = "flight")]
pub use autopilot::AsyncAutopilot;
pub use link::AsyncLink;
pub use relay::AsyncRelay;

use self::link::Frames;
use crate::node::view::record::ViewRecord;
use crate::relay::{Port, Relay, Transmit};
use crate::serial::NoPin;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::frame::MAX_FRAME;
use link::track_pending;

/// Ports of a relay with two links, one to each neighbour. A link with a driver-enable pin is half duplex, a link
/// without a pin is full duplex.
#[derive(Debug)]
pub struct AsyncPair<UR, UW, DR, DW, UPin = NoPin, DPin = NoPin> {
    upstream: AsyncLink<UR, UW, UPin>,
    downstream: AsyncLink<DR, DW, DPin>,
}

impl<UR, UW, DR, DW, UPin, DPin> AsyncPair<UR, UW, DR, DW, UPin, DPin>
where
    UR: Read,
    UW: Write,
    DR: Read,
    DW: Write,
    UPin: OutputPin,
    DPin: OutputPin,
{
    /// Creates the ports of a relay with [`Wiring::Pair`](crate::Wiring::Pair). `upstream` leads toward the
    /// transmitter, `downstream` toward the receiver.
    pub const fn new(
        upstream: AsyncLink<UR, UW, UPin>,
        downstream: AsyncLink<DR, DW, DPin>,
    ) -> Self {
        Self {
            upstream,
            downstream,
        }
    }

    /// Moves bytes between the relay and its ports and handles the relay's timers, forever. The documentation of
    /// [`asynch`](self) describes the work per poll and the effect of dropping the future.
    ///
    /// `store` writes a [changed record](Relay::unpersisted) of the relay's votes to memory that survives a reboot, and
    /// returns true if the record is stored. Until then the relay sends nothing. Without such memory pass `|_| true`,
    /// and leave the relay off after a reboot in flight.
    pub async fn run(
        &mut self,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        mut store: impl FnMut(&ViewRecord) -> bool,
    ) -> Infallible {
        let (rx_up, tx_up, up) = self.upstream.ends(Port::Upstream, relay, clock);
        let (rx_down, tx_down, down) = self.downstream.ends(Port::Downstream, relay, clock);
        let queues = [(Port::Upstream, up), (Port::Downstream, down)];
        let runs = run_relay(relay, &queues, clock, &mut store);
        // The order matters: received bytes reach the relay in this poll, and the resulting frames are written in the
        // same poll.
        match select5(rx_up, rx_down, runs, tx_up, tx_down).await {
            Either5::First(never)
            | Either5::Second(never)
            | Either5::Third(never)
            | Either5::Fourth(never)
            | Either5::Fifth(never) => never,
        }
    }

    /// Returns the two links, so that their ports can be used again.
    pub fn release(self) -> (AsyncLink<UR, UW, UPin>, AsyncLink<DR, DW, DPin>) {
        (self.upstream, self.downstream)
    }
}

/// Port of a relay on a shared channel, on which every neighbour receives each frame. The port leads to a radio modem,
/// or to a half-duplex bus with a driver-enable pin.
///
/// The modem controls the access to the channel. This crate only keeps relays from retransmitting at the same times.
#[derive(Debug)]
pub struct AsyncShared<R, W, Pin = NoPin> {
    channel: AsyncLink<R, W, Pin>,
}

impl<R: Read, W: Write, Pin: OutputPin> AsyncShared<R, W, Pin> {
    /// Creates the port of a relay with [`Wiring::Shared`](crate::Wiring::Shared).
    pub const fn new(channel: AsyncLink<R, W, Pin>) -> Self {
        Self { channel }
    }

    /// Moves bytes between the relay and its shared port and handles the relay's timers, forever. The parameters are
    /// those of [`AsyncPair::run`].
    pub async fn run(
        &mut self,
        relay: &AsyncRelay<'_>,
        clock: &impl Clock,
        mut store: impl FnMut(&ViewRecord) -> bool,
    ) -> Infallible {
        let (receives, sends, queue) = self.channel.ends(Port::Shared, relay, clock);
        let queues = [(Port::Shared, queue)];
        let runs = run_relay(relay, &queues, clock, &mut store);
        match select3(receives, runs, sends).await {
            Either3::First(never) | Either3::Second(never) | Either3::Third(never) => never,
        }
    }

    /// Returns the link, so that its reader, writer and pin can be used again.
    pub fn release(self) -> AsyncLink<R, W, Pin> {
        self.channel
    }
}

/// Handles the timers of the relay and queues its frames for the ports, forever.
async fn run_relay(
    relay: &AsyncRelay<'_>,
    queues: &[(Port, &RefCell<Frames>)],
    clock: &impl Clock,
    store: &mut dyn FnMut(&ViewRecord) -> bool,
) -> Infallible {
    loop {
        relay.mark_handled();
        let now = clock.now();
        let wake = relay.lend(|of| turn(of, now, relay, queues, store));
        relay.notify_listener();
        let waited = match wake.flatten() {
            Some(wake) => {
                track_pending(select(relay.changed(), clock.sleep_until(wake)))
                    .await
                    .1
            }
            None => track_pending(relay.changed()).await.1,
        };
        if !waited {
            yield_now().await;
        }
    }
}

/// Handles the relay's due timers, stores its votes on views after a change, and queues its frames.
///
/// Returns the time of the relay's next timeout; `None` if there is none.
fn turn(
    of: &mut Relay,
    now: Instant,
    relay: &AsyncRelay<'_>,
    queues: &[(Port, &RefCell<Frames>)],
    store: &mut dyn FnMut(&ViewRecord) -> bool,
) -> Option<Instant> {
    if of.poll_timeout().is_some_and(|at| at <= now) {
        of.handle_timeout(now);
    }
    of.persist(store);
    let mut frame = [0; MAX_FRAME];
    let has_room = |(_, queue): &(Port, &RefCell<Frames>)| {
        queue.try_borrow().is_ok_and(|queue| queue.has_room())
    };
    // A port without room must not delay the other port. So a frame for it is counted and dropped.
    while queues.iter().any(has_room)
        && let Some(Transmit { port, len }) = of.poll_transmit(now, &mut frame)
    {
        let frame = frame.get(..len).unwrap_or_default();
        if let Some((_, queue)) = queues.iter().find(|(at, _)| *at == port) {
            if !queue
                .try_borrow_mut()
                .is_ok_and(|mut queue| queue.push(frame))
            {
                relay.count(port, |stats| bump(&mut stats.dropped));
            }
        } else {
            relay.count(port, |stats| bump(&mut stats.unrouted));
        }
    }
    of.poll_timeout()
}
