//! Stages of an upload, from the request for the flown mission to its replacement.
//!
//! | stage | event | next stage |
//! | --- | --- | --- |
//! | asking | a relay has reported its mission, and the upload is in range and newer than the relays' | computing |
//! | asking | the upload is out of range or not newer | over |
//! | computing | the relays' new positions are computed, and the upload fits the geofence | confirming, or uploading with `--yes`; over with `--dry-run` |
//! | computing | the upload is outside the geofence, or for the page the moves cannot be computed although no interference is measured | over |
//! | confirming | the operator answers `y` | uploading |
//! | confirming | the operator holds the page's button | asking again; then uploading, or over if the chain flies another mission by now |
//! | confirming | any other answer | over |
//! | uploading | the chain flies it, refuses it, or has a newer one | over |
//! | asking or uploading | `--timeout` expired; for the page while asking 15 s | over |
//!
//! An upload that has failed is no longer offered to the chain. The positions are computed by a thread of their own, at most one at a time, so that the relays are answered meanwhile.

use std::io::Write as _;
use std::sync::mpsc::{Receiver, TryRecvError, channel};

use serde_json::Value;
use uav_relay::{Duration, FlownMission, Ground, Instant, Interference, Progress, Upload};
use uav_relay_linux::log::Log;

use crate::forecast::{Move, moves};
use crate::new::{Basis, NewOptions};
use crate::options::Plan;
use crate::report::{self, FenceViolation};
use crate::{change, desk};

/// Maximum time from a relay's report of the mission version to its report of the mission's values.
const VALUES_TIMEOUT: Duration = Duration::from_millis(5_000);

/// Maximum time until the chain answers a request that came from the page.
const PAGE_TIMEOUT: Duration = Duration::from_millis(15_000);

/// Interval at which the station checks if the forecast of the relays' moves is computed.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

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
    /// The station waits until a relay reports the mission that it flies, with its values.
    ///
    /// The field is the time at which a relay first reported the mission's version without its values; `None` before.
    Querying(Option<Instant>),
    /// A thread computes the relays' new positions. The field is the time at which the station next checks whether the
    /// thread has finished.
    Computing(Instant),
    Confirming,
    Uploading,
    Ended,
}

/// Values of the new mission, as entered on the page.
#[derive(Debug)]
pub(crate) struct Form {
    /// Number of the preview, from 1.
    pub(crate) number: u32,
    pub(crate) new: NewOptions,
    /// New position of the receiver in the coordinates of the present line, x and y in m.
    pub(crate) receiver_m: Option<[f32; 2]>,
    /// Mission in whose coordinates the page gives positions, as [`name_of`] returns it.
    ///
    /// `None` if the form has no positions, or the page has no map.
    pub(crate) shown: Option<String>,
}

/// Missions before and after an upload, and the moves of the relays.
#[derive(Debug)]
pub(crate) struct Preview {
    pub(crate) before: Basis,
    pub(crate) after: Basis,
    /// Moves of all relays; `None` if they cannot be computed.
    pub(crate) moves: Option<Vec<Move>>,
}

#[derive(Debug)]
pub(crate) struct Uploading {
    /// Values entered on the page; `None` for an upload of the command line.
    form: Option<Form>,
    /// Version of the new mission: one more than the version of the flown mission. `None` until the flown version is
    /// known.
    version: Option<u16>,
    stage: Stage,
    /// Mission to upload; `None` until a relay has reported the mission whose values it changes.
    upload: Option<Upload>,
    /// Version and upload of the mission that the chain flew when the preview was computed.
    based_on: (u16, Option<Upload>),
    forecast: Option<Receiver<Option<Vec<Move>>>>,
    preview: Option<Preview>,
    /// Preview as JSON, for the page.
    shown: Value,
    /// True once the operator has confirmed the upload on the page.
    is_confirmed: bool,
    fault: Option<String>,
    progress: Progress,
    /// Deadline of the present stage of the upload. `None` while the operator's confirmation is awaited, and at the
    /// end.
    late_at: Option<Instant>,
}

