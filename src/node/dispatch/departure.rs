//! Departure: a relay leaves the chain while it holds its place, or waits outside as a spare.
//!
//! Requests travel to the leader in the replies to lease renewals, orders from the leader in the renewals (see `lease`). The states
//! and rules are in [`docs::batteries`](crate::docs::batteries).
//!
//! | event | action |
//! | --- | --- |
//! | `wait_as_spare`, or `leave`, before this relay has taken part in anything | go outside, as a spare or as a leaver |
//! | order to leave | ask both neighbours for a hello, again and again |
//! | order to leave; both neighbours have selected the relay beyond (the only one at an end) | go outside; keep the setpoint |
//! | order for the neighbour to leave, received by all | ask the nodes beyond it for a hello; at the end of the chain: give up the neighbour |
//! | hello of the node beyond the neighbour that is ordered to leave | select it |
//! | hello of a node outside of the chain | do not select it; if it is the neighbour, give it up, or call it if it is a spare that the view still has |
//! | outside, hello of a member: it has a neighbour beyond this relay in a later view, which is complete and in place | raise `MayLeave` |
//! | outside, called or `stay`; no later view for `dead_after`; not free for 16 times `dead_after` | join as a relay that was lost; without endurance only by `stay` |

use super::{Layers, Node};
use crate::event::{Event, NodeEvent};
use crate::guard::{Guard, HoldReason};
use crate::node::context::{Member, longest_lease, tenths};
use crate::node::neighbour::hearing::{CANDIDATES, mask};
use crate::place::Placement;
use crate::settings::{Settings, Wiring};
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::view::ViewId;
use crate::wire::message::{Hello, Leave, Orders, OwnRequests, used};

/// Maximum deviation in each of x, y and altitude at which a drone counts as in place, m. In place means at its agreed
/// position, or as near to it as the guard permits beside a lost drone.
const IN_PLACE_M: f32 = 3.0;

/// Time from the order to leave until the departure counts as blocked, in units of `dead_after`. A departure is blocked
/// if the neighbours of the relay that leaves do not receive each other. At twice this time after the order, the relay
/// requests the departure again.
const BLOCKED_AFTER: u32 = 4;

/// Time after which the last orders are followed again, in units of `hop_time`.
const REPEATED_AFTER: u32 = 24;

/// State of a relay that leaves the chain or waits outside of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Departure {
    /// Member of the chain, or about to join it.
    Member,
    /// Departure requested: the relay holds its place until the leader's order.
    Requested,
    /// Departure refused, because this relay has no guard (collision avoidance). The neighbours would fly close to this
    /// drone, which still holds its place. See [`Settings::leave_without_guard`](crate::Settings::leave_without_guard).
    NeedsGuard,
    /// Departure refused: with a separate link to each neighbour, the neighbours do not receive each other. See
    /// [`Wiring::Pair`](crate::Wiring::Pair).
    NeedsChannel,
    /// Departure refused for now: no relay would remain, or the remaining relays would have no quorum. If a spare is
    /// known, the leader calls it first.
    NeedsQuorum,
    /// Departure refused for now: the node numbers of this relay's neighbours differ by more than four.
    WideGap,
    /// Departure refused for a minute: this relay's two neighbours have not selected each other.
    Blocked,
    /// Spare outside of the chain, which the leader may call.
    Spare,
    /// Relay outside of the chain: it holds its place, and the other relays close the gap.
    Outside,
    /// Relay outside of the chain: the drone may fly away.
    Free,
}

