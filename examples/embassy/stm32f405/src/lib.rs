//! The STM32F405, on the pins of the other firmware: its configuration block, its seed, and its UARTs.
//!
//! | what | where |
//! | --- | --- |
//! | toward the transmitter, or the radio | USART2: TX PA2, RX PA3 |
//! | toward the receiver | USART3: TX PB10, RX PB11 |
//! | the radio's driver enable | PA1: high while this relay sends |
//! | log | the debug probe (RTT) |
//! | clock | HSI, 16 MHz, no PLL |
#![no_std]
#![forbid(unsafe_code)]

use defmt_rtt as _;
use embassy_stm32::flash::Flash;
use embassy_stm32::peripherals::{FLASH, PA2, PA3, PB10, PB11, USART2, USART3};
use embassy_stm32::usart::{
    BufferedInterruptHandler, BufferedUart, BufferedUartRx, BufferedUartTx, Config, ConfigError,
};
use embassy_stm32::{Peri, bind_interrupts};
use panic_probe as _;
use relay_app::{BAUD, BUFFER};
use static_cell::StaticCell;
use uav_relay_block::{ADDRESS, Block, LEN};

bind_interrupts!(
    /// Who handles which interrupt.
    pub struct Irqs {
        USART2 => BufferedInterruptHandler<USART2>;
        USART3 => BufferedInterruptHandler<USART3>;
    }
);

/// Where the flash begins.
const FLASH_START: u32 = 0x0800_0000;

/// The configuration block; blank where it cannot be read.
pub fn block(flash: Peri<'_, FLASH>) -> Block {
    let mut block = [0xFF; LEN];
    let mut flash = Flash::new_blocking(flash);
    if flash
        .blocking_read(ADDRESS - FLASH_START, &mut block)
        .is_err()
    {
        block.fill(0xFF);
    }
    block
}

type Halves = (BufferedUartRx<'static>, BufferedUartTx<'static>);

/// Reader and writer of USART2.
///
/// # Errors
/// Where its clock does not give the baud rate.
pub fn usart2(
    uart: Peri<'static, USART2>,
    tx: Peri<'static, PA2>,
    rx: Peri<'static, PA3>,
) -> Result<Halves, ConfigError> {
    static BUFFERS: StaticCell<[[u8; BUFFER]; 2]> = StaticCell::new();
    let [sent, received] = BUFFERS.init([[0; BUFFER]; 2]);
    let (tx, rx) = BufferedUart::new(uart, rx, tx, sent, received, Irqs, config())?.split();
    Ok((rx, tx))
}

/// Reader and writer of USART3.
///
/// # Errors
/// Where its clock does not give the baud rate.
pub fn usart3(
    uart: Peri<'static, USART3>,
    tx: Peri<'static, PB10>,
    rx: Peri<'static, PB11>,
) -> Result<Halves, ConfigError> {
    static BUFFERS: StaticCell<[[u8; BUFFER]; 2]> = StaticCell::new();
    let [sent, received] = BUFFERS.init([[0; BUFFER]; 2]);
    let (tx, rx) = BufferedUart::new(uart, rx, tx, sent, received, Irqs, config())?.split();
    Ok((rx, tx))
}

fn config() -> Config {
    let mut config = Config::default();
    config.baudrate = BAUD;
    config
}

/// Differs from one chip to the next: its random number generator wants the PLL, which this board leaves alone.
pub fn seed() -> u32 {
    let words = embassy_stm32::uid::uid().map(u32::from);
    // FNV-1a.
    let step = |hash: u32, byte: u32| (hash ^ byte).wrapping_mul(0x0100_0193);
    words.into_iter().fold(0x811C_9DC5, step)
}
