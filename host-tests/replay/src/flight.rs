//! Flight computed from merged frames: snapshots of the screen, log, and figures of the report.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::axis::Axis;
use uav_relay::wire::message::{Detail, Entry, Message};
use uav_relay::{GuardConfig, Instant, Mission, Phase, Placement, Profile, Report, Side, Upload};
use uav_relay_screen::chain::{Chain, SILENT_AFTER, seconds};
use uav_relay_screen::station::{Frames, StationView};
use uav_relay_screen::{Alarm, LogLine, Snapshot, clean};

use crate::recording::Frame;

/// Time between two computed snapshots, s.
///
/// It does not depend on the flight's duration, because an alarm begins after a few seconds.
const PERIOD: f64 = 0.5;

/// Maximum number of stored snapshots, not counting the last. In a long flight only every k-th snapshot is stored.
const MOST: f64 = 7_200.0;

/// Maximum time between two reported positions of a relay between which a position is interpolated, s.
const GAP: f64 = 5.0;

/// Mission that the chain loaded before flight, from the scenario.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Mission loaded before flight, with all parameters.
    pub mission: Mission,
    /// Number of relays that are meant to fly: `fleet.flying` of the scenario.
    pub flying: Option<u16>,
    /// Profiles (altitude and power) of single relays, with the relay's number.
    pub profiles: Vec<(u16, Profile)>,
    /// Line on earth from Tx to Rx, if the scenario has one.
    pub axis: Option<Axis>,
}

/// Period in which one relay, or all relays, sent no report.
#[derive(Clone, PartialEq, Debug)]
pub struct Loss {
    /// Number of the silent relay; 0 if all were silent.
    pub relay: u16,
    /// Time of the last report before the silence, s.
    pub from: f64,
    /// Time of the first report after the silence, s; `None` if there is no later report.
    pub until: Option<f64>,
    /// True if any other relay has reported the silent relay as lost.
    pub is_reported: bool,
}

impl Loss {
    /// Returns true if this silence is a part of `all`, a silence of all relays.
    ///
    /// The part may begin up to 5 s earlier than `all`, and end up to 5 s later.
    fn is_part_of(&self, all: &Self) -> bool {
        let margin = seconds(Instant::ZERO + SILENT_AFTER);
        let ends = all
            .until
            .is_none_or(|end| self.until.is_some_and(|it| it <= end + margin));
        ends && (0.0..=margin).contains(&(all.from - self.from))
    }
}

/// Closest approach of two relays in the air.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Nearest {
    /// Distance of the two relays at their closest approach, the smallest of the flight, m.
    pub distance_m: f64,
    /// Node numbers of the two relays.
    pub relays: [u16; 2],
    /// Time of the closest approach, s.
    pub time_s: f64,
}

/// Recorded flight. All times except `begin` are in s since the flight's first frame.
#[derive(Debug, Default)]
pub struct Flight {
    /// Time of the flight's first frame, s since 1970-01-01.
    pub begin: f64,
    /// Duration of the flight, s.
    pub duration: f64,
    /// Time between two stored snapshots, s. The last snapshot is taken at the end of the flight.
    pub period: f64,
    /// Stored snapshots as JSON. Each one has only the changes since the previous stored snapshot.
    pub steps: Vec<Value>,
    /// Last snapshot of the flight.
    pub last: Snapshot,
    /// Log of the flight, as the ground station would have shown it.
    pub log: Vec<LogLine>,
    /// Alarms of the flight, as the ground station would have shown them.
    pub alarms: Vec<Alarm>,
    /// Number of relays in the recorded flight.
    pub relays: u16,
    /// Time of the first agreement, s, and two fractions of the time since then.
    ///
    /// In the first fraction of the time, all relays have agreed positions. In the second fraction, all members of the
    /// view (membership of the chain) in force have agreed positions.
    pub available: Option<(f64, [f64; 2])>,
    /// Lowest SIR of any hop since the previous stored snapshot, dB; `None` if unknown.
    pub worst_db: Vec<Option<f64>>,
    /// Periods in which relays sent no reports.
    pub losses: Vec<Loss>,
    /// Agreed views (memberships of the chain): time, s, view number, and number of relays.
    pub views: Vec<(f64, u32, u16)>,
    /// Closest approach of two relays in the air, `None` if two were never in the air at the same time.
    pub nearest: Option<Nearest>,
}

