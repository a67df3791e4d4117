//! The hellos that a relay owes, and what it says in them.

use super::state::Node;
#[cfg(feature = "upload")]
use crate::node::mission_update::takes_uploads;
use crate::node::neighbour::hearing::CANDIDATES;
use crate::side::Side;
use crate::time::Instant;
use crate::wire::digest::MissionId;
use crate::wire::message::Hello;

/// What a hello says of a mission.
struct MissionSaid {
    holds: MissionId,
    flies: bool,
    whole: bool,
    refused: bool,
}

impl Node {
    /// Owes node `to` at `side` a hello, which may ask for one in return.
    #[inline(never)] // called from many places
    pub(super) fn owe_hello(&mut self, side: Side, to: u16, ask: bool) {
        let distance = to.abs_diff(self.member.node);
        self.layers.neighbours.at_mut(side).owe(distance, ask);
    }

    /// The next hello that is owed: at which side, to which node.
    pub(super) fn next_hello(&mut self, now: Instant) -> Option<(Side, u16, Hello)> {
        let (own, all) = (self.member.node, self.member.all);
        for side in [Side::Upstream, Side::Downstream] {
            for _ in 0..CANDIDATES {
                let Some((distance, ask)) = self.layers.neighbours.at_mut(side).take_hello() else {
                    break;
                };
                let to = match side {
                    Side::Upstream => own.saturating_sub(distance),
                    Side::Downstream => own.saturating_add(distance),
                };
                if to >= 1 && to <= all && self.side_of(to).is_some() {
                    let nonce = self.ask_number(now);
                    let ready = self.is_between(now, side, to);
                    let hello = self.hello(now, side, ask, nonce);
                    return Some((side, to, Hello { ready, ..hello }));
                }
            }
        }
        None
    }

    pub(super) fn hello(&self, now: Instant, side: Side, ask: bool, nonce: u16) -> Hello {
        let said = self.says_of_mission();
        Hello {
            mission: self.member.digest,
            newest: self.layers.view.newest(),
            neighbour: self.layers.neighbours.at(side).node(),
            ask,
            form: self.layers.view.asking.asks() && side == self.back(),
            fresh: self.layers.round.is_fresh(),
            ready: false,
            // Who has just been switched on is in no part yet.
            behind: if self.layers.round.is_fresh() {
                1
            } else {
                self.beyond(side.other()).saturating_add(1)
            },
            hears: self
                .layers
                .neighbours
                .at(side)
                .hears(now, &self.member.settings),
            holds: said.holds,
            flies: said.flies,
            whole: said.whole,
            refused: said.refused,
            nonce,
        }
    }

    /// What a hello says of the mission: of the one that is held, or of a newer one that this relay has refused.
    fn says_of_mission(&self) -> MissionSaid {
        let (active, latest) = (self.member.active, self.layers.update.latest());
        #[cfg(feature = "upload")]
        if let Some(refused) = self.layers.update.refused_of(active) {
            return MissionSaid {
                holds: refused,
                flies: false,
                whole: false,
                refused: true,
            };
        }
        let flies = active == latest;
        #[cfg(feature = "upload")]
        let whole = flies && latest.version > 0 && self.layers.lease.is_whole();
        #[cfg(not(feature = "upload"))]
        let whole = false;
        MissionSaid {
            holds: latest,
            flies,
            whole,
            refused: false,
        }
    }

    /// Whether this relay could come between node `other` at `side` and the one that it takes there: whether that one and this relay hear
    /// each other, or there is a neighbour that comes along with it.
    fn is_between(&self, now: Instant, side: Side, other: u16) -> bool {
        let own = self.member.node;
        let beyond = self
            .layers
            .neighbours
            .at(side)
            .taken_by(other.abs_diff(own));
        let there = match side {
            Side::Upstream => beyond > own,
            Side::Downstream => beyond != 0 && beyond < own,
        };
        let settings = &self.member.settings;
        let far = self.layers.neighbours.at(side.other());
        let distance = beyond.abs_diff(own);
        // Of two links that cross the one that ends nearest to Rx is given up.
        let crosses = side == Side::Downstream && far.goes_past(distance);
        there && (far.is_two_way(distance, now, settings) || far.comes_along(distance) || crosses)
    }

    /// How many relays there are on that side in the part of the chain that this relay is in, as it was counted last.
    pub(super) fn beyond(&self, side: Side) -> u16 {
        if self.layers.neighbours.at(side).has_no_peer() {
            return 0;
        }
        let (place, all) = self
            .layers
            .view
            .counted()
            .unwrap_or_else(|| self.member.place_in_all());
        if side == self.back() {
            place.saturating_sub(1)
        } else {
            all.saturating_sub(place)
        }
    }

    /// The number of a hello that is said now, for the offer that answers it; 0 where none is taken.
    #[cfg(feature = "upload")]
    pub(super) fn ask_number(&mut self, now: Instant) -> u16 {
        if takes_uploads(&self.member) {
            self.layers.update.ask(now, &self.member.settings)
        } else {
            0
        }
    }

    #[cfg(not(feature = "upload"))]
    #[expect(clippy::unused_self, reason = "as the other one")]
    pub(super) const fn ask_number(&mut self, _: Instant) -> u16 {
        0
    }
}
