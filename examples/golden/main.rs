//! Firmware that shows that target and PC agree on every byte.
//!
//! It answers each frame on USART2 (TX PA2, RX PA3, 115 200 baud) with the crate's result.
//! `host-tests/tests/qemu/golden.rs` compares the answers with those of a PC.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[expect(unreachable_pub, reason = "the test on the host has it public")]
mod answer;

#[cfg(target_os = "none")]
use panic_halt as _;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    if let Some(uart) = start() {
        serve(uart);
    }
    loop {
        cortex_m::asm::wfi();
    }
}

#[cfg(target_os = "none")]
type Uart = stm32f4xx_hal::serial::Serial<stm32f4xx_hal::pac::USART2>;

#[cfg(target_os = "none")]
fn start() -> Option<Uart> {
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::Config;
    use stm32f4xx_hal::serial::{self, Serial};

    let chip = stm32f4xx_hal::pac::Peripherals::take()?;
    let mut rcc = chip.RCC.freeze(Config::hsi());
    let a = chip.GPIOA.split(&mut rcc);
    let config = serial::Config::default().baudrate(115_200.bps());
    Serial::new(chip.USART2, (a.pa2, a.pa3), config, &mut rcc).ok()
}

/// Receives frames from `uart` and answers each, forever.
#[cfg(target_os = "none")]
fn serve(mut uart: Uart) -> ! {
    use embedded_hal_nb::serial::Read as _;

    let mut answerer = answer::Answerer::new();
    // Bytes sent to the firmware before this would be lost.
    say(&mut uart, answer::READY);
    loop {
        if let Ok(byte) = uart.read() {
            answerer.hear(byte, |answer| say(&mut uart, answer));
        }
    }
}

#[cfg(target_os = "none")]
fn say(uart: &mut Uart, bytes: &[u8]) {
    use embedded_hal_nb::serial::Write as _;

    for &byte in bytes {
        while uart.write(byte).is_err() {}
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!("A firmware that answers frames; see the head of examples/golden/main.rs.");
}
