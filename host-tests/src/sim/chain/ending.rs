//! When a run is over.

use uav_relay::{Phase, Side};

use super::super::outcome::Ending;
use super::Chain;

impl Chain {
    pub(super) fn ending(&self) -> Option<Ending> {
        let killed = self.members.iter().any(|member| member.killed.is_some());
        if killed && self.kills_ahead == 0 {
            return self.all_noticed().then_some(Ending::Broken);
        }
        if self.kills_ahead > 0 {
            return None;
        }
        if self
            .leader()
            .is_some_and(|leader| leader.relay.phase() == Phase::Infeasible)
        {
            return Some(Ending::Infeasible);
        }
        let settled = self.holding >= self.members.len()
            && self
                .members
                .iter()
                .all(|member| member.relay.phase() == Phase::Holding);
        settled.then_some(Ending::Settled)
    }

    /// Whether every living neighbour of a silent relay has noticed.
    fn all_noticed(&self) -> bool {
        let noticed = |by: usize, side| {
            let Some(member) = self.members.get(by) else {
                return true;
            };
            let key = (u16::try_from(by + 1).unwrap_or(u16::MAX), side);
            member.killed.is_some() || self.outcome.noticed.contains_key(&key)
        };
        self.members
            .iter()
            .enumerate()
            .filter(|(_, member)| member.killed.is_some())
            .all(|(silent, _)| {
                let before = silent
                    .checked_sub(1)
                    .is_none_or(|by| noticed(by, Side::Downstream));
                before && noticed(silent + 1, Side::Upstream)
            })
    }
}
