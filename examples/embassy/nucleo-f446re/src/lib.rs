//! Board support of the NUCLEO-F446RE: flash, seed and UARTs.
//!
//! | function | resource |
//! | --- | --- |
//! | neighbour toward the transmitter, or radio | USART1: TX PA9 (D8, CN10 pin 21), RX PA10 (D2, CN10 pin 33) |
//! | neighbour toward the receiver | USART3: TX PC10 (CN7 pin 1), RX PC11 (CN7 pin 2) |
//! | autopilot, if the block has Tx and Rx positions | USART6: TX PC6 (CN10 pin 4), RX PC7 (D9, CN10 pin 19) |
//! | driver enable of the radio | PA8 (D7, CN10 pin 23): high while this relay sends |
//! | log | the ST-LINK on the board (RTT) |
//! | clock | PLL, 180 MHz, from the 8 MHz of the ST-LINK or from the HSI |
//! | votes | sectors 1 and 2, of 16 KiB each |
//! | epochs | sectors 3 and 4 of the flash, of 16 and 64 KiB |
//! | image | sector 0, the vectors alone; sectors 5 and 6 |
//! | configuration block | sector 7 |
//!
//! USART2 on PA2 and PA3 is not used. The solder bridges SB13 and SB14 connect these pins to the ST-LINK's virtual
//! serial port, and not to D0 and D1.
#![no_std]
#![forbid(unsafe_code)]

use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::peripherals::{FLASH, USART1, USART3, USART6};
use embassy_stm32::usart::BufferedInterruptHandler;
use embassy_stm32::{Peri, bind_interrupts};
use relay_app::board::{Board, Storage};
use relay_stm32::seed;
pub use uav_relay_chip::clock::NUCLEO_F446RE as PLAN;

bind_interrupts!(
    /// Interrupt handlers of the UARTs.
    pub struct Irqs {
        USART1 => BufferedInterruptHandler<USART1>;
        USART3 => BufferedInterruptHandler<USART3>;
        USART6 => BufferedInterruptHandler<USART6>;
    }
);

/// Creates the description of the board.
///
/// An erase of a flash sector stops the CPU for 0.25 s (16 KiB) or 0.55 s (64 KiB), at most for twice as long.
pub fn board(flash: Peri<'static, FLASH>) -> Board<Flash<'static, Blocking>> {
    Board::new(
        seed(),
        Storage {
            flash: Flash::new_blocking(flash),
            block: 0x6_0000,
            epochs: [0xC000..0x1_0000, 0x1_0000..0x2_0000],
            views: [0x4000..0x8000, 0x8000..0xC000],
        },
    )
}
