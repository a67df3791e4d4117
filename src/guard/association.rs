//! Association: the incarnation of the neighbour that a message belongs to.
//!
//! Each side numbers its association with the other one at random, and a message counts only if it has the sender's number and
//! echoes the receiver's. The owner pairs its number with the first number that echoes it; the follower takes a new number
//! whenever it accepts another one of the owner's. So a pair of numbers is used once, and a late message of an earlier
//! association cannot count in a later one.
//! [`Fence`] is the message of an association.

use crate::guard::config::{GuardConfig, is_coordinate};
use crate::guard::own::Own;
use crate::place::{CrossSection, Placement};
use crate::side::Side;
use crate::time::Jitter;

/// Number of consecutive messages of an unknown session that prove a restart of the neighbour. Fewer such messages are
/// possibly late messages of an earlier association.
const MAX_FOREIGN_MESSAGES: u8 = 3;

/// Number of seconds after which a neighbour's halt request expires if it is not repeated.
const HALT_REMINDERS: u8 = 15;

/// Number of seconds after which a neighbour's last reported x expires without a new message.
const SEEN_REMINDERS: u8 = 15;

/// Notice to a neighbour that this relay has left the association with it. This relay leaves the association
/// because its drone no longer flies to setpoints. The notice is repeated until the neighbour starts a new association.
#[derive(Clone, Copy, Debug)]
struct LeaveNotice {
    own_number: u16,
    peer_number: u16,
    due: bool,
}

/// State of the association with the neighbour on one side. The state has the numbers of the session, and
/// the pending messages and requests.
#[expect(
    clippy::struct_excessive_bools,
    reason = "flags of the messages, each for itself"
)]
#[derive(Clone, Copy, Debug)]
pub(super) struct Association {
    /// Node number of the neighbour in this association; 0 if there is no neighbour.
    pub(super) node: u16,
    /// Random number by which this relay identifies the association with the neighbour.
    pub(super) own_number: u16,
    /// Number by which the neighbour identifies this association; 0 until it is known.
    pub(super) peer_number: u16,
    /// Number of consecutive messages of the neighbour that belong to no current association.
    foreign_messages: u8,
    /// True if a message about the fence to the neighbour is due.
    pub(super) due: bool,
    /// True while the neighbour requests an open chain. In an open chain all relays are at least the minimum separation
    /// apart along x.
    pub(super) open_requested: bool,
    /// True while the messages to the neighbour request an open chain. In an open chain all relays are at least the
    /// minimum separation apart along x.
    open_sent: bool,
    /// Number of seconds (reminders) until the neighbour's halt request expires. 0 without a halt request.
    halt_reminders_left: u8,
    /// True while the messages to the neighbour request that the chain halts.
    halt_sent: bool,
    /// Number of the association that the neighbour has left; 0 if it has left none. A neighbour that has
    /// left counts as absent, because its drone does not fly to setpoints.
    left_number: u16,
    /// Notice to the neighbour that this relay has left an association with it. `None` if the neighbour
    /// needs no notice.
    leave_notice: Option<LeaveNotice>,
    /// Last x received from the neighbour, m, in any association; NaN if none has been received.
    seen_m: f32,
    /// Number of seconds (reminders) until the neighbour's last x expires.
    seen_reminders_left: u8,
}

impl Association {
    #[inline(never)] // called from several places
    pub(super) const fn new(node: u16, jitter: &mut Jitter) -> Self {
        Self {
            node,
            own_number: jitter.number(),
            peer_number: 0,
            foreign_messages: 0,
            due: true,
            open_requested: false,
            open_sent: false,
            halt_reminders_left: 0,
            halt_sent: false,
            left_number: 0,
            leave_notice: None,
            seen_m: f32::NAN,
            seen_reminders_left: 0,
        }
    }

