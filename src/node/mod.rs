//! The protocol of one relay, on messages and without bytes: what it does with a message, and with silence.
//!
//! Five layers, each a machine of its own beside its state table, with the same verbs: `handle` takes a message, `take_...` gives what
//! there is to send, `handle_timeout` and `next_timeout` keep the time. None knows another: each is handed a `context` and gives back
//! effects, which `Node` passes on.
//!
//! | layer | one idea |
//! | --- | --- |
//! | `neighbour` | which node is taken for the neighbour on each side, and when it counts as lost |
//! | `view` | the view change: how the chain comes to a new view of who is in it |
//! | `lease` | how long what was agreed on may be held |
//! | `mission_update` | a newer mission, in flight |
//! | `round` | a round of agreement: sweeps, gatherings of the joint method, turns |
//!
//! | file | one idea |
//! | --- | --- |
//! | `context` | what a relay is and flies, as every layer is handed it, and what a layer asks of the others |
//! | `retransmit` | how long an answer is awaited, and when a message is sent again |
//! | `numbering` | what a number that is not the expected one means |
//! | `namesake` | another node with this relay's number, and which of the two stands down |
//! | `timing` | what the layers have in common in keeping time |
//! | `steering` | the setpoint on its way to the agreed place |
//! | [`sample`] | the interference that a relay measures |
//!
//! A message is answered by setting flags, and what is sent is built from the state when it is asked for, so nothing queues up and a
//! message sent twice is harmless.

pub(crate) mod context;
mod lease;
pub(crate) mod mission_update;
pub(crate) mod namesake;
pub(crate) mod neighbour;
mod numbering;
mod retransmit;
pub(crate) mod round;
pub(crate) mod sample;
mod steering;
mod timing;
pub(crate) mod view;

use crate::event::{About, Event, Pending};
use crate::guard::HoldReason;
use crate::mission::{Heading, Mission};
use crate::place::Placement;
use crate::settings::{Identity, Method, Settings, Wiring};
use crate::side::Side;
use crate::stats::{Stats, bump};
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;
use crate::wire::message::{Hello, Message};
#[cfg(feature = "upload")]
use crate::wire::upload::{Upload, UploadError};

use context::{Context, Decided, Effects, Member};
use lease::Lease;
use mission_update::{MissionUpdate, takes_uploads};
use namesake::{Claim, Namesake, Twice};
use neighbour::Neighbours;
use neighbour::state::{CANDIDATES, Candidate};
use round::Round;
use round::state::Phase;
use sample::{Meter, Sample};
use steering::Steering;
use timing::first_pass;
use view::ViewChange;
use view::electorate::Held;
use view::record::{RecordError, ViewRecord};

/// What the firmware is told.
#[derive(Clone, Debug, Default)]
struct Telemetry {
    events: Pending,
    stats: Stats,
    /// Whether a lapse of the lease, and a refusal, have been told since a view was agreed on.
    told_lapsed: bool,
    told_refused: bool,
}

/// A relay's share of the protocol.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    member: Member,
    neighbours: Neighbours,
    view: ViewChange,
    lease: Lease,
    update: MissionUpdate,
    round: Round,
    steering: Steering,
    meter: Meter,
    namesake: Namesake,
    telemetry: Telemetry,
}

/// What the layers are handed, of those that it is made of.
fn of<'a>(
    now: Instant,
    member: &'a Member,
    neighbours: &Neighbours,
    update: &MissionUpdate,
    meter: &Meter,
    held: Held,
) -> Context<'a> {
    let onward = Side::onward(member.mission.heading());
    Context {
        now,
        member,
        latest: update.latest(),
        end: neighbours.at(onward).has_no_peer(),
        held,
        measured_per_w: meter.published(),
    }
}

/// Whether node `other`, which hears the nodes of `mask` on that side, hears node `own`.
const fn hears(own: u16, other: u16, mask: u8) -> bool {
    let distance = own.abs_diff(other);
    distance >= 1 && distance <= CANDIDATES && mask >> (distance - 1) & 1 == 1
}

impl Node {
    /// A relay that has just been switched on. `identity` and `settings` have been checked.
    pub(crate) fn new(
        mission: Mission,
        identity: Identity,
        settings: Settings,
        seed: u32,
        now: Instant,
    ) -> Self {
        let leads = identity.index == mission.leader();
        let profile = settings.profile.unwrap_or(mission.config().common);
        let seed = seed.wrapping_add(u32::from(identity.index));
        let [a, b, ..] = seed.wrapping_mul(0x9E37_79B1).to_le_bytes();
        let number = u16::from_le_bytes([a, b]);
        let member = Member::new(mission, settings, identity.index);
        let neighbours = Neighbours::new(
            identity.index,
            member.all,
            seed.rotate_left(8),
            now,
            &settings,
        );
        let mut node = Self {
            update: MissionUpdate::new(member.active, seed.rotate_left(4), now),
            view: ViewChange::new(member.all, mission.leader(), !seed),
            lease: Lease::new(!seed.rotate_left(16), now, &settings),
            round: Round::new(leads, number, profile, seed),
            steering: Steering::new(&settings, neighbours.nodes(), seed, now),
            meter: Meter::new(settings.measure),
            namesake: Namesake::new(seed.rotate_left(24)),
            telemetry: Telemetry::default(),
            member,
            neighbours,
        };
        if leads || settings.method == Method::Joint {
            node.round.work_soon(now);
        }
        if !leads {
            node.await_first(now);
        }
        node
    }

    /// By when the first pass should have come, were this the beginning.
    fn await_first(&mut self, now: Instant) {
        let (settings, all) = (&self.member.settings, self.member.all);
        let there_and_back = settings.hop_time.times(2 * u32::from(all));
        let usual = now + settings.probe_after + there_and_back;
        let slow = now + first_pass(settings, all);
        self.view.await_first(usual.max(slow));
    }

