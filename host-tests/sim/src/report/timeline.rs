//! Log of a run, as JSON entries and as grouped lines of text.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::Instant;
use uav_relay_screen::{list, named};

use crate::simulator::outcome::{Moment, TimelineEvent};

/// Converts a virtual time to seconds since the start of the run.
pub fn seconds(at: Instant) -> f64 {
    at.as_micros() as f64 / 1e6
}

/// Entry in the log of a run: an event at one node.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MomentReport {
    /// Time of the event, s of virtual time.
    pub at_s: f64,
    /// Node that the entry is about: a relay's number from 1, 0 for Tx, N + 1 for Rx.
    ///
    /// For a partition it is the relay after which the chain is cut.
    pub relay: u16,
    /// Kind of the event, in words.
    ///
    /// `silent`, `switched on`, `lost`, `found`, `view accepted`, `no quorum`, `converged`, `infeasible`,
    /// `partition`, `partition ended`, `does not receive`, `receives again`, `offered`, `stored`, `adopted`, `lease
    /// expired`, `not received by`, `mission mismatch`, `key mismatch`, `epoch went back`, `duplicate index`; of
    /// autopilots `engaged`, `released`, `blind`, `restarted`; of relays that measure `new estimate`, `interferer
    /// unclear`, `sensor off`.
    pub what: &'static str,
    /// Second node that the event concerns, for example a lost or found neighbour; absent if none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other: Option<u16>,
    /// Number of the view (membership of the chain) that the relay accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<u32>,
    /// Number of relays in the view that the relay accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relays: Option<u16>,
    /// Version of the mission that was offered, stored or adopted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Linear target SIR of the position that the relay accepted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sir: Option<f64>,
}

impl MomentReport {
    fn of(moment: &Moment) -> Self {
        let what = match moment.what {
            TimelineEvent::Silent => "silent",
            TimelineEvent::Booted => "switched on",
            TimelineEvent::Lost(_) => "lost",
            TimelineEvent::Found(_) => "found",
            TimelineEvent::ViewAccepted { .. } => "view accepted",
            TimelineEvent::NoQuorum => "no quorum",
            TimelineEvent::LeaseLapsed => "lease expired",
            TimelineEvent::NotHeard => "not received by",
            TimelineEvent::MissionMismatch => "mission mismatch",
            TimelineEvent::KeyMismatch => "key mismatch",
            TimelineEvent::EpochWentBack => "epoch went back",
            TimelineEvent::DuplicateIndex => "duplicate index",
            TimelineEvent::Converged => "converged",
            TimelineEvent::Infeasible => "infeasible",
            TimelineEvent::Partitioned => "partition",
            TimelineEvent::PartitionEnded => "partition ended",
            TimelineEvent::Deaf => "does not receive",
            TimelineEvent::Hears => "receives again",
            TimelineEvent::Offered(_) => "offered",
            TimelineEvent::Uploaded(_) => "stored",
            TimelineEvent::Adopted(_) => "adopted",
            TimelineEvent::Engaged => "engaged",
            TimelineEvent::Released => "released",
            TimelineEvent::Blind => "blind",
            TimelineEvent::Restarted => "restarted",
            TimelineEvent::NewEstimate => "new estimate",
            TimelineEvent::InterfererUnclear => "interferer unclear",
            TimelineEvent::SensorOff => "sensor off",
            TimelineEvent::MayLeave => "may leave",
            TimelineEvent::MustLeave => "has to leave",
            TimelineEvent::MayLeaveTold => "told to leave",
        };
        let (view, relays) = match moment.what {
            TimelineEvent::ViewAccepted { view, relays, .. } => (Some(view), Some(relays)),
            _ => (None, None),
        };
        let version = match moment.what {
            TimelineEvent::Offered(version)
            | TimelineEvent::Uploaded(version)
            | TimelineEvent::Adopted(version) => Some(version),
            _ => None,
        };
        let sir = moment.target.filter(|_| what == "converged");
        Self {
            at_s: seconds(moment.at),
            relay: moment.relay,
            what,
            other: moment.other,
            view,
            relays,
            version,
            sir: sir.map(f64::from),
        }
    }
}

