//! The lease of a view: how long a relay may hold what was agreed on, by its own clock, before the others may fly something else.
//!
//! From the first agreement on the leader sends a *pulse* through the view, again and again. It goes onward to the last relay and back; one
//! that has come back to the leader is over, and only then the next one begins. So the next one is the proof that all took part in the one
//! before, and renews the lease.
//!
//! | who | what happens | what it does |
//! | --- | --- | --- |
//! | leader | it is time, and none is under way | a pulse: hand it on |
//! | any | a pulse, while this relay has agreed on no place in the view | ask for a new view |
//! | any | the next pulse | the lease counts from when it handed on the one before; hand it on |
//! | any | the first ones, each with more than twice the span of the one before | no lease yet: it would not last until the one after |
//! | any | the same again | say whether it has come back |
//! | last | a pulse | it has come back: say so |
//! | any | it has come back | say so; at the leader the lease counts from when it began, and the next one is due after a period |
//! | any | the lease has run out | ask for a new view, and hold nothing that was agreed on |
//!
//! *Why it is safe.* Let all have taken part in pulse n, and relay r have handed it on at t: r holds the view until t + span. Any other
//! relay q said that pulse n had come back not before t: nearer to the leader after r said so, farther from it after r had handed it on.
//! Who votes for a view without members of this one says until when they may hold it, span after it last said so; that is never
//! before r lets go.
//!
//! The span is `dead_after`, or three times as long as a pulse took lately and two periods, at most eight times `dead_after`: where many
//! frames are lost a silence says less. The period from one to the next is half of `probe_after`, or twice as
//! long as a pulse takes, up to a quarter of `dead_after`.

use super::circulation::{Circulation, Reply};
use super::context::{Context, Effects};
use super::timing::{PAUSE, earliest, longest_lease, tenths};
use super::view::electorate::Held;
use crate::settings::Settings;
use crate::time::{Duration, Instant};
use crate::view::ViewId;
use crate::wire::message::{Message, Pulse, Pulsed};

/// Of a lease.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum LeaseState {
    /// Nothing has been agreed on in this view, or not all know it yet.
    Open,
    Until(Instant),
    Lapsed,
}

/// The last pulse that a relay took part in.
#[derive(Clone, Copy, Debug)]
struct Current {
    number: u16,
    /// In tenths of a second.
    span: u16,
}

/// The lease of one relay.
#[derive(Clone, Debug)]
pub(crate) struct Lease {
    state: LeaseState,
    current: Option<Current>,
    /// Until when others may count on this relay.
    relied_on: Instant,
    /// The view accepted last, and until when its places are not to be taken, once all have accepted it.
    rest: (ViewId, Instant),
    /// Until when members of views before may hold what was agreed on there, as far as that is known.
    bound: Option<Instant>,
    /// True once all relays of the view are known to have accepted it, or to have taken part in a pulse.
    is_whole: bool,
    /// True once this relay has agreed on its place in this view.
    is_agreed: bool,
    /// At the leader: when the next pulse begins, and how long they took lately.
    next_at: Option<Instant>,
    slowest: Duration,
    circulation: Circulation,
}

const fn from_tenths(tenths: u16) -> Duration {
    Duration::from_millis(100 * tenths as u64)
}

impl Lease {
    /// A relay that was switched on at `now`: it may have been in a view that it does not remember.
    pub(crate) fn new(seed: u32, now: Instant, settings: &Settings) -> Self {
        Self {
            state: LeaseState::Open,
            current: None,
            relied_on: now + settings.dead_after,
            rest: (ViewId::LOADED, now),
            bound: Some(now),
            is_whole: false,
            is_agreed: false,
            next_at: None,
            slowest: Duration::from_micros(0),
            circulation: Circulation::new(seed),
        }
    }

    /// It was in a view before it was switched on: the others may count on it for as long as a lease can take.
    pub(crate) fn resume(&mut self, settings: &Settings) {
        self.relied_on = self.relied_on + longest_lease(settings);
    }

    /// Until when this relay may hold what was agreed on; `None` where that is not known, or has run out.
    pub(crate) const fn until(&self) -> Option<Instant> {
        match self.state {
            LeaseState::Until(at) => Some(at),
            LeaseState::Open | LeaseState::Lapsed => None,
        }
    }

    /// Whether nothing has been agreed on in this view, as far as is known here.
    pub(crate) const fn is_open(&self) -> bool {
        matches!(self.state, LeaseState::Open)
    }

    /// How long a silence has to be until it says something.
    pub(crate) fn span(&self, settings: &Settings) -> Duration {
        let told = self.current.map_or(0, |current| current.span);
        from_tenths(told).max(settings.dead_after)
    }

    /// For how long what was agreed on may be held elsewhere.
    pub(crate) fn held(&self, now: Instant) -> Held {
        Held {
            lease_left: self.relied_on.since(now),
            view: self.rest.0,
            rest: self.bound.map(|until| until.since(now)),
        }
    }

