//! What the tags of frames say of the nodes around.

use super::state::Node;
use crate::event::About;
use crate::side::Side;

impl Node {
    /// Node `from` at `side` has made itself known, for the first time if `first`: then what waits for an answer from there is
    /// said again.
    pub(crate) fn meet(&mut self, side: Side, from: u16, first: bool) {
        if self.ground_side(from).is_some() {
            return;
        }
        if self.layers.neighbours.at(side).node() != from {
            if first {
                // What was to be said to it before could not be read there.
                self.owe_hello(side, from, true);
            }
            return;
        }
        if first && side == self.onward() {
            self.layers.resend();
        }
    }

    /// Node `from` at `side` has said that it is there, and not shown that it has heard this relay.
    pub(crate) fn called(&mut self, side: Side, from: u16) {
        self.is_signed_right(side, from);
        if self.searches() {
            self.says_it_hears(side, from, false);
        }
    }

    /// A handshake under the number of node `from` at `side` was signed with another key, or altered.
    pub(crate) fn is_forged(&mut self, side: Side, from: u16) {
        let distance = from.abs_diff(self.member.node);
        if self.layers.neighbours.at_mut(side).is_forged(distance) {
            self.raise_about(About::Key, side, from);
        }
    }

    /// Node `from` at `side` has the key.
    pub(crate) fn is_signed_right(&mut self, side: Side, from: u16) {
        let distance = from.abs_diff(self.member.node);
        self.layers
            .neighbours
            .at_mut(side)
            .is_signed_right(distance);
    }

    /// Node `from` at `side` goes on with an older epoch than it had.
    pub(crate) fn went_back(&mut self, side: Side, from: u16) {
        self.raise_about(About::Epoch, side, from);
    }
}