    /// Returns true if there is no neighbour on this side that flies to its setpoints. Either the chain ends here, or
    /// the neighbour's drone is in manual control or on the ground.
    pub(super) const fn has_no_flown_neighbour(&self) -> bool {
        self.node == 0 || self.is_absent()
    }

    /// Stores the neighbour's x from a message, `x_m`. This x expires after 15 s without another message.
    pub(super) const fn record_x(&mut self, x_m: f32) {
        (self.seen_m, self.seen_reminders_left) = (x_m, SEEN_REMINDERS);
    }

    /// Returns the distance along x from this relay to the neighbour at `side`, m. It is negative if the two are in the
    /// wrong order. The distance is computed from the last reported x of both relays. NaN if one of these is unknown,
    /// or if that of the neighbour has expired.
    fn beyond_m(&self, own: &Own, side: Side) -> f32 {
        let x_m = own.reported.map_or(f32::NAN, |place| place.x_m);
        match side {
            _ if self.seen_reminders_left == 0 => f32::NAN,
            Side::Upstream => x_m - self.seen_m,
            Side::Downstream => self.seen_m - x_m,
        }
    }

    /// Returns the neighbour's last reported x, m; NaN if it is unknown or expired.
    pub(super) const fn recent_x_m(&self) -> f32 {
        if self.seen_reminders_left == 0 {
            f32::NAN
        } else {
            self.seen_m
        }
    }

    /// Returns true if the last reported x of this relay and of the neighbour are in the wrong order. They must differ
    /// by more than the position errors of both relays, 2 `hover_m`.
    pub(super) fn is_on_wrong_side(&self, own: &Own, side: Side) -> bool {
        self.beyond_m(own, side) < -2.0 * own.config.hover_m
    }

    /// Returns true if the last reported x of this relay and of the neighbour are in the right order. They must differ
    /// by at least the position errors of both relays, 2 `hover_m`.
    pub(super) fn is_seen_in_order(&self, own: &Own, side: Side) -> bool {
        self.beyond_m(own, side) >= 2.0 * own.config.hover_m
    }

    /// Handles the parts of a message that concern no fence. Returns false if it belongs to an association that this
    /// relay or the neighbour has left. `is_placed` is true if its position counts, `has_x` if it has the sender's x.
    #[inline(never)] // called from both sides
    pub(super) fn receive(
        &mut self,
        keep_out: &mut KeepOut,
        fence: &Fence,
        is_placed: bool,
        has_x: bool,
    ) -> bool {
        self.receive_halt(fence, is_placed);
        keep_out.record_x(self, fence);
        if has_x {
            self.record_x(fence.x_m);
        }
        if self.is_of_left_association(fence) || fence.has_flag(Fence::LEFT) {
            return false;
        }
        keep_out.remove_unflown();
        true
    }

    /// Returns the reason why the neighbour at `side`, without an association, stops this relay.
    ///
    /// It is `Lost` if the neighbour is not linked because of a lost drone in `keep_out`, otherwise `Unheard`.
    pub(super) fn unpaired_reason(&self, side: Side, keep_out: &KeepOut, own: &Own) -> HoldReason {
        if keep_out.bars(side, self.node, self.recent_x_m(), &own.config) {
            HoldReason::Lost
        } else {
            HoldReason::Unheard
        }
    }

    /// Returns the last x that the neighbour has sent, m; NaN if it has sent none.
    pub(super) const fn last_x_m(&self) -> f32 {
        self.seen_m
    }

    pub(super) const fn is_absent(&self) -> bool {
        self.left_number != 0
    }

    /// Marks the neighbour as absent: it has left the association with the number `association`. An absent
    /// neighbour may be anywhere.
    pub(super) const fn mark_absent(&mut self, association: u16) {
        self.left_number = association;
    }

    /// Accepts the number that the neighbour has given to the association with this relay. If the neighbour
    /// had left, it counts as present again.
    pub(super) const fn pair(&mut self, association: u16) {
        self.peer_number = association;
        self.left_number = 0;
    }

