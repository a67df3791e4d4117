//! Motion guard: keeps relays apart while they fly to new agreed positions. Messages may be lost or late.
//!
//! Relays are in order along x. The *cross-section* of a position is its lateral offset and altitude. Normally
//! neighbours are at least the minimum separation apart *along x*. Then all relays are, whatever their cross-sections
//! are. Two relays whose agreed positions are beside or above each other come closer along x once both have arrived at
//! their cross-sections, which then keep them apart. Two relays with one between them always stay at least the
//! separation apart along x, so no relay needs more information than its neighbours'. Agreed positions that do not
//! allow this are approached as far as possible, and [`Guard::hold_reason`] reports it.
//!
//! Between two neighbours there is a *fence*, a plane x = constant. The relay upstream of it, its *owner*, stays a
//! distance, the *step*, before it. The relay downstream, the *follower*, stays at it or beyond.
//!
//! | file | content |
//! | --- | --- |
//! | [`config`] | geofence of setpoints, and other settings |
//! | `own` | the relay's setpoint and cross-section, and the interval along x in which it may be |
//! | `association` | the session with a neighbour to which a message belongs, and requests that relays forward |
//! | `link` | state that both fences have, with the association and the obstacles on that side |
//! | `owner` | the fence downstream, which this relay sets |
//! | `follower` | the fence upstream, which the neighbour sets |
//!
//! # Rules
//!
//! *Interval* of a relay: from the lowest to the highest x at which it may be, wherever it stops on its way. *In
//! order*: the follower is beyond the owner along x. Reports have an error of up to `hover_m`. If two reports are
//! within twice that error along x, the relays are in order only if their cross-sections are at least the separation
//! apart, so that they may pass each other.
//!
//! | | rule | purpose |
//! | --- | --- | --- |
//! | 1 | The follower never lowers its setpoint below the newest fence received, and flies up to that fence if it is below. | the owner can rely on its reports |
//! | 2 | The follower reports the number of the newest fence received, and the low end of its interval. If the x that it relies on downstream (rule 3) is lower, it reports this x, because errors of the reports of relays in order may add up. | a relay is known to be beyond all relays upstream |
//! | 3 | The owner relies on the lowest of that low end, if reported together with the newest fence, and every fence announced since. | no message in transit lets the follower come nearer than the owner relies on |
//! | 4 | The owner never raises its setpoint to less than the step before the x it relies on. | the two intervals are the step apart |
//! | 5 | The owner announces no fence nearer than the step beyond the high end of its own interval. | a fence that is lowered has already been cleared |
//! | 6 | As far as rule 5 allows, the fence is halfway between the two agreed positions plus half the step. Beside a relay with the order to leave, which holds its position, it is next to that relay. | both can reach their positions, and the neighbours close up to one that leaves |
//! | 7 | The first fence is the separation beyond the owner's own interval. Other fences, and moves across the line, start when the follower has cleared it. Until a relay has cleared the first fence upstream, it keeps room for the owner of that fence: each fence that it sends downstream is at least the separation beyond the highest x that the owner may still take. | a start that is too close is opened first, and no relay descends onto another |
//! | 8 | The first setpoint is the last reported position, with side and altitude, even outside of the geofence. Its x counts once a report shows the effect of the setpoint, or at once if the drone hovered there for the lag before. The setpoint remains until both neighbours are known to be in order: the follower has reported that it is beyond the owner, the owner has announced a fence. A relay sends a position that counts to one neighbour only while it is in order with the other one. | nothing is granted before the order is known, after a start, a reboot or a new link |
//! | 9 | No limit expires with time: the last limit of a neighbour that is replaced or restarts remains until that neighbour sends again, or [`Guard::forget`]. If it was never heard, this relay goes no farther toward it. A new neighbour with a number between the two is linked only once its x is between them, too; toward Rx, one with a number beyond the silent one only once its x is beyond it. | no relay flies into a silent one that still hovers |
//! | 10 | With a fence the owner sends the step that it requests. From a step below the separation until the next one that equals it, neither moves across the line: the owner from its request on, the follower from its reception on. | the follower's reported position across the line remains valid |
//! | 11 | The step is the separation. It becomes smaller when the follower has reported, together with the newest fence, that and where it has arrived across the line, and that it agrees. Then it is the largest of the requested step, of the distance along x that the two positions across the line still require, and of the step by rule 12. The owner announces a larger one only once it is that far before the x it relies on. | the two are the separation apart in space |
//! | 12 | The steps upstream and downstream of a relay add up to at least the separation: it agrees to a smaller step upstream, and takes one downstream, only as far as the sum allows. | relays that are not neighbours are the separation apart along x |
//! | 13 | A relay requests an *open* chain on both sides if it has to change its cross-section and may not by rule 10, or if it started too close to a neighbour whose agreed position is close. Every relay forwards the request. Then all fly to positions in the same order that are the separation apart along x, and steps are the separation. | there is room to change the cross-section |
//! | 14 | From a neighbour that became silent within the separation along x this relay moves away to the separation. Before, it does not change its cross-section, and later it does not come back nearer. The same applies if it never received the neighbour, or had not cleared the first fence. If the neighbour was out of order with it, it holds its position. | the position of the silent relay still counts |
//! | 15 | A relay that is not flown to its setpoints, under its pilot's control or on the ground, has none. It leaves both associations, and repeats this notice until the neighbour has started a new one. When flown again, it begins as after a start. Meanwhile it sends its reported position, which grants nothing. Its neighbour goes no farther toward it than its present setpoint (and by rule 14 away to the separation). If the two were in order, it is otherwise free until it receives a new association, except near the last position sent. Until the neighbour is flown again, linked again or forgotten, it does not pass that position along x nor come nearer to it than the separation, unless the two cross-sections are the separation apart. Within the separation along x it changes its cross-section only away from it. A relay on its way stops where it was reported. | no relay relies on a drone that is flown by hand, and none comes nearer to it or flies through it |
//! | 16 | A relay that is out of order with a neighbour requests a *halt* of the chain. So does a relay that is not in order with both neighbours for three reminders, unless the positions of relays that are not flown show the order. It sends the request to both sides at every reminder, and every relay forwards it, also one that is not flown. A relay that halts on its way stops where it was last reported. A request that is not repeated for 15 reminders expires. | no relay flies into a drone that was flown again, or started, at a wrong position |
//!
//! If the line from Tx to Rx changes ([`Guard::leave_line`]), a relay has no setpoint and begins as after a start, once
//! it has stopped. Messages of a neighbour that uses another line are ignored. This relay relies on the neighbour's
//! earlier messages, and does not move before both neighbours use the new line. Relays that the new line puts out of
//! order hold their positions.
//!
//! # Why the order along x suffices
//!
//! Let all neighbours be in order. A pair of neighbours closer than the separation only moves apart: the owner's
//! setpoint does not rise (rule 4) and the follower's does not fall (rules 1 and 7). From then on the pair stays at
//! least the separation apart. So no gap between neighbours ever falls below the smaller of the separation and the gap
//! at the start. Nor does a sum of gaps, which is the distance along x of any two relays. Until both gaps of a relay
//! are the separation, it does not change its cross-section. So no two relays come nearer in space than the smaller of
//! the separation and their distance at the start, minus the errors of their positions. `cargo test --test guard
//! anywhere` tests it.
//!
//! # Why all relays arrive
//!
//! Let the agreed positions be at least the separation apart; then the final fences are as well. A fence that has to be
//! lowered waits for its owner to fly to a smaller x. That relay waits only for the fence upstream, if that has to be
//! lowered too. The first of them waits for none, so all are lowered one after the other. In the same way all fences
//! that have to be raised are raised, from the receiver's end. Then every relay finds its position between its fences.
//! Fences move along with the flight, so this takes one flight's time and a few messages per relay at worst.
//!
//! If neighbours are to be closer along x, the same is true for the positions in an open chain. So each relay can
//! change its cross-section, and none needs that again before the next agreement. Then the steps take their final
//! values, and all arrive.
//!
//! # Limitations
//!
//! - A deviation of up to [`GuardConfig::hover_m`] from the reported position reduces the separation by as much at
//!   either relay. It does so again each time that one is rebooted before a fence has restored the shortfall.
//!   Deviations of the cross-section count if the two are within the separation along x.
//! - A relay sends nothing before it has both an agreed position and a report; until then no neighbour moves toward it.
//! - The pilot is responsible for a drone in manual control. Its neighbours only come no nearer to the last position
//!   received, which is sent every second while it changes and otherwise every four seconds. Other relays do not know
//!   it, and may fly past it. A drone that is flown again at a wrong position stays there, and the chain halts around
//!   it. For a drone that is just flying past this takes some seconds. A drone that is flown again in motion overshoots
//!   by its autopilot's stopping distance.
//! - A relay may start, or be flown again, beside one that is not flown and has not been received. It then holds its
//!   position until that one is flown or is replaced as a neighbour.
//! - A rebooted relay does not know its earlier neighbours: it has to start with those of the mission, and silent ones have to be
//!   replaced by `set_neighbour`, so that rule 9 applies.
//! - The numbers of the associations are random: `seed` has to differ from one start to the next.

