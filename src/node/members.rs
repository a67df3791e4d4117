//! What a relay knows of the chain it is in: which view of it was agreed on, and whether a new one is called for.
//!
//! A *view* is the chain as it was counted last: how many relays there are, and the place of each. View 0 is the chain as the
//! mission has it. Every pass bears its view's number in its digest, so none is taken up in another view. When a relay finds
//! somebody else beside it than in its view, or gets a pass that it cannot take part in, it asks toward the leader for a new
//! one, hop by hop, until it comes. The leader is whoever has nobody before it.
//!
//! | what a relay finds | what it does |
//! | --- | --- |
//! | another node beside it than agreed on, which has taken it, too; or nobody | calls for a view |
//! | a pass of another view, of another life of its leader, or one that comes after others which it missed | calls for a view |
//! | no pass for a while after it was switched on | calls for a view |
//! | a call from a neighbour that knows as new a view, or has just been switched on | calls for a view |
//! | a newer mission than the one it flies | calls for a view, which flies it if all hold it |
//! | a proposal, when it is the last | counts: more than half of the view before, or half with its leader, are a chain |

use crate::mission::Mission;
use crate::time::Duration;
use crate::wire::digest::{MissionId, digest};

use crate::settings::Settings;

/// The relay in its chain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Members {
    /// Its own node number, from 1 next to Tx.
    pub(crate) node: u16,
    /// Relays of the mission.
    pub(crate) all: u16,
    /// Digest of the mission as it was loaded.
    pub(crate) digest: u16,
    /// The mission that it flies.
    pub(crate) flown: MissionId,
    /// The newest mission that it holds.
    pub(crate) held: MissionId,
    /// Number of the view agreed on.
    pub(crate) view: u16,
    /// The largest number of a view heard of.
    pub(crate) newest: u16,
    /// Its place in the view, from 1 next to Tx.
    pub(crate) index: u16,
    /// Whether it calls for a new view.
    pub(crate) calls: bool,
    /// How often it has called since.
    tries: u8,
}

impl Members {
    pub(crate) fn new(mission: &Mission, node: u16) -> Self {
        let digest = digest(mission);
        let flown = MissionId { version: 0, digest };
        Self {
            node,
            all: mission.relays(),
            digest,
            flown,
            held: flown,
            view: 0,
            newest: 0,
            index: node,
            calls: false,
            tries: 0,
        }
    }

    /// The digest that passes bear in the view agreed on.
    pub(crate) const fn pass_digest(&self) -> u16 {
        self.flown.digest.wrapping_add(self.view)
    }

    /// A new view is called for; whether it was not until now.
    pub(crate) const fn call(&mut self) -> bool {
        let new = !self.calls;
        self.calls = true;
        if new {
            self.tries = 0;
        }
        new
    }

    /// A view has been agreed on.
    pub(crate) const fn agree(&mut self, view: u16, index: u16) {
        self.view = view;
        self.heard_of(view);
        self.index = index;
        self.calls = false;
    }

    /// A view of this number is known to somebody.
    pub(crate) const fn heard_of(&mut self, view: u16) {
        if view > self.newest {
            self.newest = view;
        }
    }

    /// How long to wait before calling again: twice as long each time, up to `quiet`.
    pub(crate) fn patience(&mut self, settings: &Settings) -> Duration {
        let wait = settings.hop_time.times(8 << self.tries.min(12));
        self.tries = self.tries.saturating_add(1);
        wait.min(settings.quiet)
    }
}
