//! Time since the start, and sleep until a time or received bytes.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use cortex_m::asm;
use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m_rt::exception;
use uav_relay::Instant;

/// Number of `SysTick` cycles in a microsecond. `SysTick` interrupts every millisecond.
static MICRO: AtomicU32 = AtomicU32::new(1);

/// Milliseconds since the start. The 64 bits never overflow.
static TICKS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));
/// True if bytes have arrived since the last sleep.
static INPUT: AtomicBool = AtomicBool::new(false);

pub(crate) struct Clock {
    last: Instant,
}

impl Clock {
    /// Starts the clock, which counts the milliseconds of `SysTick`. `core_hz` is a multiple of 1 MHz.
    pub(crate) fn start(mut tick: SYST, core_hz: u32) -> Self {
        let micro = core_hz / 1_000_000;
        MICRO.store(micro, Ordering::Relaxed);
        tick.set_clock_source(SystClkSource::Core);
        tick.set_reload(1_000 * micro - 1);
        tick.clear_current();
        tick.enable_counter();
        tick.enable_interrupt();
        Self {
            last: Instant::ZERO,
        }
    }

    /// Returns the time since the start; it never decreases.
    pub(crate) fn now(&mut self) -> Instant {
        self.last = self.last.max(Instant::from_micros(micros()));
        self.last
    }

    /// Sleeps until the time `wake`, if any, or until bytes arrive.
    pub(crate) fn sleep(&mut self, wake: Option<Instant>) {
        while wake.is_none_or(|wake| self.now() < wake) {
            // An interrupt after this check of INPUT stays pending, and makes `wfi` return.
            let input = free(|_| {
                let input = INPUT.swap(false, Ordering::Relaxed);
                if !input {
                    asm::wfi();
                }
                input
            });
            if input {
                return;
            }
        }
    }
}

pub(crate) fn wake() {
    INPUT.store(true, Ordering::Relaxed);
}

pub(crate) fn micros() -> u64 {
    let (ticks, count) = free(|cs| {
        let ticks = TICKS.borrow(cs).get();
        let count = SYST::get_current();
        if SCB::is_pendst_pending() {
            // The millisecond is over, but its interrupt waits for the end of this critical section.
            (ticks.wrapping_add(1), SYST::get_current())
        } else {
            (ticks, count)
        }
    });
    let micro = MICRO.load(Ordering::Relaxed).max(1);
    // The counter counts down to 0, starting at the number of cycles of a millisecond minus 1.
    let tick = micro.saturating_mul(1_000);
    let cycles = tick.wrapping_sub(count) % tick;
    ticks
        .wrapping_mul(1_000)
        .wrapping_add(u64::from(cycles / micro))
}

#[exception]
fn SysTick() {
    free(|cs| {
        let ticks = TICKS.borrow(cs);
        ticks.set(ticks.get().wrapping_add(1));
    });
}