/// Returns the largest relay number in the reports; 0 without reports.
pub fn largest(frames: &[Frame]) -> u16 {
    let entries = frames.iter().flat_map(entries);
    entries.map(|(entry, ..)| entry.relay()).max().unwrap_or(0)
}

/// Returns the relay states in a report message; no states for other messages.
///
/// The first state of the report comes with the report's detail, if any.
fn entries(frame: &Frame) -> impl Iterator<Item = (Entry, Option<Detail>)> {
    let report = match &frame.message {
        Some(Message::Report(report)) => Some(report),
        _ => None,
    };
    report.into_iter().flat_map(|report| {
        let mut detail = report.detail;
        let entries = report.entries.iter();
        entries.map(move |entry| (*entry, detail.take()))
    })
}

impl Flight {
    /// Computes the flight of `relays` relays from frames in order of time.
    pub fn new(frames: &[Frame], relays: u16, loaded: Option<&Loaded>) -> Self {
        let begin = frames.first().map_or(0.0, |frame| frame.at);
        let duration = frames.last().map_or(0.0, |frame| frame.at - begin);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "number of snapshots"
        )]
        let [count, every] =
            [1.0, MOST].map(|most| (duration / (most * PERIOD)).ceil().max(1.0) as usize);
        let period = every as f64 * PERIOD;
        let mut flight = Self {
            begin,
            duration,
            period,
            relays,
            ..Self::default()
        };
        let reports = reports(frames, begin, relays);
        flight.follow_frames(frames);
        let mut recorder = Recorder::new(&reports, loaded);
        let mut shown = json!({});
        for step in 0..=count {
            let now = (step as f64 * PERIOD).min(duration);
            let received = frames.partition_point(|frame| frame.at - begin <= now);
            let snapshot =
                recorder.advance(&mut flight, now, frames.get(..received).unwrap_or_default());
            if step % every != 0 && step != count {
                continue;
            }
            flight.worst_db.push(recorder.worst_db.take());
            let value = compact(&snapshot, now);
            flight
                .steps
                .push(difference(&shown, &value).unwrap_or_else(|| json!({})));
            shown = value;
            flight.last = snapshot;
        }
        recorder.finish(&mut flight);
        flight
            .log
            .sort_by(|one, other| one.time_s.total_cmp(&other.time_s));
        flight
    }

    /// Returns the time of the stored snapshot with index `step`, s.
    pub fn time_of(&self, step: usize) -> f64 {
        (step as f64 * self.period).min(self.duration)
    }

    /// Records the agreed views and the uploaded missions.
    fn follow_frames(&mut self, frames: &[Frame]) {
        let mut offered = Vec::new();
        for frame in frames {
            let time_s = frame.at - self.begin;
            let mut say = |text| self.log.push(LogLine { time_s, text });
            match &frame.message {
                Some(Message::Decision(decision)) => {
                    if let Some(view) = decision.accepted
                        && !self
                            .views
                            .iter()
                            .any(|(_, number, _)| *number == view.id.number())
                    {
                        let number = view.id.number();
                        say(format!(
                            "membership agreed: {} relays (view {number})",
                            view.relays
                        ));
                        self.views.push((time_s, number, view.relays));
                    }
                }
                Some(Message::Offer { upload, .. }) => {
                    let sender = frame.header.sender;
                    let is_ground = sender == 0 || sender > self.relays;
                    if is_ground && !offered.contains(&upload.version()) {
                        offered.push(upload.version());
                        let end = if sender == 0 { "Tx" } else { "Rx" };
                        say(format!(
                            "ground station at {end} uploads version {} of the mission",
                            upload.version()
                        ));
                    }
                }
                _ => {}
            }
        }
    }
}

