//! How the chain forms anew: hellos between nodes that might become neighbours, the call for a new view, and its coming.
//!
//! [`members`](super::members) has the rules; what a new view consists of is worked out by `share::roll`.

use super::beside::CANDIDATES;
use super::exchange::Phase;
use super::liveness::tick;
use super::members::Members;
use super::timers::Timer;
use super::{MEMBERSHIP, Node, PAUSE};
use crate::event::Event;
use crate::mission::{Heading, Mission};
use crate::settings::Method;
use crate::side::Side;
use crate::stats::bump;
use crate::time::Instant;
use crate::wire::digest::MissionId;
use crate::wire::message::Hello;

impl Node {
    /// Whether this relay is to call for views: nobody is before it.
    fn leads(&mut self) -> bool {
        let back = Side::back(self.mission.heading());
        self.beside(back).is_end()
    }

    /// Owes node `to` at `side` a hello, which may ask for one in return.
    pub(super) fn owe_hello(&mut self, side: Side, to: u16, ask: bool) {
        if MEMBERSHIP {
            let distance = to.abs_diff(self.members.node);
            self.beside(side).owe(distance, ask);
        }
    }

    /// The next hello that is owed: at which side, to which node.
    pub(super) fn next_hello(&mut self) -> Option<(Side, u16, Hello)> {
        let (own, all) = (self.members.node, self.members.all);
        for side in [Side::Upstream, Side::Downstream] {
            for _ in 0..CANDIDATES {
                let Some((distance, ask)) = self.beside(side).take_hello() else {
                    break;
                };
                let to = match side {
                    Side::Upstream => own.saturating_sub(distance),
                    Side::Downstream => own.saturating_add(distance),
                };
                if to >= 1 && to <= all && self.side_of(to).is_some() {
                    return Some((side, to, self.hello(side, ask)));
                }
            }
        }
        None
    }

    pub(super) fn hello(&mut self, side: Side, ask: bool) -> Hello {
        let back = Side::back(self.mission.heading());
        let other = match side {
            Side::Upstream => Side::Downstream,
            Side::Downstream => Side::Upstream,
        };
        Hello {
            mission: self.members.digest,
            newest: self.members.newest,
            neighbour: self.beside(side).node(),
            ask,
            form: self.members.calls && side == back,
            fresh: self.share.is_fresh(),
            ready: self.beside(other).is_ready(),
            holds: self.members.held,
            flies: self.members.flown == self.members.held,
        }
    }

    /// A hello from node `from` at `side`, of the same mission.
    pub(super) fn on_hello(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.members.node;
        let known = self.members.newest;
        self.members.heard_of(hello.newest);
        if hello.ask {
            self.owe_hello(side, from, false);
        }
        let node = self.beside(side).node();
        if node == from {
            #[cfg(feature = "upload")]
            self.compare(side, from, hello.holds);
            self.beside(side).holds = Some(hello.holds);
            if self.seeks() {
                self.told(now, side, hello.neighbour == own);
            }
            let waits = self.share.called().is_some();
            if hello.form && (hello.newest >= known || hello.fresh && !waits) {
                self.call(now);
            }
        } else if self.seeks() {
            self.consider(now, side, from, hello);
        }
        self.review(now);
    }

    /// A hello from node `from` at `side`, which is not taken for the neighbour there.
    fn consider(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let settings = self.settings;
        let own = self.members.node;
        if self.beside(side).notice(now, &settings) {
            self.timers.set(Timer::of(side), now + tick(&settings));
        }
        if hello.neighbour == own || hello.neighbour == 0 {
            let node = self.beside(side).node();
            let courts = hello.neighbour == own;
            let nearer = from.abs_diff(own) < node.abs_diff(own);
            if self
                .beside(side)
                .consider(from, courts, nearer, hello.ready, now, &settings)
            {
                self.beside(side).holds = Some(hello.holds);
                self.pending.raise(Event::NeighbourBack(side));
                self.timers.set(Timer::of(side), now + tick(&settings));
                self.owe_hello(side, from, true);
                self.told(now, side, courts);
            }
        }
    }

    /// The neighbour at `side` has said, one way or the other, whether it takes this relay for its own.
    pub(super) fn told(&mut self, now: Instant, side: Side, mutual: bool) {
        if !self.beside(side).told(mutual, now) {
            return;
        }
        let settings = self.settings;
        let wait = if mutual {
            settings.quiet
        } else {
            tick(&settings)
        };
        self.timers.set(Timer::of(side), now + wait);
        let newer = self.members.newest > self.members.view;
        if mutual && newer && !self.beside(side).has_grace(now) {
            // One of the two has missed something.
            self.call(now);
        }
        // What could not be said to it can now.
        self.onward_due |= mutual && self.share.phase() == Phase::Waiting;
    }