    fn context(&self, now: Instant) -> Context<'_> {
        of(
            now,
            &self.member,
            &self.neighbours,
            &self.update,
            &self.meter,
            self.lease.held(now),
        )
    }

    /// Where passes go to, and where they come from.
    const fn onward(&self) -> Side {
        Side::onward(self.member.mission.heading())
    }

    const fn back(&self) -> Side {
        Side::back(self.member.mission.heading())
    }

    /// On which side node `sender` is, if it may have something to say to this relay: a neighbour, or one that might become
    /// one, or the ground where it may upload missions.
    pub(crate) fn side_of(&self, sender: u16) -> Option<Side> {
        if let Some(side) = self.ground_side(sender) {
            return Some(side);
        }
        let own = self.member.node;
        let near = sender.abs_diff(own) <= if self.searches() { CANDIDATES } else { 1 };
        if !near || sender == own || sender < 1 || sender > self.member.all {
            return None;
        }
        Some(if sender < own {
            Side::Upstream
        } else {
            Side::Downstream
        })
    }

    /// On which side `node` is, if it is the ground transmitter or receiver and near enough to be heard.
    fn ground_side(&self, node: u16) -> Option<Side> {
        let (own, all) = (self.member.node, self.member.all);
        let most = match self.member.settings.wiring {
            Wiring::Pair => 1,
            Wiring::Shared => CANDIDATES,
        };
        let near = takes_uploads(&self.member) && node.abs_diff(own) <= most;
        match node {
            0 if near => Some(Side::Upstream),
            _ if near && node == all.saturating_add(1) => Some(Side::Downstream),
            _ => None,
        }
    }

    /// Whether others than the neighbours of the mission can be heard.
    fn searches(&self) -> bool {
        self.member.settings.wiring == Wiring::Shared
    }

    fn raise(&mut self, event: Event) {
        self.telemetry.events.raise(event);
    }

    fn raise_about(&mut self, about: About, side: Side, node: u16) {
        self.telemetry.events.raise_about(about, side, node);
    }

    /// Has the other layers know what one of them came to.
    fn apply(&mut self, now: Instant, effects: Effects) {
        let stats = &mut self.telemetry.stats;
        for (happened, counter) in [
            (effects.stale, &mut stats.stale),
            (effects.repeated, &mut stats.repeated),
            (effects.resent, &mut stats.repeats),
            (effects.began, &mut stats.sweeps),
        ] {
            if happened {
                bump(counter);
            }
        }
        if let Some(proposer) = effects.proposed_by {
            let back = self.back();
            self.neighbours.at_mut(back).proposed_by(proposer);
        }
        let (back, onward) = (self.back(), self.onward());
        for (side, at) in [(onward, effects.heard_onward), (back, effects.heard_back)] {
            if let Some(at) = at {
                self.confirm(now, side, at);
            }
        }
        if effects.lapsed && !core::mem::replace(&mut self.telemetry.told_lapsed, true) {
            self.raise(Event::LeaseLapsed);
        }
        if effects.view_proposed {
            self.round.suspend();
        }
        if effects.view_needed {
            self.view.ask(now);
        }
        if effects.ask {
            let back = self.back();
            let to = self.neighbours.at(back).node();
            self.owe_hello(back, to, true);
        }
        if let Some(decided) = effects.decided {
            self.decided(now, decided);
        }
        if effects.converged {
            self.raise(Event::Converged);
            if self.context(now).leads() {
                self.lease.begin(now);
            }
        }
        if effects.infeasible {
            self.raise(Event::Infeasible);
        }
        if effects.moved {
            // What is measured from now on is measured elsewhere.
            self.meter.restart();
        }
    }

    /// Where to be in the end: at the place agreed on, or beside it while others may fly there.
    fn wanted(&self) -> Option<Placement> {
        let agreed = self.round.setpoint()?;
        Some(if self.view.has_no_quorum() {
            self.member.settings.without_quorum.place(agreed)
        } else {
            agreed
        })
    }

    /// Moves the setpoint as far as it may go by what is known now.
    fn steer(&mut self, now: Instant) {
        if self.steering.steer(now, self.wanted()) {
            self.raise(Event::SetpointChanged);
        }
    }

    /// Node `from` at `side` has made itself known, for the first time if `first`: then what waits for an answer from there is
    /// said again.
    #[cfg(feature = "auth")]
    pub(crate) fn meet(&mut self, side: Side, from: u16, first: bool) {
        if self.ground_side(from).is_some() {
            return;
        }
        if self.neighbours.at(side).node() != from {
            if first {
                // What was to be said to it before could not be read there.
                self.owe_hello(side, from, true);
            }
            return;
        }
        if first && side == self.onward() {
            self.resend();
        }
    }

    /// Node `from` at `side` has said that it is there, and not shown that it has heard this relay.
    #[cfg(feature = "auth")]
    pub(crate) fn called(&mut self, side: Side, from: u16) {
        self.is_signed_right(side, from);
        if self.searches() {
            self.says_it_hears(side, from, false);
        }
    }

    /// A handshake under the number of node `from` at `side` was signed with another key, or altered.
    #[cfg(feature = "auth")]
    pub(crate) fn is_forged(&mut self, side: Side, from: u16) {
        let distance = from.abs_diff(self.member.node);
        if self.neighbours.at_mut(side).is_forged(distance) {
            self.raise_about(About::Key, side, from);
        }
    }

    /// Node `from` at `side` has the key.
    #[cfg(feature = "auth")]
    pub(crate) fn is_signed_right(&mut self, side: Side, from: u16) {
        let distance = from.abs_diff(self.member.node);
        self.neighbours.at_mut(side).is_signed_right(distance);
    }

    /// Node `from` at `side` goes on with an older epoch than it had.
    #[cfg(feature = "auth")]
    pub(crate) fn went_back(&mut self, side: Side, from: u16) {
        self.raise_about(About::Epoch, side, from);
    }

    /// A frame under this relay's own number, from another node.
    pub(crate) fn hear_namesake(&mut self, now: Instant, claim: Claim) {
        let settings = self.member.settings;
        if self.namesake.is_news(now, Twice::Own, &settings) {
            let node = self.member.node;
            self.raise_about(About::Index, Side::Upstream, node);
        }
        let holds = self.holds(now);
        let placed = self.setpoint().is_some();
        if self.namesake.hear(now, claim, holds, &settings) && placed {
            self.raise(Event::SetpointChanged);
        }
    }

    fn holds(&self, now: Instant) -> bool {
        self.lease.until().is_some_and(|until| until > now)
    }

    /// Whether it stands down from now on, as it holds no lease any more and another node of its number takes part.
    fn gives_way(&mut self, now: Instant) -> bool {
        let holds = self.holds(now);
        let placed = self.setpoint().is_some();
        let down = self.namesake.review(now, holds, &self.member.settings);
        if down && placed {
            self.raise(Event::SetpointChanged);
        }
        down
    }

    /// What it says while it stands down: a hello to its own number, as one that has taken part in nothing.
    fn next_to_namesake(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        if !self.namesake.take_hello() {
            return None;
        }
        let hello = Hello {
            fresh: true,
            form: false,
            ..self.hello(now, Side::Upstream, false, 0)
        };
        Some((Side::Upstream, self.member.node, Message::Hello(hello)))
    }

    /// Node `from` was heard at the port of side `through`: at that of the other side than its own, it may be heard at both.
    pub(crate) fn hear_at_both(&mut self, now: Instant, through: Side, from: u16) {
        let Some(side) = self.side_of(from).filter(|side| *side != through) else {
            return;
        };
        let settings = self.member.settings;
        if self.neighbours.at(side).is_there()
            && self.namesake.is_news(now, Twice::Neighbour, &settings)
        {
            self.raise_about(About::Index, side, from);
        }
    }

    /// Whether it takes part in nothing, because another relay has its number.
    pub(crate) const fn stands_down(&self) -> bool {
        self.namesake.stands_down()
    }

    /// The other relay with this number is gone.
    pub(crate) fn clear_namesake(&mut self, now: Instant) {
        if self.namesake.clear() {
            self.stand_up(now);
        }
    }

    /// It takes part again: in nothing that goes on without it.
    fn stand_up(&mut self, now: Instant) {
        if self.setpoint().is_some() {
            self.raise(Event::SetpointChanged);
        }
        if !self.round.is_fresh() {
            self.view.ask(now);
        }
    }

    /// What could not be said to the neighbour after can be now.
    fn resend(&mut self) {
        self.view.resend();
        self.round.resend();
    }

    /// A message from node `from` at `side`, intact and addressed to this relay; whether it was one to say to this relay.
    /// Bounded by 16 reaches.
    #[inline(never)]
    pub(crate) fn handle_message(
        &mut self,
        now: Instant,
        side: Side,
        from: u16,
        message: &Message,
    ) -> bool {
        if self.stands_down() {
            return false;
        }
        #[cfg(feature = "upload")]
        if self.ground_side(from).is_some() {
            return self.on_ground(now, side, from, message);
        }
        let taken = self.neighbours.at(side).node() == from;
        let distance = from.abs_diff(self.member.node);
        let Self {
            member, neighbours, ..
        } = self;
        neighbours
            .at_mut(side)
            .heard(distance, taken, now, &member.settings);
        if let Message::Hello(hello) = message {
            if self.is_of_mission(side, from, hello.mission) {
                self.on_hello(now, side, from, *hello);
                self.steer(now);
            }
            return true;
        }
        #[cfg(feature = "upload")]
        if let Message::Offer { upload, answer } = message
            && !taken
            && takes_uploads(&self.member)
        {
            // It takes this relay for its neighbour: a hello alone would only make it say the same again.
            if self.is_of_mission(side, from, upload.base()) {
                self.on_offer(now, side, from, upload, *answer);
            }
            return true;
        }
        if !taken {
            self.owe_hello(side, from, false);
            return false;
        }
        if self.searches() {
            // Nobody says anything else to a node that it has not taken.
            self.told(now, side, true);
        }
        if !self.is_of_this_view(now, side, from, message) {
            return true;
        }
        self.dispatch(now, side, from, message);
        self.steer(now);
        true
    }

    /// Whether `message` from the neighbour `from` is of the mission and, if it is of one, of the view that this relay is in.
    /// What is not is counted and answered by a hello, and a pass of another view has the relay ask for one.
    fn is_of_this_view(&mut self, now: Instant, side: Side, from: u16, message: &Message) -> bool {
        let Some(digest) = message.mission() else {
            return true;
        };
        let (active, latest) = (self.member.active, self.update.latest());
        let proposes = message.is_of_a_proposal();
        if !proposes && !message.is_of_a_view() {
            return self.is_of_mission(side, from, digest);
        }
        let known = match message {
            Message::Proposal(proposal) => proposal.mission_id == latest,
            Message::Decision(decision) => [active, latest].contains(&decision.mission_id),
            _ => digest == self.member.pass_digest(),
        };
        if !known {
            // What it flies, and in which view, it says in a hello.
            bump(&mut self.telemetry.stats.view);
            self.owe_hello(side, from, true);
            // It has said that it is of this mission: then the two are in different views.
            let of_mission = self.neighbours.at(side).holds.is_some();
            if of_mission && message.is_of_a_view() && message.is_onward() {
                self.view.ask(now);
            }
        }
        known
    }

    fn is_of_mission(&mut self, side: Side, from: u16, digest: u16) -> bool {
        let same = digest == self.member.digest;
        if !same {
            self.refuse_mission(side, from);
        }
        same
    }

    fn refuse_mission(&mut self, side: Side, from: u16) {
        bump(&mut self.telemetry.stats.mission);
        self.raise_about(About::Mission, side, from);
    }

    /// The neighbour at `side` was there `at` that time or later: it has answered what this relay said then.
    fn confirm(&mut self, now: Instant, side: Side, at: Instant) {
        let neighbour = self.neighbours.at_mut(side);
        if neighbour.confirmed(now, at) {
            let node = neighbour.node();
            self.raise_about(About::Back, side, node);
        }
    }

    /// A message of this mission, and of this view if it is of one, from the neighbour `from` at `side`.
    fn dispatch(&mut self, now: Instant, side: Side, from: u16, message: &Message) {
        match message {
            Message::Heartbeat { ask, answer, .. } => {
                let neighbour = self.neighbours.at_mut(side);
                neighbour.asked(*ask);
                if let Some(at) = neighbour.answered(*answer) {
                    self.confirm(now, side, at);
                }
                return;
            }
            Message::Fence { fence, .. } => {
                let effects = self.steering.handle(side, from, fence);
                return self.apply(now, effects);
            }
            #[cfg(feature = "upload")]
            Message::Offer { upload, answer } => {
                return self.on_offer(now, side, from, upload, *answer);
            }
            _ => {}
        }
        if message.is_of_a_view() && !self.neighbours.at(side).is_agreed() {
            // It is in no view with this relay yet.
            return bump(&mut self.telemetry.stats.stale);
        }
        let wanted = if message.is_onward() {
            self.back()
        } else {
            self.onward()
        };
        if side != wanted {
            return bump(&mut self.telemetry.stats.misdirected);
        }
        let context = of(
            now,
            &self.member,
            &self.neighbours,
            &self.update,
            &self.meter,
            self.lease.held(now),
        );
        let effects = match message {
            Message::Proposal(_) | Message::Decision(_) => self.view.handle(&context, message),
            Message::Busy { sweep } if self.view.on_busy(&context, *sweep) => Effects::NONE,
            // No pass goes on while a view is proposed.
            _ if self.view.awaited().is_some() => Effects::STALE,
            Message::Pulsed(_) => self.lease.handle(&context, message),
            Message::Pulse(_) => {
                self.view.commit(self.member.view);
                self.lease.commit();
                self.lease.handle(&context, message)
            }
            _ if message.is_of_a_view() && message.is_onward() => {
                self.view.commit(self.member.view);
                self.lease.commit();
                self.round.handle(&context, message)
            }
            _ => self.round.handle(&context, message),
        };
        self.apply(now, effects);
    }

    /// Whether it is at the chain's solution, as every relay of its view is.
    fn is_solving(&self, now: Instant) -> bool {
        self.round.is_solving(&self.context(now))
    }

    /// Whether no pass has come yet, and it has not asked for a view.
    fn awaits_first(&self) -> bool {
        self.round.is_fresh() && !self.view.asks()
    }

    /// Handles what has run out by `now`, each layer once; the work is that of one portion of a computation.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        if self.stands_down() {
            if !self.namesake.handle_timeout(now, &self.member.settings) {
                return;
            }
            self.stand_up(now);
        }
        if self.gives_way(now) {
            return;
        }
        let solved = self.is_solving(now);
        let context = of(
            now,
            &self.member,
            &self.neighbours,
            &self.update,
            &self.meter,
            self.lease.held(now),
        );
        let effects = self.round.handle_timeout(&context);
        self.apply(now, effects);
        let context = of(
            now,
            &self.member,
            &self.neighbours,
            &self.update,
            &self.meter,
            self.lease.held(now),
        );
        let effects = self.lease.handle_timeout(&context);
        self.apply(now, effects);
        if solved && !self.is_solving(now) {
            self.solved(now);
        }
        for side in [Side::Upstream, Side::Downstream] {
            if self.neighbours.at(side).is_due(now) {
                self.silence(now, side);
            }
        }
        if self.awaits_first() && self.is_solving(now) {
            if self.view.is_due(now) {
                self.await_first(now);
            }
        } else {
            let leads = self.neighbours.at(self.back()).has_no_peer();
            let fresh = self.round.is_fresh();
            let context = of(
                now,
                &self.member,
                &self.neighbours,
                &self.update,
                &self.meter,
                self.lease.held(now),
            );
            let effects = self.view.handle_timeout(&context, leads, fresh);
            self.apply(now, effects);
        }
        #[cfg(feature = "upload")]
        self.offer_again(now);
        self.steering.handle_timeout(now);
        self.steer(now);
    }

    /// It has just found out where it is to be: what it waits for it waits for from now on.
    fn solved(&mut self, now: Instant) {
        let Self {
            member, neighbours, ..
        } = self;
        for side in [Side::Upstream, Side::Downstream] {
            neighbours.at_mut(side).excuse(now, &member.settings);
        }
        if self.awaits_first() {
            self.await_first(now);
        }
    }

    fn silence(&mut self, now: Instant, side: Side) {
        let (solving, searches) = (self.is_solving(now), self.searches());
        let Self {
            member,
            neighbours,
            steering,
            lease,
            ..
        } = self;
        let settings = &member.settings;
        let neighbour = neighbours.at_mut(side);
        if solving && neighbour.excuse(now, settings) {
            return;
        }
        let node = neighbour.node();
        let ended = neighbour.has_no_peer();
        let lost = neighbour.handle_timeout(now, settings, lease.span(settings), searches);
        let ends = neighbour.has_no_peer() && !ended;
        steering.link(side, Some(neighbour.node()).filter(|node| *node != 0));
        if lost {
            self.raise_about(About::Lost, side, node);
        }
        if ends {
            self.view.hasten(now);
        }
        self.review(now);
    }

    /// Asks for a new view if the chain is another than the one agreed on.
    fn review(&mut self, now: Instant) {
        if self.neighbours.have_changed(now) {
            self.view.ask(now);
        }
        if self.neighbours.at(self.onward()).has_no_peer() && self.view.awaited().is_some() {
            // Whoever was to be counted next is not there any more.
            let context = of(
                now,
                &self.member,
                &self.neighbours,
                &self.update,
                &self.meter,
                self.lease.held(now),
            );
            let effects = self.view.decide(&context);
            self.apply(now, effects);
        }
    }

    /// Owes node `to` at `side` a hello, which may ask for one in return.
    fn owe_hello(&mut self, side: Side, to: u16, ask: bool) {
        let distance = to.abs_diff(self.member.node);
        self.neighbours.at_mut(side).owe(distance, ask);
    }

    /// The next hello that is owed: at which side, to which node.
    fn next_hello(&mut self, now: Instant) -> Option<(Side, u16, Hello)> {
        let (own, all) = (self.member.node, self.member.all);
        for side in [Side::Upstream, Side::Downstream] {
            for _ in 0..CANDIDATES {
                let Some((distance, ask)) = self.neighbours.at_mut(side).take_hello() else {
                    break;
                };
                let to = match side {
                    Side::Upstream => own.saturating_sub(distance),
                    Side::Downstream => own.saturating_add(distance),
                };
                if to >= 1 && to <= all && self.side_of(to).is_some() {
                    let nonce = self.ask_number(now);
                    let ready = self.is_between(now, side, to);
                    let hello = self.hello(now, side, ask, nonce);
                    return Some((side, to, Hello { ready, ..hello }));
                }
            }
        }
        None
    }

    /// How many relays there are on that side in the part of the chain that this relay is in, as it was counted last.
    fn beyond(&self, side: Side) -> u16 {
        if self.neighbours.at(side).has_no_peer() {
            return 0;
        }
        let (place, all) = self
            .view
            .counted()
            .unwrap_or_else(|| self.member.place_in_all());
        if side == self.back() {
            place.saturating_sub(1)
        } else {
            all.saturating_sub(place)
        }
    }

    /// The number of a hello that is said now, for the offer that answers it; 0 where none is taken.
    #[cfg(feature = "upload")]
    fn ask_number(&mut self, now: Instant) -> u16 {
        if takes_uploads(&self.member) {
            self.update.ask(now, &self.member.settings)
        } else {
            0
        }
    }

    #[cfg(not(feature = "upload"))]
    #[expect(clippy::unused_self, reason = "as the other one")]
    const fn ask_number(&mut self, _: Instant) -> u16 {
        0
    }

    /// Whether this relay could come between node `other` at `side` and the one that it takes there: whether that one and this relay hear
    /// each other, or there is a neighbour that comes along with it.
    fn is_between(&self, now: Instant, side: Side, other: u16) -> bool {
        let own = self.member.node;
        let beyond = self.neighbours.at(side).taken_by(other.abs_diff(own));
        let there = match side {
            Side::Upstream => beyond > own,
            Side::Downstream => beyond != 0 && beyond < own,
        };
        let settings = &self.member.settings;
        let far = self.neighbours.at(side.other());
        let distance = beyond.abs_diff(own);
        // Of two links that cross the one that ends nearest to Rx is given up.
        let crosses = side == Side::Downstream && far.goes_past(distance);
        there && (far.is_two_way(distance, now, settings) || far.comes_along(distance) || crosses)
    }

    fn hello(&self, now: Instant, side: Side, ask: bool, nonce: u16) -> Hello {
        let latest = self.update.latest();
        Hello {
            mission: self.member.digest,
            newest: self.view.newest(),
            neighbour: self.neighbours.at(side).node(),
            ask,
            form: self.view.asks() && side == self.back(),
            fresh: self.round.is_fresh(),
            ready: false,
            // Who has just been switched on is in no part yet.
            behind: if self.round.is_fresh() {
                1
            } else {
                self.beyond(side.other()).saturating_add(1)
            },
            hears: self.neighbours.at(side).hears(now, &self.member.settings),
            holds: latest,
            flies: self.member.active == latest,
            nonce,
        }
    }

    /// A hello from node `from` at `side`, of the same mission.
    fn on_hello(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.member.node;
        let known = self.view.newest();
        self.view.heard_of(hello.newest);
        if self.searches() {
            let heard = hears(own, from, hello.hears);
            // One that asks for nothing may be the answer to what was heard just now.
            if heard || hello.ask {
                self.says_it_hears(side, from, heard);
            }
            let Self {
                member, neighbours, ..
            } = self;
            let distance = from.abs_diff(own);
            neighbours
                .at_mut(side)
                .says(distance, hello.neighbour, heard, now, &member.settings);
        }
        if hello.ask {
            self.owe_hello(side, from, false);
        }
        if self.neighbours.at(side).node() == from {
            #[cfg(feature = "upload")]
            {
                self.neighbours.at_mut(side).asked = hello.nonce;
                self.update.may_answer(side, now);
                self.compare(side, from, hello.holds);
            }
            self.neighbours.at_mut(side).holds = Some(hello.holds);
            if self.searches() {
                let two_way = hears(own, from, hello.hears);
                // A run of lost frames does not undo what was heard before: silence has its own measure.
                let linked = self.neighbours.at(side).is_mutual();
                let mutual = hello.neighbour == own && (two_way || linked);
                self.told(now, side, mutual);
            }
            let waits = self.view.awaited().is_some();
            // One that holds a newer mission takes part in no view without it: it is asked for once this relay holds it, too.
            let newer = takes_uploads(&self.member) && hello.holds > self.update.latest();
            if hello.form && !newer && (hello.newest >= known || hello.fresh && !waits) {
                if self.view.newest() > known {
                    self.view.ask_anew(now);
                } else {
                    self.view.ask(now);
                }
            }
        } else if self.searches() {
            self.consider(now, side, from, hello);
        }
        self.review(now);
    }

    /// Node `from` at `side` has said whether it hears this relay.
    fn says_it_hears(&mut self, side: Side, from: u16, heard: bool) {
        let distance = from.abs_diff(self.member.node);
        if self.neighbours.at_mut(side).says_it_hears(distance, heard) {
            self.raise_about(About::NotHeard, side, from);
        }
    }

    /// A hello from node `from` at `side`, which is not taken for the neighbour there.
    ///
    /// One that does not hear this relay is none: nothing can be agreed on with it.
    fn consider(&mut self, now: Instant, side: Side, from: u16, hello: Hello) {
        let own = self.member.node;
        let there = self.beyond(side);
        let Self {
            member,
            neighbours,
            steering,
            #[cfg(feature = "upload")]
            update,
            ..
        } = self;
        let neighbour = neighbours.at_mut(side);
        neighbour.notice(now, &member.settings);
        // It would rather have this relay than one that is farther away.
        let farther = hello.neighbour.abs_diff(from) > own.abs_diff(from);
        let taken = hello.neighbour != own && hello.neighbour != 0 && !farther;
        if taken || !hears(own, from, hello.hears) {
            return;
        }
        let pairs = hello.neighbour == own;
        let candidate = Candidate {
            node: from,
            distance: from.abs_diff(own),
            downstream: from > own,
            pairs,
            nearer: from.abs_diff(own) < neighbour.node().abs_diff(own),
            ready: hello.ready,
            longer: hello.behind > there,
        };
        if neighbour.consider(candidate, now, &member.settings) {
            neighbour.holds = Some(hello.holds);
            #[cfg(feature = "upload")]
            {
                neighbour.asked = hello.nonce;
                update.may_answer(side, now);
                update.begin_offers(side);
            }
            steering.link(side, Some(from));
            self.raise_about(About::Back, side, from);
            self.owe_hello(side, from, true);
            self.told(now, side, pairs);
        }
    }

    /// The neighbour at `side` has said, one way or the other, whether it takes this relay for its own.
    fn told(&mut self, now: Instant, side: Side, mutual: bool) {
        if !self.neighbours.at_mut(side).told(mutual, now) || !mutual {
            return;
        }
        let newer = self.view.newest() > self.member.view;
        if newer && !self.neighbours.at(side).has_grace(now) {
            // One of the two has missed something.
            self.view.ask(now);
        }
        self.resend();
    }

    /// What came of a proposal is known: how many relays there are, or that they are too few.
    fn decided(&mut self, now: Instant, decided: Decided) {
        let Some(proposed) = self.view.proposed() else {
            return;
        };
        let (place, id) = (proposed.place, proposed.mission_id);
        let leads = place == 1;
        let (relays, lease_left) = match decided {
            Decided::Granted { relays, lease_left } => (relays, lease_left),
            Decided::Earlier => {
                if leads {
                    self.view.ask(now);
                }
                return;
            }
            Decided::Refused => {
                if !core::mem::replace(&mut self.telemetry.told_refused, true) {
                    self.raise(Event::NoQuorum);
                }
                return self.neighbours.refuse();
            }
        };
        let mission = self.update.mission_of(&self.member, id);
        let mission = mission.and_then(|mission| mission.with_relays(relays).ok());
        let Some(mission) = mission else {
            return self.view.ask(now);
        };
        let before = self.member.mission.relays();
        self.member.index = match mission.heading() {
            Heading::TowardRx => place,
            Heading::TowardTx => relays.saturating_sub(place).saturating_add(1),
        };
        self.member.view = proposed.view;
        self.fly(mission, id);
        self.view.heard_of(proposed.view);
        let (back, onward) = (self.back(), self.onward());
        self.neighbours.at_mut(back).agree_with_proposer();
        self.neighbours.at_mut(onward).agree(place == relays);
        let works = self.member.settings.method == Method::Joint;
        let rest = now + Duration::from_millis(100).times(u32::from(lease_left));
        let views = (proposed.view, proposed.base.id);
        self.lease.renew(now, views, rest, relays < before);
        if leads {
            self.lease.commit();
        }
        self.round.renew(rest, leads, works);
        bump(&mut self.telemetry.stats.views);
        self.telemetry.told_lapsed = false;
        self.telemetry.told_refused = false;
        self.raise(Event::Reformed);
        if id != self.update.latest() {
            // A newer one has come in the meantime.
            self.view.ask(now);
        }
    }

    /// Flies `mission` from now on, which is that of `id`.
    fn fly(&mut self, mission: Mission, id: MissionId) {
        self.member.mission = mission;
        if id == self.member.active {
            return;
        }
        self.member.active = id;
        let common = mission.config().common;
        self.round
            .load(self.member.settings.profile.unwrap_or(common));
        self.raise(Event::Adopted);
    }

    /// One measurement, by a relay that measures.
    pub(crate) fn handle_sample(&mut self, sample: Sample) {
        let at = self.round.setpoint().filter(|_| self.member.index == 1);
        if !self.meter.take(&self.member.mission, at, sample) {
            bump(&mut self.telemetry.stats.samples_refused);
        }
    }

    /// The leader begins again, at `now`; nobody else has anything to begin.
    pub(crate) fn restart(&mut self, now: Instant) {
        let leads = self.member.index == self.member.mission.leader();
        let may = leads && !self.view.has_no_quorum() && !self.stands_down();
        if may && self.view.awaited().is_none() {
            let context = of(
                now,
                &self.member,
                &self.neighbours,
                &self.update,
                &self.meter,
                self.lease.held(now),
            );
            let effects = self.round.restart(&context);
            self.apply(now, effects);
        }
    }

    /// The drone was at `place` at time `at`.
    pub(crate) fn handle_position(&mut self, now: Instant, at: Instant, place: Placement) {
        self.steering.position(at, place);
        self.steer(now);
    }

    /// Who fell silent at `side` is not in the air any more.
    pub(crate) fn clear_lost(&mut self, now: Instant, side: Side) {
        self.steering.clear_lost(side);
        self.steer(now);
    }

    /// What it has said in the votes on views.
    pub(crate) const fn view_record(&self) -> ViewRecord {
        self.view.record(self.member.digest)
    }

    /// A relay that has just been switched on has said what is in `record`.
    pub(crate) fn resume_view(
        &mut self,
        now: Instant,
        record: &ViewRecord,
    ) -> Result<(), RecordError> {
        let untouched = self.round.is_untouched();
        self.view.resume(now, &self.member, record, untouched)?;
        self.lease.resume(&self.member.settings);
        Ok(())
    }

    /// The next message to send, to which node at which side. Call until there is none.
    pub(crate) fn poll_message(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        if self.stands_down() {
            return self.next_to_namesake(now);
        }
        if let Some(message) = self.next_of_a_round(now) {
            return Some(message);
        }
        let mission = self.member.digest;
        if let Some((side, to, ask, answer)) = self.neighbours.take_heartbeat(now) {
            let beat = Message::Heartbeat {
                mission,
                ask,
                answer,
            };
            return Some((side, to, beat));
        }
        if let Some((side, to, hello)) = self.next_hello(now) {
            return Some((side, to, Message::Hello(hello)));
        }
        #[cfg(feature = "upload")]
        for side in [Side::Upstream, Side::Downstream] {
            if let Some(offer) = self.next_offer(now, side) {
                return Some(offer);
            }
            if let Some((to, hello)) = self.next_report(now, side) {
                return Some((side, to, Message::Hello(hello)));
            }
        }
        let (side, to, fence) = self.steering.poll_transmit()?;
        Some((side, to, Message::Fence { mission, fence }))
    }

    /// The next message of a view change or of a round.
    fn next_of_a_round(&mut self, now: Instant) -> Option<(Side, u16, Message)> {
        let (onward, back) = (self.onward(), self.back());
        let peer = |side| {
            let neighbour = self.neighbours.at(side);
            neighbour
                .is_mutual()
                .then_some((neighbour.node(), neighbour.is_agreed()))
        };
        let (next, before) = (peer(onward), peer(back));
        let context = of(
            now,
            &self.member,
            &self.neighbours,
            &self.update,
            &self.meter,
            self.lease.held(now),
        );
        // Without anybody to hand it to it waits.
        if let Some((to, _)) = next
            && let Some(message) = self.view.take_onward(&context, to)
        {
            #[cfg(feature = "upload")]
            {
                let holds = self.neighbours.at(onward).holds;
                if self.update.offer_to(holds).is_some() {
                    self.neighbours.at_mut(onward).offer = true;
                    self.update.begin_offers(onward);
                    return self.next_offer(now, onward);
                }
            }
            return Some((onward, to, message));
        }
        if let Some((to, _)) = before
            && let Some(message) = self.view.take_back()
        {
            return Some((back, to, message));
        }
        let agreed = |peer: Option<(u16, bool)>| peer.is_some_and(|(_, agreed)| agreed);
        if self.view.awaited().is_none() {
            if agreed(next)
                && let Some(message) = self.lease.take_onward(&context)
                && let Some((to, _)) = next
            {
                return Some((onward, to, message));
            }
            if agreed(before)
                && let Some(message) = self.lease.take_back(&context)
                && let Some((to, _)) = before
            {
                return Some((back, to, message));
            }
        }
        if let Some(message) = self.round.take_onward(&context, agreed(next))
            && let Some((to, _)) = next
        {
            return Some((onward, to, message));
        }
        let message = self.round.take_back(&context, agreed(before))?;
        let (to, _) = before?;
        Some((back, to, message))
    }

    pub(crate) fn poll_event(&mut self) -> Option<Event> {
        self.telemetry.events.take()
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        if self.stands_down() {
            return self.namesake.next_timeout();
        }
        [
            self.neighbours.next_timeout(),
            self.view.next_timeout(),
            self.lease.next_timeout(),
            self.round.next_timeout(),
            self.steering.next_timeout(),
            #[cfg(feature = "upload")]
            self.update.next_timeout(),
        ]
        .into_iter()
        .flatten()
        .min()
    }

    /// Where to be in the end.
    pub(crate) const fn final_setpoint(&self) -> Option<Placement> {
        self.round.setpoint()
    }

    /// Where to fly now.
    pub(crate) fn setpoint(&self) -> Option<Placement> {
        if self.stands_down() {
            return None;
        }
        self.steering.setpoint(self.wanted())
    }

    /// What keeps the relay from its place at `side`.
    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.steering.hold_reason(side)
    }

    /// Until when it may hold what was agreed on.
    pub(crate) const fn lease(&self) -> Option<Instant> {
        self.lease.until()
    }

    pub(crate) fn phase(&self) -> Phase {
        if self.view.has_no_quorum() {
            Phase::NoQuorum
        } else if self.view.awaited().is_some() {
            Phase::ViewChange
        } else {
            self.round.phase()
        }
    }

    pub(crate) const fn member(&self) -> &Member {
        &self.member
    }

    /// The neighbours toward Tx and toward Rx.
    pub(crate) fn neighbours(&self) -> [Option<u16>; 2] {
        self.neighbours.nodes()
    }

    pub(crate) const fn round(&self) -> &Round {
        &self.round
    }

    pub(crate) const fn meter(&self) -> &Meter {
        &self.meter
    }

    pub(crate) const fn stats(&self) -> &Stats {
        &self.telemetry.stats
    }

    pub(crate) const fn stats_mut(&mut self) -> &mut Stats {
        &mut self.telemetry.stats
    }
}