/// Returns the reported states of all relays in order of time.
///
/// The time of a state is the time of its frame minus the age that the frame states for it.
fn reports(frames: &[Frame], begin: f64, relays: u16) -> Vec<Report> {
    let mut all: Vec<_> = frames
        .iter()
        .flat_map(|frame| entries(frame).map(move |entry| (frame.at - begin, entry)))
        .filter(|(_, (entry, _))| entry.relay() <= relays)
        .map(|(at, (entry, detail))| ((at - f64::from(entry.age) / 10.0).max(0.0), entry, detail))
        .collect();
    all.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
    let mut details = BTreeMap::<u16, Detail>::new();
    all.into_iter()
        .map(|(at, entry, detail)| {
            if let Some(detail) = detail {
                details.insert(entry.relay(), detail);
            }
            let last = details.get(&entry.relay()).copied();
            Report::of(&entry, last, instant(at))
        })
        .collect()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times of a flight"
)]
fn instant(at: f64) -> Instant {
    Instant::from_micros((at * 1e6).round() as u64)
}

/// State of the recorder, which follows the flight from one snapshot to the next.
struct Recorder<'a> {
    reports: &'a [Report],
    loaded: Option<&'a Loaded>,
    view: StationView,
    uploads: BTreeMap<u16, Upload>,
    /// End of the chain where the ground station is that last sent a Watch (request for reports).
    end: Side,
    /// Number of processed reports, and of processed frames.
    used: [usize; 2],
    received: u32,
    newest: BTreeMap<u16, Report>,
    tracks: BTreeMap<u16, Vec<(f64, Placement)>>,
    /// Lowest SIR since the last stored snapshot, dB; `None` if unknown.
    worst_db: Option<f64>,
    /// Silences that have not ended yet, by relay number.
    open: BTreeMap<u16, Loss>,
    /// Last time at which all relays were silent.
    silent_at: Instant,
    /// Time of the first agreement, s, and numbers of snapshots since then.
    ///
    /// The numbers count all snapshots; those in which all relays have agreed positions; and those in which all members
    /// of the view (membership of the chain) have agreed positions.
    agreed: Option<(f64, u32, [u32; 2])>,
}

impl<'a> Recorder<'a> {
    fn new(reports: &'a [Report], loaded: Option<&'a Loaded>) -> Self {
        let mut tracks = BTreeMap::<u16, Vec<_>>::new();
        for report in reports {
            let is_up = report.control != Some(State::Grounded);
            if let Some(place) = report.position.filter(|_| is_up) {
                let track = tracks.entry(report.relay).or_default();
                track.push((seconds(report.at), place));
            }
        }
        Self {
            reports,
            loaded,
            view: StationView::default(),
            uploads: BTreeMap::new(),
            end: Side::Upstream,
            used: [0; 2],
            received: 0,
            newest: BTreeMap::new(),
            tracks,
            worst_db: None,
            open: BTreeMap::new(),
            silent_at: Instant::ZERO,
            agreed: None,
        }
    }

