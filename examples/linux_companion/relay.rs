//! The loop: move bytes, report events, sleep.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::os::fd::AsFd;
use std::time::{Duration, Instant as Clock};

use rustix::event::PollFlags;
use uav_relay::{Auth, Event, Key, Relay, Settings, Upload};

use crate::autopilot::Companion;
use crate::options::Plan;
use crate::ports::{Ports, Woken};
use crate::positions::Positions;
use crate::report::Report;
use crate::system::{now, on_signals};
use crate::views::Views;
use crate::{epoch, positions, uploads};

/// Runs the relay until it is told to stop.
///
/// # Errors
/// One line that says why it could not go on.
pub(crate) fn fly(plan: &Plan) -> Result<(), String> {
    let stop = on_signals()?;
    let mut ports = Ports::open(&plan.ttys, plan.baud)?;
    let listens = plan.settings.listen.is_some();
    let mut positions = plan
        .positions
        .as_deref()
        .map(|path| Positions::open(path, listens))
        .transpose()?;
    let clock = Clock::now();
    let mut autopilot = plan
        .autopilot
        .as_ref()
        .map(|plan| Companion::open(plan, now(clock)))
        .transpose()?;
    let auth = auth(plan)?;
    let settings = Settings {
        auth,
        ..plan.settings
    };
    let mut held = held(plan);
    let mut views = Views::load(plan.view_file.as_deref())?;
    let mut relay = Relay::new(plan.mission, plan.identity, settings, seed(), now(clock))
        .map_err(|error| error.to_string())?;
    if let Some(Err(error)) = held.as_ref().map(|held| relay.resume(held)) {
        eprintln!("--upload-file: {error}; not used");
        held = None;
    }
    if let Some(record) = views.stored() {
        relay
            .resume_view(now(clock), record)
            .map_err(|error| views.refused(&error.to_string()))?;
    }
    let report = Report::new(plan.identity, &plan.mission);
    let names: Vec<String> = ports.ttys().map(|tty| tty.name().to_owned()).collect();
    report.started(&names, plan.baud)?;
    report.signs(auth.map(|auth| auth.epoch))?;
    match &autopilot {
        Some(autopilot) => autopilot.started()?,
        None => positions::started(positions.as_ref())?,
    }
    if held.is_some() {
        report.resumed(&relay)?;
    }
    if views.stored().is_some() {
        report.stands_by()?;
    }
    loop {
        if let Some(positions) = &mut positions
            && let Some(place) = positions.newest(now(clock), &mut |sample| {
                relay.handle_sample(now(clock), sample);
            })?
        {
            relay.handle_position(now(clock), now(clock), place);
        }
        if let Some(autopilot) = &mut autopilot {
            autopilot.drive(now(clock), &mut relay)?;
        }
        let wake = ports.poll(now(clock), &mut relay, &mut |relay| views.keep(relay));
        while let Some(event) = relay.poll_event() {
            if event == Event::Uploaded {
                store(plan, &relay);
            }
            if let Some(autopilot) = &mut autopilot {
                autopilot.tell(event);
            }
            report.event(now(clock), event, &relay)?;
        }
        if let Some(line) = ports.ttys().find_map(|tty| tty.failure()) {
            return Err(line.to_owned());
        }
        let also = autopilot.as_ref().map(|it| it.wake(now(clock)));
        let wake = wake.into_iter().chain(also).min();
        let span = wake.map(|at| Duration::from_micros(at.since(now(clock)).as_micros()));
        let fifo = positions.as_ref().map(|it| (it.fd(), PollFlags::IN));
        let other = fifo.or_else(|| autopilot.as_ref()?.interest());
        let (woken, found) = ports.sleep(span, stop.as_fd(), other)?;
        if let Some(autopilot) = &mut autopilot {
            autopilot.noticed(found);
        }
        if woken == Woken::Stop {
            if let Some(positions) = &positions {
                positions.stopped(now(clock))?;
            }
            if let Some(autopilot) = &autopilot {
                autopilot.stopped(now(clock))?;
            }
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

/// Another number at every start, of the source that std keys its hash maps with.
fn seed() -> u32 {
    let [a, b, c, d, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// What was uploaded before this start. A file that is of no use is no reason not to fly: the chain hands the relay the newer mission.
fn held(plan: &Plan) -> Option<Upload> {
    let file = plan.secret.as_ref()?.upload_file.as_ref()?;
    uploads::load(file, &plan.mission).unwrap_or_else(|line| {
        eprintln!("{line}");
        None
    })
}

/// Keeps what was uploaded for the next start; where it cannot be kept, it is flown all the same.
fn store(plan: &Plan, relay: &Relay) {
    let file = plan.secret.as_ref().map(|secret| &secret.upload_file);
    if let (Some(Some(file)), Some(upload)) = (file, relay.upload())
        && let Err(line) = uploads::store(file, upload)
    {
        eprintln!("{line}");
    }
}
