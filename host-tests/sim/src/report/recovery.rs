//! Recovery times: new views after the loss or return of relays, or after a mission upload.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use serde::Serialize;
use uav_relay::Instant;

use super::timeline::{list, seconds};
use crate::simulator::outcome::{Moment, TimelineEvent};

/// New view of the chain. All times are virtual time since the start, s.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RecoveryReport {
    /// Number of the view.
    pub view: u32,
    /// Number of relays in the view.
    pub relays: u16,
    /// Relays of the previous view that left.
    pub lost: Vec<u16>,
    /// Relays that joined or returned.
    pub back: Vec<u16>,
    /// Version of an uploaded mission that is first flown in this view.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Start of that upload.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offered_s: Option<f64>,
    /// Time of the cause: the first failure, reboot, partition or reunion of those relays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub happened_s: Option<f64>,
    /// Time of its first detection by a neighbour.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub detected_s: Option<f64>,
    /// Time when all its relays had accepted the view.
    pub formed_s: f64,
    /// Time when all its relays held their new positions; absent if another view came first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub converged_s: Option<f64>,
    /// Sweeps from the detection, or the start of the upload, to convergence, including view requests.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sweeps: Option<u32>,
}

/// View that all its relays have accepted.
struct View {
    number: u32,
    members: BTreeSet<u16>,
    /// Log indices of its first and last acceptance.
    span: (usize, usize),
}

/// Reports the new views of a run of `relays` relays, in order.
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
        let detected = detected(earlier, &lost, &back);
        let version = adopted(moments, view).filter(|version| *version > flown);
        let offered = version.and_then(|version| offered(moments, version));
        let begun = detected.or(offered);
        let converged = converged(later, &view.members);
        reports.push(RecoveryReport {
            view: view.number,
            relays: u16::try_from(view.members.len()).unwrap_or(u16::MAX),
            version,
            offered_s: offered.map(|moment| seconds(moment.at)),
            happened_s: happened(moments.get(..first).unwrap_or_default(), &lost, &back)
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

/// Returns the newest uploaded mission that a relay of `view` adopted with it.
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

/// Returns the time of the event that removed relays from the view, or brought them back.
fn happened(earlier: &[Moment], lost: &[u16], back: &[u16]) -> Option<Instant> {
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

/// Returns the first detection of a lost or returned relay.
fn detected<'a>(earlier: &'a [Moment], lost: &[u16], back: &[u16]) -> Option<&'a Moment> {
    earlier.iter().find(|moment| match moment.what {
        TimelineEvent::Lost(_) => moment.other.is_some_and(|other| lost.contains(&other)),
        TimelineEvent::Found(_) => {
            back.contains(&moment.relay) || moment.other.is_some_and(|other| back.contains(&other))
        }
        _ => false,
    })
}

/// Returns the last convergence among `members`, if all have converged.
fn converged<'a>(later: &'a [Moment], members: &BTreeSet<u16>) -> Option<&'a Moment> {
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

/// Returns the sweeps that `members` began in `span`, as far as the log tells.
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

/// Formats a line per view with lost or returned relays or a new mission; other views are only counted.
pub(super) fn text(recoveries: &[RecoveryReport]) -> String {
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
                .map(|version| format!("mission {version} uploaded")),
        );
        if what.is_empty() {
            same += 1;
            continue;
        }
        _ = writeln!(
            text,
            "view {}, {}: {}",
            one.view,
            what.join(", "),
            one.times()
        );
    }
    if same > 0 {
        let times = if same == 1 {
            "once"
        } else {
            &format!("{same} times")
        };
        _ = writeln!(text, "accepted {times} with the same relays");
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
            _ = write!(
                text,
                "view accepted {:.3} s later, ",
                self.formed_s - detected
            );
        }
        if let Some(offered) = self.offered_s {
            let after = self.formed_s - offered;
            _ = if self.detected_s.is_some() {
                write!(text, "adopted {after:.3} s after the upload began, ")
            } else {
                write!(text, "adopted after {after:.3} s, ")
            };
        }
        let Some(converged) = self.converged_s else {
            return text + "another view came before it converged";
        };
        _ = write!(
            text,
            "converged {:.3} s after that",
            converged - self.formed_s
        );
        if let Some(sweeps) = self.sweeps {
            _ = write!(text, "; {sweeps} sweeps");
        }
        text
    }
}
