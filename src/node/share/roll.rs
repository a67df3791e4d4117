//! The call for a new view of the chain: who is there, counted from the leader to the last, and back.

use super::super::exchange::{Arrival, Next, Phase};
use super::super::lead::Lead;
use super::{Own, Pass, Share};
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, PriorView, Proposal};

/// A call, as one relay sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rolling {
    /// Number of the new view.
    pub(crate) view: u16,
    /// The mission that it is to fly.
    pub(crate) mission_id: MissionId,
    /// This relay's place in it, from 1 at the leader.
    pub(crate) place: u16,
    /// The newest view that a relay up to this one has agreed to.
    pub(crate) before: PriorView,
    /// How many relays there are, once that is known; `None` if too few.
    pub(crate) relays: Option<u16>,
}

impl Share {
    /// The leader calls for view `view`, above every one it has heard of.
    pub(crate) fn call(&mut self, own: Own<'_>, view: u16) -> Next {
        self.sweeps = self.sweeps.saturating_add(1);
        self.roll(own, view, own.held, 0, None)
    }

    /// A call from the relay before, for a view that flies the mission that this relay holds.
    pub(crate) fn on_proposal(&mut self, own: Own<'_>, proposal: &Proposal) -> Next {
        let current = match &self.pass {
            Pass::Roll(rolling) => Some(*rolling),
            _ => None,
        };
        let again = current.is_some_and(|rolling| {
            rolling.view == proposal.view
                && rolling.mission_id == proposal.mission_id
                && rolling.place == proposal.place.saturating_add(1)
        });
        if again {
            return self.exchange.again();
        }
        let newest = match current {
            Some(rolling) if self.exchange.phase == Phase::Waiting => rolling.view.max(own.view),
            _ => own.view,
        };
        if proposal.view <= newest {
            // Late, or from a leader that has missed something.
            return match self.exchange.straggler() {
                Arrival::Foreign => Next::Foreign,
                _ => Next::Stale,
            };
        }
        let before = Some(proposal.before);
        self.roll(
            own,
            proposal.view,
            proposal.mission_id,
            proposal.place,
            before,
        )
    }

    fn roll(
        &mut self,
        own: Own<'_>,
        view: u16,
        mission_id: MissionId,
        place: u16,
        before: Option<PriorView>,
    ) -> Next {
        let known = PriorView {
            view: own.view,
            relays: own.mission.relays(),
            leader: own.index == own.mission.leader(),
        };
        let before = match before {
            Some(told) if told.view > known.view => told,
            Some(told) if told.view == known.view => PriorView {
                leader: told.leader || known.leader,
                ..told
            },
            _ => known,
        };
        self.lead = Lead::No;
        self.exchange.phase = Phase::Waiting;
        self.pass = Pass::Roll(Rolling {
            view,
            mission_id,
            place: place.saturating_add(1),
            before,
            relays: None,
        });
        if own.end {
            self.end_roll(own)
        } else {
            Next::Forward { moved: false }
        }
    }

    /// The chain ends here: if a call has come so far, everybody is counted.
    pub(crate) fn end_roll(&mut self, own: Own<'_>) -> Next {
        let Pass::Roll(rolling) = self.pass else {
            return Next::Nothing;
        };
        if self.exchange.phase != Phase::Waiting {
            return Next::Nothing;
        }
        // Of two halves the one with the leader is the larger.
        let there = 2 * u32::from(rolling.place) + u32::from(rolling.before.leader);
        let enough = !own.settings.quorum || there > u32::from(rolling.before.relays);
        self.conclude_roll(own, enough.then_some(rolling.place))
    }

    /// What came of a call, from the relay after.
    pub(crate) fn on_decision(&mut self, own: Own<'_>, count: &Decision) -> Next {
        if let Pass::Roll(rolling) = &self.pass
            && self.exchange.phase == Phase::Waiting
            && rolling.view == count.view
            && rolling.mission_id == count.mission_id
            && rolling.place.saturating_add(1) == count.place
            && count.relays.is_none_or(|relays| relays > rolling.place)
        {
            return self.conclude_roll(own, count.relays);
        }
        Next::Stale
    }

    fn conclude_roll(&mut self, own: Own<'_>, relays: Option<u16>) -> Next {
        let Pass::Roll(rolling) = &mut self.pass else {
            return Next::Nothing;
        };
        if !own.has(rolling.mission_id) {
            // A newer mission has taken its place since: the others come to hold that one, too.
            return Next::Foreign;
        }
        rolling.relays = relays;
        self.exchange.phase = Phase::Answered;
        Next::Formed { granted: relays }
    }

