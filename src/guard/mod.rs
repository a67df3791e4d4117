//! Motion guard: keeps relays apart while they fly from one agreed set of places to the next, whatever is lost or late between them.
//!
//! Relays stand in order along x. As a rule neighbours are the separation apart *along x*, and then so are all relays, whatever they do
//! across the line. Two relays that are agreed beside or above each other come closer along x once both have arrived across the line; what
//! they are apart across the line then counts. Two relays with one between them stay the separation apart along x in any case, so no
//! relay has to know more than its neighbours. Places that do not allow that are approached as far as they can be, and
//! [`Guard::hold_reason`] says so.
//!
//! Between two neighbours there is a *fence*, a plane across x. The relay upstream of it, its *owner*, stays a *step* before it; the relay
//! downstream, the *follower*, stays at it or beyond.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`config`] | the geofence of setpoints, and other settings |
//! | `own` | the relay's own setpoint and place across the line |
//! | `reachable` | the interval along x in which the relay may be, by its reports and setpoints |
//! | `association` | the incarnation of the neighbour that a message belongs to, and requests that relays pass on |
//! | `owner` | the fence downstream, which this relay places |
//! | `follower` | the fence upstream, which the neighbour places |
//!
//! # Rules
//!
//! *Own interval*: from the lowest to the highest x at which the relay may be, wherever it stops on its way. *In order*: the follower is
//! beyond the owner along x. Reports are off by up to `hover_m`: two relays whose reports are within twice that along x are in order only if
//! they are the separation apart across the line, so that they may pass each other.
//!
//! | | rule | so that |
//! | --- | --- | --- |
//! | 1 | The follower never lowers its setpoint below the newest fence that it has received, and flies up to that fence if it is below. | its promise holds |
//! | 2 | It tells the newest fence that it has received, and the low end of its own interval, or what it counts on downstream (rule 3) if that is lower: relays that are in order but for the error of their reports may add up. | a relay is known to be beyond all that are upstream |
//! | 3 | The owner counts on the lowest of that low end, if told together with the newest fence, and every fence announced since. | no message under way lets the follower come nearer than it is counted on |
//! | 4 | The owner never raises its setpoint to less than the step before what it counts on. | the two intervals are the step apart |
//! | 5 | The owner announces no fence nearer than the step beyond the high end of its own interval. | a fence that is lowered has been cleared already |
//! | 6 | As far as 5 allows, the fence goes halfway between the two agreed places, and half the step on. | both can reach their places |
//! | 7 | The first fence is the separation beyond the owner's own interval, and beyond what the fence upstream of it leaves to that one's owner. Other fences, and moves across the line, begin when the follower has cleared it. | a start that is too close is opened first, and no relay sinks onto another |
//! | 8 | The first setpoint is the place reported last, side and altitude included, even outside the geofence. It stays until both neighbours are known to be in order: the follower has told that it is beyond the owner, the owner has announced a fence. A relay tells the one neighbour a place that counts only once it is in order with the other one. | nothing is granted before the order is known, after a start as after a reboot or a new link |
//! | 9 | Nothing lapses with time: the last limit of a neighbour that is replaced or starts anew stays until it speaks for itself, or [`Guard::forget`]; if it was never heard, this relay goes no farther toward it. | no relay flies into a silent one that still hovers |
//! | 10 | With a fence the owner tells the step that it asks for. From a step below the separation until the next one that is the separation, neither moves across the line: the owner from asking on, the follower from receiving on. | the place across the line that the follower told stays true |
//! | 11 | The step is the separation. It becomes less when the follower has told, together with the newest fence, that it has arrived across the line, where, and that it agrees: then it is the largest of what is asked for, of what the two places across the line leave to be kept along x, and of what rule 12 asks for. The owner announces a larger one only once it is that far before what it counts on. | the two are the separation apart in space |
//! | 12 | The steps upstream and downstream of a relay add up to the separation at least: it agrees to no smaller one upstream before, and takes no smaller one downstream after. | relays that are not neighbours are the separation apart along x |
//! | 13 | A relay that has to move across the line and may not by rule 10, or that started too close to a neighbour that is to be close, has the chain *open*: it tells both sides, and every relay passes that on. Then all go to places in the same order that are the separation apart along x, and steps are the separation. | there is room to move across the line |
//! | 14 | From a neighbour that fell silent within the separation along x this relay goes off to the separation, and does not move across the line before, nor comes back nearer; nor where it never heard the neighbour, or had not cleared the first fence, before it has gone as far. Where the neighbour was out of order with it, it stays where it is. | the place of the silent one still counts |
//! | 15 | A relay that is not flown to its setpoints, in its pilot's hands or on the ground, has none. It leaves both associations and says so until the neighbour has begun anew; flown again it begins as after a start. Meanwhile it tells the place at which it was reported, which grants nothing. Its neighbour goes no farther toward it than its own setpoint (and by rule 14 off to the separation); if the two were in order it is otherwise free, until it receives a new association, but for the place that was told last: until the neighbour is flown again, is linked anew or is forgotten, it does not go past that place along x nor nearer to it than the separation, unless the two are the separation apart across the line, and within the separation along x it moves across the line only away from it. A relay that is on its way stops where it was reported. | no relay counts on a drone that is flown by hand, and none comes nearer to it or flies through it |
//! | 16 | A relay that is out of order with a neighbour, or not in order with both for three reminders and not seen to be so by the places of those that are not flown, has the chain *halt*: it tells both sides at every reminder, and every relay passes that on, also one that is not flown. A relay that halts on its way stops where it was reported last. A request that is not repeated for 15 reminders is forgotten. | no relay flies into a drone that was given back, or has started, at a wrong place |
//!
//! Where places are along another line from one moment to the next ([`Guard::leave_line`]), a relay has no setpoint and begins as after a
//! start, once it has stopped. A neighbour that speaks along another line is not heard: it is counted on as before, where it was, and the
//! relay does not move before both neighbours speak along the new line. Relays that the new line puts out of order stay where they are.
//!
//! # Why the order along x suffices
//!
//! Let all neighbours be in order. A pair of neighbours less than the separation apart only parts: the owner's setpoint does not rise
//! (rule 4) and the follower's does not fall (rules 1 and 7). From then on the pair stays the separation apart. So no gap between
//! neighbours ever falls below the lesser of the separation and the gap at the start, nor does a sum of gaps: that is the distance along x
//! of any two relays. Until a relay's two gaps are the separation, it does not move across the line. So no two relays come nearer in
//! space than the lesser of the separation and their distance at the start, less what their places are off by.
//! `cargo test --test guard anywhere` flies it.
//!
//! # Why everybody arrives
//!
//! Let the places agreed on be the separation apart; then so are the fences' goals. A fence that has to be lowered waits for
//! its owner to come down, and that relay waits only for the fence upstream, if that has to be lowered, too: the first of them
//! waits for nobody, and so, one after the other, all come down. In the same way all that have to be raised are, from the
//! receiver's end. Then every relay finds its place between its fences. Fences go along with the flight, so that is one
//! flight's time and a few messages a relay at the worst.
//!
//! Where neighbours are to be closer along x, the same holds of the places in an open chain, so each relay gets to move across the line,
//! and none needs that again before the next agreement. Then the steps become what they are to be, and the same holds of the places
//! agreed on.
//!
//! # What is not promised
//!
//! - Hovering off the reported place by up to [`GuardConfig::hover_m`] takes as much from the separation at either relay, and as
//!   much again each time that one is rebooted before a fence has opened what is missing. What a relay hovers off across the line counts
//!   where the two are within the separation along x.
//! - A relay says nothing before it has both a place to go to and a report of where it is: until then nobody moves toward it.
//! - A drone in its pilot's hands is the pilot's affair: its neighbours only come no nearer, to the place that they have received last, which is told
//!   every second while it changes and every four seconds else. Relays that are not its neighbours do not know it, and may fly past it. A drone that is given back at a wrong place
//!   stays there, and the chain halts around it; a drone that is just flying past needs some seconds for that. A drone that is given back
//!   in motion overshoots as far as its autopilot takes to stop it.
//! - A relay that starts, or is flown again, beside one that is not flown has not heard it, and stays where it is until that one is
//!   flown or is linked around.
//! - A relay that is rebooted has forgotten whom it was linked to: it has to begin with the neighbours of the mission and be
//!   linked around those that are silent, so that rule 9 holds it back.
//! - The numbers of the associations are random: `seed` has to differ from one start to the next.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