/// Departure of this relay from the chain, and its knowledge of spares (relays that wait outside).
#[expect(clippy::struct_excessive_bools, reason = "independent of each other")]
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Leaving {
    requested: bool,
    /// Time at which the drone's endurance ends; `None` if unknown.
    lasts_until: Option<Instant>,
    /// Time at which this relay went outside of the chain; `None` while it is inside.
    outside_since: Option<Instant>,
    /// True for each side (toward Tx, toward Rx) at which this relay was the end of the chain. The values are those of
    /// the time at which the relay went outside of the chain.
    was_end: [bool; 2],
    /// True for each side whose neighbour has selected a different node in place of this relay.
    replaced: [bool; 2],
    /// True if this relay is a spare. Remains true if the spare requests to leave.
    spare: bool,
    free: bool,
    /// True while the drone has too little endurance for a return to the chain.
    too_low: bool,
    /// Time of the first order to leave since the request; `None` without an order.
    ///
    /// At a spare that has not joined yet: time of the first call.
    ordered_at: Option<Instant>,
    /// Time at which this relay follows the last orders again. At a spare that waits outside: end of its call.
    ///
    /// It is 0 if the orders name no relay, this relay requests nothing, and is not called.
    repeat_at: Instant,
    /// Last reported position of the drone; `None` until a position is reported.
    place: Option<Placement>,
    /// Position that the drone must reach to be reported as in place. `None` until the chain has agreed, and while the
    /// setpoint moves.
    goal: Option<Placement>,
    /// Spare (relay that waits outside) from which a frame was received last, and the time of this frame. `None` if no
    /// such frame was received.
    heard_spare: Option<(u16, Instant)>,
    /// Relay outside of the chain, at this side, that must be informed when it is allowed to leave. `None` if there is
    /// none.
    waiting: Option<(Side, u16)>,
    /// Relays that are allowed to leave, and that were reported to the firmware. One bit mask for each side of this
    /// relay; bit 0 is the nearest node.
    informed: [u8; 2],
}

impl Leaving {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    pub(crate) const fn is_outside(&self) -> bool {
        self.outside_since.is_some()
    }

    /// Returns true if this relay waits outside of the chain until the leader calls it.
    pub(crate) const fn is_spare(&self) -> bool {
        self.spare && !self.requested
    }

    pub(crate) const fn record_place(&mut self, place: Placement) {
        self.place = Some(place);
    }

    /// Ends the order to leave.
    const fn end_order(&mut self) {
        self.ordered_at = None;
        self.replaced = [false; 2];
    }

    /// Ends the orders of the previous view. A spare that it called is now a member; the others send hellos soon.
    ///
    /// Returns true if this relay was called to join, as a spare.
    pub(crate) const fn on_new_view(&mut self) -> bool {
        let was_called = self.ordered_at.is_some() && !self.requested;
        self.end_order();
        self.heard_spare = None;
        was_called
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        Some(self.repeat_at).filter(|at| *at > Instant::ZERO)
    }

    /// Returns the spare (relay that waits outside) that this relay has recently received; 0 for none.
    fn spare(&self, now: Instant, settings: &Settings) -> u16 {
        // A spare that receives no answer sends its next hellos after `dead_after`.
        let known = self
            .heard_spare
            .filter(|(_, at)| now.since(*at) < settings.dead_after.times(2));
        known.map_or(0, |(node, _)| node)
    }

    /// Returns true if the drone has arrived at its agreed position, as far as its own position is known.
    fn is_in_place(&self) -> bool {
        self.goal.is_some_and(|goal| {
            self.place.is_none_or(|place| {
                let off_m = [
                    place.x_m - goal.x_m,
                    place.y_m - goal.y_m,
                    place.altitude_m - goal.altitude_m,
                ];
                off_m.iter().all(|off_m| off_m.abs() <= IN_PLACE_M)
            })
        })
    }
}

impl Layers {
    /// Returns the reason why this relay cannot leave the chain now; `None` if it can leave.
    fn departure_refusal(&self, now: Instant, member: &Member) -> Option<Departure> {
        let Member { node, settings, .. } = member;
        let [before, after] =
            [Side::Upstream, Side::Downstream].map(|side| self.neighbours.at(side).node());
        // A spare between this relay and a neighbour joins first.
        let width = match self.leaving.spare(now, settings) {
            0 => after.saturating_sub(before),
            spare if spare < *node => after.saturating_sub(spare),
            spare => spare.saturating_sub(before),
        };
        let blocked = settings.dead_after.times(BLOCKED_AFTER);
        let ordered_for = self.leaving.ordered_at.map(|at| now.since(at));
        if settings.wiring == Wiring::Pair {
            Some(Departure::NeedsChannel)
        } else if settings.guard.is_none() && !settings.leave_without_guard {
            Some(Departure::NeedsGuard)
        } else if !member.keeps_quorum_without(&[*node]) {
            Some(Departure::NeedsQuorum)
        } else if before != 0 && after != 0 && width > CANDIDATES {
            Some(Departure::WideGap)
        } else if ordered_for.is_some_and(|span| blocked <= span && span < blocked.times(2)) {
            Some(Departure::Blocked)
        } else {
            None
        }
    }

