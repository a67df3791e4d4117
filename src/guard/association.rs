//! Association: the incarnation of the neighbour that a message belongs to.
//!
//! Each side numbers its association with the other one at random, and a message counts only if it has the sender's number and
//! echoes the receiver's. The owner pairs its number with the first number that echoes it; the follower takes a new number
//! whenever it accepts another one of the owner's. So a pair of numbers is used once, and a late message of an earlier
//! association cannot count in a later one.
//! [`Fence`] is the message of an association.

use crate::guard::config::{GuardConfig, is_place};
use crate::guard::own::Own;
use crate::place::{CrossSection, Placement};
use crate::side::Side;
use crate::time::Jitter;

/// Number of consecutive messages of another association that prove a new one. Fewer may be late ones.
const STRAYS: u8 = 3;

/// Number of reminders, one per second, after which a halt request expires unless it is repeated.
const HALT_REMINDERS: u8 = 15;

/// Number of one-second reminders after which a neighbour's last x expires, unless it sends again.
const SEEN_REMINDERS: u8 = 15;

/// Association that this relay has left, until the neighbour starts a new one.
#[derive(Clone, Copy, Debug)]
struct LeaveNotice {
    own: u16,
    heard: u16,
    due: bool,
}

/// Association with the neighbour on one side.
#[expect(
    clippy::struct_excessive_bools,
    reason = "flags of the messages, each for itself"
)]
#[derive(Clone, Copy, Debug)]
pub(super) struct Association {
    /// Node number of the neighbour, 0 for none.
    pub(super) node: u16,
    /// Number of this relay's association.
    pub(super) own: u16,
    /// Number of the neighbour's association, paired with `own`; 0 for none.
    pub(super) heard: u16,
    /// Number of consecutive messages that belong to another association.
    strays: u8,
    /// True if a message is pending.
    pub(super) due: bool,
    /// True if the neighbour has forwarded a request to open the chain.
    pub(super) opens: bool,
    /// Value of that request in the last message to the neighbour.
    open_sent: bool,
    /// Reminders until the neighbour's halt request expires, 0 for none.
    halt_reminders_left: u8,
    /// True while a halt request is sent to the neighbour.
    halt_sent: bool,
    /// Number of the association that the neighbour has left, 0 for none. A neighbour that has left one is absent: its drone does
    /// not follow setpoints.
    absent: u16,
    /// Pending notice of the association that this relay has left.
    leave_notice: Option<LeaveNotice>,
    /// Last x received from the neighbour, in any association, m; NaN before the first.
    seen_m: f32,
    /// Reminders until that x expires.
    seen_reminders_left: u8,
}

impl Association {
    #[inline(never)] // called from several places
    pub(super) const fn new(node: u16, jitter: &mut Jitter) -> Self {
        Self {
            node,
            own: jitter.number(),
            heard: 0,
            strays: 0,
            due: true,
            opens: false,
            open_sent: false,
            halt_reminders_left: 0,
            halt_sent: false,
            absent: 0,
            leave_notice: None,
            seen_m: f32::NAN,
            seen_reminders_left: 0,
        }
    }

    /// Returns true if there is no flown neighbour: the chain ends here, or the neighbour is absent.
    pub(super) const fn has_no_flown_neighbour(&self) -> bool {
        self.node == 0 || self.is_absent()
    }

    /// Stores the x of a neighbour's message.
    pub(super) const fn record_x(&mut self, x_m: f32) {
        (self.seen_m, self.seen_reminders_left) = (x_m, SEEN_REMINDERS);
    }

    /// Returns the distance of this relay on its own side of the neighbour's last x, m; NaN if unknown.
    fn beyond_m(&self, own: &Own, side: Side) -> f32 {
        let x_m = own.reported.map_or(f32::NAN, |place| place.x_m);
        match side {
            _ if self.seen_reminders_left == 0 => f32::NAN,
            Side::Upstream => x_m - self.seen_m,
            Side::Downstream => self.seen_m - x_m,
        }
    }

