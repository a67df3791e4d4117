//! The clock tree, the independent watchdog and the reset cause of the STM32F4 boards.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`registers`] | the registers that are read and written, and the chip that has them |
//! | [`baud`] | the bit rate of a UART whose HAL believes in another clock |
//! | [`clock`] | the PLL from a crystal or from the HSI, with bounded waits; the HSI alone as the fallback |
//! | [`crystal`] | the crystal's frequency, measured by the HSI |
//! | [`watchdog`] | the independent watchdog, and when the relay's loop may feed it |
//! | [`reset`] | the cause of the last reset |
//!
//! The tests run on a block of registers in RAM, with the rules of RM0090 and RM0390 and every combination of what can fail. **Nothing here was
//! tried on silicon**: the emulator of the tests has no clock tree and no watchdog.
#![no_std]

pub mod baud;
pub mod clock;
pub mod crystal;
pub mod registers;
pub mod reset;
pub mod watchdog;

#[cfg(test)]
mod mock;
