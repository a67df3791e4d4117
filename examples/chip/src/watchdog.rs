//! The independent watchdog: it has an oscillator of its own, and resets the chip unless it is fed.
//!
//! It is fed once a turn of the relay's loop, after ports and timers were served, and never by an interrupt. So a loop that hangs, a panic, a hard
//! fault, and a clock that stops have the chip restart. A sleep is ended after [`TURN_MS`] at the latest.

use crate::registers::{Register, Registers};

/// The LSI divided by 64: 500 counts a second at its typical 32 kHz.
const PRESCALER: u32 = 0b100;
const RELOAD: u32 = 2_999;

/// Time from the last feeding to the reset: typical, and at the fastest and slowest LSI of the data sheets, 47 and 17 kHz. An erase of a flash sector
/// of 128 KiB stops the core for 2 s at most.
pub const TIMEOUT_MS: [u32; 3] = [6_000, 4_085, 11_294];

/// Longest sleep of a relay's loop.
pub const TURN_MS: u64 = 500;

/// A timer of the relay may be overdue for so long in a loop that is fed.
pub const LATE_MS: u64 = 1_000;

/// Words of the key register.
const START: u32 = 0xCCCC;
const UNLOCK: u32 = 0x5555;
const FEED: u32 = 0xAAAA;

/// Reads of the status until the prescaler and the reload value have reached the watchdog's clock: five periods of the LSI, 0.3 ms at most.
const POLLS: u32 = 10_000;

/// Starts the watchdog, for good. It stands still while a debugger has stopped the core. Bounded work.
pub fn start(chip: &mut impl Registers) {
    chip.modify(Register::DebugFreeze, 0, 1 << 12);
    chip.write(Register::WatchdogKey, START);
    chip.write(Register::WatchdogKey, UNLOCK);
    chip.write(Register::WatchdogPrescaler, PRESCALER);
    chip.write(Register::WatchdogReload, RELOAD);
    // Not ready in time, it counts with what it had at its reset: 0.5 s, and the feeding below starts with the new value.
    let _ = chip.wait(Register::WatchdogStatus, 0b11, 0, POLLS);
    feed(chip);
}

/// Feeds it: one write.
pub fn feed(chip: &mut impl Registers) {
    chip.write(Register::WatchdogKey, FEED);
}

#[cfg(test)]
mod tests {
    use super::{PRESCALER, RELOAD, TIMEOUT_MS, feed, start};
    use crate::mock::Block;
    use crate::registers::Register::{DebugFreeze, WatchdogKey, WatchdogPrescaler, WatchdogReload};

    #[test]
    fn it_is_started_unlocked_set_and_fed() {
        let mut block = Block::default();
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
    fn it_waits_as_long_as_is_said() {
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