    /// Returns the snapshot at `now` and updates `flight`. `frames` are all frames up to `now`.
    fn advance(&mut self, flight: &mut Flight, now: f64, frames: &[Frame]) -> Snapshot {
        for frame in frames.get(self.used[1]..).unwrap_or_default() {
            self.act(flight, now, frame);
            match &frame.message {
                Some(Message::Offer { upload, .. }) => {
                    self.uploads.insert(upload.version(), *upload);
                }
                Some(Message::Watch { .. }) if frame.header.sender == 0 => {
                    self.end = Side::Upstream;
                }
                Some(Message::Watch { .. }) if frame.header.sender > flight.relays => {
                    self.end = Side::Downstream;
                }
                Some(Message::Report(_)) => self.received += 1,
                _ => {}
            }
        }
        let rest = self.reports.get(self.used[0]..).unwrap_or_default();
        let new = rest.iter().take_while(|report| report.at <= instant(now));
        let new: Vec<Report> = new.copied().collect();
        self.used = [self.used[0] + new.len(), frames.len()];
        self.newest
            .extend(new.iter().map(|report| (report.relay, *report)));
        let mut snapshot = self.snapshot(flight.relays, now, &new);
        flight.log.append(&mut snapshot.log);
        clean(&mut snapshot);
        for alarm in &snapshot.alarms {
            match flight
                .alarms
                .iter_mut()
                .find(|it| it.number == alarm.number)
            {
                Some(known) => known.clone_from(alarm),
                None => flight.alarms.push(alarm.clone()),
            }
        }
        let hops = snapshot.hops.iter();
        let sirs = hops.flat_map(|hop| {
            [
                hop.measured_db.or(hop.sir_db),
                hop.measured_back_db.or(hop.sir_back_db),
            ]
        });
        self.worst_db = sirs.flatten().chain(self.worst_db).reduce(f64::min);
        self.losses(flight, now, &snapshot);
        for report in &new {
            self.nearest(flight, seconds(report.at), Some(report.relay));
        }
        self.nearest(flight, now, None);
        snapshot
    }

    /// Applies and logs the operator's commands that the comment of a frame contains.
    fn act(&mut self, flight: &mut Flight, now: f64, frame: &Frame) {
        let acts = frame.comment.split("; ");
        for act in acts.filter_map(|it| it.strip_prefix("operator: ")) {
            let words: Vec<&str> = act.split_whitespace().collect();
            let cleared = match words.as_slice() {
                ["clear-lost", relay, ..] => relay.parse().ok(),
                _ => None,
            };
            // The captures may not show that the relay was lost.
            if cleared.is_none_or(|relay| self.view.clear(instant(now), relay, &[]).is_err()) {
                flight.log.push(LogLine {
                    time_s: frame.at - flight.begin,
                    text: format!("operator: {act}"),
                });
            }
        }
    }

    fn snapshot(&mut self, relays: u16, now: f64, new: &[Report]) -> Snapshot {
        let version = self.view.version().unwrap_or(0);
        let upload = self.uploads.get(&version);
        let uploaded = upload.and_then(|it| Mission::try_new(*it.config()).ok());
        let sites = upload.and_then(Upload::sites);
        let uploaded_axis = sites.and_then(|sites| Axis::between(sites).ok());
        let base = self
            .loaded
            .filter(|_| version == 0 || upload.is_some() && sites.is_none());
        let chain = Chain {
            mission: uploaded.as_ref().or(base.map(|it| &it.mission)),
            end: self.end,
            relays,
            flying: self.loaded.and_then(|it| it.flying),
            profiles: self.loaded.map_or(&[], |it| it.profiles.as_slice()),
            is_estimated: false,
            axis: uploaded_axis
                .as_ref()
                .or(base.and_then(|it| it.axis.as_ref())),
            geofence: base
                .map(|it| GuardConfig::of(&it.mission, it.mission.config().common).geofence),
        };
        let frames = Frames {
            received: self.received,
            rejected: 0,
        };
        let mut snapshot = self.view.snapshot(instant(now), &chain, new, frames);
        for alarm in &mut snapshot.alarms {
            alarm.text = replayed(std::mem::take(&mut alarm.text));
        }
        snapshot
    }

