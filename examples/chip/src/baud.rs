//! Bit rate of a UART whose HAL assumes the wrong clock.

use crate::crystal::HSI_HZ;

/// Returns the bit rate to request from a HAL that assumes the clock after a reset, 16 MHz.
///
/// The port then runs at `baud` bit/s, although the UART's clock is `apb_hz`, a multiple of 1 MHz.
pub const fn compensated_baud(baud: u32, apb_hz: u32) -> u32 {
    let apb_mhz = match apb_hz / 1_000_000 {
        0 => 1,
        mhz => mhz,
    };
    (baud * (HSI_HZ / 1_000_000) + apb_mhz / 2) / apb_mhz
}
