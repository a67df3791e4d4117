//! Parts that all STM32F4 boards share: clocks, watchdog, seed and UARTs.
#![no_std]
#![forbid(unsafe_code)]

use defmt_rtt as _;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::rcc;
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{
    BufferedInterruptHandler, BufferedUart, BufferedUartRx, BufferedUartTx, Config, ConfigError,
    Instance, RxPin, TxPin,
};
use embassy_stm32::{Peri, Peripherals};
use panic_probe as _;
use relay_app::{BAUD, Buffers};
use uav_relay_chip::clock::{self, ClockHardware, Clocks, PLL_INPUT_HZ, Source};
use uav_relay_chip::crystal::HSI_HZ;
use uav_relay_chip::registers::Chip;
use uav_relay_chip::reset::Reset;
use uav_relay_chip::watchdog;

/// Starts the watchdog and the clocks of `hardware`. Returns the peripherals and the cause of the last reset.
///
/// Embassy waits for its clocks without a limit, so we first probe them with bounded waits. If a clock then stops,
/// the watchdog restarts the chip.
pub fn init(hardware: &ClockHardware) -> (Peripherals, Reset) {
    let reset = Reset::take(&mut Chip);
    watchdog::start(&mut Chip);
    let clocks = clock::probe(&mut Chip, hardware);
    let mut config = embassy_stm32::Config::default();
    config.rcc = tree(hardware, clocks);
    let peripherals = embassy_stm32::init(config);
    clock::cache_flash(&mut Chip);
    defmt::info!("clock {} MHz", clocks.core_hz / 1_000_000);
    (peripherals, reset)
}

/// Feeds the watchdog.
pub fn feed() {
    watchdog::feed(&mut Chip);
}

/// Returns Embassy's description of the clocks, which already run at `clocks`.
fn tree(hardware: &ClockHardware, clocks: Clocks) -> rcc::Config {
    let mut config = rcc::Config::new();
    let source_hz = match (clocks.pll, hardware.crystal) {
        (None, _) => return config,
        (Some(Source::Crystal), Some(crystal)) => {
            config.hse = Some(rcc::Hse {
                freq: Hertz(crystal.hz),
                mode: if crystal.bypass {
                    rcc::HseMode::Bypass
                } else {
                    rcc::HseMode::Oscillator
                },
            });
            config.pll_src = rcc::PllSource::HSE;
            crystal.hz
        }
        (Some(_), _) => HSI_HZ,
    };
    let [divisor, ..] = (source_hz / PLL_INPUT_HZ).to_le_bytes();
    // The core runs at half of the PLL's frequency.
    let [low, high, ..] = (2 * clocks.core_hz / PLL_INPUT_HZ).to_le_bytes();
    config.pll = Some(rcc::Pll {
        prediv: rcc::PllPreDiv::from_bits(divisor),
        mul: rcc::PllMul::from_bits(u16::from_le_bytes([low, high])),
        divp: Some(rcc::PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.sys = rcc::Sysclk::PLL1_P;
    config.apb1_pre = rcc::APBPrescaler::DIV4;
    config.apb2_pre = rcc::APBPrescaler::DIV2;
    config
}

/// Receiving and sending half of a UART.
pub type Port = (BufferedUartRx<'static>, BufferedUartTx<'static>);

/// Opens a UART at the firmware's bit rate, with `buffers` that no other UART uses.
///
/// # Errors
/// The UART's clock does not permit the baud rate.
pub fn port<T: Instance, const IN: usize>(
    uart: Peri<'static, T>,
    tx: Peri<'static, impl TxPin<T>>,
    rx: Peri<'static, impl RxPin<T>>,
    irqs: impl Binding<T::Interrupt, BufferedInterruptHandler<T>> + 'static,
    buffers: &'static Buffers<IN>,
) -> Result<Port, ConfigError> {
    let (sent, received) = buffers.take();
    let mut config = Config::default();
    config.baudrate = BAUD;
    let (tx, rx) = BufferedUart::new(uart, rx, tx, sent, received, irqs, config)?.split();
    Ok((rx, tx))
}

/// Returns a seed computed from the chip's unique number.
///
/// The STM32F446 has no random number generator. That of the STM32F405 has no clock, because PLLQ is not set up.
pub fn seed() -> u32 {
    let words = embassy_stm32::uid::uid().map(u32::from);
    let step = |hash: u32, byte: u32| (hash ^ byte).wrapping_mul(0x0100_0193);
    words.into_iter().fold(0x811C_9DC5, step)
}
