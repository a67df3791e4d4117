//! Who hears whom.

use uav_relay::Wiring;

use super::state::Chain;

/// A relay takes one that is so many places away at most for its neighbour, however far it is heard.
const NEIGHBOUR: usize = 4;

impl Chain {
    /// How many relays away a relay is heard.
    pub(super) fn reach(&self) -> usize {
        match self.setup.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => self.setup.radio_reach,
        }
    }

    /// Whether relays `one` and `other` (from 0) are on different sides of a partition now.
    pub(super) fn are_parted(&self, one: usize, other: usize) -> bool {
        let parts = &self.setup.partitions;
        parts
            .iter()
            .any(|part| part.parts(number(one), number(other), self.now))
    }

    /// Whether relay `by` hears relay `of` now (from 0), if it is near enough.
    pub(super) fn hears(&self, by: usize, of: usize) -> bool {
        let deaf = &self.setup.deaf;
        !self.are_parted(by, of)
            && !deaf
                .iter()
                .any(|deaf| deaf.applies(number(by), number(of), self.now))
    }

    /// Whether relays `one` and `other` (from 0) can be neighbours in a chain now: they hear each other, and not too many are between.
    pub(super) fn are_linked(&self, one: usize, other: usize) -> bool {
        let most = self.reach().min(NEIGHBOUR);
        one.abs_diff(other) <= most && self.hears(one, other) && self.hears(other, one)
    }

    /// The relays that hear what relay `index` (from 0) sends on a shared channel.
    pub(super) fn in_range(&self, index: usize) -> Vec<usize> {
        let reach = self.setup.radio_reach;
        let until = self.members.len().min(index + reach + 1);
        (index.saturating_sub(reach)..until)
            .filter(|by| *by != index && self.hears(*by, index))
            .collect()
    }
}

/// The number of a relay, from 1.
fn number(index: usize) -> u16 {
    u16::try_from(index + 1).unwrap_or(u16::MAX)
}
