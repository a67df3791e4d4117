//! Clock tree, independent watchdog and reset cause of the STM32F4 boards.
//!
//! | file | content |
//! | --- | --- |
//! | [`registers`] | registers, and their access on the chip |
//! | [`baud`] | bit rate of a UART whose HAL assumes another clock |
//! | [`clock`] | PLL from a crystal or from the HSI, with bounded waits; else the HSI alone |
//! | [`crystal`] | check of the crystal's frequency against the HSI |
//! | [`watchdog`] | independent watchdog, and the rules for feeding it |
//! | [`reset`] | cause of the last reset |
//!
//! The tests run on a mock of the registers in RAM, with the rules of RM0090 and RM0390, for every combination of
//! faults. **Not tested on hardware yet**: the emulator of the tests has no clock tree and no watchdog.
#![no_std]

pub mod baud;
pub mod clock;
pub mod crystal;
pub mod registers;
pub mod reset;
pub mod watchdog;

#[cfg(test)]
mod mock;
