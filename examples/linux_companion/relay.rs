//! The loop: move bytes, say what happened, sleep. Once it flies nothing ends it but a signal.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant as Clock};

use rustix::event::PollFlags;
use serde_json::{Value, json};
use uav_relay::{Auth, Event, Instant, Key, Relay, Settings, Upload};

use crate::autopilot::Companion;
use crate::log::Log;
use crate::notify::Notify;
use crate::options::Plan;
use crate::ports::Ports;
use crate::positions::Positions;
use crate::refusals::Refusals;
use crate::report::Report;
use crate::requests::Requests;
use crate::socket::StatusSocket;
use crate::system::{now, on_stop};
use crate::uploads::Uploads;
use crate::views::Views;
use crate::{epoch, positions, socket, status, uploads, views};

/// How long the last lines may take.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Where it is not possible to sleep as it should be.
const NAP: Duration = Duration::from_millis(10);

/// A relay, and all that it is connected to.
struct Flight {
    clock: Clock,
    log: Log,
    report: Report,
    relay: Relay,
    ports: Ports,
    positions: Option<Positions>,
    autopilot: Option<Companion>,
    views: Views,
    uploads: Option<Uploads>,
    refusals: Refusals,
    signs: bool,
    socket: Option<StatusSocket>,
    requests: Requests,
    notify: Option<Notify>,
    stop: UnixStream,
}

/// Runs the relay until it is told to stop.
///
/// # Errors
/// One line that says why it could not begin.
pub(crate) fn fly(plan: &Plan) -> Result<(), String> {
    let mut flight = Flight::begin(plan)?;
    flight.notify.iter().for_each(Notify::ready);
    while flight.turn() {}
    flight.end();
    Ok(())
}

impl Flight {
    fn begin(plan: &Plan) -> Result<Self, String> {
        let (stop, requests) = (on_stop()?, Requests::new()?);
        let mut ports = Ports::open(&plan.ttys, plan.baud, plan.capture.as_deref())?;
        let listens = plan.settings.listen.is_some();
        let positions = plan
            .positions
            .as_deref()
            .map(|path| Positions::open(path, listens))
            .transpose()?;
        let socket = plan
            .status_socket
            .as_deref()
            .map(StatusSocket::open)
            .transpose()?;
        let clock = Clock::now();
        let autopilot = plan
            .autopilot
            .as_ref()
            .map(|plan| Companion::open(plan, now(clock)))
            .transpose()?;
        let auth = auth(plan)?;
        let settings = Settings {
            auth,
            ..plan.settings
        };
        let views = Views::load(plan.view_file.as_deref())?;
        let mut relay = Relay::new(plan.mission, plan.identity, settings, seed(), now(clock))
            .map_err(|error| error.to_string())?;
        let log = Log::open(&plan.log)?;
        let resumed = resume(plan, &mut relay, &log);
        if let Some(record) = views.stored() {
            relay
                .resume_view(now(clock), record)
                .map_err(|error| views::refused(plan.view_file.as_deref(), &error.to_string()))?;
        }
        let report = Report::new(log.clone(), plan.identity, &plan.mission);
        report.started(&ports.names(), plan.baud);
        report.signs(auth.map(|auth| auth.epoch));
        match &autopilot {
            Some(autopilot) => autopilot.started(&log),
            None => positions::started(&log, positions.as_ref()),
        }
        if resumed {
            report.resumed(&relay);
        }
        if views.stored().is_some() {
            report.stands_by();
        }
        let file = plan.secret.as_ref().and_then(|it| it.upload_file.as_ref());
        Ok(Self {
            clock,
            log,
            report,
            relay,
            ports,
            positions,
            autopilot,
            views,
            uploads: file.map(|file| Uploads::new(file)),
            refusals: Refusals::default(),
            signs: auth.is_some(),
            socket,
            requests,
            notify: Notify::open(),
            stop,
        })
    }

    /// One turn of the loop; whether there is to be another.
    fn turn(&mut self) -> bool {
        let time = now(self.clock);
        let Self { log, relay, .. } = self;
        if let Some(positions) = &mut self.positions {
            let mut heard = |sample| relay.handle_sample(time, sample);
            if let Some(place) = positions.newest(time, log, &mut heard) {
                relay.handle_position(time, time, place);
            }
        }
        if let Some(autopilot) = &mut self.autopilot {
            autopilot.drive(time, log, relay);
        }
        let reopen = self.ports.tend(time, log);
        let views = &mut self.views;
        let mut keep = |relay: &Relay| views.keep(time, log, relay);
        let wake = self.ports.poll(time, relay, &mut keep);
        while let Some(event) = relay.poll_event() {
            if let (Event::Uploaded, Some(uploads), Some(upload)) =
                (event, &mut self.uploads, relay.upload())
            {
                uploads.take(upload);
            }
            if let Some(autopilot) = &mut self.autopilot {
                autopilot.tell(event);
            }
            self.report.event(time, event, relay);
        }
        if let Some(uploads) = &mut self.uploads {
            uploads.tend(time, log);
        }
        if let Some(why) = self.refusals.look(time, relay.stats(), self.signs) {
            log.tell(time, "not taken", format_args!("{why}"));
        }
        self.asked(time);
        let again = self.autopilot.as_ref().map(|it| it.wake(now(self.clock)));
        let alive = self.notify.as_mut().and_then(|it| it.tend(time));
        let others = [again, reopen, alive].into_iter().flatten();
        let wake = wake.into_iter().chain(others).min();
        self.sleep(wake)
    }

