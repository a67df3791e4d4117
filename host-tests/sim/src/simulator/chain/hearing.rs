//! Connectivity of the relays: range, partitions and one-way failures.

use uav_relay::Wiring;

use super::state::Chain;

/// Largest difference of the numbers of two neighbours, whatever the radio range.
const NEIGHBOUR: usize = 4;

impl Chain {
    /// Returns the range of a relay, in relays.
    pub(super) fn reach(&self) -> usize {
        match self.setup.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => self.setup.radio_reach,
        }
    }

    /// Returns true if a partition separates relays `one` and `other` (from 0) now.
    pub(super) fn are_parted(&self, one: usize, other: usize) -> bool {
        let parts = &self.setup.partitions;
        parts
            .iter()
            .any(|part| part.parts(number(one), number(other), self.now))
    }

    /// Returns true if no failure keeps relay `by` from receiving relay `of` (from 0) now. Range is not checked.
    pub(super) fn hears(&self, by: usize, of: usize) -> bool {
        let deaf = &self.setup.deaf;
        !self.are_parted(by, of)
            && !deaf
                .iter()
                .any(|deaf| deaf.applies(number(by), number(of), self.now))
    }

    /// Returns true if relays `one` and `other` (from 0) can be neighbours now: linked both ways and near.
    pub(super) fn are_linked(&self, one: usize, other: usize) -> bool {
        let most = self.reach().min(NEIGHBOUR);
        one.abs_diff(other) <= most && self.hears(one, other) && self.hears(other, one)
    }

    /// Returns the relays that receive relay `index` (from 0) on a shared channel.
    pub(super) fn in_range(&self, index: usize) -> Vec<usize> {
        let reach = self.setup.radio_reach;
        let until = self.members.len().min(index + reach + 1);
        (index.saturating_sub(reach)..until)
            .filter(|by| *by != index && self.hears(*by, index))
            .collect()
    }
}

fn number(index: usize) -> u16 {
    u16::try_from(index + 1).unwrap_or(u16::MAX)
}
