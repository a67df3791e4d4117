//! The two sides of a relay, and the order in which positions are computed along the chain.

/// Order in which positions are computed; it determines the leader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Heading {
    /// Relay 1 first: used with an interferer (Algorithm 1). A position follows from that of the sender toward Tx.
    TowardRx,
    /// Relay N first: used with an interference field (Algorithm 4). A position follows from that of the receiver
    /// toward Rx.
    TowardTx,
}

/// Direction from a relay: toward Tx or toward Rx.
///
/// Also the neighbour there, and the link to it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Direction toward Tx.
    Upstream,
    /// Direction toward Rx.
    Downstream,
}

impl Side {
    /// Returns where messages in the direction `heading` are forwarded to.
    pub(crate) const fn onward(heading: Heading) -> Self {
        match heading {
            Heading::TowardRx => Self::Downstream,
            Heading::TowardTx => Self::Upstream,
        }
    }

    /// Returns where messages come from; replies go there.
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