    /// Updates this relay's requests to the leader, which go with the next lease renewal. They are the wish to leave, a
    /// spare (relay that waits outside) that this relay receives, and the report that its drone is in place.
    pub(super) fn update_requests(&mut self, now: Instant, member: &Member) {
        let Leaving {
            requested,
            lasts_until,
            ..
        } = self.leaving;
        // 0 is the mark of the relay that has the order to leave.
        let endurance_s = lasts_until.map_or(u16::MAX, |at| (tenths(at.since(now)) / 10).max(1));
        let leaves = requested
            && match self.departure_refusal(now, member) {
                // Once a spare has joined, the others have a quorum.
                Some(Departure::NeedsQuorum) => self.lease.knows_spare(),
                refused => refused.is_none(),
            };
        let ordered = self.lease.orders().leavers.contains(&member.node);
        let leave = Leave {
            node: member.node,
            endurance_s: if ordered { 0 } else { endurance_s },
        };
        let requests = OwnRequests {
            node: member.node,
            gap: match self
                .neighbours
                .at(Side::onward(member.mission.heading()))
                .node()
            {
                0 => CANDIDATES,
                next => next.abs_diff(member.node),
            },
            leave: if leaves { leave } else { Leave::NONE },
            spare: self.leaving.spare(now, &member.settings),
            in_place: self.leaving.is_in_place(),
        };
        self.lease.set_requests(requests);
    }
}

impl Node {
    /// Requests to leave the chain. `endurance_s` is the remaining endurance of the drone, s; `None` if unknown. A
    /// relay that has taken no part in the protocol since its start leaves the chain at once.
    pub(crate) fn leave(&mut self, now: Instant, endurance_s: Option<u16>) {
        let leaving = &mut self.layers.leaving;
        leaving.lasts_until =
            endurance_s.map(|left_s| now + Duration::from_millis(1_000).times(left_s.into()));
        if leaving.requested {
            return;
        }
        leaving.requested = true;
        leaving.end_order();
        let refused = self.layers.departure_refusal(now, &self.member).is_some();
        if !refused && self.is_untouched() && !self.layers.leaving.is_outside() {
            self.go_outside(now, false);
        }
    }

    /// Returns true until this relay has taken part in the protocol. The initial leader takes part as soon as it starts
    /// its first message along the chain.
    fn is_untouched(&self) -> bool {
        let Layers { round, view, .. } = &self.layers;
        let is_loaded = self.member.view == ViewId::LOADED && view.outstanding().is_none();
        round.is_idle() || is_loaded && round.is_untouched()
    }

    /// Cancels this relay's request to leave. Returns false, and does nothing, if the leader has already ordered the
    /// departure, or if the relay has already left the chain.
    pub(crate) fn withdraw(&mut self, now: Instant) -> bool {
        let is_untouched = self.is_untouched();
        let leaving = &mut self.layers.leaving;
        let granted = leaving.ordered_at.is_some() || leaving.is_outside() && !is_untouched;
        if granted || leaving.free {
            return false;
        }
        leaving.requested = false;
        if !leaving.spare {
            self.come_back(now);
        }
        true
    }

    /// Returns true if the settings never let this relay leave: no guard, or separate links. Separate links to the two
    /// neighbours are those of [`Wiring::Pair`]. The guard is the collision avoidance.
    pub(crate) fn can_never_leave(&self, now: Instant) -> bool {
        let refusal = self.layers.departure_refusal(now, &self.member);
        let lasting = [Departure::NeedsGuard, Departure::NeedsChannel];
        refusal.is_some_and(|why| lasting.contains(&why))
    }

