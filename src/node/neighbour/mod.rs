//! The neighbours of a relay: one on each side.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`state`] | which node is taken for the neighbour on one side: its state table, what the nodes there say, and what they are owed |
//! | [`hearing`] | which nodes were heard lately, and which hellos wait to be sent |
//! | `damping` | links that come and go |
//! | [`liveness`] | when a neighbour counts as lost |

mod damping;
pub(crate) mod hearing;
pub(crate) mod liveness;
pub(crate) mod state;

use super::timing::earliest;
use crate::settings::Settings;
use crate::side::Side;
use crate::time::Instant;

use state::Neighbour;

/// Both sides.
#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    upstream: Neighbour,
    downstream: Neighbour,
}

impl Neighbours {
    /// Before they have begun.
    pub(crate) const NONE: Self = Self {
        upstream: Neighbour::NONE,
        downstream: Neighbour::NONE,
    };

    /// Of node `node` of a chain of `all`, from now on.
    pub(crate) fn begin(
        &mut self,
        node: u16,
        all: u16,
        seed: u32,
        now: Instant,
        settings: &Settings,
    ) {
        let before = node.saturating_sub(1);
        let after = if node < all {
            node.saturating_add(1)
        } else {
            0
        };
        self.upstream.begin(before, all, seed, now, settings);
        self.downstream.begin(after, all, !seed, now, settings);
    }

    pub(crate) const fn at(&self, side: Side) -> &Neighbour {
        match side {
            Side::Upstream => &self.upstream,
            Side::Downstream => &self.downstream,
        }
    }

    pub(crate) const fn at_mut(&mut self, side: Side) -> &mut Neighbour {
        match side {
            Side::Upstream => &mut self.upstream,
            Side::Downstream => &mut self.downstream,
        }
    }

    /// The nodes taken, toward Tx and toward Rx.
    pub(crate) fn nodes(&self) -> [Option<u16>; 2] {
        [&self.upstream, &self.downstream].map(|side| Some(side.node()).filter(|node| *node != 0))
    }

    /// Whether somebody else is there than when a view was decided on last.
    pub(crate) fn have_changed(&self, now: Instant) -> bool {
        self.upstream.has_changed(now) || self.downstream.has_changed(now)
    }

    /// Leaves the view: no neighbour is one of a view until the next one is agreed on.
    pub(crate) const fn leave(&mut self) {
        self.upstream.leave();
        self.downstream.leave();
    }

    /// A proposal was decided against.
    pub(crate) const fn refuse(&mut self) {
        self.upstream.refuse();
        self.downstream.refuse();
    }

    /// The next heartbeat that is owed: at which side, to which node, the number of its question and that of the one it answers.
    pub(crate) fn take_heartbeat(&mut self, now: Instant) -> Option<(Side, u16, u16, u16)> {
        [Side::Upstream, Side::Downstream]
            .into_iter()
            .find_map(|side| {
                let (to, ask, answer) = self.at_mut(side).take_heartbeat(now)?;
                Some((side, to, ask, answer))
            })
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.upstream.next_timeout(), self.downstream.next_timeout())
    }
}