    /// Returns the neighbour's last x, m; NaN if it is unknown or expired.
    pub(super) const fn seen_m(&self) -> f32 {
        if self.seen_reminders_left == 0 {
            f32::NAN
        } else {
            self.seen_m
        }
    }

    /// Returns true if this relay's reported x is on the wrong side of the neighbour's last x.
    pub(super) fn is_passed(&self, own: &Own, side: Side) -> bool {
        self.beyond_m(own, side) < -2.0 * own.config.hover_m
    }

    /// Returns true if this relay's reported x is on its own side of the neighbour's last x.
    pub(super) fn is_seen_in_order(&self, own: &Own, side: Side) -> bool {
        self.beyond_m(own, side) >= 2.0 * own.config.hover_m
    }

    pub(super) const fn is_absent(&self) -> bool {
        self.absent != 0
    }

    /// Marks the neighbour as absent: it has left the association of that number, and may be anywhere.
    pub(super) const fn mark_absent(&mut self, association: u16) {
        self.absent = association;
    }

    /// Accepts the neighbour's association number; an absent neighbour is back.
    pub(super) const fn pair(&mut self, association: u16) {
        self.heard = association;
        self.absent = 0;
    }

    /// Returns true if a message states that the neighbour has left this association. The echoed number is not used again, so a
    /// repetition of the message belongs to an earlier association.
    pub(super) const fn is_leave_notice(&self, fence: &Fence) -> bool {
        fence.has_flag(Fence::LEFT) && fence.echo == self.own
    }

    /// Returns the next association after this relay has left this one. It has a notice if the neighbour relies on this one.
    pub(super) fn leave(&self, jitter: &mut Jitter) -> Self {
        let left = LeaveNotice {
            own: self.own,
            heard: self.heard,
            due: true,
        };
        Self {
            leave_notice: if self.heard == 0 {
                self.leave_notice
            } else {
                Some(left)
            },
            ..Self::new(self.node, jitter)
        }
    }

    /// Returns the next association; a pending notice of an earlier one is kept.
    pub(super) fn renew(&self, jitter: &mut Jitter) -> Self {
        Self {
            leave_notice: self.leave_notice,
            ..Self::new(self.node, jitter)
        }
    }

    /// Returns true if a message belongs to an association that this relay, or the neighbour, has left. The notice is repeated
    /// until the neighbour starts a new association.
    pub(super) fn is_of_left_association(&mut self, fence: &Fence) -> bool {
        if let Some(leave_notice) = &mut self.leave_notice {
            let left = fence.association == leave_notice.heard;
            let is_new = fence.echo == 0 || fence.echo == self.own;
            if left && fence.has_flag(Fence::LEFT) || !left && is_new {
                self.leave_notice = None;
            } else {
                // The neighbour still relies on that association, or on an earlier one.
                leave_notice.heard = fence.association;
                leave_notice.due = true;
            }
            if left || !is_new {
                return true;
            }
        }
        fence.association == self.absent
    }

    /// Schedules a pending notice again; returns true if there is one.
    pub(super) const fn remind(&mut self) -> bool {
        if let Some(leave_notice) = &mut self.leave_notice {
            leave_notice.due = true;
        }
        self.leave_notice.is_some()
    }

    /// Returns the notice that this relay has left its association, if it is due.
    pub(super) fn poll_leave_notice(&mut self) -> Option<Fence> {
        let leave_notice = self.leave_notice.as_mut()?;
        core::mem::take(&mut leave_notice.due).then(|| Fence {
            flags: Fence::LEFT,
            ..Fence::without_place(leave_notice.own, leave_notice.heard)
        })
    }

    pub(super) const fn is_current(&mut self, association: u16, echo: u16) -> bool {
        let known = association == self.heard && echo == self.own;
        if known {
            self.strays = 0;
        }
        known
    }

    /// Returns a message of this association; the fence's number, x and step are 0.
    pub(super) fn fence(&self, own: &Own) -> Fence {
        Fence {
            association: self.own,
            echo: self.heard,
            number: 0,
            x_m: 0.0,
            target_m: own.target_m(),
            across: own.cross_section(),
            apart_m: 0.0,
            flags: u8::from(own.still) * Fence::ARRIVED
                + u8::from(self.open_sent) * Fence::REQUESTS_OPENING
                + u8::from(self.opens) * Fence::OPENING_RECEIVED
                + u8::from(self.halt_sent) * Fence::HALTS,
        }
    }

