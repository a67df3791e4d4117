//! The relays, connected, run until they hold their places.

mod air;
mod channel;
mod ending;
mod flight;
mod ground;
mod hearing;
mod judge;
mod start;
mod state;
mod station;
mod story;
mod strike;

pub use state::Chain;

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::SetupError;
use uav_relay::wire::frame::MAX_FRAME;
use uav_relay::{Instant, Method, Placement, Sample, Wiring};

use judge::Touched;
use start::{Start, switched_on};
use state::Member;
use station::stations;

use super::attack::Struck;
use super::bursts::Bursts;
use super::faults::Injected;
use super::flying::Seen;
use super::link::Line;
use super::medium::{Access, AirCounts, Medium};
use super::outcome::{Ending, Outcome, RelayEnd, Turning};
use super::queue::{Happening, Queue};
use super::setup::Setup;
use super::watch::Watch;

/// After this many happenings the run is given up: some minutes of computing.
const MOST_HAPPENINGS: u64 = 400_000_000;

impl Chain {
    /// Switches every relay on at time 0.
    ///
    /// # Errors
    /// [`SetupError`] where a profile or setting is refused by the relay.
    pub fn new(setup: Setup) -> Result<Self, SetupError> {
        let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
        let mut members = Vec::new();
        for index in 1..=setup.mission.relays() {
            let start = Start {
                index,
                number: 1,
                seed: rng.random(),
                now: Instant::ZERO,
            };
            let relay = switched_on(&setup, start, None, None)?;
            members.push(Member {
                node: index,
                lines: [Line::default(); 2],
                killed: None,
                starts: 1,
                swept: 0,
                stored: None,
                safe: None,
                relay,
                wake: None,
            });
        }
        let mut queue = Queue::default();
        let stations = stations(&setup);
        let bursts = (setup.burst > 1.0).then(|| Bursts::new(setup.faults.loss, setup.burst));
        let shared = setup.settings.wiring == Wiring::Shared;
        let medium = (shared && setup.access != Access::Ideal).then(|| {
            let nodes = members.len() + stations.len();
            Medium::new(setup.access, setup.link, nodes, setup.seed)
        });
        for &(index, at) in &setup.kills {
            queue.put(at, usize::from(index.saturating_sub(1)), Happening::Kill);
        }
        for &(index, at) in &setup.boots {
            queue.put(at, usize::from(index.saturating_sub(1)), Happening::Boot);
        }
        for (which, spec) in setup.uploads.iter().enumerate() {
            queue.put(spec.at, which, Happening::Upload);
        }
        let mut ahead = setup.kills.len() + setup.boots.len() + setup.uploads.len();
        let parts = setup.partitions.iter().map(|part| (part.from, part.until));
        let deaf = setup.deaf.iter().map(|deaf| (deaf.from, deaf.until));
        for (from, until) in parts.chain(deaf) {
            for at in [Some(from), until].into_iter().flatten() {
                queue.put(at, 0, Happening::Part);
                ahead += 1;
            }
        }
        let mut chain = Self {
            stations,
            setup,
            members,
            queue,
            rng,
            outcome: Outcome {
                ending: Ending::OutOfTime,
                relays: Vec::new(),
                rounds: Vec::new(),
                sweeps: 0,
                messages: 0,
                bytes: 0,
                ended: Instant::ZERO,
                injected: Injected::default(),
                noticed: BTreeMap::new(),
                struck: Struck::default(),
                moments: Vec::new(),
                nearest: None,
                unsafe_setpoints: 0,
                air: AirCounts::default(),
                watched: None,
            },
            now: Instant::ZERO,
            happenings: 0,
            holding: 0,
            ahead,
            attacker: None,
            flight: None,
            medium,
            bursts,
            watch: Watch::default(),
        };
        if shared || chain.setup.soak.is_some() {
            chain.begin_watch();
        }
        chain.expect_an_attack();
        chain.take_off();
        for index in 0..chain.members.len() {
            chain.drain(index);
        }
        chain.look(Touched::All);
        Ok(chain)
    }

    /// Sweeps that have begun and virtual time so far.
    pub fn progress(&self) -> (u32, Instant) {
        (self.sweeps(), self.now)
    }

    /// Runs up to `happenings` happenings; whether the run has ended.
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

