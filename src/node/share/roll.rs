//! The call for a new view of the chain: who is there, counted from the leader to the last, and back.

use super::super::exchange::{Arrival, Next, Phase};
use super::super::lead::Lead;
use super::{Own, Pass, Share};
use crate::wire::message::{Before, Count, Roster};

/// A call, as one relay sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rolling {
    /// Number of the new view.
    pub(crate) view: u16,
    /// This relay's place in it, from 1 at the leader.
    pub(crate) place: u16,
    /// The newest view that a relay up to this one has agreed to.
    pub(crate) before: Before,
    /// How many relays there are, once that is known; `None` if too few.
    pub(crate) relays: Option<u16>,
}

impl Share {
    /// The leader calls for view `view`, above every one it has heard of.
    pub(crate) fn call(&mut self, own: Own<'_>, view: u16) -> Next {
        self.sweeps = self.sweeps.saturating_add(1);
        self.roll(own, view, 0, None)
    }

    /// A call from the relay before.
    pub(crate) fn on_roster(&mut self, own: Own<'_>, roster: &Roster) -> Next {
        let current = match &self.pass {
            Pass::Roll(rolling) => Some(*rolling),
            _ => None,
        };
        let again = current.is_some_and(|rolling| {
            rolling.view == roster.view && rolling.place == roster.place.saturating_add(1)
        });
        if again {
            return self.exchange.again();
        }
        let newest = match current {
            Some(rolling) if self.exchange.phase == Phase::Waiting => rolling.view.max(own.view),
            _ => own.view,
        };
        if roster.view <= newest {
            // Late, or from a leader that has missed something.
            return match self.exchange.straggler() {
                Arrival::Foreign => Next::Foreign,
                _ => Next::Stale,
            };
        }
        self.roll(own, roster.view, roster.place, Some(roster.before))
    }

    fn roll(&mut self, own: Own<'_>, view: u16, place: u16, before: Option<Before>) -> Next {
        let known = Before {
            view: own.view,
            relays: own.mission.relays(),
            leader: own.index == own.mission.leader(),
        };
        let before = match before {
            Some(told) if told.view > known.view => told,
            Some(told) if told.view == known.view => Before {
                leader: told.leader || known.leader,
                ..told
            },
            _ => known,
        };
        self.lead = Lead::No;
        self.exchange.phase = Phase::Waiting;
        self.pass = Pass::Roll(Rolling {
            view,
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
        self.conclude_roll(enough.then_some(rolling.place))
    }

    /// What came of a call, from the relay after.
    pub(crate) fn on_count(&mut self, count: &Count) -> Next {
        if let Pass::Roll(rolling) = &self.pass
            && self.exchange.phase == Phase::Waiting
            && rolling.view == count.view
            && rolling.place.saturating_add(1) == count.place
            && count.relays.is_none_or(|relays| relays > rolling.place)
        {
            return self.conclude_roll(count.relays);
        }
        Next::Stale
    }

    fn conclude_roll(&mut self, relays: Option<u16>) -> Next {
        let Pass::Roll(rolling) = &mut self.pass else {
            return Next::Nothing;
        };
        rolling.relays = relays;
        self.exchange.phase = Phase::Answered;
        Next::Formed { granted: relays }
    }

    /// The new view is in force: everybody's first pass in it is still to come.
    pub(crate) fn renew(&mut self, leader: bool) {
        self.lead = Lead::No;
        self.after = None;
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

    /// The number of the view that is being called for, while the answer is awaited.
    pub(crate) fn called(&self) -> Option<u16> {
        match &self.pass {
            Pass::Roll(rolling) if self.exchange.phase == Phase::Waiting => Some(rolling.view),
            _ => None,
        }
    }
}
