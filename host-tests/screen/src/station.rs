//! Alarms and log lines of a ground station, which knows its chain by the relays' reports alone.
//!
//! | state | alarm |
//! | --- | --- |
//! | a relay has not reported yet | notice |
//! | a neighbour reports a relay as silent, or a relay that has reported is silent for [`SILENT_AFTER`], or for one and a half times as long as it recently was, up to 10 s | critical, one for the relay |
//! | the same without a neighbour's report, within 15 s of its last report: a relay nearer to the station is silent, too, for less than 10 s, or has returned within 5 s, and no later report of a relay beyond has arrived; or the station has [received](StationView::overhear) another frame of the relay within 5 s | none yet: the reports may have to find another way, or were lost |
//! | no frame from a chain that has reported, for [`SILENT_AFTER`] | critical; it replaces the alarms about single relays |
//! | no quorum, no feasible positions, two nodes with a relay's number | critical |
//! | autopilot without a position, or its link lost after it was there | critical |
//! | drone not engaged any more, until it is engaged again | warning |
//! | an agreed position, but no lease for [`SILENT_AFTER`] | warning |
//! | version of the mission not the chain's newest, for [`SILENT_AFTER`] | warning |
//! | a relay refuses another one for another mission, old epoch or key, and that one does not report; or reports, but is refused for another mission for `LINGERS` more: a second node has its number | warning or critical, one for the refused relay |
//! | for 30 s fewer relays in the chain than are meant to fly, and no more than at the start of this time | warning |
//! | engaged, and the autopilot flies to another target; or engaged, more than `NEAR_M` from its setpoint without a reason to wait, and no nearer for `STUCK_AFTER` | warning |
//! | frames rejected by the station in the last `REJECTED_FOR` | notice |
//!
//! An alarm of a relay that does not report any more stays as it was. An operator can [clear](StationView::clear) a lost relay: it then
//! has no alarm and is not part of the snapshot, until a newer report of it arrives.

use std::collections::BTreeMap;

use uav_relay::flight::autopilot::state::State;
use uav_relay::{Duration, Instant, Phase, Placement, Report, Side};

use crate::alarms::{Alarms, Lasting, Reason, named};
use crate::chain::{Chain, SILENT_AFTER, control, hold_reason, phase, seconds};
use crate::snapshot::{ChainSize, LogLine, Snapshot};

/// Time without any received frame after which no alarm about a single silent relay begins.
///
/// After this time the station itself may be cut off from the chain.
const QUIET_AFTER: Duration = Duration::from_millis(2_000);

/// Age of a relay's newest report from which reports of relays farther away may be missing, too.
///
/// Reports of relays farther away from the station pass through this relay.
const UNSURE_AFTER: Duration = Duration::from_millis(2_500);

/// Age of a relay's newest report from which the chain bypasses this relay.
///
/// The reports of relays farther away from the station then arrive again.
const CLOSED_AFTER: Duration = SILENT_AFTER.times(2);

/// Age of a relay's newest report from which the alarm that the relay is silent is no longer delayed.
///
/// Only a silence of the whole chain still delays it. Before, received frames of the relay delay it, and silent relays on the way of its reports. The frames are not
/// verified, and with lost frames some relay on the way is always silent: without a limit, they could hide a loss.
const OVERDUE_AFTER: Duration = SILENT_AFTER.times(3);

/// Time for which the alarm about rejected frames lasts after the last rejected frame.
const REJECTED_FOR: Duration = Duration::from_millis(30_000);

/// Time after which a drone that comes no nearer to its setpoint causes an alarm.
///
/// Only every eighth report contains the setpoint: a drone on its way to a new setpoint may therefore seem to fly away
/// from the previous setpoint for 10 s, or longer if reports are lost.
const STUCK_AFTER: Duration = Duration::from_millis(15_000);

/// Time after the drone was nearest to its setpoint from which a report with this setpoint confirms it.
const CONFIRMED_AFTER: Duration = Duration::from_millis(2_000);

/// Time after which too few relays in the chain cause an alarm.
///
/// A waiting spare that replaces a lost relay has joined by then.
const TOO_FEW_AFTER: Duration = Duration::from_millis(30_000);

/// Time after which a relay that has returned should no longer be refused for its earlier mission.
///
/// A relay reports that it refuses another relay for up to two minutes after the last frame that it refused.
const LINGERS: Duration = Duration::from_millis(150_000);

