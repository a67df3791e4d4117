//! Log of a run, as JSON entries and as grouped lines of text.

use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::Instant;

use crate::simulator::outcome::{Moment, TimelineEvent};

/// Converts to seconds of virtual time since the start.
pub(super) fn seconds(at: Instant) -> f64 {
    at.as_micros() as f64 / 1e6
}

/// Log entry of a run.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MomentReport {
    /// Time of the entry, s of virtual time.
    pub at_s: f64,
    /// Relay number from 1; Tx and Rx count as 0 and N + 1; for a partition, the last relay before it.
    pub relay: u16,
    /// Kind of the entry.
    ///
    /// `silent`, `switched on`, `lost`, `found`, `view accepted`, `no quorum`, `converged`, `infeasible`, `partition`, `partition ended`, `does not receive`, `receives again`,
    /// `offered`, `stored`, `adopted`, `lease expired`, `not received by`, `mission mismatch`, `key mismatch`, `epoch went back`, `duplicate index`; of autopilots
    /// `engaged`, `released`, `blind`, `restarted`; of relays that measure `new estimate`, `interferer unclear`, `sensor off`.
    pub what: &'static str,
    /// Other node of the entry, for example a lost or found neighbour.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other: Option<u16>,
    /// Number of the new view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<u32>,
    /// Number of relays in the new view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relays: Option<u16>,
    /// Version of the mission that was offered, stored or adopted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Target SIR agreed on, linear.
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

/// Returns all log entries; none if the run has only convergence.
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

/// Log entries of several relays that form one line.
#[derive(Clone, PartialEq, Debug)]
struct Group {
    first_s: f64,
    last_s: f64,
    /// Relays in order of their entries; a pair of neighbours that found each other, in order from Tx.
    relays: Vec<u16>,
    sample: MomentReport,
}

/// Longest time between entries of one group, s: neighbours may detect a failure at different times.
const TOGETHER_S: f64 = 10.0;

