//! State of a relay: its five layers, events and counters, and how the effects of one layer reach the others.
//!
//! A relay whose part of the chain has no quorum gives its links up after a while and searches anew.
//! Two parts that are interleaved, as 1 - 3 - 5 and 2 - 4 are, or a part of which no relay takes the one that could lead it back, would
//! keep their links for good. One that has no quorum has nothing to lose by them.

use crate::event::{About, Event, Pending};
use crate::mission::Mission;
use crate::node::context::{Context, Effects, Member};
use crate::node::duplicate::DuplicateIndex;
use crate::node::lease::Lease;
use crate::node::mission_update::MissionUpdate;
use crate::node::neighbour::Neighbours;
use crate::node::round::Round;
use crate::node::round::state::Phase;
use crate::node::sample::Sample;
use crate::node::steering::Steering;
use crate::node::timing::first_pass;
use crate::node::view::change::ViewChange;
use crate::node::view::record::{RecordError, ViewRecord};
use crate::settings::{Identity, Method, Settings};
use crate::side::Side;
use crate::stats::{Stats, bump};
use crate::time::{Duration, Instant};
use crate::wire::message::Claim;

/// Claim to repeat: at which side, to which node.
pub(crate) type Echo = (Side, u16, Claim);

/// A relay's share of the protocol.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub(super) member: Member,
    pub(super) layers: Layers,
    pub(super) steering: Steering,
    pub(super) duplicate: DuplicateIndex,
    pub(super) adrift: Adrift,
    /// Claim of a neighbour that is to be repeated to it.
    pub(super) echo: Option<Echo>,
    /// Side of the next claim.
    pub(super) claim_side: Side,
    pub(super) telemetry: Telemetry,
}

/// The relay's own seed.
fn seed_of(identity: Identity, seed: u32) -> u32 {
    seed.wrapping_add(u32::from(identity.index))
}

impl Node {
    /// A relay before it has [begun](Self::begin). `identity` and `settings` have been checked.
    ///
    /// Plain numbers alone, which are written where the relay is to stand.
    pub(crate) fn new(
        mission: &Mission,
        identity: Identity,
        settings: &Settings,
        seed: u32,
        now: Instant,
    ) -> Self {
        let leads = identity.index == mission.leader();
        let profile = settings.profile.unwrap_or(mission.config().common);
        let seed = seed_of(identity, seed);
        let [a, b, ..] = seed.wrapping_mul(0x9E37_79B1).to_le_bytes();
        let number = u16::from_le_bytes([a, b]);
        let member = Member::new(*mission, *settings, identity.index);
        Self {
            layers: Layers {
                neighbours: Neighbours::NONE,
                view: ViewChange::new(member.all, mission.leader(), !seed),
                lease: Lease::new(!seed.rotate_left(16), now, settings),
                update: MissionUpdate::new(member.active, seed.rotate_left(4), now),
                round: Round::new(leads, number, profile, settings, seed, now),
            },
            steering: Steering::NONE,
            duplicate: DuplicateIndex::new(seed.rotate_left(24), now, settings),
            adrift: Adrift::NONE,
            echo: None,
            claim_side: Side::Upstream,
            telemetry: Telemetry::default(),
            member,
        }
    }

    /// It is switched on at `now`, with the seed that it was made with.
    #[inline(never)] // as `Steering::begin`
    pub(crate) fn begin(&mut self, identity: Identity, seed: u32, now: Instant) {
        let Member {
            settings,
            mission,
            all,
            ..
        } = &self.member;
        let seed = seed_of(identity, seed);
        let neighbours = &mut self.layers.neighbours;
        neighbours.begin(identity.index, *all, seed.rotate_left(8), now, settings);
        self.steering.begin(settings, neighbours.nodes(), seed, now);
        let leads = identity.index == mission.leader();
        if leads || settings.method == Method::Joint {
            self.layers.round.work_soon(now);
        }
        if !leads {
            self.await_first(now);
        }
    }

    pub(super) fn raise(&mut self, event: Event) {
        self.telemetry.events.raise(event);
    }

    pub(super) fn raise_about(&mut self, about: About, side: Side, node: u16) {
        self.telemetry.events.raise_about(about, side, node);
    }

