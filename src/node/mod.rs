//! The protocol of one relay, on messages and without bytes: what it does with a sweep, a verdict, silence.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`settings`] | who the relay is and how it behaves, checked once |
//! | [`exchange`] | the state table of a pass and what comes back of it |
//! | `share` | a relay's share of every algorithm: sweeps, waves of altitude levels, turns |
//! | `lead` | what the leader has beyond that: which pass comes next |
//! | `align` | a sweep of Algorithms 1 and 4 |
//! | `adjust` | a turn of Algorithm 2 |
//! | [`sample`] | the interference that a relay measures |
//! | `repeats` | how long an answer is awaited, and when a pass is sent again |
//! | [`liveness`] | when a neighbour counts as lost |
//! | [`timers`] | every timer, in one table |
//! | [`event`] | what the firmware is told |
//! | [`stats`] | what was counted |
//!
//! `Node` connects them. It answers messages by setting flags, and builds what it sends from its state when asked to, so
//! nothing queues up and a message sent twice is harmless.

mod adjust;
mod align;
pub mod event;
pub mod exchange;
mod lead;
pub mod liveness;
mod repeats;
pub mod sample;
pub mod settings;
mod share;
mod side;
pub mod stats;
pub mod timers;

use crate::mission::{Heading, Mission, Profile};
use crate::sir::Placement;
use crate::time::{Duration, Instant};
use crate::wire::digest::digest;
use crate::wire::message::Message;

use event::{Event, Pending};
use exchange::{Next, Phase};
use liveness::{Neighbour, Silence};
use repeats::Repeats;
use sample::{Meter, Sample};
use settings::{Identity, Settings};
use share::{ADJUST, ALTITUDE, Own, Share};
pub use side::Side;
use stats::{Stats, bump};
use timers::{Timer, Timers};

/// How long a relay rests between two portions of a computation, so that a caller's loop gets its turn.
const PAUSE: Duration = Duration::from_millis(1);

/// What waits to be sent to one neighbour, apart from passes and what comes back of them.
#[derive(Clone, Copy, Debug, Default)]
struct Signs {
    /// A heartbeat that asks for one in return.
    ask: bool,
    /// A heartbeat in return.
    answer: bool,
}

/// One neighbour and what is owed to it.
#[derive(Clone, Debug)]
struct Link {
    neighbour: Neighbour,
    signs: Signs,
}

