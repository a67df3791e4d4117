//! Main loop: exchange bytes, log events, sleep. In flight only a signal ends it.

use std::hash::{BuildHasher, Hasher, RandomState};

use rustix::event::PollFlags;
use serde_json::json;
use uav_relay::{Auth, Duration, Event, Instant, Key, Relay, Settings, ViewRecord};

use crate::autopilot::{Companion, SigningKey};
use crate::battery::Battery;
use crate::hold_reasons::HoldReasonLog;
use crate::lost::Lost;
use crate::options::Plan;
use crate::ports::Ports;
use crate::positions::Positions;
use crate::report::Report;
use crate::{positions, records, status};
use uav_relay_linux::counters::RejectionReasons;
use uav_relay_linux::log::Source;
use uav_relay_linux::service::Service;
use uav_relay_linux::stored::{StoredFile, next_epoch};
use uav_relay_linux::{config, tap};

/// Time between two checks while the relay waits for its drone's endurance (remaining flight time).
const WAIT: Duration = Duration::from_millis(100);

struct Flight {
    service: Service,
    report: Report,
    relay: Relay,
    ports: Ports,
    positions: Option<Positions>,
    autopilot: Option<Companion>,
    /// File with the relay's votes on the chain's members.
    views: Option<StoredFile>,
    /// File with the newest uploaded mission.
    uploads: Option<StoredFile>,
    rejections: RejectionReasons,
    hold_reasons: HoldReasonLog,
    lost: Lost,
    battery: Battery,
    signs: bool,
}

#[derive(Debug)]
pub(crate) struct Refusal {
    pub(crate) line: String,
    /// True if a restart of the program would fail, too, until the configuration or hardware is changed.
    ///
    /// False for a missing port, which may come back by itself.
    pub(crate) is_final: bool,
}

impl From<String> for Refusal {
    fn from(line: String) -> Self {
        Self {
            line,
            is_final: false,
        }
    }
}

/// Runs the relay until SIGINT or SIGTERM.
pub(crate) fn fly(plan: &Plan) -> Result<(), Refusal> {
    let mut flight = Flight::begin(plan)?;
    flight.service.ready();
    while flight.turn() {}
    flight.end();
    Ok(())
}

impl Flight {
    fn begin(plan: &Plan) -> Result<Self, Refusal> {
        let index = plan.identity.index;
        let source = Source {
            name: format!("relay {index}"),
            key: "index",
            value: index.into(),
        };
        let options = &plan.options;
        let service = Service::begin(&options.log, source, options.status_socket.as_deref())?;
        let log = service.log.clone();
        let mut ports = Ports::open(options)?;
        let listens = plan.settings.listen.is_some();
        let positions = options.positions.as_deref();
        let positions = positions
            .map(|path| Positions::open(path, listens))
            .transpose()?;
        let autopilot = plan
            .autopilot
            .as_ref()
            .map(|plan| Companion::open(plan, service.now()))
            .transpose()?;
        let auth = auth(plan)?;
        let settings = Settings {
            auth,
            ..plan.settings
        };
        let now = service.now();
        let mut relay = Relay::new(plan.mission, plan.identity, settings, seed(), now)
            .map_err(|error| error.to_string())?;
        let reserve = options.battery.reserve();
        relay.set_reserve(reserve);
        let file = options.upload_file.as_deref();
        let resumed =
            file.is_some_and(|file| records::resume_upload(file, &plan.mission, &mut relay, &log));
        let uploads = file.map(records::uploads).transpose()?;
        let views = options.view_file.as_deref();
        let views = views.map(|file| records::resume_views(file, &mut relay, now));
        let (mut views, has_votes) = views.transpose()?.unzip();
        // After `resume_view`, as `wait_as_spare` requires.
        if options.battery.spare {
            relay.wait_as_spare(now);
        }
        // This step is the last one that may fail, so that failed starts leave no files.
        if let Some(asked) = &options.capture {
            tap::attach(&log, env!("CARGO_BIN_NAME"), asked, ports.ttys())?;
        }
        let report = Report::new(
            log.clone(),
            plan.identity,
            &plan.mission,
            plan.settings.guard.map(|guard| guard.geofence),
            plan.autopilot.is_some(),
        );
        report.started(&ports.names(), options.baud);
        config::log_overrides(&plan.overrides, &log);
        report.signing(auth.map(|auth| auth.epoch));
        match &autopilot {
            Some(autopilot) => autopilot.started(&log),
            None => positions::started(&log, positions.as_ref()),
        }
        if resumed {
            report.resumed(&relay);
        }
        if has_votes == Some(true) {
            report.votes_restored();
        } else if let Some(views) = &mut views {
            // The votes are written at once, so that a disk failure shows before flight.
            views.store(&relay.view_record().to_bytes());
        }
        Ok(Self {
            service,
            report,
            relay,
            ports,
            positions,
            autopilot,
            views,
            uploads,
            rejections: RejectionReasons::default(),
            hold_reasons: HoldReasonLog::default(),
            lost: Lost::new(plan.identity.index, plan.mission.relays()),
            battery: Battery::new(reserve.is_some()),
            signs: auth.is_some(),
        })
    }