/// Time for which a report of a refused relay stays valid while later reports name another relay.
///
/// A relay that refuses one relay on each side names the two in alternate reports.
const TURNS: Duration = Duration::from_millis(20_000);

/// Distance from a setpoint below which a drone has reached it, m.
const NEAR_M: f32 = 5.0;

/// Frame counters of a station.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Frames {
    /// Number of accepted frames.
    pub received: u32,
    /// Number of rejected frames.
    pub rejected: u32,
}

/// Newest report of a relay, and the values from earlier reports that its alarms depend on.
#[derive(Clone, Copy, Debug)]
struct Known {
    report: Report,
    /// True from the time when the relay takes control of the drone until the pilot takes control. It stays true if the
    /// link to the autopilot is lost.
    was_engaged: bool,
    is_released: bool,
    is_link_lost: bool,
    /// Time of the first of the newest consecutive reports with an agreed position but no lease.
    ///
    /// `None` if the newest report has no agreed position or has a lease.
    unleased_at: Option<Instant>,
    /// Slowly decaying maximum of the time between two reports of this relay.
    longest_age: Duration,
    /// Time when the drone came nearest to its setpoint, and its distance from the setpoint then, m.
    ///
    /// `None` while the relay does not move the drone, or the drone has arrived.
    nearest: Option<(Instant, f32)>,
    /// Time of the last report that had details, and so the setpoint.
    detailed_at: Instant,
    /// Time of the first report that has the same neighbours as the newest report.
    neighbours_at: Instant,
    /// Time of the first report after the relay's last silence; `None` before a silence.
    ///
    /// Reports of relays farther away from the station may have been lost in this silence.
    returned_at: Option<Instant>,
}

impl Known {
    fn new(report: Report) -> Self {
        Self {
            report,
            was_engaged: false,
            is_released: false,
            is_link_lost: false,
            unleased_at: None,
            longest_age: Duration::from_micros(0),
            nearest: None,
            detailed_at: report.at,
            neighbours_at: report.at,
            returned_at: None,
        }
    }

    /// Stores a newer report of the relay, or its first one, and updates the history.
    ///
    /// `is_detailed` is true if the report has details of its own, and false if they are those of an earlier report.
    fn take(&mut self, now: Instant, report: Report, is_detailed: bool) {
        let before = std::mem::replace(&mut self.report, report);
        let decayed = Duration::from_micros(self.longest_age.as_micros() * 7 / 8);
        let age = now.since(before.at);
        self.longest_age = decayed.max(age);
        if age >= UNSURE_AFTER {
            self.returned_at = Some(now);
        }
        if before.neighbours != report.neighbours {
            self.neighbours_at = report.at;
        }
        match report.control {
            Some(State::Engaged | State::Blind) => {
                (self.was_engaged, self.is_released) = (true, false);
            }
            Some(State::Standby | State::Grounded) => {
                self.is_released |= std::mem::take(&mut self.was_engaged);
            }
            Some(State::Silent) | None => {}
        }
        let was_linked = before.control.is_some_and(|it| it != State::Silent);
        self.is_link_lost =
            report.control == Some(State::Silent) && (self.is_link_lost || was_linked);
        if is_detailed {
            self.detailed_at = report.at;
        }
        let is_unleased = report.agreed.is_some() && !report.holds_lease;
        // After a restart the stored agreed position is not the relay's, until a report with details arrives.
        let has_restarted = age >= UNSURE_AFTER && before.control != report.control;
        let unleased_at = self.unleased_at.filter(|_| !has_restarted);
        self.unleased_at = is_unleased.then(|| unleased_at.unwrap_or(report.at));
        let known = self.nearest.filter(|_| before.setpoint == report.setpoint);
        let way_m = distance_to_fly_m(&report).filter(|it| *it > NEAR_M);
        self.nearest = way_m.map(|it| match known {
            // A drone in the wind moves, too.
            Some((at, least_m)) if it > least_m - 1.0 => (at, least_m),
            _ => (report.at, it),
        });
    }

