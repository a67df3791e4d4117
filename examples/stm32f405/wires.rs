//! Board with a serial port to each neighbour.
//!
//! The port toward the transmitter is in `firmware/pins.rs`. The port toward the receiver is USART3: TX PB10, RX
//! PB11.

use core::cell::RefCell;

use cortex_m::interrupt::Mutex;
use cortex_m::singleton;
use stm32f4xx_hal::pac::{Interrupt, USART3, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::Serial;

use crate::autopilot::Uart;
use crate::firmware::clock::Clock;
use crate::firmware::pins::{self, Pins, Second};
use crate::firmware::port::{self, Port, Queues, Slot};

static DOWNSTREAM: Slot<USART3> = Mutex::new(RefCell::new(None));

/// Sets up the board, once. Returns the clock, the ports toward transmitter and receiver, and the autopilot's UART.
pub(crate) fn start() -> Option<(Clock, Port, Port, Uart)> {
    let Pins {
        clock,
        first,
        uart,
        second,
        ..
    } = pins::start()?;
    let Second {
        usart,
        gpio,
        config,
        mut rcc,
    } = second;
    let b = gpio.split(&mut rcc);
    let downstream = Serial::new(usart, (b.pb10, b.pb11), config, &mut rcc).ok()?;
    let downstream = port::open(
        downstream,
        Interrupt::USART3,
        &DOWNSTREAM,
        singleton!(DOWNSTREAM_QUEUES: Queues = Queues::new())?,
    );
    Some((clock, first, downstream, uart))
}

#[interrupt]
fn USART3() {
    port::serve(&DOWNSTREAM);
}