/// Converts the log of a run to report entries. The result is empty if the log has only accepted positions and results
/// that no positions exist.
pub(super) fn timeline(moments: &[Moment]) -> Vec<MomentReport> {
    let plain = |moment: &Moment| {
        matches!(
            moment.what,
            TimelineEvent::Converged | TimelineEvent::Infeasible
        )
    };
    if moments.iter().all(plain) {
        return Vec::new();
    }
    moments.iter().map(MomentReport::of).collect()
}

/// Log entries of several relays about the same event, which are shown as one line of text.
#[derive(Clone, PartialEq, Debug)]
struct Group {
    first_s: f64,
    last_s: f64,
    /// Numbers of the relays that have logged the event, in the order of their entries.
    relays: Vec<u16>,
    sample: MomentReport,
}

/// Returns the line of the log about one event at one node. The line names the node.
pub fn line(moment: &Moment) -> String {
    let relay = moment.relay;
    if let (TimelineEvent::Converged, Some(sir)) = (moment.what, moment.target) {
        return format!("relay {relay}: position agreed, SIR {sir:.3}");
    }
    let sample = MomentReport::of(moment);
    let line = Group {
        first_s: sample.at_s,
        last_s: sample.at_s,
        relays: vec![relay],
        sample,
    }
    .line();
    // The other log lines of these events do not name the relay.
    match moment.what {
        TimelineEvent::ViewAccepted { .. }
        | TimelineEvent::Converged
        | TimelineEvent::Infeasible => format!("relay {relay}: {line}"),
        _ => line,
    }
}

/// Longest time between two successive log entries that are grouped as one event, s.
///
/// The neighbours of a relay can detect the same failure at different times.
const TOGETHER_S: f64 = 10.0;

/// Groups log entries about the same event, sorted by time.
///
/// An event in which all relays take part, such as an agreement, has the time of its last entry. Any other event has
/// the time of its first entry.
fn groups(timeline: &[MomentReport]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for moment in timeline {
        // Entries before a new view do not belong to those after it.
        let open = groups
            .iter()
            .rposition(|group| group.sample.what == "view accepted" && moment.what == "converged")
            .unwrap_or(0);
        let mut known = groups.iter_mut().skip(open).rev();
        let same =
            known.find(|group| moment.at_s - group.last_s <= TOGETHER_S && belongs(moment, group));
        if let Some(group) = same {
            group.last_s = moment.at_s;
            if !group.relays.contains(&moment.relay) {
                group.relays.push(moment.relay);
            }
        } else {
            groups.push(Group {
                first_s: moment.at_s,
                last_s: moment.at_s,
                relays: vec![moment.relay],
                sample: moment.clone(),
            });
        }
    }
    groups.sort_by(|one, other| one.at_s().total_cmp(&other.at_s()));
    groups
}

fn belongs(moment: &MomentReport, group: &Group) -> bool {
    let one = &group.sample;
    if one.what != moment.what {
        return false;
    }
    match one.what {
        "lost" | "told to leave" | "not received by" | "mission mismatch" | "key mismatch"
        | "epoch went back" | "duplicate index" | "sensor off" => one.other == moment.other,
        // Both neighbours log that they found each other.
        "found" => {
            one.other == Some(moment.relay) && moment.other == Some(one.relay)
                || (one.relay, one.other) == (moment.relay, moment.other)
        }
        "view accepted" => one.view == moment.view,
        // Targets are compared bit by bit.
        "converged" => one.sir.map(f64::to_bits) == moment.sir.map(f64::to_bits),
        "silent" | "switched on" => one.at_s.to_bits() == moment.at_s.to_bits(),
        "stored" | "adopted" => one.version == moment.version,
        "no quorum" | "lease expired" | "engaged" | "released" => true,
        "new estimate" => !group.relays.contains(&moment.relay),
        _ => false,
    }
}

impl Group {
    fn at_s(&self) -> f64 {
        match self.sample.what {
            "view accepted" | "converged" | "stored" | "adopted" => self.last_s,
            _ => self.first_s,
        }
    }