    /// Returns true if the message `fence` states that the neighbour has left the current association. Later
    /// repetitions of the message do not count, because this relay then has a new association.
    pub(super) const fn is_leave_notice(&self, fence: &Fence) -> bool {
        fence.has_flag(Fence::LEFT) && fence.echo == self.own_number
    }

    /// Returns a new association with the same neighbour, after this relay has left `self`. If the neighbour
    /// has sent a number for `self`, it still relies on `self`. The new association then includes a leave notice.
    pub(super) fn leave(&self, jitter: &mut Jitter) -> Self {
        let left = LeaveNotice {
            own_number: self.own_number,
            peer_number: self.peer_number,
            due: true,
        };
        Self {
            leave_notice: if self.peer_number == 0 {
                self.leave_notice
            } else {
                Some(left)
            },
            ..Self::new(self.node, jitter)
        }
    }

    /// Returns a new association with the same neighbour. A pending leave notice is kept.
    pub(super) fn renew(&self, jitter: &mut Jitter) -> Self {
        Self {
            leave_notice: self.leave_notice,
            ..Self::new(self.node, jitter)
        }
    }

    /// Returns true if `fence` belongs to an association that this relay or its neighbour left. If the
    /// neighbour still uses an association that this relay has left, the leave notice is repeated.
    pub(super) fn is_of_left_association(&mut self, fence: &Fence) -> bool {
        if let Some(leave_notice) = &mut self.leave_notice {
            let left = fence.association == leave_notice.peer_number;
            let is_new = fence.echo == 0 || fence.echo == self.own_number;
            if left && fence.has_flag(Fence::LEFT) || !left && is_new {
                self.leave_notice = None;
            } else {
                // The neighbour still relies on that association, or on an earlier one.
                leave_notice.peer_number = fence.association;
                leave_notice.due = true;
            }
            if left || !is_new {
                return true;
            }
        }
        fence.association == self.left_number
    }

    /// Schedules a repetition of a pending leave notice; returns true if a notice is pending.
    pub(super) const fn remind(&mut self) -> bool {
        if let Some(leave_notice) = &mut self.leave_notice {
            leave_notice.due = true;
        }
        self.leave_notice.is_some()
    }

    /// Returns the notice that this relay has left the association with its neighbour. `None` if no notice
    /// must be sent.
    pub(super) fn poll_leave_notice(&mut self) -> Option<Fence> {
        let leave_notice = self.leave_notice.as_mut()?;
        core::mem::take(&mut leave_notice.due).then(|| Fence {
            flags: Fence::LEFT,
            ..Fence::without_position(leave_notice.own_number, leave_notice.peer_number)
        })
    }

    pub(super) const fn is_current(&mut self, association: u16, echo: u16) -> bool {
        let known = association == self.peer_number && echo == self.own_number;
        if known {
            self.foreign_messages = 0;
        }
        known
    }

    /// Returns a message to the neighbour about the fence. The caller fills
    /// in the fence's number, its x, and the upstream relay's distance from it. These are 0 in the result.
    pub(super) fn fence(&self, own: &Own) -> Fence {
        Fence {
            association: self.own_number,
            echo: self.peer_number,
            number: 0,
            x_m: 0.0,
            target_m: own.target_m(),
            across: own.cross_section(),
            apart_m: 0.0,
            flags: u8::from(own.arrived) * Fence::ARRIVED
                + u8::from(self.open_sent) * Fence::REQUESTS_OPENING
                + u8::from(self.open_requested) * Fence::OPENING_RECEIVED
                + u8::from(self.halt_sent) * Fence::HALTS,
        }
    }