    /// Has the other layers know what one of them came to.
    pub(super) fn apply(&mut self, now: Instant, effects: Effects) {
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
            self.layers.neighbours.at_mut(back).proposed_by(proposer);
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
            self.layers.round.suspend();
        }
        if effects.view_needed {
            self.layers.view.asking.ask(now);
        }
        if effects.ask {
            let back = self.back();
            let to = self.layers.neighbours.at(back).node();
            self.owe_hello(back, to, true);
        }
        if let Some(decided) = effects.decided {
            self.decided(now, decided);
            self.drift(now);
        }
        if effects.converged {
            self.raise(Event::Converged);
            let leads = self.layers.context(now, &self.member).leads();
            self.layers.lease.begin(now, leads);
        }
        if effects.infeasible {
            self.raise(Event::Infeasible);
        }
        if effects.believes {
            self.believe();
        }
        if effects.unclear {
            self.raise(Event::InterfererUnclear);
        }
        if let Some(node) = effects.off {
            self.raise_about(About::Sensor, onward, node);
        }
    }

    /// Flies by what is believed from now on.
    fn believe(&mut self) {
        let told = self.layers.round.sensing().told();
        let believing = self
            .member
            .mission
            .believing(self.member.interference, &told.belief);
        if let Ok(mission) = believing {
            self.member.mission = mission;
            self.raise(Event::Believed);
        }
    }

    pub(crate) fn poll_event(&mut self) -> Option<Event> {
        self.telemetry.events.take()
    }

    /// Until when it may hold what was agreed on.
    pub(crate) const fn lease(&self) -> Option<Instant> {
        self.layers.lease.until()
    }

    pub(crate) fn phase(&self) -> Phase {
        if self.layers.view.has_no_quorum() {
            Phase::NoQuorum
        } else if self.layers.view.awaited().is_some() {
            Phase::ViewChange
        } else {
            self.layers.round.phase()
        }
    }

    pub(crate) const fn member(&self) -> &Member {
        &self.member
    }

    /// The neighbours toward Tx and toward Rx.
    pub(crate) fn neighbours(&self) -> [Option<u16>; 2] {
        self.layers.neighbours.nodes()
    }

    pub(crate) const fn round(&self) -> &Round {
        &self.layers.round
    }

    pub(crate) const fn stats(&self) -> &Stats {
        &self.telemetry.stats
    }

    pub(crate) const fn stats_mut(&mut self) -> &mut Stats {
        &mut self.telemetry.stats
    }

    /// What it has said in the votes on views.
    pub(crate) const fn view_record(&self) -> ViewRecord {
        self.layers.view.record(self.member.digest)
    }

    /// A relay that has just been switched on has said what is in `record`.
    pub(crate) fn resume_view(
        &mut self,
        now: Instant,
        record: &ViewRecord,
    ) -> Result<(), RecordError> {
        let untouched = self.layers.round.is_untouched();
        self.layers
            .view
            .resume(now, &self.member, record, untouched)?;
        self.layers.lease.resume(&self.member.settings);
        Ok(())
    }

    /// One measurement, by a relay that measures.
    pub(crate) fn handle_sample(&mut self, now: Instant, sample: Sample) {
        if !self.layers.round.handle_sample(now, &self.member, sample) {
            bump(&mut self.telemetry.stats.samples_refused);
        }
    }

    /// The leader begins again, at `now`; nobody else has anything to begin.
    pub(crate) fn restart(&mut self, now: Instant) {
        let leads = self.member.index == self.member.mission.leader();
        let may = leads && !self.layers.view.has_no_quorum() && !self.is_passive();
        if may && self.layers.view.awaited().is_none() {
            let context = self.layers.context(now, &self.member);
            let effects = self.layers.round.restart(&context);
            self.apply(now, effects);
        }
    }
}

/// The layers of one relay.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub(super) neighbours: Neighbours,
    pub(super) view: ViewChange,
    pub(super) lease: Lease,
    pub(super) update: MissionUpdate,
    pub(super) round: Round,
}

impl Layers {
    /// What a layer is handed. It borrows the member alone, which stands beside the layers: any of them can be lent while it lasts.
    pub(super) fn context<'a>(&self, now: Instant, member: &'a Member) -> Context<'a> {
        let onward = Side::onward(member.mission.heading());
        Context {
            now,
            member,
            latest: self.update.latest(),
            end: self.neighbours.at(onward).has_no_peer(),
            held: self.lease.held(now),
        }
    }

    /// What could not be said to the neighbour after can be now.
    pub(super) fn resend(&mut self) {
        self.view.resend();
        self.round.resend();
    }
}

/// What the firmware is told.
#[derive(Clone, Debug, Default)]
pub(super) struct Telemetry {
    pub(super) events: Pending,
    pub(super) stats: Stats,
    /// Whether a lapse of the lease, and a refusal, have been told since a view was agreed on.
    pub(super) told_lapsed: bool,
    pub(super) told_refused: bool,
}

/// So many times `dead_after` a part without a quorum keeps its links, at first and at most.
const FIRST: u32 = 3;
const MOST: u32 = 4;

/// Since when there is no quorum, and how often the links were given up since.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Adrift {
    /// When the links are given up; `None` where there is a quorum.
    at: Option<Instant>,
    again: bool,
}

impl Adrift {
    pub(super) const NONE: Self = Self {
        at: None,
        again: false,
    };

    pub(super) const fn next_timeout(&self) -> Option<Instant> {
        self.at
    }
}

impl Node {
    /// The part that this relay is in has been refused a view, or has one.
    pub(super) fn drift(&mut self, now: Instant) {
        if !self.searches() || !self.layers.view.has_no_quorum() {
            self.adrift = Adrift::NONE;
        } else if self.adrift.at.is_none() {
            self.adrift.at = Some(now + self.keeps_links_for());
        }
    }

    /// How long links are kept without a quorum.
    fn keeps_links_for(&self) -> Duration {
        let settings = &self.member.settings;
        let times = if self.adrift.again { MOST } else { FIRST };
        let pass = first_pass(settings, self.member.all);
        settings.dead_after.times(times).max(pass)
    }

    /// Gives the links up if it is time to.
    pub(super) fn search_anew(&mut self, now: Instant) {
        if self.adrift.at.is_none_or(|at| now < at) {
            return;
        }
        self.adrift.again = true;
        self.adrift.at = Some(now + self.keeps_links_for());
        for side in [Side::Upstream, Side::Downstream] {
            self.layers.neighbours.at_mut(side).give_up(now);
        }
    }
}
