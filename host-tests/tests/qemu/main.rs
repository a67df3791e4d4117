//! Firmware image in QEMU: chains of emulated drones end in the positions of the simulated chain, to the bit.
//!
//! Every drone is a process with the same ELF as on an STM32F405, and a configuration block in its flash. The medium between
//! them paces bytes and may damage them; logs are decoded like `defmt-print` does. Without `qemu-system-arm` these tests fail
//! with a hint. For a chain of 20: `-- --ignored`.
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