    /// Records if the drone has too little endurance for a return to the chain: yes if `too_low` is true.
    pub(crate) const fn set_too_low(&mut self, too_low: bool) {
        self.layers.leaving.too_low = too_low;
    }

    /// Returns true if the drone may fly away, false if it has to wait. `None` unless this relay has requested to
    /// leave.
    pub(crate) fn departure_granted(&self) -> Option<bool> {
        let leaving = &self.layers.leaving;
        leaving.requested.then_some(leaving.free)
    }

    /// Makes this relay a spare outside of the chain. The call has no effect if the relay has taken part in the
    /// protocol since its start, has requested to leave, or has separate links to its neighbours ([`Wiring::Pair`]).
    pub(crate) fn wait_as_spare(&mut self, now: Instant) {
        let leaving = &self.layers.leaving;
        let may = self.searches() && self.is_untouched() && !leaving.requested;
        if may && !leaving.is_outside() {
            self.go_outside(now, true);
        }
    }

    /// Cancels the departure: this relay stays in the chain, or joins it again.
    pub(crate) fn stay(&mut self, now: Instant) {
        self.layers.leaving.requested = false;
        self.come_back(now);
    }

    pub(crate) fn departure(&self, now: Instant) -> Departure {
        let leaving = &self.layers.leaving;
        match self.layers.departure_refusal(now, &self.member) {
            _ if leaving.free => Departure::Free,
            _ if leaving.is_spare() => Departure::Spare,
            _ if leaving.is_outside() => Departure::Outside,
            _ if !leaving.requested => Departure::Member,
            Some(refused) => refused,
            None => Departure::Requested,
        }
    }

    /// Leaves the view: this relay has no neighbours, and no relay selects it. It keeps its setpoint.
    fn go_outside(&mut self, now: Instant, spare: bool) {
        // A relay that has just started knows no neighbours: it counts as an end only if there is no number beyond.
        let ends = [self.member.node == 1, self.member.node == self.member.all];
        let fresh = self.is_untouched();
        if fresh && !self.layers.round.is_idle() {
            self.layers.round.cancel_work();
        }
        self.layers.leaving.was_end = [0, 1].map(|at: usize| {
            let known = self.layers.neighbours.nodes().get(at).copied().flatten();
            known.is_none() && (!fresh || ends.get(at).copied().unwrap_or(false))
        });
        self.become_active(now);
        self.layers.view.request.stop();
        for side in [Side::Upstream, Side::Downstream] {
            self.layers.neighbours.at_mut(side).give_up(now, true);
        }
        let leaving = &mut self.layers.leaving;
        leaving.outside_since = Some(now);
        leaving.spare = spare;
    }

    /// Joins the chain again, like a lost relay that comes back. No effect if this relay is inside the chain.
    fn come_back(&mut self, now: Instant) {
        let leaving = &mut self.layers.leaving;
        if leaving.outside_since.take().is_none() {
            return;
        }
        leaving.spare = false;
        leaving.free = false;
        leaving.end_order();
        for side in [Side::Upstream, Side::Downstream] {
            let ends = !self.member.is_relay(self.member.beyond(side, 1));
            self.layers.neighbours.at_mut(side).give_up(now, ends);
            self.layers.neighbours.at_mut(side).forget_losses(now);
        }
        if self.layers.round.is_idle() {
            self.await_first(now);
        } else {
            self.layers.view.request.request_now(now);
        }
    }

    /// Returns this relay to the chain if it has waited outside too long for the permission to fly away. If no later
    /// view was agreed on, the chain still needs this relay.
    pub(super) fn return_if_expired(&mut self, now: Instant) {
        let Leaving {
            outside_since,
            spare,
            free,
            too_low,
            ..
        } = self.layers.leaving;
        let settings = &self.member.settings;
        let most = if self.layers.view.latest_view() > self.member.view {
            longest_lease(settings).times(2)
        } else {
            settings.dead_after
        };
        let may_return = !spare && !free && !too_low;
        if may_return && outside_since.is_some_and(|at| now.since(at) >= most) {
            self.come_back(now);
        }
    }