#[cfg(feature = "upload")]
impl Node {
    /// A message from the ground at `side`; whether it is one for the ground to say.
    fn on_ground(&mut self, now: Instant, side: Side, from: u16, message: &Message) -> bool {
        let base = self.member.digest;
        match message {
            Message::Offer { .. } | Message::Hello(_) if message.mission() != Some(base) => {
                self.refuse_mission(side, from);
            }
            Message::Offer { upload, answer } => {
                if self.is_asked(now, *answer) {
                    self.hold(now, *upload);
                }
                self.neighbours.at_mut(side).ground = true;
            }
            Message::Hello(hello) => self.neighbours.at_mut(side).ground |= hello.ask,
            _ => return false,
        }
        true
    }

    /// What the ground at `side` is told, once it is owed: to which node.
    fn next_report(&mut self, now: Instant, side: Side) -> Option<(u16, Hello)> {
        if !core::mem::take(&mut self.neighbours.at_mut(side).ground) {
            return None;
        }
        let to = match side {
            Side::Upstream => 0,
            Side::Downstream => self.member.all.saturating_add(1),
        };
        let nonce = self.ask_number(now);
        let hello = Hello {
            neighbour: 0,
            form: false,
            ..self.hello(now, side, false, nonce)
        };
        Some((to, hello))
    }

