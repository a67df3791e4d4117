//! Board support of the STM32F405, on the pins of `examples/stm32f405`: flash, seed and UARTs.
//!
//! | function | resource |
//! | --- | --- |
//! | neighbour toward the transmitter, or radio | USART2: TX PA2, RX PA3 |
//! | neighbour toward the receiver | USART3: TX PB10, RX PB11 |
//! | autopilot, if the block has Tx and Rx positions | USART1: TX PA9, RX PA10 |
//! | driver enable of the radio | PA1: high while this relay sends |
//! | log | the debug probe (RTT) |
//! | clock | PLL, 168 MHz, from a crystal of 8 MHz or from the HSI |
//! | votes, epochs, configuration block | sectors as in `examples/stm32f405` |
#![no_std]
#![forbid(unsafe_code)]

use core::ops::Range;

use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::peripherals::{FLASH, USART1, USART2, USART3};
use embassy_stm32::usart::BufferedInterruptHandler;
use embassy_stm32::{Peri, bind_interrupts};
use relay_app::board::{Board, Storage};
use relay_stm32::seed;
use uav_relay_block::ADDRESS;
pub use uav_relay_chip::clock::STM32F405 as PLAN;
use uav_relay_kept::{epoch, views};

bind_interrupts!(
    /// Interrupt handlers of the UARTs.
    pub struct Irqs {
        USART1 => BufferedInterruptHandler<USART1>;
        USART2 => BufferedInterruptHandler<USART2>;
        USART3 => BufferedInterruptHandler<USART3>;
    }
);

const FLASH_START: u32 = 0x0800_0000;

const KIB: u32 = 1024;

/// Creates the description of the board. An erase of an epoch sector stops the CPU for 1 s, at most 2 s.
pub fn board(flash: Peri<'static, FLASH>) -> Board<Flash<'static, Blocking>> {
    let sector = |address: u32, bytes: u32| -> Range<u32> {
        let start = address - FLASH_START;
        start..start + bytes
    };
    Board::new(
        seed(),
        Storage {
            flash: Flash::new_blocking(flash),
            block: ADDRESS - FLASH_START,
            epochs: epoch::SECTORS.map(|at| sector(at, 128 * KIB)),
            views: views::SECTORS.map(|at| sector(at, 16 * KIB)),
        },
    )
}
