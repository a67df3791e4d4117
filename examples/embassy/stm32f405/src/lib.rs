//! Board support of the STM32F405, on the pins of `examples/stm32f405`: flash, seed and UARTs.
//!
//! | function | resource |
//! | --- | --- |
//! | neighbour toward the transmitter, or radio | USART2: TX PA2, RX PA3 |
//! | neighbour toward the receiver | USART3: TX PB10, RX PB11 |
//! | autopilot, for a drone with sites | USART1: TX PA9, RX PA10 |
//! | driver enable of the radio | PA1: high while this relay sends |
//! | log | the debug probe (RTT) |
//! | clock | PLL, 168 MHz, from a crystal of 8 MHz or from the HSI |
//! | votes, epochs, configuration block | sectors as in `examples/stm32f405` |
#![no_std]
#![forbid(unsafe_code)]

use core::ops::Range;

use defmt_rtt as _;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::peripherals::{FLASH, PA2, PA3, PA9, PA10, PB10, PB11, USART1, USART2, USART3};
use embassy_stm32::rcc;
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{
    BufferedInterruptHandler, BufferedUart, BufferedUartRx, BufferedUartTx, Config, ConfigError,
    Instance, RxPin, TxPin,
};
use embassy_stm32::{Peri, Peripherals, bind_interrupts};
use panic_probe as _;
use relay_app::board::{Board, Storage};
use relay_app::{BAUD, BUFFER, BURST};
use static_cell::StaticCell;
use uav_relay_block::ADDRESS;
use uav_relay_chip::clock::{self, Clocks, STM32F405 as PLAN, Source};
use uav_relay_chip::registers::Chip;
use uav_relay_chip::reset::Reset;
use uav_relay_chip::watchdog;
use uav_relay_kept::{epoch, views};

bind_interrupts!(
    /// Interrupt handlers of the UARTs.
    pub struct Irqs {
        USART2 => BufferedInterruptHandler<USART2>;
        USART3 => BufferedInterruptHandler<USART3>;
        USART1 => BufferedInterruptHandler<USART1>;
    }
);

const FLASH_START: u32 = 0x0800_0000;

const KIB: u32 = 1024;

/// Starts the watchdog and the clocks; returns the peripherals and the cause of the last reset.
///
/// Embassy waits for its clocks without a limit, so we first probe the clock tree with bounded waits; if a clock stops in
/// between, the watchdog restarts the chip.
pub fn init() -> (Peripherals, Reset) {
    let reset = Reset::take(&mut Chip);
    watchdog::start(&mut Chip);
    let clocks = clock::probe(&mut Chip, &PLAN);
    let mut config = embassy_stm32::Config::default();
    config.rcc = tree(clocks);
    let peripherals = embassy_stm32::init(config);
    clock::cache_flash(&mut Chip);
    defmt::info!("clock {} MHz", clocks.core_hz / 1_000_000);
    (peripherals, reset)
}

/// Feeds the watchdog.
pub fn feed() {
    watchdog::feed(&mut Chip);
}

/// Returns Embassy's settings for the probed clocks.
fn tree(clocks: Clocks) -> rcc::Config {
    let mut config = rcc::Config::new();
    let (Some(source), Some(crystal)) = (clocks.pll, PLAN.crystal) else {
        return config;
    };
    let prediv = match source {
        Source::Crystal => {
            config.hse = Some(rcc::Hse {
                freq: Hertz(crystal.hz),
                mode: rcc::HseMode::Oscillator,
            });
            config.pll_src = rcc::PllSource::HSE;
            rcc::PllPreDiv::DIV4
        }
        Source::Internal => rcc::PllPreDiv::DIV8,
    };
    config.pll = Some(rcc::Pll {
        prediv,
        mul: rcc::PllMul::MUL168,
        divp: Some(rcc::PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.sys = rcc::Sysclk::PLL1_P;
    config.apb1_pre = rcc::APBPrescaler::DIV4;
    config.apb2_pre = rcc::APBPrescaler::DIV2;
    config
}

/// Creates the board. An erase of a sector of the epoch stops its CPU for 1 s, at most 2 s.
pub fn board(flash: Peri<'static, FLASH>) -> Board<Flash<'static, Blocking>> {
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

const fn sector(address: u32, bytes: u32) -> Range<u32> {
    let start = address - FLASH_START;
    start..start + bytes
}

type Halves = (BufferedUartRx<'static>, BufferedUartTx<'static>);
type Buffer = StaticCell<[u8; BUFFER]>;

/// Returns reader and writer of USART2.
///
/// # Errors
/// The UART's clock does not permit the baud rate.
pub fn usart2(
    uart: Peri<'static, USART2>,
    tx: Peri<'static, PA2>,
    rx: Peri<'static, PA3>,
) -> Result<Halves, ConfigError> {
    static SENT: Buffer = StaticCell::new();
    static RECEIVED: Buffer = StaticCell::new();
    let (sent, received) = (SENT.init([0; BUFFER]), RECEIVED.init([0; BUFFER]));
    halves(uart, tx, rx, sent, received)
}

/// Returns reader and writer of USART3.
///
/// # Errors
/// The UART's clock does not permit the baud rate.
pub fn usart3(
    uart: Peri<'static, USART3>,
    tx: Peri<'static, PB10>,
    rx: Peri<'static, PB11>,
) -> Result<Halves, ConfigError> {
    static SENT: Buffer = StaticCell::new();
    static RECEIVED: Buffer = StaticCell::new();
    let (sent, received) = (SENT.init([0; BUFFER]), RECEIVED.init([0; BUFFER]));
    halves(uart, tx, rx, sent, received)
}

/// Returns reader and writer of USART1, to the autopilot.
///
/// # Errors
/// The UART's clock does not permit the baud rate.
pub fn usart1(
    uart: Peri<'static, USART1>,
    tx: Peri<'static, PA9>,
    rx: Peri<'static, PA10>,
) -> Result<Halves, ConfigError> {
    static SENT: Buffer = StaticCell::new();
    static RECEIVED: StaticCell<[u8; BURST]> = StaticCell::new();
    let (sent, received) = (SENT.init([0; BUFFER]), RECEIVED.init([0; BURST]));
    halves(uart, tx, rx, sent, received)
}

fn halves<T: Instance>(
    uart: Peri<'static, T>,
    tx: Peri<'static, impl TxPin<T>>,
    rx: Peri<'static, impl RxPin<T>>,
    sent: &'static mut [u8],
    received: &'static mut [u8],
) -> Result<Halves, ConfigError>
where
    Irqs: Binding<T::Interrupt, BufferedInterruptHandler<T>>,
{
    let mut config = Config::default();
    config.baudrate = BAUD;
    let (tx, rx) = BufferedUart::new(uart, rx, tx, sent, received, Irqs, config)?.split();
    Ok((rx, tx))
}

/// Returns a seed from the chip's unique number. The random number generator's clock, PLLQ, is not set up here.
fn seed() -> u32 {
    let words = embassy_stm32::uid::uid().map(u32::from);
    let step = |hash: u32, byte: u32| (hash ^ byte).wrapping_mul(0x0100_0193);
    words.into_iter().fold(0x811C_9DC5, step)
}
