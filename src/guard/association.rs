//! Which incarnation of the neighbour a message is from.
//!
//! Each side numbers its association with the other at random, and a message counts only if it bears the sender's number and echoes the
//! receiver's. The owner's number goes with the first number that echoes it; the follower takes a new number whenever it
//! takes up another of the owner's. So two numbers go together once, and what was said in an earlier one cannot count in a
//! later one, however late it comes.

use super::config::GuardConfig;
use super::fence::{Fence, HoldReason};
use super::own::Own;
use crate::jitter::Jitter;
use crate::place::Placement;
use crate::side::Side;

/// So many messages of another association in a row are of a new one, not late ones of an old.
const STRAYS: u8 = 3;

/// Reminders, of one a second, after which a request to halt that is not repeated is forgotten.
const HALT_REMINDERS: u8 = 15;

/// Reminders after which a place that is not repeated is forgotten.
const SEEN_REMINDERS: u8 = 15;

/// An association that this relay has left, until the neighbour has begun anew.
#[derive(Clone, Copy, Debug)]
struct Parting {
    own: u16,
    heard: u16,
    due: bool,
}

/// An association with the neighbour on one side.
#[expect(
    clippy::struct_excessive_bools,
    reason = "flags of the messages, each for itself"
)]
#[derive(Clone, Copy, Debug)]
pub(super) struct Association {
    /// The neighbour, 0 for none.
    pub(super) node: u16,
    /// The number of this relay's association.
    pub(super) own: u16,
    /// The neighbour's, as it goes with `own`; 0 for none.
    pub(super) heard: u16,
    /// Messages of other associations in a row.
    strays: u8,
    /// Whether there is something to tell.
    pub(super) due: bool,
    /// True if the neighbour passed on that the chain is to open, and if it was last told so.
    pub(super) opens: bool,
    told_open: bool,
    /// Reminders until the neighbour's request to halt is forgotten, 0 for none.
    halt_left: u8,
    /// True while the neighbour is told to halt.
    told_halt: bool,
    /// The neighbour's number of the association that it has left, 0 for none: it is counted as absent.
    absent: u16,
    /// What this relay still has to say of the one that it has left itself.
    parting: Option<Parting>,
    /// Place along x that the neighbour told last, in whichever association, m; NaN before that.
    seen_m: f32,
    /// Reminders until that place is forgotten.
    seen_left: u8,
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
            told_open: false,
            halt_left: 0,
            told_halt: false,
            absent: 0,
            parting: None,
            seen_m: f32::NAN,
            seen_left: 0,
        }
    }

    /// Whether nobody is there that this relay could agree with: the chain ends, or the neighbour is not flown.
    pub(super) const fn is_none(&self) -> bool {
        self.node == 0 || self.is_absent()
    }

    /// Takes the place along x that a message of the neighbour tells.
    pub(super) const fn see(&mut self, x_m: f32) {
        (self.seen_m, self.seen_left) = (x_m, SEEN_REMINDERS);
    }

    /// Returns how far this relay was reported beyond the place that the neighbour told last, m: along x for the neighbour upstream, against
    /// x for the one downstream. NaN if either is unknown.
    fn beyond_m(&self, own: &Own, side: Side) -> f32 {
        let x_m = own.reported.map_or(f32::NAN, |place| place.x_m);
        match side {
            _ if self.seen_left == 0 => f32::NAN,
            Side::Upstream => x_m - self.seen_m,
            Side::Downstream => self.seen_m - x_m,
        }
    }

    /// Returns the place along x that the neighbour told last, m; NaN if that is not known or was forgotten.
    pub(super) const fn seen_m(&self) -> f32 {
        if self.seen_left == 0 {
            f32::NAN
        } else {
            self.seen_m
        }
    }

    /// Returns true if this relay was reported on the wrong side of the place that the neighbour told last.
    pub(super) fn is_passed(&self, own: &Own, side: Side) -> bool {
        self.beyond_m(own, side) < -2.0 * own.config.hover_m
    }

    /// Returns true if this relay was reported on its own side of the place that the neighbour told last.
    pub(super) fn is_seen_in_order(&self, own: &Own, side: Side) -> bool {
        self.beyond_m(own, side) >= 2.0 * own.config.hover_m
    }

    /// Whether the neighbour is not flown.
    pub(super) const fn is_absent(&self) -> bool {
        self.absent != 0
    }

    /// The neighbour has left the association of that number, and may be anywhere.
    pub(super) const fn miss(&mut self, association: u16) {
        self.absent = association;
    }

    /// From now on the neighbour's number is that one: whoever was absent is back.
    pub(super) const fn meet(&mut self, association: u16) {
        self.heard = association;
        self.absent = 0;
    }

    /// Whether a message says that the neighbour has left this association. The number it echoes is not used after that, so what is said of it
    /// again is of an earlier one.
    pub(super) const fn is_left(&self, fence: &Fence) -> bool {
        fence.says(Fence::RELEASED) && fence.echo == self.own
    }

    /// Leaves it: the next one, which has to say so where the neighbour may count on this one.
    pub(super) fn leave(&self, jitter: &mut Jitter) -> Self {
        let left = Parting {
            own: self.own,
            heard: self.heard,
            due: true,
        };
        Self {
            parting: if self.heard == 0 {
                self.parting
            } else {
                Some(left)
            },
            ..Self::new(self.node, jitter)
        }
    }

    /// The next one, whatever was said in this one. What it has still to say of one that it left before it says.
    pub(super) fn renew(&self, jitter: &mut Jitter) -> Self {
        Self {
            parting: self.parting,
            ..Self::new(self.node, jitter)
        }
    }

    /// Whether a message is of an association that this relay, or the neighbour, has left. The neighbour is told again until it has begun
    /// anew.
    pub(super) fn is_over(&mut self, fence: &Fence) -> bool {
        if let Some(parting) = &mut self.parting {
            let left = fence.association == parting.heard;
            let is_new = fence.echo == 0 || fence.echo == self.own;
            if left && fence.says(Fence::RELEASED) || !left && is_new {
                self.parting = None;
            } else {
                // It still counts on that one, or on an earlier one.
                parting.heard = fence.association;
                parting.due = true;
            }
            if left || !is_new {
                return true;
            }
        }
        fence.association == self.absent
    }

    /// Whether the neighbour has still to be told that this relay has left; it is told again.
    pub(super) const fn remind(&mut self) -> bool {
        if let Some(parting) = &mut self.parting {
            parting.due = true;
        }
        self.parting.is_some()
    }

    /// What there is to tell of the association that this relay has left.
    pub(super) fn part(&mut self) -> Option<Fence> {
        let parting = self.parting.as_mut()?;
        core::mem::take(&mut parting.due).then(|| Fence {
            flags: Fence::RELEASED,
            ..Fence::without_place(parting.own, parting.heard)
        })
    }

    /// Whether a message is of this association.
    pub(super) const fn knows(&mut self, association: u16, echo: u16) -> bool {
        let known = association == self.heard && echo == self.own;
        if known {
            self.strays = 0;
        }
        known
    }

    /// A message of this association, but for what is of the fence.
    pub(super) fn fence(&self, own: &Own) -> Fence {
        Fence {
            association: self.own,
            echo: self.heard,
            number: 0,
            x_m: 0.0,
            target_m: own.target_m(),
            across: own.across(),
            apart_m: 0.0,
            flags: u8::from(own.still) * Fence::STILL
                + u8::from(self.told_open) * Fence::OPENS
                + u8::from(self.opens) * Fence::ECHO_OPENS
                + u8::from(self.told_halt) * Fence::HALTS,
        }
    }

    /// Takes from a message of this association whether the chain is to open. It is answered if the neighbour has not received the last
    /// of that.
    pub(super) const fn hear_open(&mut self, fence: &Fence) {
        self.opens = fence.says(Fence::OPENS);
        self.due |= fence.says(Fence::ECHO_OPENS) != self.told_open;
    }

    /// Passes on that the chain is to open.
    pub(super) const fn pass_open(&mut self, opens: bool) {
        self.due |= self.told_open != opens;
        self.told_open = opens;
    }

    /// Takes from any message of the neighbour whether the chain is to halt. A request is withdrawn by a relay that is in order on its
    /// other side (`is_placed`): one that was rebooted does not know yet what it had requested.
    pub(super) const fn hear_halt(&mut self, fence: &Fence, is_placed: bool) {
        if fence.says(Fence::HALTS) {
            self.halt_left = HALT_REMINDERS;
        } else if is_placed {
            self.halt_left = 0;
        }
    }

    /// Returns true while the neighbour requests a halt.
    pub(super) const fn requests_halt(&self) -> bool {
        self.halt_left > 0
    }

    /// Passes on that the chain is to halt.
    pub(super) const fn pass_halt(&mut self, halts: bool) {
        self.due |= self.told_halt != halts;
        self.told_halt = halts;
    }

    /// Returns true while the neighbour is told to halt.
    pub(super) const fn tells_halt(&self) -> bool {
        self.told_halt
    }

    /// Counts a reminder: a request to halt, and a place, that was not repeated for long is forgotten.
    pub(super) const fn age(&mut self) {
        self.halt_left = self.halt_left.saturating_sub(1);
        self.seen_left = self.seen_left.saturating_sub(1);
    }

    /// Returns the message of a relay that is not flown, or has just begun, and so is in no association: its place, and a halt that it
    /// passes on.
    pub(super) fn tell_alone(&mut self, own: &Own) -> Option<Fence> {
        let is_due = self.due && self.node != 0 && self.parting.is_none();
        let place = own.reported.filter(|_| is_due)?;
        self.due = false;
        Some(Fence {
            x_m: place.x_m,
            across: place.cross_section(),
            flags: Fence::RELEASED | Fence::UNPLACED | (u8::from(self.told_halt) * Fence::HALTS),
            ..Fence::without_place(self.own, 0)
        })
    }

    /// One more message of another association; whether they are too many to be late ones.
    pub(super) const fn stray(&mut self) -> bool {
        self.strays = self.strays.saturating_add(1);
        self.strays >= STRAYS
    }
}

