//! Lease: time during which a relay knows that no later view uses positions.
//!
//! A split chain agrees on new positions only in the part that has a quorum. Before that, the leases of all other
//! members must have expired. So a relay with a lease knows that the positions of its own view are the only ones.
//!
//! After the first agreement the leader sends renewals. A `Pulse` message is forwarded to the last relay, and the reply
//! `Pulsed` travels back. Only then the next renewal is sent. Renewal n + 1 therefore proves that every member took
//! part in renewal n, and extends the lease.
//!
//! | role | event | action |
//! | --- | --- | --- |
//! | leader | renewal due, none outstanding | send the next renewal |
//! | any | renewal received, but no position agreed on in this view | request a new view |
//! | any | next renewal received | extend the lease, counted from the forwarding of the previous renewal; forward it |
//! | any | next renewal, no lease yet, span more than doubled | grant no lease: the last renewal was forwarded with the short span, and its lease would expire before a renewal with the long span comes back |
//! | any | duplicate renewal received | reply whether it has completed |
//! | last | renewal received | reply: completed |
//! | any | completion received | forward it; at the leader: extend the lease from the start of this renewal, schedule the next one |
//! | any | lease expired | request a new view; the setpoint stays |
//!
//! # Expiry
//! The expiry stops no motion: the relay keeps its setpoint and requests a new view. From then on, relays of a
//! different view may fly to other positions; the guard's separation fences keep them apart.
//!
//! | state | after the expiry | code |
//! | --- | --- | --- |
//! | setpoint, guard, fences | unchanged | `Node::steer` |
//! | `Relay::lease` | `None` | [`Lease::until`] |
//! | `Event::LeaseLapsed` | raised once per view | `LayerEvent::Lapsed` in `Node::apply` |
//! | view | requested by hellos to the neighbour toward the leader | `Effects::view_needed`, `LayerEvent::RequestView` |
//! | links to the neighbours | kept until `NoQuorumTimer` expires, which runs while there is no quorum | `Node::drop_links_if_expired` |
//! | `Settings::without_quorum` | applies if the new view has no quorum, not at the expiry | `Node::wanted_place` |
//!
//! # Safety
//! All leases of a view have expired before the positions of a later view are agreed on. Suppose that every member took part in
//! renewal n and that relay r forwarded it at time t: its lease ends at t + span. Every other member reports the completion
//! no earlier than t: members closer to the leader after r has replied, members farther away after r has forwarded. A member that
//! votes for a view without r states when the last lease that it vouched for expires: span after its own last report, which is
//! never before r's expiry.
//!
//! A proposal may end with a view B that was decided before, on an earlier proposal, and that only some members have accepted. B
//! follows A. A relay that was polled in B and flies by A then knows a bound of all leases before B: the larger of two times. The
//! first is the end of the leases that it vouched for in A; a renewal of A that it completes later extends this time. The second
//! is the waiting time of the decision, which bounds the leases before A. No relay has a lease of B, because a renewal of B needs
//! all relays that were polled in B, and this one has completed none: it would know that B is agreed on, and reject the decision.
//!
//! # Timing
//! The span is three round trips plus two periods, at least `dead_after` and at most eight times `dead_after`: on a lossy channel
//! a silence is weaker evidence. The renewal period is the larger of half of `probe_after` and two round trips; the latter count
//! for at most a quarter of `dead_after`.

use super::circulation::{Circulation, Reply};
use super::context::OtherLeases;
use super::context::{Context, Effects, LayerEvent, Peer};
use super::context::{PAUSE, earliest, flying, longest_lease, respacing, tenths};
use crate::features::DEPARTURES;
use crate::settings::Settings;
use crate::time::{Duration, Instant};
use crate::view::ViewId;
use crate::wire::message::{AT_ONCE, Leave, Message, Orders, OwnRequests, Pulse, Pulsed};
use crate::wire::message::{Requests, push, used};

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum LeaseState {
    /// No lease yet: the view has no agreed positions, or some members possibly do not know them.
    Pending,
    Until(Instant),
    Lapsed,
}

/// Number of relays from which on spares for several departures are called during a motion.
const LONG: u16 = 16;

/// Last lease renewal that this relay took part in.
#[derive(Clone, Copy, Debug)]
struct Current {
    number: u16,
    /// Duration of the lease that the renewal grants, in tenths of a second.
    span: u16,
}

