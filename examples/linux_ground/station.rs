//! Main loop: exchange bytes, forward measurements, log the upload's progress, sleep.

use std::os::fd::AsFd as _;

use rustix::event::PollFlags;
use serde_json::{Value, json};
use uav_relay::MAX_FRAME;
use uav_relay::serial::SerialPort as _;
use uav_relay::{Auth, Duration, Ground, Instant, Key, Progress, Report, Upload};
use uav_relay_linux::counters::{RejectionReasons, counted};
use uav_relay_linux::log::{Log, Source};
use uav_relay_linux::replug::Replug;
use uav_relay_linux::service::Service;
use uav_relay_linux::stored::next_epoch;
use uav_relay_linux::{config, tap};

use crate::check::Check;
use crate::desk::{Desk, Parts};
use crate::heard::NearbyRelays;
use crate::measurements::{Measurements, name};
use crate::options::Plan;
use crate::report;
use crate::screen::Web;
use crate::uploading::{Fault, Outcome, Uploading, digest_of};

const READS: usize = 64;

/// Time between two evaluations of the relays' reports during a check.
const LOOK_AGAIN: Duration = Duration::from_millis(200);

struct Station<'a> {
    plan: &'a Plan,
    service: Service,
    ground: Ground,
    tty: Replug,
    /// Bytes of the frame being sent that the tty has not accepted yet.
    outgoing: Vec<u8>,
    measurements: Option<Measurements>,
    hearing: NearbyRelays,
    rejections: RejectionReasons,
    uploading: Option<Uploading>,
    check: Option<Check>,
    web: Option<Web>,
    desk: Desk,
    /// True if the operator has answered the request for confirmation. Standard input can then be read without waiting.
    is_answered: bool,
}

/// Runs the station until the chain flies the new mission; with `--stand` until SIGINT or SIGTERM.
///
/// # Errors
/// One line that states why the station could not start, or why the chain does not fly the mission.
pub(crate) fn stand(plan: &Plan) -> Result<(), Fault> {
    let mut station = Station::begin(plan)?;
    station.service.ready();
    let outcome = loop {
        if let Some(over) = station.turn() {
            break over;
        }
    };
    station.service.end();
    outcome
}

impl<'a> Station<'a> {
    fn begin(plan: &'a Plan) -> Result<Self, String> {
        let source = Source {
            name: name(plan.end).to_owned(),
            key: "station",
            value: name(plan.end).into(),
        };
        let options = &plan.options;
        let service = Service::begin(&options.log, source, options.status_socket.as_deref())?;
        let mut tty = Replug::open("--tty", &options.tty, options.baud)?;
        let measurements = options.measurements.as_deref();
        let measurements = measurements
            .map(|from| Measurements::open(from, plan.end))
            .transpose()?;
        let auth = Auth {
            key: Key::new(plan.key),
            epoch: next_epoch(&options.epoch_file)?,
        };
        report::started(&service.log, plan, auth.epoch);
        config::log_overrides(&plan.overrides, &service.log);
        if let Some(asked) = &options.capture {
            let tty = std::iter::once(&mut tty);
            tap::attach(&service.log, env!("CARGO_BIN_NAME"), asked, tty)?;
        }
        let loaded = &plan.loaded.mission;
        let mut ground = Ground::new(loaded, plan.end, options.network, plan.wiring(), auth);
        let uploading = options
            .version
            .map(|it| Uploading::begin(service.now(), plan, Some(it), None, &mut ground));
        let check = options
            .check
            .map(|seconds| Check::begin(service.now(), seconds, &mut ground));
        let web = options
            .web
            .map(|address| Web::start(address, service.now(), &service.log, plan, &mut ground))
            .transpose()?;
        let (web, posts) = web.unzip();
        Ok(Self {
            plan,
            service,
            ground,
            tty,
            outgoing: Vec::new(),
            measurements,
            hearing: NearbyRelays::default(),
            rejections: RejectionReasons::default(),
            uploading,
            check,
            web,
            desk: Desk::new(posts),
            is_answered: false,
        })
    }

