//! Neighbours of a relay: one on each side.
//!
//! | file | content |
//! | --- | --- |
//! | [`state`] | selection of the neighbour on one side: state table, contents of received hellos, pending messages |
//! | [`hearing`] | recently heard nodes, pending hellos |
//! | `damping` | flapping links |
//! | [`liveness`] | detection of a lost neighbour |

mod damping;
pub(crate) mod hearing;
pub(crate) mod liveness;
pub(crate) mod state;

use super::context::{Member, earliest};
use crate::settings::Settings;
use crate::side::Side;
use crate::time::Instant;

use state::Neighbour;

#[derive(Clone, Debug)]
pub(crate) struct Neighbours {
    upstream: Neighbour,
    downstream: Neighbour,
}

impl Neighbours {
    /// State of both sides of the relay (toward Tx and toward Rx) before its start.
    pub(crate) const NONE: Self = Self {
        upstream: Neighbour::NONE,
        downstream: Neighbour::NONE,
    };

    /// Starts both sides of relay `node` at `now`. The relay's first neighbours are the relays with the adjacent node
    /// numbers, in a chain of `all` relays.
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

    /// Returns the node numbers of the neighbours toward Tx and toward Rx; `None` for no neighbour.
    pub(crate) fn nodes(&self) -> [Option<u16>; 2] {
        [&self.upstream, &self.downstream].map(|side| Some(side.node()).filter(|node| *node != 0))
    }

    /// Returns the neighbour at `side`, or Tx or Rx if this relay is the last one. `None` while there is neither.
    pub(crate) fn next(&self, member: &Member, side: Side) -> Option<u16> {
        let end = member.beyond(side, 1);
        match self.at(side).node() {
            0 => Some(end).filter(|end| !member.is_relay(*end)),
            node => Some(node),
        }
    }

    /// Returns true if a neighbour has changed since the last decision on a view.
    pub(crate) fn have_changed(&self, now: Instant) -> bool {
        self.upstream.has_changed(now) || self.downstream.has_changed(now)
    }

    /// Leaves the view: until the next view no neighbour counts as a member.
    pub(crate) const fn leave(&mut self) {
        self.upstream.leave();
        self.downstream.leave();
    }

    /// Records that a view proposal was refused. No new view is requested until a neighbour changes.
    pub(crate) const fn refuse(&mut self) {
        self.upstream.refuse();
        self.downstream.refuse();
    }

    /// Returns the next pending heartbeat; `None` if none is pending.
    ///
    /// The values are: side, destination node, number of this relay's own request, and number of the neighbour's
    /// request to which the heartbeat replies. A number 0 means none.
    pub(crate) fn poll_heartbeat(&mut self, now: Instant) -> Option<(Side, u16, u16, u16)> {
        [Side::Upstream, Side::Downstream]
            .into_iter()
            .find_map(|side| {
                let (to, ask, answer) = self.at_mut(side).poll_heartbeat(now)?;
                Some((side, to, ask, answer))
            })
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.upstream.next_timeout(), self.downstream.next_timeout())
    }
}