    /// Returns the age of the relay's newest report at which the relay begins to count as silent.
    ///
    /// The age is longer if the times between this relay's reports are often long. Before a relay's first agreement its
    /// reports may be delayed by 6 s.
    fn silent_after(&self) -> Duration {
        let Report { phase, agreed, .. } = self.report;
        let is_idle = matches!(phase, Phase::Holding | Phase::Infeasible | Phase::NoQuorum);
        if agreed.is_none() && !is_idle {
            return SILENT_AFTER.times(2);
        }
        let usual = Duration::from_micros(self.longest_age.as_micros() * 3 / 2);
        usual.clamp(SILENT_AFTER, SILENT_AFTER.times(2))
    }

    /// Returns true if the drone has come no nearer to its setpoint for [`STUCK_AFTER`].
    ///
    /// A report of this time must have confirmed the setpoint.
    fn is_stuck(&self) -> bool {
        let is_long = |(at, _)| {
            self.report.at.since(at) >= STUCK_AFTER && self.detailed_at.since(at) >= CONFIRMED_AFTER
        };
        self.nearest.is_some_and(is_long)
    }

    /// Returns true if the relay has had an agreed position without a lease for at least [`SILENT_AFTER`].
    fn has_expired(&self) -> bool {
        let is_long = |at: Instant| self.report.at.since(at) >= SILENT_AFTER;
        self.unleased_at.is_some_and(is_long)
    }

    /// Returns true if the drone is in the air and its position is unknown.
    fn is_blind(&self) -> bool {
        let Report {
            control, position, ..
        } = self.report;
        let needs = matches!(control, Some(State::Standby | State::Engaged));
        control == Some(State::Blind) || (needs && position.is_none())
    }
}

/// Refusal of a relay for another mission, an old epoch or another key.
#[derive(Debug)]
struct Refused {
    /// Relays that refuse the refused relay, and the times of their last reports of the refusal.
    by: BTreeMap<u16, Instant>,
    /// Time of the first report of the refusal.
    since: Instant,
    /// Time since which the refused relay has reported without a silence; `None` while it does not report.
    back_at: Option<Instant>,
}

/// View of a chain by the reports of its relays, with the history that alarms and log lines need.
#[derive(Debug, Default)]
pub struct StationView {
    alarms: Alarms,
    known: BTreeMap<u16, Known>,
    /// Neighbours that have reported a relay as silent, each with the time of its last such report.
    ///
    /// The key of the outer map is the silent relay, the key of the inner map the neighbour.
    claims: BTreeMap<u16, BTreeMap<u16, Instant>>,
    refused: BTreeMap<(Reason, u16), Refused>,
    /// Times of the last frames that the station has received of its nearest relays, to any node.
    overheard: BTreeMap<u16, Instant>,
    /// Lost relays that an operator has cleared from the display, with the time of each command.
    cleared: BTreeMap<u16, Instant>,
    /// Log lines of the next snapshot.
    acts: Vec<LogLine>,
    frames: Frames,
    /// Time of the last accepted frame; before the first frame it is the time of the start.
    frame_at: Instant,
    /// Time of the first frame after the last time in which no frame arrived from the whole chain.
    ///
    /// Alarms count a relay's silence from this time or later.
    resumed_at: Instant,
    rejected_at: Option<Instant>,
    /// Number of relays in a chain with too few, and time since which it has not risen.
    ///
    /// `None` if enough relays are in the chain.
    short: Option<(u16, Instant)>,
    /// Newest mission version that relays report, and the time when the station first received it.
    version: Option<(u16, Instant)>,
}

impl StationView {
    /// Returns the newest report of each relay that is not cleared, with the details last received.
    pub fn reports(&self) -> impl Iterator<Item = &Report> {
        self.shown().map(|it| &it.report)
    }

    /// Returns the newest version of the mission that relays report; `None` until a report has a version.
    pub fn version(&self) -> Option<u16> {
        self.version.map(|(version, _)| version)
    }

    /// Records that the station has received frames of these relays, to any node, since the last snapshot.
    pub fn overhear(&mut self, now: Instant, relays: impl IntoIterator<Item = u16>) {
        self.overheard
            .extend(relays.into_iter().map(|it| (it, now)));
    }

