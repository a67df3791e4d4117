//! Who was there when a view was decided on.

use crate::node::context::Proposer;

/// The nodes on one side by what was decided on views, 0 for none.
#[derive(Clone, Copy, Debug)]
pub(super) struct AgreedNodes {
    /// The node that was there when the view was agreed on.
    in_view: u16,
    /// The node that was there when a proposal was decided last, granted or not.
    counted: u16,
    /// The node that the last proposal came from.
    proposer: u16,
}

impl AgreedNodes {
    pub(super) const fn on(node: u16) -> Self {
        Self {
            in_view: node,
            counted: node,
            proposer: node,
        }
    }

    /// The node that was there when the view was agreed on.
    pub(super) const fn node(self) -> u16 {
        self.in_view
    }

    /// The node that was there when a proposal was decided last, granted or not.
    pub(super) const fn counted(self) -> u16 {
        self.counted
    }

    /// A proposal has come from `node`, which is there, or begins here: then nobody is to be before this relay.
    pub(super) const fn proposed_by(&mut self, proposer: Proposer, node: u16) {
        self.proposer = match proposer {
            Proposer::Itself => 0,
            Proposer::Neighbour => node,
        };
    }

    /// The proposal that came from this side was granted.
    pub(super) const fn agree_with_proposer(&mut self) {
        self.agree(self.proposer);
    }

    /// A proposal was granted with `node` on this side.
    pub(super) const fn agree(&mut self, node: u16) {
        self.in_view = node;
        self.counted = node;
    }

    /// It was not granted: there is nothing to ask again until somebody else than `node` is there.
    pub(super) const fn refuse(&mut self, node: u16) {
        self.counted = node;
    }
}
