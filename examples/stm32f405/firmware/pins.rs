//! Pins of every image, with wires or a radio.
//!
//! | function | pins |
//! | --- | --- |
//! | neighbour toward the transmitter, or radio | USART2: TX PA2, RX PA3 |
//! | autopilot, if the block has Tx and Rx positions | USART1: TX PA9, RX PA10 |
//! | log, with `--features defmt` | UART4: TX PC10, RX PC11 |
//! | clock | PLL, 168 MHz, from a crystal of 8 MHz or from the HSI; `SysTick` every millisecond |

use core::cell::RefCell;

use cortex_m::interrupt::Mutex;
use cortex_m::singleton;
use stm32f4xx_hal::gpio::PA1;
use stm32f4xx_hal::pac::{self, GPIOB, Interrupt, USART2, USART3, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::serial::{Config, Serial};

use super::clock::Clock;
use super::port::{self, Port, Queues, Slot};
use crate::autopilot::{self, Uart};

static FIRST: Slot<USART2> = Mutex::new(RefCell::new(None));

/// Board with running clocks: ports and peripherals.
pub(crate) struct Pins {
    pub(crate) clock: Clock,
    /// Port at USART2: to the neighbour toward the transmitter, or to the radio.
    pub(crate) first: Port,
    /// UART of the autopilot.
    pub(crate) uart: Uart,
    #[allow(dead_code, reason = "the driver enable of a radio")]
    pub(crate) pa1: PA1,
    #[allow(dead_code, reason = "the second neighbour's port")]
    pub(crate) second: Second,
}

/// Peripherals of the port at USART3, which leads to the neighbour toward the receiver.
#[allow(dead_code, reason = "the second neighbour's port")]
pub(crate) struct Second {
    pub(crate) usart: USART3,
    pub(crate) gpio: GPIOB,
    pub(crate) config: Config,
    pub(crate) rcc: Rcc,
}

/// Sets up the board, once: watchdog, clocks, log, port at USART2, and the autopilot's UART.
pub(crate) fn start() -> Option<Pins> {
    let chip = pac::Peripherals::take()?;
    let core = cortex_m::Peripherals::take()?;
    let begun = super::chip::begin();
    let clocks = begun.clocks;
    let mut rcc = chip.RCC.constrain();
    let a = chip.GPIOA.split(&mut rcc);
    let clock = Clock::start(core.SYST, clocks.core_hz);
    let config = port::config(clocks.apb1_hz);
    #[cfg(all(feature = "defmt", not(feature = "rtt")))]
    {
        let c = chip.GPIOC.split(&mut rcc);
        let uart = Serial::new(chip.UART4, (c.pc10, c.pc11), config, &mut rcc);
        super::uart_log::start(uart.ok()?);
    }
    super::log::started(&begun);
    let uart = autopilot::uart(chip.USART1, a.pa9, a.pa10, clocks.apb2_hz, &mut rcc)?;
    let first = Serial::new(chip.USART2, (a.pa2, a.pa3), config, &mut rcc).ok()?;
    let first = port::open(
        first,
        Interrupt::USART2,
        &FIRST,
        singleton!(FIRST_QUEUES: Queues = Queues::new())?,
    );
    Some(Pins {
        clock,
        first,
        uart,
        pa1: a.pa1,
        second: Second {
            usart: chip.USART3,
            gpio: chip.GPIOB,
            config,
            rcc,
        },
    })
}

#[interrupt]
fn USART2() {
    port::serve(&FIRST);
}