    /// Takes the open request from a message of this association. A reply is due if the neighbour has not received the last
    /// request of this relay.
    pub(super) const fn receive_open(&mut self, fence: &Fence) {
        self.opens = fence.has_flag(Fence::REQUESTS_OPENING);
        self.due |= fence.has_flag(Fence::OPENING_RECEIVED) != self.open_sent;
    }

    /// Forwards a request to open the chain, or its end.
    pub(super) const fn forward_open(&mut self, opens: bool) {
        self.due |= self.open_sent != opens;
        self.open_sent = opens;
    }

    /// Takes the halt request from any message of the neighbour. A request is only withdrawn by a relay that is in order on its
    /// other side (`is_placed`), because a rebooted one does not know its earlier request.
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

    /// Forwards a halt request, or its end.
    pub(super) const fn forward_halt(&mut self, halts: bool) {
        self.due |= self.halt_sent != halts;
        self.halt_sent = halts;
    }

    pub(super) const fn sends_halt(&self) -> bool {
        self.halt_sent
    }

    /// Counts a reminder. A received halt request or position expires unless it is repeated within some reminders.
    pub(super) const fn count_reminder(&mut self) {
        self.halt_reminders_left = self.halt_reminders_left.saturating_sub(1);
        self.seen_reminders_left = self.seen_reminders_left.saturating_sub(1);
    }

    /// Returns the message of a relay without an association: one that is not flown or has just started.
    ///
    /// It contains the relay's position, and a halt request to forward.
    pub(super) fn poll_unpaired(&mut self, own: &Own) -> Option<Fence> {
        let is_due = self.due && self.node != 0 && self.leave_notice.is_none();
        let place = own.reported.filter(|_| is_due)?;
        self.due = false;
        Some(Fence {
            x_m: place.x_m,
            across: place.cross_section(),
            flags: Fence::LEFT | Fence::UNPLACED | (u8::from(self.halt_sent) * Fence::HALTS),
            ..Fence::without_place(self.own, 0)
        })
    }

    /// Counts a message of another association; returns true if they are too many to be late ones.
    pub(super) const fn count_foreign(&mut self) -> bool {
        self.strays = self.strays.saturating_add(1);
        self.strays >= STRAYS
    }
}

/// Limit on this relay's x, because of a lost relay that may still hover, or of an unflown drone.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeepOut {
    /// Nearest lost node, and the limit of this relay's x because of that node, m.
    lost: Option<(u16, f32)>,
    /// x from which a nearby lost relay is at least the separation away, m; NaN if no relay is lost nearby. Below this x the two
    /// may be separated across the line only.
    near_m: f32,
    /// True if a lost relay was out of order with this one at its last message.
    disordered: bool,
    /// Relay that reported last that it is not flown, and its reported position.
    unflown: Option<(u16, Placement)>,
}

impl KeepOut {
    pub(super) const fn none() -> Self {
        Self {
            lost: None,
            near_m: f32::NAN,
            disordered: false,
            unflown: None,
        }
    }

    pub(super) fn limit_m(&self) -> Option<f32> {
        self.lost.map(|(_, limit_m)| limit_m)
    }

    /// Adds a lost relay, `node`, with the limit `limit_m`. The side determines the nearer node and the tighter limit.
    #[inline(never)] // called from both sides
    pub(super) fn raise(&mut self, side: Side, node: u16, limit_m: f32) {
        let (nearest, tightest_m) = self.lost.unwrap_or((node, limit_m));
        self.lost = Some(match side {
            Side::Upstream => (nearest.max(node), tightest_m.max(limit_m)),
            Side::Downstream => (nearest.min(node), tightest_m.min(limit_m)),
        });
    }

