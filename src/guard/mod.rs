//! Keeps relays apart while they fly from one agreed set of places to the next, whatever is lost or late between them.
//!
//! Relays stand in order along x, so relays that are the separation apart *along x* from their neighbours are that far from
//! every other relay, at whatever altitudes: that is what the guard keeps, and why it does not count height. Places that were
//! agreed closer along x than that (methods that choose altitudes do so in dense chains) are approached as far as this
//! allows, and [`Guard::hold_reason`] says so.
//!
//! Between two neighbours there is a *fence*, a line across x. The relay upstream of it, its *owner*, stays the separation
//! before it; the other one, the *follower*, stays at it or beyond.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`config`] | the box that no setpoint leaves, and what else is set before flight |
//! | `reachable` | where the relay may be, by what was reported and what it was told to fly to |
//! | `association` | which incarnation of the neighbour a message is from, so that late ones cannot be mistaken |
//! | `owner` | the fence downstream, which this relay places |
//! | `follower` | the fence upstream, which the neighbour places |
//!
//! # Rules
//!
//! *Own stretch*: from the lowest to the highest x at which the relay may be, be it stopped anywhere on its way.
//!
//! | | rule | so that |
//! | --- | --- | --- |
//! | 1 | The follower never lowers its setpoint below the newest fence it has heard of, and flies up to it if it is below. | what it promises holds |
//! | 2 | It tells the newest fence it has heard of, and the low end of its own stretch. | - |
//! | 3 | The owner counts on the lowest of: that low end, if told together with the newest fence; every fence announced since. | no message under way can make the follower come nearer than it is counted on |
//! | 4 | The owner never raises its setpoint to less than the separation before what it counts on. | the stretches of the two are the separation apart |
//! | 5 | The owner announces no fence nearer than the separation beyond the high end of its own stretch. | a fence it lowers is one it has cleared already |
//! | 6 | As far as 5 allows, the fence goes halfway between the two agreed places (and half the separation on). | both can get where they are to be |
//! | 7 | The first fence is right at the owner's own stretch; other fences, and changes of altitude, begin when the follower has cleared it. | a start that is too close is opened first, and no relay sinks onto another |
//! | 8 | A setpoint stays until both neighbours are known to be in order: the follower has told that it is beyond the owner, the owner has announced a fence. It tells one of them only once it knows that of the other one. | nothing is granted unheard (switched on, rebooted, newly linked); relays in the wrong order, and all others, stay where they are |
//! | 9 | Nothing lapses with time: of a neighbour that is replaced or starts anew, the last limit stays until it speaks for itself, or [`Guard::forget`]; if it was never heard, this relay goes no farther toward it. | a silent relay that still hovers is not flown into |
//!
//! # Why everybody arrives
//!
//! Let the places agreed on be the separation apart; then so are the fences' goals. A fence that has to be lowered waits for
//! its owner to come down, and that relay waits only for the fence upstream, if that has to be lowered, too: the first of them
//! waits for nobody, and so, one after the other, all come down. In the same way all that have to be raised are, from the
//! receiver's end. Then every relay finds its place between its fences. Fences go along with the flight, so that is one
//! flight's time and a few messages a relay at the worst.
//!
//! # What is not promised
//!
//! - Hovering off the reported place by up to [`GuardConfig::hover_m`] takes as much from the separation at either relay, and as
//!   much again each time that one is rebooted before a fence has opened what is missing.
//! - A relay says nothing before it has both a place to go to and a report of where it is: until then nobody moves toward it.
//! - A relay that is rebooted has forgotten whom it was linked to: it has to begin with the neighbours of the mission and be
//!   linked around those that are silent, so that rule 9 holds it back.
//! - The numbers of the associations are random: `seed` has to differ from one start to the next.

mod association;
pub mod config;
mod fence;
mod follower;
mod owner;
mod reachable;
#[cfg(test)]
mod tests;

use crate::place::{CrossSection, Placement};
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;

use crate::jitter::Jitter;
use config::GuardConfig;
use fence::is_place;
pub use fence::{Fence, HoldReason};
use follower::FenceFollower;
use owner::FenceOwner;
use reachable::ReachableInterval;

/// One relay's guard: where it was agreed to be goes in, where it is safe to fly now comes out.
///
/// Feed it with [`commit`](Self::commit), [`position`](Self::position), [`hear`](Self::hear), [`link`](Self::link); after each,
/// call [`steer`](Self::steer), fly to what it gives, then send what [`poll`](Self::poll) has to say. Every call does a few dozen
/// operations, none depends on the length of the chain.
#[derive(Clone, Copy, Debug)]
pub struct Guard {
    config: GuardConfig,
    jitter: Jitter,
    born: Instant,
    /// Where the relay was agreed to be, inside the box.
    target: Option<Placement>,
    /// Before the first setpoint: where the relay was reported last.
    found: Option<Placement>,
    setpoint: Option<Placement>,
    reachable: ReachableInterval,
    /// Where the relay was across the line when it was reported last.
    across: CrossSection,
    follower: FenceFollower,
    owner: FenceOwner,
    refused: u32,
}

impl Guard {
    /// A guard that starts at `now` between `neighbours`, toward Tx and toward Rx; `None` where the chain ends.
    ///
    /// `config` has to be valid ([`GuardConfig::is_valid`]); `seed` has to differ from relay to relay and from start to start.
    pub fn new(config: GuardConfig, neighbours: [Option<u16>; 2], seed: u32, now: Instant) -> Self {
        let [upstream, downstream] = neighbours;
        let mut jitter = Jitter::new(seed);
        Self {
            config,
            follower: FenceFollower::new(upstream.unwrap_or(0), &mut jitter),
            owner: FenceOwner::new(downstream.unwrap_or(0), &mut jitter),
            jitter,
            born: now,
            target: None,
            found: None,
            setpoint: None,
            reachable: ReachableInterval::unknown(now),
            across: CrossSection::on_line(0.0),
            refused: 0,
        }
    }

