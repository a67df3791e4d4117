//! Event loop of a run: connects the relays and processes events until the run ends.

mod air;
mod attacker;
mod begin;
mod channel;
mod ending;
mod filmed;
mod fleet;
mod flight;
mod ground;
mod hearing;
mod judge;
mod limits;
mod listening;
mod receiver;
mod recorded;
mod start;
mod state;
mod station;
mod timeline;

pub use state::Chain;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use uav_relay::MAX_FRAME;
use uav_relay::SetupError;
use uav_relay::{Instant, Placement, Sample};

use judge::Touched;
use start::{Start, switched_on};

use super::fleet::Vehicle;
use super::flying::Seen;
use super::medium::AirCounts;
use super::outcome::{Outcome, RelayEnd, TimelineEvent};
use super::queue::QueuedEvent;
use super::setup::Setup;

/// Limit on the events of a run: some minutes of computing.
const MOST_HAPPENINGS: u64 = 400_000_000;

impl Chain {
    /// Switches every relay on at time 0.
    ///
    /// # Errors
    /// [`SetupError`] if a relay rejects its profile or settings.
    pub fn new(setup: Setup) -> Result<Self, SetupError> {
        Self::begin(setup, |other| run(other).ok())
    }

    /// Returns the number of sweeps begun and the virtual time.
    pub fn progress(&self) -> (u32, Instant) {
        (self.sweeps(), self.now)
    }

    /// Processes up to `happenings` events. Returns true if the run has ended.
    pub fn step(&mut self, happenings: u64) -> bool {
        for _ in 0..happenings {
            if let Some(ending) = self.ending() {
                self.outcome.ending = ending;
                return true;
            }
            let Some((at, relay, happening)) = self.queue.take() else {
                return true;
            };
            if at > self.setup.deadline || self.happenings >= MOST_HAPPENINGS {
                self.end_soak(at);
                return true;
            }
            self.happenings += 1;
            self.now = at;
            let touched = Touched::by(&happening, relay);
            self.happen(relay, happening);
            self.look(touched);
        }
        false
    }

    /// Feeds `samples` interference samples to every living relay that has a setpoint. `draw` returns one, W, for a position.
    pub fn measure(
        &mut self,
        samples: u32,
        mut draw: impl FnMut(Placement, &mut ChaCha8Rng) -> f32,
    ) {
        for index in 0..self.members.len() {
            let Some(member) = self.members.get_mut(index) else {
                continue;
            };
            if let Some(place) = member.relay.setpoint()
                && member.killed.is_none()
            {
                for _ in 0..samples {
                    let power_w = draw(place, &mut self.rng);
                    let sample = Sample::Interference { power_w };
                    member.relay.handle_sample(self.now, sample);
                }
            }
            self.drain(index);
        }
    }

    /// Returns the setpoints of all relays; `None` unless every relay has one.
    pub fn setpoints(&self) -> Option<Vec<Placement>> {
        self.members
            .iter()
            .map(|member| member.relay.setpoint())
            .collect()
    }

    /// Restarts planning at the leader.
    pub fn restart(&mut self) {
        let now = self.now;
        self.holding = 0;
        let index = usize::from(self.setup.mission.leader()).saturating_sub(1);
        if let Some(leader) = self.members.get_mut(index) {
            leader.relay.restart(now);
        }
        self.drain(index);
    }

    /// Runs to the end.
    pub fn run(mut self) -> Outcome {
        while !self.step(u64::MAX) {}
        self.finish()
    }

    /// Returns the outcome of the run so far.
    pub fn finish(mut self) -> Outcome {
        self.outcome.ended = self.now;
        self.outcome.sweeps = self.progress().0;
        self.outcome.air = self
            .medium
            .map_or_else(AirCounts::default, |it| it.counts());
        if let Some(watch) = self.watch {
            let flown_m = self.outcome.nearest.map(|it| it.apart_m);
            let is_judged = self.setup.soak.is_some();
            let watched = watch.end(self.now, is_judged, flown_m);
            self.outcome.watched = Some(watched);
        }
        let lent = self.members.iter().map(|member| member.lent);
        let places = self.fleet.iter().map(Vehicle::along);
        self.outcome.fleet = places.zip(lent).collect();
        self.outcome.relays = self
            .members
            .into_iter()
            .map(|member| RelayEnd {
                setpoint: member.relay.setpoint(),
                target: member.relay.target(),
                bound: member.relay.bound(),
                profile: member.relay.profile(),
                stats: *member.relay.stats(),
                killed: member.killed,
                index: member.relay.index(),
                relays: member.relay.mission().relays(),
                view: member.relay.view().number(),
                version: member.relay.version(),
                believed: member.relay.belief(),
                sites: member.relay.sites(),
                seen: Seen::of(&member.relay, member.killed.is_none()),
            })
            .collect();
        self.outcome
    }

