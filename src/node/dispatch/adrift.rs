//! A relay whose part of the chain has no quorum: after a while it gives its links up, and searches anew.
//!
//! Two parts that are interleaved, as 1 - 3 - 5 and 2 - 4 are, or a part of which no relay takes the one that could lead it back, would
//! keep their links for good. One that has no quorum has nothing to lose by them.

use super::state::Node;
use crate::node::timing::first_pass;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// So many times `dead_after` a part without a quorum keeps its links, at first and at most.
const FIRST: u32 = 3;
const MOST: u32 = 4;

/// Since when there is no quorum, and how often the links were given up since.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Adrift {
    /// When the links are given up; `None` where there is a quorum.
    at: Option<Instant>,
    again: bool,
}

impl Adrift {
    pub(super) const NONE: Self = Self {
        at: None,
        again: false,
    };

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }
}

impl Node {
    /// The part that this relay is in has been refused a view, or has one.
    pub(super) fn drift(&mut self, now: Instant) {
        if !self.searches() || !self.layers.view.has_no_quorum() {
            self.adrift = Adrift::NONE;
        } else if self.adrift.at.is_none() {
            self.adrift.at = Some(now + self.keeps_links_for());
        }
    }

    /// How long links are kept without a quorum.
    fn keeps_links_for(&self) -> Duration {
        let settings = &self.member.settings;
        let times = if self.adrift.again { MOST } else { FIRST };
        let pass = first_pass(settings, self.member.all);
        settings.dead_after.times(times).max(pass)
    }

    /// Gives the links up if it is time to.
    pub(super) fn search_anew(&mut self, now: Instant) {
        if self.adrift.at.is_none_or(|at| now < at) {
            return;
        }
        self.adrift.again = true;
        self.adrift.at = Some(now + self.keeps_links_for());
        for side in [Side::Upstream, Side::Downstream] {
            self.layers.neighbours.at_mut(side).give_up(now);
        }
    }
}
