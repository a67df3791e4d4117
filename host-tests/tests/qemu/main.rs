//! Firmware image in QEMU: emulated drones end in the simulated chain's positions, to the bit.
//!
//! Every drone is a process with the same ELF as on an STM32F405 and a configuration block in its flash, on a medium that paces
//! bytes and may damage them. Without `qemu-system-arm` these tests fail with a hint. For a chain of 20: `-- --ignored`.
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