    /// Updates the chain's availability and the silences from `snapshot`, the state at `now`.
    ///
    /// The availability is the fraction of time with agreed positions.
    fn losses(&mut self, flight: &mut Flight, now: f64, snapshot: &Snapshot) {
        let is_fresh = |report: &Report| instant(now).since(report.at) < SILENT_AFTER;
        let reporting: Vec<&Report> = self.newest.values().filter(|it| is_fresh(it)).collect();
        let have_agreed = reporting
            .iter()
            .filter(|it| it.phase == Phase::Holding)
            .count();
        let views = flight.views.iter().take_while(|(at, ..)| *at <= now);
        let members = views.last().map_or(flight.relays, |(.., members)| *members);
        let is_available = [flight.relays, members].map(|all| have_agreed >= usize::from(all));
        if is_available[0] && self.agreed.is_none() {
            self.agreed = Some((now, 0, [0; 2]));
        }
        if let Some((_, all, [every, members])) = &mut self.agreed {
            *all += 1;
            *every += u32::from(is_available[0]);
            *members += u32::from(is_available[1]);
        }
        let last = self.newest.values().map(|it| it.at).max();
        if reporting.is_empty() {
            self.silent_at = instant(now);
        }
        let is_late = instant(now).since(self.silent_at) >= SILENT_AFTER;
        for (number, at) in self
            .newest
            .values()
            .map(|it| (it.relay, it.at))
            .chain(last.map(|at| (0, at)))
        {
            let is_old = instant(now).since(at) >= SILENT_AFTER;
            if !is_old {
                if let Some(mut loss) = self.open.remove(&number) {
                    loss.until = Some(seconds(at));
                    flight.losses.push(loss);
                }
            } else if number == 0 || is_late || self.open.contains_key(&number) {
                let reported = snapshot
                    .relays
                    .iter()
                    .any(|it| it.lost_neighbours.contains(&number));
                let loss = self.open.entry(number).or_insert_with(|| Loss {
                    relay: number,
                    from: seconds(at),
                    until: None,
                    is_reported: false,
                });
                loss.is_reported |= reported;
            }
        }
    }

    /// Updates the closest approach of the flight by the distances between relays at `time_s`.
    ///
    /// If `only` is given, only the distances from relay `only` to the other relays are computed.
    fn nearest(&self, flight: &mut Flight, time_s: f64, only: Option<u16>) {
        let places = self.tracks.iter();
        let places: Vec<(u16, Placement)> = places
            .filter_map(|(relay, track)| Some((*relay, between(track, time_s)?)))
            .collect();
        let own = places
            .iter()
            .filter(|(one, _)| only.is_none_or(|only| *one == only));
        for (one, at) in own {
            let others = places
                .iter()
                .filter(|(other, _)| other > one || only.is_some() && other < one);
            for (other, beside) in others {
                let [x, y, up] = [
                    at.x_m - beside.x_m,
                    at.y_m - beside.y_m,
                    at.altitude_m - beside.altitude_m,
                ];
                let distance_m = f64::from(x).hypot(y.into()).hypot(up.into());
                if flight.nearest.is_none_or(|it| distance_m < it.distance_m) {
                    flight.nearest = Some(Nearest {
                        distance_m,
                        relays: [*one.min(other), *one.max(other)],
                        time_s,
                    });
                }
            }
        }
    }

    fn finish(self, flight: &mut Flight) {
        flight.losses.extend(self.open.into_values());
        // When all relays fall silent, some of them begin earlier, and some report again later.
        let outages = flight.losses.iter().filter(|it| it.relay == 0);
        let outages: Vec<Loss> = outages.cloned().collect();
        flight
            .losses
            .retain(|it| it.relay == 0 || !outages.iter().any(|all| it.is_part_of(all)));
        flight
            .losses
            .sort_by(|one, other| one.from.total_cmp(&other.from));
        flight.available = self
            .agreed
            .map(|(at, all, agreed)| (at, agreed.map(|it| f64::from(it) / f64::from(all))));
    }
}

/// Replaces or removes the text about the station's received frames in the text of an alarm.
///
/// A replay has no data about the frames that the station received.
fn replayed(text: String) -> String {
    match text.split_once("nothing received from the chain") {
        Some(("", rest)) => {
            let time = rest.split(':').next().unwrap_or_default();
            format!("no report of any relay{time}")
        }
        Some((before, _)) => before.trim_end_matches("; ").to_owned(),
        None => text,
    }
}

