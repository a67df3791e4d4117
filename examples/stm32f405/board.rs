//! All the unsafe of the board but the writing of flash: what the compiler cannot see about RAM, interrupts and the linker.

use core::ptr::{read_volatile, write_volatile};

use cortex_m::asm;
use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::pac::Interrupt;

use super::chip;
use super::config::{self, Block};

/// The configuration block, where it stands in the flash.
pub(crate) fn block() -> &'static Block {
    // SAFETY: a part of the flash, which is always readable, and which nothing writes while the program runs; bytes need
    // no alignment.
    unsafe { &*(config::ADDRESS as *const Block) }
}

/// Lets an interrupt through. Called once its driver is in place.
pub(crate) fn unmask(interrupt: Interrupt) {
    // SAFETY: no critical section of this program relies on a single interrupt being masked.
    unsafe { NVIC::unmask(interrupt) };
}

/// Returns a number that differs from board to board and from one start to the next: after power-up the RAM holds noise, which is the
/// chip's own and not copied with an image; after a reset it holds what this function left there. The chip's unique number would do as well, but
/// the emulator has none at its address.
pub(crate) fn seed() -> u32 {
    const WORDS: usize = 64;
    #[unsafe(link_section = ".uninit.leftover")]
    static mut LEFTOVER: [u32; WORDS] = [0; WORDS];
    let first = (&raw mut LEFTOVER).cast::<u32>();
    // FNV-1a, by words.
    let seed = (0..WORDS).fold(0x811C_9DC5, |hash: u32, word| {
        // SAFETY: within the array, which only this function uses, from the main loop alone.
        (hash ^ unsafe { read_volatile(first.add(word)) }).wrapping_mul(0x0100_0193)
    });
    // SAFETY: as above.
    unsafe { write_volatile(first, seed) };
    seed
}

/// For a drone that cannot take part: sleeps for good, once it has a clock to wake by. Without one the watchdog restarts it.
pub(crate) fn stop() -> ! {
    loop {
        chip::feed();
        asm::wfi();
    }
}

/// No panic is reachable; `cargo cost` proves it by this handler, which cannot be linked.
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

// The linker script that comes with defmt sorts the strings of the log, and is wanted only where there is a log: named like
// a library, it is found where defmt's build put it.
#[cfg(feature = "defmt")]
#[link(name = "defmt.x", kind = "dylib", modifiers = "+verbatim")]
unsafe extern "C" {}

/// The frames of the log, where they are this program's.
#[cfg(all(feature = "defmt", not(feature = "rtt")))]
mod defmt_frames {
    use core::sync::atomic::{AtomicBool, Ordering};

    use cortex_m::interrupt;
    use cortex_m::register::primask;

    use crate::log;

    #[defmt::global_logger]
    struct Logger;

    /// Whether interrupts are to be let through when the frame is done.
    static INTERRUPTED: AtomicBool = AtomicBool::new(false);

    // SAFETY: interrupts are off from `acquire` to `release`, so no two frames are written at a time; a frame inside a
    // frame, which no `Format` of this program makes, would spoil the text of both and nothing else. No method logs.
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
                // SAFETY: they were on when this frame began, so this is inside no critical section.
                unsafe { interrupt::enable() };
            }
        }

        unsafe fn write(bytes: &[u8]) {
            log::write(bytes);
        }
    }
}
