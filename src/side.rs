//! The two sides of a relay, and the direction of passes.

use crate::mission::Heading;

/// Neighbour of a relay, or the link to it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Side of the transmitter.
    Upstream,
    /// Side of the receiver.
    Downstream,
}

impl Side {
    /// Returns the side to which passes are sent.
    pub(crate) const fn onward(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Downstream,
            Heading::TowardTx => Self::Upstream,
        }
    }

    /// Returns the side from which passes are received, and to which their replies are sent.
    pub(crate) const fn back(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Upstream,
            Heading::TowardTx => Self::Downstream,
        }
    }

    pub(crate) const fn other(self) -> Self {
        match self {
            Self::Upstream => Self::Downstream,
            Self::Downstream => Self::Upstream,
        }
    }
}