    /// Returns true if `node` is between this relay and its neighbour at `side`. Also true if the chain ends here and
    /// `node` is beyond this end.
    fn is_beside(&self, side: Side, node: u16) -> bool {
        let own = self.member.node;
        let neighbour = self.layers.neighbours.at(side).node();
        neighbour == 0 || node.abs_diff(own) < neighbour.abs_diff(own)
    }

    /// Returns true if node `to` at `side`, outside of the chain, is allowed to leave. This is so once the view without
    /// it is agreed on, and the relays of this view are in place.
    pub(super) fn may_fly_away(&self, side: Side, to: u16) -> bool {
        let lease = &self.layers.lease;
        let complete = lease.is_whole() && lease.until().is_some() && lease.orders().in_place;
        complete && self.layers.neighbours.at(side).is_agreed() && self.is_beside(side, to)
    }

    /// Raises an event for the firmware: the drone of node `to` at `side` may fly away. The event is raised once. It is
    /// raised a second time only if the node was a neighbour in the meantime.
    pub(super) fn on_freed(&mut self, side: Side, to: u16) {
        let bit = mask(to.abs_diff(self.member.node));
        if let Some(informed) = self.layers.leaving.informed.get_mut(side as usize)
            && *informed & bit == 0
        {
            *informed |= bit;
            self.raise_node_event(NodeEvent::MayLeaveTold, side, to);
        }
    }

    /// Returns true if node `to` at `side`, outside of the chain, is called to join the chain.
    ///
    /// The leader calls a spare. A relay that searches for its neighbour does not pass the call on, because it may look
    /// like the end of the chain. A spare that is still this relay's neighbour in the view has restarted, and is called
    /// at once.
    pub(super) fn calls_to_join(&self, side: Side, to: u16) -> bool {
        let (lease, neighbour) = (&self.layers.lease, self.layers.neighbours.at(side));
        let is_called = if neighbour.node() == to {
            let distance = to.abs_diff(self.member.node);
            neighbour.is_agreed() && neighbour.selected_by(distance) == 0
        } else {
            lease.orders().joiners.contains(&to)
                && self.is_beside(side, to)
                && (neighbour.is_mutual() || neighbour.has_no_peer())
                && !self.steering.has_lost(side)
        };
        is_called && lease.until().is_some()
    }

    /// Updates the position that this relay must reach to report that it is in place. `destination` is the position to
    /// fly to; `None` if there is no such position.
    pub(super) fn update_goal(&mut self, destination: Option<Placement>) {
        // Near a lost drone, or that of a relay that leaves, the guard's limit is as close as a relay gets.
        let is_held = [Side::Upstream, Side::Downstream]
            .into_iter()
            .any(|side| self.steering.hold_reason(side) == Some(HoldReason::Lost));
        let goal = if is_held {
            self.steering.setpoint(destination)
        } else {
            self.layers.round.agreed_place()
        };
        // The fences beside a relay that leaves are as near as its interval of possible positions, once received.
        let is_fenced = |guard: &Guard| guard.is_still() && guard.is_answered();
        let waits =
            self.layers.leaving.requested && !self.steering.known_guard().is_none_or(is_fenced);
        self.layers.leaving.goal = goal.filter(|_| !self.steering.is_moving() && !waits);
    }

    /// Follows the last orders again once it is time, and repeats a fence that has not been answered.
    ///
    /// Reason: on a channel that loses frames, hellos to the relays that the orders name may be lost.
    pub(super) fn repeat_orders(&mut self, now: Instant) {
        if self
            .layers
            .leaving
            .next_timeout()
            .is_some_and(|at| at <= now)
        {
            self.follow_orders(now);
            self.steering.repeat_fence();
        }
    }

