//! The relays, connected, run until they hold their places.

mod ending;

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::node::settings::SetupError;
use uav_relay::wire::frame::MAX_FRAME;
use uav_relay::{Event, Identity, Instant, Method, Placement, Port, Relay, Sample, Settings};

use super::faults::Injected;
use super::link::Line;
use super::outcome::{Ending, Outcome, RelayEnd};
use super::queue::{Happening, Queue};
use super::setup::Setup;

/// After this many happenings the run is given up: some minutes of computing.
const MOST_HAPPENINGS: u64 = 400_000_000;

/// One relay in the run.
#[derive(Debug)]
struct Member {
    relay: Relay,
    /// Its lines: toward Tx (or to all), toward Rx.
    lines: [Line; 2],
    killed: Option<Instant>,
    /// The wake-up in the queue that counts: the earliest one. Any other is void.
    wake: Option<Instant>,
}

/// A chain under way.
#[derive(Debug)]
pub struct Chain {
    setup: Setup,
    members: Vec<Member>,
    queue: Queue,
    rng: ChaCha8Rng,
    outcome: Outcome,
    now: Instant,
    happenings: u64,
    /// How often a relay has taken a place.
    holding: usize,
    /// Kills that are still to come.
    kills_ahead: usize,
}

impl Chain {
    /// Switches every relay on at time 0.
    ///
    /// # Errors
    /// [`SetupError`] where a profile or setting is refused by the relay.
    pub fn new(setup: Setup) -> Result<Self, SetupError> {
        let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
        let mut members = Vec::new();
        for index in 1..=setup.mission.relays() {
            let own = setup.profiles.iter().find(|(of, _)| *of == index);
            let settings = Settings {
                profile: own.map(|(_, profile)| *profile),
                hold_altitude: setup.held.contains(&index),
                hop_time: setup.link.hop_time(),
                ..setup.settings
            };
            let identity = Identity { network: 1, index };
            let relay = Relay::new(
                setup.mission,
                identity,
                settings,
                rng.random(),
                Instant::ZERO,
            )?;
            members.push(Member {
                relay,
                lines: [Line::default(); 2],
                killed: None,
                wake: None,
            });
        }
        let mut queue = Queue::default();
        for &(index, at) in &setup.kills {
            queue.put(at, usize::from(index.saturating_sub(1)), Happening::Kill);
        }
        let kills_ahead = setup.kills.len();
        let mut chain = Self {
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
                unsafe_setpoints: 0,
            },
            now: Instant::ZERO,
            happenings: 0,
            holding: 0,
            kills_ahead,
        };
        for index in 0..chain.members.len() {
            chain.drain(index);
        }
        Ok(chain)
    }

    /// Sweeps the head has begun and virtual time so far.
    pub fn progress(&self) -> (u32, Instant) {
        let sweeps = self
            .leader()
            .map_or(0, |leader| leader.relay.stats().sweeps);
        (sweeps, self.now)
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
                return true;
            }
            self.happenings += 1;
            self.now = at;
            self.happen(relay, happening);
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
        self.outcome.relays = self
            .members
            .into_iter()
            .map(|member| RelayEnd {
                setpoint: member.relay.setpoint(),
                target: member.relay.target(),
                profile: member.relay.profile(),
                stats: *member.relay.stats(),
                killed: member.killed,
            })
            .collect();
        self.outcome
    }

    /// The relay that begins the passes.
    fn leader(&self) -> Option<&Member> {
        let index = usize::from(self.setup.mission.leader());
        self.members.get(index.checked_sub(1)?)
    }

    fn happen(&mut self, index: usize, happening: Happening) {
        let now = self.now;
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        if member.killed.is_some() {
            return;
        }
        match happening {
            Happening::Kill => {
                member.killed = Some(now);
                self.kills_ahead -= 1;
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
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let by = u16::try_from(index + 1).unwrap_or(u16::MAX);
        while let Some(event) = member.relay.poll_event() {
            match event {
                Event::NeighbourLost(side) => {
                    self.outcome.noticed.insert((by, side), now);
                }
                Event::NeighbourBack(side) => {
                    self.outcome.noticed.remove(&(by, side));
                }
                Event::Converged => self.holding += 1,
                _ => {}
            }
        }
        if let Some(place) = member.relay.setpoint() {
            let config = self.setup.mission.config();
            let end = config.distance_m;
            // What it was given, or one of the band.
            let given = self.setup.profiles.iter().find(|(of, _)| *of == by);
            let altitude = given.map_or(config.common, |(_, own)| *own).altitude_m;
            let chosen = self.setup.settings.method != Method::Align
                && !self.setup.held.contains(&by)
                && (config.band.least_m..=config.band.most_m).contains(&place.altitude_m);
            let inside = (0.0..=end).contains(&place.x_m)
                && (chosen || place.altitude_m.to_bits() == altitude.to_bits());
            self.outcome.unsafe_setpoints += u64::from(!inside);
        }
        if let Some((done, sir)) = member.relay.rounds()
            && sir > 0.0
            && self.outcome.rounds.len() <= usize::from(done)
        {
            // Algorithm 2 moves only what makes the worse of two hops better.
            debug_assert!(
                self.outcome.rounds.last().is_none_or(|last| sir >= *last),
                "round {done} has made the chain worse"
            );
            self.outcome.rounds.push(sir);
        }
        if let Some(at) = member.relay.poll_timeout()
            && member.wake.is_none_or(|wake| at < wake)
        {
            // The contract of a relay: drained, it never wants to be called at once.
            debug_assert!(at > now, "relay {} would spin", index + 1);
            member.wake = Some(at);
            self.queue.put(at, index, Happening::Wake);
        }
    }

    /// Puts a frame on a link.
    fn transmit(&mut self, index: usize, port: Port, frame: &[u8]) {
        self.outcome.messages += 1;
        self.outcome.bytes += frame.len() as u64;
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let line = if port == Port::Downstream {
            &mut member.lines[1]
        } else {
            &mut member.lines[0]
        };
        let arrives = line.send(self.now, frame.len(), &self.setup.link);
        let before = index.checked_sub(1);
        let (receivers, into) = match port {
            Port::Upstream => ([before, None, None, None], Port::Downstream),
            Port::Downstream => ([Some(index + 1), None, None, None], Port::Upstream),
            // A radio is heard two relays away.
            Port::Shared => (
                [
                    before,
                    index.checked_sub(2),
                    Some(index + 1),
                    Some(index + 2),
                ],
                Port::Shared,
            ),
        };
        let late_by = self.setup.link.hop_time();
        for receiver in receivers
            .into_iter()
            .flatten()
            .filter(|&receiver| receiver < self.members.len())
        {
            let arrivals =
                self.setup
                    .faults
                    .inject(frame, &mut self.rng, &mut self.outcome.injected);
            for arrival in arrivals {
                let late = late_by.times(u32::try_from(arrival.late).unwrap_or(u32::MAX));
                let happening = Happening::Bytes {
                    port: into,
                    bytes: arrival.bytes,
                };
                self.queue.put(arrives + late, receiver, happening);
            }
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
