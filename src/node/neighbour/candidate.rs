//! A node that is not taken, as its hello has it.

/// A node that is not taken, and hears this relay.
#[expect(
    clippy::struct_excessive_bools,
    reason = "four things that its hello says"
)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub(crate) node: u16,
    /// How many places away it is, and whether toward Rx.
    pub(crate) distance: u16,
    pub(crate) downstream: bool,
    /// Whether it takes this relay for its neighbour.
    pub(crate) pairs: bool,
    /// Whether it is nearer than the one taken.
    pub(crate) nearer: bool,
    /// Whether it has somebody beyond it.
    pub(crate) ready: bool,
    /// Whether more relays hang together by it than by the one taken.
    pub(crate) longer: bool,
}

impl Candidate {
    /// How many nodes there may be between it and the one that was lost.
    pub(super) const fn beyond(self) -> u16 {
        self.distance.saturating_sub(2)
    }

    /// Whether it is to take the place of another one.
    pub(super) const fn is_better(self) -> bool {
        if self.nearer { self.ready } else { self.longer }
    }
}