    /// Follows the leader's orders in the last lease renewal.
    pub(super) fn follow_orders(&mut self, now: Instant) {
        let orders = self.layers.lease.orders();
        self.record_orders(now, orders);
        if orders.in_place
            && let Some((side, node)) = self.layers.leaving.waiting.take()
        {
            self.schedule_hello(side, node, false);
        }
        for side in [Side::Upstream, Side::Downstream] {
            for joiner in used(&orders.joiners) {
                if self.side_of(joiner) == Some(side) && self.is_beside(side, joiner) {
                    self.schedule_hello(side, joiner, true);
                }
            }
            let neighbour = self.layers.neighbours.at(side);
            let node = neighbour.node();
            // The neighbour's hello that it has selected the relay beyond may be lost.
            let asks = self.layers.leaving.ordered_at.is_some()
                && orders.leavers.contains(&self.member.node)
                && !neighbour.has_no_peer();
            let leaves = node != 0 && orders.leavers.contains(&node) && neighbour.is_agreed();
            if asks {
                self.schedule_hello(side, node, true);
            }
            // Before the renewal has completed, relays beyond may not have the order.
            if leaves && self.layers.lease.has_completed() {
                self.pass_leaver(now, side, node);
            }
        }
        self.review_neighbours(now);
    }

    /// Records how long this relay has had its order to leave, and when it follows the orders again.
    fn record_orders(&mut self, now: Instant, orders: Orders) {
        let Member { node, settings, .. } = &self.member;
        let leaving = &mut self.layers.leaving;
        let waits = leaving.requested && !leaving.is_outside();
        let [[leaver, ..], [joiner, ..]] = [orders.leavers, orders.joiners];
        let names_relay = leaver != 0 || joiner != 0;
        if !waits && !names_relay {
            leaving.repeat_at = Instant::ZERO;
            if leaving.is_spare() {
                leaving.end_order();
            }
        } else if leaving.repeat_at <= now {
            leaving.repeat_at = now + settings.hop_time.times(REPEATED_AFTER);
        }
        if orders.leavers.contains(node) && leaving.requested {
            let blocked = settings.dead_after.times(2 * BLOCKED_AFTER);
            let at = leaving.ordered_at.filter(|at| now.since(*at) < blocked);
            leaving.ordered_at = Some(at.unwrap_or(now));
        } else if leaver != 0 {
            leaving.end_order();
        }
    }

    /// Asks the nodes beyond `leaver`, the neighbour at `side` that is ordered to leave, for hellos. If the chain ends
    /// with that neighbour, gives it up.
    fn pass_leaver(&mut self, now: Instant, side: Side, leaver: u16) {
        let Member { index, mission, .. } = &self.member;
        let is_end = match side {
            Side::Upstream => *index <= 2,
            Side::Downstream => index.saturating_add(1) >= mission.relays(),
        };
        if !is_end {
            return self.layers.neighbours.at_mut(side).schedule_hellos();
        }
        // First the fence beside the relay that leaves moves up to it.
        self.steer(now);
        if side == Side::Upstream || self.steering.known_guard().is_none_or(Guard::is_answered) {
            self.layers.neighbours.at_mut(side).give_up(now, true);
            self.steering.set_neighbour(side, None);
            self.schedule_hello(side, leaver, true);
        }
    }

    /// Handles the part of a hello of node `from` that concerns relays outside of the chain. Returns true if the rest
    /// of the hello must be ignored, because this relay or the sender is outside of the chain.
    pub(super) fn handle_outside_hello(
        &mut self,
        now: Instant,
        side: Side,
        from: u16,
        hello: &Hello,
    ) -> bool {
        if self.layers.leaving.is_outside() {
            self.on_hello_outside(now, side, hello);
            true
        } else if hello.is_of_outsider() {
            self.on_hello_of_outsider(now, side, from, hello);
            true
        } else {
            self.on_hello_of_member(now, side, from, hello)
        }
    }