    /// Whether an offer of that number answers a hello of late; one that does not is counted.
    fn is_asked(&mut self, now: Instant, answer: u16) -> bool {
        let asked = self.update.asked(answer, now, &self.member.settings);
        if !asked {
            bump(&mut self.telemetry.stats.stale);
        }
        asked
    }

    /// An offer from node `from` at `side`, for relays that were loaded with the same mission. One that answers a hello of late is
    /// answered only by who holds as new a mission then: any other answer would be answered by the same offer.
    fn on_offer(&mut self, now: Instant, side: Side, from: u16, upload: &Upload, answer: u16) {
        if !takes_uploads(&self.member) {
            return bump(&mut self.telemetry.stats.unsigned);
        }
        if !self.is_asked(now, answer) {
            return self.owe_hello(side, from, false);
        }
        let id = upload.id();
        let neighbour = self.neighbours.at_mut(side);
        if neighbour.node() == from {
            neighbour.holds = neighbour.holds.max(Some(id));
        }
        self.hold(now, *upload);
        if self.update.latest() >= id {
            self.owe_hello(side, from, false);
        }
    }

    /// Holds `upload` from now on, if it is newer than what is held.
    fn hold(&mut self, now: Instant, upload: Upload) {
        if self.update.hold(&self.member, upload) {
            self.held(now);
        }
    }

