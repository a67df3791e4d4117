//! The two neighbours of a relay, and which of them passes go to.

use crate::mission::Heading;

/// One of the two neighbours of a relay, or the link to it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Toward the transmitter.
    Upstream,
    /// Toward the receiver.
    Downstream,
}

impl Side {
    /// Where passes go to.
    pub(crate) const fn onward(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Downstream,
            Heading::TowardTx => Self::Upstream,
        }
    }

    /// Where passes come from, and what came of them goes back to.
    pub(crate) const fn back(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Upstream,
            Heading::TowardTx => Self::Downstream,
        }
    }

    /// The one opposite.
    pub(crate) const fn other(self) -> Self {
        match self {
            Self::Upstream => Self::Downstream,
            Self::Downstream => Self::Upstream,
        }
    }
}