    /// Removes a lost relay and its alarm from the snapshots, until a report newer than `now` arrives.
    ///
    /// `reports` are reports received since the last snapshot; older ones may be included.
    ///
    /// # Errors
    /// The reason if the relay is not lost: it has reported within [`SILENT_AFTER`], or has no alarm that it is lost.
    pub fn clear(&mut self, now: Instant, relay: u16, reports: &[Report]) -> Result<(), String> {
        let known = self.known.get(&relay).map(|it| &it.report);
        let own = reports.iter().chain(known);
        let newest = own.filter(|it| it.relay == relay).map(|it| it.at).max();
        let is_silent = newest.is_some_and(|at| now.since(at) >= SILENT_AFTER);
        if !is_silent || !self.alarms.lasts(Reason::Lost, relay) {
            return Err(format!("relay {relay} is not lost"));
        }
        self.cleared.insert(relay, now);
        self.acts.push(LogLine {
            time_s: seconds(now),
            text: format!("operator: lost relay {relay} cleared"),
        });
        Ok(())
    }

    /// Returns the state of `chain` at the time `now`, its alarms, and the log since the last call.
    ///
    /// `reports` are the reports received since the last snapshot; older ones may be included. Reports of relays with a number above `chain.relays` are ignored.
    pub fn snapshot<'a>(
        &mut self,
        now: Instant,
        chain: &Chain<'_>,
        reports: impl IntoIterator<Item = &'a Report>,
        frames: Frames,
    ) -> Snapshot {
        let mut log = std::mem::take(&mut self.acts);
        let mut is_new = false;
        for report in reports {
            let is_listed = (1..=chain.relays).contains(&report.relay);
            is_new |= is_listed && self.take(now, *report, &mut log);
        }
        log.sort_by(|one: &LogLine, other| one.time_s.total_cmp(&other.time_s));
        self.count(now, frames, is_new);
        self.follow_version(now);
        self.drop_answered_claims(now);
        self.follow_refusals(now);
        let reports: Vec<Report> = self.reports().copied().collect();
        self.follow_size(now, chain.size(&reports, &self.alarms));
        let lasting = self.lasting(now, chain);
        self.alarms.settle(seconds(now), lasting);
        let cleared: Vec<u16> = self.cleared.keys().copied().collect();
        let changed = self.known.iter();
        let changed = changed.map(|(number, it)| (*number, it.neighbours_at));
        Snapshot {
            name: Some(chain.name()),
            log,
            ..chain.snapshot(now, &reports, &self.alarms, &cleared, &changed.collect())
        }
    }

    /// Stores a relay's report, and appends a log line for each change since the relay's stored report.
    ///
    /// Returns false if `report` is not newer than the stored report.
    fn take(&mut self, now: Instant, report: Report, log: &mut Vec<LogLine>) -> bool {
        let number = report.relay;
        let is_detailed = report.version.is_some();
        let before = self.known.get(&number).map(|it| it.report);
        let mut newest = before.unwrap_or(report);
        if before.is_some() && !newest.update(report) {
            return false;
        }
        let report = newest;
        let line = |text| LogLine {
            time_s: seconds(report.at),
            text: format!("relay {number}: {text}"),
        };
        log.extend(changes(before.as_ref(), &report).into_iter().map(line));
        if self.cleared.get(&number).is_some_and(|at| report.at > *at) {
            self.cleared.remove(&number);
            log.push(line("reports again after it was cleared".to_owned()));
        }
        let known = self.known.entry(number);
        known
            .or_insert_with(|| Known::new(report))
            .take(now, report, is_detailed);
        for lost in silent(&report) {
            // A neighbour that has never been received is not lost.
            let was_received = before.is_some_and(|before| {
                before.neighbours.contains(&Some(lost)) && !silent(&before).any(|it| it == lost)
            });
            if was_received || self.claims(lost).contains(&number) {
                let claims = self.claims.entry(lost).or_default();
                claims.insert(number, report.at);
            }
        }
        true
    }

    /// Updates the newest version of the mission according to the relays' recent reports.
    fn follow_version(&mut self, now: Instant) {
        let reports = self.known.values().map(|it| it.report);
        let fresh = reports.filter(|it| now.since(it.at) < SILENT_AFTER);
        if let Some(newest) = fresh.filter_map(|it| it.version).max()
            && self.version() != Some(newest)
        {
            self.version = Some((newest, now));
        }
    }

    fn count(&mut self, now: Instant, frames: Frames, has_report: bool) {
        if has_report || frames.received != self.frames.received {
            if now.since(self.frame_at) >= QUIET_AFTER {
                self.resumed_at = now;
            }
            self.frame_at = now;
        }
        if frames.rejected != self.frames.rejected {
            self.rejected_at = Some(now);
        }
        self.frames = frames;
    }

    /// Updates since when the chain has too few relays. Before any relay is in the chain, it has not.
    fn follow_size(&mut self, now: Instant, size: Option<ChainSize>) {
        let size = size.filter(|it| (1..it.meant).contains(&it.present));
        self.short = size.map(|ChainSize { present, .. }| match self.short {
            Some((before, at)) if present <= before || self.alarms.lasts(Reason::TooFew, 0) => {
                (present, at)
            }
            _ => (present, now),
        });
    }

    /// Drops each neighbour's claim that a relay is silent, once that relay has sent a newer report.
    ///
    /// A claim that is still part of the neighbour's newest report is kept, unless this report is old.
    fn drop_answered_claims(&mut self, now: Instant) {
        let known = &self.known;
        for (number, claims) in &mut self.claims {
            let Some(subject) = known.get(number) else {
                continue;
            };
            claims.retain(|by, at| {
                let by = known.get(by).map(|it| it.report);
                let lasts = by.is_some_and(|by| {
                    now.since(by.at) < SILENT_AFTER && silent(&by).any(|it| it == *number)
                });
                lasts || subject.report.at <= *at
            });
        }
        self.claims.retain(|_, claims| !claims.is_empty());
    }

    /// Updates the relays that are refused, at the time `now`.
    fn follow_refusals(&mut self, now: Instant) {
        let mut refused: BTreeMap<(Reason, u16), Refused> = BTreeMap::new();
        let reports = self.known.values().map(|it| it.report);
        for by in reports.filter(|by| now.since(by.at) < SILENT_AFTER.times(2)) {
            let refusals = [
                (Reason::Mission, by.other_mission),
                (Reason::Key, by.other_key),
                (Reason::Epoch, by.old_epoch),
            ];
            let named = refusals
                .into_iter()
                .filter_map(|(reason, it)| Some((reason, it?)));
            for (reason, newest) in named {
                let is_toward_tx = |number: u16| number < by.relay;
                // Of a relay toward Tx and one toward Rx, each report has one.
                let other = self.refused.iter().filter_map(|((of, number), it)| {
                    let at = *it.by.get(&by.relay)?;
                    let is_other = is_toward_tx(*number) != is_toward_tx(newest);
                    (*of == reason && is_other && by.at.since(at) < TURNS).then_some((*number, at))
                });
                for (number, at) in other.chain([(newest, by.at)]) {
                    let key = (reason, number);
                    let before = self.refused.get(&key);
                    let it = refused.entry(key).or_insert_with(|| Refused {
                        by: BTreeMap::new(),
                        since: at,
                        back_at: before.and_then(|it| it.back_at),
                    });
                    it.by.insert(by.relay, at);
                    it.since = before.map_or(at.min(it.since), |it| it.since);
                }
            }
        }
        for ((_, number), it) in &mut refused {
            let is_back = |known: &Known| {
                let at = known.report.at;
                at > it.since && now.since(at) < known.silent_after()
            };
            let is_back = self.known.get(number).is_some_and(is_back);
            it.back_at = is_back.then(|| it.back_at.unwrap_or(now));
        }
        self.refused = refused;
    }

    /// Returns the relays that are known and not cleared.
    fn shown(&self) -> impl Iterator<Item = &Known> {
        let known = self.known.iter();
        known.filter_map(|(number, it)| (!self.cleared.contains_key(number)).then_some(it))
    }

    fn claims(&self, number: u16) -> Vec<u16> {
        let claims = self.claims.get(&number).into_iter().flatten();
        claims.map(|(by, _)| *by).collect()
    }

    fn lasting(&self, now: Instant, chain: &Chain<'_>) -> Vec<Lasting> {
        let mut all = Vec::new();
        let mut add = |reason, subject, by: Vec<u16>, note| all.push((reason, subject, by, note));
        let quiet = now.since(self.frame_at);
        let Frames { received, rejected } = self.frames;
        if quiet >= SILENT_AFTER && !self.known.is_empty() {
            let note = format!(
                " for {} s; {received} frames received until then, {rejected} rejected",
                quiet.as_micros() / 1_000_000
            );
            add(Reason::ChainSilent, 0, Vec::new(), note);
        }
        let is_unknown = |it: &u16| !self.known.contains_key(it);
        let unknown: Vec<u16> = (1..=chain.relays).filter(is_unknown).collect();
        if !unknown.is_empty() {
            let note = if received == 0 && self.known.is_empty() {
                "; nothing received from the chain yet".to_owned()
            } else {
                self.gaps(now)
            };
            add(Reason::NoReport, 0, unknown, note);
        }
        if let (Some((present, since)), Some(meant)) = (self.short, chain.flying)
            && now.since(since) >= TOO_FEW_AFTER
        {
            let note = format!(": {present}, of {meant} that are meant to fly");
            add(Reason::TooFew, 0, Vec::new(), note);
        }
        let is_recent = |at: Instant| now.since(at) < REJECTED_FOR;
        if self.rejected_at.is_some_and(is_recent) {
            let all = u64::from(received) + u64::from(rejected);
            let note = format!(": {rejected} of {all} since its start");
            add(Reason::Rejected, 0, Vec::new(), note);
        }
        for ((reason, number), it) in &self.refused {
            // Reports of a refused relay do not reach this station.
            let lasts = it
                .back_at
                .is_none_or(|back_at| *reason == Reason::Mission && now.since(back_at) >= LINGERS);
            if lasts && (1..=chain.relays).contains(number) {
                add(
                    *reason,
                    *number,
                    it.by.keys().copied().collect(),
                    String::new(),
                );
            }
        }
        for known in self.shown() {
            let number = known.report.relay;
            let by = self.claims(number);
            let heard_at = known.report.at.max(self.resumed_at);
            let after = known.silent_after();
            let is_late = now.since(known.report.at) >= after;
            // While nothing at all is received, an alarm that has begun stays, and none begins.
            let begins = quiet < QUIET_AFTER
                && now.since(heard_at) >= after
                && (now.since(heard_at) >= OVERDUE_AFTER
                    || !self.is_overheard(now, number)
                        && !self.may_be_behind(now, chain.end, number));
            let is_silent = is_late && (begins || self.alarms.lasts(Reason::Lost, number));
            if is_silent || !by.is_empty() {
                let note = match (is_late, by.is_empty()) {
                    (false, _) => String::new(),
                    (true, false) => "; no report for 5 s".to_owned(),
                    (true, true) => format!(": no report for 5 s{}", self.gaps(now)),
                };
                add(Reason::Lost, number, by, note);
            }
            let own = [
                (Reason::Duplicate, known.report.is_duplicated),
                (Reason::Blind, known.is_blind()),
                (Reason::LinkLost, known.is_link_lost),
                (Reason::Released, known.is_released),
                (
                    Reason::Stuck,
                    known.is_stuck() || known.report.refuses_setpoint,
                ),
            ];
            for (reason, _) in own.into_iter().filter(|(_, is)| *is) {
                add(reason, number, vec![number], String::new());
            }
            if let (Some((newest, since)), Some(version)) = (self.version, known.report.version)
                && version != newest
                && known.report.at.since(since) >= SILENT_AFTER
            {
                let note = format!(": version {version}, other relays version {newest}");
                add(Reason::Version, number, vec![number], note);
            }
        }
        for reason in [Reason::NoQuorum, Reason::Infeasible, Reason::LeaseExpired] {
            let lasts = |it: &&Known| match reason {
                Reason::NoQuorum => it.report.phase == Phase::NoQuorum,
                Reason::Infeasible => it.report.phase == Phase::Infeasible,
                _ => it.has_expired(),
            };
            let by = self.shown().filter(lasts);
            let by: Vec<u16> = by.map(|it| it.report.relay).collect();
            if !by.is_empty() {
                add(reason, 0, by, String::new());
            }
        }
        all
    }

    /// Returns true if the station still receives frames of relay `number`.
    fn is_overheard(&self, now: Instant, number: u16) -> bool {
        let last = self.overheard.get(&number);
        last.is_some_and(|last| now.since(*last) < SILENT_AFTER)
    }

    /// Returns true if reports of relay `number` may be missing because of a silent relay on their way.
    ///
    /// The silent relay is between relay `number` and the station. Either its silence is so short that the chain does
    /// not bypass it yet, or it has just returned, so that reports through it may still be on their way. False if
    /// later reports of a relay beyond have arrived: then they pass.
    fn may_be_behind(&self, now: Instant, end: Side, number: u16) -> bool {
        let is_nearer = |relay: u16, of: u16| match end {
            Side::Upstream => relay < of,
            Side::Downstream => relay > of,
        };
        let mut beyond = self.shown().filter(|it| is_nearer(number, it.report.relay));
        let newest = self.known.get(&number).map(|it| it.report.at);
        if newest.is_some_and(|at| beyond.any(|it| it.report.at.since(at) >= SILENT_AFTER)) {
            return false;
        }
        let mut nearer = self
            .known
            .values()
            .filter(|it| is_nearer(it.report.relay, number));
        nearer.any(|it| {
            let is_back = |at| now.since(at) < SILENT_AFTER;
            (UNSURE_AFTER..CLOSED_AFTER).contains(&now.since(it.report.at))
                || it.returned_at.is_some_and(is_back)
        })
    }

    /// Lists which relays report that they do not receive a neighbour, for an alarm about missing reports.
    fn gaps(&self, now: Instant) -> String {
        let fresh = self.known.values().map(|it| &it.report);
        let fresh = fresh.filter(|it| now.since(it.at) < SILENT_AFTER);
        let gaps = fresh.flat_map(|by| silent(by).map(|it| (by.relay, it)));
        let gaps = gaps.map(|(by, it)| format!("; relay {by} does not receive relay {it}"));
        gaps.collect::<Vec<_>>().concat()
    }
}