#[derive(Clone, Debug)]
pub(crate) struct Lease {
    state: LeaseState,
    current: Option<Current>,
    bounds: LeaseBounds,
    /// True once this relay knows that all members have accepted the view. Every completed lease renewal proves this,
    /// because every member takes part in the renewal.
    is_whole: bool,
    /// True once this relay has agreed on its position in this view.
    is_agreed: bool,
    /// Time at which the leader starts the next lease renewal; `None` if none is due.
    next_at: Option<Instant>,
    /// Maximum round trip of recent lease renewals. The stored value decays slowly.
    round_trip: Duration,
    circulation: Circulation,
    /// Orders of the leader in the last renewal of this view.
    orders: Orders,
    /// Requests of this relay and of all relays farther from the leader, from the last completed renewal. `None` until
    /// a renewal is completed.
    requests: Option<Requests>,
    /// Requests of this relay, and its knowledge of departures. Empty without the feature `departures`.
    departures: [Departures; DEPARTURES as usize],
}

/// Requests of this relay to the leader. At the leader also the state of departures from the chain.
#[derive(Clone, Copy, Debug)]
struct Departures {
    requests: OwnRequests,
    /// Number of relays in the view before a relay first requested to leave.
    complement: u16,
    /// Relay that requests to leave (0 for none), and the time of its first request. The request may be from an earlier
    /// view. Without a request: the time at which a spare was last reported.
    leaver: (u16, Instant),
    /// Last time at which all relays of the view were in place; at first the time of the first agreement.
    ///
    /// All are in place if two renewals in a row report it. The time is that of the leader.
    settled_at: Instant,
    /// True if the last renewal has reported that all relays of the view are in place.
    reported: bool,
    /// Time at which the last relay answered this view's first lease renewal, as estimated by this relay. `None` until
    /// this renewal has completed.
    turned_at: Option<Instant>,
}

/// Bounds of the ends of other relays' leases, as far as this relay knows them.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct LeaseBounds {
    /// Latest possible end of other members' leases that this relay's completed renewals have extended. Each lease
    /// renewal that this relay completes extends the leases of all members.
    vouched_until: Instant,
    /// Last accepted view, and the earliest time at which its agreed positions may be used. This relay is a member of
    /// the view, but does not necessarily fly by it.
    accepted: (ViewId, Instant),
    /// Latest time at which a lease from before the accepted view can end; `None` if unknown.
    older_leases_end: Option<Instant>,
}

impl LeaseBounds {
    pub(crate) fn new(now: Instant, settings: &Settings) -> Self {
        Self {
            vouched_until: now + settings.dead_after,
            accepted: (ViewId::LOADED, now),
            older_leases_end: Some(now),
        }
    }

    /// Records that this relay, a member of `view`, has accepted it. It follows the view `base`, and its positions must
    /// not be used before the time `rest`.
    ///
    /// A member of `base` that has not accepted `view` can still have a lease. If this relay was a member of `base`,
    /// that lease ends by `vouched_until`, because no renewal completes without all members.
    pub(crate) fn accept(&mut self, (view, base): (ViewId, ViewId), rest: Instant) {
        if view == self.accepted.0 {
            return;
        }
        let known = self.older_leases_end.filter(|_| self.accepted.0 == base);
        self.older_leases_end = known.map(|until| until.max(rest).max(self.vouched_until));
        self.accepted = (view, rest);
    }

    /// Records that all members have accepted `view`. Leases of earlier views end before its positions may be used.
    /// No effect if this relay has accepted another view since.
    pub(crate) fn confirm(&mut self, view: ViewId) {
        if view == self.accepted.0 {
            self.older_leases_end = Some(self.accepted.1);
        }
    }

    /// Records that this relay has completed a renewal of `view`. Until `until` other members may rely on it.
    pub(crate) fn vouch(&mut self, view: ViewId, until: Instant) {
        self.vouched_until = self.vouched_until.max(until);
        if view != self.accepted.0 {
            // This relay has accepted a view that was decided before, and still flies by an earlier one.
            self.older_leases_end = self.older_leases_end.map(|end| end.max(until));
        }
    }

    /// Returns the remaining leases of other members, as far as this relay knows.
    pub(crate) fn other_leases(&self, now: Instant) -> OtherLeases {
        OtherLeases {
            lease_left: self.vouched_until.since(now),
            view: self.accepted.0,
            earlier_lease_left: self.older_leases_end.map(|until| until.since(now)),
        }
    }
}

const fn from_tenths(tenths: u16) -> Duration {
    Duration::from_millis(100 * tenths as u64)
}

