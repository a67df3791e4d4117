//! Alarms of a running chain, from the events of its relays.
//!
//! | event | alarm | ends with |
//! | --- | --- | --- |
//! | a neighbour is lost | critical | the neighbour is found again, or finds a neighbour |
//! | no quorum | critical | all relays that reported it have accepted a view |
//! | the autopilot reports no position | critical | the relay is engaged or released |
//! | duplicate number, another key, old epoch | critical | it stays |
//! | no feasible positions | critical | the relay has an agreed position |
//! | the pilot took control | warning | the relay is engaged |
//! | the lease has expired | warning | all relays that reported it have an agreed position |
//! | not received by another relay | warning | the relay has accepted a view |
//! | another mission | warning | the other relay has adopted the mission |
//! | the autopilot was restarted | notice | the relay is engaged |
//! | measurements that do not fit | notice | the relay has a new estimate |

use uav_relay_screen::{Alarm, Urgency};

use crate::report::seconds;
use crate::report::timeline::named;
use crate::simulator::outcome::{Moment, TimelineEvent};

/// Number of alarms beyond which ended ones are dropped: the least urgent first, of these the oldest. Lasting ones stay.
const MOST: usize = 200;

/// Reason of an alarm.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Reason {
    Lost,
    NoQuorum,
    Blind,
    Duplicate,
    Key,
    Epoch,
    Infeasible,
    Released,
    LeaseExpired,
    NotReceived,
    Mission,
    Restarted,
    Measurements,
}

impl Reason {
    const fn urgency(self) -> Urgency {
        match self {
            Self::Lost
            | Self::NoQuorum
            | Self::Blind
            | Self::Duplicate
            | Self::Key
            | Self::Epoch
            | Self::Infeasible => Urgency::Critical,
            Self::Released | Self::LeaseExpired | Self::NotReceived | Self::Mission => {
                Urgency::Warning
            }
            Self::Restarted | Self::Measurements => Urgency::Notice,
        }
    }

    /// Returns the text of an alarm about relay `subject`, or about its `reporters` for subject 0.
    fn text(self, subject: u16, reporters: &[u16]) -> String {
        let by = named(reporters);
        match self {
            Self::Lost => format!("relay {subject} lost: reported by {by}"),
            Self::NoQuorum => format!("no quorum: {by} cannot reach enough relays, position held"),
            Self::Blind => format!("{by}: the autopilot reports no position"),
            Self::Duplicate => format!("two nodes have the number {subject}: reported by {by}"),
            Self::Key => format!("relay {subject} signs with another key: reported by {by}"),
            Self::Epoch => {
                format!(
                    "relay {subject} started with an old epoch: its frames are rejected by {by}"
                )
            }
            Self::Infeasible => format!("{by}: no positions meet any target SIR, positions kept"),
            Self::Released => format!("{by} released: the pilot took control"),
            Self::LeaseExpired => format!("last agreement expired, setpoint kept: {by}"),
            Self::NotReceived => format!("relay {subject} does not receive {by}"),
            Self::Mission => format!("relay {subject} has another mission: reported by {by}"),
            Self::Restarted => format!("{by}: the autopilot was restarted"),
            Self::Measurements => {
                format!("{by}: the measured interference does not fit one interferer")
            }
        }
    }
}

#[derive(Debug)]
struct Entry {
    alarm: Alarm,
    reason: Reason,
    /// Relay that the alarm is about; 0 if it is about its reporters.
    subject: u16,
    /// Relays for which the reason lasts, sorted.
    reporters: Vec<u16>,
}

/// Alarms of a run, in the order of their numbers.
#[derive(Debug, Default)]
pub(super) struct Alarms {
    entries: Vec<Entry>,
    raised: u32,
}