/// Returns the distance of a drone from its setpoint, m. `None` if the relay does not control the drone, or if the
/// drone waits.
fn distance_to_fly_m(report: &Report) -> Option<f32> {
    let flies = report.control == Some(State::Engaged) && report.hold_reasons == [None; 2];
    let (at, to) = (report.position?, report.setpoint?);
    let way_m = (at.x_m - to.x_m).hypot(at.y_m - to.y_m);
    flies.then(|| way_m.hypot(at.altitude_m - to.altitude_m))
}

/// Returns the neighbours that a relay reports as silent.
fn silent(report: &Report) -> impl Iterator<Item = u16> {
    let pairs = report.neighbours.into_iter().zip(report.silent);
    pairs.filter_map(|(beside, is_silent)| beside.filter(|_| is_silent))
}

/// Returns a log line for each difference between two reports, or one line for the first report.
fn changes(before: Option<&Report>, new: &Report) -> Vec<String> {
    let Some(old) = before else {
        let words = |it| format!(", {}", control(it));
        let control = new.control.map_or(String::new(), words);
        return vec![format!("first report: {}{control}", phase(new))];
    };
    let mut lines = Vec::new();
    if phase(old) != phase(new) {
        lines.push(phase(new).to_owned());
    }
    if old.control != new.control {
        let words = new.control.map_or("no autopilot link", control);
        lines.push(format!("control: {words}"));
    }
    if old.agreed != new.agreed {
        lines.push(match new.agreed {
            Some(at) => {
                let Placement {
                    x_m,
                    y_m,
                    altitude_m: h_m,
                } = at;
                format!("agreed position: x {x_m:.1} m, y {y_m:.1} m, altitude {h_m:.1} m")
            }
            None => "no agreed position any more".to_owned(),
        });
    }
    let (waited, waits) = (hold_reason(old), hold_reason(new));
    if waited != waits {
        lines.push(waits.map_or("no longer waits".to_owned(), |why| format!("waits: {why}")));
    }
    for it in silent(new).filter(|it| !silent(old).any(|was| was == *it)) {
        lines.push(format!("does not receive relay {it}"));
    }
    let beside: Vec<u16> = new.neighbours.into_iter().flatten().collect();
    for it in silent(old).filter(|it| beside.contains(it) && !silent(new).any(|is| is == *it)) {
        lines.push(format!("receives relay {it} again"));
    }
    if old.neighbours != new.neighbours {
        lines.push(match beside.as_slice() {
            [] => "no neighbours".to_owned(),
            all => format!("neighbours: {}", named(all)),
        });
    }
    if let Some(version) = new.version
        && version != old.version.unwrap_or(0)
    {
        lines.push(format!("flies version {version} of the mission"));
    }
    lines
}