    /// Removes lost relays at or beyond `node`, which has sent a message.
    pub(super) fn on_fence(&mut self, side: Side, node: u16) {
        let is_beyond = |lost: u16| match side {
            Side::Upstream => lost <= node,
            Side::Downstream => lost >= node,
        };
        if self.lost.is_some_and(|(lost, _)| is_beyond(lost)) {
            self.clear();
        }
        if self.unflown.is_some_and(|(unflown, _)| is_beyond(unflown)) {
            self.unflown = None;
        }
    }

    /// Takes a message that the neighbour is not flown, with its reported position. One of the current association is late, and
    /// ignored.
    pub(super) fn record_x(&mut self, association: &Association, fence: &Fence) {
        let is_late = fence.association == association.heard;
        if fence.has_flag(Fence::LEFT) && fence.has_flag(Fence::UNPLACED) && !is_late {
            self.unflown = Some((association.node, fence.across.at(fence.x_m)));
        }
    }

    /// Removes the obstacle: the neighbour is flown.
    pub(super) const fn remove_unflown(&mut self) {
        self.unflown = None;
    }

    /// Removes the obstacle because the line changes: the drone's position along the new line is unknown.
    pub(super) const fn leave_line(mut self) -> Self {
        self.unflown = None;
        self
    }

    /// Returns `otherwise` as the reason for a limit or a wait, or that the neighbour `node` is not flown.
    pub(super) fn reason(&self, node: u16, otherwise: HoldReason) -> HoldReason {
        if self.unflown.is_some_and(|(unflown, _)| unflown == node) {
            HoldReason::NotFlown
        } else {
            otherwise
        }
    }

    /// Returns true if a drone that is not flown blocks this relay's path to its agreed position.
    pub(super) fn blocks(&self, own: &Own) -> bool {
        let ways = own.setpoint.zip(own.target);
        ways.is_some_and(|(from, to)| self.path_end(from, to, &own.config) != to)
    }

    /// Returns the part of the path from `from` to `to` that keeps clear of a drone that is not flown. It keeps the separation. If
    /// `from` is closer than the separation, the path comes no nearer. Along x it ends before that drone, unless the two are the
    /// separation apart across the line. Within the separation along x only moves across the line away from the drone remain.
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

    /// Moves the limit for relays that were lost before the first setpoint to that setpoint's `x_m`.
    ///
    /// They were never heard and may hover anywhere beyond it; from `near_m` on they are the separation away.
    pub(super) fn begin(&mut self, x_m: f32, near_m: f32) {
        if let Some((_, limit_m)) = &mut self.lost {
            *limit_m = x_m;
            self.near_m = near_m;
        }
    }

    /// Marks the last lost relay as possibly closer than the separation, until this relay reaches `near_m`.
    pub(super) const fn mark_near(&mut self, near_m: f32) {
        self.near_m = near_m;
    }

    /// Returns the x from which on the last lost relay is the separation away, m; NaN if it already is.
    pub(super) const fn near_m(&self) -> f32 {
        self.near_m
    }

    /// Returns true while the last lost relay may be closer than the separation.
    pub(super) const fn is_near(&self) -> bool {
        !self.near_m.is_nan()
    }

    /// Ends [`is_near`](Self::is_near) once this relay `is_beyond` the x `near_m`. `near_m` then becomes its limit, so it stays the
    /// separation away from the lost relay.
    pub(super) fn end_near(&mut self, side: Side, is_beyond: impl Fn(f32) -> bool) {
        if is_beyond(self.near_m) {
            if let Some((_, limit_m)) = &mut self.lost {
                *limit_m = match side {
                    Side::Upstream => limit_m.max(self.near_m),
                    Side::Downstream => limit_m.min(self.near_m),
                };
            }
            self.near_m = f32::NAN;
        }
    }

    /// Marks that a lost relay is out of order with this one.
    pub(super) const fn disorder(&mut self) {
        self.disordered = true;
    }

    /// Returns true while a lost relay may be on the wrong side. No path along x then leads away from it.
    pub(super) const fn is_disordered(&self) -> bool {
        self.disordered
    }

    pub(super) const fn clear(&mut self) {
        *self = Self::none();
    }