impl Alarms {
    /// Updates the alarms after an event.
    pub(super) fn observe(&mut self, moment: &Moment) {
        let (by, other) = (moment.relay, moment.other.unwrap_or_default());
        let mut begin = |reason, subject| self.begin(moment, reason, subject);
        match moment.what {
            TimelineEvent::Lost(_) => begin(Reason::Lost, other),
            TimelineEvent::NoQuorum => begin(Reason::NoQuorum, 0),
            TimelineEvent::Blind => begin(Reason::Blind, by),
            TimelineEvent::DuplicateIndex => begin(Reason::Duplicate, other),
            TimelineEvent::KeyMismatch => begin(Reason::Key, other),
            TimelineEvent::EpochWentBack => begin(Reason::Epoch, other),
            TimelineEvent::Infeasible => begin(Reason::Infeasible, 0),
            TimelineEvent::Released => {
                begin(Reason::Released, by);
                self.end(moment, Reason::Blind, None);
            }
            TimelineEvent::LeaseLapsed => begin(Reason::LeaseExpired, 0),
            TimelineEvent::NotHeard => begin(Reason::NotReceived, other),
            TimelineEvent::MissionMismatch => begin(Reason::Mission, other),
            TimelineEvent::Restarted => begin(Reason::Restarted, by),
            TimelineEvent::InterfererUnclear | TimelineEvent::SensorOff => {
                begin(Reason::Measurements, 0);
            }
            TimelineEvent::Found(_) => {
                self.end(moment, Reason::Lost, Some(other));
                self.end(moment, Reason::Lost, Some(by));
            }
            TimelineEvent::ViewAccepted { .. } => {
                self.end(moment, Reason::NoQuorum, None);
                self.end(moment, Reason::NotReceived, None);
            }
            TimelineEvent::Converged => {
                self.end(moment, Reason::LeaseExpired, None);
                self.end(moment, Reason::Infeasible, None);
            }
            TimelineEvent::Engaged => {
                for reason in [Reason::Blind, Reason::Released, Reason::Restarted] {
                    self.end(moment, reason, None);
                }
            }
            TimelineEvent::Adopted(_) => self.end(moment, Reason::Mission, Some(by)),
            TimelineEvent::NewEstimate => self.end(moment, Reason::Measurements, None),
            _ => {}
        }
    }

    /// Begins an alarm, or adds its reporter to the same alarm that lasts already.
    fn begin(&mut self, moment: &Moment, reason: Reason, subject: u16) {
        let by = moment.relay;
        let mut lasting = self
            .entries
            .iter_mut()
            .filter(|it| it.alarm.cleared_s.is_none());
        if let Some(known) = lasting.find(|it| (it.reason, it.subject) == (reason, subject)) {
            if let Err(at) = known.reporters.binary_search(&by) {
                known.reporters.insert(at, by);
            }
            known.alarm.text = reason.text(subject, &known.reporters);
            return;
        }
        self.raised += 1;
        self.entries.push(Entry {
            alarm: Alarm {
                number: self.raised,
                time_s: seconds(moment.at),
                urgency: reason.urgency(),
                text: reason.text(subject, &[by]),
                cleared_s: None,
            },
            reason,
            subject,
            reporters: vec![by],
        });
        if self.entries.len() > MOST {
            let all = self.entries.iter().enumerate();
            let ended = all.filter(|(_, it)| it.alarm.cleared_s.is_some());
            if let Some((at, _)) = ended.min_by_key(|(_, it)| it.alarm.urgency) {
                self.entries.remove(at);
            }
        }
    }

    /// Ends the alarms of a reason about relay `subject`.
    ///
    /// `None` ends only the part that the moment's relay has reported.
    fn end(&mut self, moment: &Moment, reason: Reason, subject: Option<u16>) {
        let lasting = self
            .entries
            .iter_mut()
            .filter(|it| it.alarm.cleared_s.is_none());
        for entry in lasting.filter(|it| it.reason == reason) {
            match subject {
                Some(subject) if subject == entry.subject => entry.reporters.clear(),
                Some(_) => continue,
                None => entry.reporters.retain(|by| *by != moment.relay),
            }
            if entry.reporters.is_empty() {
                entry.alarm.cleared_s = Some(seconds(moment.at));
            } else {
                entry.alarm.text = reason.text(entry.subject, &entry.reporters);
            }
        }
    }

    /// Returns the numbers of the relays that `by` has reported as lost and not found again.
    pub(super) fn lost_for(&self, by: u16) -> Vec<u16> {
        let lost = self.lost().filter(|it| it.reporters.contains(&by));
        lost.map(|it| it.subject).collect()
    }

    /// Returns true if relay `number` is reported as lost.
    pub(super) fn is_lost(&self, number: u16) -> bool {
        self.lost().any(|it| it.subject == number)
    }