    /// A newer mission is held.
    fn held(&mut self, now: Instant) {
        self.raise(Event::Uploaded);
        // The leader has to hold it first; the others hold it best before the proposal comes to them.
        for side in [Side::Upstream, Side::Downstream] {
            self.neighbours.at_mut(side).offer = true;
            self.update.begin_offers(side);
        }
        self.view.ask(now);
    }

    /// The same by the relay's own firmware.
    pub(crate) fn handle_upload(
        &mut self,
        now: Instant,
        upload: &Upload,
    ) -> Result<(), UploadError> {
        self.update.hand_in(&self.member, upload)?;
        self.held(now);
        Ok(())
    }

    /// A relay that has just been switched on flies `upload`, which it held before.
    pub(crate) fn resume(&mut self, upload: &Upload) -> Result<(), UploadError> {
        let untouched = self.view.is_untouched() && self.round.is_untouched();
        let mission = self.update.resume(&self.member, upload, untouched)?;
        self.member.mission = mission;
        self.member.active = upload.id();
        let common = mission.config().common;
        self.round
            .load(self.member.settings.profile.unwrap_or(common));
        Ok(())
    }

    /// The newest mission held, if it was uploaded.
    pub(crate) const fn upload(&self) -> Option<&Upload> {
        self.update.upload()
    }

