//! A relay on a Linux companion computer, over real ttys: USB adapters, the UART of a header, telemetry radios.
//!
//! ```text
//! cargo companion --index 2 --of 3 --upstream /dev/ttyUSB0 --downstream /dev/ttyUSB1
//! cargo companion --index 2 --of 3 --shared /dev/ttyUSB0      # one radio for all
//! cargo companion --help
//! ```
//! The first relay needs no `--upstream`, the last one no `--downstream`. All relays of a chain are given the same `--of`,
//! `--baud`, `--network` and mission; a neighbour that was given another mission is reported.
//!
//! With `--key-file` and `--epoch-file` its frames are signed; without, anybody in range can move the drones, and it says so. One
//! that signs takes new missions in flight (`examples/linux_ground` uploads them), and with `--upload-file` it still has them when it
//! is switched on again. With `--view-file` it stands by what it has said in votes on who is in the chain when it is switched on again
//! in flight; before another flight that file is removed.
//!
//! With `--autopilot`, `--site-tx` and `--site-rx` it flies a drone with a PX4 or an ArduCopter, over a tty or UDP: it streams where to
//! fly and hears where the drone is, so its setpoints keep drones apart on their way. With `--positions` it is told where the drone is by
//! another program, which flies to the setpoints that are printed. Without either nothing keeps drones apart, and it says so.
//!
//! `--config` reads all of that from one file, the scenario of the other tools with sections of its own.
//!
//! Every event is one line on standard output or in a file; an f32 also as its bits. In flight neither a port that vanishes nor a full disk nor
//! a reader that stops ends it or holds it up. It ends with status 0 at Ctrl-C or SIGTERM, 1 where it cannot begin, 2 when
//! the options or the --view-file are wrong.
//!
//! | file | one idea |
//! | --- | --- |
//! | `options.rs` | the command line, checked |
//! | `section.rs` | the companion's part of the file, as options |
//! | `listen.rs` | the part of it that is how the chain finds its interferer |
//! | `ports.rs` | the ttys of either wiring |
//! | `autopilot.rs` | the autopilot |
//! | `datagrams.rs` | its UDP port |
//! | `answers.rs` | an autopilot that does not answer |
//! | `astray.rs` | a drone that is far from its line |
//! | `positions.rs` | where the drone is, and what is heard there, from a FIFO |
//! | `relay.rs` | the loop |
//! | `report.rs` | the lines it says |
//! | `movement.rs` | log lines for setpoints and the arrival |
//! | `status.rs` | how the relay is, as JSON |
//! | `uploads.rs` | the newest mission that was uploaded, in a file |
//! | `views.rs` | what it has said in the votes on views, in a file |
//! | `waits.rs` | log lines for what keeps the drone from its place |
//! | `lost.rs` | lost relays, and the operator's command to clear them |
//! | `kept.rs` | a file that is written in flight, by a thread of its own |
//! | `gate.rs` | nothing is sent before it is in such a file |
//!
//! What it has in common with the ground station is a library, `examples/linux`.
//!
//! It runs on other kinds of Unix too; on a Mac the ttys are called `/dev/cu.*`.
#![cfg_attr(unix, forbid(unsafe_code))]

#[cfg(unix)]
mod answers;
#[cfg(unix)]
mod astray;
#[cfg(unix)]
mod autopilot;
#[cfg(unix)]
mod datagrams;
#[cfg(unix)]
mod gate;
#[cfg(unix)]
mod kept;
#[cfg(unix)]
mod listen;
#[cfg(unix)]
mod lost;
#[cfg(unix)]
mod movement;
#[cfg(unix)]
mod options;
#[cfg(unix)]
mod ports;
#[cfg(unix)]
mod positions;
#[cfg(unix)]
mod relay;
#[cfg(unix)]
mod report;
#[cfg(unix)]
mod section;
#[cfg(unix)]
mod status;
#[cfg(unix)]
mod uploads;
#[cfg(unix)]
mod views;
#[cfg(unix)]
mod waits;

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    use std::process::ExitCode;

    use relay::Refusal;

    let plan = match options::read() {
        Ok(plan) => plan,
        Err(code) => return code,
    };
    match relay::fly(&plan) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Refusal { line, is_final }) => {
            uav_relay_linux::command::complain(&line);
            if is_final {
                // As for wrong options: the unit does not start it again.
                ExitCode::from(2)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}

#[cfg(not(unix))]
fn main() {
    println!("This program needs Linux or another Unix.");
}
