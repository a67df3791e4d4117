//! Serial driver of a relay: moves bytes between a [`Relay`] and one or two ports without blocking.
//!
//! | file | content |
//! | --- | --- |
//! | [`port`] | a port that never blocks, based on [`embedded_hal_nb`] ([`Nb`]) or [`embedded_io`] ([`Io`]) |
//! | [`link`] | one port with its transmit queue, driver-enable pin and error counters |
//! | [`queue`] | queues between an interrupt and the main loop, for a UART that holds one byte |
//! | this one | the relay and its links: [`Pair`] for [`Wiring::Pair`](crate::Wiring::Pair), [`Shared`] for
//! [`Wiring::Shared`](crate::Wiring::Shared) |
//!
//! # One call
//! `poll` reads up to 64 bytes per port into the relay, lets it handle due timers, polls its frames, and writes as many
//! bytes as fit. Afterwards poll the relay's events, and sleep until the returned time or until a byte is received,
//! whichever is first. The time is always later than `now`. If bytes must still be written or read, or a pin must be
//! set low, it is one byte time ahead, which keeps a UART without a FIFO busy. A port that accepts nothing is tried
//! less and less often, at last every 128 byte times. If the port can, let it wake the main loop when it accepts bytes
//! again.
//!
//! # A UART that holds one byte
//! Between two polls a relay may compute for 3 ms (16 MHz), and at 115 200 baud a byte lasts 87 us. A UART without a FIFO or DMA
//! needs an interrupt that moves the bytes: [`ByteQueues`] has both ends, and [`queue_depth`] returns the required depth. For
//! asynchronous ports use `asynch` (feature `async`).
//!
//! # Full queues
//! A link has room for two frames of maximum length. A frame that does not fit is dropped and counted in
//! [`SerialStats::dropped`], because the other neighbour must not wait for a port that accepts nothing. With one shared
//! port no frame is dropped; frames stay in the relay until there is room. Errors of the ports are counted, never
//! returned.
//!
//! # Example
//! Main loop of a firmware, with a substitute for the HAL's port. A HAL with ports of an older `embedded_io` (such as 0.6) can be
//! used through its [`embedded_hal_nb`] traits.
//! ```
//! use uav_relay::channel::{AirGround, Channel};
//! use uav_relay::serial::{Nb, Pair, SerialLink};
//! use uav_relay::{Band, Event, Identity, Instant, Interference, Interferer, Mission, MissionConfig, Profile, Relay, Settings};
//! use embedded_hal_nb::{nb, serial};
//!
//! #[derive(Default)]
//! struct Uart {
//!     sent: Vec<u8>,
//! }
//!
//! impl serial::ErrorType for Uart {
//!     type Error = serial::ErrorKind;
//! }
//!
//! impl serial::Read<u8> for Uart {
//!     fn read(&mut self) -> nb::Result<u8, Self::Error> {
//!         Err(nb::Error::WouldBlock) // nobody there
//!     }
//! }
//!
//! impl serial::Write<u8> for Uart {
//!     fn write(&mut self, byte: u8) -> nb::Result<(), Self::Error> {
//!         self.sent.push(byte);
//!         Ok(())
//!     }
//!     fn flush(&mut self) -> nb::Result<(), Self::Error> {
//!         Ok(())
//!     }
//! }
//!
//! let mission = Mission::try_new(MissionConfig {
//!     relays: 2,
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
//! let mut now = Instant::ZERO; // a firmware reads its clock
//! let mut relay = Relay::new(mission, identity, Settings::wires(115_200), 1, now)?;
//! let link = || SerialLink::new(Nb(Uart::default()), 115_200);
//! let mut ports = Pair::new(link(), link());
//!
//! while now < Instant::from_millis(100) {
//!     let wake = ports.poll(now, &mut relay, |_| true);
//!     while let Some(event) = relay.poll_event() {
//!         if event == Event::SetpointChanged {
//!             // hand relay.setpoint() to the autopilot
//!         }
//!     }
//!     // Sleep until `wake` or the next byte.
//!     now = wake.expect("a relay with a neighbour always has a timer");
//! }
//! assert_eq!(ports.downstream.port_mut().0.sent.last(), Some(&0), "a whole sweep has left");
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

pub mod link;
pub mod port;
pub mod queue;

use embedded_hal::digital::OutputPin;

#[doc(hidden)]
pub use link::READ_LIMIT;
pub use link::SerialStats;
#[cfg(feature = "async")]
pub(crate) use link::byte_time;
pub use link::{NoPin, SerialLink};
pub use port::{Fault, Io, Nb, SerialPort};
pub use queue::{ByteQueues, InterruptEnd, Pend, QueuedPort, queue_depth};