impl Uploading {
    /// Starts an upload by asking the chain for the mission that it flies.
    ///
    /// `version` is the version given on the command line; `None` for an upload requested on the page. `form` has the
    /// values entered on the page; their mission gets the next version.
    pub(crate) fn begin(
        now: Instant,
        plan: &Plan,
        version: Option<u16>,
        form: Option<Form>,
        ground: &mut Ground,
    ) -> Self {
        ground.request_flown(now);
        let limit = form.as_ref().map_or(plan.timeout(), |_| PAGE_TIMEOUT);
        Self {
            form,
            version,
            stage: Stage::Querying(None),
            upload: None,
            based_on: (0, None),
            forecast: None,
            preview: None,
            shown: Value::Null,
            is_confirmed: false,
            fault: None,
            progress: Progress::Idle,
            late_at: Some(now + limit),
        }
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let next = match self.stage {
            Stage::Querying(since) => since.map(|since| since + VALUES_TIMEOUT),
            Stage::Computing(at) => Some(at),
            _ => None,
        };
        self.late_at.into_iter().chain(next).min()
    }

    /// Returns true while the station waits for the operator's answer at the terminal.
    pub(crate) const fn is_asking(&self) -> bool {
        self.is_confirming() && self.form.is_none()
    }

    /// Returns true if another upload may replace this upload.
    ///
    /// This is possible if this upload has ended, or is a preview that the operator has not confirmed on the page.
    pub(crate) const fn is_idle(&self) -> bool {
        self.has_ended() || self.is_confirming() && self.form.is_some()
    }

    /// Returns the number of the page's preview; `None` for an upload of the command line.
    pub(crate) fn number(&self) -> Option<u32> {
        self.form.as_ref().map(|form| form.number)
    }

    /// Returns the preview for the page; `Null` without a preview.
    pub(crate) const fn shown(&self) -> &Value {
        &self.shown
    }

    /// Returns true if a relay has reported that it flies this upload.
    pub(crate) const fn is_adopted(&self) -> bool {
        matches!(
            self.progress,
            Progress::Adopted { .. } | Progress::Flown { .. }
        )
    }

