//! What the Linux programs of a chain have in common: `examples/linux_companion`, a relay, and `examples/linux_ground`, the ground's end
//! of the chain.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`command`] | a command line, checked; what is said of a mistake |
//! | [`config`] | a file, as options before those of the command line |
//! | [`mission`], [`site`] | the mission, and where its line is on earth, as options give them |
//! | [`tty`] | a tty that never blocks, as a `SerialPort` |
//! | [`replug`] | the same, opened again whenever it vanishes: all bytes of a port pass here |
//! | [`tap`] | what goes over ports, in a capture |
//! | [`lines`] | lines of a FIFO, whoever comes and goes |
//! | [`sleep`] | sleep until a port, or something else, needs the program |
//! | [`service`] | what a program that runs for days has beside its work |
//! | [`log`] | its lines, written without ever waiting |
//! | [`requests`], [`system`] | signals that ask something of it; those that end it, and time |
//! | [`socket`], [`counters`] | a socket that tells what is counted; that, as JSON |
//! | [`refusals`] | why frames are refused, in words |
//! | [`notify`] | what systemd is told |
//! | [`epoch`], [`keep`] | the number of this start, in a file; a file that is written whole or not at all |
#![cfg(unix)]
#![forbid(unsafe_code)]

pub mod command;
pub mod config;
pub mod counters;
pub mod epoch;
pub mod keep;
pub mod lines;
pub mod log;
pub mod mission;
pub mod notify;
pub mod refusals;
pub mod replug;
pub mod requests;
pub mod service;
pub mod site;
pub mod sleep;
pub mod socket;
pub mod system;
pub mod tap;
pub mod tty;
