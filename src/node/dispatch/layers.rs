//! The five layers of a relay, and what each of them is handed.

use crate::node::context::{Context, Member};
use crate::node::lease::Lease;
use crate::node::mission_update::MissionUpdate;
use crate::node::neighbour::Neighbours;
use crate::node::round::Round;
use crate::node::view::change::ViewChange;
use crate::side::Side;
use crate::time::Instant;

/// The layers of one relay.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub(super) neighbours: Neighbours,
    pub(super) view: ViewChange,
    pub(super) lease: Lease,
    pub(super) update: MissionUpdate,
    pub(super) round: Round,
}

impl Layers {
    /// What a layer is handed. It borrows the member alone, which stands beside the layers: any of them can be lent while it lasts.
    pub(super) fn context<'a>(&self, now: Instant, member: &'a Member) -> Context<'a> {
        let onward = Side::onward(member.mission.heading());
        Context {
            now,
            member,
            latest: self.update.latest(),
            end: self.neighbours.at(onward).has_no_peer(),
            held: self.lease.held(now),
        }
    }

    /// What could not be said to the neighbour after can be now.
    pub(super) fn resend(&mut self) {
        self.view.resend();
        self.round.resend();
    }
}
