//! The ground's end of a chain, over a real tty: hands it a new mission, or stays at its post.
//!
//! ```text
//! cargo ground --tty /dev/ttyUSB0 --end tx --of 3 \
//!   --key-file network7.key --epoch-file ground.epoch --version 1 --new-interferer 80,700,-300
//! cargo ground --tty /dev/ttyUSB0 --end rx --of 3 \
//!   --key-file network7.key --epoch-file rx.epoch --stand --measurements udp:9000
//! cargo ground --help
//! ```
//! It is the transmitter or the receiver of the chain: connect it where the relay next to that listens, or to the channel that
//! all hear (`--shared`). `--of`, `--network` and the options of the mission say what the relays were loaded with, as `linux_companion`
//! was given it, or as a file has it (`--config`): another channel than the paper's, or a field, only that can say.
//! The options that begin with `--new-` say what is different from now on. The chain is asked what it flies, and values that none of them states stay
//! so. Every change is shown, with the distance that each relay moves, and is to be confirmed (`--yes`, `--dry-run`). Every upload has a
//! larger `--version` than the one before, and the epoch file is this program's own.
//!
//! With `--stand` it does not end: it answers the relays and tells them how strong the interference is where it stands
//! (`--measurements`). Neither a port that vanishes nor a full disk nor a reader that stops ends it or holds it up. It takes no upload
//! while it stands: it is started again with `--version`, knows nothing that it would lose, and the relays know it again by its first frames.
//!
//! Its lines on standard output are as those of `linux_companion`. It ends with status 0 once the chain flies the new mission, or where it
//! stood at Ctrl-C or SIGTERM; 1 if that does not come about or it cannot begin, 2 when the options are wrong.
//!
//! | file | one idea |
//! | --- | --- |
//! | `options.rs` | the command line, checked |
//! | `new.rs` | what is different in a new mission |
//! | `uploading.rs` | the stages of an upload |
//! | `change.rs` | log lines for what an upload changes |
//! | `forecast.rs` | where the relays will fly |
//! | `station.rs` | the loop |
//! | `measurements.rs` | how strong the interference is, from a FIFO, a file or datagrams |
//! | `heard.rs` | which relays are heard |
//! | `report.rs` | the lines it says |
//!
//! What it has in common with the relay is a library, `examples/linux`.
#![cfg_attr(unix, forbid(unsafe_code))]

#[cfg(unix)]
mod change;
#[cfg(unix)]
mod forecast;
#[cfg(unix)]
mod heard;
#[cfg(unix)]
mod measurements;
#[cfg(unix)]
mod new;
#[cfg(unix)]
mod options;
#[cfg(unix)]
mod report;
#[cfg(unix)]
mod station;
#[cfg(unix)]
mod uploading;

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    use std::process::ExitCode;

    let plan = match options::read() {
        Ok(plan) => plan,
        Err(code) => return code,
    };
    match station::stand(&plan) {
        Ok(()) => ExitCode::SUCCESS,
        Err(uploading::Fault { line, status }) => {
            uav_relay_linux::command::complain(&line);
            ExitCode::from(status)
        }
    }
}

#[cfg(not(unix))]
fn main() {
    println!("This program needs Linux or another Unix.");
}