    /// Calls for a new view if the chain is another than the one agreed on.
    pub(super) fn review(&mut self, now: Instant) {
        if !MEMBERSHIP {
            return;
        }
        if self.upstream.has_changed(now) || self.downstream.has_changed(now) {
            self.call(now);
        }
        let (share, own) = self.parts();
        if own.end && share.called().is_some() {
            // Whoever was to be counted next is not there any more.
            let next = share.end_roll(own);
            self.proceed(now, next);
        }
    }

    /// Calls for a new view, from now on until it comes.
    pub(super) fn call(&mut self, now: Instant) {
        if MEMBERSHIP && self.members.call() {
            self.timers.set(Timer::Call, now + PAUSE);
        }
    }

    /// It has not come yet, or it is time to ask for a place in the chain.
    pub(super) fn call_again(&mut self, now: Instant) {
        if !self.members.calls {
            if !self.share.is_fresh() {
                return;
            }
            self.members.call();
        }
        let settings = self.settings;
        let patience = self.members.patience(&settings);
        self.timers.set(Timer::Call, now + patience);
        if !self.leads() {
            let back = Side::back(self.mission.heading());
            let to = self.beside(back).node();
            self.owe_hello(back, to, true);
            return;
        }
        let Members { newest, held, .. } = self.members;
        let under_way = self
            .share
            .called()
            .is_some_and(|(view, mission_id)| view >= newest && mission_id == held);
        let Some(view) = newest.checked_add(1).filter(|_| !under_way) else {
            return;
        };
        self.members.heard_of(view);
        let back = Side::back(self.mission.heading());
        self.beside(back).called(true);
        let (share, own) = self.parts();
        let next = share.call(own, view);
        self.proceed(now, next);
    }

    /// The mission of mission_id `mission_id`, if it is the one flown or the one held.
    fn mission_of(&self, mission_id: MissionId) -> Option<Mission> {
        #[cfg(feature = "upload")]
        if mission_id != self.members.flown {
            return self.uploaded(mission_id);
        }
        (mission_id == self.members.flown).then_some(self.mission)
    }

    /// What came of a call is known: how many relays there are, or that they are too few.
    pub(super) fn formed(&mut self, now: Instant, granted: Option<u16>) {
        let place = self.share.place();
        let leads = place == 1;
        self.onward_due = false;
        self.busy_due = false;
        self.back_due = !leads;
        self.timers.stop(Timer::Repeat);
        self.timers.stop(Timer::Work);
        self.stats.sweeps = self.share.sweeps();
        let view = self.share.number();
        let mission_id = self.share.id().unwrap_or(self.members.flown);
        let mission = self.mission_of(mission_id).zip(granted);
        let mission = mission.and_then(|(mission, relays)| mission.with_relays(relays).ok());
        let (Some(relays), Some(mission)) = (granted, mission) else {
            self.pending.raise(Event::Cut);
            // Until somebody else is found there is nothing to ask again.
            self.members.calls = false;
            self.timers.stop(Timer::Call);
            self.upstream.refuse();
            self.downstream.refuse();
            if leads {
                self.share.cut();
            }
            return;
        };
        let index = match mission.heading() {
            Heading::TowardRx => place,
            Heading::TowardTx => relays.saturating_sub(place).saturating_add(1),
        };
        if mission_id == self.members.flown {
            self.mission = mission;
        } else {
            self.fly(mission, mission_id);
            self.pending.raise(Event::Adopted);
        }
        self.members.agree(view, index);
        let heading = mission.heading();
        self.beside(Side::back(heading)).agree_with_caller();
        self.beside(Side::onward(heading)).agree(place == relays);
        self.share.renew(leads);
        if self.settings.method == Method::Joint {
            self.timers.set(Timer::Work, now + PAUSE);
        }
        self.timers.stop(Timer::Call);
        bump(&mut self.stats.views);
        self.pending.raise(Event::Reformed);
        if mission_id != self.members.held {
            // A newer one has come in the meantime.
            self.call(now);
        }
        if leads {
            self.timers.set(Timer::Work, now + PAUSE);
        }
    }
}