    /// Returns the reason why the upload has failed; `None` if it has not failed.
    pub(crate) fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Returns the name of the stage, for the page.
    pub(crate) const fn stage(&self) -> &'static str {
        match self.stage {
            Stage::Querying(_) if self.is_confirmed => "checking",
            Stage::Querying(_) => "asking",
            Stage::Computing(_) => "computing",
            Stage::Confirming => "ready",
            Stage::Uploading => "uploading",
            Stage::Ended if matches!(self.progress, Progress::Flown { .. }) => "flown",
            Stage::Ended if self.fault.is_some() => "failed",
            Stage::Ended => "dry run",
        }
    }

    /// Uploads the previewed mission, if the chain still flies the mission from which the preview was made.
    ///
    /// # Errors
    /// The reason why this preview cannot be uploaded, for example because it was uploaded before.
    pub(crate) fn confirm(
        &mut self,
        now: Instant,
        ground: &mut Ground,
        number: u32,
        digest: &str,
    ) -> Result<(), String> {
        let newest = self
            .number()
            .ok_or("there is no preview: make a preview first")?;
        if number != newest {
            return Err(format!(
                "preview {number} is not the newest one, which is preview {newest}"
            ));
        }
        let upload = self
            .upload
            .filter(|_| matches!(self.stage, Stage::Confirming));
        let Some(upload) = upload else {
            let why = if self.is_confirmed {
                "was used already: make a new preview"
            } else {
                "is not computed yet: try again later"
            };
            return Err(format!("preview {number} {why}"));
        };
        let own = digest_of(&upload);
        if digest != own {
            return Err(format!(
                "preview {number} has the digest {own}, not {digest}: give the digest of the preview to upload"
            ));
        }
        ground.request_flown(now);
        self.is_confirmed = true;
        self.stage = Stage::Querying(None);
        self.late_at = Some(now + PAGE_TIMEOUT);
        Ok(())
    }

    const fn is_confirming(&self) -> bool {
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

    /// Handles the operator's answer `line` to the request for confirmation.
    ///
    /// The answer is empty if standard input has ended.
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
        let outcome = if matches!(line.trim(), "y" | "Y" | "yes") {
            self.start(now, plan, ground, upload)
        } else {
            let version = upload.version();
            failed(format!(
                "upload of version {version} not confirmed by the operator: nothing was uploaded"
            ))
        };
        self.finish(ground, outcome)
    }

    /// Records the result of an upload that has ended. A failed upload is no longer offered to the chain.
    fn finish(&mut self, ground: &mut Ground, outcome: Outcome) -> Outcome {
        if let Some(outcome) = &outcome {
            self.stage = Stage::Ended;
            self.late_at = None;
            self.fault = outcome.as_ref().err().map(|fault| fault.line.clone());
            if outcome.is_err() {
                ground.cancel();
            }
        }
        outcome
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
            (Stage::Computing(_), Some(upload)) => self.await_moves(now, log, plan, ground, upload),
            (Stage::Uploading, Some(upload)) => self.follow(now, log, plan, &upload, ground),
            _ => None,
        };
        self.finish(ground, outcome)
    }

    fn await_mission(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
        since: Option<Instant>,
    ) -> Outcome {
        if let Some(flown) = ground.flown().copied() {
            if flown.is_known() {
                return self.decide(now, log, plan, ground, flown);
            }
            let since = since.unwrap_or(now);
            self.stage = Stage::Querying(Some(since));
            if since + VALUES_TIMEOUT <= now {
                let version = self.version.unwrap_or(u16::MAX);
                if flown.version >= version {
                    return failed(report::outdated(version, flown.version));
                }
                if plan.options.from_loaded && self.form.is_none() {
                    return self.decide(now, log, plan, ground, flown);
                }
                return failed(format!(
                    "upload of version {version} refused: relay {} flies version {}, but its firmware is too old to report the values of that mission: give --from-loaded, and repeat as options all values that the new mission takes over from the mission in flight",
                    flown.by, flown.version
                ));
            }
        }
        self.late_at.filter(|at| *at <= now)?;
        failed(match (&self.form, self.version) {
            (None, Some(version)) => report::timed_out(plan, version, Progress::Idle, ground),
            _ => format!(
                "no relay has reported the mission that it flies: {}",
                report::likely_reason(plan, ground.stats())
            ),
        })
    }

    /// Builds the upload from the mission `flown` by the relays, and starts to compute the relays' moves.
    ///
    /// If the operator has already confirmed the upload on the page, the function starts the upload instead.
    fn decide(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
        flown: FlownMission,
    ) -> Outcome {
        let options = &plan.options;
        report::flown(log, now, &flown);
        let basis = (flown.version, flown.upload);
        if let (true, Some(upload)) = (self.is_confirmed, self.upload) {
            if basis != self.based_on {
                return failed(format!(
                    "preview {} was computed for version {} of the mission, but the chain flies another mission now, version {}: make a new preview",
                    self.number().unwrap_or(0),
                    self.based_on.0,
                    flown.version
                ));
            }
            return self.start(now, plan, ground, upload);
        }
        let of = name_of(flown.version, flown.upload.as_ref());
        if let Some(shown) = self.form.as_ref().and_then(|form| form.shown.as_ref())
            && *shown != of
        {
            return failed(format!(
                "the map shows mission {shown} (version and digest), but the chain flies mission {of}, which may have another line from Tx to Rx: wait for the new map, and check the coordinates"
            ));
        }
        let version = self.version.unwrap_or(flown.version.saturating_add(1));
        if flown.version > version || self.form.is_some() && flown.version == version {
            return failed(report::outdated(version, flown.version));
        }
        let loaded = Basis::loaded(&plan.loaded.mission, plan.sited);
        let before = match flown.upload {
            Some(upload) => Basis::flown(upload, plan.sited),
            None => loaded,
        };
        let (new, base) = match &self.form {
            Some(form) => (form.new.with_receiver(form.receiver_m, &before), before),
            None if options.from_loaded => (Ok(options.new.clone()), loaded),
            None => (Ok(options.new.clone()), before),
        };
        let loaded = &plan.loaded.mission;
        let upload = match new.and_then(|new| new.upload(version, loaded, plan.sited, &base)) {
            Ok(upload) => upload,
            Err(line) => return Some(Err(Fault { line, status: 2 })),
        };
        if flown.version == version && flown.upload.is_none_or(|it| it.id() != upload.id()) {
            return failed(report::outdated(version, flown.version));
        }
        let after = Basis::flown(upload, plan.sited);
        change::log_changes(log, now, &before, &after);
        let (sender, forecast) = channel();
        let (loaded, lines) = (plan.loaded.clone(), [before.line, after.line]);
        // The receiver may be gone at the end of the program. Without a thread no moves are shown.
        let compute =
            move || _ = sender.send(moves(&loaded, flown.upload.as_ref(), &upload, lines));
        _ = std::thread::Builder::new()
            .name("forecast".to_owned())
            .spawn(compute);
        self.forecast = Some(forecast);
        self.based_on = basis;
        let preview = Preview {
            before,
            after,
            moves: None,
        };
        self.shown = desk::preview(plan, &preview);
        self.preview = Some(preview);
        (self.stage, self.upload, self.late_at) = (Stage::Computing(now), Some(upload), None);
        None
    }

    /// Shows the relays' moves once they are computed. Then starts the upload, or asks the operator to confirm it.
    fn await_moves(
        &mut self,
        now: Instant,
        log: &Log,
        plan: &Plan,
        ground: &mut Ground,
        upload: Upload,
    ) -> Outcome {
        let moves = match self.forecast.as_ref()?.try_recv() {
            Ok(moves) => moves,
            Err(TryRecvError::Disconnected) => None,
            Err(TryRecvError::Empty) => {
                self.stage = Stage::Computing(now + LOOK_AGAIN);
                return None;
            }
        };
        self.forecast = None;
        let (version, options) = (upload.version(), &plan.options);
        change::log_moves(log, now, moves.as_deref());
        let is_fenced = !options.no_fence || self.form.is_some();
        let fence = FenceViolation::of(&plan.loaded.mission, &upload).filter(|_| is_fenced);
        let outside = fence.map(|fence| fence.line(moves.as_deref()));
        let mut is_predicted = true;
        if let Some(preview) = &mut self.preview {
            let missions = [&preview.before, &preview.after];
            let is_measured = missions
                .iter()
                .any(|it| it.config.interference == Interference::Unknown);
            is_predicted = is_measured || moves.is_some();
            preview.moves = moves;
            self.shown = desk::preview(plan, preview);
        }
        if let Some(outside) = outside {
            return failed(match self.form {
                Some(_) => outside,
                None => {
                    format!(
                        "upload of version {version} refused: {outside}; --no-fence uploads the mission nevertheless"
                    )
                }
            });
        }
        if self.form.is_some() && !is_predicted {
            return failed(
                "the moves of the relays cannot be computed: the simulated relays refused the mission, or did not agree on it within 10 s"
                    .to_owned(),
            );
        }
        (self.stage, self.upload) = (Stage::Confirming, Some(upload));
        if self.form.is_some() {
            return None;
        }
        if options.dry_run {
            let what = format_args!("version {version} of the mission was not uploaded");
            log.line(now, "dry run", what);
            return Some(Ok(()));
        }
        if options.yes {
            return self.start(now, plan, ground, upload);
        }
        // Earlier log lines must be printed before the question. A closed standard error is ignored.
        log.flush(std::time::Duration::from_millis(500));
        let mut out = std::io::stderr();
        let _ = write!(out, "Upload version {version} of the mission? [y/N] ");
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

/// Returns a name of a mission for the page: its version, and the digest of its upload if there is one.
///
/// The page sends this name back with its requests.
pub(crate) fn name_of(version: u16, upload: Option<&Upload>) -> String {
    upload.map_or_else(
        || version.to_string(),
        |it| format!("{version},{}", digest_of(it)),
    )
}

/// Returns the digest of an upload as the page shows it.
pub(crate) fn digest_of(upload: &Upload) -> String {
    format!("0x{:04x}", upload.id().digest)
}

/// Returns the result of an upload that has failed for the reason `line`.
#[expect(clippy::unnecessary_wraps, reason = "as the stages return it")]
fn failed(line: String) -> Outcome {
    Some(Err(line.into()))
}