mod association;
pub mod config;
mod fence;
mod follower;
mod own;
mod owner;
mod reachable;
#[cfg(test)]
mod tests;

use crate::place::Placement;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;

use crate::jitter::Jitter;
use association::Association;
use config::{Geofence, GuardConfig};
use fence::is_place;
pub use fence::{Fence, HoldReason};
use follower::FenceFollower;
use own::Own;
use owner::FenceOwner;
use reachable::ReachableInterval;

/// One relay's guard: where it was agreed to be goes in, where it is safe to fly now comes out.
///
/// Feed it with [`commit`](Self::commit), [`position`](Self::position), [`hear`](Self::hear), [`link`](Self::link); after each,
/// call [`steer`](Self::steer), fly to what it gives, then send what [`poll`](Self::poll) has to say. Every call does some hundred
/// operations and two square roots at most, none depends on the length of the chain.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    own: Own,
    jitter: Jitter,
    born: Instant,
    /// Before the first setpoint: where the relay was reported last.
    found: Option<Placement>,
    /// Whether the relay flies to its setpoints.
    flown: bool,
    follower: FenceFollower,
    owner: FenceOwner,
    /// True while this relay has the whole chain halt: it is out of order with a neighbour, or not in order for some reminders.
    disorder: bool,
    /// Reminders in a row at which this relay was not in order.
    waits: u8,
    /// Reminders so far.
    reminders: u8,
    refused: u32,
}

