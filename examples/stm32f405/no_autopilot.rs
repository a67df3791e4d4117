//! Replacement of `autopilot.rs` without the feature `flight`.
//!
//! A drone whose block has Tx and Rx positions does not fly with such an image.

use stm32f4xx_hal::gpio::{PA9, PA10};
use stm32f4xx_hal::pac::USART1;
use stm32f4xx_hal::rcc::Rcc;
use uav_relay::GuardConfig;
use uav_relay::{Event, Instant, Mission, Relay};

use crate::firmware::config::Sites;
use crate::firmware::log;

pub(crate) struct Uart;

#[expect(
    clippy::unnecessary_wraps,
    reason = "as the port of an autopilot is set up"
)]
pub(crate) fn uart(_: USART1, _: PA9, _: PA10, _: u32, _: &mut Rcc) -> Option<Uart> {
    Some(Uart)
}

/// Placeholder for the autopilot link, which this image lacks. This type has no values.
pub(crate) enum Autopilot {}

impl Autopilot {
    /// Returns `None`: an image without an autopilot needs no guard (collision avoidance).
    pub(crate) const fn guard(_: &Sites, _: GuardConfig) -> Option<GuardConfig> {
        None
    }

    pub(crate) fn begin(_: Uart, _: &Sites, _: &Mission, _: Instant) -> Option<&'static mut Self> {
        log::no_flight();
        None
    }

    pub(crate) const fn listen(&mut self, _: Instant, _: &mut Relay) {
        match *self {}
    }

    pub(crate) const fn handle_event(&mut self, _: Event) {
        match *self {}
    }

    pub(crate) const fn fly(&mut self, _: Instant, _: &mut Relay) -> Instant {
        match *self {}
    }
}