    /// Does what signals and the socket ask for.
    fn asked(&mut self, time: Instant) {
        if self.requests.take_hangup() {
            self.log.reopen();
            self.log.tell(
                time,
                "hang-up",
                format_args!("the log was opened again, the relay goes on"),
            );
        }
        if self.requests.take_status() {
            let status = self.status(time);
            let text = status.to_string();
            self.log.say(time, "status", status, format_args!("{text}"));
        }
        let clients = self.socket.as_ref().map(StatusSocket::clients);
        for client in clients.into_iter().flatten() {
            socket::answer(client, &self.status(time));
        }
    }

    fn status(&mut self, time: Instant) -> Value {
        let upload_failures = self.uploads.as_ref().map_or(0, Uploads::failures);
        json!({
            "program": env!("CARGO_BIN_NAME"),
            "program_version": env!("CARGO_PKG_VERSION"),
            "uptime_s": time.as_micros() / 1_000_000,
            "relay": status::of_relay(&self.relay, |node| self.report.name(node)),
            "links": self.ports.status(),
            "autopilot": self.autopilot.as_ref().map(Companion::status),
            "positions_refused": self.positions.as_ref().map(Positions::bad),
            "view_file_failures": self.views.failures(),
            "upload_file_failures": upload_failures,
            "lines_dropped": self.log.dropped(),
        })
    }

    /// Sleeps until there may be something to do; whether nobody said that it is enough.
    fn sleep(&mut self, wake: Option<Instant>) -> bool {
        let time = now(self.clock);
        let span = wake.map(|at| Duration::from_micros(at.since(time).as_micros()));
        let [hangup, status] = self.requests.fds();
        let mut others: Vec<(BorrowedFd<'_>, PollFlags)> = vec![
            (self.stop.as_fd(), PollFlags::IN),
            (hangup, PollFlags::IN),
            (status, PollFlags::IN),
        ];
        let socket = self.socket.as_ref().map(StatusSocket::fd);
        let fifo = self.positions.as_ref().map(Positions::fd);
        others.extend(socket.into_iter().chain(fifo).map(|fd| (fd, PollFlags::IN)));
        // The last one, if any.
        let autopilot = self.autopilot.as_ref().and_then(Companion::interest);
        others.extend(autopilot);
        let found = self.ports.sleep(span, &others);
        let has_autopilot = autopilot.is_some();
        let Ok(found) = found else {
            // For want of memory, say. A relay in the air goes on.
            std::thread::sleep(span.map_or(NAP, |span| span.min(NAP)));
            return true;
        };
        if let (true, Some(autopilot), Some(events)) =
            (has_autopilot, &mut self.autopilot, found.last())
        {
            autopilot.noticed(*events);
        }
        found.first().is_none_or(PollFlags::is_empty)
    }

    fn end(&mut self) {
        self.notify.iter().for_each(Notify::stopping);
        let time = now(self.clock);
        if let Some(positions) = &self.positions {
            positions.stopped(time, &self.log);
        }
        if let Some(autopilot) = &self.autopilot {
            autopilot.stopped(time, &self.log);
        }
        self.report.stopped(time, self.relay.stats());
        self.log.flush(LAST_LINES);
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

/// Whether the relay goes on with what was uploaded before this start. A file that is of no use is no reason not to fly: the chain hands
/// the relay the newer mission.
fn resume(plan: &Plan, relay: &mut Relay, log: &Log) -> bool {
    let unused = |why: &str| log.tell(Instant::ZERO, "file", format_args!("{why}; not used"));
    match held(plan) {
        Ok(None) => false,
        Err(line) => {
            unused(&line);
            false
        }
        Ok(Some(held)) => match relay.resume(&held) {
            Ok(()) => true,
            Err(error) => {
                unused(&format!("--upload-file: {error}"));
                false
            }
        },
    }
}

fn held(plan: &Plan) -> Result<Option<Upload>, String> {
    let file = plan.secret.as_ref().and_then(|it| it.upload_file.as_ref());
    file.map_or(Ok(None), |file| uploads::load(file, &plan.mission))
}