mod association;
pub mod config;
mod follower;
mod link;
mod own;
mod owner;
#[cfg(test)]
pub(crate) mod tests;

use crate::place::Placement;
use crate::side::Side;
use crate::stats::bump;
use crate::time::{Instant, Jitter};

pub use self::association::{Fence, HoldReason};
use association::{Association, KeepOut};
use config::{Geofence, GuardConfig, is_coordinate};
use follower::FenceFollower;
use own::{Own, ReachableInterval};
use owner::FenceOwner;

/// Guard (collision avoidance) of one relay: computes safe setpoints on the way to the agreed position.
///
/// Call [`set_goal`](Self::set_goal), [`position`](Self::position), [`handle_fence`](Self::handle_fence) and [`set_neighbour`](Self::set_neighbour) with new inputs.
/// After each call [`steer`](Self::steer), fly to its result, then send the messages of [`poll`](Self::poll). Every call takes at
/// most some hundred operations and two square roots, independent of the length of the chain.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    own: Own,
    jitter: Jitter,
    started_at: Instant,
    /// Last position reported before there is a setpoint. It becomes the first setpoint. `None` until a position is
    /// reported.
    initial_place: Option<Placement>,
    /// True while the drone flies to this guard's setpoints.
    flown: bool,
    follower: FenceFollower,
    owner: FenceOwner,
    /// True while this relay itself requests a halt of the chain.
    ///
    /// The reason is a neighbour on the wrong side of this relay along x, or an order along x that has been unknown for
    /// several seconds (reminders) in a row.
    disorder: bool,
    /// Number of successive reminders (calls of `remind`, one per second) with an unknown order along x.
    unordered: u8,
    /// Number of successive reminders (one per second) while this relay waits for a message.
    waited: u8,
    /// Quarters of a second that reminders have counted.
    reminders: u8,
    refused: u32,
}

