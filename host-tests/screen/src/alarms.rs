//! Alarms of a chain. Each has a reason, a relay that it is about, and the relays that have reported it.
//!
//! A program that receives events begins and ends alarms by [`Alarms::begin`] and [`Alarms::end`]. A program that knows which alarms
//! last passes all of them to [`Alarms::settle`].

use std::collections::BTreeSet;

use crate::snapshot::{Alarm, Urgency};

/// Number of stored alarms above which ended alarms are dropped.
///
/// The least urgent ended alarm is dropped first; if several are equally urgent, the oldest. Alarms that have not ended
/// are never dropped.
pub const MOST: usize = 200;

/// Reason of an alarm.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[expect(missing_docs, reason = "the texts of the alarms describe them")]
pub enum Reason {
    Lost,
    NoQuorum,
    Blind,
    LinkLost,
    Duplicate,
    Key,
    Epoch,
    Infeasible,
    ChainSilent,
    Released,
    LeaseExpired,
    NotReceived,
    Mission,
    Version,
    Stuck,
    TooFew,
    Restarted,
    Measurements,
    NoReport,
    Rejected,
}

impl Reason {
    const fn urgency(self) -> Urgency {
        match self {
            Self::Lost
            | Self::NoQuorum
            | Self::Blind
            | Self::LinkLost
            | Self::Duplicate
            | Self::Key
            | Self::Epoch
            | Self::Infeasible
            | Self::ChainSilent => Urgency::Critical,
            Self::Released
            | Self::LeaseExpired
            | Self::NotReceived
            | Self::Mission
            | Self::Version
            | Self::Stuck
            | Self::TooFew => Urgency::Warning,
            Self::Restarted | Self::Measurements | Self::NoReport | Self::Rejected => {
                Urgency::Notice
            }
        }
    }

    /// Returns the text of an alarm about relay `subject`, reported by the relays `reporters`.
    ///
    /// If `subject` is 0, the alarm is about the reporters or the ground station.
    fn text(self, subject: u16, reporters: &[u16]) -> String {
        let by = named(reporters);
        match self {
            // No relay has reported it: the station itself has noticed that the relay's reports stopped.
            Self::Lost if reporters.is_empty() => format!("relay {subject}"),
            Self::Lost => format!("relay {subject} lost: reported by {by}"),
            Self::NoQuorum => format!("no quorum: {by} cannot reach enough relays, position held"),
            Self::Blind => format!("{by}: the autopilot reports no position"),
            Self::LinkLost => format!("{by}: the link to the autopilot is lost"),
            Self::Duplicate => format!("two nodes have the number {subject}: reported by {by}"),
            Self::Key => format!("relay {subject} signs with another key: reported by {by}"),
            Self::Epoch => {
                format!(
                    "relay {subject} started with an old epoch (start counter): its frames are rejected by {by}"
                )
            }
            Self::Infeasible => format!("{by}: no positions meet any target SIR, positions kept"),
            Self::ChainSilent => "nothing received from the chain".to_owned(),
            Self::Released => {
                format!("{by} released: under the pilot's or the autopilot's control")
            }
            Self::LeaseExpired => {
                format!("{by}: last agreement on positions expired, setpoint kept")
            }
            Self::NotReceived => format!("relay {subject} does not receive {by}"),
            Self::Mission => format!("relay {subject} has another mission: reported by {by}"),
            Self::Version => format!("{by} flies another version of the mission"),
            Self::Stuck => {
                format!(
                    "{by} does not fly to its setpoint: its autopilot's fence or limits may forbid it"
                )
            }
            Self::TooFew => "too few relays in the chain".to_owned(),
            Self::Restarted => format!("{by}: the autopilot was restarted"),
            Self::Measurements => {
                format!("{by}: the measured interference does not fit one interferer")
            }
            Self::NoReport => format!("no report yet from {by}"),
            Self::Rejected => "frames rejected by this station".to_owned(),
        }
    }
}

/// Alarm that has not ended: its reason, its subject, its reporters and a note.
///
/// The subject is the number of the relay that the alarm is about; 0 if it is about its reporters or the station. The
/// reporters are the numbers of the relays that have reported the reason, sorted. The note is added to the text.
pub type Lasting = (Reason, u16, Vec<u16>, String);

#[derive(Debug)]
struct Entry {
    alarm: Alarm,
    reason: Reason,
    subject: u16,
    reporters: Vec<u16>,
    /// Present and earlier reporters.
    ever: BTreeSet<u16>,
    note: String,
}

impl Entry {
    /// Ends the alarm. Its text then names all relays that have reported it.
    fn end(&mut self, time_s: f64) {
        self.alarm.cleared_s = Some(time_s);
        if !self.reporters.is_empty() {
            let all: Vec<u16> = self.ever.iter().copied().collect();
            self.alarm.text = self.reason.text(self.subject, &all) + &self.note;
        }
    }

    const fn lasts(&self) -> bool {
        self.alarm.cleared_s.is_none()
    }
}

