//! Check before flight, `--check`: one line for each finding, green or red.
//!
//! | file | content |
//! | --- | --- |
//! | `mod.rs` | files, ports and clock of this computer; main loop |
//! | `drone.rs` | autopilot: mode, position, parameters |
//! | `radio.rs` | neighbours, without taking part in the chain |
//!
//! Nothing that the check sends moves a drone. At first it only listens, and it sends nothing to relays while one of
//! their drones may fly. It sends HEARTBEAT, message intervals and parameter requests to the autopilot, and hellos,
//! heartbeats and handshakes to relays. It uses up one epoch, because no epoch may be used twice.

mod drone;
mod radio;

use std::fs::{OpenOptions, remove_file};
use std::io::Write as _;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};
use std::time::{Duration as Span, Instant as Clock, SystemTime, UNIX_EPOCH};

use rustix::fs::statvfs;
use rustix::process::geteuid;
use uav_relay::{Duration, Instant, Port, Relay};
use uav_relay_linux::check::{End, Finding, colour, verdict};
use uav_relay_linux::tty::Tty;

use crate::options::Plan;
use crate::records;
use crate::relay::{auth, seed};
use drone::Drone;
use radio::Radio;

/// Result line of the check: its subject, such as `autopilot`, and its finding (green or red).
pub(crate) type Line = (&'static str, Finding);

/// Time for which the check still answers its neighbours after all lines of the check are green.
///
/// The neighbours may be running a check of their own.
const LINGER: Duration = Duration::from_millis(5_000);

/// Pause between two cycles of the main loop.
const TURN: Span = Span::from_millis(20);

/// Minimum free space for the files of a flight, bytes.
const FREE: u64 = 64 << 20;

/// Seconds from 1970 to 2024. A clock that shows an earlier time has not been set.
const YEAR_2024_S: u64 = 1_704_067_200;

/// Name of the file with udev rules, in the folder of the configuration or in /etc/udev/rules.d.
const RULES: &str = "70-uav-relay.rules";

/// Checks this computer, then the autopilot and the neighbours for at most `limit`.
///
/// At first the check only receives from the neighbours, and sends them nothing. Prints all lines; returns true if all
/// are green.
pub(crate) fn run(plan: &Plan, limit: Duration) -> bool {
    let options = &plan.options;
    let (mut lines, ports) = ports(plan);
    lines.push((
        "mission",
        Ok(format!(
            "digest 0x{:04x}, {} relays",
            plan.mission.digest(),
            plan.mission.relays()
        )),
    ));
    lines.push(("clock", clock(SystemTime::now())));
    let written = [
        ("--epoch-file", &options.epoch_file),
        ("--upload-file", &options.upload_file),
        ("--view-file", &options.view_file),
        ("--log-file", &options.log.log_file),
        ("--capture", &options.capture),
    ];
    for (option, file) in written
        .iter()
        .filter_map(|(option, file)| Some((*option, file.as_deref()?)))
    {
        let space =
            space(file).map(|free| format!("{option} {}: {} MB free", file.display(), free >> 20));
        lines.push((
            "disk",
            space.map_err(|why| format!("{option} {}: {why}", file.display())),
        ));
    }
    lines.extend(records(plan));
    lines.extend(rules(plan));
    let auth = match (&plan.key, auth(plan)) {
        (None, _) => {
            lines.push((
                "key",
                Ok(
                    "none: frames are not signed, so anybody in range can move the drones"
                        .to_owned(),
                ),
            ));
            Ok(None)
        }
        (Some(_), Ok(auth)) => {
            let used = auth.map_or(0, |auth| auth.epoch);
            lines.push((
                "epoch",
                Ok(format!(
                    "{used} is used by this check; the flight will use a larger epoch"
                )),
            ));
            Ok(auth)
        }
        (Some(_), Err(why)) => {
            lines.push(("epoch", Err(why.clone())));
            Err(why)
        }
    };
    lines.iter().for_each(print);
    let begun = Clock::now();
    let now =
        || Instant::from_micros(u64::try_from(begun.elapsed().as_micros()).unwrap_or(u64::MAX));
    let radio = match (ports, auth) {
        (Some(ports), Ok(auth)) => Radio::new(plan, auth, ports, now()),
        (None, _) => Err("not checked: a port to the neighbours is missing".to_owned()),
        (_, Err(_)) => Err("not checked: without an epoch nothing may be sent".to_owned()),
    };
    let drone = plan
        .autopilot
        .as_ref()
        .map(|autopilot| Drone::open(plan, autopilot));
    let found = watch(plan, now, limit, drone, radio);
    found.iter().for_each(print);
    lines.extend(found);
    let red = lines.iter().filter(|(_, finding)| finding.is_err()).count();
    let (Ok(last) | Err(last)) = verdict(red, lines.len(), "lines");
    let _ = writeln!(std::io::stdout(), "{last}");
    red == 0
}

/// Exchanges messages with autopilot and neighbours until all lines stay green, or for `limit`.
fn watch(
    plan: &Plan,
    now: impl Fn() -> Instant,
    limit: Duration,
    mut drone: Option<Result<Drone, String>>,
    mut radio: Result<Radio, String>,
) -> Vec<Line> {
    let mut end = End {
        limit: radio.as_ref().map_or_else(|_| now(), Radio::sends_from) + limit,
        green_for: LINGER.min(Duration::from_micros(limit.as_micros() / 4)),
        green_since: None,
    };
    loop {
        let time = now();
        let mut lines = Vec::new();
        let mut may_send = true;
        match &mut drone {
            None if plan.options.no_autopilot => {
                lines.push(("autopilot", Ok("none: the drone is not checked".to_owned())));
            }
            None => {
                may_send = false;
                lines.push(("autopilot", Err("no autopilot is configured: give --autopilot, or --no-autopilot if the drone is not to be checked".to_owned())));
            }
            Some(Err(why)) => {
                may_send = false;
                lines.push(("autopilot", Err(why.clone())));
            }
            Some(Ok(drone)) => {
                drone.exchange(time);
                may_send = drone.is_disarmed();
                lines.extend(drone.lines(time));
            }
        }
        match &mut radio {
            Err(why) => lines.push(("neighbours", Err(why.clone()))),
            Ok(radio) => {
                radio.exchange(time, may_send);
                lines.extend(radio.lines(time));
            }
        }
        if end.is_reached(time, lines.iter().all(|(_, finding)| finding.is_ok())) {
            return lines;
        }
        std::thread::sleep(TURN);
    }
}

/// Prints a line; a closed standard output is ignored.
fn print((subject, finding): &Line) {
    let colour = colour(finding.is_ok());
    let (Ok(text) | Err(text)) = finding;
    let _ = writeln!(std::io::stdout(), "{colour:<6} {subject:<11} {text}");
}

/// Opens the ports toward other relays. Returns a result line for each port, and the opened ports.
///
/// The opened ports are `None` if any port could not be opened.
fn ports(plan: &Plan) -> (Vec<Line>, Option<Vec<(Port, Tty)>>) {
    let options = &plan.options;
    let named = [
        ("--upstream", Port::Upstream, &options.upstream),
        ("--downstream", Port::Downstream, &options.downstream),
        ("--shared", Port::Shared, &options.shared),
    ];
    let (mut lines, mut open) = (Vec::new(), Some(Vec::new()));
    for (option, port, path) in named {
        let Some(path) = path else { continue };
        let tty = Tty::open(option, path, options.baud);
        let line = match tty {
            Ok(tty) => {
                if let Some(open) = &mut open {
                    open.push((port, tty));
                }
                Ok(format!(
                    "{option} {}: open at {} bit/s",
                    path.display(),
                    options.baud
                ))
            }
            Err(why) => {
                open = None;
                Err(why)
            }
        };
        lines.push(("port", line));
    }
    (lines, open)
}

fn clock(now: SystemTime) -> Result<String, String> {
    let since = now.duration_since(UNIX_EPOCH).unwrap_or_default();
    let text = humantime::format_rfc3339_seconds(UNIX_EPOCH + since);
    if since.as_secs() < YEAR_2024_S {
        return Err(format!(
            "{text} is before 2024: set the clock of this computer, which new epochs and signatures depend on"
        ));
    }
    Ok(text.to_string())
}

/// Returns the free disk space for `file`, bytes. Tests first if a file can be written to the folder of `file`.
fn space(file: &Path) -> Result<u64, String> {
    let failed = |error: std::io::Error| format!("cannot be written: {error}");
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    if let Ok(about) = file.metadata() {
        let kind = about.file_type();
        let is_special = kind.is_char_device() || kind.is_fifo() || kind.is_socket();
        let text: &[u8] = if is_special { b"\n" } else { b"" };
        let mut open = OpenOptions::new();
        open.append(true)
            .open(file)
            .and_then(|mut it| it.write_all(text))
            .map_err(failed)?;
        if is_special {
            return Ok(FREE);
        }
    }
    // Root may write everywhere, but the user of the systemd unit may not.
    let owner = folder.metadata().map_or(0, |about| about.uid());
    if geteuid().is_root() && owner != 0 {
        return Err(format!(
            "its folder belongs to user {owner}: run the check as that user, not as root"
        ));
    }
    let trial = folder.join(format!(".uav-relay-check-{}", std::process::id()));
    let written = std::fs::write(&trial, [0; 4_096]);
    let _ = remove_file(&trial);
    written.map_err(failed)?;
    let disk = statvfs(folder).map_err(|error| failed(error.into()))?;
    let free = disk.f_bavail.saturating_mul(disk.f_frsize);
    if free < FREE {
        return Err(format!(
            "{} MB are free on the disk, at least {} MB are needed",
            free >> 20,
            FREE >> 20
        ));
    }
    Ok(free)
}

/// Checks that no votes and no uploaded mission are stored from earlier starts of the program.
fn records(plan: &Plan) -> Vec<Line> {
    let mut lines = Vec::new();
    if let Some(file) = &plan.options.view_file {
        let relay = Relay::new(
            plan.mission,
            plan.identity,
            plan.settings,
            seed(),
            Instant::ZERO,
        );
        let votes = relay
            .map_err(|error| error.to_string())
            .and_then(|mut relay| {
                let votes = records::resume_views(file, &mut relay, Instant::ZERO);
                votes.map_err(|refusal| refusal.line)
            });
        let name = format!("--view-file {}", file.display());
        lines.push((
            "votes",
            votes.and_then(|(_, has_votes)| {
                if has_votes {
                    Err(format!("{name}: has votes of an earlier flight; remove it"))
                } else {
                    Ok(format!("{name}: has no votes"))
                }
            }),
        ));
    }
    if let Some(file) = &plan.options.upload_file {
        let name = format!("--upload-file {}", file.display());
        let upload = records::load_upload(file, &plan.mission);
        lines.push((
            "upload",
            upload.and_then(|upload| match upload {
                Some(upload) => Err(format!(
                    "{name}: has version {} of an earlier flight, which the relay would fly instead of the mission of its file; remove it",
                    upload.version()
                )),
                None => Ok(format!("{name}: has no mission")),
            }),
        ));
    }
    lines
}

/// Checks the file with udev rules. `None` if it is missing and no port has a name given by such a rule.
fn rules(plan: &Plan) -> Option<Line> {
    let options = &plan.options;
    let ports = [&options.upstream, &options.downstream, &options.shared];
    let needs = ports
        .into_iter()
        .flatten()
        .any(|path| path.starts_with("/dev") && path.to_string_lossy().contains("/uav-relay-"));
    let beside = options.config.as_deref().and_then(Path::parent);
    let places = beside.into_iter().map(|folder| folder.join(RULES));
    let places = places.chain([PathBuf::from("/etc/udev/rules.d").join(RULES)]);
    let found = places
        .into_iter()
        .find_map(|file| Some((std::fs::read_to_string(&file).ok()?, file)));
    let Some((text, file)) = found else {
        return needs.then(|| {
            (
                "udev",
                Err(format!(
                    "{RULES} is neither in the folder of the configuration nor in /etc/udev/rules.d: install the bundle of this relay"
                )),
            )
        });
    };
    let open = text
        .lines()
        .zip(1..)
        .find(|(line, _)| !line.starts_with('#') && line.contains("FILL-IN"));
    Some((
        "udev",
        match open {
            Some((_, number)) => Err(format!(
                "{}:{number}: FILL-IN-SERIAL-NUMBER is not replaced by the serial number of the adapter",
                file.display()
            )),
            None => Ok(format!("{}: complete", file.display())),
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::{YEAR_2024_S, clock};
    use std::time::{Duration, UNIX_EPOCH};

    #[test]
    fn a_clock_before_2024_is_red() {
        let at = |seconds| clock(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(at(YEAR_2024_S), Ok("2024-01-01T00:00:00Z".to_owned()));
        let error = at(YEAR_2024_S - 1).unwrap_err();
        assert!(
            error.starts_with("2023-12-31T23:59:59Z is before 2024"),
            "{error}"
        );
    }
}