/// Where a relay that fell silent may still hover, as a limit of this relay's own x.
#[derive(Clone, Copy, Debug)]
pub(super) struct KeepOut {
    /// Of the lost relays the nearest node, and the limit, m.
    lost: Option<(u16, f32)>,
    /// Where along x this relay may be no farther than the separation from it, and has not been beyond since, m: only where the two are
    /// across the line keeps them apart. Not a number where that is over.
    near_m: f32,
    /// True if a lost relay was out of order with this one when it was heard last.
    disordered: bool,
    /// The relay that told last that it is not flown, and the place at which it was reported.
    unflown: Option<(u16, Placement)>,
}

impl KeepOut {
    /// Nothing there.
    pub(super) const fn none() -> Self {
        Self {
            lost: None,
            near_m: f32::NAN,
            disordered: false,
            unflown: None,
        }
    }

    /// The limit, m.
    pub(super) fn limit_m(&self) -> Option<f32> {
        self.lost.map(|(_, limit_m)| limit_m)
    }

    /// One more relay, `node`, may hover so that this one may not go beyond `limit_m`; which node is nearer and which limit
    /// tighter depends on the side.
    #[inline(never)] // called from both sides
    pub(super) fn raise(&mut self, side: Side, node: u16, limit_m: f32) {
        let (nearest, tightest_m) = self.lost.unwrap_or((node, limit_m));
        self.lost = Some(match side {
            Side::Upstream => (nearest.max(node), tightest_m.max(limit_m)),
            Side::Downstream => (nearest.min(node), tightest_m.min(limit_m)),
        });
    }

