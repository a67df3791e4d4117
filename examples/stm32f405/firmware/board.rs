//! Unsafe code of the board, except flash writes: RAM, interrupts and the linker.

use core::ptr::{read_volatile, write_volatile};

use cortex_m::asm;
use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::pac::Interrupt;

use super::chip;
use super::config::{self, Block};

/// Returns the configuration block in the flash.
pub(crate) fn block() -> &'static Block {
    // SAFETY: a part of the flash, always readable, and not written while the program runs; bytes need no alignment.
    unsafe { &*(config::ADDRESS as *const Block) }
}

/// Enables an interrupt. The driver that the interrupt uses must be set up before.
pub(crate) fn unmask(interrupt: Interrupt) {
    // SAFETY: no critical section of this program relies on a single interrupt being masked.
    unsafe { NVIC::unmask(interrupt) };
}

/// Returns a seed that differs between boards and starts.
///
/// After power-up the seed is a hash of the noise in the RAM. After a reset it is a hash of the RAM's content, which
/// includes the last seed. The chip's unique number is not used, because the emulator has none.
pub(crate) fn seed() -> u32 {
    const WORDS: usize = 64;
    #[unsafe(link_section = ".uninit.leftover")]
    static mut LEFTOVER: [u32; WORDS] = [0; WORDS];
    let first = (&raw mut LEFTOVER).cast::<u32>();
    // FNV-1a over words.
    let seed = (0..WORDS).fold(0x811C_9DC5, |hash: u32, word| {
        // SAFETY: the address is within the array, which only this function uses, and only from the main loop.
        (hash ^ unsafe { read_volatile(first.add(word)) }).wrapping_mul(0x0100_0193)
    });
    // SAFETY: as above.
    unsafe { write_volatile(first, seed) };
    seed
}

/// Feeds the watchdog and sleeps, forever. Called if the drone cannot join the chain.
///
/// If no clock wakes the chip, the watchdog restarts it.
pub(crate) fn stop() -> ! {
    loop {
        chip::feed();
        asm::wfi();
    }
}

/// Panic handler that makes the linker fail if a panic is reachable.
///
/// An image that links has no reachable panic, which `cargo cost` proves.
#[cfg(prove_no_panic)]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn a_panic_is_reachable() -> !;
    }
    // SAFETY: never linked.
    unsafe { a_panic_is_reachable() }
}

#[cfg(not(prove_no_panic))]
use panic_halt as _;

// defmt's linker script sorts the strings of the log, so it is linked only with a log. The script is linked as a
// library, because the linker finds a library in defmt's build directory.
#[cfg(feature = "defmt")]
#[link(name = "defmt.x", kind = "dylib", modifiers = "+verbatim")]
unsafe extern "C" {}

/// Logger that sends defmt frames over a UART, not through the debug probe (RTT).
#[cfg(all(feature = "defmt", not(feature = "rtt")))]
mod defmt_frames {
    use core::sync::atomic::{AtomicBool, Ordering};

    use cortex_m::interrupt;
    use cortex_m::register::primask;

    use crate::firmware::uart_log as log;

    #[defmt::global_logger]
    struct Logger;

    /// True if interrupts were enabled before the present log frame; its end then enables them again.
    static INTERRUPTED: AtomicBool = AtomicBool::new(false);

    // SAFETY: interrupts are off from `acquire` to `release`, so frames are written one at a time. A nested frame,
    // which no `Format` of this program makes, would garble only the text of both. No method logs.
    unsafe impl defmt::Logger for Logger {
        fn acquire() {
            let on = primask::read().is_active();
            interrupt::disable();
            INTERRUPTED.store(on, Ordering::Relaxed);
            log::begin();
        }

        unsafe fn flush() {}

        unsafe fn release() {
            log::end();
            if INTERRUPTED.load(Ordering::Relaxed) {
                // SAFETY: interrupts were enabled when this frame began, so this is not inside a critical section.
                unsafe { interrupt::enable() };
            }
        }

        unsafe fn write(bytes: &[u8]) {
            log::write(bytes);
        }
    }
}