    /// `view` is accepted, which follows `base`, and whose places are not to be taken before `rest`.
    ///
    /// Members of `base` that have not accepted it yet may hold what was agreed on there, but not for longer than they rely on this relay,
    /// if it was one of them: without it no more pulses go through.
    ///
    /// A pulse that is under way counts as slow only if the view loses no relay (`lost`) and this relay was a member of `base`. A relay that
    /// was left out of `base` holds a pulse of an older view, whose age is the time for which the relay was away.
    pub(crate) fn renew(
        &mut self,
        now: Instant,
        (view, base): (ViewId, ViewId),
        rest: Instant,
        lost: bool,
    ) {
        let is_under_way = self.circulation.is_outstanding();
        let started_at = self.circulation.started_at();
        if let Some(at) = started_at.filter(|_| is_under_way && !lost && self.rest.0 == base) {
            self.slowest = self.slowest.max(now.since(at));
        }
        let known = self.bound.filter(|_| self.rest.0 == base);
        self.bound = known.map(|until| until.max(rest).max(self.relied_on));
        self.rest = (view, rest);
        self.leave();
    }

    /// Gives up the lease of the view: nothing is agreed on until this relay agrees on its place in another one.
    pub(crate) fn leave(&mut self) {
        self.is_whole = false;
        self.is_agreed = false;
        self.state = LeaseState::Open;
        self.current = None;
        self.next_at = None;
        self.circulation.withdraw();
    }

    /// All have accepted the view that this relay is in.
    pub(crate) fn commit(&mut self) {
        self.bound = Some(self.rest.1);
        // The view that relays are switched on in was accepted by nobody.
        self.is_whole |= self.rest.0 != ViewId::LOADED;
    }

    /// Returns true once all relays of the view are known to be in it.
    #[cfg(feature = "upload")]
    pub(crate) const fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// This relay has agreed on its place in the view. If it leads, all others have, and it begins the pulses.
    pub(crate) fn begin(&mut self, now: Instant, leads: bool) {
        self.is_agreed = true;
        if leads && self.current.is_none() && self.next_at.is_none() {
            self.next_at = Some(now + PAUSE);
        }
    }

    /// A pulse, or what came back of it, of the view that this relay is in, from the neighbour that has it to say.
    pub(crate) fn handle(&mut self, context: &Context<'_>, message: &Message) -> Effects {
        match message {
            Message::Pulse(pulse) => self.on_pulse(context, *pulse),
            Message::Pulsed(pulsed) => self.on_pulsed(context, *pulsed),
            _ => Effects::STALE,
        }
    }

    fn on_pulse(&mut self, context: &Context<'_>, pulse: Pulse) -> Effects {
        let mut effects = Effects::NONE;
        if let Some(current) = self.current {
            match pulse.number.wrapping_sub(current.number) {
                0 => {
                    let path = context.path_to_leader();
                    self.circulation.on_duplicate(context.now, path);
                    return Effects::REPEATED;
                }
                1 if !self.circulation.is_outstanding() => {
                    self.grant(context, current, pulse.lease);
                    effects.heard_back = self.circulation.completed_at();
                }
                // The leader has begun anew, or this relay was not asked for long.
                2..=0x7FFF => {}
                _ => return Effects::STALE,
            }
        } else if !self.is_agreed {
            // Another node with this relay's number has agreed on the place.
            return Effects::FOREIGN;
        }
        self.take(context, pulse.number, pulse.lease);
        effects
    }

    /// All took part in `pulse`; so long ago, perhaps, that the lease has run out since. `next` is the span of the one after.
    ///
    /// Where that is more than twice as long, the first ones were too short: the lease would run out before it could be renewed.
    fn grant(&mut self, context: &Context<'_>, pulse: Current, next: u16) {
        let now = context.now;
        let Some(forwarded_at) = self.circulation.started_at() else {
            return;
        };
        if self.state == LeaseState::Open && next / 2 > pulse.span {
            return;
        }
        let until = forwarded_at + from_tenths(pulse.span);
        self.is_whole = true;
        if until > now {
            let until = self.until().map_or(until, |at| at.max(until));
            self.state = LeaseState::Until(until);
        }
    }

    fn take(&mut self, context: &Context<'_>, number: u16, span: u16) {
        self.current = Some(Current { number, span });
        self.circulation.start(context.now);
        if context.is_last() {
            self.finish(context);
        }
    }