    fn happen(&mut self, index: usize, happening: QueuedEvent) {
        if matches!(
            happening,
            QueuedEvent::Kill
                | QueuedEvent::Boot
                | QueuedEvent::Part
                | QueuedEvent::Upload
                | QueuedEvent::AttackKind(_)
        ) {
            self.ahead -= 1;
        }
        match happening {
            QueuedEvent::Fly if self.fleet.is_empty() => self.fly(),
            QueuedEvent::Fly => self.fly_fleet(),
            QueuedEvent::Restart => self.restart_autopilot(index),
            QueuedEvent::Part => self.tell_of_partitions(),
            QueuedEvent::Air(event) => self.on_air(event),
            QueuedEvent::Listen => self.measure_all(),
            QueuedEvent::AttackKind(kind) => self.strike(kind),
            QueuedEvent::Upload => self.begin_upload(index),
            QueuedEvent::Heard { bytes } => self.hear(index, &bytes),
            QueuedEvent::Ask => self.ask(index),
            of_relay => self.happen_to(index, of_relay),
        }
    }

    /// Handles an event of relay `index` (from 0).
    fn happen_to(&mut self, index: usize, happening: QueuedEvent) {
        let now = self.now;
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        match happening {
            QueuedEvent::Boot => {
                let start = Start {
                    index: member.node,
                    number: member.starts + 1,
                    seed: self.rng.random(),
                    now,
                };
                let (stored, record) = (member.stored.as_ref(), member.record.as_ref());
                let Ok(relay) = switched_on(&self.setup, start, stored, record) else {
                    return;
                };
                member.swept += member.relay.stats().passes_begun;
                member.starts = start.number;
                member.relay = relay;
                member.killed = None;
                member.wake = None;
                if let Some(vehicle) = self.fleet.get_mut(index) {
                    vehicle.boot(now);
                }
                self.tell(index, TimelineEvent::Booted, None);
            }
            _ if member.killed.is_some() => return,
            QueuedEvent::Kill => {
                member.killed = Some(now);
                if let Some(medium) = &mut self.medium {
                    medium.switch_off(index);
                }
                self.tell(index, TimelineEvent::Silent, None);
                self.film(index);
                return;
            }
            QueuedEvent::Bytes { port, bytes } => {
                // The relay must accept any fragmentation of the byte stream: split at a random offset.
                let cut = self.rng.random_range(0..=bytes.len());
                let (first, second) = bytes.split_at_checked(cut).unwrap_or((&bytes, &[]));
                member.relay.handle_bytes(now, port, first);
                member.relay.handle_bytes(now, port, second);
            }
            QueuedEvent::Wake => {
                // Ignore a wake-up that was replaced by an earlier one; otherwise wake-ups would multiply.
                if member.wake != Some(now) {
                    return;
                }
                member.wake = None;
                member.relay.handle_timeout(now);
            }
            _ => return,
        }
        self.drain(index);
    }

    /// Sends the relay's pending frames, handles its events, and schedules its next wake-up.
    fn drain(&mut self, index: usize) {
        let now = self.now;
        let mut frame = [0; MAX_FRAME];
        if let Some(member) = self.members.get_mut(index) {
            let stored = &mut member.record;
            member.relay.persist(|record| {
                *stored = Some(*record);
                true
            });
        }
        while let Some(member) = self.members.get_mut(index)
            && let Some(transmit) = member.relay.poll_transmit(now, &mut frame)
        {
            let bytes = frame.get(..transmit.len).unwrap_or_default();
            self.film_frame(index, transmit.port);
            self.transmit(index, transmit.port, bytes);
        }
        self.listen(index);
        self.check(index);
        self.film(index);
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        if let Some(at) = member.relay.poll_timeout()
            && member.wake.is_none_or(|wake| at < wake)
        {
            // A drained relay must not request an immediate call.
            assert!(at > now, "relay {} would spin", index + 1);
            member.wake = Some(at);
            self.queue.put(at, index, QueuedEvent::Wake);
        }
    }
}

/// Runs `setup` to the end.
///
/// # Errors
/// [`SetupError`] if a relay rejects its profile or settings.
pub fn run(setup: Setup) -> Result<Outcome, SetupError> {
    Chain::new(setup).map(Chain::run)
}
