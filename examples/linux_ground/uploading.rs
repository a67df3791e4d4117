//! Stages of an upload, from the request for the flown mission to its replacement.
//!
//! | stage | event | next stage |
//! | --- | --- | --- |
//! | asking | a relay has reported its mission, and the upload fits | confirming, or uploading with `--yes`; over with `--dry-run` |
//! | asking | the upload is out of range, outside the geofence or not newer than the relays' | over |
//! | confirming | the operator answers `y` | uploading |
//! | confirming | any other answer | over |
//! | uploading | the chain flies it, refuses it, or has a newer one | over |
//! | asking or uploading | `--timeout` expired | over |

use std::io::Write as _;

use uav_relay::{FlownMission, Ground, Instant, Progress, Upload};
use uav_relay_linux::log::Log;

use crate::change;
use crate::forecast::moves;
use crate::new::Basis;
use crate::options::Plan;
use crate::report::{self, FenceViolation};

/// Maximum time that a relay may take to send the values of the mission that it flies.
const VALUES_TIMEOUT: uav_relay::Duration = uav_relay::Duration::from_millis(5_000);

#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) line: String,
    pub(crate) status: u8,
}

impl From<String> for Fault {
    fn from(line: String) -> Self {
        Self { line, status: 1 }
    }
}

/// Result of an upload or of the program; `None` while the upload or the program continues.
pub(crate) type Outcome = Option<Result<(), Fault>>;

#[derive(Clone, Copy, Debug)]
enum Stage {
    /// Waiting until a relay reports the mission that it flies, with its values. `Some` is the time at which a relay
    /// first reported only the mission's version.
    Querying(Option<Instant>),
    Confirming,
    Uploading,
    Ended,
}

#[derive(Debug)]
pub(crate) struct Uploading {
    version: u16,
    stage: Stage,
    /// Mission to upload; `None` until a relay has reported the mission that it is based on.
    upload: Option<Upload>,
    progress: Progress,
    /// Deadline of the present stage of the upload; `None` while a confirmation is awaited, and at the end.
    late_at: Option<Instant>,
}

impl Uploading {
    /// Starts an upload by asking the chain for the mission that it flies.
    pub(crate) fn begin(now: Instant, plan: &Plan, version: u16, ground: &mut Ground) -> Self {
        ground.request_flown(now);
        Self {
            version,
            stage: Stage::Querying(None),
            upload: None,
            progress: Progress::Idle,
            late_at: Some(now + plan.timeout()),
        }
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let values = match self.stage {
            Stage::Querying(since) => since.map(|since| since + VALUES_TIMEOUT),
            _ => None,
        };
        self.late_at.into_iter().chain(values).min()
    }

    pub(crate) const fn is_confirming(&self) -> bool {
        matches!(self.stage, Stage::Confirming)
    }

    pub(crate) const fn upload(&self) -> Option<&Upload> {
        self.upload.as_ref()
    }

    /// Returns the last progress of the upload.
    pub(crate) const fn progress(&self) -> Progress {
        self.progress
    }

    pub(crate) const fn has_ended(&self) -> bool {
        matches!(self.stage, Stage::Ended)
    }

    /// Handles the operator's answer to the request for confirmation. `line` is empty at the end of standard input.
    pub(crate) fn answer(
        &mut self,
        now: Instant,
        plan: &Plan,
        ground: &mut Ground,
        line: &str,
    ) -> Outcome {
        let (Stage::Confirming, Some(upload)) = (self.stage, self.upload) else {
            return None;
        };
        if matches!(line.trim(), "y" | "Y" | "yes") {
            return self.start(now, plan, ground, upload);
        }
        self.stage = Stage::Ended;
        let version = self.version;
        failed(format!(
            "--version {version}: not confirmed, so nothing was uploaded"
        ))
    }

    /// Continues the upload; returns its result once it has ended.
    pub(crate) fn turn(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
    ) -> Outcome {
        let outcome = match (self.stage, self.upload) {
            (Stage::Querying(since), _) => self.await_mission(now, log, plan, ground, since),
            (Stage::Uploading, Some(upload)) => self.follow(now, log, plan, &upload, ground),
            _ => None,
        };
        if outcome.is_some() {
            self.stage = Stage::Ended;
            self.late_at = None;
        }
        outcome
    }

