//! The ground's end of an upload, over a real tty: hands the chain a new mission, and ends once that is flown.
//!
//! ```text
//! cargo ground --tty /dev/ttyUSB0 --end tx --of 3 \
//!   --key-file network7.key --epoch-file ground.epoch --version 1 --new-interferer 80,700,-300
//! cargo ground --help
//! ```
//! It is the transmitter or the receiver of the chain: connect it where the relay next to that listens, or to the channel that
//! all hear (`--shared`). `--of`, `--network` and the options of the mission say what the relays were loaded with, as `linux_companion`
//! was given it, or as a file has it (`--config`): another channel than the paper's, or a field, only that can say.
//! The options that begin with `--new-` say what is different from now on. Every upload has a larger `--version` than the
//! one before, and the epoch file is this program's own.
//!
//! Its lines on standard output are as those of `linux_companion`. It ends with status 0 once the chain flies the new mission, 1 if
//! that does not come about, 2 when the options are wrong.
//!
//! | file | one idea |
//! | --- | --- |
//! | `options.rs` | the command line, checked |
//! | `station.rs` | the loop |
//!
//! What it has in common with the relay is a library, `examples/linux`.
#![cfg_attr(unix, forbid(unsafe_code))]

#[cfg(unix)]
mod options;
#[cfg(unix)]
mod station;

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    use std::process::ExitCode;

    let plan = match options::read() {
        Ok(plan) => plan,
        Err(code) => return code,
    };
    match station::upload(&plan) {
        Ok(()) => ExitCode::SUCCESS,
        Err(line) => {
            uav_relay_linux::command::complain(&line);
            ExitCode::FAILURE
        }
    }
}

#[cfg(not(unix))]
fn main() {
    println!("This program needs Linux or another Unix.");
}