impl Lease {
    /// Creates the lease state of a relay that starts at `now`. After a restart of this relay, other relays can still
    /// have leases for up to `dead_after`.
    pub(crate) fn new(seed: u32, now: Instant, settings: &Settings) -> Self {
        Self {
            state: LeaseState::Pending,
            current: None,
            bounds: LeaseBounds::new(now, settings),
            is_whole: false,
            is_agreed: false,
            next_at: None,
            round_trip: Duration::from_micros(0),
            circulation: Circulation::new(seed),
            orders: Orders::NONE,
            requests: None,
            departures: [Departures {
                requests: OwnRequests {
                    node: 0,
                    gap: 0,
                    leave: Leave::NONE,
                    spare: 0,
                    in_place: false,
                },
                complement: 0,
                leaver: (0, now),
                settled_at: now,
                reported: false,
                turned_at: None,
            }; DEPARTURES as usize],
        }
    }

    /// Sets the requests that this relay sends to the leader in its replies to lease renewals. They are the relay's
    /// wish to leave, a spare (relay outside of the chain), and the report that the relay is in place.
    pub(crate) fn set_requests(&mut self, requests: OwnRequests) {
        if let Some(departures) = self.departures.first_mut() {
            departures.requests = requests;
        }
    }

    /// Returns true if a relay of the view receives a spare, as far as this relay knows. The leader knows it of all.
    pub(crate) fn knows_spare(&self) -> bool {
        let [joiner, ..] = self.orders.joiners;
        joiner != 0 || self.requests.is_some_and(|it| it.spares != [0; AT_ONCE])
    }

    pub(crate) const fn orders(&self) -> Orders {
        self.orders
    }

    #[cfg(all(test, feature = "departures"))]
    pub(crate) const fn set_orders(&mut self, orders: Orders) {
        self.orders = orders;
    }

    #[cfg(all(test, feature = "departures"))]
    pub(crate) const fn set_until(&mut self, until: Instant) {
        self.state = LeaseState::Until(until);
    }

    /// Returns true if all relays of the view have provably received the leader's last orders.
    pub(crate) fn has_completed(&self) -> bool {
        self.current.is_some() && !self.circulation.is_outstanding()
    }

    /// Returns the leader's orders for the next renewal. They follow from the requests in the last renewal.
    ///
    /// Relays are ordered to leave once two consecutive renewals have reported all relays in place. By then a relay
    /// that left the chain earlier knows that all relays are in place. If there are spares (relays that wait outside),
    /// one for each departure joins first, unless the view already has more relays than `Settings::flying`, or, without
    /// this number, more than before the requests to leave. As many relays may then leave as the view has more, at
    /// least one. If the view has fewer than `Settings::flying`, spares are called at once, also while relays move.
    ///
    /// A relay that does not arrive counts as in place after half of the maximum duration of a lease and the duration
    /// of a motion, counted from the first agreement in this view, or from the last time that all were in place. A
    /// relay with the most urgent request waits for spares at most this maximum duration, and at most its remaining
    /// endurance, and then until all are in place.
    fn next_orders(&mut self, context: &Context<'_>) -> Orders {
        let (Some(requests), Some(known)) = (self.requests, self.departures.first_mut()) else {
            return Orders::NONE;
        };
        let (now, most) = (context.now, longest_lease(context.settings()));
        let relays = context.mission().relays();
        // The last orders may state that all are in place only because the time limit had passed.
        if core::mem::replace(&mut known.reported, requests.in_place) && requests.in_place {
            known.settled_at = now;
        }
        let moving = now.since(known.settled_at + respacing(context.settings()));
        let in_place = requests.in_place || moving.times(2) >= most;
        let mut orders = Orders {
            in_place,
            ..Orders::NONE
        };
        let [urgent, ..] = requests.leaves;
        let leaves = urgent.node != 0;
        if !leaves || known.complement == 0 {
            known.complement = relays;
        }
        if urgent.node != known.leaver.0 || !leaves && requests.spares != [0; AT_ONCE] {
            known.leaver = (urgent.node, now);
        }
        let waited = now.since(known.leaver.1);
        let left = Duration::from_millis(1_000).times(urgent.endurance_s.into());
        let may_leave = leaves && context.member.keeps_quorum_without(&[urgent.node]);
        let is_over = waited >= most || leaves && waited >= left;
        let late = may_leave && is_over;
        // A spare is silent between the order to join and its arrival. The call of a spare that never arrives ends.
        let spares = if requests.spares == [0; AT_ONCE] && !is_over {
            self.orders.joiners
        } else {
            requests.spares
        };
        // A departure needs one relay more than the chain keeps.
        let kept = match flying(context.settings()) {
            0 if leaves => known.complement,
            flying => flying,
        };
        let wish = |leave: &&Leave| leave.node != 0;
        let wanted = requests
            .leaves
            .iter()
            .filter(wish)
            .fold(kept, |sum, _| sum.saturating_add(1));
        let joins = spares != [0; AT_ONCE] && relays <= kept && relays < wanted && !late;
        let settled = in_place && self.orders.in_place;
        let is_called = self.orders.joiners != [0; AT_ONCE];
        // In a long chain the next spares join while the relays still move after the last departures.
        let [_, other, ..] = requests.leaves;
        let is_busy = other.node != 0 && relays >= LONG;
        let at_once = is_called || is_busy || relays < flying(context.settings());
        if joins && (settled || at_once) {
            // The called ones are the first ones.
            for spare in used(&spares).take(wanted.saturating_sub(relays).into()) {
                push(&mut orders.joiners, spare);
            }
        } else if !joins
            && may_leave
            && (settled || late && (in_place || self.orders.leavers.contains(&urgent.node)))
        {
            let most = relays.saturating_sub(kept).max(1);
            let member = context.member;
            for leave in requests.leaves.iter().take(most.into()) {
                // Before all are in place, only orders that were given remain. The leader leaves alone: the renewals end
                // when it is outside.
                let waits = !settled && !self.orders.leavers.contains(&leave.node);
                let alone = waits || [leave.node, urgent.node].contains(&member.node);
                let mut leavers = orders.leavers;
                push(&mut leavers, leave.node);
                if (leave.node == urgent.node || !alone) && member.keeps_quorum_without(&leavers) {
                    orders.leavers = leavers;
                }
            }
        }
        orders
    }

