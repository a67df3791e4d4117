//! Ground station at one end of a chain, over a tty. Uploads a new mission, or keeps answering the relays.
//!
//! ```text
//! cargo ground --tty /dev/ttyUSB0 --end tx --of 3 \
//!   --key-file network7.key --epoch-file ground.epoch --version 1 --new-interferer 80,700,-300
//! cargo ground --tty /dev/ttyUSB0 --end rx --of 3 \
//!   --key-file network7.key --epoch-file rx.epoch --stand --measurements udp:9000
//! cargo ground --help
//! ```
//! It acts as the transmitter or the receiver of the chain: connect it to the relay next to that end, or to the channel shared by
//! all (`--shared`). `--of`, `--network` and the mission options describe the mission loaded into the relays, as given to
//! `linux_companion`, or in a file (`--config`); only a file can give a field or another channel than the paper's. The `--new-`
//! options change values of the mission; all others stay as the chain flies them, which the station asks first. It shows every
//! change, with the distance that each relay moves, and asks for confirmation (`--yes`, `--dry-run`). Every upload needs a larger
//! `--version` than the one before. The epoch file must be this program's own.
//!
//! With `--stand` it keeps running: it answers the relays and reports the interference at its position (`--measurements`). With
//! `--web` a page in a browser shows the chain, and uploads missions. It survives a lost port, a full disk and a blocked log. Without
//! the page restart it with `--version` for an upload: it has no state to lose, and the relays recognise it by its first frames.
//!
//! Log lines have the format of `linux_companion`. Exit status: 0 once the chain flies the new mission, or after Ctrl-C or
//! SIGTERM with `--stand`; 1 if the upload fails or it cannot start; 2 if the options are wrong.
//!
//! | file | content |
//! | --- | --- |
//! | `options.rs` | command line, checked |
//! | `check.rs` | check of the chain before flight, `--check` |
//! | `new.rs` | options of the new mission |
//! | `uploading.rs` | stages of an upload |
//! | `change.rs` | log lines for an upload's changes |
//! | `forecast.rs` | forecast of the relays' positions |
//! | `station.rs` | main loop |
//! | `measurements.rs` | measured interference, from a FIFO, a file or datagrams |
//! | `heard.rs` | nearby relays that answer |
//! | `report.rs` | log lines |
//! | `screen.rs` | page that shows the chain in a browser |
//! | `desk.rs` | previews and uploads of the page |
//! | `terrain.rs` | ground below the chain, for the page |
//! | `tiles.rs` | map pictures of the page |
//!
//! It shares a library with the relay, `examples/linux`.
#![cfg_attr(unix, forbid(unsafe_code))]

#[cfg(unix)]
mod change;
#[cfg(unix)]
mod check;
#[cfg(unix)]
mod desk;
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
mod screen;
#[cfg(unix)]
mod station;
#[cfg(unix)]
mod terrain;
#[cfg(unix)]
mod tiles;
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
            uav_relay_linux::command::print_line(&line);
            ExitCode::from(status)
        }
    }
}

#[cfg(not(unix))]
fn main() {
    println!("This program needs Linux or another Unix.");
}
