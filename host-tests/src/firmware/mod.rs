//! The firmware on the ground: its configuration, its image, and drones emulated by QEMU that run it.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`journal`] | a log in two sectors of flash; the firmware's own file, as are the next three |
//! | [`epoch`] | the number that rises at every start, and where it is kept |
//! | [`uploads`] | the missions that were uploaded in flight, and where they are kept |
//! | [`views`] | what the relay has said in the votes on views, and where it is kept |
//! | [`ram`] | two sectors of flash in RAM, to fill them and to spoil them |
//! | [`image`] | the image, built by cargo |
//! | [`emulator`] | one emulated drone: a process, and a socket for each serial port |
//! | [`slow`] | a clock by which emulated drones live in real time |
//! | [`medium`] | what happens to frames between drones, and when they arrive |
//! | [`network`] | who hears whom: threads that carry bytes between sockets |

#[cfg(unix)]
pub mod emulator;
#[path = "../../../examples/stm32f405/epoch.rs"]
pub mod epoch;
pub mod image;
#[path = "../../../examples/stm32f405/journal.rs"]
pub mod journal;
#[cfg(unix)]
pub mod medium;
#[cfg(unix)]
pub mod network;
pub mod ram;
#[cfg(unix)]
pub mod slow;
#[path = "../../../examples/stm32f405/uploads.rs"]
pub mod uploads;
#[path = "../../../examples/stm32f405/views.rs"]
pub mod views;

/// The emulator.
pub const QEMU: &str = "qemu-system-arm";

/// What to type where it is missing.
pub const MISSING: &str =
    "qemu-system-arm is missing; type: sudo apt-get install --yes qemu-system-arm";