    /// The current pulse has come back from the last relay.
    fn finish(&mut self, context: &Context<'_>) {
        let (Some(current), Some(forwarded_at)) = (self.current, self.circulation.started_at())
        else {
            return;
        };
        self.relied_on = self.relied_on.max(context.now + from_tenths(current.span));
        self.circulation
            .complete(context.now, context.path_to_leader());
        if !context.leads() {
            return;
        }
        // After a slow one the next one follows soon; where all are slow the channel is left some time for others.
        let period = self.period(context.settings());
        // The first two follow each other at once: nobody else has a lease before the second.
        let first = self.state == LeaseState::Open;
        let took = context.now.since(forwarded_at);
        // A run of lost frames is remembered for a minute or two.
        let part = self.slowest.as_micros() / 32;
        let lately = self.slowest.as_micros().saturating_sub(part);
        self.slowest = took.max(Duration::from_micros(lately));
        let next = self.given(context.settings());
        self.grant(context, current, next);
        let soon = context.now + PAUSE;
        let paced = forwarded_at + period;
        self.next_at = Some(if first { soon } else { paced.max(soon) });
    }

    fn period(&self, settings: &Settings) -> Duration {
        let half = Duration::from_micros(settings.probe_after.as_micros() / 2);
        // The span that was told last may be the shortest one: several have to fit into it.
        let most = Duration::from_micros(settings.dead_after.as_micros() / 4);
        half.max(self.slowest.times(2).min(most)).max(PAUSE)
    }

    /// What the leader gives the others, in tenths of a second.
    fn given(&self, settings: &Settings) -> u16 {
        let slow = self.slowest.times(3).as_micros();
        let wanted = slow.saturating_add(self.period(settings).times(2).as_micros());
        let most = longest_lease(settings);
        let span = Duration::from_micros(wanted)
            .min(most)
            .max(settings.dead_after);
        tenths(span)
    }

    fn on_pulsed(&mut self, context: &Context<'_>, pulsed: Pulsed) -> Effects {
        let is_current = self
            .current
            .is_some_and(|current| current.number == pulsed.number);
        if !(is_current && self.circulation.is_outstanding()) {
            return Effects::STALE;
        }
        let forwarded_at = self.circulation.started_at();
        if pulsed.done {
            self.finish(context);
        } else {
            let path = context.path_to_last();
            self.circulation.on_in_progress(context.now, path);
        }
        Effects {
            heard_onward: forwarded_at,
            ..Effects::NONE
        }
    }

    /// Does what is due: a pulse at the leader, one more time, or nothing any more.
    pub(crate) fn handle_timeout(&mut self, context: &Context<'_>) -> Effects {
        let now = context.now;
        let hop_time = context.settings().hop_time;
        let resent = self.circulation.handle_timeout(now, hop_time);
        if self.next_at.is_some_and(|at| at <= now) {
            self.next_at = None;
            let number = self.current.map_or(0, |current| current.number);
            let span = self.given(context.settings());
            self.take(context, number.wrapping_add(1), span);
        }
        let lapsed = self.until().is_some_and(|at| at <= now);
        if lapsed {
            self.state = LeaseState::Lapsed;
        }
        Effects {
            resent,
            lapsed,
            view_needed: lapsed,
            ..Effects::NONE
        }
    }

    /// What is to be sent onward; it is taken for sent then.
    pub(crate) fn take_onward(&mut self, context: &Context<'_>) -> Option<Message> {
        let is_due = self.circulation.poll_forward();
        let current = self.current.filter(|_| is_due)?;
        self.circulation
            .await_result(context.now, context.path_to_last());
        Some(Message::Pulse(Pulse {
            number: current.number,
            mission: context.digest(),
            lease: current.span,
        }))
    }

    /// What is to be sent back; it is taken for sent then.
    pub(crate) fn take_back(&mut self, context: &Context<'_>) -> Option<Message> {
        let reply = self.circulation.poll_reply()?;
        let current = self.current?;
        Some(Message::Pulsed(Pulsed {
            number: current.number,
            mission: context.digest(),
            done: reply == Reply::Result,
        }))
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let pulse = earliest(self.next_at, self.circulation.next_timeout());
        earliest(pulse, self.until())
    }
}

#[cfg(test)]
mod tests {
    use super::{Current, Lease};
    use crate::settings::Settings;
    use crate::time::{Duration, Instant};
    use crate::view::ViewId;

    /// Span in tenths of a second that a leader grants after it accepts a view 40 s after an unfinished pulse of view 1. The new view follows
    /// view `base` and loses no relay.
    fn span_after(base: u32) -> u16 {
        let settings = Settings::default();
        let view = |number: u32| ViewId::from_bits(number << 10 | 1);
        let mut lease = Lease::new(1, Instant::ZERO, &settings);
        lease.rest = (view(1), Instant::ZERO);
        lease.current = Some(Current {
            number: 7,
            span: 150,
        });
        lease.circulation.start(Instant::ZERO);
        let now = Instant::ZERO + Duration::from_millis(40_000);
        lease.renew(now, (view(base + 1), view(base)), now, false);
        lease.given(&settings)
    }

    #[test]
    fn an_unfinished_pulse_of_the_view_before_is_a_slow_one() {
        assert!(span_after(1) >= 1_200);
    }

    #[test]
    fn an_unfinished_pulse_of_a_relay_that_was_left_out_in_between_is_not() {
        assert_eq!(span_after(2), 150);
    }
}
