//! On which side of a relay a node is.

use super::state::Node;
use crate::event::About;
use crate::node::duplicate::Duplicated;
use crate::node::mission_update::takes_uploads;
use crate::node::neighbour::hearing::CANDIDATES;
use crate::settings::Wiring;
use crate::side::Side;
use crate::time::Instant;

impl Node {
    /// Where passes go to, and where they come from.
    pub(super) const fn onward(&self) -> Side {
        Side::onward(self.member.mission.heading())
    }

    pub(super) const fn back(&self) -> Side {
        Side::back(self.member.mission.heading())
    }

    /// On which side node `sender` is, if it may have something to say to this relay: a neighbour, or one that might become
    /// one, or the ground where it may upload missions.
    pub(crate) fn side_of(&self, sender: u16) -> Option<Side> {
        if let Some(side) = self.ground_side(sender) {
            return Some(side);
        }
        let own = self.member.node;
        let near = sender.abs_diff(own) <= if self.searches() { CANDIDATES } else { 1 };
        if !near || sender == own || sender < 1 || sender > self.member.all {
            return None;
        }
        Some(if sender < own {
            Side::Upstream
        } else {
            Side::Downstream
        })
    }

    /// On which side `node` is, if it is the ground transmitter or receiver and near enough to be heard.
    pub(super) fn ground_side(&self, node: u16) -> Option<Side> {
        let (own, all) = (self.member.node, self.member.all);
        let most = match self.member.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => CANDIDATES,
        };
        let near = takes_uploads(&self.member) && node.abs_diff(own) <= most;
        match node {
            0 if near => Some(Side::Upstream),
            _ if near && node == all.saturating_add(1) => Some(Side::Downstream),
            _ => None,
        }
    }

    /// Whether others than the neighbours of the mission can be heard.
    pub(super) fn searches(&self) -> bool {
        self.member.settings.wiring == Wiring::Shared
    }

    /// Node `from` was heard at the port of side `through`: at that of the other side than its own, it may be heard at both.
    pub(crate) fn hear_at_both(&mut self, now: Instant, through: Side, from: u16) {
        let Some(side) = self.side_of(from).filter(|side| *side != through) else {
            return;
        };
        let settings = self.member.settings;
        if self.layers.neighbours.at(side).is_there()
            && self
                .duplicate
                .should_report(now, Duplicated::Neighbour, &settings)
        {
            self.raise_about(About::Index, side, from);
        }
    }
}
