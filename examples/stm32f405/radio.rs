//! Board with one serial port, to a radio channel shared by all relays in range.
//!
//! | function | pins |
//! | --- | --- |
//! | radio, or transceiver of a bus | USART2: TX PA2, RX PA3 |
//! | driver enable, if the radio has one | PA1: high while this relay sends |
//! | autopilot, for a drone with sites | USART1: TX PA9, RX PA10 |
//! | log, with `--features defmt` | UART4: TX PC10, RX PC11 |
//! | clock | PLL, 168 MHz, from a crystal of 8 MHz or from the HSI; `SysTick` every millisecond |

use core::cell::RefCell;

use cortex_m::interrupt::Mutex;
use cortex_m::singleton;
use stm32f4xx_hal::gpio::{Output, PA1};
use stm32f4xx_hal::pac::{self, Interrupt, USART2, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::Serial;

use super::autopilot::{self, Uart};
use super::clock::Clock;
use super::port::{self, Port, Queues, Slot};

static RADIO: Slot<USART2> = Mutex::new(RefCell::new(None));

pub(crate) type DriverEnable = PA1<Output>;

/// Sets up the board, once: clock, radio port, driver-enable pin, and the UART of the autopilot.
pub(crate) fn start() -> Option<(Clock, Port, DriverEnable, Uart)> {
    let chip = pac::Peripherals::take()?;
    let core = cortex_m::Peripherals::take()?;
    let begun = super::chip::begin();
    let clocks = begun.clocks;
    let mut rcc = chip.RCC.constrain();
    let a = chip.GPIOA.split(&mut rcc);
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
    let radio = Serial::new(
        chip.USART2,
        (a.pa2, a.pa3),
        port::config(clocks.apb1_hz),
        &mut rcc,
    )
    .ok()?;
    let radio = port::open(
        radio,
        Interrupt::USART2,
        &RADIO,
        singleton!(RADIO_QUEUES: Queues = Queues::new())?,
    );
    Some((clock, radio, a.pa1.into_push_pull_output(), autopilot))
}

#[interrupt]
fn USART2() {
    port::serve(&RADIO);
}