    /// Records if the neighbour's message `fence` requests an open chain. In an open chain all relays are at least the
    /// minimum separation apart along x. A reply is due if the message shows that the neighbour has missed this relay's
    /// own last request for an open chain, or the withdrawal of this request.
    pub(super) const fn receive_open(&mut self, fence: &Fence) {
        self.open_requested = fence.has_flag(Fence::REQUESTS_OPENING);
        self.due |= fence.has_flag(Fence::OPENING_RECEIVED) != self.open_sent;
    }

    /// Requests an open chain from the neighbour if `opens` is true, or else withdraws the request. In an open chain
    /// all relays are at least the minimum separation apart along x. After a change a message must be sent.
    pub(super) const fn forward_open(&mut self, opens: bool) {
        self.due |= self.open_sent != opens;
        self.open_sent = opens;
    }

    /// Records if the neighbour's message `fence` requests a halt. A message without a halt request ends an earlier
    /// halt request, but only if its position is valid (`is_placed`). A rebooted neighbour has no valid position at
    /// first, and does not know its earlier request.
    pub(super) const fn receive_halt(&mut self, fence: &Fence, is_placed: bool) {
        if fence.has_flag(Fence::HALTS) {
            self.halt_reminders_left = HALT_REMINDERS;
        } else if is_placed {
            self.halt_reminders_left = 0;
        }
    }

    pub(super) const fn has_halt_request(&self) -> bool {
        self.halt_reminders_left > 0
    }

    /// Requests a halt of the chain from the neighbour if `halts` is true, or else withdraws the request. After a
    /// change a message must be sent.
    pub(super) const fn forward_halt(&mut self, halts: bool) {
        self.due |= self.halt_sent != halts;
        self.halt_sent = halts;
    }

    pub(super) const fn sends_halt(&self) -> bool {
        self.halt_sent
    }

    /// Counts one reminder; reminders are due every second. The neighbour's halt request and its last x expire after 15
    /// reminders without a new message.
    pub(super) const fn count_reminder(&mut self) {
        self.halt_reminders_left = self.halt_reminders_left.saturating_sub(1);
        self.seen_reminders_left = self.seen_reminders_left.saturating_sub(1);
    }

    /// Returns the pending message of this relay, if it does not fly to setpoints or has just started. `None` if no
    /// message is pending.
    ///
    /// The message contains the relay's reported position, and a halt request if one must be forwarded. The message is
    /// valid without an association.
    pub(super) fn poll_unpaired(&mut self, own: &Own) -> Option<Fence> {
        let is_due = self.due && self.node != 0 && self.leave_notice.is_none();
        let place = own.reported.filter(|_| is_due)?;
        self.due = false;
        Some(Fence {
            x_m: place.x_m,
            across: place.cross_section(),
            flags: Fence::LEFT | Fence::UNPLACED | (u8::from(self.halt_sent) * Fence::HALTS),
            ..Fence::without_position(self.own_number, 0)
        })
    }

    /// Counts a message that does not belong to this association. Returns true once [`MAX_FOREIGN_MESSAGES`]
    /// such messages were received in a row: the neighbour must have restarted.
    pub(super) const fn count_foreign(&mut self) -> bool {
        self.foreign_messages = self.foreign_messages.saturating_add(1);
        self.foreign_messages >= MAX_FOREIGN_MESSAGES
    }
}

/// Obstacles that limit this relay's x on one side. An obstacle is a lost relay that may still hover, or a drone that
/// does not fly to setpoints.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeepOut {
    /// Nearest lost node on this side; no meaning if no node is lost.
    lost: u16,
    /// Limit of this relay's x due to all lost nodes on this side, m. NaN if no node is lost.
    limit_m: f32,
    /// Nearest lost node whose last x had a known limit; no meaning without such a node.
    known: u16,
    /// Limit of the x of the node `known`, m: its drone is there or farther away. NaN without such a node.
    known_m: f32,
    /// x at which this relay is at least the minimum separation away from a lost relay, m. NaN if this relay already
    /// is. Until it is there, possibly only lateral offset and altitude keep the two relays apart.
    near_m: f32,
    /// True while a lost relay may be on the wrong side of this relay along x.
    disordered: bool,
    /// Node number and last reported position of a neighbour whose drone does not fly to setpoints. `None` without
    /// such a neighbour.
    unflown: Option<(u16, Placement)>,
}