    /// Describes the event in a few words, for a picture.
    fn words(&self) -> String {
        let who = named(&self.relays);
        let one = &self.sample;
        let (relay, other) = (one.relay, one.other.unwrap_or_default());
        match one.what {
            "silent" => format!("{who} silent"),
            "switched on" => format!("{who} rebooted"),
            "lost" => format!("relay {other} lost"),
            "found" => format!("relays {relay} and {other} linked"),
            "view accepted" => format!(
                "chain of {}",
                counted(one.relays.unwrap_or_default().into())
            ),
            "converged" => one.sir.map_or_else(
                || "relays spread evenly".to_owned(),
                |sir| format!("SIR {sir:.3}"),
            ),
            "may leave" => format!("{who} has permission to leave"),
            "told to leave" => format!("relay {other} has permission to leave"),
            "partition" => format!("partition after relay {relay}"),
            "partition ended" => format!("end of the partition after relay {relay}"),
            "does not receive" => format!("relay {relay} does not receive relay {other}"),
            "receives again" => format!("relay {relay} receives relay {other} again"),
            "not received by" => format!("relay {other} does not receive {}", list(&self.relays)),
            "mission mismatch" => format!("relay {other} has another mission"),
            "key mismatch" => format!("relay {other} has another key"),
            "epoch went back" => format!("relay {other} has an old epoch"),
            "duplicate index" => format!("duplicate relay number {other}"),
            "engaged" | "released" if self.relays.len() > 1 => {
                format!("{} {}", counted(self.relays.len()), one.what)
            }
            "engaged" | "released" => format!("{who} {}", one.what),
            "blind" => format!("{who}: no position"),
            "restarted" => format!("{who}: autopilot restarted"),
            "offered" | "stored" | "adopted" => {
                format!("mission {} {}", one.version.unwrap_or_default(), one.what)
            }
            other => other.to_owned(),
        }
    }

    /// Describes the event as a line of the log.
    fn line(&self) -> String {
        let many = self.relays.len() > 1;
        let who = named(&self.relays);
        let one = &self.sample;
        let other = one.other.unwrap_or_default();
        let relay = one.relay;
        let version = one.version.unwrap_or_default();
        match one.what {
            "silent" => format!("{who} went silent"),
            "switched on" => format!("{who} rebooted"),
            "lost" => format!("{who}: relay {other} lost (no reply)"),
            "found" if many => format!("{who} became neighbours"),
            "found" => format!("{who} became a neighbour of relay {other}"),
            "view accepted" => format!(
                "membership agreed: {} (view {})",
                counted(one.relays.unwrap_or_default().into()),
                one.view.unwrap_or_default()
            ),
            "lease expired" => format!("{who}: last agreement on positions expired, setpoint kept"),
            "not received by" => format!("relay {other} does not receive {who}"),
            "mission mismatch" => format!("{who}: relay {other} has another mission"),
            "key mismatch" => format!("{who}: relay {other} signs with another key"),
            "epoch went back" => {
                format!(
                    "{who}: relay {other} started with an old epoch (start counter), so its frames are rejected"
                )
            }
            "duplicate index" => format!("{who}: another node also has the number {other}"),
            "engaged" => format!("{who}: setpoint control engaged"),
            "released" => format!("{who} released: the pilot took control"),
            "blind" => format!("{who}: the autopilot reports no position"),
            "restarted" => format!("{who}: autopilot restarted"),
            "may leave" => {
                format!(
                    "{who}: the chain works without this relay now, its drone has permission to leave"
                )
            }
            "told to leave" => {
                format!("{who}: relay {other} is outside of the chain, and has permission to leave")
            }
            "has to leave" => {
                format!("{who}: the battery lasts only for the way home, and the drone must leave")
            }
            "no quorum" => {
                format!("{who}: too few relays receive each other (no quorum), position held")
            }
            "new estimate" => format!("{who}: new interference estimate"),
            "interferer unclear" => {
                format!("{who}: the measurements do not fit a single interferer")
            }
            "sensor off" => {
                format!(
                    "{who}: the measurements of relay {other} do not fit those of the other nodes"
                )
            }
            "converged" if one.sir.is_none() => {
                format!(
                    "{} spread evenly to measure the interference",
                    counted(self.relays.len())
                )
            }
            "converged" => format!(
                "positions agreed: {}, SIR {:.3}",
                counted(self.relays.len()),
                one.sir.unwrap_or_default()
            ),
            "partition" => {
                format!("partition: relays 1 to {relay} and the others do not receive each other")
            }
            "partition ended" => format!(
                "partition ended: relays 1 to {relay} and the others receive each other again"
            ),
            "does not receive" => format!("{who} does not receive relay {other}"),
            "receives again" => format!("{who} receives relay {other} again"),
            "offered" if relay == 0 => {
                format!("the ground station at Tx uploads mission version {version}")
            }
            "offered" => format!("the ground station at Rx uploads mission version {version}"),
            "stored" => format!("{who} stored mission version {version}"),
            "adopted" => format!("mission version {version} adopted by {who}"),
            _ => "no positions meet any target SIR, so the relays keep their positions".to_owned(),
        }
    }
}

