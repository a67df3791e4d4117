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

use uav_relay_screen::alarms::{Alarms, Reason};

use crate::report::seconds;
use crate::simulator::outcome::{Moment, TimelineEvent};

/// Updates the page's alarms from the events of a run.
pub(super) trait Observe {
    /// Processes the event `moment`: begins the alarms that it causes, and ends those that it resolves.
    fn observe(&mut self, moment: &Moment);
}

impl Observe for Alarms {
    fn observe(&mut self, moment: &Moment) {
        let (by, other) = (moment.relay, moment.other.unwrap_or_default());
        let time_s = seconds(moment.at);
        let mut begin = |reason, subject| self.begin(time_s, reason, subject, by);
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
                self.end(time_s, Reason::Blind, None, by);
            }
            TimelineEvent::LeaseLapsed => begin(Reason::LeaseExpired, 0),
            TimelineEvent::NotHeard => begin(Reason::NotReceived, other),
            TimelineEvent::MissionMismatch => begin(Reason::Mission, other),
            TimelineEvent::Restarted => begin(Reason::Restarted, by),
            TimelineEvent::InterfererUnclear | TimelineEvent::SensorOff => {
                begin(Reason::Measurements, 0);
            }
            TimelineEvent::Found(_) => {
                self.end(time_s, Reason::Lost, Some(other), by);
                self.end(time_s, Reason::Lost, Some(by), by);
            }
            TimelineEvent::ViewAccepted { .. } => {
                self.end(time_s, Reason::NoQuorum, None, by);
                self.end(time_s, Reason::NotReceived, None, by);
            }
            TimelineEvent::Converged => {
                self.end(time_s, Reason::LeaseExpired, None, by);
                self.end(time_s, Reason::Infeasible, None, by);
            }
            TimelineEvent::Engaged => {
                for reason in [Reason::Blind, Reason::Released, Reason::Restarted] {
                    self.end(time_s, reason, None, by);
                }
            }
            TimelineEvent::Adopted(_) => self.end(time_s, Reason::Mission, Some(by), by),
            TimelineEvent::NewEstimate => self.end(time_s, Reason::Measurements, None, by),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a test fails by it")]

    use uav_relay::{Instant, Side};
    use uav_relay_screen::Urgency;
    use uav_relay_screen::alarms::{Alarms, MOST};

    use super::Observe as _;
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
            "relay 2: last agreement on positions expired, setpoint kept"
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
