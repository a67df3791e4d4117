//! End conditions of a run.

use uav_relay::{Instant, Phase, Side, Wiring};

use super::super::outcome::Ending;
use super::state::{Chain, Member};
use super::station::Station;

impl Chain {
    pub(super) fn ending(&self) -> Option<Ending> {
        if self.setup.sky.is_some() {
            return self.listened.then_some(Ending::Soaked);
        }
        if self.ahead > 0 || self.setup.soak.is_some() {
            return None;
        }
        let killed = self.members.iter().any(|member| member.killed.is_some());
        if killed && self.setup.settings.wiring == Wiring::Pair {
            // Uploads cannot pass a silent relay on separate links.
            return self.all_noticed().then_some(Ending::Broken);
        }
        if self.stations.iter().any(Station::is_busy) {
            return None;
        }
        let phases = || {
            let living = self.members.iter().filter(|member| member.killed.is_none());
            living.map(|member| member.relay.phase())
        };
        let busy = |phase| {
            matches!(
                phase,
                Phase::Planning | Phase::Waiting | Phase::ViewChange | Phase::Idle
            )
        };
        if phases().any(busy) && !phases().any(|phase| phase == Phase::Infeasible) {
            return None;
        }
        let parts = self.parts();
        if is_cut(&parts) {
            return Some(Ending::NoQuorum);
        }
        let counted = parts.iter().filter(|part| is_counted(part));
        let largest = counted.max_by_key(|part| part.len())?;
        let is_in =
            |part: &[&Member], phase| part.iter().any(|member| member.relay.phase() == phase);
        if is_in(largest, Phase::Infeasible) {
            return Some(Ending::Infeasible);
        }
        let settled = self.holding >= largest.len()
            && holds(largest)
            && self.has_arrived()
            && self.all_hover();
        let others = parts
            .iter()
            .filter(|part| !std::ptr::eq(*part, largest))
            .all(|part| is_in(part, Phase::NoQuorum));
        (settled && others).then_some(Ending::Settled)
    }

    /// Ends a soak at its planned time if the next event is later.
    pub(super) fn end_soak(&mut self, next: Instant) {
        if let Some(until) = self.setup.soak
            && next > until
        {
            self.now = until;
            self.outcome.ending = Ending::Soaked;
        }
    }

    /// Returns the living relays, grouped into parts that can receive each other.
    fn parts(&self) -> Vec<Vec<&Member>> {
        let mut parts: Vec<Vec<&Member>> = Vec::new();
        let mut last: Option<usize> = None;
        for (index, member) in self.members.iter().enumerate() {
            if member.killed.is_some() {
                continue;
            }
            match parts.last_mut() {
                Some(part)
                    if last.is_some_and(|last| {
                        index - last <= self.setup.radio_reach && !self.are_parted(last, index)
                    }) =>
                {
                    part.push(member);
                }
                _ => parts.push(vec![member]),
            }
            last = Some(index);
        }
        parts
    }

    /// Returns true if every living neighbour of a silent relay has reported the loss.
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

/// Returns true if the members' indices and number of relays match `part`.
fn is_counted(part: &[&Member]) -> bool {
    part.iter().zip(1_u16..).all(|(member, index)| {
        member.relay.index() == index && usize::from(member.relay.mission().relays()) == part.len()
    })
}

/// Returns true if no part has a quorum, the relays know it, and all know their present neighbours.
fn is_cut(parts: &[Vec<&Member>]) -> bool {
    parts.iter().all(|part| {
        let nodes = part.iter().map(|member| Some(member.node));
        let before = [None].into_iter().chain(nodes.clone());
        let after = nodes.skip(1).chain([None]);
        let closed = part
            .iter()
            .zip(before.zip(after))
            .all(|(member, (before, after))| member.relay.neighbours() == [before, after]);
        let cut = part
            .iter()
            .any(|member| member.relay.phase() == Phase::NoQuorum);
        let newest = part.iter().max_by_key(|member| member.relay.view());
        let before = newest.map_or(0, |member| member.relay.mission().relays());
        closed && cut && 2 * part.len() <= usize::from(before)
    })
}

/// Returns true if all relays hold their positions for the same target.
fn holds(part: &[&Member]) -> bool {
    let target = |member: &&Member| member.relay.target().map(f32::to_bits);
    part.iter()
        .all(|member| member.relay.phase() == Phase::Holding)
        && part.windows(2).all(|pair| match pair {
            [one, other] => target(one) == target(other),
            _ => true,
        })
}