/// Reminders from one message of a relay that is not flown to the next.
const ALONE_EVERY: u8 = 4;

/// Reminders in a row without order after which the whole chain halts.
const MOST_WAITS: u8 = 3;

impl Guard {
    /// A guard that starts at `now` between `neighbours`, toward Tx and toward Rx, as the mission has them; `None` where the chain ends.
    ///
    /// `config` has to be valid ([`GuardConfig::is_valid`]); `seed` has to differ from relay to relay and from start to start.
    pub fn new(config: GuardConfig, neighbours: [Option<u16>; 2], seed: u32, now: Instant) -> Self {
        let [upstream, downstream] = neighbours.map(Option::unwrap_or_default);
        let mut jitter = Jitter::new(seed);
        Self {
            own: Own::new(config, upstream.saturating_add(1), now),
            follower: FenceFollower::new(upstream, &mut jitter),
            owner: FenceOwner::new(downstream, &mut jitter),
            disorder: false,
            waits: 0,
            reminders: 0,
            jitter,
            born: now,
            found: None,
            flown: true,
            refused: 0,
        }
    }

    /// The chain has agreed that this relay shall be at `place`. It is cut to the box.
    pub fn commit(&mut self, place: Placement) {
        if !is_placement(place) {
            return bump(&mut self.refused);
        }
        self.own.target = Some(self.own.config.cut(place));
        self.follower.association.due = true;
        self.owner.association.due = true;
    }

    /// Whether `place` is where the relay is on its way to, or is.
    pub fn is_for(&self, place: Placement) -> bool {
        self.own.target == Some(self.own.config.cut(place))
    }

    /// The flight controller has found that the relay was at `place` at time `at`: when that was measured, not when it was read.
    ///
    /// The first setpoint is a place reported since the start, altitude and side included, even outside the box; nothing farther than
    /// [`BEGIN_WITHIN_M`](config::BEGIN_WITHIN_M) from the box.
    pub fn position(&mut self, at: Instant, place: Placement) {
        if !is_placement(place) {
            return bump(&mut self.refused);
        }
        let own = &mut self.own;
        own.reported = Some(place);
        if own.setpoint.is_some() {
            own.reachable.report(at, place.x_m, &own.config);
            own.report(at, place);
        } else if self.flown && at >= self.born && own.config.may_begin_at(place) {
            self.found = Some(place);
        }
    }

    /// Whether the relay flies to its setpoints from `now` on; whether that is news. Until this says otherwise it does.
    ///
    /// While it does not there is no setpoint, and both neighbours are told that it may be anywhere. Flown again it begins as after a
    /// start: with the next place that is reported.
    pub fn control(&mut self, now: Instant, flown: bool) -> bool {
        if flown == self.flown {
            return false;
        }
        self.flown = flown;
        (self.disorder, self.waits) = (false, 0);
        (self.born, self.found) = (now, None);
        if self.own.setpoint.is_some() {
            self.own.release(now);
            self.follower.leave(&mut self.jitter);
            self.owner.leave(&mut self.jitter);
        }
        true
    }

