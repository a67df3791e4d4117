//! The image that is flashed, run by QEMU: chains of emulated drones settle where the simulated chain says, to the bit.
//!
//! Every drone is a process with the very ELF that a person flashes to an STM32F405, and a configuration block in its flash.
//! Between them is a medium that paces bytes and may spoil them; each drone's log is decoded as `defmt-print` would. Without
//! `qemu-system-arm` these tests fail and say what to type. A chain of 20: `-- --ignored`.
#![cfg(unix)]

mod chain;
mod fleet;
mod flight;
mod golden;
mod listening;
mod log;
mod mavsdk;
mod methods;
mod radio;
mod signed;
mod silence;
mod three;
mod upload;
mod vehicle;
mod views;
mod watchdog;
