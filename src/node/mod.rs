//! The protocol of one relay, on messages and without bytes: what it does with a sweep, a verdict, silence.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`settings`] | who the relay is and how it behaves, checked once |
//! | [`align`] | Algorithm 1: the state table of a sweep |
//! | [`liveness`] | when a neighbour counts as lost |
//! | [`timers`] | every timer, in one table |
//! | [`event`] | what the firmware is told |
//! | [`stats`] | what was counted |
//!
//! `Node` connects them. It answers messages by setting flags, and builds what it sends from its state when asked to, so
//! nothing queues up and a message sent twice is harmless.

pub mod align;
pub mod event;
pub mod liveness;
pub mod settings;
pub mod stats;
pub mod timers;

use crate::mission::{Mission, Profile};
use crate::sir::Placement;
use crate::time::{Duration, Instant};
use crate::wire::digest::digest;
use crate::wire::message::Message;

use align::{Align, Next, Phase};
use event::{Event, Pending};
use liveness::{Neighbour, Silence};
use settings::{Identity, Settings};
use stats::{Stats, bump};
use timers::{Timer, Timers};

/// One of the two neighbours of a relay, or the link to it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Side {
    /// Toward the transmitter.
    Upstream,
    /// Toward the receiver.
    Downstream,
}

impl Side {
    const fn timer(self) -> Timer {
        match self {
            Self::Upstream => Timer::Upstream,
            Self::Downstream => Timer::Downstream,
        }
    }
}

/// How long the head rests between two portions of a computation, so that a caller's loop gets its turn.
const PAUSE: Duration = Duration::from_millis(1);