    /// Places are along another line from now on, and what was said of the one before is void: this relay begins as after a start, with the
    /// first place that is reported once it has stopped. At `now`, or if that is `None` when it was switched on.
    ///
    /// Who fell silent may hover anywhere beyond where this relay is, as after a start.
    pub fn leave_line(&mut self, now: Option<Instant>) {
        if let Some(now) = now {
            self.born = self.born.max(now + self.own.config.lag);
        }
        self.found = None;
        (self.disorder, self.waits) = (false, 0);
        self.own.reported = None;
        self.own.target = None;
        self.own.release(self.born);
        self.follower.leave_line(&mut self.jitter);
        self.owner.leave_line(&mut self.jitter);
    }

    /// No setpoint leaves `fence` from now on. Whoever is outside comes back with the next one.
    pub fn set_box(&mut self, fence: Geofence) {
        self.own.config.fence = fence;
    }

    /// What node `from` at `side` says. What is out of range is counted, what is of an earlier association or of another node ignored.
    pub fn hear(&mut self, side: Side, from: u16, fence: &Fence) {
        if !fence.is_valid() {
            return bump(&mut self.refused);
        }
        match side {
            Side::Upstream if self.follower.association.node == from => {
                self.follower.hear(fence, &self.own, &mut self.jitter);
            }
            Side::Downstream if self.owner.association.node == from => {
                self.owner.hear(fence, &self.own, &mut self.jitter);
            }
            _ => {}
        }
    }

    /// From now on `neighbour` is the one at `side`, `None` if the chain ends here. The same one again changes nothing.
    ///
    /// The one before may still hover: this relay keeps clear of it until [`forget`](Self::forget), or until it, or one between,
    /// is linked and has spoken.
    pub fn link(&mut self, side: Side, neighbour: Option<u16>) {
        let node = neighbour.unwrap_or(0);
        match side {
            Side::Upstream if self.follower.association.node != node => {
                self.follower.link(node, &self.own, &mut self.jitter);
            }
            Side::Downstream if self.owner.association.node != node => {
                self.owner.link(node, &self.own, &mut self.jitter);
            }
            _ => {}
        }
    }

    /// Relays that fell silent at `side` are no longer there: they have landed, or were taken away.
    pub fn forget(&mut self, side: Side) {
        match side {
            Side::Upstream => self.follower.keep_out.clear(),
            Side::Downstream => self.owner.keep_out.clear(),
        }
    }

    /// Moves the setpoint as far as is granted by now, and gives it; `None` before there is a place to go to and a report.
    ///
    /// `now` is when the setpoint is handed on: the relay flies toward it [`GuardConfig::lag`] later.
    pub fn steer(&mut self, now: Instant) -> Option<Placement> {
        let target = self.own.target?;
        let Some(before) = self.own.setpoint else {
            let found = self.found?;
            self.own.reachable = ReachableInterval::at(found.x_m, now);
            let (x_m, apart) = (found.x_m, self.own.config.separation_m);
            self.follower.keep_out.begin(x_m, x_m + apart);
            self.owner.keep_out.begin(x_m, x_m - apart);
            self.own.begin(found, now);
            return self.own.setpoint;
        };
        let low_m = self.owner.low_m(&self.own);
        self.follower.settle(&self.own, low_m);
        self.clear_near();
        let is_ordered = self.is_ordered();
        self.halt(is_ordered, now);
        let before = self.own.setpoint.unwrap_or(before);
        let clear = self.follower.is_clear(&self.own) && self.owner.is_clear(&self.own);
        self.open(clear);
        let own = &self.own;
        let taken_m = self.follower.taken_m();
        let apart = if own.open {
            own.config.separation_m
        } else {
            self.owner.apart(own, taken_m)
        };
        let mut least = self.follower.least(own);
        let mut most = self.owner.most(own, apart);
        if !own.is_across() {
            // A relay that has to move across the line goes off from one that fell silent near by.
            least = least.max(self.follower.keep_out.near_m());
            most = most.min(self.owner.keep_out.near_m());
        }
        let x_m = own.goal_m().max(least).min(most);
        // Whatever the limits ask for: toward a neighbour only as far as it has granted, back never beyond what was promised.
        let x_m = x_m.max(least.min(before.x_m)).min(most.max(before.x_m));
        let moves = is_ordered && !own.halted;
        let x_m = if moves { x_m } else { before.x_m };
        let across = if clear && moves { target } else { before };
        // A relay outside the box comes back as far as its limits allow, and goes no farther out.
        let wanted = across.cross_section().at(x_m);
        let next = own.config.cut_toward(wanted, before);
        let from = own.way_begins(before);
        let next = self.follower.keep_out.way(from, next, &own.config);
        let next = self.owner.keep_out.way(from, next, &own.config);
        self.own.reachable.go(next.x_m, now);
        self.own.go(next, now);
        if self.follower.is_ordered() {
            let upstream_m = self.follower.high_m(&self.own);
            self.owner.settle(&self.own, taken_m, upstream_m);
        }
        self.own.setpoint
    }

