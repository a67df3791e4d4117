//! Views: agreements on the members of the chain.

use crate::mission::MAX_RELAYS;

/// Identifier of a view, which is an agreement on the members of the chain.
///
/// It consists of a number and of the node that proposed the view. So no two nodes propose views with the same
/// identifier. Views are ordered by number, then by proposer.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ViewId(u32);

/// Number of bits of a view identifier that hold the proposing node's number, enough for 1000 relays.
const NODE: u32 = 10;

impl ViewId {
    /// Initial view: the chain as configured in the mission, without a proposer.
    pub const LOADED: Self = Self(0);

    /// Decodes a view identifier: the proposer in the low ten bits, the number above.
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// Encodes the identifier for [`ViewId::from_bits`].
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// Number of the view, 0 to 4 194 303.
    pub const fn number(self) -> u32 {
        self.0 >> NODE
    }

    /// Node that proposed the view; 0 for the initial view.
    pub const fn proposer(self) -> u16 {
        (self.0 & ((1 << NODE) - 1)) as u16
    }

    /// Returns true if a node can have proposed this view: a valid proposer, and not the initial view.
    pub(crate) const fn is_proposed(self) -> bool {
        self.number() > 0 && 1 <= self.proposer() && self.proposer() <= MAX_RELAYS
    }

    /// Returns the view with the next number, proposed by `node`, 1 to 1000. `None` after four million views.
    pub(crate) const fn next_by(self, node: u16) -> Option<Self> {
        let number = self.number() + 1;
        if number >> (32 - NODE) == 0 {
            Some(Self(number << NODE | node as u32))
        } else {
            None
        }
    }

    /// Returns `view` with its number limited to this view's number plus `most`. This bounds the step by which a
    /// received view can raise the known number.
    pub(crate) const fn toward(self, view: Self, most: u32) -> Self {
        let number = self.number() + most;
        if view.number() > number {
            Self(number << NODE | view.proposer() as u32)
        } else {
            view
        }
    }

    /// Returns a 16-bit value for this view, to be added to the mission's digest in messages. Views with the same
    /// number and different proposers have different values, and so have thousands of consecutive views.
    pub(crate) const fn mark(self) -> u16 {
        let [a, b, c, d] = self.0.to_le_bytes();
        u16::from_le_bytes([a, b]).wrapping_add(u16::from_le_bytes([d, c]))
    }
}

/// View: agreed membership of the chain, with its identifier and its number of relays.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct View {
    /// Identifier of the view, an agreed set of members of the chain.
    pub id: ViewId,
    /// Number of relays that are members of the view, 1 to 1000.
    pub relays: u16,
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::ViewId;

    #[test]
    fn views_are_ordered_by_number_then_by_proposer() {
        let first = ViewId::LOADED.next_by(1000).unwrap();
        let other = ViewId::LOADED.next_by(3).unwrap();
        let second = first.next_by(1).unwrap();
        assert!(ViewId::LOADED < other && other < first && first < second);
        assert_eq!((second.number(), second.proposer()), (2, 1));
        assert_eq!(ViewId::from_bits(u32::MAX).next_by(1), None);
    }

    #[test]
    fn the_passes_of_near_views_differ_in_their_mark() {
        let mut marks: std::vec::Vec<u16> = (0..16)
            .flat_map(|number| (1..=1000).map(move |node| ViewId(number << 10 | node).mark()))
            .collect();
        marks.sort_unstable();
        marks.dedup();
        assert_eq!(marks.len(), 16_000);
    }
}
