//! The drone's autopilot, a PX4 or ArduCopter, at USART1: TX PA9, RX PA10, 115 200 baud, MAVLink 2.
//!
//! It is told where to fly by a drone whose block has sites; without them the port is never opened.

use core::cell::RefCell;

use cortex_m::interrupt::Mutex;
use cortex_m::singleton;
use stm32f4xx_hal::gpio::{PA9, PA10};
use stm32f4xx_hal::pac::{Interrupt, USART1, interrupt};
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::Serial;
use uav_relay::GuardConfig;
use uav_relay::flight::autopilot::Autopilot as Link;
use uav_relay::flight::autopilot::FrameBytes;
use uav_relay::flight::autopilot::carrot::Pace;
#[cfg(feature = "mavlink-signing")]
use uav_relay::flight::autopilot::{Signing, Stamp};
#[cfg(feature = "upload")]
use uav_relay::flight::axis::Axis;
use uav_relay::flight::course::Course;
use uav_relay::serial::SerialPort as _;
use uav_relay::{Duration, Event, Instant, Mission, Relay, Side};

use super::config::{self, Sites};
use super::port::{self, OUTGOING, Port, Queues, Slot};
use super::{board, chip, log};

/// Received bytes that can wait for the main loop: 44 ms of them. An autopilot sends bursts, and the main loop may be in a sweep.
const RECEIVED: usize = 512;

/// How far off its place a hovering drone may be reported, m.
const POSITION_ERROR_M: f32 = 1.5;

/// The longest frame that is sent.
const LONGEST: usize = size_of::<FrameBytes>();

/// So long a full port is left alone; 115 bytes leave meanwhile.
const PAUSE: Duration = Duration::from_millis(10);

static AUTOPILOT: Slot<USART1> = Mutex::new(RefCell::new(None));

/// The port that nobody serves yet.
pub(crate) type Uart = Serial<USART1>;

/// Sets the port up.
pub(crate) fn uart(usart: USART1, tx: PA9, rx: PA10, apb2_hz: u32, rcc: &mut Rcc) -> Option<Uart> {
    Serial::new(usart, (tx, rx), port::config(apb2_hz), rcc).ok()
}

/// The link, and what it goes over.
pub(crate) struct Autopilot {
    link: Link,
    /// The sites of the block, and those between which it flies.
    #[cfg(feature = "upload")]
    loaded: uav_relay::Sites,
    #[cfg(feature = "upload")]
    between: uav_relay::Sites,
    port: Port,
    /// What the relay was told last of whether its setpoint is flown.
    flown: Option<bool>,
    /// The SIR that the hop to this relay is to reach, as a factor and in decibels.
    target: Option<(f32, f32)>,
}

impl Autopilot {
    /// Returns the rest of a guard: how far off its place a hovering drone may be reported, m, and how long it takes to stop.
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