    /// Runs one cycle of the main loop; returns false when the program must end.
    fn turn(&mut self) -> bool {
        let time = self.service.now();
        let Self { service, relay, .. } = self;
        let log = &service.log;
        let mut drone = None;
        if let Some(positions) = &mut self.positions {
            let mut on_sample = |sample| relay.handle_sample(time, sample);
            let (place, endurance_s) = positions.newest(time, log, &mut on_sample);
            if let Some(place) = place {
                relay.handle_position(time, place, time);
            }
            if let Some([left_s, home_s]) = endurance_s {
                relay.handle_endurance(time, left_s, home_s);
            }
            drone = positions.place(time);
        }
        if let Some(autopilot) = &mut self.autopilot {
            autopilot.exchange(time, log, relay);
            self.lost.remove_cleared(&autopilot.take_cleared());
            drone = autopilot.place(time);
        }
        let reopen = self.ports.tend(time, log);
        let views = &mut self.views;
        let retry = views.as_mut().and_then(|file| file.tend(time, log));
        let mut store = |record: &ViewRecord| {
            let file = views.as_mut();
            file.is_none_or(|file| file.store(&record.to_bytes()))
        };
        let autopilot = self.autopilot.as_ref();
        let waits = self.battery.waits(time, relay, autopilot);
        self.battery.tell_unknown(time, relay, autopilot);
        let wake = if waits {
            self.ports.discard();
            Some(time + WAIT)
        } else {
            self.ports.poll(time, relay, &mut store)
        };
        while let Some(event) = relay.poll_event() {
            if let (Event::Uploaded, Some(uploads), Some(upload)) =
                (event, &mut self.uploads, relay.upload())
            {
                records::store_upload(uploads, upload);
            }
            if let Some(autopilot) = &mut self.autopilot {
                autopilot.handle_event(event);
            }
            self.lost.handle_event(event);
            self.report.event(time, event, relay);
        }
        let autopilot = self.autopilot.as_mut();
        self.battery.tend(time, log, relay, autopilot);
        let moves = self.report.log_movement(time, relay, drone);
        let uploads = self.uploads.as_mut();
        let uploads = uploads.and_then(|file| file.tend(time, log));
        if let Some(why) = self.rejections.next_reason(time, relay.stats(), self.signs) {
            log.line(time, "rejected", why);
        }
        let name = |node| self.report.name(node);
        let waits = self.hold_reasons.tend(time, log, relay, name);
        let again = self.autopilot.as_ref().map(|it| it.wake(service.now()));
        let alive = self.serve_status(time);
        let wakes = [wake, again, reopen, alive, waits, moves, retry, uploads];
        self.sleep(wakes.into_iter().flatten().min())
    }

    /// Handles signals and status requests; returns the time by which the next call is due.
    fn serve_status(&mut self, time: Instant) -> Option<Instant> {
        let Self {
            service,
            relay,
            report,
            ports,
            lost,
            battery,
            ..
        } = self;
        let (uploads, views) = (self.uploads.as_ref(), self.views.as_ref());
        let index = report.index();
        service.tend(time, "relay", |log, command| {
            if let Some((command, user)) = command {
                if let Some(done) = Battery::command(time, log, relay, command, user) {
                    return done;
                }
                return lost.command(time, log, relay, command, user);
            }
            json!({
                "program": env!("CARGO_BIN_NAME"),
                "program_version": env!("CARGO_PKG_VERSION"),
                "uptime_s": time.as_micros() / 1_000_000,
                "relay": status::of_relay(relay, index, lost, |node| report.name(node)),
                "battery": battery.status(relay, time),
                "links": ports.status(),
                "autopilot": self.autopilot.as_ref().map(Companion::status),
                "positions_refused": self.positions.as_ref().map(Positions::invalid_lines),
                "view_file_writes": views.map_or(0, StoredFile::writes),
                "view_file_slowest_ms": views.map_or(0.0, StoredFile::slowest_ms),
                "view_file_failures": views.map_or(0, StoredFile::failures),
                "upload_file_failures": uploads.map_or(0, StoredFile::failures),
                "lines_dropped": log.dropped(),
            })
        })
    }

    /// Sleeps until input or a timer; returns false after a signal to end.
    fn sleep(&mut self, wake: Option<Instant>) -> bool {
        let fifo = self.positions.as_ref().map(Positions::fd);
        let files = [&self.views, &self.uploads].into_iter().flatten();
        let files = files.map(StoredFile::fd);
        let others = fifo.into_iter().chain(files);
        let mut others: Vec<_> = others.map(|fd| (fd, PollFlags::IN)).collect();
        // The autopilot is the last entry, if any.
        let autopilot = self.autopilot.as_ref().and_then(Companion::interest);
        others.extend(autopilot);
        let has_autopilot = autopilot.is_some();
        let is_waiting = self.battery.is_waiting();
        let ttys = self.ports.ttys().filter(|_| !is_waiting);
        let (found, is_over) = self.service.sleep(wake, ttys, &others);
        if has_autopilot
            && let (Some(autopilot), Some(events)) = (&mut self.autopilot, found.last())
        {
            autopilot.noticed(*events);
        }
        !is_over
    }

    fn end(&mut self) {
        self.service.stopping();
        let (time, log) = (self.service.now(), &self.service.log);
        for file in [&mut self.views, &mut self.uploads].into_iter().flatten() {
            file.finish(time, log);
        }
        if let Some(positions) = &self.positions {
            positions.stopped(time, log);
        }
        if let Some(autopilot) = &self.autopilot {
            autopilot.stopped(time, log);
        }
        self.report.stopped(time, self.relay.stats());
        self.service.end();
    }
}

/// Returns the signing key with a new epoch (start counter) for this start; `None` without a key.
///
/// The epoch is stored and never reused.
pub(crate) fn auth(plan: &Plan) -> Result<Option<Auth>, String> {
    let (Some(SigningKey(key)), Some(file)) = (plan.key, &plan.options.epoch_file) else {
        return Ok(None);
    };
    Ok(Some(Auth {
        key: Key::new(key),
        epoch: next_epoch(file)?,
    }))
}

/// Returns a random number, from the seed of std's hash maps.
pub(crate) fn seed() -> u32 {
    let [a, b, c, d, ..] = RandomState::new().build_hasher().finish().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}
