//! The bit rate of a UART whose HAL believes in another clock.

use crate::crystal::HSI_HZ;

/// Returns the bit rate that a HAL is to be asked for, if it believes in the clock of the reset, 16 MHz, and the UART has `apb_hz`, a multiple of
/// 1 MHz: then the port runs at `baud` bit/s.
pub const fn believed(baud: u32, apb_hz: u32) -> u32 {
    let apb_mhz = match apb_hz / 1_000_000 {
        0 => 1,
        mhz => mhz,
    };
    (baud * (HSI_HZ / 1_000_000) + apb_mhz / 2) / apb_mhz
}