/// Alarms of a flight, in the order of their numbers.
#[derive(Debug, Default)]
pub struct Alarms {
    entries: Vec<Entry>,
    raised: u32,
}

impl Alarms {
    /// Begins an alarm, or adds `by` to its reporters if the same alarm lasts already.
    ///
    /// `subject` is the relay that the alarm is about; 0 if the alarm is about its reporters.
    pub fn begin(&mut self, time_s: f64, reason: Reason, subject: u16, by: u16) {
        let known = self
            .lasting()
            .find(|it| (it.reason, it.subject) == (reason, subject));
        let mut reporters = known.map_or_else(Vec::new, |it| it.reporters.clone());
        if let Err(at) = reporters.binary_search(&by) {
            reporters.insert(at, by);
        }
        self.put(time_s, (reason, subject, reporters, String::new()));
    }

    /// Begins an alarm, or updates it if an alarm of the same reason and subject lasts already.
    fn put(&mut self, time_s: f64, (reason, subject, reporters, note): Lasting) {
        let text = reason.text(subject, &reporters) + &note;
        let mut entries = self.entries.iter_mut();
        let same = |it: &&mut Entry| it.lasts() && (it.reason, it.subject) == (reason, subject);
        if let Some(known) = entries.find(same) {
            known.ever.extend(&reporters);
            (known.reporters, known.note) = (reporters, note);
            known.alarm.text = text;
            return;
        }
        self.raised += 1;
        self.entries.push(Entry {
            alarm: Alarm {
                number: self.raised,
                time_s,
                urgency: reason.urgency(),
                text,
                cleared_s: None,
                lost: (reason == Reason::Lost).then_some(subject),
            },
            reason,
            subject,
            ever: reporters.iter().copied().collect(),
            reporters,
            note,
        });
        if self.entries.len() > MOST {
            let all = self.entries.iter().enumerate();
            let ended = all.filter(|(_, it)| !it.lasts());
            if let Some((at, _)) = ended.min_by_key(|(_, it)| it.alarm.urgency) {
                self.entries.remove(at);
            }
        }
    }

    /// Ends the alarms for `reason` about relay `subject`.
    ///
    /// If `subject` is `None`, removes relay `by` from the reporters of all alarms for `reason`. Such an alarm ends
    /// when it has no reporters left.
    pub fn end(&mut self, time_s: f64, reason: Reason, subject: Option<u16>, by: u16) {
        let lasting = self.entries.iter_mut().filter(|it| it.lasts());
        for entry in lasting.filter(|it| it.reason == reason) {
            let is_over = match subject {
                Some(subject) if subject == entry.subject => true,
                Some(_) => continue,
                None => entry.reporters.iter().all(|it| *it == by),
            };
            if is_over {
                entry.end(time_s);
            } else {
                entry.reporters.retain(|it| *it != by);
                entry.alarm.text = reason.text(entry.subject, &entry.reporters);
            }
        }
    }

    /// Begins or updates the alarms in `lasting`, and ends all other alarms.
    pub fn settle(&mut self, time_s: f64, lasting: Vec<Lasting>) {
        for entry in self.entries.iter_mut().filter(|it| it.lasts()) {
            let same = |it: &Lasting| (it.0, it.1) == (entry.reason, entry.subject);
            if !lasting.iter().any(same) {
                entry.end(time_s);
            }
        }
        for alarm in lasting {
            self.put(time_s, alarm);
        }
    }

    /// Returns the numbers of the relays that relay `by` still reports as lost.
    pub fn lost_for(&self, by: u16) -> Vec<u16> {
        let lost = self.lost().filter(|it| it.reporters.contains(&by));
        lost.map(|it| it.subject).collect()
    }

    /// Returns true if relay `number` is reported as lost by another relay.
    pub fn is_lost(&self, number: u16) -> bool {
        self.lost()
            .any(|it| it.subject == number && !it.reporters.is_empty())
    }

    /// Returns true while an alarm of a reason about relay `subject` lasts.
    pub fn lasts(&self, reason: Reason, subject: u16) -> bool {
        let mut lasting = self.lasting();
        lasting.any(|it| (it.reason, it.subject) == (reason, subject))
    }

    fn lost(&self) -> impl Iterator<Item = &Entry> {
        self.lasting().filter(|it| it.reason == Reason::Lost)
    }

    fn lasting(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|it| it.lasts())
    }

    /// Returns all alarms.
    pub fn all(&self) -> Vec<Alarm> {
        self.entries.iter().map(|it| it.alarm.clone()).collect()
    }
}

/// Formats relay numbers: "3", "3 and 5", "1, 2 and 5", "1 to 3 and 5 to 9".
pub fn list(relays: &[u16]) -> String {
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

/// Formats relays by their numbers: "relay 3", "relays 3 and 5".
pub fn named(relays: &[u16]) -> String {
    let noun = if relays.len() > 1 { "relays" } else { "relay" };
    format!("{noun} {}", list(relays))
}
