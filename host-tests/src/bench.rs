//! Test bench: relays in virtual time, with ground stations at the ends.
//!
//! A test can see, delay, change and drop every frame.
//!
//! Nodes are numbered as in the protocol: 0 is the transmitter, then come the relays, and the receiver is last. The
//! bench tests the protocol only; drones, radios and recorded timelines are in `uav-relay-sim`.

use std::collections::VecDeque;

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::wire::message::Message;
use uav_relay::{
    Auth, Duration, Event, Ground, Instant, MAX_FRAME, Mission, Phase, Placement, Port, Relay,
    Settings, Side, Wiring,
};

use crate::fixtures::NETWORK;
use crate::make;

/// Maximum number of frames delivered at one instant.
///
/// With more, the relays seem to send without end, and the bench panics.
const MOST_STEPS: u32 = 400_000;

/// Frame in transit between two nodes of the test bench.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Time at which the frame arrives at the receiving node.
    pub at: Instant,
    /// Sending node: 0 is the transmitter, then come the relays, and last the receiver.
    pub from: usize,
    /// Receiving node, numbered like the sender.
    pub to: usize,
    /// Port of the receiving node.
    pub port: Port,
    pub bytes: Vec<u8>,
}

impl Frame {
    /// Returns true if the frame is intact and `wanted` returns true for its message.
    pub fn is(&self, wanted: impl Fn(&Message) -> bool) -> bool {
        let mut deframer = Deframer::new();
        self.bytes.iter().any(|&byte| match deframer.push(byte) {
            Some(Ok(plain)) => wanted(&frame::decode(plain).unwrap().1),
            _ => false,
        })
    }
}

/// Function that chooses the receiving port of a frame; `None` if the frame does not arrive.
///
/// It takes the sender's index, the sender's port, and the receiver's index; indices are from 1.
pub type Route = Box<dyn Fn(usize, Port, usize) -> Option<Port>>;

/// Function that may change an arriving frame. It returns true if the frame is delivered.
pub type Delivery = Box<dyn FnMut(&mut Frame) -> bool>;

/// Test bench in virtual time: relays, ground stations, and the frames between them.
#[expect(
    missing_debug_implementations,
    reason = "the route and the fate are closures"
)]
pub struct Bench {
    pub relays: Vec<Relay>,
    /// Ground stations at the transmitter and at the receiver; `None` where there is none.
    pub grounds: [Option<Box<Ground>>; 2],
    /// Index in the chain of each relay, from 1. A duplicate of a relay has the same index.
    places: Vec<usize>,
    pub now: Instant,
    pub flying: VecDeque<Frame>,
    /// Events of the relays. The number before an event is the relay's position in the field `relays`, from 0.
    pub events: Vec<(usize, Event)>,
    pub latency: Duration,
    pub route: Route,
    pub fate: Delivery,
    steps: u32,
}

impl Bench {
    /// Creates a test bench with `relays`. Frames pass only between neighbours, and without delay.
    pub fn new(relays: Vec<Relay>, now: Instant) -> Self {
        let places = relays.iter().map(|relay| usize::from(relay.index()));
        let mut bench = Self {
            places: places.collect(),
            relays,
            grounds: [None, None],
            now,
            flying: VecDeque::new(),
            events: Vec::new(),
            latency: Duration::from_micros(0),
            route: Box::new(between_neighbours),
            fate: Box::new(|_| true),
            steps: 0,
        };
        bench.drain();
        bench
    }

    /// Creates a test bench with all relays of `mission`. `settings` returns a relay's settings for its index.
    ///
    /// The random seed of a relay is its index.
    ///
    /// # Panics
    /// A relay rejects its settings.
    pub fn of(mission: Mission, settings: impl Fn(u16) -> Settings) -> Self {
        let relay = |index| {
            let identity = make::identity(index);
            let seed = u32::from(index);
            Relay::new(mission, identity, settings(index), seed, Instant::ZERO).unwrap()
        };
        Self::new((1..=mission.relays()).map(relay).collect(), Instant::ZERO)
    }

    /// Adds a relay that starts now, for example a copy with the index of another relay.
    pub fn switch_on(&mut self, relay: Relay) {
        self.places.push(usize::from(relay.index()));
        self.relays.push(relay);
        self.drain();
    }

    /// Returns the ground station at `end`; the first call creates it.
    ///
    /// `base` is the mission that the station has before flight; `auth` authenticates the station's frames.
    pub fn ground(&mut self, base: &Mission, end: Side, auth: Auth) -> &mut Ground {
        let ground = || Box::new(Ground::new(base, end, NETWORK, Wiring::Pair, auth));
        self.grounds[end as usize].get_or_insert_with(ground)
    }

    /// Delivers an arrived frame, or advances the time to the next event. Then all nodes handle timers and send.
    ///
    /// Returns false if nothing is left to do up to `until`.
    pub fn step(&mut self, until: Instant) -> bool {
        let arrived = self
            .flying
            .front()
            .is_some_and(|frame| frame.at <= self.now);
        if let Some(mut frame) = arrived.then(|| self.flying.pop_front()).flatten() {
            self.steps += 1;
            assert!(self.steps < MOST_STEPS, "it never ends: {:?}", self.now);
            if (self.fate)(&mut frame) {
                self.deliver(&frame);
            }
        } else {
            let timers = self.relays.iter().filter_map(Relay::poll_timeout);
            let grounds = self
                .grounds
                .iter()
                .flatten()
                .filter_map(|ground| ground.poll_timeout());
            let arrival = self.flying.front().map(|frame| frame.at);
            let next = timers.chain(grounds).chain(arrival).min();
            let Some(next) = next.filter(|next| *next <= until) else {
                self.now = self.now.max(until);
                self.drain();
                return self
                    .flying
                    .front()
                    .is_some_and(|frame| frame.at <= self.now);
            };
            self.now = self.now.max(next);
            self.steps = 0;
        }
        self.drain();
        true
    }