/// Quarters of a second between two messages of a relay that hovers without flying to setpoints.
const UNFLOWN_EVERY: u8 = 16;

/// Number of seconds without the awaited message after which messages are no longer repeated early.
const MAX_EARLY: u8 = 30;

/// Number of seconds after which an unknown order along x halts the chain.
const MAX_UNORDERED: u8 = 3;

impl Guard {
    /// Creates a guard that starts at `now`. `neighbours` are the mission's neighbours toward Tx and toward Rx; `None`
    /// is an end of the chain.
    ///
    /// `config` must be valid ([`GuardConfig::is_valid`]). `seed` must differ from relay to relay and from start to
    /// start.
    pub fn new(config: GuardConfig, neighbours: [Option<u16>; 2], seed: u32, now: Instant) -> Self {
        let [upstream, downstream] = neighbours.map(Option::unwrap_or_default);
        let mut jitter = Jitter::new(seed);
        Self {
            own: Own::new(config, upstream.saturating_add(1), now),
            follower: FenceFollower::new(upstream, &mut jitter),
            owner: FenceOwner::new(downstream, &mut jitter),
            disorder: false,
            unordered: 0,
            waited: 0,
            reminders: 0,
            jitter,
            started_at: now,
            initial_place: None,
            flown: true,
            refused: 0,
        }
    }