    /// Records that this leader has joined a chain of `relays` relays as a spare for a departure.
    ///
    /// Then no second spare is called for the departure.
    pub(crate) fn exclude_joined(&mut self, relays: u16) {
        if let Some(known) = self.departures.first_mut() {
            known.complement = relays;
        }
    }

    /// Extends `vouched_until` by the maximum duration of a lease, after a restart of this relay. Other members may
    /// still have leases that they got before the restart.
    pub(crate) fn resume(&mut self, settings: &Settings) {
        self.bounds.vouched_until = self.bounds.vouched_until + longest_lease(settings);
    }

    /// Returns the time at which this relay's lease expires; `None` if it has no lease.
    pub(crate) const fn until(&self) -> Option<Instant> {
        match self.state {
            LeaseState::Until(at) => Some(at),
            LeaseState::Pending | LeaseState::Lapsed => None,
        }
    }

    /// Returns true from the expiry of this relay's lease until the next view.
    pub(crate) const fn has_lapsed(&self) -> bool {
        matches!(self.state, LeaseState::Lapsed)
    }

    /// Returns true until the first lease of this view is granted to this relay.
    pub(crate) const fn is_pending(&self) -> bool {
        matches!(self.state, LeaseState::Pending)
    }

    /// Returns the silence after which a neighbour may count as lost.
    ///
    /// It is the lease duration of the last renewal or `dead_after`, whichever is longer.
    pub(crate) fn silence_until_lost(&self, settings: &Settings) -> Duration {
        let span = self.current.map_or(0, |current| current.span);
        from_tenths(span).max(settings.dead_after)
    }

    /// Returns the remaining leases of other members, as far as this relay knows.
    pub(crate) fn other_leases(&self, now: Instant) -> OtherLeases {
        self.bounds.other_leases(now)
    }

    /// Records that this relay has accepted a view that was decided in place of the proposed one.
    ///
    /// See [`LeaseBounds::accept`]. The relay does not use positions of this view. So its present lease and its present
    /// agreement on positions stay valid until it accepts the next view.
    pub(crate) fn accept_decided(&mut self, views: (ViewId, ViewId), rest: Instant) {
        self.bounds.accept(views, rest);
    }

    /// Accepts `view`, which follows the view `base`. Positions of `view` must not be used before the time `rest`.
    ///
    /// The age of an outstanding renewal counts as a round trip only if this relay was a member of `base` and `lost` is
    /// false. If a relay is lost (`lost` is true), the age is the duration of the outage.
    pub(crate) fn accept_view(
        &mut self,
        now: Instant,
        (view, base): (ViewId, ViewId),
        rest: Instant,
        lost: bool,
    ) {
        let is_under_way = self.circulation.is_outstanding();
        let started_at = self.circulation.started_at();
        if let Some(at) =
            started_at.filter(|_| is_under_way && !lost && self.bounds.accepted.0 == base)
        {
            self.round_trip = self.round_trip.max(now.since(at));
        }
        self.bounds.accept((view, base), rest);
        self.end();
    }

