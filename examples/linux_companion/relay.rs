//! The loop: move bytes, report events, sleep.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant as Clock};

use signal_hook::consts::{SIGINT, SIGTERM};
use uav_relay::{Auth, Instant, Key, Relay, Settings};

use crate::epoch;
use crate::options::Plan;
use crate::ports::{Ports, Woken};
use crate::report::Report;

/// Runs the relay until it is told to stop.
///
/// # Errors
/// One line that says why it could not go on.
pub(crate) fn fly(plan: &Plan) -> Result<(), String> {
    let stop = on_signals().map_err(|error| format!("cannot wait for signals: {error}"))?;
    let mut ports = Ports::open(&plan.ttys, plan.baud)?;
    let clock = Clock::now();
    let auth = auth(plan)?;
    let settings = Settings {
        auth,
        ..plan.settings
    };
    let mut relay = Relay::new(plan.mission, plan.identity, settings, seed(), now(clock))
        .map_err(|error| error.to_string())?;
    let report = Report::new(plan.identity, &plan.mission);
    let names: Vec<String> = ports.ttys().map(|tty| tty.name().to_owned()).collect();
    report.started(&names, plan.baud)?;
    report.signs(auth.map(|auth| auth.epoch))?;
    loop {
        let wake = ports.poll(now(clock), &mut relay);
        while let Some(event) = relay.poll_event() {
            report.event(now(clock), event, &relay)?;
        }
        if let Some(line) = ports.ttys().find_map(|tty| tty.failure()) {
            return Err(line.to_owned());
        }
        let span = wake.map(|at| Duration::from_micros(at.since(now(clock)).as_micros()));
        if ports.sleep(span, stop.as_fd())? == Woken::Stop {
            return report.stopped(now(clock), relay.stats());
        }
    }
}

/// What frames are signed with in this start.
fn auth(plan: &Plan) -> Result<Option<Auth>, String> {
    let Some(secret) = &plan.secret else {
        return Ok(None);
    };
    Ok(Some(Auth {
        key: Key::new(secret.key),
        epoch: epoch::next(&secret.epoch_file)?,
    }))
}

/// Time since the start, by a clock that nobody sets.
fn now(clock: Clock) -> Instant {
    Instant::from_micros(u64::try_from(clock.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// Another number at every start, of the source that std keys its hash maps with.
fn seed() -> u32 {
    let [a, b, c, d, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// A stream that gets a byte at SIGINT or SIGTERM, so that poll(2) notices.
fn on_signals() -> io::Result<UnixStream> {
    let (ours, theirs) = UnixStream::pair()?;
    signal_hook::low_level::pipe::register(SIGINT, theirs.try_clone()?)?;
    signal_hook::low_level::pipe::register(SIGTERM, theirs)?;
    Ok(ours)
}