    /// Sets the position to fly to, limited to the geofence.
    ///
    /// It is the agreed position, or a point on the way there.
    pub fn set_goal(&mut self, place: Placement) {
        if !is_placement(place) {
            return bump(&mut self.refused);
        }
        self.own.goal = Some(self.own.config.clamp(place));
        self.follower.association.due = true;
        self.owner.association.due = true;
    }

    /// Returns true if `place`, limited to the geofence, equals the current agreed position.
    pub fn is_for(&self, place: Placement) -> bool {
        self.own.goal == Some(self.own.config.clamp(place))
    }

    /// Handles a position report of the flight controller, measured at time `at`.
    ///
    /// The first setpoint is a position reported after the start. It can be outside of the geofence, within
    /// [`BEGIN_WITHIN_M`](config::BEGIN_WITHIN_M) of it.
    pub fn position(&mut self, at: Instant, place: Placement) {
        if !is_placement(place) {
            return bump(&mut self.refused);
        }
        let own = &mut self.own;
        own.reported = Some(place);
        if own.setpoint.is_some() {
            own.reachable.report(at, place.x_m, &own.config);
            own.report(at, place);
        } else if self.flown && at >= self.started_at && own.config.may_begin_at(place) {
            self.initial_place = Some(place);
            own.report_hover(at, place);
        }
    }

    /// Records in `flown` if the drone flies to the relay's setpoints from `now` on; initially true. Returns true if
    /// `flown` has changed.
    ///
    /// While `flown` is false there is no setpoint, and both neighbours are informed that the relay may be anywhere.
    /// When it becomes true again, the relay begins as after a start, with the next reported position.
    pub fn control(&mut self, now: Instant, flown: bool) -> bool {
        if flown == self.flown {
            return false;
        }
        self.flown = flown;
        (self.disorder, self.unordered) = (false, 0);
        (self.started_at, self.initial_place) = (now, None);
        let begun = self.own.setpoint.is_some();
        self.own.release(now);
        if begun {
            self.follower.leave(&mut self.jitter);
            self.owner.leave(&mut self.jitter);
        }
        true
    }

    /// Restarts the guard because the line from Tx to Rx has changed. Earlier positions and messages no longer count.
    ///
    /// The first setpoint is a position measured after `now` and the stopping time of the drone. If `now` is `None`, it
    /// is the next position measured after the guard's start. As after a start, a lost relay toward Tx may hover at any
    /// smaller x than this relay, and a lost relay toward Rx at any larger x.
    pub fn leave_line(&mut self, now: Option<Instant>) {
        if let Some(now) = now {
            self.started_at = self.started_at.max(now + self.own.config.lag);
        }
        self.initial_place = None;
        (self.disorder, self.unordered) = (false, 0);
        self.own.reported = None;
        self.own.goal = None;
        self.own.release(self.started_at);
        self.follower.leave_line(&mut self.jitter);
        self.owner.leave_line(&mut self.jitter);
    }

    /// Changes the geofence. A relay outside the new geofence returns into it with the next setpoint.
    pub fn set_geofence(&mut self, fence: Geofence) {
        self.own.config.geofence = fence;
    }

    /// Records that relay `node` is ordered to leave the chain; 0 for none. The fences (limits of x) on both sides of
    /// that relay then move as near to it as its position permits, so that its neighbours can close up to it.
    pub const fn set_leaver(&mut self, node: u16) {
        self.own.leaver = node;
    }

    #[cfg(all(test, feature = "departures"))]
    pub(crate) const fn leaver(&self) -> u16 {
        self.own.leaver
    }

    /// Handles a message about a fence from node `from`, a neighbour at `side`.
    ///
    /// A message with a value out of range is counted and ignored. A message of an earlier association, or of
    /// a node other than the neighbour, is ignored.
    pub fn handle_fence(&mut self, side: Side, from: u16, fence: &Fence) {
        if !fence.is_valid() {
            return bump(&mut self.refused);
        }
        match side {
            Side::Upstream if self.follower.association.node == from => {
                self.follower
                    .handle_fence(fence, &self.own, &mut self.jitter);
            }
            Side::Downstream if self.owner.association.node == from => {
                self.owner.handle_fence(fence, &self.own, &mut self.jitter);
            }
            _ => {}
        }
    }

