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
use crate::options::{Change, Plan};
use crate::report::{self, Outside};

/// Time that a relay has to send the values of its mission.
const VALUES: uav_relay::Duration = uav_relay::Duration::from_millis(5_000);

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

/// Result of the upload; `None` while it goes on.
pub(crate) type Over = Option<Result<(), Fault>>;

#[derive(Debug)]
enum Stage {
    /// Time since when a relay is known to hold an upload with unknown values.
    Asking(Option<Instant>),
    Confirming(Box<Upload>),
    Uploading(Box<Upload>),
    Over(Option<Box<Upload>>),
}

#[derive(Debug)]
pub(crate) struct Uploading {
    stage: Stage,
    progress: Progress,
    /// End of the stage; `None` while a confirmation is awaited, and at the end.
    late_at: Option<Instant>,
}

impl Uploading {
    /// Starts by asking the chain for the mission that it flies.
    pub(crate) fn begin(now: Instant, plan: &Plan, ground: &mut Ground) -> Self {
        ground.ask_flown(now);
        Self {
            stage: Stage::Asking(None),
            progress: Progress::Idle,
            late_at: Some(now + plan.timeout),
        }
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let values = match self.stage {
            Stage::Asking(since) => since.map(|since| since + VALUES),
            _ => None,
        };
        self.late_at.into_iter().chain(values).min()
    }

    pub(crate) const fn is_confirming(&self) -> bool {
        matches!(self.stage, Stage::Confirming(_))
    }

    /// Returns the upload, once its values are known.
    pub(crate) fn upload(&self) -> Option<&Upload> {
        match &self.stage {
            Stage::Asking(_) => None,
            Stage::Confirming(upload) | Stage::Uploading(upload) => Some(upload),
            Stage::Over(upload) => upload.as_deref(),
        }
    }

    /// Handles the operator's answer: a line, empty at the end of standard input.
    pub(crate) fn answer(
        &mut self,
        now: Instant,
        plan: &Plan,
        ground: &mut Ground,
        line: &str,
    ) -> Over {
        let Stage::Confirming(upload) = &self.stage else {
            return None;
        };
        let upload = **upload;
        if matches!(line.trim(), "y" | "Y" | "yes") {
            return self.start(now, plan, ground, upload);
        }
        self.stage = Stage::Over(Some(Box::new(upload)));
        let version = upload.version();
        Some(Err(format!(
            "--version {version}: not confirmed, nothing was uploaded"
        )
        .into()))
    }

    /// Advances the upload; returns its result at the end.
    pub(crate) fn turn(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        change: &Change,
        ground: &mut Ground,
    ) -> Over {
        let over = match &self.stage {
            Stage::Asking(since) => {
                let since = *since;
                self.asked(now, log, plan, change, ground, since)
            }
            Stage::Confirming(_) | Stage::Over(_) => None,
            Stage::Uploading(upload) => {
                let upload = **upload;
                self.follow(now, log, plan, &upload, ground)
            }
        };
        if over.is_some() {
            self.stage = Stage::Over(self.upload().copied().map(Box::new));
            self.late_at = None;
        }
        over
    }

    fn asked(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        change: &Change,
        ground: &mut Ground,
        since: Option<Instant>,
    ) -> Over {
        let version = change.version;
        match ground.flown().copied() {
            Some(flown) if flown.is_known() => {
                return self.decide(now, log, plan, change, ground, flown);
            }
            Some(flown) => {
                let since = since.unwrap_or(now);
                self.stage = Stage::Asking(Some(since));
                if since + VALUES <= now {
                    if flown.version < version && change.from_loaded {
                        return self.decide(now, log, plan, change, ground, flown);
                    }
                    let line = if flown.version < version {
                        format!(
                            "--version {version}: relay {} holds version {} and does not send its values, as an older firmware does not; give --from-loaded, and state all that is to stay as it is flown",
                            flown.by, flown.version
                        )
                    } else {
                        report::outdated(version, flown.version)
                    };
                    return Some(Err(line.into()));
                }
            }
            None => {}
        }
        let is_late = self.late_at.is_some_and(|at| at <= now);
        is_late.then(|| Err(report::late(plan, version, Progress::Idle, ground).into()))
    }

    /// Builds the upload from the flown mission and shows its changes.
    fn decide(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        change: &Change,
        ground: &mut Ground,
        flown: FlownMission,
    ) -> Over {
        let version = change.version;
        report::flown(log, now, &flown);
        if flown.version > version {
            return Some(Err(report::outdated(version, flown.version).into()));
        }
        let loaded = Basis::loaded(&plan.loaded.mission, change.sited);
        let before = match flown.upload {
            Some(upload) => Basis::flown(upload, change.sited),
            None => loaded,
        };
        let basis = if change.from_loaded { loaded } else { before };
        let upload = match change.upload(&plan.loaded.mission, &basis) {
            Ok(upload) => upload,
            Err(line) => return Some(Err(Fault { line, status: 2 })),
        };
        if flown.version == version && flown.upload.is_none_or(|it| it.id() != upload.id()) {
            return Some(Err(report::outdated(version, flown.version).into()));
        }
        let after = Basis::flown(upload, change.sited);
        change::tell(log, now, &before, &after);
        let lines = [before.line, after.line];
        let moves = moves(&plan.loaded, flown.upload.as_ref(), &upload, lines);
        change::tell_moves(log, now, moves.as_deref());
        if let Some(outside) = Outside::of(plan, &upload)
            && !change.no_fence
        {
            let outside = outside.line(moves.as_deref());
            return Some(Err(format!("--version {version}: {outside}").into()));
        }
        if change.dry_run {
            let what = format_args!("version {version} was not uploaded");
            log.tell(now, "dry run", what);
            return Some(Ok(()));
        }
        if change.yes {
            return self.start(now, plan, ground, upload);
        }
        self.stage = Stage::Confirming(Box::new(upload));
        self.late_at = None;
        // Earlier log lines must be printed before the question. A closed standard error is ignored.
        log.flush(std::time::Duration::from_millis(500));
        let mut out = std::io::stderr();
        let _ = write!(out, "Upload version {version}? [y/N] ");
        let _ = out.flush();
        None
    }

    fn start(&mut self, now: Instant, plan: &Plan, ground: &mut Ground, upload: Upload) -> Over {
        if let Err(error) = ground.upload(now, upload) {
            return Some(Err(error.to_string().into()));
        }
        self.stage = Stage::Uploading(Box::new(upload));
        self.late_at = Some(now + plan.timeout);
        None
    }

    /// Logs the progress; returns the result of the upload at its end.
    fn follow(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        upload: &Upload,
        ground: &Ground,
    ) -> Over {
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
                report::late(plan, upload.version(), progress, ground)
            }
        };
        Some(Err(fault.into()))
    }
}
