//! Log of the run.

use uav_relay::Event;

use super::super::outcome::{Moment, TimelineEvent};
use super::state::{Chain, Member};

impl Chain {
    /// Handles all events of relay `index` (from 0) and logs them.
    pub(super) fn listen(&mut self, index: usize) {
        while let Some(member) = self.members.get_mut(index)
            && let Some(event) = member.relay.poll_event()
        {
            let by = member.node;
            let (what, other) = match event {
                Event::NeighbourLost { side, node } => {
                    self.outcome.noticed.insert((by, side), self.now);
                    (TimelineEvent::Lost(side), Some(node))
                }
                Event::NeighbourBack { side, node } => {
                    self.outcome.noticed.remove(&(by, side));
                    (TimelineEvent::Found(side), Some(node))
                }
                Event::NotHeard { node } => (TimelineEvent::NotHeard, Some(node)),
                Event::MissionMismatch { node } => (TimelineEvent::MissionMismatch, Some(node)),
                Event::KeyMismatch { node } => (TimelineEvent::KeyMismatch, Some(node)),
                Event::EpochWentBack { node } => (TimelineEvent::EpochWentBack, Some(node)),
                Event::DuplicateIndex { node } => (TimelineEvent::DuplicateIndex, Some(node)),
                Event::NewEstimate => (TimelineEvent::NewEstimate, None),
                Event::InterfererUnclear => (TimelineEvent::InterfererUnclear, None),
                Event::SensorOff { node } => (TimelineEvent::SensorOff, Some(node)),
                Event::LeaseLapsed => (TimelineEvent::LeaseLapsed, None),
                Event::Converged => {
                    self.holding += 1;
                    (TimelineEvent::Converged, None)
                }
                Event::ViewAccepted => {
                    // The rounds so far belong to the previous view.
                    self.outcome.rounds.clear();
                    let what = TimelineEvent::ViewAccepted {
                        view: member.relay.view().number(),
                        index: member.relay.index(),
                        relays: member.relay.mission().relays(),
                        version: member.relay.version(),
                    };
                    (what, None)
                }
                Event::Uploaded => {
                    let upload = member.relay.upload().copied();
                    if !self.setup.forgetful.contains(&by) {
                        member.stored = upload;
                    }
                    let version = upload.map_or(0, |upload| upload.version());
                    (TimelineEvent::Uploaded(version), None)
                }
                Event::Adopted => (TimelineEvent::Adopted(member.relay.version()), None),
                Event::NoQuorum => (TimelineEvent::NoQuorum, None),
                Event::Infeasible => (TimelineEvent::Infeasible, None),
                _ => continue,
            };
            self.tell(index, what, other);
        }
    }

    /// Adds a log entry about relay `index` (from 0).
    pub(super) fn tell(&mut self, index: usize, what: TimelineEvent, other: Option<u16>) {
        let Some(member) = self.members.get(index) else {
            return;
        };
        self.outcome.moments.push(Moment {
            at: self.now,
            relay: member.node,
            what,
            other,
            target: member.relay.target(),
            sweeps: member.begun(),
        });
    }

    /// Logs the partitions and one-way failures that begin or end now.
    pub(super) fn tell_of_partitions(&mut self) {
        for deaf in self.setup.deaf.clone() {
            let by = usize::from(deaf.by).saturating_sub(1);
            if deaf.from == self.now {
                self.tell(by, TimelineEvent::Deaf, Some(deaf.of));
            } else if deaf.until == Some(self.now) {
                self.tell(by, TimelineEvent::Hears, Some(deaf.of));
            }
        }
        let relays = self.setup.mission.relays();
        for partition in self.setup.partitions.clone() {
            if !(1..relays).contains(&partition.after) {
                // This partition separates no relays.
                continue;
            }
            let last = usize::from(partition.after).saturating_sub(1);
            if partition.from == self.now {
                self.tell(last, TimelineEvent::Partitioned, None);
            } else if partition.until == Some(self.now) {
                self.tell(last, TimelineEvent::PartitionEnded, None);
            }
        }
    }

    pub(super) fn sweeps(&self) -> u32 {
        self.members.iter().map(Member::begun).sum()
    }
}

impl Member {
    /// Returns the number of sweeps that this relay has begun over all its starts.
    fn begun(&self) -> u32 {
        self.swept + self.relay.stats().passes_begun
    }
}
