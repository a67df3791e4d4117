//! What the nodes on one side say of themselves: which are heard, whom they hear, and whom they take.

use super::hearing::mask;
use super::state::Neighbour;
use crate::settings::Settings;
use crate::time::Instant;

/// So many times in a row a node has to say that it does not hear this relay: an answer or two may be lost.
const UNHEARD: u8 = 8;

/// Handshakes in a row under a node's number that are signed with another key.
#[cfg(feature = "auth")]
const FORGED: u8 = 3;

impl Neighbour {
    /// Returns true if the node `distance` places away and this relay hear each other, and the link is not held down.
    pub(crate) fn is_two_way(&self, distance: u16, now: Instant, settings: &Settings) -> bool {
        let held = self.damping.held(now, settings);
        let known = mask(distance) & self.both_ways.recent(now, settings) & !held != 0;
        known || self.is_mutual() && self.distance == distance && self.liveness.is_there()
    }

    /// Whether the neighbour here is linked, and less than `distance` places away.
    pub(crate) fn comes_along(&self, distance: u16) -> bool {
        self.is_mutual() && self.liveness.is_there() && self.distance < distance
    }

    /// Whether the neighbour here is linked, and more than `distance` places away.
    pub(crate) fn goes_past(&self, distance: u16) -> bool {
        self.is_mutual() && self.liveness.is_there() && self.distance > distance
    }

    /// Node `distance` places away has said which one it takes on this side, and whether it hears this relay.
    pub(crate) fn says(
        &mut self,
        distance: u16,
        neighbour: u16,
        hears: bool,
        now: Instant,
        settings: &Settings,
    ) {
        if let Some(taken) = self.taken_by.get_mut(usize::from(distance).wrapping_sub(1)) {
            *taken = neighbour;
        }
        if hears {
            self.both_ways.add(distance, now, settings);
        }
    }

    /// The node that the one `distance` places away takes on this side, as it said last; 0 for none.
    pub(crate) fn taken_by(&self, distance: u16) -> u16 {
        let known = self.taken_by.get(usize::from(distance).wrapping_sub(1));
        known.copied().unwrap_or(0)
    }

    /// An intact frame from the node `distance` nodes away, which is the one `taken` or not.
    pub(crate) fn heard(&mut self, distance: u16, taken: bool, now: Instant, settings: &Settings) {
        self.hearing.add(distance, now, settings);
        self.damping.hear(distance, self.asks_all(), now, settings);
        if taken {
            self.liveness.met();
        }
    }

    /// The nodes that were heard lately, without one whose link is held down: bit 0 is the nearest one.
    pub(crate) fn hears(&self, now: Instant, settings: &Settings) -> u8 {
        let held = self.damping.held(now, settings);
        self.hearing.recent(now, settings) & !held
    }

    /// The node `distance` nodes away has said whether it hears this relay; whether it does not, for the last of so many times in a row.
    pub(crate) fn says_it_hears(&mut self, distance: u16, heard: bool) -> bool {
        self.unheard.count(distance, !heard, UNHEARD)
    }

    /// The node `distance` nodes away is of another mission; whether that is to be told.
    pub(crate) fn is_stranger(&mut self, distance: u16, now: Instant) -> bool {
        self.strangers.tell(distance, now)
    }

    /// A handshake under the number of the node `distance` nodes away was signed with another key; whether that is certain now.
    #[cfg(feature = "auth")]
    pub(crate) fn is_forged(&mut self, distance: u16) -> bool {
        self.forged.count(distance, true, FORGED)
    }

    /// The node `distance` nodes away has the key.
    #[cfg(feature = "auth")]
    pub(crate) fn is_signed_right(&mut self, distance: u16) {
        self.forged.count(distance, false, FORGED);
    }
}