    /// Ends this relay's lease. The next lease requires an agreement on positions in a later view.
    pub(crate) fn end(&mut self) {
        self.is_whole = false;
        self.is_agreed = false;
        self.state = LeaseState::Pending;
        self.current = None;
        self.next_at = None;
        self.circulation.withdraw();
        self.orders = Orders::NONE;
        self.requests = None;
        if let Some(departures) = self.departures.first_mut() {
            departures.turned_at = None;
            departures.reported = false;
        }
    }

    /// Returns the time at which the last relay answered this view's first renewal; `None` if unknown.
    ///
    /// Each relay takes the middle between its forwarding of the renewal and its reception of the reply. So all relays
    /// obtain nearly the same time, without a common clock.
    pub(crate) fn turned_at(&self) -> Option<Instant> {
        self.departures.first()?.turned_at
    }

    /// Records that all members have accepted this relay's view `view`.
    pub(crate) fn confirm_view(&mut self, view: ViewId) {
        self.bounds.confirm(view);
        // The initial view is configured and needs no acceptance.
        self.is_whole |= view != ViewId::LOADED;
    }

    /// Returns true once all relays of the view are known to have accepted it.
    pub(crate) const fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Records that this relay has agreed on its position. The leader (`leads` is true) agrees last, and schedules the
    /// first lease renewal.
    pub(crate) fn on_agreement(&mut self, now: Instant, leads: bool) {
        self.is_agreed = true;
        if leads && self.current.is_none() && self.next_at.is_none() {
            self.next_at = Some(now + PAUSE);
            if let Some(departures) = self.departures.first_mut() {
                departures.settled_at = now;
            }
        }
    }

