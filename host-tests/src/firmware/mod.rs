//! Firmware tests on a PC: configuration, image, and drones emulated by QEMU.
//!
//! | file | content |
//! | --- | --- |
//! | [`journal`], [`epoch`], [`views`] | persistent state in flash, from the crate that the firmware uses |
//! | [`uploads`] | persistent uploads, the firmware's own file |
//! | [`ram`] | mock of two flash sectors, which can be worn or lose power |
//! | [`image`] | firmware image, built by cargo |
//! | [`emulator`] | emulated drone: a process, and a socket for each serial port |
//! | [`slow`] | clock that makes emulated drones run in real time |
//! | [`medium`] | faults and latency of frames between drones |
//! | [`network`] | topology, and threads that carry bytes between sockets |

#[cfg(unix)]
pub mod emulator;
pub mod image;
#[cfg(unix)]
pub mod medium;
#[cfg(unix)]
pub mod network;
pub mod ram;
#[cfg(unix)]
pub mod slow;
#[path = "../../../examples/stm32f405/firmware/uploads.rs"]
pub mod uploads;

pub use uav_relay_kept::{epoch, journal, views};

/// Program name of the emulator.
pub const QEMU: &str = "qemu-system-arm";

/// Error message for a missing emulator, with the command that installs it.
pub const MISSING: &str =
    "qemu-system-arm is missing; type: sudo apt-get install --yes qemu-system-arm";
