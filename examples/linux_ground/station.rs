//! The loop: move bytes, say how far the upload is, sleep.

use std::os::fd::{AsFd, BorrowedFd};
use std::time::Instant as Clock;

use rustix::event::{PollFd, Timespec, poll};
use rustix::io::Errno;
use uav_relay::serial::SerialPort as _;
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::MAX_FRAME;
use uav_relay::{Auth, Ground, Instant, Key, Progress, Side, Stats};

use crate::options::Plan;
use uav_relay_linux::epoch;
use uav_relay_linux::log::Log;
use uav_relay_linux::site::Between;
use uav_relay_linux::system::{now, on_stop};
use uav_relay_linux::tty::Tty;

/// How long the last lines may take.
const LAST_LINES: std::time::Duration = std::time::Duration::from_millis(500);

/// A tty, and what it has not taken yet.
struct Wire {
    tty: Tty,
    outgoing: Vec<u8>,
}

/// Uploads until the chain flies the new mission.
///
/// # Errors
/// One line that says why it does not.
pub(crate) fn upload(plan: &Plan) -> Result<(), String> {
    let stop = on_stop()?;
    let mut wire = Wire {
        tty: Tty::open("--tty", &plan.tty, plan.baud)?,
        outgoing: Vec::new(),
    };
    let clock = Clock::now();
    let auth = Auth {
        key: Key::new(plan.key),
        epoch: epoch::next(&plan.epoch_file)?,
    };
    let log = Log::open(&plan.log)?;
    started(&log, plan, auth.epoch);
    let mut ground = Ground::new(&plan.loaded, plan.end, plan.network, plan.wiring, auth);
    let begun = now(clock);
    ground
        .upload(begun, plan.upload)
        .map_err(|error| error.to_string())?;
    let end = begun + plan.timeout;
    let mut last = Progress::Idle;
    loop {
        wire.turn(&mut ground, now(clock));
        if ground.progress() != last {
            last = ground.progress();
            say(&log, now(clock), plan, last);
        }
        match last {
            Progress::Flown { .. } => {
                log.flush(LAST_LINES);
                return Ok(());
            }
            Progress::Outdated { version } => return Err(outdated(plan, version)),
            _ => {}
        }
        if let Some(failure) = wire.tty.failure() {
            return Err(failure.to_owned());
        }
        let time = now(clock);
        if time >= end {
            return Err(late(plan, last, &ground));
        }
        let wake = ground.poll_timeout().map_or(end, |again| again.min(end));
        if wire.sleep(time, wake, stop.as_fd())? {
            return Err("stopped before the chain was known to fly it".to_owned());
        }
    }
}

impl Wire {
    /// Moves what can be moved.
    fn turn(&mut self, ground: &mut Ground, now: Instant) {
        let mut bytes = [0; 256];
        // What is wrong with the tty is in its failure.
        while let Ok(count @ 1..) = self.tty.read(&mut bytes) {
            ground.handle_bytes(bytes.get(..count).unwrap_or_default());
        }
        ground.handle_timeout(now);
        let mut frame = [0; MAX_FRAME];
        while let Some(len) = ground.poll_transmit(&mut frame) {
            self.outgoing.extend(frame.get(..len).unwrap_or_default());
        }
        if !self.outgoing.is_empty() {
            let sent = self.tty.write(&self.outgoing).unwrap_or(0);
            self.outgoing.drain(..sent);
        }
    }

    /// Sleeps until the tty needs it, or until `wake`; whether the program was told to end.
    fn sleep(&mut self, now: Instant, wake: Instant, stop: BorrowedFd<'_>) -> Result<bool, String> {
        let span = std::time::Duration::from_micros(wake.since(now).as_micros());
        let timeout = Timespec::try_from(span).ok();
        let mut fds = [
            PollFd::from_borrowed_fd(stop, rustix::event::PollFlags::IN),
            PollFd::from_borrowed_fd(self.tty.as_fd(), self.tty.interest()),
        ];
        match poll(&mut fds, timeout.as_ref()) {
            Ok(_) => {}
            Err(Errno::INTR) => return Ok(false),
            Err(error) => return Err(format!("cannot sleep: {error}")),
        }
        let [stopped, events] = fds.map(|fd| fd.revents());
        self.tty.noticed(events);
        Ok(!stopped.is_empty())
    }
}

