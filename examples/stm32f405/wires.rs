//! Board with a serial port to each neighbour.
//!
//! | function | pins |
//! | --- | --- |
//! | neighbour toward the transmitter | USART2: TX PA2, RX PA3 |
//! | neighbour toward the receiver | USART3: TX PB10, RX PB11 |
//! | autopilot, for a drone with sites | USART1: TX PA9, RX PA10 |
//! | log, with `--features defmt` | UART4: TX PC10, RX PC11 |
//! | clock | PLL, 168 MHz, from a crystal of 8 MHz or from the HSI; `SysTick` every millisecond |

use core::cell::RefCell;

use cortex_m::interrupt::Mutex;
use cortex_m::singleton;
use stm32f4xx_hal::pac::{self, Interrupt, USART2, USART3, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::Serial;

use super::autopilot::{self, Uart};
use super::clock::Clock;
use super::port::{self, Port, Queues, Slot};

static UPSTREAM: Slot<USART2> = Mutex::new(RefCell::new(None));
static DOWNSTREAM: Slot<USART3> = Mutex::new(RefCell::new(None));

/// Sets up the board, once: clock, the ports of both neighbours, and the UART of the autopilot.
pub(crate) fn start() -> Option<(Clock, Port, Port, Uart)> {
    let chip = pac::Peripherals::take()?;
    let core = cortex_m::Peripherals::take()?;
    let begun = super::chip::begin();
    let clocks = begun.clocks;
    let mut rcc = chip.RCC.constrain();
    let a = chip.GPIOA.split(&mut rcc);
    let b = chip.GPIOB.split(&mut rcc);
    let clock = Clock::start(core.SYST, clocks.core_hz);
    #[cfg(all(feature = "defmt", not(feature = "rtt")))]
    {
        let c = chip.GPIOC.split(&mut rcc);
        let config = port::config(clocks.apb1_hz);
        let uart = Serial::new(chip.UART4, (c.pc10, c.pc11), config, &mut rcc);
        super::log::start(uart.ok()?);
    }
    super::log::started(&begun);
    let autopilot = autopilot::uart(chip.USART1, a.pa9, a.pa10, clocks.apb2_hz, &mut rcc)?;
    let upstream = Serial::new(
        chip.USART2,
        (a.pa2, a.pa3),
        port::config(clocks.apb1_hz),
        &mut rcc,
    )
    .ok()?;
    let downstream = Serial::new(
        chip.USART3,
        (b.pb10, b.pb11),
        port::config(clocks.apb1_hz),
        &mut rcc,
    )
    .ok()?;
    let upstream = port::open(
        upstream,
        Interrupt::USART2,
        &UPSTREAM,
        singleton!(UPSTREAM_QUEUES: Queues = Queues::new())?,
    );
    let downstream = port::open(
        downstream,
        Interrupt::USART3,
        &DOWNSTREAM,
        singleton!(DOWNSTREAM_QUEUES: Queues = Queues::new())?,
    );
    Some((clock, upstream, downstream, autopilot))
}

#[interrupt]
fn USART2() {
    port::serve(&UPSTREAM);
}

#[interrupt]
fn USART3() {
    port::serve(&DOWNSTREAM);
}