/// Returns the position of a relay at `now`, interpolated between the reports before and after `now`.
///
/// `None` if there is no such pair of reports, or if the time between the two reports exceeds [`GAP`].
fn between(track: &[(f64, Placement)], now: f64) -> Option<Placement> {
    let after = track.partition_point(|(at, _)| *at < now);
    let (t0, one) = track.get(after.checked_sub(1)?)?;
    let (t1, other) = track.get(after).filter(|(at, _)| at - t0 <= GAP)?;
    #[expect(clippy::cast_possible_truncation, reason = "a share")]
    let share = ((now - t0) / (t1 - t0).max(1e-9)) as f32;
    let mix = |from: f32, to: f32| from + share * (to - from);
    Some(Placement {
        x_m: mix(one.x_m, other.x_m),
        y_m: mix(one.y_m, other.y_m),
        altitude_m: mix(one.altitude_m, other.altitude_m),
    })
}

/// Returns a snapshot as JSON with rounded numbers.
///
/// The age of a report differs in every snapshot, so it is replaced by the report's time `at_s`.
fn compact(snapshot: &Snapshot, now: f64) -> Value {
    let mut value = serde_json::to_value(snapshot).unwrap_or_default();
    if let Some(all) = value.as_object_mut() {
        all.remove("time_s");
        let relays = all.get_mut("relays").and_then(Value::as_array_mut);
        for relay in relays
            .into_iter()
            .flatten()
            .filter_map(Value::as_object_mut)
        {
            let age = relay.remove("age_s").and_then(|age| age.as_f64());
            relay.insert("at_s".to_owned(), age.map(|age| now - age).into());
        }
    }
    round(&mut value);
    value
}

/// Rounds all numbers in a JSON value to two decimals, except powers and degrees.
fn round(value: &mut Value) {
    match value {
        Value::Number(number) if number.is_f64() => {
            let rounded = number.as_f64().map(|it| (it * 100.0).round() / 100.0);
            *value = rounded.into();
        }
        Value::Array(all) => all.iter_mut().for_each(round),
        Value::Object(all) => all
            .iter_mut()
            .filter(|(key, _)| !matches!(key.as_str(), "power_w" | "origin_deg"))
            .for_each(|(_, value)| round(value)),
        _ => {}
    }
}

/// Returns the changes from `old` to `new` for the page; `None` without changes.
///
/// For an object or array, the result has the changed values by key or index. The key `#` is an array's new length.
fn difference(old: &Value, new: &Value) -> Option<Value> {
    let mut changes = serde_json::Map::new();
    match (old, new) {
        (Value::Object(old), Value::Object(new)) => {
            for (key, value) in new {
                let change = old
                    .get(key)
                    .map_or_else(|| Some(value.clone()), |it| difference(it, value));
                changes.extend(change.map(|change| (key.clone(), change)));
            }
        }
        (Value::Array(old), Value::Array(new)) => {
            if old.len() != new.len() {
                changes.insert("#".to_owned(), new.len().into());
            }
            for (index, value) in new.iter().enumerate() {
                let change = old
                    .get(index)
                    .map_or_else(|| Some(value.clone()), |it| difference(it, value));
                changes.extend(change.map(|change| (index.to_string(), change)));
            }
        }
        _ if old == new => return None,
        _ => return Some(new.clone()),
    }
    (!changes.is_empty()).then_some(changes.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_powers_and_degrees_are_not_rounded() {
        let mut value =
            json!({"origin_deg": [47.123_456_7], "all": [{"power_w": 0.001, "x_m": 1.234}]});
        round(&mut value);
        let exact = json!({"origin_deg": [47.123_456_7], "all": [{"power_w": 0.001, "x_m": 1.23}]});
        assert_eq!(value, exact);
    }
}
