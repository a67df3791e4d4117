//! Link to the drone's autopilot, PX4 or ArduCopter: MAVLink 2 at 115 200 baud.
//!
//! It uses USART1: TX PA9, RX PA10.
//!
//! Used if the block has Tx and Rx positions; otherwise the port is never opened.

use core::cell::RefCell;

use cortex_m::interrupt::Mutex;
use cortex_m::singleton;
use stm32f4xx_hal::gpio::{PA9, PA10};
use stm32f4xx_hal::pac::{Interrupt, USART1, interrupt};
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::Serial;
use uav_relay::GuardConfig;
use uav_relay::flight::autopilot::Autopilot as Link;
use uav_relay::flight::autopilot::carrot::Pace;
#[cfg(feature = "mavlink-signing")]
use uav_relay::flight::autopilot::{Signing, Stamp};
use uav_relay::flight::course::Course;
use uav_relay::serial::SerialPort as _;
use uav_relay::{Duration, Event, Instant, Mission, Relay};

use crate::firmware::config::{self, Sites};
use crate::firmware::port::{self, OUTGOING, Port, Queues, Slot};
use crate::firmware::{board, chip, log};

/// Capacity of the receive queue, bytes: 44 ms of traffic, for bursts while the main loop is busy.
const RECEIVED: usize = 512;

/// Maximum position error of a hovering drone, m.
const POSITION_ERROR_M: f32 = 1.5;

/// Length of the longest frame to send, bytes.
const LONGEST: usize = Link::LONGEST_FRAME;

/// Pause before the next attempt to write to a port whose send queue is full. In this time the UART sends 115 bytes.
const PAUSE: Duration = Duration::from_millis(10);

static AUTOPILOT: Slot<USART1> = Mutex::new(RefCell::new(None));

pub(crate) type Uart = Serial<USART1>;

pub(crate) fn uart(usart: USART1, tx: PA9, rx: PA10, apb2_hz: u32, rcc: &mut Rcc) -> Option<Uart> {
    Serial::new(usart, (tx, rx), port::config(apb2_hz), rcc).ok()
}

pub(crate) struct Autopilot {
    link: Link,
    port: Port,
}

impl Autopilot {
    /// Returns the guard's settings `of`, with the position error and the stopping time of this drone.
    #[expect(
        clippy::unnecessary_wraps,
        reason = "an image that does not fly has none"
    )]
    pub(crate) fn guard(sites: &Sites, of: GuardConfig) -> Option<GuardConfig> {
        Some(GuardConfig {
            hover_m: POSITION_ERROR_M,
            lag: Pace::of_speed(sites.speed_m_s).stopping_time(),
            ..of
        })
    }

    /// Creates the autopilot link in static RAM, for the line from Tx to Rx in `sites`.
    ///
    /// `None` if the mission's distance differs from the length of this line.
    #[inline(never)] // frees its stack frame
    pub(crate) fn begin(
        uart: Uart,
        sites: &Sites,
        mission: &Mission,
        now: Instant,
    ) -> Option<&'static mut Self> {
        let course = Course::try_new(sites.on_earth(), sites.speed_m_s, mission);
        let course = course.map_err(log::off_course).ok()?;
        log::flies(&course);
        Self::along(&course, uart, now)
    }

    /// Creates the autopilot link for a course: a line on earth and a speed limit.
    ///
    /// The caller computes the course, so that this function needs less stack.
    #[inline(never)]
    fn along(course: &Course, uart: Uart, now: Instant) -> Option<&'static mut Self> {
        let port = open(uart)?;
        let autopilot = singleton!(LINK: Autopilot = Autopilot {
            link: Link::new(course.axis, course.pace, now),
            port,
        })?;
        autopilot.link.set_seed(board::seed());
        sign(&mut autopilot.link, now).ok()?;
        if chip::was_hung() {
            // The queue is still empty, so it has room for this text.
            let _ = autopilot.link.send_text("relay: restarted by its watchdog");
        }
        Some(autopilot)
    }

    /// Processes bytes from the autopilot, and exchanges data with the relay.
    ///
    /// The relay's next frames then contain the drone's newest position.
    pub(crate) fn listen(&mut self, now: Instant, relay: &mut Relay) {
        self.receive(now);
        self.link.exchange(relay, now);
    }

    #[inline(never)] // frees its stack frame
    fn receive(&mut self, now: Instant) {
        let mut bytes = [0; 64];
        // Bytes that are received during this call wake the main loop again.
        for _ in 0..RECEIVED / bytes.len() {
            match self.port.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => {
                    let bytes = bytes.get(..count).unwrap_or_default();
                    self.link.handle_bytes(now, bytes);
                }
                // A lost byte makes the frame's checksum wrong.
                Err(_) => {}
            }
        }
    }

    /// Shows an event of the relay to the autopilot's operator.
    pub(crate) fn handle_event(&mut self, event: Event) {
        self.link.handle_event(event);
    }

    /// Sends frames with the relay's setpoint to the autopilot. Returns the time by which the next call is due.
    ///
    /// `now` must be the time passed to the last call of [`listen`](Self::listen).
    pub(crate) fn fly(&mut self, now: Instant, relay: &mut Relay) -> Instant {
        // The relay's ports have been served since the last exchange. So this exchange sends the newest setpoint
        // without delay.
        self.link.exchange(relay, now);
        while let Some(event) = self.link.poll_event() {
            log::autopilot(event);
        }
        loop {
            if self.port.room() < LONGEST {
                return now + PAUSE;
            }
            let Some(frame) = self.link.poll_transmit(now) else {
                return self.link.poll_timeout(now);
            };
            // The port has room for a whole frame.
            let _ = self.port.write(&frame);
        }
    }
}

/// Opens the autopilot's port, served by its interrupt.
///
/// The queues are built on the stack before they are moved to static RAM. The function is not inlined, so that this
/// stack is freed.
#[inline(never)]
fn open(uart: Uart) -> Option<Port> {
    Some(port::open(
        uart,
        Interrupt::USART1,
        &AUTOPILOT,
        singleton!(AUTOPILOT_QUEUES: Queues<OUTGOING, RECEIVED> = Queues::new())?,
    ))
}

/// Error: the configuration block has a key for the autopilot, but this image cannot sign frames.
struct CannotSign;

/// Enables signed frames to the autopilot, if the configuration block has a key for it.
///
/// The board has no clock, so timestamps received from the autopilot give the time.
#[cfg(feature = "mavlink-signing")]
#[expect(clippy::unnecessary_wraps, reason = "as where it cannot")]
fn sign(link: &mut Link, now: Instant) -> Result<(), CannotSign> {
    if let Some(key) = config::autopilot_key(board::block()) {
        link.sign(Signing::new(key, 0, Stamp::UNKNOWN, now));
        log::signs_to_autopilot();
    }
    Ok(())
}

/// Returns an error if the configuration block has a key for the autopilot: this image cannot sign.
#[cfg(not(feature = "mavlink-signing"))]
fn sign(_: &mut Link, _: Instant) -> Result<(), CannotSign> {
    if config::autopilot_key(board::block()).is_none() {
        return Ok(());
    }
    log::cannot_sign_to_autopilot();
    Err(CannotSign)
}

#[interrupt]
fn USART1() {
    port::serve(&AUTOPILOT);
}