impl KeepOut {
    pub(super) const fn none() -> Self {
        Self {
            lost: 0,
            limit_m: f32::NAN,
            known: 0,
            known_m: f32::NAN,
            near_m: f32::NAN,
            disordered: false,
            unflown: None,
        }
    }

    /// Returns the limit of this relay's x due to lost relays, m. NaN if no relay is lost.
    pub(super) const fn limit_m(&self) -> f32 {
        self.limit_m
    }

    /// Returns true if a lost relay is an obstacle.
    pub(super) const fn has_lost(&self) -> bool {
        !self.limit_m.is_nan()
    }

    /// Returns true if `node` is nearer than the node `other` at `side`.
    const fn is_nearer(side: Side, node: u16, other: u16) -> bool {
        match side {
            Side::Upstream => node > other,
            Side::Downstream => node < other,
        }
    }

    /// Adds a lost relay at `side` as an obstacle. The lost relay has the number `node`, and limits this relay's x to
    /// `limit_m`, m. If there already is a lost relay, the nearer node and the tighter limit are kept.
    #[inline(never)] // called from both sides
    pub(super) fn add_lost(&mut self, side: Side, node: u16, limit_m: f32) {
        if !self.has_lost() || Self::is_nearer(side, node, self.lost) {
            self.lost = node;
        }
        self.limit_m = match side {
            Side::Upstream => self.limit_m.max(limit_m),
            Side::Downstream => self.limit_m.min(limit_m),
        };
    }

    /// Records that the drone of the lost relay `node` at `side` is at the x `x_m` or farther away. If there already is
    /// such a record, that of the nearer node is kept.
    pub(super) const fn record_lost_x(&mut self, side: Side, node: u16, x_m: f32) {
        if self.known_m.is_nan() || Self::is_nearer(side, node, self.known) {
            (self.known, self.known_m) = (node, x_m);
        }
    }

    /// Returns true if the new neighbour `node` at `x_m` is on the wrong side of a lost drone along x.
    ///
    /// If the number of `node` is between the numbers of this relay and of the lost drone, its x has to be between the
    /// x of these two, except for position errors. The new neighbour knows nothing of the lost drone. Toward Rx, if its
    /// number is beyond that of the lost drone, its x has to be beyond the drone's x, too. Toward Tx this is not
    /// checked: a drone on its way may be beyond its agreed position, and its regular neighbour, too.
    pub(super) fn bars(&self, side: Side, node: u16, x_m: f32, config: &GuardConfig) -> bool {
        let beyond_m = match side {
            Side::Upstream => self.known_m - x_m,
            Side::Downstream => x_m - self.known_m,
        };
        let off_m = 2.0 * config.hover_m + config.rounding();
        if Self::is_nearer(side, node, self.known) {
            beyond_m > off_m
        } else {
            // Relays in order may be reported in the wrong order by twice the error.
            side == Side::Downstream && node != self.known && beyond_m < -2.0 * off_m
        }
    }

    /// Removes obstacles on `side` after a message from `node`: the node itself, and all nodes beyond it. These are no
    /// obstacles, because `node` is between them and this relay. An obstacle is a lost relay, or a drone that does not
    /// fly to setpoints.
    pub(super) fn on_fence(&mut self, side: Side, node: u16) {
        let is_beyond = |lost: u16| match side {
            Side::Upstream => lost <= node,
            Side::Downstream => lost >= node,
        };
        if self.has_lost() && is_beyond(self.lost) {
            self.clear();
        }
        if is_beyond(self.known) {
            self.known_m = f32::NAN;
        }
        if self.unflown.is_some_and(|(unflown, _)| is_beyond(unflown)) {
            self.unflown = None;
        }
    }

