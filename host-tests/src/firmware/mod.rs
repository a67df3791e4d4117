//! The firmware on the ground: its configuration, its image, and drones emulated by QEMU that run it.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`journal`], [`epoch`], [`views`] | what is kept in flash, by the crate that the firmware has it from |
//! | [`uploads`] | the missions that were uploaded in flight, and where they are kept; the firmware's own file |
//! | [`ram`] | two sectors of flash in RAM, to fill them and to spoil them |
//! | [`image`] | the image, built by cargo |
//! | [`emulator`] | one emulated drone: a process, and a socket for each serial port |
//! | [`slow`] | a clock by which emulated drones live in real time |
//! | [`medium`] | what happens to frames between drones, and when they arrive |
//! | [`network`] | who hears whom: threads that carry bytes between sockets |

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
#[path = "../../../examples/stm32f405/uploads.rs"]
pub mod uploads;

pub use uav_relay_kept::{epoch, journal, views};

/// The emulator.
pub const QEMU: &str = "qemu-system-arm";

/// What to type where it is missing.
pub const MISSING: &str =
    "qemu-system-arm is missing; type: sudo apt-get install --yes qemu-system-arm";
