//! The protocol of one relay, on messages and without bytes: what it does with a sweep, a verdict, silence.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`exchange`] | the state table of a pass and what comes back of it |
//! | `share` | a relay's share of every algorithm: sweeps, courses of the joint method, turns |
//! | `lead` | what the leader has beyond that: which pass comes next |
//! | `align` | a sweep of Algorithms 1 and 4 |
//! | `adjust` | a turn of Algorithm 2 |
//! | [`sample`] | the interference that a relay measures |
//! | `repeats` | how long an answer is awaited, and when a pass is sent again |
//! | [`liveness`] | when a neighbour counts as lost |
//! | [`beside`] | which node is taken for the neighbour on one side |
//! | [`members`] | which view of the chain was agreed on, and when a new one is called for |
//! | `incoming`, `outgoing` | what a message does; what there is to say |
//! | `forming` | hellos, calls and new views |
//! | `uploads` | a newer mission, in flight |
//! | [`timers`] | every timer, in one table |
//! | `steering` | the setpoint on its way to the agreed place |
//!
//! `Node` connects them. It answers messages by setting flags, and builds what it sends from its state when asked to, so
//! nothing queues up and a message sent twice is harmless.

mod adjust;
mod align;
pub mod beside;
pub mod exchange;
mod forming;
mod incoming;
mod lead;
pub mod liveness;
pub mod members;
mod outgoing;
mod repeats;
pub mod sample;
mod share;
mod steering;
pub mod timers;
#[cfg(feature = "upload")]
mod uploads;

use crate::guard::Guard;
use crate::mission::{Mission, Profile};
use crate::place::Placement;
use crate::time::{Duration, Instant};
use crate::wire::digest::MissionId;
#[cfg(feature = "upload")]
use crate::wire::upload::Upload;

use crate::event::{Event, Pending};
use crate::settings::{Identity, Method, Settings, Wiring};
use crate::side::Side;
use crate::stats::{Stats, bump};
use beside::{Beside, CANDIDATES};
use exchange::{Next, Phase};
use members::Members;
use repeats::Repeats;
use sample::{Meter, Sample};
use share::{Own, Share};
use steering::guard;
use timers::{Timer, Timers};

/// How long a relay rests between two portions of a computation, so that a caller's loop gets its turn.
const PAUSE: Duration = Duration::from_micros(250);

/// Whether this crate was built to re-form the chain. Without it, none of its code is reached.
pub(crate) const MEMBERSHIP: bool = cfg!(feature = "membership");

/// Whether it was built to take a newer mission in flight.
pub(crate) const UPLOAD: bool = cfg!(feature = "upload");

/// Whether it was built to guard setpoints.
pub(crate) const GUARD: bool = cfg!(feature = "guard");