    /// Handles a lease renewal (from the previous relay) or a reply to a renewal (from the next relay).
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
                    return Effects::DUPLICATE;
                }
                1 if !self.circulation.is_outstanding() => {
                    self.grant(context, current, pulse.lease);
                    let reported_at = self.circulation.completed_at();
                    effects.alive = reported_at.map(|at| (Peer::Previous, at));
                }
                // The leader has restarted, or this relay has missed renewals.
                2..=0x7FFF => {}
                _ => return Effects::STALE,
            }
        } else if !self.is_agreed {
            // The agreement was made by a second node with this relay's index.
            return Effects::FOREIGN;
        }
        self.orders = pulse.orders;
        self.join_renewal(context, pulse.number, pulse.lease);
        effects
    }

    /// Extends this relay's lease after the completed renewal `pulse`, in which all members took part. The lease ends
    /// when the duration in `pulse` has passed since this relay forwarded the renewal.
    ///
    /// `next` is the lease duration in the next renewal, in tenths of a second. The first lease in a view is not
    /// granted if `next` is more than twice the duration in `pulse`. It would expire before the next renewal completes.
    fn grant(&mut self, context: &Context<'_>, pulse: Current, next: u16) {
        let now = context.now;
        let Some(forwarded_at) = self.circulation.started_at() else {
            return;
        };
        if self.state == LeaseState::Pending && next / 2 > pulse.span {
            return;
        }
        let until = forwarded_at + from_tenths(pulse.span);
        self.is_whole = true;
        if until > now {
            let until = self.until().map_or(until, |at| at.max(until));
            self.state = LeaseState::Until(until);
        }
    }

    fn join_renewal(&mut self, context: &Context<'_>, number: u16, span: u16) {
        self.current = Some(Current { number, span });
        self.circulation.start(context.now);
        if context.is_last_of_view() {
            self.complete_renewal(context, None);
        }
    }

    /// Completes the current lease renewal, and schedules the reply to the previous relay. The leader instead extends
    /// its own lease and schedules the next renewal. `received` contains the requests of all relays farther from the
    /// leader; `None` at the last relay.
    fn complete_renewal(&mut self, context: &Context<'_>, received: Option<Requests>) {
        let (Some(current), Some(forwarded_at)) = (self.current, self.circulation.started_at())
        else {
            return;
        };
        // At the last relay of the chain the collection of requests begins.
        let received = received.unwrap_or(Requests {
            in_place: true,
            ..Requests::NONE
        });
        self.requests = match self.departures.first() {
            None => Some(received),
            Some(Departures { requests, .. }) => {
                let own = OwnRequests {
                    in_place: requests.in_place && self.is_agreed,
                    ..*requests
                };
                Some(received.with(&own, self.orders.joiners))
            }
        };
        if let Some(departures) = self.departures.first_mut() {
            let half = Duration::from_micros(context.now.since(forwarded_at).as_micros() / 2);
            departures.turned_at.get_or_insert(forwarded_at + half);
        }
        let until = context.now + from_tenths(current.span);
        self.bounds.vouch(context.member.view, until);
        self.circulation
            .complete(context.now, context.path_to_leader());
        if !context.leads_view() {
            return;
        }
        // The period counts from the start of a renewal. So after a slow renewal the next one follows after only a
        // short pause for other messages.
        let period = self.period(context.settings());
        // The second renewal follows at once, because no other member gets a lease before it.
        let first = self.state == LeaseState::Pending;
        let took = context.now.since(forwarded_at);
        // The maximum decays by 1/32 per renewal, so a long run of lost frames affects it for a minute or two.
        let part = self.round_trip.as_micros() / 32;
        let lately = self.round_trip.as_micros().saturating_sub(part);
        self.round_trip = took.max(Duration::from_micros(lately));
        let next = self.announced_span(context.settings());
        self.grant(context, current, next);
        let soon = context.now + PAUSE;
        let paced = forwarded_at + period;
        self.next_at = Some(if first { soon } else { paced.max(soon) });
    }

    fn period(&self, settings: &Settings) -> Duration {
        let half = Duration::from_micros(settings.probe_after.as_micros() / 2);
        // The last announced span may be the shortest possible one, so several periods must fit into `dead_after`.
        let most = Duration::from_micros(settings.dead_after.as_micros() / 4);
        half.max(self.round_trip.times(2).min(most)).max(PAUSE)
    }

    /// Returns the lease duration that the leader announces in the next renewal, in tenths of a second.
    fn announced_span(&self, settings: &Settings) -> u16 {
        let slow = self.round_trip.times(3).as_micros();
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
            self.complete_renewal(context, Some(pulsed.requests));
        } else {
            let path = context.path_to_last();
            self.circulation.on_in_progress(context.now, path);
        }
        Effects {
            alive: forwarded_at.map(|at| (Peer::Next, at)),
            ..Effects::NONE
        }
    }

    /// Handles the timers: next renewal at the leader, retransmission, and expiry of the lease.
    pub(crate) fn handle_timeout(&mut self, context: &Context<'_>) -> Effects {
        let now = context.now;
        let hop_time = context.settings().hop_time;
        let resent = self.circulation.handle_timeout(now, hop_time);
        if self.next_at.is_some_and(|at| at <= now) {
            self.next_at = None;
            let number = self.current.map_or(0, |current| current.number);
            let span = self.announced_span(context.settings());
            self.orders = self.next_orders(context);
            self.join_renewal(context, number.wrapping_add(1), span);
        }
        let lapsed = self.until().is_some_and(|at| at <= now);
        if lapsed {
            self.state = LeaseState::Lapsed;
        }
        Effects {
            resent,
            view_needed: lapsed,
            event: lapsed.then_some(LayerEvent::Lapsed),
            ..Effects::NONE
        }
    }

    /// Returns the pending lease renewal to forward, and marks it as sent; `None` if none is pending.
    pub(crate) fn poll_onward(&mut self, context: &Context<'_>) -> Option<Message> {
        let is_due = self.circulation.poll_forward();
        let current = self.current.filter(|_| is_due)?;
        self.circulation
            .await_result(context.now, context.path_to_last());
        Some(Message::Pulse(Pulse {
            number: current.number,
            view_digest: context.digest(),
            lease: current.span,
            orders: self.orders,
        }))
    }

    /// Returns the pending reply to a lease renewal, and marks it as sent; `None` if none is pending.
    pub(crate) fn poll_back(&mut self, context: &Context<'_>) -> Option<Message> {
        let reply = self.circulation.poll_reply()?;
        let current = self.current?;
        Some(Message::Pulsed(Pulsed {
            number: current.number,
            view_digest: context.digest(),
            done: reply == Reply::Result,
            requests: self
                .requests
                .filter(|_| reply == Reply::Result)
                .unwrap_or(Requests::NONE),
        }))
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        let pulse = earliest(self.next_at, self.circulation.next_timeout());
        earliest(pulse, self.until())
    }
}

#[cfg(test)]
mod tests;