    fn turn(&mut self) -> Outcome {
        let time = self.service.now();
        let log = &self.service.log;
        self.tty.tend(time, log);
        let arrived = self.exchange(time);
        let log = &self.service.log;
        let silent = self.hearing.update(time, &self.ground, log);
        if let Some(why) = self.rejections.next_reason(time, self.ground.stats(), true) {
            log.line(time, "rejected", why);
        }
        let check = self.check.as_mut();
        let checked = check.and_then(|it| it.turn(time, self.plan, &arrived, log));
        if checked.is_some() {
            return checked;
        }
        if let Some(web) = &mut self.web {
            web.take(&arrived);
        }
        let outcome = self.uploading(time);
        if outcome.is_some() {
            return outcome;
        }
        let parts = Parts {
            plan: self.plan,
            ground: &mut self.ground,
            uploading: &mut self.uploading,
            web: self.web.as_mut(),
            tty: &mut self.tty,
        };
        self.desk.turn(time, &self.service.log, parts);
        let (ground, uploading) = (&mut self.ground, self.uploading.as_ref());
        let log = &self.service.log;
        let web = self.web.as_mut();
        let shown = web.map(|web| web.turn(time, log, self.plan, ground, uploading));
        // An upload's next stage begins with a frame.
        self.send();
        let alive = self.serve_status(time);
        let measured = self.measurements.as_ref().and_then(Measurements::wake);
        let late = self.uploading.as_ref().and_then(Uploading::wake);
        let look_again = self.check.as_ref().map(|_| time + LOOK_AGAIN);
        let others = [
            look_again,
            silent,
            alive,
            measured,
            late,
            shown,
            self.tty.wake(),
        ];
        let wake = others
            .into_iter()
            .flatten()
            .chain(self.ground.poll_timeout());
        self.sleep(wake.min())
    }

    /// Receives and sends what is due. Returns the received reports.
    fn exchange(&mut self, time: Instant) -> Vec<Report> {
        let Self { ground, tty, .. } = self;
        let (mut bytes, mut reports) = ([0; 256], Vec::new());
        for _ in 0..READS {
            // Errors of the tty are logged by `tend`.
            let Ok(count @ 1..) = tty.read(&mut bytes) else {
                break;
            };
            ground.handle_bytes(bytes.get(..count).unwrap_or_default());
            reports.extend(std::iter::from_fn(|| ground.poll_report(time)));
        }
        if let Some(measurements) = &mut self.measurements
            && let Some(power_w) = measurements.newest(time, &self.service.log)
        {
            ground.measured(power_w);
        }
        ground.handle_timeout(time);
        self.send();
        reports
    }

    fn send(&mut self) {
        let Self { ground, tty, .. } = self;
        loop {
            if !self.outgoing.is_empty() {
                let sent = tty.write(&self.outgoing).unwrap_or(0);
                self.outgoing.drain(..sent);
            }
            // A frame is made only when it can be sent, so that a slow tty gets the newest.
            let mut frame = [0; MAX_FRAME];
            if !self.outgoing.is_empty() {
                return;
            }
            let Some(len) = ground.poll_transmit(&mut frame) else {
                return;
            };
            self.outgoing.extend(frame.get(..len).unwrap_or_default());
        }
    }

    /// Continues the upload. Returns the result of the upload if the program must end with it; otherwise `None`.
    fn uploading(&mut self, time: Instant) -> Outcome {
        let Self {
            plan,
            ground,
            uploading,
            service,
            ..
        } = self;
        let uploading = uploading.as_mut()?;
        let outcome = if std::mem::take(&mut self.is_answered) {
            uploading.answer(time, plan, ground, &answered())
        } else {
            None
        };
        let outcome = outcome.or_else(|| uploading.turn(time, &service.log, plan, ground))?;
        if !plan.options.stand {
            return Some(outcome);
        }
        if let Err(fault) = outcome {
            service.log.line(time, "not flown", fault.line);
        }
        None
    }

