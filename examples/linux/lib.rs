//! Modules shared by the Linux programs: `linux_companion` (relay) and `linux_ground` (ground station).
//!
//! | module | content |
//! | --- | --- |
//! | [`check`] | colours, end and verdict of a check before flight |
//! | [`command`] | command-line parsing and its error messages |
//! | [`config`] | `--config` file, as options before those of the command line |
//! | [`mission`], [`site`] | options of the mission, and of the Tx and Rx positions on earth |
//! | [`tty`] | non-blocking tty as a `SerialPort` |
//! | [`replug`] | tty that is reopened when it disappears; counts and captures its bytes |
//! | [`tap`] | capture of the ports' traffic |
//! | [`lines`] | lines from a FIFO, for any sequence of writers |
//! | [`service`] | clock, sleep, log, signals, status socket and systemd |
//! | [`log`] | log lines, written without blocking the program |
//! | [`socket`] | status socket |
//! | [`counters`] | frame counters as JSON; reasons of rejected frames, in words |
//! | [`notify`] | systemd notifications |
//! | [`stored`] | epoch file, and records written in flight |
#![cfg(unix)]
#![forbid(unsafe_code)]

pub mod check;
pub mod command;
pub mod config;
pub mod counters;
pub mod lines;
pub mod log;
pub mod mission;
pub mod notify;
pub mod replug;
pub mod service;
pub mod site;
pub mod socket;
pub mod stored;
pub mod tap;
pub mod tty;