    /// Sets the neighbour at `side`; `None` at the end of the chain. No effect if `neighbour` is already set.
    ///
    /// The previous neighbour may still hover. This relay keeps clear of it until [`forget`](Self::forget) is called. A
    /// message of the new neighbour also ends this, if the new neighbour is the previous one again, or is a node
    /// between this relay and the previous one.
    pub fn set_neighbour(&mut self, side: Side, neighbour: Option<u16>) {
        let node = neighbour.unwrap_or(0);
        match side {
            Side::Upstream if self.follower.association.node != node => {
                self.follower.link(node, &self.own, &mut self.jitter);
                self.waited = 0;
            }
            Side::Downstream if self.owner.association.node != node => {
                self.owner.link(node, &self.own, &mut self.jitter);
                self.waited = 0;
            }
            _ => {}
        }
    }

    /// Removes the obstacles of lost relays at `side`. The lost relays have landed or were removed.
    ///
    /// `others` is true if the chain has other relays on this side. If this relay has not received any of these yet, it
    /// does not go beyond its present x toward `side` until it receives one.
    pub fn forget(&mut self, side: Side, others: bool) {
        let ReachableInterval { low_m, high_m, .. } = self.own.reachable;
        let (is_heard, limit_m, keep_out) = match side {
            Side::Upstream => (
                self.follower.has_fence(),
                low_m,
                &mut self.follower.keep_out,
            ),
            Side::Downstream => (self.owner.has_reply(), high_m, &mut self.owner.keep_out),
        };
        keep_out.clear();
        if others && !is_heard {
            keep_out.add_unheard(side, limit_m, self.own.config.separation_m);
        }
    }

    /// Moves the setpoint as far as the neighbours permit, and returns it. `None` until there is an agreed position and
    /// a reported position of the drone.
    ///
    /// `now` is the time at which the autopilot gets the setpoint. At most [`GuardConfig::lag`] later, the drone flies
    /// toward it.
    pub fn steer(&mut self, now: Instant) -> Option<Placement> {
        let target = self.own.goal?;
        let Some(before) = self.own.setpoint else {
            let found = self.initial_place?;
            let hovers = self.own.hovers(now);
            self.own.reachable = ReachableInterval::at(found.x_m, now);
            self.own.reachable.known = hovers;
            let (x_m, apart) = (found.x_m, self.own.config.separation_m);
            self.follower.keep_out.begin(x_m, x_m + apart);
            self.owner.keep_out.begin(x_m, x_m - apart);
            self.own.begin(found, now);
            return self.own.setpoint;
        };
        let low_m = self.owner.low_m(&self.own);
        self.follower.update_clearance(&self.own, low_m);
        self.clear_near();
        let is_ordered = self.is_ordered();
        self.halt(is_ordered, now);
        let before = self.own.setpoint.unwrap_or(before);
        let may_cross =
            self.follower.may_move_across(&self.own) && self.owner.may_move_across(&self.own);
        self.open(may_cross);
        let own = &self.own;
        let kept_m = self.follower.kept_distance();
        let apart = if own.open {
            own.config.separation_m
        } else {
            self.owner.step(own, kept_m)
        };
        let mut least = self.follower.min_x(own);
        let mut most = self.owner.max_x(own, apart);
        if !own.has_agreed_cross_section() {
            // A relay that has to change its lateral offset or altitude first moves away from a neighbour that became
            // silent nearby.
            least = least.max(self.follower.keep_out.near_m());
            most = most.min(self.owner.keep_out.near_m());
        }
        let x_m = own.goal_m().max(least).min(most);
        // Toward a neighbour only as far as that neighbour permits, and back never beyond what was promised to the
        // other one.
        let x_m = x_m.max(least.min(before.x_m)).min(most.max(before.x_m));
        let moves = is_ordered && !own.halted;
        let x_m = if moves { x_m } else { before.x_m };
        let across = if may_cross && moves { target } else { before };
        // A relay outside of the geofence returns as far as its limits permit, and goes no farther out.
        let wanted = across.cross_section().at(x_m);
        let next = own.config.clamp_toward(wanted, before);
        let from = own.path_start(before);
        let next = self.follower.keep_out.path_end(from, next, &own.config);
        let next = self.owner.keep_out.path_end(from, next, &own.config);
        self.own.reachable.extend_to(next.x_m, now);
        self.own.set_setpoint(next, now);
        if self.follower.is_ordered() {
            let upstream_m = self.follower.high_m(&self.own);
            self.owner.schedule_fence(&self.own, kept_m, upstream_m);
        }
        self.own.setpoint
    }