    /// The neighbour `from` at `side` says that it holds the mission of that number.
    fn compare(&mut self, side: Side, from: u16, holds: MissionId) {
        if !takes_uploads(&self.member) {
            return;
        }
        let latest = self.update.latest();
        if holds >= latest {
            self.update.stop_offers(side);
        }
        if holds > latest {
            self.owe_hello(side, from, false);
        } else if holds < latest {
            self.neighbours.at_mut(side).offer = true;
        } else if self.neighbours.at(side).holds != Some(latest)
            && side == self.onward()
            && self
                .view
                .awaited()
                .is_some_and(|proposed| proposed.mission_id == latest)
        {
            // The proposal had to wait for that.
            self.view.resend();
        }
    }

    /// The offer that is owed to the neighbour at `side`, or the hello that asks for one that it can answer: to which node.
    fn next_offer(&mut self, now: Instant, side: Side) -> Option<(Side, u16, Message)> {
        let neighbour = self.neighbours.at_mut(side);
        let due = core::mem::take(&mut neighbour.offer);
        let (to, holds, answer) = (neighbour.node(), neighbour.holds, neighbour.asked);
        let upload = self.update.offer_to(holds)?;
        if !due || to == 0 {
            return None;
        }
        let settings = self.member.settings;
        self.update.offered(side, now, &settings);
        let message = if self.update.has_asked(side, now, &settings) {
            Message::Offer { upload, answer }
        } else {
            let nonce = self.ask_number(now);
            Message::Hello(self.hello(now, side, true, nonce))
        };
        Some((side, to, message))
    }

    /// Whoever has not said since that it holds the mission is offered it again.
    fn offer_again(&mut self, now: Instant) {
        for side in [Side::Upstream, Side::Downstream] {
            if self.update.offers_again(side, now) {
                self.neighbours.at_mut(side).offer = true;
            }
        }
    }
}

#[cfg(feature = "upload")]
#[cfg(test)]
mod tests;
