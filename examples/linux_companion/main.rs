//! Relay on a Linux companion computer, over ttys: USB adapters, UARTs, telemetry radios.
//!
//! ```text
//! cargo companion --index 2 --of 3 --upstream /dev/ttyUSB0 --downstream /dev/ttyUSB1
//! cargo companion --index 2 --of 3 --shared /dev/ttyUSB0      # one radio for all
//! cargo companion --help
//! ```
//! The first relay needs no `--upstream`, the last one no `--downstream`. All relays of a chain need the same `--of`,
//! `--baud`, `--network` and mission; another mission of a neighbour is reported.
//!
//! With `--key-file` and `--epoch-file` frames are signed. Without them anybody in range can move the drones, and the
//! log warns. A signing relay accepts new missions in flight (uploaded by `examples/linux_ground`), and
//! `--upload-file` keeps them over a restart. `--view-file` keeps the relay's votes on the membership of the chain
//! over a restart in flight; remove the file before another flight.
//!
//! With `--autopilot`, `--site-tx` and `--site-rx` it flies a drone with PX4 or ArduCopter over a tty or UDP. It
//! streams targets and receives positions, so that the guard can keep drones apart. With `--positions` another
//! program reports the position, and flies to the logged setpoints. With neither, nothing keeps drones apart, and the
//! log warns.
//!
//! `--config` reads all options from one file: the scenario of the other tools, with further sections.
//!
//! Every event is one line on standard output or in a file, with each f32 also as its bits. In flight the relay
//! survives a lost port, a full disk and a blocked log. Exit status: 0 after Ctrl-C or SIGTERM, 1 if it cannot start,
//! 2 if the options or the --view-file are wrong.
//!
//! | file | content |
//! | --- | --- |
//! | `options.rs` | command line, checked |
//! | `check/` | check before flight, `--check` |
//! | `ports.rs` | ttys of either wiring |
//! | `autopilot.rs` | link to the autopilot |
//! | `battery.rs` | departure of a drone whose battery is low |
//! | `datagrams.rs` | UDP port of the autopilot |
//! | `unanswered.rs` | report of an autopilot that does not answer |
//! | `off_line.rs` | report of a drone far from its line |
//! | `positions.rs` | positions and measurements from a FIFO |
//! | `relay.rs` | main loop |
//! | `report.rs` | log lines |
//! | `movement.rs` | log lines for setpoints and the arrival |
//! | `status.rs` | state of the relay as JSON |
//! | `records.rs` | files of the newest uploaded mission, and of the relay's votes on views |
//! | `hold_reasons.rs` | log lines for the reasons of a hold |
//! | `lost.rs` | lost relays, and the operator's command to clear them |
//!
//! It shares a library with the ground station, `examples/linux`. It also runs on other kinds of Unix; on a Mac the
//! ttys are called `/dev/cu.*`.
#![cfg_attr(unix, forbid(unsafe_code))]

#[cfg(unix)]
mod autopilot;
#[cfg(unix)]
mod battery;
#[cfg(unix)]
mod check;
#[cfg(unix)]
mod datagrams;
#[cfg(unix)]
mod hold_reasons;
#[cfg(unix)]
mod lost;
#[cfg(unix)]
mod movement;
#[cfg(unix)]
mod off_line;
#[cfg(unix)]
mod options;
#[cfg(unix)]
mod ports;
#[cfg(unix)]
mod positions;
#[cfg(unix)]
mod records;
#[cfg(unix)]
mod relay;
#[cfg(unix)]
mod report;
#[cfg(unix)]
mod status;
#[cfg(unix)]
mod unanswered;

#[cfg(unix)]
fn main() -> std::process::ExitCode {
    use std::process::ExitCode;

    use relay::Refusal;

    let plan = match options::read() {
        Ok(plan) => plan,
        Err(code) => return code,
    };
    if let Some(seconds) = plan.options.check {
        let is_green = check::run(&plan, uav_relay::Duration::from_millis(1_000 * seconds));
        return ExitCode::from(u8::from(!is_green));
    }
    match relay::fly(&plan) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Refusal { line, is_final }) => {
            uav_relay_linux::command::print_line(&line);
            if is_final {
                // Status 2, as for wrong options: the systemd unit does not restart the program.
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