    /// The new view is in force: everybody's first pass in it is still to come.
    pub(crate) fn renew(&mut self, leader: bool) {
        self.lead = Lead::No;
        self.after = None;
        self.chosen = None;
        self.exchange.renew(if leader {
            Phase::Planning
        } else {
            Phase::Answered
        });
    }

    /// The leader's part is too small.
    pub(crate) const fn cut(&mut self) {
        self.exchange.phase = Phase::Cut;
    }

    /// This relay's place in the last call, from 1 at the one that began it; 0 if the current pass is another.
    pub(crate) const fn place(&self) -> u16 {
        match &self.pass {
            Pass::Roll(rolling) => rolling.place,
            _ => 0,
        }
    }

    /// Whether the current pass is a call for a new view.
    pub(crate) const fn is_rolling(&self) -> bool {
        matches!(self.pass, Pass::Roll(_))
    }

    /// The view that is being called for, its number and its mission, while the answer is awaited.
    pub(crate) fn called(&self) -> Option<(u16, MissionId)> {
        match &self.pass {
            Pass::Roll(rolling) if self.exchange.phase == Phase::Waiting => {
                Some((rolling.view, rolling.mission_id))
            }
            _ => None,
        }
    }

    /// The mission of the last call; `None` if the current pass is another.
    pub(crate) const fn id(&self) -> Option<MissionId> {
        match &self.pass {
            Pass::Roll(rolling) => Some(rolling.mission_id),
            _ => None,
        }
    }
}

#[cfg(feature = "upload")]
#[cfg(test)]
mod tests {
    use super::{Next, Own, Pass, Phase, Rolling, Share};
    use crate::mission::Mission;
    use crate::mission::tests::paper;
    use crate::settings::Settings;
    use crate::wire::digest::{MissionId, digest};
    use crate::wire::message::{Decision, PriorView, Proposal};

    /// What relay 2 of 3 holds: mission 4; it flies the one it was loaded with.
    struct Held {
        mission: Mission,
        settings: Settings,
        mission_id: MissionId,
    }

    impl Held {
        fn new() -> Self {
            Self {
                mission: Mission::try_new(paper(3)).unwrap(),
                settings: Settings::default(),
                mission_id: MissionId {
                    version: 4,
                    digest: 0x1234,
                },
            }
        }

        fn own(&self) -> Own<'_> {
            Own {
                mission: &self.mission,
                settings: &self.settings,
                flown: MissionId {
                    version: 0,
                    digest: digest(&self.mission),
                },
                held: self.mission_id,
                view: 0,
                index: 2,
                end: false,
                measured_per_w: None,
            }
        }

        fn proposal(&self, view: u16) -> Proposal {
            Proposal {
                mission_id: self.mission_id,
                view,
                place: 1,
                before: PriorView {
                    view: 0,
                    relays: 3,
                    leader: true,
                },
            }
        }

        fn count(&self, view: u16) -> Decision {
            Decision {
                mission_id: self.mission_id,
                view,
                place: 3,
                relays: Some(3),
            }
        }
    }

    fn share(held: &Held) -> Share {
        Share::new(false, 0, held.mission.config().common)
    }

    /// The leader was switched on again in the midst of a call, and has been offered another mission.
    #[test]
    fn a_call_for_the_same_view_with_another_mission_is_another_call() {
        let mut held = Held::new();
        let mut share = share(&held);
        let first = held.proposal(1);
        assert_eq!(
            share.on_proposal(held.own(), &first),
            Next::Forward { moved: false }
        );
        assert_eq!(share.on_proposal(held.own(), &first), Next::Busy);
        held.mission_id.version = 5;
        assert_eq!(
            share.on_proposal(held.own(), &held.proposal(1)),
            Next::Stale,
            "and not that it has arrived"
        );
    }

    #[test]
    fn a_count_is_of_the_mission_that_was_called_for() {
        let held = Held::new();
        let mut share = share(&held);
        share.on_proposal(held.own(), &held.proposal(1));
        let mut count = held.count(1);
        count.mission_id.version = 5;
        assert_eq!(share.on_decision(held.own(), &count), Next::Stale);
        assert_eq!(
            share.on_decision(held.own(), &held.count(1)),
            Next::Formed { granted: Some(3) }
        );
    }

    /// A newer mission has taken the place of the one called for: it cannot be flown any more.
    #[test]
    fn who_has_lost_the_mission_has_no_part_in_its_view() {
        let mut held = Held::new();
        let mut share = share(&held);
        share.on_proposal(held.own(), &held.proposal(1));
        let count = held.count(1);
        held.mission_id.version = 5;
        assert_eq!(share.on_decision(held.own(), &count), Next::Foreign);
        assert_eq!(share.phase(), Phase::Waiting);
        assert!(matches!(
            share.pass,
            Pass::Roll(Rolling { relays: None, .. })
        ));
    }
}
