//! The two sides of a relay, and the direction of passes.

use crate::mission::Heading;

/// Direction along the chain as seen from a relay: a neighbour of the relay, or the link to it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Direction toward the transmitter.
    Upstream,
    /// Direction toward the receiver.
    Downstream,
}

impl Side {
    /// Returns the side to which a relay forwards the messages of a pass along the chain.
    pub(crate) const fn onward(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Downstream,
            Heading::TowardTx => Self::Upstream,
        }
    }

    /// Returns the side from which a relay receives passes along the chain, and to which it replies.
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