    fn await_mission(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
        since: Option<Instant>,
    ) -> Outcome {
        let version = self.version;
        if let Some(flown) = ground.flown().copied() {
            if flown.is_known() {
                return self.decide(now, log, plan, ground, flown);
            }
            let since = since.unwrap_or(now);
            self.stage = Stage::Querying(Some(since));
            if since + VALUES_TIMEOUT <= now {
                if flown.version >= version {
                    return failed(report::outdated(version, flown.version));
                }
                if plan.options.from_loaded {
                    return self.decide(now, log, plan, ground, flown);
                }
                return failed(format!(
                    "--version {version}: relay {} flies version {}, and its older firmware cannot report the values of that mission: give --from-loaded, and every value of that version that the new mission has to keep",
                    flown.by, flown.version
                ));
            }
        }
        self.late_at.filter(|at| *at <= now)?;
        failed(report::timed_out(plan, version, Progress::Idle, ground))
    }

    /// Builds the upload from the mission that the relays fly, and shows the changes. Then starts the upload, or asks
    /// the operator for confirmation.
    fn decide(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
        flown: FlownMission,
    ) -> Outcome {
        let (version, options) = (self.version, &plan.options);
        report::flown(log, now, &flown);
        if flown.version > version {
            return failed(report::outdated(version, flown.version));
        }
        let loaded = Basis::loaded(&plan.loaded.mission, plan.sited);
        let before = match flown.upload {
            Some(upload) => Basis::flown(upload, plan.sited),
            None => loaded,
        };
        let basis = if options.from_loaded { loaded } else { before };
        let loaded = &plan.loaded.mission;
        let upload = match options.new.upload(version, loaded, plan.sited, &basis) {
            Ok(upload) => upload,
            Err(line) => return Some(Err(Fault { line, status: 2 })),
        };
        if flown.version == version && flown.upload.is_none_or(|it| it.id() != upload.id()) {
            return failed(report::outdated(version, flown.version));
        }
        let after = Basis::flown(upload, plan.sited);
        change::log_changes(log, now, &before, &after);
        let lines = [before.line, after.line];
        let moves = moves(&plan.loaded, flown.upload.as_ref(), &upload, lines);
        change::log_moves(log, now, moves.as_deref());
        if let Some(outside) = FenceViolation::of(plan, &upload)
            && !options.no_fence
        {
            let outside = outside.line(moves.as_deref());
            return failed(format!(
                "--version {version}: {outside}; --no-fence uploads it nevertheless"
            ));
        }
        if options.dry_run {
            let what = format_args!("version {version} was not uploaded");
            log.line(now, "dry run", what);
            return Some(Ok(()));
        }
        if options.yes {
            return self.start(now, plan, ground, upload);
        }
        (self.stage, self.upload) = (Stage::Confirming, Some(upload));
        self.late_at = None;
        // Earlier log lines must be printed before the question. A closed standard error is ignored.
        log.flush(std::time::Duration::from_millis(500));
        let mut out = std::io::stderr();
        let _ = write!(out, "Upload version {version}? [y/N] ");
        let _ = out.flush();
        None
    }

    fn start(&mut self, now: Instant, plan: &Plan, ground: &mut Ground, upload: Upload) -> Outcome {
        if let Err(error) = ground.upload(now, upload) {
            return failed(error.to_string());
        }
        (self.stage, self.upload) = (Stage::Uploading, Some(upload));
        self.late_at = Some(now + plan.timeout());
        None
    }

    /// Logs the upload's progress; returns its result once it has ended.
    fn follow(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        upload: &Upload,
        ground: &Ground,
    ) -> Outcome {
        let progress = ground.progress();
        let is_new = std::mem::replace(&mut self.progress, progress) != progress;
        if is_new {
            report::progress(log, now, upload, progress);
        }
        let fault = match progress {
            Progress::Flown { .. } => return Some(Ok(())),
            Progress::Outdated { version } => report::outdated(upload.version(), version),
            Progress::Refused { by } => report::refused(plan, upload, by),
            _ => {
                self.late_at.filter(|at| *at <= now)?;
                report::timed_out(plan, upload.version(), progress, ground)
            }
        };
        failed(fault)
    }
}

/// Returns the result of an upload that has failed for the reason `line`.
#[expect(clippy::unnecessary_wraps, reason = "as the stages return it")]
fn failed(line: String) -> Outcome {
    Some(Err(line.into()))
}