/// What waits to be sent to one neighbour, apart from sweeps and verdicts.
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
    profile: Profile,
    settings: Settings,
    index: u16,
    align: Align,
    timers: Timers,
    upstream: Option<Link>,
    downstream: Option<Link>,
    sweep_due: bool,
    verdict_due: bool,
    busy_due: bool,
    /// How often the current sweep has been sent again since anything was heard of it.
    unheard: u8,
    pending: Pending,
    pub(crate) stats: Stats,
    random: u32,
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
            profile,
            settings,
            index: identity.index,
            align: Align::new(identity.index == 1, low),
            timers: Timers::new(),
            upstream: link(identity.index > 1),
            downstream: link(identity.index < relays),
            sweep_due: false,
            verdict_due: false,
            busy_due: false,
            unheard: 0,
            pending: Pending::default(),
            stats: Stats::default(),
            random,
        };
        for side in [Side::Upstream, Side::Downstream] {
            if node.link(side).is_some() {
                node.timers.set(side.timer(), now + settings.quiet);
            }
        }
        if identity.index == 1 {
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

    /// A message from the neighbour at `side`, intact and addressed to this relay. Bounded by 16 reaches.
    #[inline(never)]
    pub(crate) fn handle_message(&mut self, now: Instant, side: Side, message: Message) {
        let quiet = self.settings.quiet;
        let Some(link) = self.link(side) else { return };
        let back = link.neighbour.heard(now);
        self.timers.set(side.timer(), now + quiet);
        if back {
            self.pending.raise(Event::NeighbourBack(side));
        }
        let digest = match &message {
            Message::Sweep(sweep) => Some(sweep.mission),
            Message::Verdict(answer) => Some(answer.mission),
            Message::Heartbeat { mission, .. } => Some(*mission),
            Message::Busy { .. } => None,
        };
        if digest.is_some_and(|digest| digest != self.digest) {
            bump(&mut self.stats.mission);
            self.pending.raise(Event::MissionMismatch(side));
            return;
        }
        match (side, message) {
            (Side::Upstream, Message::Sweep(sweep)) => {
                let next = self
                    .align
                    .on_sweep(&self.mission, self.index, self.profile, &sweep);
                self.proceed(now, next);
            }
            (Side::Downstream, Message::Verdict(answer)) => {
                let next = self.align.on_verdict(self.profile, answer);
                self.proceed(now, next);
            }
            (_, Message::Heartbeat { answer, .. }) => {
                if let Some(link) = self.link(side)
                    && answer
                {
                    link.signs.answer = true;
                }
            }
            (Side::Downstream, Message::Busy { sweep }) => {
                if self.align.phase() == Phase::Waiting && sweep == self.align.number() {
                    // It has arrived: what is missing is the answer, and that may take its time.
                    self.unheard = 0;
                    let patience = self.patience();
                    self.timers.set(Timer::Repeat, now + patience);
                }
            }
            (Side::Upstream, Message::Verdict(_) | Message::Busy { .. })
            | (Side::Downstream, Message::Sweep(_)) => {
                bump(&mut self.stats.misdirected);
            }
        }
    }

    /// Does what the alignment asks for.
    fn proceed(&mut self, now: Instant, next: Next) {
        match next {
            Next::Nothing => {}
            Next::Stale => bump(&mut self.stats.stale),
            Next::Work => {
                self.timers.stop(Timer::Repeat);
                self.timers.set(Timer::Work, now + PAUSE);
            }
            Next::Forward => {
                self.unheard = 0;
                self.sweep_due = true;
                self.busy_due = false;
                // An answer to the sweep before would be stale.
                self.verdict_due = false;
                self.timers.stop(Timer::Repeat);
            }
            Next::Busy => {
                bump(&mut self.stats.repeated);
                self.busy_due = true;
            }
            Next::Repeat => {
                bump(&mut self.stats.repeated);
                self.verdict_due = true;
            }
            Next::Answer { committed } => {
                self.sweep_due = false;
                self.busy_due = false;
                self.timers.stop(Timer::Repeat);
                self.verdict_due = self.upstream.is_some();
                if committed {
                    self.pending.raise(Event::SetpointChanged);
                    self.pending.raise(Event::Converged);
                }
            }
            Next::Infeasible => {
                self.timers.stop(Timer::Repeat);
                self.pending.raise(Event::Infeasible);
            }
        }
        self.stats.sweeps = self.align.sweeps();
    }

    /// Handles every timer that has run out by `now`. Each is stopped first and set again only to a later time, so four
    /// rounds at most; the work is bounded by 16 hops of 16 reaches.
    pub(crate) fn handle_timeout(&mut self, now: Instant) {
        while let Some(timer) = self.timers.expired(now) {
            match timer {
                Timer::Work => {
                    let next = self.align.work(&self.mission, self.profile, &self.settings);
                    self.proceed(now, next);
                }
                Timer::Repeat => {
                    if self.align.phase() == Phase::Waiting {
                        bump(&mut self.stats.repeats);
                        self.unheard = self.unheard.saturating_add(1);
                        self.sweep_due = true;
                    }
                }
                Timer::Upstream => self.silence(now, Side::Upstream),
                Timer::Downstream => self.silence(now, Side::Downstream),
            }
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
    pub(crate) fn poll_message(&mut self, now: Instant) -> Option<(Side, Message)> {
        if core::mem::take(&mut self.sweep_due)
            && let Some(sweep) = self.align.sweep(self.digest, self.profile)
        {
            let patience = self.patience();
            self.timers.set(Timer::Repeat, now + patience);
            return Some((Side::Downstream, Message::Sweep(sweep)));
        }
        if core::mem::take(&mut self.verdict_due)
            && let Some(answer) = self.align.answer(self.digest)
        {
            return Some((Side::Upstream, Message::Verdict(answer)));
        }
        if core::mem::take(&mut self.busy_due) {
            return Some((
                Side::Upstream,
                Message::Busy {
                    sweep: self.align.number(),
                },
            ));
        }
        let mission = self.digest;
        for side in [Side::Upstream, Side::Downstream] {
            let Some(link) = self.link(side) else {
                continue;
            };
            let Signs { ask, answer } = core::mem::take(&mut link.signs);
            if ask || answer {
                return Some((
                    side,
                    Message::Heartbeat {
                        mission,
                        answer: ask,
                    },
                ));
            }
        }
        None
    }

    /// How long the verdict on a sweep sent now may take: there and back over every hop that is left, and two to spare.
    ///
    /// The relay next to a lost frame runs out of patience first, so one loss costs one repetition. From then on it is
    /// known that frames get lost here, and the sweep is repeated sooner, first after four hops' time and then after twice
    /// as long each, until a neighbour says that it has arrived. A random eighth keeps relays on a shared channel from
    /// repeating in step.
    fn patience(&mut self) -> Duration {
        let hops = u32::from(self.mission.relays().saturating_sub(self.index));
        let answer = 2 * hops + 2;
        let hops = match self.unheard {
            0 => answer,
            again => answer.min(2 << u32::from(again).min(16)),
        };
        let patience = self.settings.hop_time.times(hops).as_micros();
        Duration::from_micros(patience.saturating_add(u64::from(self.draw()) % (patience / 8 + 1)))
    }

    /// A xorshift generator (Marsaglia 2003, 13-17-5): only timing depends on it, never a placement.
    fn draw(&mut self) -> u32 {
        let mut x = self.random;
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.random = x;
        x
    }

    pub(crate) fn poll_event(&mut self) -> Option<Event> {
        self.pending.take()
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        self.timers.next()
    }

    pub(crate) fn setpoint(&self) -> Option<Placement> {
        self.align.setpoint()
    }

    pub(crate) fn target(&self) -> Option<f32> {
        self.align.target()
    }

    pub(crate) fn phase(&self) -> Phase {
        self.align.phase()
    }

    pub(crate) fn mission(&self) -> &Mission {
        &self.mission
    }

    pub(crate) fn index(&self) -> u16 {
        self.index
    }

    pub(crate) fn profile(&self) -> Profile {
        self.profile
    }
}