/// Formats a count: "1 relay", "8 relays".
pub fn counted(relays: usize) -> String {
    format!("{relays} {}", if relays == 1 { "relay" } else { "relays" })
}

/// Formats a number of sweeps: "1 sweep", "3 sweeps".
pub(super) fn sweeps_text(sweeps: u32) -> String {
    format!("{sweeps} {}", if sweeps == 1 { "sweep" } else { "sweeps" })
}

/// Number of lines at the start, and also at the end, that a shortened log keeps.
const ENDS: usize = 20;

/// Formats the log with a line for each event. If the log has more than 40 lines, the middle lines are left out.
pub(super) fn text(timeline: &[MomentReport]) -> String {
    let groups = groups(timeline);
    let mut text = String::new();
    for (number, group) in groups.iter().enumerate() {
        if number >= ENDS && groups.len() > 2 * ENDS && number + ENDS < groups.len() {
            if number == ENDS {
                _ = writeln!(
                    text,
                    "{:>12}  {} more lines",
                    "...",
                    groups.len() - 2 * ENDS
                );
            }
            continue;
        }
        _ = writeln!(text, "{:>10.3} s  {}", group.at_s(), group.line());
    }
    text
}

/// Returns the time, s, and a short description of each event in the log, for a picture.
pub fn words(timeline: &[MomentReport]) -> Vec<(f64, String)> {
    groups(timeline)
        .iter()
        .filter(|group| !matches!(group.sample.what, "found" | "stored"))
        .map(|group| (group.at_s(), group.words()))
        .collect()
}

/// New view (membership of the chain) and the times of its formation. Times are s since the start.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RecoveryReport {
    /// Number of the view (membership of the chain).
    pub view: u32,
    /// Number of relays in the view (membership of the chain).
    pub relays: u16,
    /// Numbers (from 1) of relays that were in the previous view, and are not in this one. A view is an agreed set of
    /// the chain's members.
    pub lost: Vec<u16>,
    /// Numbers (from 1) of relays that are in this view, and were not in the previous one. A view is an agreed set of
    /// the chain's members.
    pub back: Vec<u16>,
    /// Version of the uploaded mission that the chain begins to fly with this view. Absent if the view brings no newly
    /// uploaded mission.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Time when the upload of the mission `version` began, s; absent without an upload.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offered_s: Option<f64>,
    /// Time of the event that caused the new view, s: a failure, reboot, partition or end of a partition.
    ///
    /// If there are several such events, it is the time of the first event that explains the loss or return of a relay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub happened_s: Option<f64>,
    /// Time when a relay first detected that a neighbour was lost or had returned, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detected_s: Option<f64>,
    /// Time when the last relay of the view (membership of the chain) accepted it, s.
    pub formed_s: f64,
    /// Time when all relays of the view had new positions, s. Absent if the next view was formed before that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged_s: Option<f64>,
    /// Number of passes and view proposals up to the agreement on positions (`converged_s`). Counted from the detection
    /// (`detected_s`), or without it from the upload (`offered_s`).
    ///
    /// A pass is a message that relays forward along the whole chain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweeps: Option<u32>,
}

/// View (membership of the chain) that all its relays have accepted, as found in the log.
struct View {
    number: u32,
    members: BTreeSet<u16>,
    /// Indices of two log entries: the first and the last one in which a relay accepts the view.
    span: (usize, usize),
}