    /// `node` speaks for itself: all that are lost are it, or beyond it.
    pub(super) fn spoken(&mut self, side: Side, node: u16) {
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

    /// Takes from a message of the neighbour that it is not flown, and where it was reported. A message that bears the number of the
    /// association that the two have since is late.
    pub(super) fn see(&mut self, association: &Association, fence: &Fence) {
        let is_late = fence.association == association.heard;
        if fence.says(Fence::RELEASED) && fence.says(Fence::UNPLACED) && !is_late {
            self.unflown = Some((association.node, fence.across.at(fence.x_m)));
        }
    }

    /// The neighbour is flown.
    pub(super) const fn flies(&mut self) {
        self.unflown = None;
    }

    /// Returns what holds along another line: the place of a drone that is not flown is not known along it.
    pub(super) const fn leave_line(mut self) -> Self {
        self.unflown = None;
        self
    }

    /// Returns the reason for a limit, or a wait, at this side: `otherwise`, unless the neighbour `node` has told that it is not flown.
    pub(super) fn reason(&self, node: u16, otherwise: HoldReason) -> HoldReason {
        if self.unflown.is_some_and(|(unflown, _)| unflown == node) {
            HoldReason::NotFlown
        } else {
            otherwise
        }
    }

    /// Returns true if a drone that is not flown is in the way of this relay to its agreed place.
    pub(super) fn bars(&self, own: &Own) -> bool {
        let ways = own.setpoint.zip(own.target);
        ways.is_some_and(|(from, to)| self.way(from, to, &own.config) != to)
    }

    /// Returns the part of the way from `from` to `to` that does not come nearer than the separation to the drone that is not flown, or no
    /// nearer than `from` is.
    ///
    /// Along x the way ends before that drone, unless the two are the separation apart across the line. Within the separation along x only
    /// moves across the line that lead away from it are left.
    pub(super) fn way(&self, from: Placement, to: Placement, config: &GuardConfig) -> Placement {
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

    /// The first setpoint is `x_m`: whoever was lost before was never heard, and may hover anywhere beyond, from `near_m` on the
    /// separation apart.
    pub(super) fn begin(&mut self, x_m: f32, near_m: f32) {
        if let Some((_, limit_m)) = &mut self.lost {
            *limit_m = x_m;
            self.near_m = near_m;
        }
    }

    /// The relay that was lost last was nearer than the separation, or may have been, unless this one is at `near_m` or beyond.
    pub(super) const fn near(&mut self, near_m: f32) {
        self.near_m = near_m;
    }

    /// Returns the place along x from which on the relay that was lost last is the separation away, m; NaN if it is.
    pub(super) const fn near_m(&self) -> f32 {
        self.near_m
    }

    /// Whether that may still be so.
    pub(super) const fn is_near(&self) -> bool {
        !self.near_m.is_nan()
    }

    /// Takes whether this relay is beyond a limit, by `is_beyond`. Once it has gone off to the separation from a relay on `side` that was
    /// lost near by, it stays at least so far away.
    pub(super) fn part(&mut self, side: Side, is_beyond: impl Fn(f32) -> bool) {
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

    /// A relay that is out of order with this one is lost.
    pub(super) const fn disorder(&mut self) {
        self.disordered = true;
    }

    /// Returns true while a lost relay may be on the wrong side of this one: then no way along x leads away from it.
    pub(super) const fn is_disordered(&self) -> bool {
        self.disordered
    }

    pub(super) const fn clear(&mut self) {
        *self = Self::none();
    }
}