    /// Ends the restrictions due to a close lost neighbour once it is the minimum separation away along x.
    fn clear_near(&mut self) {
        let ReachableInterval { low_m, high_m, .. } = self.own.reachable;
        self.follower
            .keep_out
            .end_near(Side::Upstream, |near_m| low_m >= near_m);
        self.owner
            .keep_out
            .end_near(Side::Downstream, |near_m| high_m <= near_m);
    }

    /// Requests an open chain, if needed: all relays at least the minimum separation apart along x. A request of one
    /// neighbour is forwarded to the other neighbour. `may_cross` is true if both sides permit this relay to change its
    /// lateral offset and altitude.
    fn open(&mut self, may_cross: bool) {
        let own = &mut self.own;
        let is_blocked = !may_cross && !own.has_agreed_cross_section();
        let close = self.follower.is_close(own) || self.owner.is_close(own);
        let tight = close && (self.follower.is_tight() || self.owner.is_tight());
        let needs = tight
            || is_blocked
                && (self.follower.has_reduced_step(own) || self.owner.has_reduced_step(own));
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        own.open = needs || up.open_requested || down.open_requested;
        let (upward, downward) = (needs || down.open_requested, needs || up.open_requested);
        up.forward_open(upward);
        down.forward_open(downward);
    }

    /// Returns true if this relay is known to be between its two neighbours along x, the right order.
    fn is_ordered(&self) -> bool {
        self.follower.is_ordered() && self.owner.is_ordered(&self.own)
    }

    /// Returns true if this relay and its neighbours are known to be in the wrong order along x.
    ///
    /// Either a neighbour is on the wrong side of this relay, or the upstream neighbour is at a larger x than the
    /// downstream one.
    fn is_out_of_order(&self) -> bool {
        let (up, down) = (&self.follower.association, &self.owner.association);
        self.follower.is_out_of_order(&self.own)
            || self.owner.is_out_of_order(&self.own)
            || up.recent_x_m() - down.recent_x_m() > 2.0 * self.own.config.hover_m
    }

    /// Returns true if this relay is seen between its neighbours along x. Fences (limits of x) or reported positions
    /// show this.
    fn is_seen_in_order(&self) -> bool {
        let own = &self.own;
        let seen = |association: &Association, side| association.is_seen_in_order(own, side);
        (self.follower.is_ordered() || seen(&self.follower.association, Side::Upstream))
            && (self.owner.is_ordered(own) || seen(&self.owner.association, Side::Downstream))
    }

    /// Halts this relay while its order along x is unknown (`is_ordered` is false), or on a halt request. Such a
    /// request comes from another relay, or from this relay itself if the order is wrong or stays unknown.
    fn halt(&mut self, is_ordered: bool, now: Instant) {
        self.disorder &= !is_ordered && !self.is_seen_in_order();
        self.disorder |= self.is_out_of_order();
        let halted = self.forward_halt();
        self.own.halt(halted || !is_ordered, now);
    }

    /// Forwards halt requests of this relay and of its neighbours. Returns true if there are any.
    fn forward_halt(&mut self) -> bool {
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        let (upstream, downstream) = (up.has_halt_request(), down.has_halt_request());
        up.forward_halt(self.disorder || downstream);
        down.forward_halt(self.disorder || upstream);
        self.disorder || upstream || downstream
    }

    /// Returns the last setpoint of [`steer`](Self::steer); `None` if there is none yet.
    pub const fn setpoint(&self) -> Option<Placement> {
        self.own.setpoint
    }

