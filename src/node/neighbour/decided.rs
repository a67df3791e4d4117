//! What a decision on a view makes of who is on one side.

use super::state::Neighbour;
use crate::node::context::Proposer;
use crate::time::Instant;

impl Neighbour {
    /// Whether it is certain who is there, and somebody else than when a proposal was decided last.
    pub(crate) fn has_changed(&self, now: Instant) -> bool {
        let changed = self.node != self.agreed.counted();
        changed && (self.has_no_peer() || self.is_mutual() && !self.has_grace(now))
    }

    /// Whether it is who was there when the view was agreed on.
    pub(crate) const fn is_agreed(&self) -> bool {
        self.node == self.agreed.node()
    }

    /// A proposal has come from whoever is there, or begins here: then nobody is to be before this relay.
    pub(crate) const fn proposed_by(&mut self, proposer: Proposer) {
        self.agreed.proposed_by(proposer, self.node);
    }

    /// The proposal that came from this side was granted.
    pub(crate) const fn agree_with_proposer(&mut self) {
        self.agreed.agree_with_proposer();
    }

    /// Leaves the view: nobody is here in it.
    pub(crate) const fn leave(&mut self) {
        self.agreed.agree(0);
    }

    /// It was not granted: there is nothing to ask again until somebody else is there.
    pub(crate) const fn refuse(&mut self) {
        self.agreed.refuse(self.node);
    }

    /// The proposal that was granted goes on to whoever is there, or ends here.
    pub(crate) const fn agree(&mut self, ends: bool) {
        self.agreed.agree(if ends { 0 } else { self.node });
    }
}
