//! The two sides of a relay, and the order in which positions are computed along the chain.

/// Order in which the positions of a chain are computed; it determines the leader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heading {
    /// Order from Tx to Rx, relay 1 first: used with an interferer (Algorithm 1). Each relay's position is computed
    /// from the position of its neighbour toward Tx, which sends to this relay.
    TowardRx,
    /// Order from Rx to Tx, relay N first: used with an interference field (Algorithm 4). Each relay's position is
    /// computed from the position of its neighbour toward Rx, which receives from this relay.
    TowardTx,
}

/// Side of a relay along the chain, toward Tx or toward Rx. Also used for the neighbour on that side, and for the link
/// to this neighbour.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Side of a relay toward the transmitter Tx.
    Upstream,
    /// Side of a relay toward the receiver Rx.
    Downstream,
}

impl Side {
    /// Returns the side to which a relay forwards messages along the chain in the direction `heading`.
    pub(crate) const fn onward(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Downstream,
            Heading::TowardTx => Self::Upstream,
        }
    }

    /// Returns the side from which messages along the chain in the direction `heading` arrive. Replies are sent to this
    /// side.
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