    /// Returns the next message to a neighbour, with its side and node number; `None` if none is due.
    pub fn poll(&mut self) -> Option<(Side, u16, Fence)> {
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        for (side, association) in [(Side::Upstream, up), (Side::Downstream, down)] {
            if let Some(fence) = association.poll_leave_notice() {
                return Some((side, association.node, fence));
            }
        }
        if !self.flown || self.own.goal.is_none() || !self.own.reachable.is_known() {
            self.forward_halt();
            let (up, down) = (&mut self.follower.association, &mut self.owner.association);
            let fence_message = [(Side::Upstream, up), (Side::Downstream, down)]
                .into_iter()
                .find_map(|(side, association)| {
                    let fence = association.poll_unpaired(&self.own)?;
                    Some((side, association.node, fence))
                });
            if let Some((_, _, fence)) = &fence_message {
                self.own.sent_place = fence.across.at(fence.x_m);
            }
            return fence_message;
        }
        let own = &self.own;
        let placed = self.owner.is_ordered(own);
        if placed {
            let kept_m = self.follower.kept_distance();
            self.follower
                .agree(own, self.owner.kept_distance(own, kept_m));
        }
        let low_m = self.owner.low_m(own);
        if let Some(fence) = self.follower.poll_fence(own, low_m, placed) {
            return Some((Side::Upstream, self.follower.association.node, fence));
        }
        let moves = self.follower.is_ordered();
        let upstream_m = self.follower.high_m(own);
        let kept_m = self.follower.kept_distance();
        let fence = self.owner.poll_fence(own, kept_m, upstream_m, moves)?;
        Some((Side::Downstream, self.owner.association.node, fence))
    }

    /// Schedules repetitions of all messages that were possibly lost. Returns true if there are any. Call it about
    /// every second.
    pub fn remind(&mut self) -> bool {
        let begun = self.own.setpoint.is_some() && self.own.reachable.is_known();
        self.unordered = if begun && !self.is_ordered() {
            self.unordered.saturating_add(1)
        } else {
            0
        };
        self.disorder |= self.unordered >= MAX_UNORDERED && !self.is_seen_in_order();
        self.waited = if self.awaits() == [false; 2] {
            0
        } else {
            self.waited.saturating_add(1)
        };
        let arrived = self.has_arrived();
        let follower =
            self.follower.association.node != 0 && !(arrived && self.follower.has_fence());
        let owner = self.owner.association.node != 0 && !(arrived && self.owner.is_cleared());
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        self.own.count_reminder();
        // A relay without an association sends its position less often, unless it moves.
        self.reminders = (self.reminders & !3).wrapping_add(4);
        let sends = begun || self.own.has_moved() || self.reminders.is_multiple_of(UNFLOWN_EVERY);
        up.due |= follower && (sends || up.sends_halt());
        down.due |= owner && (sends || down.sends_halt());
        up.count_reminder();
        down.count_reminder();
        let leaves = up.remind() | down.remind();
        follower || owner || leaves
    }

    /// Returns the sides at which this relay waits for a message of its neighbour.
    ///
    /// The message is the first fence of the neighbour toward Tx, or the answer to this relay's newest fence.
    #[inline(never)] // called from several places
    fn awaits(&self) -> [bool; 2] {
        let begun = self.own.setpoint.is_some();
        let (up, down) = (&self.follower.association, &self.owner.association);
        [
            begun && !up.has_no_flown_neighbour() && !self.follower.has_fence(),
            begun && !down.has_no_flown_neighbour() && !self.owner.is_received(),
        ]
    }

    /// Returns true if this relay waits for a message of a neighbour, but not after a long wait.
    pub fn is_waiting(&self) -> bool {
        self.waited < MAX_EARLY && self.awaits() != [false; 2]
    }

    /// Restarts the second that ends with the next [`remind`](Self::remind).
    pub const fn restart_second(&mut self) {
        self.reminders &= !3;
    }

    /// Ends the second: the next early reminder is a [`remind`](Self::remind).
    pub const fn end_second(&mut self) {
        self.reminders |= 3;
    }

    /// Schedules a repetition of the messages to the neighbours for whose messages this relay waits. Call it `times`
    /// times a second, 1 to 4; each last call of a second is a [`remind`](Self::remind).
    pub fn remind_early(&mut self, times: u8) {
        if (self.reminders & 3) + 1 >= times {
            self.remind();
            return;
        }
        self.reminders = self.reminders.wrapping_add(1);
        let [up, down] = self.awaits();
        self.follower.association.due |= up;
        self.owner.association.due |= down;
    }