    /// Keeps clear of relays at `side` that were never heard. They may hover anywhere beyond `limit_m`, until any of them has sent
    /// a message.
    pub(super) fn expect(&mut self, side: Side, limit_m: f32, separation_m: f32) {
        let (nearest, near_m) = match side {
            Side::Upstream => (0, limit_m + separation_m),
            Side::Downstream => (u16::MAX, limit_m - separation_m),
        };
        self.lost = Some((nearest, limit_m));
        self.near_m = near_m;
    }
}

/// Message of a relay to a neighbour about the fence between them.
///
/// It is a state, not a step: it may be lost, duplicated, delayed or reordered.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fence {
    /// Number of the sender's association with this neighbour, never 0.
    pub association: u16,
    /// Echo of the destination's association number as last received, 0 for none.
    pub echo: u16,
    /// Owner: number of the fence, 0 before the first. Follower: number of the newest fence received.
    pub number: u16,
    /// Owner: x of the fence. Follower: low end of its reachable interval. m, -1e7 to 1e7.
    pub x_m: f32,
    /// Agreed x of the sender, m, -1e7 to 1e7.
    pub target_m: f32,
    /// Position of the sender across the line, or its target position across the line, m. Both coordinates are -1e7 to 1e7.
    pub across: CrossSection,
    /// Owner: requested step, which is the distance to keep from the fence along x, m, 0 to 1e5. If it is less than the
    /// separation, the follower must not move across the line.
    pub apart_m: f32,
    /// Sum of the flags [`ARRIVED`](Self::ARRIVED) to [`UNPLACED`](Self::UNPLACED) that are set.
    pub flags: u8,
}

impl Fence {
    /// Flag: the sender has arrived at its position across the line.
    pub const ARRIVED: u8 = 1;
    /// Flag of the follower: it agrees to `apart_m` of the newest fence.
    pub const AGREES: u8 = 2;
    /// Flag: the sender, or a relay beyond it, has to move across the line. It needs the separation along x for that.
    pub const REQUESTS_OPENING: u8 = 4;
    /// Flag: echo of the last [`REQUESTS_OPENING`](Self::REQUESTS_OPENING) received from the destination.
    pub const OPENING_RECEIVED: u8 = 8;
    /// Flag: the sender has left this association. It does not fly to its setpoints, or did not for a time. Positions and the
    /// number of the fence are not valid.
    pub const LEFT: u8 = 16;
    /// Flag: the sender, or a relay beyond it, is not in order with its neighbours. All relays hold their positions. It is repeated
    /// every second, and valid in any association.
    pub const HALTS: u8 = 32;
    /// Flag: the position shows the order only, and grants nothing. Of the follower: it is not in order with its neighbour
    /// downstream. With [`LEFT`](Self::LEFT): the sender is not flown, and `x_m` is its last reported x.
    pub const UNPLACED: u8 = 64;

    pub(super) const fn without_place(association: u16, echo: u16) -> Self {
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

    /// Returns true if all numbers are within their ranges.
    pub fn is_valid(&self) -> bool {
        let CrossSection { y_m, altitude_m } = self.across;
        let places = [self.x_m, self.target_m, y_m, altitude_m];
        self.association != 0
            && places.into_iter().all(is_place)
            && (0.0..=1e5).contains(&self.apart_m)
            && self.flags < 2 * Self::UNPLACED
    }
}

/// Reason that keeps a relay from its agreed position.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum HoldReason {
    /// The neighbour has not agreed to a fence yet.
    Unheard,
    /// The neighbour is on the wrong side of this relay along the line, or too close for certainty. Neither moves.
    Order,
    /// The agreed distance along x is less than allowed, given the current positions across the line.
    Close,
    /// A lost relay may still hover between this relay and its agreed position.
    Lost,
    /// The neighbour is not flown, and blocks the path or has not made room.
    NotFlown,
    /// The neighbour has not made room for at least five seconds.
    Pending,
    /// Another relay of the chain is not in order with its neighbours, so all relays hold their positions.
    Halted,
}