/// A relay's share of the protocol.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    mission: Mission,
    settings: Settings,
    members: Members,
    share: Share,
    meter: Meter,
    /// The newest mission that was uploaded.
    #[cfg(feature = "upload")]
    upload: Option<Upload>,
    guard: Option<Guard>,
    timers: Timers,
    upstream: Beside,
    downstream: Beside,
    onward_due: bool,
    back_due: bool,
    busy_due: bool,
    repeats: Repeats,
    pending: Pending,
    pub(crate) stats: Stats,
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
        let relays = mission.relays();
        let after = if identity.index < relays {
            identity.index.saturating_add(1)
        } else {
            0
        };
        let leader = identity.index == mission.leader();
        let profile = settings.profile.unwrap_or(mission.config().common);
        // Any odd multiplier keeps distinct seeds distinct; the generator must not start at zero.
        let random = seed
            .wrapping_mul(0x9E37_79B1)
            .wrapping_add(u32::from(identity.index))
            | 1;
        let [a, b, ..] = random.to_le_bytes();
        let low = u16::from_le_bytes([a, b]);
        let mut node = Self {
            members: Members::new(&mission, identity.index),
            mission,
            settings,
            share: Share::new(leader, low, profile),
            meter: Meter::new(settings.measure),
            #[cfg(feature = "upload")]
            upload: None,
            guard: guard(&settings, identity.index, after, seed, now),
            timers: Timers::new(),
            upstream: Beside::new(identity.index.saturating_sub(1), now),
            downstream: Beside::new(after, now),
            onward_due: false,
            back_due: false,
            busy_due: false,
            repeats: Repeats::new(random),
            pending: Pending::default(),
            stats: Stats::default(),
        };
        for side in [Side::Upstream, Side::Downstream] {
            if node.beside(side).node() != 0 {
                node.timers.set(Timer::of(side), now + settings.quiet);
            }
        }
        if leader || settings.method == Method::Joint {
            node.timers.set(Timer::Work, now + PAUSE);
        }
        if !leader && MEMBERSHIP {
            node.await_first(now);
        }
        node
    }

    /// By when the first pass should have come, were this the beginning.
    fn await_first(&mut self, now: Instant) {
        let Settings {
            hop_time, quiet, ..
        } = self.settings;
        let first = hop_time.times(2 * u32::from(self.members.all));
        self.timers.set(Timer::Call, now + quiet + first);
    }

    /// Whether it is at the chain's solution, as every relay of its view is.
    fn is_solving(&mut self) -> bool {
        let works = self.timers.runs(Timer::Work);
        let (share, own) = self.parts();
        works && share.is_solving(own)
    }

    /// It has just found out where it is to be: what it waits for it waits for from now on.
    fn solved(&mut self, now: Instant) {
        let quiet = self.settings.quiet;
        for side in [Side::Upstream, Side::Downstream] {
            if self.beside(side).excuse(now) {
                self.timers.set(Timer::of(side), now + quiet);
            }
        }
        if self.awaits_first() {
            self.await_first(now);
        }
    }

    /// Whether no pass has come yet, and it has not called for one.
    fn awaits_first(&self) -> bool {
        MEMBERSHIP && self.share.is_fresh() && !self.members.calls
    }

    const fn beside(&mut self, side: Side) -> &mut Beside {
        match side {
            Side::Upstream => &mut self.upstream,
            Side::Downstream => &mut self.downstream,
        }
    }

    /// On which side node `sender` is, if it may have something to say to this relay: a neighbour, or one that might become
    /// one, or the ground where it may upload missions.
    pub(crate) fn side_of(&self, sender: u16) -> Option<Side> {
        #[cfg(feature = "upload")]
        if let Some(side) = self.ground_side(sender) {
            return Some(side);
        }
        let own = self.members.node;
        let near = sender.abs_diff(own) <= if self.seeks() { CANDIDATES } else { 1 };
        if !near || sender == own || sender < 1 || sender > self.members.all {
            return None;
        }
        Some(if sender < own {
            Side::Upstream
        } else {
            Side::Downstream
        })
    }

    /// Whether others than the neighbours of the mission can be heard.
    fn seeks(&self) -> bool {
        MEMBERSHIP && self.settings.wiring == Wiring::Shared
    }

    /// Whether newer missions are taken in flight: only where frames are signed.
    const fn takes_uploads(&self) -> bool {
        UPLOAD && self.settings.auth.is_some()
    }

    /// The relay's share, and what it needs to know of the relay.
    fn parts(&mut self) -> (&mut Share, Own<'_>) {
        let onward = match Side::onward(self.mission.heading()) {
            Side::Upstream => &self.upstream,
            Side::Downstream => &self.downstream,
        };
        let own = Own {
            mission: &self.mission,
            settings: &self.settings,
            flown: self.members.flown,
            held: self.members.held,
            view: self.members.view,
            index: self.members.index,
            end: onward.is_end(),
            measured_per_w: self.meter.published(),
        };
        (&mut self.share, own)
    }

    /// Flies `mission` from now on, whose mission_id is `mission_id`.
    fn fly(&mut self, mission: Mission, mission_id: MissionId) {
        self.mission = mission;
        self.members.flown = mission_id;
        let common = mission.config().common;
        self.share.load(self.settings.profile.unwrap_or(common));
    }

    /// Does what the relay's share asks for.
    fn proceed(&mut self, now: Instant, next: Next) {
        let mut moved = false;
        match next {
            Next::Nothing => return,
            Next::Foreign if !MEMBERSHIP => bump(&mut self.stats.stale),
            Next::Formed { .. } if !MEMBERSHIP => return,
            Next::Foreign => {
                bump(&mut self.stats.stale);
                self.call(now);
            }
            Next::Formed { granted } => return self.formed(now, granted),
            Next::Stale => bump(&mut self.stats.stale),
            Next::Work { moved: to } => {
                moved = to;
                // What there was to say of the pass before would be stale.
                self.onward_due = false;
                self.back_due = false;
                self.busy_due = false;
                self.timers.stop(Timer::Repeat);
                self.timers.set(Timer::Work, now + PAUSE);
            }
            Next::Think => return self.timers.set(Timer::Work, now + PAUSE),
            Next::Forward { moved: to } => {
                moved = to;
                self.repeats.heard();
                self.onward_due = true;
                self.busy_due = false;
                // An answer to the pass before would be stale.
                self.back_due = false;
                self.timers.stop(Timer::Repeat);
                self.timers.stop(Timer::Work);
            }
            Next::Busy => {
                bump(&mut self.stats.repeated);
                self.busy_due = true;
            }
            Next::Repeat => {
                bump(&mut self.stats.repeated);
                self.back_due = true;
            }
            Next::Answer { moved: to, agreed } => {
                moved = to;
                self.onward_due = false;
                self.busy_due = false;
                self.timers.stop(Timer::Repeat);
                self.timers.stop(Timer::Work);
                let back = Side::back(self.mission.heading());
                self.back_due = self.beside(back).node() != 0;
                if agreed {
                    self.pending.raise(Event::Converged);
                }
            }
            Next::Infeasible => {
                self.timers.stop(Timer::Repeat);
                self.pending.raise(Event::Infeasible);
            }
        }
        if moved {
            if self.guard.is_none() {
                self.pending.raise(Event::SetpointChanged);
            }
            // What is measured from now on is measured elsewhere.
            self.meter.restart();
        }
        self.stats.sweeps = self.share.sweeps();
    }

    /// Handles every timer that has run out by `now`. Each is stopped first and set again only to a later time, so six
    /// rounds at most; the work is that of one portion of a computation.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        while let Some(timer) = self.timers.expired(now) {
            match timer {
                Timer::Work => {
                    let (share, own) = self.parts();
                    let solving = share.is_solving(own);
                    let next = share.work(own);
                    let solved = solving && !share.is_solving(own);
                    self.proceed(now, next);
                    if solved {
                        self.solved(now);
                    }
                }
                Timer::Repeat => {
                    if self.share.phase() == Phase::Waiting {
                        bump(&mut self.stats.repeats);
                        self.repeats.unheard();
                        self.onward_due = true;
                    }
                }
                Timer::Upstream => self.silence(now, Side::Upstream),
                Timer::Downstream => self.silence(now, Side::Downstream),
                Timer::Remind => self.remind(now),
                Timer::Call if self.awaits_first() && self.is_solving() => self.await_first(now),
                Timer::Call if MEMBERSHIP => self.call_again(now),
                Timer::Call => {}
            }
        }
        self.steer(now);
    }

    /// One measurement, by a relay that measures.
    pub(crate) fn handle_sample(&mut self, sample: Sample) {
        let at = self.share.setpoint().filter(|_| self.members.index == 1);
        if !self.meter.take(&self.mission, at, sample) {
            bump(&mut self.stats.samples_refused);
        }
    }

    /// The leader begins again, at `now`; nobody else has anything to begin.
    pub(crate) fn restart(&mut self, now: Instant) {
        if self.members.index == self.mission.leader() && self.share.phase() != Phase::Cut {
            self.share.restart();
            self.proceed(now, Next::Work { moved: false });
        }
    }

    fn silence(&mut self, now: Instant, side: Side) {
        let (settings, seeks) = (self.settings, self.seeks());
        if self.is_solving() && self.beside(side).excuse(now) {
            self.timers.set(Timer::of(side), now + settings.quiet);
            return;
        }
        let quiet = self.beside(side).silent(now, &settings, seeks);
        self.timers.set(Timer::of(side), quiet.look_again);
        if quiet.lost {
            self.pending.raise(Event::NeighbourLost(side));
        }
        self.review(now);
    }

    pub(crate) fn poll_event(&mut self) -> Option<Event> {
        self.pending.take()
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.timers.next()
    }

    /// Where to be in the end.
    pub(crate) const fn agreed(&self) -> Option<Placement> {
        self.share.setpoint()
    }

    pub(crate) fn bound(&self) -> Option<f32> {
        self.share.bound()
    }

    pub(crate) fn target(&self) -> Option<f32> {
        self.share.target()
    }

    pub(crate) fn phase(&self) -> Phase {
        self.share.phase()
    }

    pub(crate) fn mission(&self) -> &Mission {
        &self.mission
    }

    pub(crate) const fn members(&self) -> &Members {
        &self.members
    }

    /// The neighbours toward Tx and toward Rx.
    pub(crate) fn neighbours(&self) -> [Option<u16>; 2] {
        [&self.upstream, &self.downstream].map(|side| Some(side.node()).filter(|node| *node != 0))
    }

    pub(crate) fn profile(&self) -> Profile {
        self.share.profile()
    }

    pub(crate) fn rounds(&self) -> Option<(u16, f32)> {
        self.share.rounds()
    }

    pub(crate) fn meter(&self) -> &Meter {
        &self.meter
    }
}