    /// Has every living relay that holds a place measure there: `samples` times what `draw` gives for a place, W.
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
                    member.relay.handle_sample(Sample::Interference { power_w });
                }
            }
            self.drain(index);
        }
    }

    /// Where the relays were told to fly, if all of them were.
    pub fn setpoints(&self) -> Option<Vec<Placement>> {
        self.members
            .iter()
            .map(|member| member.relay.setpoint())
            .collect()
    }

    /// Has the chain agree again.
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

    /// What came of the run so far.
    pub fn finish(mut self) -> Outcome {
        self.outcome.ended = self.now;
        self.outcome.sweeps = self.progress().0;
        self.outcome.air = self
            .medium
            .map_or_else(AirCounts::default, |it| it.counts());
        if self.watch.is_on {
            let flown_m = self.flight.and(self.outcome.nearest).map(|it| it.apart_m);
            let is_judged = self.setup.soak.is_some();
            let watched = self.watch.end(self.now, is_judged, flown_m);
            self.outcome.watched = Some(watched);
        }
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
                seen: Seen::of(&member.relay, member.killed.is_none()),
            })
            .collect();
        self.outcome
    }

    fn happen(&mut self, index: usize, happening: Happening) {
        if matches!(
            happening,
            Happening::Kill
                | Happening::Boot
                | Happening::Part
                | Happening::Upload
                | Happening::Strike(_)
        ) {
            self.ahead -= 1;
        }
        match happening {
            Happening::Fly => self.fly(),
            Happening::Part => self.tell_of_partitions(),
            Happening::Air(event) => self.on_air(event),
            Happening::Strike(kind) => self.strike(kind),
            Happening::Upload => self.begin_upload(index),
            Happening::Heard { bytes } => self.hear(index, &bytes),
            Happening::Ask => self.ask(index),
            of_relay => self.happen_to(index, of_relay),
        }
    }

    /// Something happens to relay `index` (from 0).
    fn happen_to(&mut self, index: usize, happening: Happening) {
        let now = self.now;
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        match happening {
            Happening::Boot => {
                let start = Start {
                    index: member.node,
                    number: member.starts + 1,
                    seed: self.rng.random(),
                    now,
                };
                // As a firmware has it in its flash before anything is sent.
                let record = member.relay.view_record();
                let stored = member.stored.as_ref();
                let Ok(relay) = switched_on(&self.setup, start, stored, Some(&record)) else {
                    return;
                };
                member.swept += member.relay.stats().sweeps;
                member.starts = start.number;
                member.relay = relay;
                member.killed = None;
                member.wake = None;
                self.tell(index, Turning::Booted, None);
            }
            _ if member.killed.is_some() => return,
            Happening::Kill => {
                member.killed = Some(now);
                if let Some(medium) = &mut self.medium {
                    medium.switch_off(index);
                }
                self.tell(index, Turning::Silent, None);
                return;
            }
            Happening::Bytes { port, bytes } => {
                // However a driver cuts the stream, the relay must not care: cut it at random.
                let cut = self.rng.random_range(0..=bytes.len());
                let (first, second) = bytes.split_at_checked(cut).unwrap_or((&bytes, &[]));
                member.relay.handle_bytes(now, port, first);
                member.relay.handle_bytes(now, port, second);
            }
            Happening::Wake => {
                // An earlier wake-up has taken the place of this one: what is left of it must not multiply.
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

    /// Takes out what the relay has to say, and when it wants to be called again.
    fn drain(&mut self, index: usize) {
        let now = self.now;
        let mut frame = [0; MAX_FRAME];
        while let Some(member) = self.members.get_mut(index)
            && let Some(transmit) = member.relay.poll_transmit(now, &mut frame)
        {
            let bytes = frame.get(..transmit.len).unwrap_or_default();
            self.transmit(index, transmit.port, bytes);
        }
        self.listen(index);
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let by = member.node;
        if let Some(place) = member.relay.setpoint()
            && member.safe != Some(place)
        {
            let config = member.relay.mission().config();
            let end = config.distance_m;
            // What it was given, or one of the band.
            let given = self.setup.profiles.iter().find(|(of, _)| *of == by);
            let altitude = given.map_or(config.common, |(_, own)| *own).altitude_m;
            let chosen = self.setup.settings.method != Method::Align
                && !self.setup.held.contains(&by)
                && (config.band.least_m..=config.band.most_m).contains(&place.altitude_m);
            let beside = config.lateral.least_m..=config.lateral.most_m;
            let aside = if self.setup.settings.method == Method::Joint {
                beside.contains(&place.y_m)
            } else {
                place.y_m.to_bits() == 0
            };
            let chosen = (0.0..=end).contains(&place.x_m)
                && aside
                && (chosen || place.altitude_m.to_bits() == altitude.to_bits());
            // With a guard it may be on its way from anywhere in the box.
            let guard = self.setup.settings.guard;
            let inside = guard.map_or(chosen, |guard| guard.fence.contains(place));
            self.outcome.unsafe_setpoints += u64::from(!inside);
            // With a new mission it stays where it is until the next agreement.
            member.safe = inside.then_some(place);
        }
        if let Some((done, sir)) = member.relay.rounds()
            && sir > 0.0
            && self.outcome.rounds.len() <= usize::from(done)
        {
            // Algorithm 2 moves only what makes the worse of two hops better.
            debug_assert!(
                self.attacker.is_some()
                    || self.outcome.rounds.last().is_none_or(|last| sir >= *last),
                "round {done} has made the chain worse"
            );
            self.outcome.rounds.push(sir);
        }
        if let Some(at) = member.relay.poll_timeout()
            && member.wake.is_none_or(|wake| at < wake)
        {
            // The contract of a relay: drained, it never wants to be called at once.
            assert!(at > now, "relay {} would spin", index + 1);
            member.wake = Some(at);
            self.queue.put(at, index, Happening::Wake);
        }
    }
}

/// Runs `setup` to the end.
///
/// # Errors
/// [`SetupError`] where a profile or setting is refused by the relay.
pub fn run(setup: Setup) -> Result<Outcome, SetupError> {
    Chain::new(setup).map(Chain::run)
}