/// Groups the log entries. Sorted by a group's last time if all relays have to agree, else by its first.
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
        "lost" | "not received by" | "mission mismatch" | "key mismatch" | "epoch went back"
        | "duplicate index" | "sensor off" => one.other == moment.other,
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

    /// Describes the group in a few words, for a picture.
    fn words(&self) -> String {
        let who = list(&self.relays);
        let one = &self.sample;
        match one.what {
            "silent" => format!("{who} silent"),
            "switched on" => format!("{who} on again"),
            "lost" => format!("{} lost", one.other.unwrap_or_default()),
            "found" => format!("{} and {} linked", one.relay, one.other.unwrap_or_default()),
            "view accepted" => format!("view: {} relays", one.relays.unwrap_or_default()),
            "converged" => one
                .sir
                .map_or_else(|| "spread".to_owned(), |sir| format!("SIR {sir:.3}")),
            "partition" => format!("partition after {}", one.relay),
            "partition ended" => format!("partition after {} ended", one.relay),
            "does not receive" => format!(
                "{} does not receive {}",
                one.relay,
                one.other.unwrap_or_default()
            ),
            "receives again" => format!(
                "{} receives {} again",
                one.relay,
                one.other.unwrap_or_default()
            ),
            "not received by" => {
                format!("{} does not receive {who}", one.other.unwrap_or_default())
            }
            "mission mismatch" => format!("{}: another mission", one.other.unwrap_or_default()),
            "key mismatch" => format!("{}: another key", one.other.unwrap_or_default()),
            "epoch went back" => format!("{}: old epoch", one.other.unwrap_or_default()),
            "duplicate index" => format!("duplicate number {}", one.other.unwrap_or_default()),
            "engaged" | "released" if self.relays.len() > 1 => {
                format!("{} {}", self.relays.len(), one.what)
            }
            "engaged" | "released" | "blind" => format!("{who} {}", one.what),
            "restarted" => format!("{who}: autopilot restarted"),
            "offered" | "stored" | "adopted" => {
                format!("mission {} {}", one.version.unwrap_or_default(), one.what)
            }
            other => other.to_owned(),
        }
    }

    /// Describes the group as a line of text.
    fn line(&self) -> String {
        let many = self.relays.len() > 1;
        let who = format!(
            "{} {}",
            if many { "relays" } else { "relay" },
            list(&self.relays)
        );
        let one = &self.sample;
        let other = one.other.unwrap_or_default();
        let relay = one.relay;
        let version = one.version.unwrap_or_default();
        match one.what {
            "silent" => format!("{who} went silent"),
            "switched on" => format!("{who} switched on again"),
            "lost" => format!("{who} lost relay {other}"),
            "found" if many => format!("{who} became neighbours"),
            "found" => format!("{who} became a neighbour of relay {other}"),
            "view accepted" => format!(
                "view accepted: {}, view {}",
                count(one.relays.unwrap_or_default().into()),
                one.view.unwrap_or_default()
            ),
            "lease expired" => format!("{who}: lease expired"),
            "not received by" => format!("relay {other} does not receive {who}"),
            "mission mismatch" => format!("{who}: relay {other} flies another mission"),
            "key mismatch" => format!("{who}: relay {other} signs with another key"),
            "epoch went back" => format!("{who}: the epoch of relay {other} went back"),
            "duplicate index" => format!("{who}: duplicate relay number {other}"),
            "engaged" if many => format!("{who}: setpoint control engaged"),
            "engaged" => format!("{who}: setpoint control engaged"),
            "released" => format!("{who} released: the pilot took control"),
            "blind" => format!("{who}: no position of its drone"),
            "restarted" => format!("{who}: autopilot restarted"),
            "no quorum" => format!("{who}: no quorum, holding position"),
            "new estimate" => format!("{who}: new interference estimate"),
            "interferer unclear" => format!("{who}: the measurements do not fit one interferer"),
            "sensor off" => {
                format!("{who}: the measurements of relay {other} do not fit those of the others")
            }
            "converged" if one.sir.is_none() => {
                format!(
                    "spread evenly to measure the interference: {}",
                    count(self.relays.len())
                )
            }
            "converged" => format!(
                "converged: {}, SIR {:.3}",
                count(self.relays.len()),
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
            "offered" if relay == 0 => format!("the transmitter uploads mission {version}"),
            "offered" => format!("the receiver uploads mission {version}"),
            "stored" => format!("{who} stored mission {version}"),
            "adopted" => format!("mission {version} adopted: {}", count(self.relays.len())),
            _ => "no target SIR can be met".to_owned(),
        }
    }
}

/// Formats relay numbers: "3", "3 and 5", "1, 2 and 5", "1 to 3 and 5 to 9".
pub(super) fn list(relays: &[u16]) -> String {
    let mut sorted = relays.to_vec();
    sorted.sort_unstable();
    let mut parts: Vec<String> = Vec::new();
    for run in sorted.chunk_by(|one, next| one + 1 == *next) {
        match run {
            [first, _, .., last] => parts.push(format!("{first} to {last}")),
            few => parts.extend(few.iter().map(u16::to_string)),
        }
    }
    match parts.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

/// Formats a count: "1 relay", "8 relays".
fn count(relays: usize) -> String {
    format!("{relays} {}", if relays == 1 { "relay" } else { "relays" })
}

/// Number of lines at the start and at the end of a shortened log.
const ENDS: usize = 20;

/// Formats the log, one line per group, without the middle of a very long log.
pub(super) fn text(timeline: &[MomentReport]) -> String {
    let groups = groups(timeline);
    let mut text = String::new();
    for (number, group) in groups.iter().enumerate() {
        if number >= ENDS && groups.len() > 2 * ENDS && number + ENDS < groups.len() {
            if number == ENDS {
                _ = writeln!(text, "{:>12}  {} more", "...", groups.len() - 2 * ENDS);
            }
            continue;
        }
        _ = writeln!(text, "{:>10.3} s  {}", group.at_s(), group.line());
    }
    text
}

/// Returns the groups' times, s, and short descriptions, for a picture.
pub fn words(timeline: &[MomentReport]) -> Vec<(f64, String)> {
    groups(timeline)
        .iter()
        .filter(|group| !matches!(group.sample.what, "found" | "stored"))
        .map(|group| (group.at_s(), group.words()))
        .collect()
}