use crate::node::view::record::ViewRecord;
use crate::relay::{Port, Relay, Transmit};
use crate::time::Instant;
use crate::wire::frame::MAX_FRAME;
use link::FrameLink;

/// Ports of a relay with two links, one to each neighbour.
///
/// A link with a driver-enable pin is half duplex, a link without a pin is full duplex.
#[derive(Debug)]
pub struct Pair<U, D, UPin = NoPin, DPin = NoPin> {
    /// Serial link to the neighbour toward the transmitter.
    pub upstream: SerialLink<U, UPin>,
    /// Serial link to the neighbour toward the receiver.
    pub downstream: SerialLink<D, DPin>,
}

impl<U: SerialPort, D: SerialPort, UPin: OutputPin, DPin: OutputPin> Pair<U, D, UPin, DPin> {
    /// Creates the ports of a relay with [`Wiring::Pair`](crate::Wiring::Pair), from its two links.
    pub const fn new(upstream: SerialLink<U, UPin>, downstream: SerialLink<D, DPin>) -> Self {
        Self {
            upstream,
            downstream,
        }
    }

    const fn links(&mut self) -> [(Port, &mut dyn FrameLink); 2] {
        [
            (Port::Upstream, &mut self.upstream),
            (Port::Downstream, &mut self.downstream),
        ]
    }
}

/// Port of a relay on one channel that all neighbours receive. The channel is a radio modem, or a half-duplex bus with
/// a driver-enable pin.
///
/// The modem controls the access to the channel. This crate only keeps relays from retransmitting at the same times.
#[derive(Debug)]
pub struct Shared<P, Pin = NoPin> {
    /// Serial link to the modem of the channel that all nodes share.
    pub channel: SerialLink<P, Pin>,
}

impl<P: SerialPort, Pin: OutputPin> Shared<P, Pin> {
    /// Creates the port of a relay with [`Wiring::Shared`](crate::Wiring::Shared).
    pub const fn new(channel: SerialLink<P, Pin>) -> Self {
        Self { channel }
    }

    const fn links(&mut self) -> [(Port, &mut dyn FrameLink); 1] {
        [(Port::Shared, &mut self.channel)]
    }
}

/// Defines the method `poll` for the ports of one kind of wiring.
macro_rules! polled {
    ([$($of:tt)*] $ports:ty) => {
        impl<$($of)*> $ports {
            /// Moves all bytes that can be moved. Returns the time by which `poll` must be called again, always later
            /// than `now`.
            ///
            /// Work: at most 64 bytes per port through [`Relay::handle_bytes`], one [`Relay::handle_timeout`], and the
            /// relay's pending frames; for a shared port, as many as fit.
            ///
            /// `store` writes a [changed record](Relay::unpersisted) to memory that survives a reboot, and returns true
            /// if it is stored. Until then the relay sends nothing. Without such memory pass `|_| true`, and leave the
            /// relay off after a reboot in flight.
            pub fn poll(
                &mut self,
                now: Instant,
                relay: &mut Relay,
                mut store: impl FnMut(&ViewRecord) -> bool,
            ) -> Option<Instant> {
                poll(now, relay, &mut self.links(), &mut store)
            }
        }
    };
}

polled!([U: SerialPort, D: SerialPort, UPin: OutputPin, DPin: OutputPin] Pair<U, D, UPin, DPin>);
polled!([P: SerialPort, Pin: OutputPin] Shared<P, Pin>);

fn poll(
    now: Instant,
    relay: &mut Relay,
    links: &mut [(Port, &mut dyn FrameLink)],
    store: &mut dyn FnMut(&ViewRecord) -> bool,
) -> Option<Instant> {
    for (port, link) in &mut *links {
        link.receive(now, *port, relay);
    }
    if relay.poll_timeout().is_some_and(|at| at <= now) {
        relay.handle_timeout(now);
    }
    relay.persist(store);
    let mut frame = [0; MAX_FRAME];
    // A link without room must not block the other link, so the frames for it are counted and dropped.
    while links.iter().any(|(_, link)| link.has_room())
        && let Some(Transmit { port, len }) = relay.poll_transmit(now, &mut frame)
    {
        let frame = frame.get(..len).unwrap_or_default();
        match links.iter_mut().find(|(at, _)| *at == port) {
            Some((_, link)) => link.queue(now, frame),
            None => {
                if let Some((_, link)) = links.first_mut() {
                    link.unrouted();
                }
            }
        }
    }
    for (_, link) in &mut *links {
        link.transmit(now);
    }
    links
        .iter()
        .filter_map(|(_, link)| link.wake(now))
        .chain(relay.poll_timeout())
        .min()
}
