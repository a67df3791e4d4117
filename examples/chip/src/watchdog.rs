//! Independent watchdog: it has an oscillator of its own, and resets the chip unless it is fed.
//!
//! The relay's main loop feeds it once per cycle, after serving ports and timers; no interrupt does. So a hanging
//! loop, a panic, a hard fault or a stopped clock restarts the chip. The loop sleeps for at most [`TURN_MS`].

use crate::registers::{Register, Registers};

/// Prescaler setting: division by 64. The watchdog then counts about 500 times a second.
const PRESCALER: u32 = 0b100;
const RELOAD: u32 = 2_999;

/// Time from the last feeding to the reset, ms: typical, shortest and longest.
///
/// The watchdog's oscillator runs at 32, 47 or 17 kHz in these cases. Each time exceeds that of an erase of a flash
/// sector of 128 KiB, which stops the core for at most 2 s.
pub const TIMEOUT_MS: [u32; 3] = [6_000, 4_085, 11_294];

/// Maximum sleep of the relay's main loop, ms. The loop feeds the watchdog before it sleeps.
pub const TURN_MS: u64 = 500;

/// Lateness of the relay's next timer, ms, from which on the main loop must not feed the watchdog.
pub const LATE_MS: u64 = 1_000;

/// Returns true if the main loop may feed the watchdog at `now_us`.
///
/// `due_us` is the time at which the relay's next timer expires; `None` without a timer. The result is true while this
/// timer is less than [`LATE_MS`] late.
pub const fn may_feed(now_us: u64, due_us: Option<u64>) -> bool {
    match due_us {
        Some(due_us) => now_us < due_us.saturating_add(1_000 * LATE_MS),
        None => true,
    }
}

/// Value of the watchdog's key register that starts it.
const START: u32 = 0xCCCC;
/// Value of the watchdog's key register that unlocks its settings.
const UNLOCK: u32 = 0x5555;
/// Value of the watchdog's key register that feeds it.
const FEED: u32 = 0xAAAA;

/// Maximum number of status reads until the settings take effect. They take effect within 0.3 ms.
const POLLS: u32 = 10_000;

/// Starts the watchdog, which only a reset can stop. The watchdog pauses while a debugger halts the core. Bounded work.
pub fn start(chip: &mut impl Registers) {
    chip.modify(Register::DebugFreeze, 0, 1 << 12);
    chip.write(Register::WatchdogKey, START);
    chip.write(Register::WatchdogKey, UNLOCK);
    chip.write(Register::WatchdogPrescaler, PRESCALER);
    chip.write(Register::WatchdogReload, RELOAD);
    // If the settings take effect late, the watchdog first counts from its reset value, 0.5 s. After this feeding it
    // uses the new value.
    let _ = chip.wait(Register::WatchdogStatus, 0b11, 0, POLLS);
    feed(chip);
}

/// Feeds the watchdog: one write.
pub fn feed(chip: &mut impl Registers) {
    chip.write(Register::WatchdogKey, FEED);
}

#[cfg(test)]
mod tests {
    use super::{PRESCALER, RELOAD, TIMEOUT_MS, feed, may_feed, start};
    use crate::mock::MockRegisters;
    use crate::registers::Register::{DebugFreeze, WatchdogKey, WatchdogPrescaler, WatchdogReload};

    #[test]
    fn the_watchdog_is_started_unlocked_set_and_fed() {
        let mut block = MockRegisters::default();
        start(&mut block);
        let expected = [
            (DebugFreeze, 0x1000),
            (WatchdogKey, 0xCCCC),
            (WatchdogKey, 0x5555),
            (WatchdogPrescaler, 4),
            (WatchdogReload, 2_999),
            (WatchdogKey, 0xAAAA),
        ];
        assert_eq!(&block.written[..], expected);
        feed(&mut block);
        assert_eq!(block.written[6..], [(WatchdogKey, 0xAAAA)]);
    }

    #[test]
    fn a_loop_with_a_timer_that_is_late_by_a_second_may_not_feed() {
        for (now_us, due_us, may) in [
            (0, None, true),
            (u64::MAX, None, true),
            (5_000_000, Some(9_000_000), true),
            (5_000_000, Some(5_000_000), true),
            (5_999_999, Some(5_000_000), true),
            (6_000_000, Some(5_000_000), false),
            (u64::MAX, Some(5_000_000), false),
            (u64::MAX - 1, Some(u64::MAX), true),
        ] {
            assert_eq!(may_feed(now_us, due_us), may, "{now_us} {due_us:?}");
        }
    }

    #[test]
    fn the_watchdog_has_the_documented_period() {
        let divisor = 4 << PRESCALER;
        for (ms, khz) in TIMEOUT_MS.into_iter().zip([32, 47, 17]) {
            assert_eq!((RELOAD + 1) * divisor / khz, ms);
        }
        let [_, least, most] = TIMEOUT_MS;
        assert!(
            u64::from(least) > 2_000 + 2 * super::TURN_MS,
            "an erase, and a turn before and after it"
        );
        assert!(most < 15_000, "before its neighbours give it up");
    }
}