    /// Stores the position of a neighbour that reports that its drone does not fly to setpoints. A report that belongs
    /// to the current association is ignored: it is late, because the drone flies to setpoints again.
    pub(super) fn record_x(&mut self, association: &Association, fence: &Fence) {
        let is_late = fence.association == association.peer_number;
        if fence.has_flag(Fence::LEFT) && fence.has_flag(Fence::UNPLACED) && !is_late {
            self.unflown = Some((association.node, fence.across.at(fence.x_m)));
        }
    }

    /// Removes the neighbour's drone as an obstacle, because it flies to its setpoints again.
    pub(super) const fn remove_unflown(&mut self) {
        self.unflown = None;
    }

    /// Returns the obstacles to keep when the line from Tx to Rx changes: the lost relays. A drone that does not fly to
    /// setpoints is not kept, and no last x of a lost relay, because the x along the new line are unknown.
    pub(super) const fn leave_line(mut self) -> Self {
        self.unflown = None;
        self.known_m = f32::NAN;
        self
    }

    /// Returns `HoldReason::NotFlown` if the neighbour `node` does not follow setpoints, else `otherwise`.
    pub(super) fn reason(&self, node: u16, otherwise: HoldReason) -> HoldReason {
        if self.unflown.is_some_and(|(unflown, _)| unflown == node) {
            HoldReason::NotFlown
        } else {
            otherwise
        }
    }

    /// Returns the reason why an obstacle at `side`, where `node` is the neighbour, stops this relay.
    #[inline(never)] // called from both sides
    pub(super) fn obstacle(&self, side: Side, node: u16, own: &Own) -> Option<HoldReason> {
        if self.is_disordered() {
            return Some(HoldReason::Order);
        }
        let is_limited = match side {
            Side::Upstream => own.target_m() < self.limit_m,
            Side::Downstream => own.target_m() > self.limit_m,
        };
        let stays = self.is_near() && !own.has_agreed_cross_section();
        let is_stopped = stays || is_limited || self.blocks(own);
        is_stopped.then(|| self.reason(node, HoldReason::Lost))
    }

    /// Returns true if a drone not flying to setpoints blocks this relay's way to its agreed position. The way begins
    /// at the relay's setpoint.
    pub(super) fn blocks(&self, own: &Own) -> bool {
        let ways = own.setpoint.zip(own.goal);
        ways.is_some_and(|(from, to)| self.path_end(from, to, &own.config) != to)
    }

    /// Returns the end of the path `from` to `to` near a neighbour's drone that does not fly to setpoints.
    ///
    /// Along x the path ends at the minimum separation from the drone, or at `from` if `from` is closer. It does not
    /// end there if lateral offset and altitude keep the separation. Closer than the separation along x, lateral offset
    /// and altitude change only if this leads away from the drone.
    pub(super) fn path_end(
        &self,
        from: Placement,
        to: Placement,
        config: &GuardConfig,
    ) -> Placement {
        let Some((_, drone)) = self.unflown else {
            return to;
        };
        let (separation_m, across) = (config.separation_m, drone.cross_section());
        let is_passed = |place: Placement| {
            place.cross_section().apart_squared(across) >= separation_m * separation_m
        };
        if is_passed(from) && is_passed(to) && from.cross_section() == to.cross_section() {
            return to;
        }
        let x_m = if from.x_m >= drone.x_m {
            to.x_m.max(from.x_m.min(drone.x_m + separation_m))
        } else {
            to.x_m.min(from.x_m.max(drone.x_m - separation_m))
        };
        let away = (from.y_m - drone.y_m) * (to.y_m - from.y_m)
            + (from.altitude_m - drone.altitude_m) * (to.altitude_m - from.altitude_m);
        let nearest_m = (from.x_m - drone.x_m).abs().min((x_m - drone.x_m).abs());
        let turns = nearest_m >= separation_m || away >= 0.0;
        if turns { to } else { from }.cross_section().at(x_m)
    }