    /// Who has come up to the limit that a lost neighbour leaves is as far from it as it has to be.
    fn clear_near(&mut self) {
        let ReachableInterval { low_m, high_m, .. } = self.own.reachable;
        self.follower
            .keep_out
            .part(Side::Upstream, |near_m| low_m >= near_m);
        self.owner
            .keep_out
            .part(Side::Downstream, |near_m| high_m <= near_m);
    }

    /// Whether the chain is to open, which each relay passes on away from whoever needs it.
    fn open(&mut self, clear: bool) {
        let own = &mut self.own;
        let waits = !clear && !own.is_across();
        let close = self.follower.is_close(own) || self.owner.is_close(own);
        let tight = close && (self.follower.is_tight() || self.owner.is_tight());
        let needs = tight || waits && (self.follower.is_held(own) || self.owner.holds(own));
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        own.open = needs || up.opens || down.opens;
        let (upward, downward) = (needs || down.opens, needs || up.opens);
        up.pass_open(upward);
        down.pass_open(downward);
    }

    /// Returns true if this relay is known to be in order with both neighbours.
    fn is_ordered(&self) -> bool {
        self.follower.is_ordered() && self.owner.is_ordered(&self.own)
    }

    /// Returns true if this relay and a neighbour, or its two neighbours, are known not to be in order. Each of the two may be taken to be in
    /// order with this relay, though only by the error of the reports, and the two may not pass each other.
    fn is_out_of_order(&self) -> bool {
        let (up, down) = (&self.follower.association, &self.owner.association);
        self.follower.is_out_of_order(&self.own)
            || self.owner.is_out_of_order(&self.own)
            || up.seen_m() - down.seen_m() > 2.0 * self.own.config.hover_m
    }

    /// Returns true if this relay is on its own side of both neighbours, by what they told or by the places at which they were reported.
    fn is_seen_in_order(&self) -> bool {
        let own = &self.own;
        let seen = |association: &Association, side| association.is_seen_in_order(own, side);
        (self.follower.is_ordered() || seen(&self.follower.association, Side::Upstream))
            && (self.owner.is_ordered(own) || seen(&self.owner.association, Side::Downstream))
    }

    /// Halts this relay while it, or a relay that requests it, is not in order.
    fn halt(&mut self, is_ordered: bool, now: Instant) {
        self.disorder &= !is_ordered && !self.is_seen_in_order();
        self.disorder |= self.is_out_of_order();
        let halted = self.pass_halt();
        self.own.halt(halted || !is_ordered, now);
    }

    /// Passes on requests to halt, and returns true if there are any.
    fn pass_halt(&mut self) -> bool {
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        let (upstream, downstream) = (up.requests_halt(), down.requests_halt());
        up.pass_halt(self.disorder || downstream);
        down.pass_halt(self.disorder || upstream);
        self.disorder || upstream || downstream
    }

    /// Where it is safe to fly, as [`steer`](Self::steer) gave it last.
    pub const fn setpoint(&self) -> Option<Placement> {
        self.own.setpoint
    }

    /// The next thing to tell a neighbour: on which side, to which node, what.
    pub fn poll(&mut self) -> Option<(Side, u16, Fence)> {
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        for (side, association) in [(Side::Upstream, up), (Side::Downstream, down)] {
            if let Some(fence) = association.part() {
                return Some((side, association.node, fence));
            }
        }
        if !self.flown || self.own.target.is_none() || !self.own.reachable.is_known() {
            self.pass_halt();
            let (up, down) = (&mut self.follower.association, &mut self.owner.association);
            let told = [(Side::Upstream, up), (Side::Downstream, down)]
                .into_iter()
                .find_map(|(side, association)| {
                    let fence = association.tell_alone(&self.own)?;
                    Some((side, association.node, fence))
                });
            if let Some((_, _, fence)) = &told {
                self.own.told = fence.across.at(fence.x_m);
            }
            return told;
        }
        let own = &self.own;
        let placed = self.owner.is_ordered(own);
        if placed {
            let taken_m = self.follower.taken_m();
            self.follower.agree(own, self.owner.kept(own, taken_m));
        }
        let low_m = self.owner.low_m(own);
        if let Some(fence) = self.follower.tell(own, low_m, placed) {
            return Some((Side::Upstream, self.follower.association.node, fence));
        }
        let moves = self.follower.is_ordered();
        let upstream_m = self.follower.high_m(own);
        let taken_m = self.follower.taken_m();
        let fence = self.owner.tell(own, taken_m, upstream_m, moves)?;
        Some((Side::Downstream, self.owner.association.node, fence))
    }