/// A relay's share of the protocol.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    mission: Mission,
    digest: u16,
    settings: Settings,
    index: u16,
    share: Share,
    meter: Meter,
    timers: Timers,
    upstream: Option<Link>,
    downstream: Option<Link>,
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
        let link = |present: bool| {
            present.then(|| Link {
                neighbour: Neighbour::new(now),
                signs: Signs::default(),
            })
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
            mission,
            digest: digest(&mission),
            settings,
            index: identity.index,
            share: Share::new(&mission, leader, low, profile),
            meter: Meter::new(settings.measure),
            timers: Timers::new(),
            upstream: link(identity.index > 1),
            downstream: link(identity.index < relays),
            onward_due: false,
            back_due: false,
            busy_due: false,
            repeats: Repeats::new(random),
            pending: Pending::default(),
            stats: Stats::default(),
        };
        for side in [Side::Upstream, Side::Downstream] {
            if node.link(side).is_some() {
                node.timers.set(side.timer(), now + settings.quiet);
            }
        }
        if leader {
            node.timers.set(Timer::Work, now + PAUSE);
        }
        node
    }

    fn link(&mut self, side: Side) -> Option<&mut Link> {
        match side {
            Side::Upstream => self.upstream.as_mut(),
            Side::Downstream => self.downstream.as_mut(),
        }
    }

    /// Which neighbour node `sender` is. Neither Tx nor Rx runs this protocol, so they are none.
    pub(crate) fn side_of(&self, sender: u16) -> Option<Side> {
        if sender.checked_add(1) == Some(self.index) {
            self.upstream.as_ref().map(|_| Side::Upstream)
        } else if self.index.checked_add(1) == Some(sender) {
            self.downstream.as_ref().map(|_| Side::Downstream)
        } else {
            None
        }
    }

    /// The relay's share, and what it needs to know of the relay.
    fn parts(&mut self) -> (&mut Share, Own<'_>) {
        let own = Own {
            mission: &self.mission,
            settings: &self.settings,
            digest: self.digest,
            index: self.index,
            measured_per_w: self.meter.published(),
        };
        (&mut self.share, own)
    }

    /// A message from the neighbour at `side`, intact and addressed to this relay. Bounded by 16 reaches.
    #[inline(never)]
    pub(crate) fn handle_message(&mut self, now: Instant, side: Side, message: &Message<'_>) {
        let quiet = self.settings.quiet;
        let Some(link) = self.link(side) else { return };
        let back = link.neighbour.heard(now);
        self.timers.set(side.timer(), now + quiet);
        if back {
            self.pending.raise(Event::NeighbourBack(side));
        }
        if message
            .mission()
            .is_some_and(|digest| digest != self.digest)
        {
            bump(&mut self.stats.mission);
            self.pending.raise(Event::MissionMismatch(side));
            return;
        }
        if let Message::Heartbeat { answer, .. } = message {
            if let Some(link) = self.link(side)
                && *answer
            {
                link.signs.answer = true;
            }
            return;
        }
        let heading = self.mission.heading();
        let wanted = if message.is_onward() {
            Side::back(heading)
        } else {
            Side::onward(heading)
        };
        if side != wanted {
            bump(&mut self.stats.misdirected);
            return;
        }
        let (share, own) = self.parts();
        let next = match message {
            Message::Sweep(sweep) => share.on_sweep(own, sweep),
            Message::Verdict(answer) => share.on_verdict(own, answer),
            Message::Wave(wave) if ALTITUDE => share.on_wave(own, wave),
            Message::Trace(trace) if ALTITUDE => share.on_trace(own, *trace),
            Message::Token(token) if ADJUST => share.on_token(own, token),
            Message::Moved(moved) if ADJUST => share.on_moved(own, moved),
            Message::Busy { sweep } => {
                if self.share.phase() == Phase::Waiting && *sweep == self.share.number() {
                    // It has arrived: what is missing is the answer, and that may take its time.
                    self.repeats.heard();
                    let patience = self.patience();
                    self.timers.set(Timer::Repeat, now + patience);
                }
                return;
            }
            _ => return,
        };
        self.proceed(now, next);
    }

    /// Does what the relay's share asks for.
    fn proceed(&mut self, now: Instant, next: Next) {
        let mut moved = false;
        match next {
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
                self.back_due = self.link(back).is_some();
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
            self.pending.raise(Event::SetpointChanged);
            // What is measured from now on is measured elsewhere.
            self.meter.restart();
        }
        self.stats.sweeps = self.share.sweeps();
    }

    /// Handles every timer that has run out by `now`. Each is stopped first and set again only to a later time, so four
    /// rounds at most; the work is that of one portion of a computation.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        while let Some(timer) = self.timers.expired(now) {
            match timer {
                Timer::Work => {
                    let (share, own) = self.parts();
                    let next = share.work(own);
                    self.proceed(now, next);
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
            }
        }
    }

    /// One measurement, by a relay that measures.
    pub(crate) fn handle_sample(&mut self, sample: Sample) {
        let at = self.share.setpoint().filter(|_| self.index == 1);
        if !self.meter.take(&self.mission, at, sample) {
            bump(&mut self.stats.samples_refused);
        }
    }

    /// The leader begins again, at `now`; nobody else has anything to begin.
    pub(crate) fn restart(&mut self, now: Instant) {
        if self.index == self.mission.leader() {
            self.share.restart();
            self.proceed(now, Next::Work { moved: false });
        }
    }

    fn silence(&mut self, now: Instant, side: Side) {
        let settings = self.settings;
        let Some(link) = self.link(side) else { return };
        let Silence { lost, look_again } = link.neighbour.silent(now, &settings);
        link.signs.ask = true;
        self.timers.set(side.timer(), look_again);
        if lost {
            self.pending.raise(Event::NeighbourLost(side));
        }
    }

    /// The next message to send, and to which neighbour. Call until there is none.
    pub(crate) fn poll_message(&mut self, now: Instant) -> Option<(Side, Message<'_>)> {
        let heading = self.mission.heading();
        let (onward, backward) = (Side::onward(heading), Side::back(heading));
        if core::mem::take(&mut self.onward_due) && self.share.phase() == Phase::Waiting {
            let patience = self.patience();
            self.timers.set(Timer::Repeat, now + patience);
            let (share, own) = self.parts();
            return share.onward(own).map(|message| (onward, message));
        }
        if core::mem::take(&mut self.back_due) && self.share.has_answer() {
            let (share, own) = self.parts();
            return share.back(own).map(|message| (backward, message));
        }
        if core::mem::take(&mut self.busy_due) {
            let sweep = self.share.number();
            return Some((backward, Message::Busy { sweep }));
        }
        let mission = self.digest;
        for side in [Side::Upstream, Side::Downstream] {
            let Some(link) = self.link(side) else {
                continue;
            };
            let Signs { ask, answer } = core::mem::take(&mut link.signs);
            if ask || answer {
                let heartbeat = Message::Heartbeat {
                    mission,
                    answer: ask,
                };
                return Some((side, heartbeat));
            }
        }
        None
    }

    /// How long what comes back of a pass sent now may take.
    fn patience(&mut self) -> Duration {
        let hops = u32::from(match self.mission.heading() {
            Heading::TowardRx => self.mission.relays().saturating_sub(self.index),
            Heading::TowardTx => self.index.saturating_sub(1),
        });
        let hop_time = self.settings.hop_time;
        self.repeats.patience(hop_time, hops, self.share.is_slow())
    }

    pub(crate) fn poll_event(&mut self) -> Option<Event> {
        self.pending.take()
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.timers.next()
    }

    pub(crate) fn setpoint(&self) -> Option<Placement> {
        self.share.setpoint()
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

    pub(crate) fn index(&self) -> u16 {
        self.index
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