    /// The chain has agreed that this relay shall be at `place`. It is cut to the box.
    pub fn commit(&mut self, place: Placement) {
        if !is_placement(place) {
            return bump(&mut self.refused);
        }
        self.target = Some(self.config.cut(place));
        self.follower.association.due = true;
        self.owner.association.due = true;
    }

    /// Whether `place` is where the relay is on its way to, or is.
    pub fn is_for(&self, place: Placement) -> bool {
        self.target == Some(self.config.cut(place))
    }

    /// The flight controller has found that the relay was at `place` at time `at`: when that was measured, not when it was read.
    ///
    /// The first setpoint is a place reported since the start and inside the box along x.
    pub fn position(&mut self, at: Instant, place: Placement) {
        if !is_placement(place) {
            return bump(&mut self.refused);
        }
        self.across = place.cross_section();
        if self.setpoint.is_some() {
            self.reachable.report(at, place.x_m, &self.config);
        } else if at >= self.born && self.config.holds(place.x_m) {
            self.found = Some(self.config.cut(place));
        }
    }

    /// What node `from` at `side` says. What is out of range is counted, what is of an earlier association or of another node ignored.
    pub fn hear(&mut self, side: Side, from: u16, fence: &Fence) {
        if !fence.is_valid() {
            return bump(&mut self.refused);
        }
        match side {
            Side::Upstream if self.follower.association.node == from => {
                self.follower.hear(fence, &self.reachable, &mut self.jitter);
            }
            Side::Downstream if self.owner.association.node == from => {
                let apart = self.config.separation_m;
                self.owner
                    .hear(fence, &self.reachable, apart, &mut self.jitter);
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
                self.follower.link(node, &self.reachable, &mut self.jitter);
            }
            Side::Downstream if self.owner.association.node != node => {
                let apart = self.config.separation_m;
                self.owner
                    .link(node, &self.reachable, apart, &mut self.jitter);
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
        let target = self.target?;
        let Some(before) = self.setpoint else {
            let found = self.found?;
            self.reachable = ReachableInterval::at(found.x_m, now);
            self.follower.keep_out.begin(found.x_m);
            self.owner.keep_out.begin(found.x_m);
            self.setpoint = Some(found);
            return self.setpoint;
        };
        let apart = self.config.separation_m;
        self.follower.settle(&self.reachable);
        let least = self.follower.least(&self.reachable);
        let most = self.owner.most(&self.reachable, apart);
        let x_m = target.x_m.max(least).min(most);
        // Whatever the limits ask for: toward a neighbour only as far as it has granted, back never beyond what was promised.
        let x_m = x_m.max(least.min(before.x_m)).min(most.max(before.x_m));
        let is_ordered = self.follower.is_ordered() && self.owner.is_ordered(&self.reachable);
        let x_m = if is_ordered { x_m } else { before.x_m };
        let clear = self.follower.is_clear() && self.owner.is_clear();
        let across = if clear { target } else { before };
        let wanted = across.cross_section().at(x_m);
        let next = self.config.cut(wanted);
        self.reachable.go(next.x_m, now);
        self.setpoint = Some(next);
        if self.follower.is_ordered() {
            self.owner.settle(&self.reachable, target.x_m, apart);
        }
        self.setpoint
    }

    /// Where it is safe to fly, as [`steer`](Self::steer) gave it last.
    pub const fn setpoint(&self) -> Option<Placement> {
        self.setpoint
    }

    /// The next thing to tell a neighbour: on which side, to which node, what.
    pub fn poll(&mut self) -> Option<(Side, u16, Fence)> {
        let target = self.target.filter(|_| self.reachable.is_known())?;
        if self.owner.is_ordered(&self.reachable)
            && let Some(fence) = self.follower.tell(&self.reachable, target.x_m)
        {
            return Some((Side::Upstream, self.follower.association.node, fence));
        }
        let apart = self.config.separation_m;
        let moves = self.follower.is_ordered();
        let fence = self.owner.tell(&self.reachable, target.x_m, apart, moves)?;
        Some((Side::Downstream, self.owner.association.node, fence))
    }

    /// Has everything told again that may have been lost, and says whether there was anything. To be called every second or so.
    pub fn remind(&mut self) -> bool {
        let there = self.is_there();
        let follower = self.follower.association.node != 0 && !(there && self.follower.is_agreed());
        let owner = self.owner.association.node != 0 && !(there && self.owner.is_agreed());
        self.follower.association.due |= follower;
        self.owner.association.due |= owner;
        follower || owner
    }

    /// Whether the setpoint is the agreed place, cut to the box, and the relay was reported to be there since.
    pub fn is_there(&self) -> bool {
        let off = self.config.rounding();
        let near = |is: f32, to_be: f32| (to_be - is).abs() <= self.config.hover_m + off;
        match (self.target, self.setpoint) {
            (Some(target), Some(setpoint)) => {
                (target.x_m - setpoint.x_m).abs() <= off
                    && self.reachable.is_still()
                    && near(self.across.y_m, target.y_m)
                    && near(self.across.altitude_m, target.altitude_m)
            }
            _ => false,
        }
    }

    /// What at `side` keeps this relay from its place, by what was heard so far; `None` if nothing does, or no place is agreed.
    ///
    /// While a new agreement spreads it may tell of places that are not to be.
    pub fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        let target = self.target?.x_m;
        let near = self.config.separation_m - self.config.rounding();
        match side {
            Side::Upstream => self.follower.hold_reason(target, near),
            Side::Downstream => self.owner.hold_reason(&self.reachable, target, near),
        }
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