    /// Has everything told again that may have been lost, and says whether there was anything. To be called every second or so.
    pub fn remind(&mut self) -> bool {
        let begun = self.own.setpoint.is_some() && self.own.reachable.is_known();
        self.waits = if begun && !self.is_ordered() {
            self.waits.saturating_add(1)
        } else {
            0
        };
        self.disorder |= self.waits >= MOST_WAITS && !self.is_seen_in_order();
        let there = self.is_there();
        let follower = self.follower.association.node != 0 && !(there && self.follower.is_agreed());
        let owner = self.owner.association.node != 0 && !(there && self.owner.is_agreed());
        let (up, down) = (&mut self.follower.association, &mut self.owner.association);
        self.own.age();
        // A relay that is in no association tells its place less often, unless it moves.
        self.reminders = self.reminders.wrapping_add(1);
        let speaks = begun || self.own.has_moved() || self.reminders.is_multiple_of(ALONE_EVERY);
        up.due |= follower && (speaks || up.tells_halt());
        down.due |= owner && (speaks || down.tells_halt());
        up.age();
        down.age();
        let leaves = up.remind() | down.remind();
        follower || owner || leaves
    }

    /// Whether the setpoint is the agreed place, cut to the box, and the relay was reported to be there since.
    pub fn is_there(&self) -> bool {
        let own = &self.own;
        match (own.target, own.setpoint) {
            (Some(target), Some(setpoint)) => {
                !(own.open || own.halted)
                    && (target.x_m - setpoint.x_m).abs() <= own.config.rounding()
                    && own.reachable.is_still()
                    && own.is_across()
                    && own.still
            }
            _ => false,
        }
    }

    /// Returns what keeps this relay from its place on `side`, by what was received so far; `None` if nothing does, or no place is agreed.
    ///
    /// While a new agreement spreads it may be about places of the one before. While the relay is not flown only
    /// [`HoldReason::Order`] is possible: the drone is on the wrong side of a neighbour that is flown.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        let own = &self.own;
        if !self.flown {
            let wrong = match side {
                Side::Upstream => self.follower.association.is_passed(own, side),
                Side::Downstream => self.owner.association.is_passed(own, side),
            };
            return wrong.then_some(HoldReason::Order);
        }
        own.target?;
        let reason = match side {
            Side::Upstream => self.follower.hold_reason(own),
            Side::Downstream => self.owner.hold_reason(own, self.follower.taken_m()),
        };
        let association = match side {
            Side::Upstream => &self.follower.association,
            Side::Downstream => &self.owner.association,
        };
        let halted = association.requests_halt();
        reason
            .or(halted.then_some(HoldReason::Halted))
            .or_else(|| self.pending(side))
    }

    /// Returns the reason for a setpoint that has stood for long on its way toward `side`.
    fn pending(&self, side: Side) -> Option<HoldReason> {
        let own = &self.own;
        let (clear, keep_out, association) = match side {
            Side::Upstream => (
                self.follower.is_clear(own),
                &self.follower.keep_out,
                &self.follower.association,
            ),
            Side::Downstream => (
                self.owner.is_clear(own),
                &self.owner.keep_out,
                &self.owner.association,
            ),
        };
        let waits = own.waits(side, clear);
        waits.then(|| keep_out.reason(association.node, HoldReason::Pending))
    }

    /// Inputs that were refused: not a number, or out of range. It stays at its maximum.
    pub const fn refused(&self) -> u32 {
        self.refused
    }
}

#[inline(never)] // called from several places
fn is_placement(place: Placement) -> bool {
    is_place(place.x_m) && is_place(place.y_m) && is_place(place.altitude_m)
}
