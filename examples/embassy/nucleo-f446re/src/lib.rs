//! Board support of the NUCLEO-F446RE: flash, seed and UARTs.
//!
//! | function | resource |
//! | --- | --- |
//! | neighbour toward the transmitter, or radio | USART1: TX PA9 (D8, CN10 pin 21), RX PA10 (D2, CN10 pin 33) |
//! | neighbour toward the receiver | USART3: TX PC10 (CN7 pin 1), RX PC11 (CN7 pin 2) |
//! | autopilot, for a drone with sites | USART6: TX PC6 (CN10 pin 4), RX PC7 (D9, CN10 pin 19) |
//! | driver enable of the radio | PA8 (D7, CN10 pin 23): high while this relay sends |
//! | log | the ST-LINK on the board (RTT) |
//! | clock | PLL, 180 MHz, from the 8 MHz of the ST-LINK or from the HSI |
//! | votes | sectors 1 and 2, of 16 KiB each |
//! | epochs | sectors 3 and 4 of the flash, of 16 and 64 KiB |
//! | image | sector 0, the vectors alone; sectors 5 and 6 |
//! | configuration block | sector 7 |
//!
//! USART2 on PA2 and PA3 is not used: solder bridges SB13 and SB14 connect both pins to the ST-LINK's virtual serial port, and
//! not to D0 and D1.
#![no_std]
#![forbid(unsafe_code)]

use defmt_rtt as _;
use embassy_stm32::flash::{Blocking, Flash};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::peripherals::{FLASH, PA9, PA10, PC6, PC7, PC10, PC11, USART1, USART3, USART6};
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
use uav_relay_chip::clock::{self, Clocks, NUCLEO_F446RE as PLAN, Source};
use uav_relay_chip::registers::Chip;
use uav_relay_chip::reset::Reset;
use uav_relay_chip::watchdog;

bind_interrupts!(
    /// Interrupt handlers of the UARTs.
    pub struct Irqs {
        USART1 => BufferedInterruptHandler<USART1>;
        USART3 => BufferedInterruptHandler<USART3>;
        USART6 => BufferedInterruptHandler<USART6>;
    }
);

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
                mode: rcc::HseMode::Bypass,
            });
            config.pll_src = rcc::PllSource::HSE;
            rcc::PllPreDiv::DIV4
        }
        Source::Internal => rcc::PllPreDiv::DIV8,
    };
    let mul = if clocks.core_hz == 180_000_000 {
        rcc::PllMul::MUL180
    } else {
        rcc::PllMul::MUL168
    };
    config.pll = Some(rcc::Pll {
        prediv,
        mul,
        divp: Some(rcc::PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.sys = rcc::Sysclk::PLL1_P;
    config.apb1_pre = rcc::APBPrescaler::DIV4;
    config.apb2_pre = rcc::APBPrescaler::DIV2;
    config
}

/// Creates the board. An erase stops its CPU: 0.25 s for 16 KiB, 0.55 s for 64 KiB, twice that at most.
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

type Halves = (BufferedUartRx<'static>, BufferedUartTx<'static>);
type Buffer = StaticCell<[u8; BUFFER]>;

/// Returns reader and writer of USART1.
///
/// # Errors
/// The UART's clock does not permit the baud rate.
pub fn usart1(
    uart: Peri<'static, USART1>,
    tx: Peri<'static, PA9>,
    rx: Peri<'static, PA10>,
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
    tx: Peri<'static, PC10>,
    rx: Peri<'static, PC11>,
) -> Result<Halves, ConfigError> {
    static SENT: Buffer = StaticCell::new();
    static RECEIVED: Buffer = StaticCell::new();
    let (sent, received) = (SENT.init([0; BUFFER]), RECEIVED.init([0; BUFFER]));
    halves(uart, tx, rx, sent, received)
}

/// Returns reader and writer of USART6, to the autopilot.
///
/// # Errors
/// The UART's clock does not permit the baud rate.
pub fn usart6(
    uart: Peri<'static, USART6>,
    tx: Peri<'static, PC6>,
    rx: Peri<'static, PC7>,
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

/// Returns a seed from the chip's unique number, because the chip has no random number generator.
fn seed() -> u32 {
    let words = embassy_stm32::uid::uid().map(u32::from);
    let step = |hash: u32, byte: u32| (hash ^ byte).wrapping_mul(0x0100_0193);
    words.into_iter().fold(0x811C_9DC5, step)
}