    /// Sets the limit of this relay's x due to lost relays to `x_m`, the x of this relay's first setpoint.
    ///
    /// No effect without a lost relay. The lost relays may hover anywhere beyond `x_m`. At x = `near_m` this relay is
    /// the minimum separation away from all of them.
    pub(super) fn begin(&mut self, x_m: f32, near_m: f32) {
        if self.has_lost() {
            (self.limit_m, self.near_m) = (x_m, near_m);
        }
    }

    /// Records that the most recently lost relay may be closer than the minimum separation. This state ends when this
    /// relay is at x = `near_m`.
    pub(super) const fn mark_near(&mut self, near_m: f32) {
        self.near_m = near_m;
    }

    /// Returns the x, m, at which this relay is the minimum separation away from the last lost relay. NaN if this relay
    /// already is at least the minimum separation away.
    pub(super) const fn near_m(&self) -> f32 {
        self.near_m
    }

    /// Returns true while the most recently lost relay may be closer than the minimum separation.
    pub(super) const fn is_near(&self) -> bool {
        !self.near_m.is_nan()
    }

    /// Ends the state [`is_near`](Self::is_near) once this relay is far enough from the lost relay. This is so at x =
    /// `near_m`. `is_beyond` returns true if this relay is at the x in its argument, or farther from the lost relay.
    pub(super) fn end_near(&mut self, side: Side, is_beyond: impl Fn(f32) -> bool) {
        if is_beyond(self.near_m) {
            self.limit_m = match side {
                Side::Upstream => self.limit_m.max(self.near_m),
                Side::Downstream => self.limit_m.min(self.near_m),
            };
            self.near_m = f32::NAN;
        }
    }

    /// Records that a lost relay may be on the wrong side of this relay along x.
    pub(super) const fn mark_disordered(&mut self) {
        self.disordered = true;
    }

    /// Returns true while a lost relay may be on the wrong side of this relay along x. It is then unknown in which
    /// direction a move along x leads away from the lost relay.
    pub(super) const fn is_disordered(&self) -> bool {
        self.disordered
    }

    pub(super) const fn clear(&mut self) {
        *self = Self::none();
    }

    /// Adds an obstacle: the relays at `side`, if none of them has ever sent a message to this relay. These relays may
    /// hover anywhere beyond the plane x = `limit_m`. This relay keeps at least `separation_m` away from that plane,
    /// until one of the relays sends a message.
    pub(super) fn add_unheard(&mut self, side: Side, limit_m: f32, separation_m: f32) {
        let (nearest, near_m) = match side {
            Side::Upstream => (0, limit_m + separation_m),
            Side::Downstream => (u16::MAX, limit_m - separation_m),
        };
        (self.lost, self.limit_m, self.near_m) = (nearest, limit_m, near_m);
    }
}

/// Message between neighbours about their fence, a plane x = constant that separates the two.
///
/// Each message contains the complete state. So a message may be lost, duplicated, delayed or reordered.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fence {
    /// Number that the sender gave to its association with this neighbour, never 0.
    pub association: u16,
    /// Number that the destination last sent for its association with the sender, 0 for none.
    pub echo: u16,
    /// Number of the fence, the plane x = constant between the two relays; 0 if there is no fence yet. The relay
    /// upstream (owner) counts its fences. The relay downstream (follower) repeats the newest number received.
    pub number: u16,
    /// Limit of x that the sender states, m, -1e7 to 1e7. The relay toward Tx states the x of its newest fence, or its
    /// own highest possible x before the first fence. The relay toward Rx states its lowest possible x.
    pub x_m: f32,
    /// x of the position that the sender flies to, m: -1e7 to 1e7. It is the agreed position, or a point on the way
    /// there.
    pub target_m: f32,
    /// Lateral offset and altitude of the sender's setpoint, m, each -1e7 to 1e7. If the sender does not follow
    /// setpoints, this is the lateral offset and altitude of its reported position.
    pub across: CrossSection,
    /// Distance along x that the upstream relay wants to keep from its newest fence, m, 0 to 1e5. While it is below the
    /// minimum separation, the downstream relay must not change its lateral offset or altitude.
    pub apart_m: f32,
    /// Sum of the flags [`ARRIVED`](Self::ARRIVED) to [`UNPLACED`](Self::UNPLACED) that are set.
    pub flags: u8,
}

