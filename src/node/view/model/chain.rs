//! Model state: relays, partition of the chain, frames in the air, and past decisions.

extern crate std;

use std::vec::Vec;

use crate::node::view::change::ViewChange;
use crate::view::ViewId;

/// View and its size, as a sortable pair.
pub(super) type Sized = (ViewId, u16);

/// Content of a frame.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) enum Body {
    Proposal {
        view: ViewId,
        place: u16,
        agreed: Sized,
        votes: u16,
        proposer: bool,
        successor: Option<(ViewId, Sized)>,
    },
    Decision {
        proposal: ViewId,
        place: u16,
        there: u16,
        base: Sized,
        view: Option<Sized>,
    },
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) struct Frame {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) body: Body,
}

/// State of one relay.
#[derive(Clone, Debug)]
pub(super) struct Unit {
    pub(super) change: ViewChange,
    /// Last accepted view, this relay's place in it, and its size.
    pub(super) flies: (ViewId, u16, u16),
}

impl Unit {
    fn key(&self) -> impl Eq + core::hash::Hash + use<> {
        let change = &self.change;
        (
            change.circulation.stage(),
            change.proposed,
            change.electorate,
            self.flies,
        )
    }
}

impl PartialEq for Unit {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Unit {}

impl core::hash::Hash for Unit {
    fn hash<H: core::hash::Hasher>(&self, hasher: &mut H) {
        self.key().hash(hasher);
    }
}

/// New view that was decided on: its size and the view that it follows.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(super) struct Decree {
    pub(super) view: Sized,
    pub(super) follows: ViewId,
    /// Relays that voted on the proposal, bit 0 for the first relay.
    pub(super) members: u8,
}

#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub(super) struct Chain {
    pub(super) units: Vec<Unit>,
    /// Partition number of each relay.
    pub(super) parts: Vec<u8>,
    /// Frames in the air, sorted and without duplicates.
    pub(super) air: Vec<Frame>,
    /// Lists of all views that were ever decided on, and of all that were ever agreed on.
    pub(super) decrees: Vec<Decree>,
    pub(super) agreed: Vec<Sized>,
    pub(super) cuts: u8,
    pub(super) proposals: u8,
    pub(super) reboots: u8,
    pub(super) losses: u8,
}

/// Event of the model.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Happens {
    Part(usize),
    Arrives(Frame),
    Proposes(usize),
    EndsAt(usize),
    Repeats(usize),
    Passes(usize),
    Reboots(usize),
    Forgets(usize),
}

/// Inserts `one` into a sorted list, unless it is already there.
pub(super) fn put<T: Ord>(all: &mut Vec<T>, one: T) {
    if let Err(at) = all.binary_search(&one) {
        all.insert(at, one);
    }
}

impl Chain {
    pub(super) fn before(&self, at: usize) -> Option<usize> {
        (0..at)
            .rev()
            .find(|&other| self.parts[other] == self.parts[at])
    }

    pub(super) fn after(&self, at: usize) -> Option<usize> {
        (at + 1..self.parts.len()).find(|&other| self.parts[other] == self.parts[at])
    }
}
