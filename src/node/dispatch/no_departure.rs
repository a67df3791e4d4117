//! Relays that leave the chain, in a build without the feature `departures`.
//!
//! This relay forwards the requests and orders of other relays, and selects no node outside of the chain.

#![expect(
    clippy::unused_self,
    reason = "the same interface as that of `departure`"
)]

use super::{Layers, Node};
use crate::node::context::Member;
use crate::place::Placement;
use crate::settings::Settings;
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::wire::message::Hello;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Leaving;

impl Leaving {
    pub(crate) const fn new() -> Self {
        Self
    }

    pub(crate) const fn is_outside(self) -> bool {
        false
    }

    pub(crate) const fn is_spare(self) -> bool {
        false
    }

    pub(crate) const fn record_place(self, _: Placement) {}

    pub(crate) const fn on_new_view(self) -> bool {
        false
    }

    pub(crate) const fn next_timeout(self) -> Option<Instant> {
        None
    }
}

impl Layers {
    pub(super) const fn update_requests(&self, _: Instant, _: &Member) {}
}

impl Node {
    pub(crate) const fn leave(&self, _: Instant, _: Option<u16>) {}

    pub(crate) const fn departure_granted(&self) -> Option<bool> {
        None
    }

    pub(crate) const fn withdraw(&self, _: Instant) -> bool {
        true
    }

    pub(crate) const fn can_never_leave(&self, _: Instant) -> bool {
        true
    }

    pub(crate) const fn set_too_low(&self, _: bool) {}

    pub(super) const fn return_if_expired(&self, _: Instant) {}

    pub(super) const fn may_fly_away(&self, _: Side, _: u16) -> bool {
        false
    }

    pub(super) const fn on_freed(&self, _: Side, _: u16) {}

    pub(super) const fn calls_to_join(&self, _: Side, _: u16) -> bool {
        false
    }

    pub(super) const fn update_goal(&self, _: Option<Placement>) {}

    pub(super) const fn repeat_orders(&self, _: Instant) {}

    pub(super) const fn follow_orders(&self, _: Instant) {}

    /// Returns true if node `from` is outside of the chain and must not be selected.
    ///
    /// False if node `from` is the neighbour: the hello then shows that `from` has not selected this relay, which ends
    /// the link.
    pub(super) fn handle_outside_hello(
        &self,
        _: Instant,
        side: Side,
        from: u16,
        hello: &Hello,
    ) -> bool {
        hello.is_of_outsider() && self.layers.neighbours.at(side).node() != from
    }
}