impl Fence {
    /// Flag: the sender has arrived at the lateral offset and altitude of its setpoint.
    pub const ARRIVED: u8 = 1;
    /// Flag of the downstream relay: it agrees to the distance `apart_m` from the newest fence.
    pub const AGREES: u8 = 2;
    /// Flag: request for an open chain: all relays at least the minimum separation apart along x. The sender, or a
    /// relay farther away, needs the open chain to change its lateral offset or altitude.
    pub const REQUESTS_OPENING: u8 = 4;
    /// Flag: acknowledges [`REQUESTS_OPENING`](Self::REQUESTS_OPENING). The sender copies the flag `REQUESTS_OPENING`
    /// of the last message received from the destination to this flag.
    pub const OPENING_RECEIVED: u8 = 8;
    /// Flag: the sender has left this association. The sender's drone does not fly to its setpoints, or did
    /// not do so for a time. The fence number is not valid. The position is valid only if the flag
    /// [`UNPLACED`](Self::UNPLACED) is set, too.
    pub const LEFT: u8 = 16;
    /// Flag: request to halt the chain, so that all relays hold their positions. The sender, or a relay farther away,
    /// is on the wrong side of a neighbour along x, or does not know its order with a neighbour. The request is
    /// repeated every second, and is valid in any association.
    pub const HALTS: u8 = 32;
    /// Flag: the position in this message shows the order of the two relays along x. It permits the receiver no move.
    /// The relay downstream sets the flag while its order with its own downstream neighbour is not confirmed. With
    /// [`LEFT`](Self::LEFT): the sender does not fly to setpoints, and `x_m` is its last reported x.
    pub const UNPLACED: u8 = 64;

    pub(super) const fn without_position(association: u16, echo: u16) -> Self {
        Self {
            association,
            echo,
            number: 0,
            x_m: 0.0,
            target_m: 0.0,
            across: CrossSection::on_line(0.0),
            apart_m: 0.0,
            flags: 0,
        }
    }

    pub(super) const fn has_flag(&self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// Returns true if all numbers of the message are within their ranges.
    pub fn is_valid(&self) -> bool {
        let CrossSection { y_m, altitude_m } = self.across;
        let places = [self.x_m, self.target_m, y_m, altitude_m];
        self.association != 0
            && places.into_iter().all(is_coordinate)
            && (0.0..=1e5).contains(&self.apart_m)
            && self.flags < 2 * Self::UNPLACED
    }
}

/// Reason that keeps a relay's setpoint from its agreed position.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HoldReason {
    /// Messages have not confirmed yet that this relay and the neighbour are in order along x.
    Unheard,
    /// The neighbour is on the wrong side of this relay along x, or so close that the order is unknown. Neither relay
    /// moves.
    Order,
    /// The agreed positions of this relay and the neighbour are too close. Neither their x nor their lateral offsets
    /// and altitudes separate them.
    Close,
    /// A lost relay may still hover between this relay and its agreed position.
    Lost,
    /// The neighbour's drone does not fly to setpoints. It is in the way, or does not move out of the way.
    NotFlown,
    /// The setpoint has not moved for at least five seconds: the neighbour has not moved out of the way.
    Pending,
    /// The chain halts, because a relay is, or may be, on the wrong side of a neighbour.
    Halted,
}