    fn lost(&self) -> impl Iterator<Item = &Entry> {
        let lasting = self
            .entries
            .iter()
            .filter(|it| it.alarm.cleared_s.is_none());
        lasting.filter(|it| it.reason == Reason::Lost)
    }

    /// Returns all alarms.
    pub(super) fn all(&self) -> Vec<Alarm> {
        self.entries.iter().map(|it| it.alarm.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a test fails by it")]

    use uav_relay::{Instant, Side};
    use uav_relay_screen::Urgency;

    use super::{Alarms, MOST};
    use crate::simulator::outcome::{Moment, TimelineEvent};

    fn moment(at_s: u64, relay: u16, what: TimelineEvent, other: u16) -> Moment {
        Moment {
            at: Instant::from_millis(1_000 * at_s),
            relay,
            what,
            other: Some(other).filter(|it| *it > 0),
            target: None,
            sweeps: 0,
        }
    }

    #[test]
    fn two_neighbours_report_one_lost_relay_which_returns() {
        let mut alarms = Alarms::default();
        alarms.observe(&moment(10, 4, TimelineEvent::Lost(Side::Upstream), 3));
        alarms.observe(&moment(11, 2, TimelineEvent::Lost(Side::Downstream), 3));
        let all = alarms.all();
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].text, "relay 3 lost: reported by relays 2 and 4");
        assert_eq!((all[0].number, all[0].cleared_s), (1, None));
        assert!(alarms.is_lost(3) && !alarms.is_lost(2));
        assert_eq!(alarms.lost_for(4), [3]);
        alarms.observe(&moment(30, 3, TimelineEvent::Found(Side::Upstream), 2));
        assert_eq!(alarms.all()[0].cleared_s, Some(30.0));
        assert!(!alarms.is_lost(3));
        // A second loss is another alarm.
        alarms.observe(&moment(40, 2, TimelineEvent::Lost(Side::Downstream), 3));
        assert_eq!(alarms.all()[1].number, 2);
    }

    #[test]
    fn an_alarm_of_several_relays_ends_with_the_last_of_them() {
        let mut alarms = Alarms::default();
        for relay in [1, 2] {
            alarms.observe(&moment(5, relay, TimelineEvent::LeaseLapsed, 0));
        }
        alarms.observe(&moment(6, 1, TimelineEvent::Converged, 0));
        let all = alarms.all();
        assert_eq!(
            all[0].text,
            "last agreement expired, setpoint kept: relay 2"
        );
        assert_eq!(all[0].cleared_s, None);
        alarms.observe(&moment(7, 2, TimelineEvent::Converged, 0));
        assert_eq!(alarms.all()[0].cleared_s, Some(7.0));
    }

    #[test]
    fn the_number_of_alarms_is_bounded() {
        let mut alarms = Alarms::default();
        for second in 0..1_000 {
            alarms.observe(&moment(second, 1, TimelineEvent::Released, 0));
            alarms.observe(&moment(second, 1, TimelineEvent::Engaged, 0));
        }
        let all = alarms.all();
        assert_eq!(all.len(), MOST);
        assert_eq!(all[MOST - 1].number, 1_000);
    }

    #[test]
    fn notices_make_room_before_warnings_and_lasting_alarms_stay() {
        let mut alarms = Alarms::default();
        alarms.observe(&moment(0, 2, TimelineEvent::Blind, 0));
        alarms.observe(&moment(1, 2, TimelineEvent::Engaged, 0));
        for second in 0..1_000 {
            for event in [TimelineEvent::Restarted, TimelineEvent::Released] {
                alarms.observe(&moment(second, 1, event, 0));
            }
            alarms.observe(&moment(second, 1, TimelineEvent::Engaged, 0));
        }
        let all = alarms.all();
        assert_eq!(all.len(), MOST);
        let count = |urgency| all.iter().filter(|it| it.urgency == urgency).count();
        assert_eq!(all[0].number, 1, "the critical alarm that has ended");
        assert!(count(Urgency::Warning) >= MOST - 2);
        // More lasting alarms than there is room for.
        let relays = u16::try_from(MOST).unwrap_or_default() + 50;
        for relay in 1..=relays {
            alarms.observe(&moment(2_000, relay, TimelineEvent::Released, 0));
        }
        let all = alarms.all();
        assert_eq!(all.len(), usize::from(relays));
        assert!(all.iter().all(|it| it.cleared_s.is_none()));
    }
}