/// Finds all complete views (memberships of the chain) in the log of a run of `relays` relays.
pub(super) fn recoveries(moments: &[Moment], relays: u16) -> Vec<RecoveryReport> {
    let views = views(moments);
    let mut before: BTreeSet<u16> = (1..=relays).collect();
    let (mut from, mut flown) = (0, 0);
    let mut reports = Vec::new();
    for (place, view) in views.iter().enumerate() {
        let until = views
            .get(place + 1)
            .map_or(moments.len(), |next| next.span.0);
        let lost: Vec<u16> = before.difference(&view.members).copied().collect();
        let back: Vec<u16> = view.members.difference(&before).copied().collect();
        let (first, last) = view.span;
        let earlier = moments.get(from..first).unwrap_or_default();
        let later = moments.get(last..until).unwrap_or_default();
        let detected = detection(earlier, &lost, &back);
        let version = adopted(moments, view).filter(|version| *version > flown);
        let offered = version.and_then(|version| offered(moments, version));
        let begun = detected.or(offered);
        let converged = convergence(later, &view.members);
        reports.push(RecoveryReport {
            view: view.number,
            relays: u16::try_from(view.members.len()).unwrap_or(u16::MAX),
            version,
            offered_s: offered.map(|moment| seconds(moment.at)),
            happened_s: fault_time(moments.get(..first).unwrap_or_default(), &lost, &back)
                .map(seconds),
            detected_s: detected.map(|moment| seconds(moment.at)),
            formed_s: moments.get(last).map_or(0.0, |moment| seconds(moment.at)),
            converged_s: converged.map(|moment| seconds(moment.at)),
            sweeps: begun
                .zip(converged)
                .map(|(one, other)| sweeps(moments, &view.members, (one.at, other.at))),
            lost,
            back,
        });
        before.clone_from(&view.members);
        from = first;
        flown = version.unwrap_or(flown);
    }
    reports
}

fn views(moments: &[Moment]) -> Vec<View> {
    let mut views: BTreeMap<u32, (u16, View)> = BTreeMap::new();
    for (place, moment) in moments.iter().enumerate() {
        if let TimelineEvent::ViewAccepted { view, relays, .. } = moment.what {
            let (_, known) = views.entry(view).or_insert_with(|| {
                let view = View {
                    number: view,
                    members: BTreeSet::new(),
                    span: (place, place),
                };
                (relays, view)
            });
            known.members.insert(moment.relay);
            known.span.1 = place;
        }
    }
    let whole = views
        .into_values()
        .filter(|(relays, view)| view.members.len() == usize::from(*relays));
    whole.map(|(_, view)| view).collect()
}

/// Returns the version of the newest mission that relays of `view` had adopted when they accepted it.
fn adopted(moments: &[Moment], view: &View) -> Option<u16> {
    // A relay logs the adoption right after the view.
    let story = moments.get(..=view.span.1 + 1).unwrap_or(moments);
    let versions = story.iter().filter_map(|moment| match moment.what {
        TimelineEvent::Adopted(version) if view.members.contains(&moment.relay) => Some(version),
        _ => None,
    });
    versions.max()
}

fn offered(moments: &[Moment], version: u16) -> Option<&Moment> {
    moments
        .iter()
        .find(|moment| moment.what == TimelineEvent::Offered(version))
}

/// Returns the time of the event that caused the loss of the relays `lost` and the return of `back`.
///
/// For each of these relays, the cause is the latest event in `earlier` that explains its loss or return, such as a
/// failure or the end of a partition. The earliest cause is returned.
fn fault_time(earlier: &[Moment], lost: &[u16], back: &[u16]) -> Option<Instant> {
    let of = |relays: &[u16], own: TimelineEvent, common: TimelineEvent| {
        let latest = |relay: &u16| {
            let mut story = earlier.iter().rev();
            story
                .find(|moment| {
                    moment.what == own && moment.relay == *relay || moment.what == common
                })
                .map(|moment| moment.at)
        };
        relays.iter().filter_map(latest).min()
    };
    let gone = of(lost, TimelineEvent::Silent, TimelineEvent::Partitioned);
    let come = of(back, TimelineEvent::Booted, TimelineEvent::PartitionEnded);
    gone.into_iter().chain(come).min()
}

/// Returns the first log entry in which a relay detects the loss or return of one of the given relays.
///
/// `lost` and `back` are the numbers of the lost and the returned relays.
fn detection<'a>(earlier: &'a [Moment], lost: &[u16], back: &[u16]) -> Option<&'a Moment> {
    earlier.iter().find(|moment| match moment.what {
        TimelineEvent::Lost(_) => moment.other.is_some_and(|other| lost.contains(&other)),
        TimelineEvent::Found(_) => {
            back.contains(&moment.relay) || moment.other.is_some_and(|other| back.contains(&other))
        }
        _ => false,
    })
}