    pub fn run(&mut self, until: Instant) {
        while self.step(until) {}
    }

    pub fn run_for(&mut self, span: Duration) {
        self.run(self.now + span);
    }

    /// Runs the bench until `done` returns true. Returns the virtual time taken; `None` after `limit`.
    pub fn run_until(&mut self, limit: Duration, done: impl Fn(&Self) -> bool) -> Option<Duration> {
        let begun = self.now;
        while !done(self) {
            if !self.step(begun + limit) {
                return None;
            }
        }
        Some(self.now.since(begun))
    }

    fn deliver(&mut self, frame: &Frame) {
        let last = self.relays.len() + 1;
        match frame.to {
            to if to == 0 || to == last => {
                if let Some(ground) = &mut self.grounds[usize::from(to == last)] {
                    ground.handle_bytes(&frame.bytes);
                }
            }
            to => self.relays[to - 1].handle_bytes(self.now, frame.port, &frame.bytes),
        }
    }

    /// Lets all nodes handle their timers, and puts their frames in transit.
    fn drain(&mut self) {
        let (now, last) = (self.now, self.relays.len() + 1);
        for at in 0..self.relays.len() {
            let relay = &mut self.relays[at];
            relay.handle_timeout(now);
            let sent = sent(relay, now);
            self.events.extend(events(relay).map(|event| (at, event)));
            let due = relay.poll_timeout();
            let spins = due.is_some_and(|due| due <= now) && now.as_micros() != u64::MAX;
            assert!(!spins, "relay {} spins: {due:?} at {now:?}", at + 1);
            for (port, bytes) in sent {
                let end = usize::from(port == Port::Downstream);
                let ground = self.grounds[end].as_ref().map(|_| [0, last][end]);
                for to in (1..last).filter(|to| *to != at + 1).chain(ground) {
                    let place = self.places.get(to.wrapping_sub(1)).copied().unwrap_or(to);
                    if let Some(port) = (self.route)(self.places[at], port, place) {
                        self.put(at + 1, to, port, bytes.clone());
                    }
                }
            }
        }
        for (from, to, port) in [(0, 1, Port::Upstream), (last, last - 1, Port::Downstream)] {
            let mut frame = [0; MAX_FRAME];
            while let Some(ground) = &mut self.grounds[usize::from(from == last)] {
                ground.handle_timeout(now);
                let Some(len) = ground.poll_transmit(&mut frame) else {
                    break;
                };
                self.put(from, to, port, frame[..len].to_vec());
            }
        }
    }

    fn put(&mut self, from: usize, to: usize, port: Port, bytes: Vec<u8>) {
        self.flying.push_back(Frame {
            at: self.now + self.latency,
            from,
            to,
            port,
            bytes,
        });
    }

    /// Returns true if all relays have agreed positions and the same view (membership of the chain).
    pub fn holds(&self) -> bool {
        let view = self.relays[0].view();
        let holds = |relay: &Relay| relay.phase() == Phase::Holding && relay.view() == view;
        self.relays.iter().all(holds)
    }

    pub fn setpoints(&self) -> Vec<Option<Placement>> {
        self.relays.iter().map(Relay::setpoint).collect()
    }

    /// Returns true if the relay at `at` in `relays`, from 0, has raised `event`.
    pub fn has_raised(&self, at: usize, event: Event) -> bool {
        self.events.contains(&(at, event))
    }
}

/// Routes frames to neighbours only: by wires, or by a radio channel that reaches only neighbours.
///
/// Returns the receiver's port; `None` if `to` is not the neighbour that `from` reaches through `port`.
pub fn between_neighbours(from: usize, port: Port, to: usize) -> Option<Port> {
    match port {
        Port::Shared => (from.abs_diff(to) == 1).then_some(port),
        Port::Upstream => (to + 1 == from).then_some(Port::Downstream),
        Port::Downstream => (to == from + 1).then_some(Port::Upstream),
    }
}

/// Returns the port and the bytes of each frame that `relay` has to send at `now`.
pub fn sent(relay: &mut Relay, now: Instant) -> Vec<(Port, Vec<u8>)> {
    let mut frame = [0; MAX_FRAME];
    let mut sent = Vec::new();
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
        sent.push((transmit.port, frame[..transmit.len].to_vec()));
    }
    sent
}

pub fn events(relay: &mut Relay) -> impl Iterator<Item = Event> {
    std::iter::from_fn(|| relay.poll_event())
}

/// Returns the positions that the relays of `mission` agree on over faultless links.
///
/// # Panics
/// They do not agree within five seconds of virtual time.
pub fn agreed(mission: Mission) -> Vec<Option<Placement>> {
    let mut bench = Bench::of(mission, |_| Settings::default());
    let all = |bench: &Bench| bench.setpoints().iter().all(Option::is_some);
    bench.run_until(Duration::from_millis(5_000), all).unwrap();
    bench.setpoints()
}
