//! Board support of the Raspberry Pi Pico 2: flash, seed and UARTs.
//!
//! | function | resource |
//! | --- | --- |
//! | neighbour toward the transmitter, or radio | UART0: TX GP0, RX GP1 |
//! | neighbour toward the receiver, or with a radio the autopilot | UART1: TX GP4, RX GP5 |
//! | driver enable of the radio | GP2: high while this relay sends |
//! | log | the debug probe (RTT) |
//! | configuration block | the last 4 KiB of the flash |
//! | epochs | twice 4 KiB before the block |
//! | votes | twice 16 KiB before the epochs; an erase of 16 KiB stops the core for 0.2 s or so |
#![no_std]
#![forbid(unsafe_code)]

use defmt_rtt as _;
use embassy_rp::flash::{Blocking, Flash};
use embassy_rp::interrupt::typelevel::Binding;
use embassy_rp::peripherals::{FLASH, TRNG, UART0, UART1, WATCHDOG};
use embassy_rp::trng::Trng;
use embassy_rp::uart::{
    BufferedInterruptHandler, BufferedUart, BufferedUartRx, BufferedUartTx, Config, Instance,
    RxPin, TxPin,
};
use embassy_rp::watchdog::{ResetReason, Watchdog};
use embassy_rp::{Peri, bind_interrupts};
use embassy_time::Duration;
use panic_probe as _;
use relay_app::board::{Board, Storage};
use relay_app::{BAUD, Buffers};
use uav_relay_chip::reset::Reset;

bind_interrupts!(
    /// Interrupt handlers of the UARTs and the random number generator.
    pub struct Irqs {
        UART0_IRQ => BufferedInterruptHandler<UART0>;
        UART1_IRQ => BufferedInterruptHandler<UART1>;
        TRNG_IRQ => embassy_rp::trng::InterruptHandler<TRNG>;
    }
);

const FLASH_SIZE: usize = 4 * 1024 * 1024;

/// Flash driver of the board.
pub type BoardFlash = Flash<'static, FLASH, Blocking, FLASH_SIZE>;

/// Running watchdog of the board, with a timeout of 6 s. A debugger that halts the core pauses the watchdog.
pub struct Guard(Watchdog);

impl Guard {
    /// Starts the watchdog; returns it and the cause of the last reset.
    pub fn start(watchdog: Peri<'static, WATCHDOG>) -> (Self, Reset) {
        let mut watchdog = Watchdog::new(watchdog);
        let reset = match watchdog.reset_reason() {
            Some(ResetReason::TimedOut) => Reset::Watchdog,
            Some(ResetReason::Forced) => Reset::Software,
            None => Reset::Unknown,
        };
        watchdog.pause_on_debug(true);
        watchdog.start(TIMEOUT);
        (Self(watchdog), reset)
    }

    /// Feeds the watchdog.
    pub fn feed(&mut self) {
        self.0.feed(TIMEOUT);
    }
}

const TIMEOUT: Duration = Duration::from_millis(6_000);

/// Creates the description of the board, with a seed from its random number generator.
pub fn board(flash: Peri<'static, FLASH>, trng: Peri<'static, TRNG>) -> Board<BoardFlash> {
    Board::new(
        seed(trng),
        Storage {
            flash: Flash::new_blocking(flash),
            block: 0x3F_F000,
            epochs: [0x3F_D000..0x3F_E000, 0x3F_E000..0x3F_F000],
            views: [0x3F_5000..0x3F_9000, 0x3F_9000..0x3F_D000],
        },
    )
}

/// Returns a random seed, which differs between starts.
fn seed(trng: Peri<'_, TRNG>) -> u32 {
    Trng::new(trng, Irqs, embassy_rp::trng::Config::default()).blocking_next_u32()
}

/// Receiving and sending half of a UART.
pub type Port = (BufferedUartRx, BufferedUartTx);

/// Absent autopilot port, for an image whose two UARTs lead to neighbours.
pub const NO_AUTOPILOT: Option<Port> = None;

/// Opens a UART at the firmware's bit rate, with `buffers` that no other UART uses.
pub fn port<T: Instance, const IN: usize>(
    uart: Peri<'static, T>,
    tx: Peri<'static, impl TxPin<T>>,
    rx: Peri<'static, impl RxPin<T>>,
    buffers: &'static Buffers<IN>,
) -> Port
where
    Irqs: Binding<T::Interrupt, BufferedInterruptHandler<T>>,
{
    let (sent, received) = buffers.take();
    let mut config = Config::default();
    config.baudrate = BAUD;
    let (tx, rx) = BufferedUart::new(uart, tx, rx, Irqs, sent, received, config).split();
    (rx, tx)
}