    /// Handles a hello to this relay outside of the chain: permission to fly away, or call to join.
    fn on_hello_outside(&mut self, now: Instant, side: Side, hello: &Hello) {
        let (own, settings) = (self.member.node, self.member.settings);
        let neighbour = self.layers.neighbours.at_mut(side);
        neighbour.record_unselected(now, &settings);
        let later = hello.latest_view > self.member.view;
        let leaving = &mut self.layers.leaving;
        let [up, down] = leaving.was_end;
        // The chain goes on beyond this relay as it did before.
        let goes_on = match (side, hello.neighbour) {
            (Side::Upstream, 0) => down,
            (Side::Upstream, beyond) => beyond > own,
            (Side::Downstream, 0) => up,
            (Side::Downstream, beyond) => beyond < own,
        };
        let is_free = hello.frees_destination() && later && goes_on;
        if is_free && !leaving.is_spare() && !leaving.free {
            leaving.free = true;
            self.raise(Event::MayLeave);
        } else if hello.calls_destination() && leaving.is_spare() {
            // From a hover the drone begins at once. One that does not hover in time joins all the same.
            let called_at = *leaving.ordered_at.get_or_insert(now);
            let guard = self.steering.known_guard();
            if guard.is_none_or(|guard| guard.may_begin(now))
                || now.since(called_at) >= settings.dead_after
            {
                self.come_back(now);
                self.layers.leaving.ordered_at = Some(called_at);
                if hello.neighbour == 0 {
                    // The caller is an end of the chain, so this relay is the next end and searches for nobody beyond.
                    let beyond = self.layers.neighbours.at_mut(side.other());
                    beyond.give_up(now, true);
                }
            } else {
                // Without a further call until then, the next one is a new call.
                leaving.repeat_at = now + settings.dead_after;
            }
        }
    }

    /// Handles a hello of node `from`, which is outside of the chain.
    fn on_hello_of_outsider(&mut self, now: Instant, side: Side, from: u16, hello: &Hello) {
        let is_neighbour = self.layers.neighbours.at(side).node() == from;
        if is_neighbour && hello.ready && self.calls_to_join(side, from) {
            self.schedule_hello(side, from, false);
        } else if is_neighbour {
            self.layers.neighbours.at_mut(side).give_up(now, false);
            self.steering.set_neighbour(side, None);
        } else if !hello.ready {
            let leaving = &mut self.layers.leaving;
            leaving.waiting = Some((side, from));
            // A spare that requests to leave is one no longer.
            leaving.heard_spare = leaving.heard_spare.filter(|(node, _)| *node != from);
        } else if self.is_beside(side, from) && !self.steering.has_lost(side) {
            // Beside a lost drone that may still hover, a spare could fly into it. Of several spares the called one
            // counts, else the one that was received first.
            let called = self.layers.lease.orders().joiners.contains(&from);
            let known = self.layers.leaving.spare(now, &self.member.settings);
            if called || [0, from].contains(&known) {
                self.layers.leaving.heard_spare = Some((from, now));
            }
        }
    }

    /// Handles a hello of node `from`, a member or a relay that joins. Returns true if this relay leaves the chain now.
    fn on_hello_of_member(&mut self, now: Instant, side: Side, from: u16, hello: &Hello) -> bool {
        let own = self.member.node;
        let is_neighbour = self.layers.neighbours.at(side).node() == from;
        let leaving = &mut self.layers.leaving;
        if is_neighbour && let Some(informed) = leaving.informed.get_mut(side as usize) {
            *informed &= !mask(from.abs_diff(own));
        }
        // A spare that was called counts as one until it has joined: the departure waits for it.
        if let Some((node, at)) = &mut leaving.heard_spare
            && *node == from
            && !is_neighbour
        {
            *at = now;
        }
        let ordered = self.layers.lease.orders().leavers.contains(&own) && leaving.requested;
        if is_neighbour && let Some(replaced) = leaving.replaced.get_mut(side as usize) {
            *replaced = hello.neighbour != own;
        }
        let replaced = leaving.replaced;
        let is_replaced = [Side::Upstream, Side::Downstream]
            .into_iter()
            .zip(replaced)
            .all(|(side, replaced)| replaced || self.layers.neighbours.at(side).has_no_peer());
        if is_neighbour && ordered && is_replaced && !self.layers.view.has_no_quorum() {
            self.go_outside(now, false);
            return true;
        }
        false
    }
}