const fn name(plan: &Plan) -> &'static str {
    match plan.end {
        Side::Upstream => "transmitter",
        Side::Downstream => "receiver",
    }
}

fn started(log: &Log, plan: &Plan, epoch: u32) {
    let (end, relays, network) = (name(plan), plan.loaded.relays(), plan.network);
    let (base, baud) = (digest(&plan.loaded), plan.baud);
    let tty = plan.tty.display();
    log.tell(
        Instant::ZERO,
        "started",
        format_args!(
            "{end} of {relays} relays, network {network}, loaded mission 0x{base:04x}, --tty {tty}, {baud} baud"
        ),
    );
    log.tell(
        Instant::ZERO,
        "signed",
        format_args!("frames carry a tag, epoch {epoch}"),
    );
}

fn say(log: &Log, now: Instant, plan: &Plan, progress: Progress) {
    let version = plan.upload.version();
    match progress {
        Progress::Offering => {
            let digest = plan.upload.id().digest;
            let what = format!("version {version}, mission 0x{digest:04x}");
            match plan.upload.sites() {
                Some(sites) => {
                    log.tell(now, "offering", format_args!("{what}, {}", Between(sites)));
                }
                None => log.tell(now, "offering", format_args!("{what}")),
            }
        }
        Progress::Held { by } => log.tell(
            now,
            "held",
            format_args!("relay {by} holds version {version}, and the others are asked"),
        ),
        Progress::Flown { by, view } => log.tell(
            now,
            "flown",
            format_args!(
                "relay {by} flies version {version}, view {} of the chain",
                view.number()
            ),
        ),
        // The others are the program's end.
        _ => {}
    }
}

fn outdated(plan: &Plan, held: u16) -> String {
    let version = plan.upload.version();
    match held.checked_add(1) {
        Some(next) => {
            format!(
                "--version {version}: must be within {next} to 65535, the relays hold version {held}"
            )
        }
        None => {
            format!("--version {version}: the relays hold version {held}, the last one there is")
        }
    }
}

fn late(plan: &Plan, progress: Progress, ground: &Ground) -> String {
    let seconds = plan.timeout.as_micros() / 1_000_000;
    let version = plan.upload.version();
    let state = match progress {
        Progress::Held { by } => {
            format!("relay {by} holds version {version}, and the chain does not fly it yet")
        }
        _ => format!(
            "no relay is known to hold version {version}: {}",
            why(plan, ground.stats())
        ),
    };
    let refused = ground.refused();
    format!("--timeout {seconds}: {state}; {refused} frames refused")
}

/// What most likely is wrong, by what was heard.
fn why(plan: &Plan, stats: &Stats) -> String {
    let faults = [
        (
            stats.mission,
            format!(
                "hellos are of relays that were loaded with another mission than 0x{:04x}; say what they were loaded with",
                digest(&plan.loaded)
            ),
        ),
        (
            stats.forged,
            "frames have a wrong tag: is the key in --key-file that of the relays?".to_owned(),
        ),
        (
            stats.unsigned,
            "frames are not signed: relays without --key-file take no uploads".to_owned(),
        ),
        (
            stats.foreign,
            format!(
                "frames are of another network number than --network {}",
                plan.network
            ),
        ),
        (
            stats.version,
            "frames are of another version of the format".to_owned(),
        ),
        (
            stats.misaddressed.saturating_add(stats.overheard),
            format!(
                "frames are heard and none is for the {}: are --key-file, --end and --of those of the relays? The log of the nearest one says more",
                name(plan)
            ),
        ),
        (
            stats.crc,
            format!(
                "frames are damaged: is --baud {} that of the relays?",
                plan.baud
            ),
        ),
    ];
    match faults.into_iter().find(|(count, _)| *count > 0) {
        Some((count, fault)) => format!("{count} {fault}"),
        None if stats.received > 0 => "one answers, and does not take it yet".to_owned(),
        // A relay that flies another mission says no more than that it is there.
        None if stats.handshakes > 0 => format!(
            "one is there and says nothing: it was loaded with another mission than 0x{:04x}, most likely",
            digest(&plan.loaded)
        ),
        None => format!(
            "nothing was heard; is --tty {} the one toward the chain, and are --network {}, --baud {}, --end and --key-file right? The log of a relay that hears this says more",
            plan.tty.display(),
            plan.network,
            plan.baud
        ),
    }
}