    /// The link along the line between `sites`, in a place of its own in RAM; `None` where the mission is not flown there.
    #[inline(never)] // its stack is given back
    pub(crate) fn begin(
        uart: Uart,
        sites: &Sites,
        mission: &Mission,
        now: Instant,
    ) -> Option<&'static mut Self> {
        let course = Course::try_new(sites.on_earth(), sites.speed_m_s, mission);
        let course = course.map_err(log::off_course).ok()?;
        log::flies(&course);
        Self::along(&course, uart, sites, now)
    }

    /// The link along that course: apart, so that what it is made on is not on the stack while the course is computed.
    #[inline(never)]
    fn along(
        course: &Course,
        uart: Uart,
        #[cfg_attr(
            not(feature = "upload"),
            expect(unused_variables, reason = "nothing moves them")
        )]
        sites: &Sites,
        now: Instant,
    ) -> Option<&'static mut Self> {
        let port = open(uart)?;
        #[cfg(feature = "upload")]
        let loaded = sites.on_earth();
        let autopilot = singleton!(LINK: Autopilot = Autopilot {
            link: Link::new(course.axis, course.pace, now),
            #[cfg(feature = "upload")]
            loaded,
            #[cfg(feature = "upload")]
            between: loaded,
            port,
            flown: None,
            target: None,
        })?;
        autopilot.link.set_seed(board::seed());
        sign(&mut autopilot.link, now).ok()?;
        if chip::was_hung() {
            // There is room for the first line.
            let _ = autopilot.link.say("relay: restarted by its watchdog");
        }
        Some(autopilot)
    }

    /// Between the sites of a mission that has just been adopted, before anything is told that is along its line.
    #[cfg(feature = "upload")]
    #[inline(never)] // its stack is given back
    fn follow(&mut self, now: Instant, relay: &Relay) {
        let sites = relay.sites().unwrap_or(self.loaded);
        if sites == self.between {
            return;
        }
        self.between = sites;
        // The relay has found that they make a line.
        if let Ok(axis) = Axis::between(sites) {
            self.link.fly_along(now, axis);
        }
    }

    /// Takes what has come, and hands the relay what follows from it.
    #[inline(never)] // its stack is given back
    pub(crate) fn listen(&mut self, now: Instant, relay: &mut Relay) {
        #[cfg(feature = "upload")]
        self.follow(now, relay);
        let mut bytes = [0; 64];
        // What comes meanwhile wakes the main loop again.
        for _ in 0..RECEIVED / bytes.len() {
            match self.port.read(&mut bytes) {
                Ok(0) => break,
                Ok(count) => {
                    let bytes = bytes.get(..count).unwrap_or_default();
                    self.link.handle_bytes(now, bytes);
                }
                // The checksum tells of a byte that is lost.
                Err(_) => {}
            }
        }
        self.link.handle_timeout(now);
        let flown = Some(self.link.is_flown());
        if self.flown != flown {
            self.flown = flown;
            relay.handle_control(now, self.link.is_flown());
        }
        while let Some(position) = self.link.poll_position() {
            relay.handle_position(now, position.at, position.place);
        }
        while let Some(sample) = self.link.poll_sample() {
            relay.handle_sample(now, sample);
        }
        if let Some(side) = self.link.poll_cleared() {
            relay.clear_lost(now, side);
        }
    }

    /// Has the operator's ground station show what happened.
    pub(crate) fn tell(&mut self, event: Event) {
        self.link.handle_event(event);
    }

    /// Sends what the relay wants and says when to be called again, at the latest; `now` is that of [`listen`](Self::listen).
    pub(crate) fn fly(&mut self, now: Instant, relay: &Relay) -> Instant {
        #[cfg(feature = "upload")]
        self.follow(now, relay);
        let setpoint = relay.setpoint();
        self.link.handle_ready(now, relay.is_ready());
        let holds = [Side::Upstream, Side::Downstream].map(|side| relay.hold_reason(side));
        self.link.handle_hold(now, holds);
        self.link.handle_setpoint(now, setpoint);
        let sir_db = relay.target().map(|target| self.decibels(target));
        self.link.handle_values(now, sir_db, setpoint);
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
            // There is room for it.
            let _ = self.port.write(&frame);
        }
    }

    /// The SIR in decibels, computed anew where it has changed.
    fn decibels(&mut self, target: f32) -> f32 {
        match self.target {
            Some((of, db)) if of.to_bits() == target.to_bits() => db,
            _ => {
                let db = 10.0 * libm::log10f(target);
                self.target = Some((target, db));
                db
            }
        }
    }
}

/// Has its interrupt serve the port. On their way to their place the queues are on the stack, which is given back.
#[inline(never)]
fn open(uart: Uart) -> Option<Port> {
    Some(port::open(
        uart,
        Interrupt::USART1,
        &AUTOPILOT,
        singleton!(AUTOPILOT_QUEUES: Queues<OUTGOING, RECEIVED> = Queues::new())?,
    ))
}

/// It is to sign, and cannot.
struct CannotSign;

/// Has the link sign, where the block has a key. Without a clock it takes the time from what it hears.
#[cfg(feature = "mavlink-signing")]
#[expect(clippy::unnecessary_wraps, reason = "as where it cannot")]
fn sign(link: &mut Link, now: Instant) -> Result<(), CannotSign> {
    if let Some(key) = config::autopilot_key(board::block()) {
        link.sign(Signing::new(key, 0, Stamp::UNKNOWN, now));
        log::signs_to_autopilot();
    }
    Ok(())
}

/// An image built without that does not fly where it is to sign.
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