    /// Handles signals and status requests; returns the time by which the next call is due.
    fn serve_status(&mut self, time: Instant) -> Option<Instant> {
        let Self {
            service,
            plan,
            ground,
            tty,
            measurements,
            hearing,
            uploading,
            desk,
            web,
            ..
        } = self;
        service.tend(time, "station", |log, command| {
            if let Some((line, by)) = command {
                let parts = Parts {
                    plan,
                    ground: &mut *ground,
                    uploading: &mut *uploading,
                    web: web.as_mut(),
                    tty: &mut *tty,
                };
                return desk.command(time, log, parts, line, by);
            }
            json!({
                "program": env!("CARGO_BIN_NAME"),
                "program_version": env!("CARGO_PKG_VERSION"),
                "uptime_s": time.as_micros() / 1_000_000,
                "station": {
                    "end": name(plan.end),
                    "relays": plan.loaded.mission.relays(),
                    "hears": hearing.nodes(),
                    "upload": uploading.as_ref().map_or(Value::Null, upload),
                    "counters": counted(ground.stats()),
                },
                "measurements": measurements.as_ref().map(Measurements::status),
                "links": { "ports": [tty.status()] },
                "lines_dropped": log.dropped(),
            })
        })
    }

    /// Sleeps until input or a timer needs work. Returns the program's result after SIGINT or SIGTERM, otherwise
    /// `None`.
    fn sleep(&mut self, wake: Option<Instant>) -> Outcome {
        let measured = self.measurements.as_ref().and_then(Measurements::fd);
        let mut others: Vec<_> = measured.into_iter().map(|fd| (fd, PollFlags::IN)).collect();
        let stdin = std::io::stdin();
        let uploading = self.uploading.as_ref();
        let asks = uploading.is_some_and(Uploading::is_asking);
        if asks {
            others.push((stdin.as_fd(), PollFlags::IN));
        }
        let tty = std::iter::once(&mut self.tty);
        let (found, is_over) = self.service.sleep(wake, tty, &others);
        self.is_answered = asks && found.last().is_some_and(|found| !found.is_empty());
        is_over.then(|| self.stop().map_err(Fault::from))
    }

    fn stop(&self) -> Result<(), String> {
        if !self.plan.options.stand {
            return Err(
                "stopped by a signal before the relays reported that they fly the new mission"
                    .to_owned(),
            );
        }
        self.service.stopping();
        let log: &Log = &self.service.log;
        report::stopped(log, self.service.now(), self.plan.end, &self.ground);
        Ok(())
    }
}

/// Reads the operator's answer from standard input. The text is empty if standard input has ended.
///
/// Called only if input is available.
fn answered() -> String {
    let mut line = String::new();
    match std::io::stdin().read_line(&mut line) {
        Ok(_) => line,
        Err(_) => String::new(),
    }
}

fn upload(uploading: &Uploading) -> Value {
    let (progress, flown_by) = match uploading.progress() {
        Progress::Stored { .. } => ("stored", 0),
        Progress::Adopted { .. } => ("adopted", 1),
        Progress::Refused { .. } => ("refused", 0),
        Progress::Flown { relays, .. } => ("flown", relays),
        Progress::Outdated { .. } => ("outdated", 0),
        _ => ("offering", 0),
    };
    let upload = uploading.upload();
    json!({
        "version": upload.map(Upload::version),
        "progress": progress,
        "flown_by": flown_by,
        "relays": upload.map(|it| it.config().relays),
        "preview": uploading.number(),
        "stage": uploading.stage(),
        "digest": upload.map(digest_of),
        "fault": uploading.fault(),
    })
}