/// Returns the last entry of `later` in which one of `members` accepts a position. `later` is the part of the log after
/// the view was accepted.
///
/// `None` unless every member accepts a position.
fn convergence<'a>(later: &'a [Moment], members: &BTreeSet<u16>) -> Option<&'a Moment> {
    let placed = |moment: &&Moment| {
        moment.what == TimelineEvent::Converged && members.contains(&moment.relay)
    };
    let who: BTreeSet<u16> = later
        .iter()
        .filter(placed)
        .map(|moment| moment.relay)
        .collect();
    let all = who.len() == members.len();
    later.iter().rfind(placed).filter(|_| all)
}

/// Returns the number of passes and view proposals that `members` began during `span`.
///
/// A pass is a message that relays forward along the whole chain.
fn sweeps(moments: &[Moment], members: &BTreeSet<u16>, span: (Instant, Instant)) -> u32 {
    let begun = |relay: u16, by: Instant| {
        let mut story = moments.iter().rev();
        story
            .find(|moment| moment.relay == relay && moment.at <= by)
            .map_or(0, |moment| moment.sweeps)
    };
    members
        .iter()
        .map(|relay| begun(*relay, span.1).saturating_sub(begun(*relay, span.0)))
        .sum()
}

/// Formats a line for each view with lost or returned relays, or with a newly uploaded mission. For all remaining views
/// together it adds one line with their number.
pub(super) fn recovery_text(recoveries: &[RecoveryReport]) -> String {
    let mut text = String::new();
    let mut same = 0;
    for one in recoveries {
        let mut what: Vec<String> = [(&one.lost, "lost"), (&one.back, "back")]
            .into_iter()
            .filter(|(relays, _)| !relays.is_empty())
            .map(|(relays, how)| {
                let many = if relays.len() > 1 { "relays" } else { "relay" };
                format!("{many} {} {how}", list(relays))
            })
            .collect();
        what.extend(
            one.version
                .map(|version| format!("mission version {version} uploaded")),
        );
        if what.is_empty() {
            same += 1;
            continue;
        }
        _ = writeln!(
            text,
            "{} (view {}): {}",
            what.join(", "),
            one.view,
            one.times()
        );
    }
    if same > 0 {
        _ = writeln!(
            text,
            "memberships agreed again with the same members: {same}"
        );
    }
    text
}

impl RecoveryReport {
    fn times(&self) -> String {
        let mut text = String::new();
        if let (Some(happened), Some(detected)) = (self.happened_s, self.detected_s) {
            _ = write!(text, "noticed after {:.3} s, ", detected - happened);
        }
        if let Some(detected) = self.detected_s {
            let since = match self.happened_s {
                Some(_) => "later",
                None => "after a relay noticed",
            };
            let after = self.formed_s - detected;
            _ = write!(text, "membership agreed {after:.3} s {since}, ");
        }
        if let Some(offered) = self.offered_s {
            let after = self.formed_s - offered;
            _ = write!(text, "adopted {after:.3} s after the upload began, ");
        }
        let Some(converged) = self.converged_s else {
            return text + "the membership changed before the relays agreed on positions";
        };
        _ = write!(
            text,
            "positions agreed {:.3} s later",
            converged - self.formed_s
        );
        if let Some(sweeps) = self.sweeps {
            _ = write!(text, "; {}", sweeps_text(sweeps));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::{Moment, TimelineEvent, line};
    use uav_relay::Instant;

    /// Checks that log lines about a relay's departure from the chain name the relay that may leave.
    #[test]
    fn lines_of_a_departure_name_the_relay_that_leaves() {
        let of = |relay, what, other| {
            line(&Moment {
                at: Instant::from_millis(60_000),
                relay,
                what,
                other,
                target: None,
                sweeps: 0,
            })
        };
        assert_eq!(
            of(3, TimelineEvent::MayLeave, None),
            "relay 3: the chain works without this relay now, its drone has permission to leave"
        );
        assert_eq!(
            of(4, TimelineEvent::MayLeaveTold, Some(3)),
            "relay 4: relay 3 is outside of the chain, and has permission to leave"
        );
        assert_eq!(
            of(3, TimelineEvent::MustLeave, None),
            "relay 3: the battery lasts only for the way home, and the drone must leave"
        );
    }
}