    /// Returns true if a position report has shown the relay at its agreed position. The setpoint must be the agreed
    /// position, limited to the geofence.
    pub fn has_arrived(&self) -> bool {
        let own = &self.own;
        match (own.goal, own.setpoint) {
            (Some(target), Some(setpoint)) => {
                !(own.open || own.halted)
                    && (target.x_m - setpoint.x_m).abs() <= own.config.rounding()
                    && own.reachable.has_arrived()
                    && own.has_agreed_cross_section()
                    && own.arrived
            }
            _ => false,
        }
    }

    /// Returns true unless the downstream neighbour still has to answer the newest fence. It has to answer
    /// none before its first message, and while it does not fly to setpoints.
    pub fn is_answered(&self) -> bool {
        self.owner.is_answered()
    }

    /// Returns true if the drone hovers at a known position, which can become the first setpoint. Also true if there
    /// already is a setpoint, or if the drone does not fly to setpoints.
    pub fn may_begin(&self, now: Instant) -> bool {
        !self.flown || self.own.setpoint.is_some() || self.own.hovers(now)
    }

    /// Returns true if a position report has shown the relay at its setpoint, where it hovers. The setpoint can differ
    /// from the agreed position. Also true if the drone does not fly to setpoints, and before any report.
    pub fn is_still(&self) -> bool {
        let hovers = self.own.reachable.has_arrived() && self.own.arrived;
        hovers || !self.flown || self.own.reported.is_none()
    }

    /// Returns the reason at `side` why this relay does not fly on to its agreed position.
    ///
    /// `None` without such a reason, or without an agreed position. Shortly after a new agreement the reason may still
    /// refer to the previous positions. While the drone does not fly to setpoints, only [`HoldReason::Order`] is
    /// possible: the drone is on the wrong side of a neighbour that flies to setpoints.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        let (own, (association, _)) = (&self.own, self.at(side));
        if !self.flown {
            let wrong = association.is_on_wrong_side(own, side);
            return wrong.then_some(HoldReason::Order);
        }
        own.goal?;
        let reason = match side {
            Side::Upstream => self.follower.hold_reason(own),
            Side::Downstream => self.owner.hold_reason(own, self.follower.kept_distance()),
        };
        let halted = association.has_halt_request();
        reason
            .or(halted.then_some(HoldReason::Halted))
            .or_else(|| self.pending(side))
    }

    /// Returns true if a lost relay toward `side` may still hover: no operator has reported it as gone.
    pub fn has_lost(&self, side: Side) -> bool {
        let (_, keep_out) = self.at(side);
        keep_out.has_lost()
    }

    /// Returns the association and the obstacles at `side`.
    const fn at(&self, side: Side) -> (&Association, &KeepOut) {
        match side {
            Side::Upstream => (&self.follower.association, &self.follower.keep_out),
            Side::Downstream => (&self.owner.association, &self.owner.keep_out),
        }
    }

    /// Returns the agreed position of the neighbour at `side`; `None` while it is unknown.
    pub fn neighbour_place(&self, side: Side) -> Option<Placement> {
        match side {
            Side::Upstream => self.follower.neighbour_place(),
            Side::Downstream => self.owner.neighbour_place(),
        }
    }

    /// Returns a reason if the setpoint should have moved toward `side`, but has not for five seconds. The reason is
    /// `NotFlown` if the neighbour does not fly to setpoints, otherwise `Pending`.
    fn pending(&self, side: Side) -> Option<HoldReason> {
        let (own, (association, keep_out)) = (&self.own, self.at(side));
        let may_cross = match side {
            Side::Upstream => self.follower.may_move_across(own),
            Side::Downstream => self.owner.may_move_across(own),
        };
        let is_held_up = own.is_held_up(side, may_cross);
        is_held_up.then(|| keep_out.reason(association.node, HoldReason::Pending))
    }

    /// Returns the number of rejected inputs (not a number, or out of range). It saturates.
    pub const fn refused(&self) -> u32 {
        self.refused
    }
}

#[inline(never)] // called from several places
fn is_placement(place: Placement) -> bool {
    is_coordinate(place.x_m) && is_coordinate(place.y_m) && is_coordinate(place.altitude_m)
}
