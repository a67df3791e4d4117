//! Event loop of a run: connects the relays and processes events until the run ends.

mod air;
mod fleet;
mod ground;
mod judge;
pub mod live;
mod rotation;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::ground::{Ground, Progress};
use uav_relay::{
    Duration, Identity, Instant, MAX_FRAME, Placement, Port, Relay, Report, Sample, Settings,
    SetupError, Side, Upload, ViewRecord, Wiring,
};

use super::attack::{AttackKind, Attacker, NETWORK};
use super::drones::{Flight, Point};
use super::faults::{Bursts, Line};
use super::fleet::Vehicle;
use super::medium::{Access, AirCounts, AirEvent, Medium};
use super::outcome::{Film, Outcome, Record, RelayEnd, TimelineEvent};
use super::rotation::Rotation;
use super::route::Track;
use super::setup::Setup;
use super::watch::{ObservedState, Places, Run, Watch, places_of, without_other_relays};

/// Largest number of events in a run. This limit ends runs in which the relays never agree on positions, after some
/// minutes of computing.
const MAX_EVENTS: u64 = 400_000_000;

impl Chain {
    /// Creates a simulated chain of the setup's relays and switches all of them on at time 0.
    ///
    /// # Errors
    /// [`SetupError`] if a relay rejects its profile or settings.
    pub fn new(setup: Setup) -> Result<Self, SetupError> {
        Self::begin(setup, |other| run(other).ok())
    }

    /// Returns the number of passes and view proposals that relays began, and the virtual time.
    ///
    /// A pass is a message that relays forward along the whole chain.
    pub fn progress(&self) -> (u32, Instant) {
        (self.sweeps(), self.now)
    }

    /// Processes at most `max_events` events. Returns true if the run has ended.
    pub fn step(&mut self, max_events: u64) -> bool {
        for _ in 0..max_events {
            if let Some(ending) = self.ending() {
                self.outcome.ending = ending;
                return true;
            }
            let Some((at, relay, event)) = self.queue.take() else {
                return true;
            };
            if at > self.setup.deadline || self.events >= MAX_EVENTS {
                self.end_soak(at);
                return true;
            }
            self.process(at, relay, event);
        }
        false
    }

    fn process(&mut self, at: Instant, relay: usize, event: QueuedEvent) {
        self.events += 1;
        self.now = at;
        let changed = ChangedRelays::of(&event, relay);
        self.process_event(relay, event);
        self.update_statistics(changed);
    }

    /// Gives `samples` interference samples to every relay that is switched on and has a setpoint.
    ///
    /// `draw` returns a random sample, W, at a position.
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

    /// Returns the setpoints of all relays, relay 1 first; `None` if any relay has no setpoint.
    pub fn setpoints(&self) -> Option<Vec<Placement>> {
        self.members
            .iter()
            .map(|member| member.relay.setpoint())
            .collect()
    }

    /// Makes the leader plan the relays' positions again, with all measurements made so far.
    pub fn restart(&mut self) {
        let now = self.now;
        self.accepted_positions = 0;
        let index = usize::from(self.setup.mission.leader()).saturating_sub(1);
        if let Some(leader) = self.members.get_mut(index) {
            leader.relay.restart(now);
        }
        self.drain(index);
    }

    /// Processes all events to the end of the run and returns its outcome.
    pub fn run(mut self) -> Outcome {
        while !self.step(u64::MAX) {}
        self.finish()
    }

    /// Ends the run now and returns its outcome.
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
        self.outcome.rotated = self.rotation.map(|rotation| rotation.record);
        let controlled = self.members.iter().map(|member| member.under_relay_control);
        let places = self.fleet.iter().map(Vehicle::along);
        self.outcome.fleet = places.zip(controlled).collect();
        self.outcome.relays = self
            .members
            .into_iter()
            .map(|member| RelayEnd {
                setpoint: member.relay.setpoint(),
                target: member.relay.target(),
                bound: member.relay.bound(),
                slot_shares: member.relay.slot_shares(),
                profile: member.relay.profile(),
                stats: *member.relay.stats(),
                killed: member.killed,
                index: member.relay.index(),
                relays: member.relay.mission().relays(),
                view: member.relay.view().number(),
                version: member.relay.version(),
                believed: member.relay.interference_estimate(),
                sites: member.relay.sites(),
                observed: ObservedState::of(&member.relay, member.killed.is_none()),
            })
            .collect();
        self.outcome
    }

    fn process_event(&mut self, index: usize, event: QueuedEvent) {
        if matches!(
            event,
            QueuedEvent::Kill
                | QueuedEvent::Boot
                | QueuedEvent::Leave(_)
                | QueuedEvent::Endurance(_)
                | QueuedEvent::Stay
                | QueuedEvent::Partition
                | QueuedEvent::Upload
                | QueuedEvent::Attack(_)
        ) {
            self.pending_planned -= 1;
        }
        match event {
            QueuedEvent::Fly if self.rotation.is_some() => self.rotate(),
            QueuedEvent::Fly if self.fleet.is_empty() => self.fly(),
            QueuedEvent::Fly => self.fly_fleet(),
            QueuedEvent::Restart => self.restart_autopilot(index),
            QueuedEvent::Partition => self.log_partitions(),
            QueuedEvent::Air(event) => self.on_air(event),
            QueuedEvent::Measure => self.measure_all(),
            QueuedEvent::Attack(kind) => self.send_attack(kind),
            QueuedEvent::Upload => self.begin_upload(index),
            QueuedEvent::Watch => self.begin_watching(index),
            QueuedEvent::StationBytes { bytes } => self.station_receive(index, &bytes),
            QueuedEvent::StationTimeout => self.station_timeout(index),
            of_relay => self.process_relay_event(index, of_relay),
        }
    }

    /// Switches relay `index` (from 0) on, with the mission and the votes that it has stored.
    fn boot(&mut self, index: usize) {
        let now = self.now;
        let seed = self.rng.random();
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        let start = Start {
            index: member.node,
            number: member.starts + 1,
            seed,
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
        self.log(index, TimelineEvent::Booted, None);
    }

    /// Processes an event that concerns only relay `index` (from 0), such as received bytes or a timer.
    fn process_relay_event(&mut self, index: usize, event: QueuedEvent) {
        let now = self.now;
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        match event {
            QueuedEvent::Boot => self.boot(index),
            _ if member.killed.is_some() => return,
            QueuedEvent::Kill => {
                member.killed = Some(now);
                if let Some(medium) = &mut self.medium {
                    medium.switch_off(index);
                }
                self.log(index, TimelineEvent::Silent, None);
                self.film(index);
                return;
            }
            QueuedEvent::Leave(endurance_s) => member.relay.leave(now, endurance_s),
            QueuedEvent::Endurance(left_s) => {
                member.relay.handle_endurance(now, left_s.into(), 0.0);
                if member.relay.must_leave() {
                    self.log(index, TimelineEvent::MustLeave, None);
                }
            }
            QueuedEvent::Stay => member.relay.stay(now),
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

    /// Handles all outputs of relay `index` (from 0): frames, events, and the time of the next timer.
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
        self.drain_events(index);
        self.check(index);
        self.on_setpoint(index);
        self.film(index);
        let Some(member) = self.members.get_mut(index) else {
            return;
        };
        if let Some(at) = member.relay.poll_timeout()
            && member.wake.is_none_or(|wake| at < wake)
        {
            // A drained relay must not request an immediate call.
            assert!(
                at > now,
                "relay {} asks for the next call without an advance of time (endless loop)",
                index + 1
            );
            member.wake = Some(at);
            self.queue.put(at, index, QueuedEvent::Wake);
        }
    }
}

/// Simulates a run of `setup` to its end and returns its outcome.
///
/// # Errors
/// [`SetupError`] if a relay rejects its profile or settings.
pub fn run(setup: Setup) -> Result<Outcome, SetupError> {
    Chain::new(setup).map(Chain::run)
}

#[derive(Debug)]
struct Member {
    relay: Relay,
    /// Number of the relay in the mission, from 1.
    node: u16,
    /// Outgoing serial lines of the relay. Line 0 leads toward Tx, or to all relays on an ideal shared channel; line 1
    /// leads toward Rx.
    lines: [Line; 2],
    killed: Option<Instant>,
    /// True if the relay controlled its drone at the previous time step of the flight.
    under_relay_control: bool,
    starts: u32,
    /// Number of passes and view proposals of the relay before it was last switched on.
    ///
    /// A pass is a message that relays forward along the whole chain.
    swept: u32,
    stored: Option<Upload>,
    /// Stored record of the relay's votes on views, which survives a reboot; `None` before its first vote.
    record: Option<ViewRecord>,
    /// Latest setpoint that [`Chain::check`] has found to be within the limits. The same setpoint is not checked again.
    safe: Option<Placement>,
    /// Smallest and largest coordinates of all setpoints since the relay last had no setpoint. If the relay has a
    /// guard, its setpoints may be outside of the geofence only within these bounds.
    setpoint_bounds: Option<[Placement; 2]>,
    /// Position of the relay's latest measurement of the interference; `None` before the first one.
    measured: Option<Placement>,
    /// State last recorded for the animation: true if the relay was on, and its setpoint.
    filmed: Option<(bool, Option<Placement>)>,
    /// Earliest time of a queued timer event of the relay. Timer events at other times are ignored.
    wake: Option<Instant>,
}

/// Simulated chain during a run: relays, links and drones on a virtual clock.
#[derive(Debug)]
pub struct Chain {
    setup: Setup,
    members: Vec<Member>,
    queue: Queue,
    rng: ChaCha8Rng,
    outcome: Outcome,
    now: Instant,
    events: u64,
    /// Number of positions that relays have accepted since the start, or since the last [`Chain::restart`].
    accepted_positions: usize,
    /// Number of planned events in the queue, such as failures, reboots, uploads and attacker frames.
    ///
    /// The run does not end by itself before all of them have happened.
    pending_planned: usize,
    stations: Vec<Station>,
    attacker: Option<Attacker>,
    flight: Option<Flight>,
    fleet: Vec<Vehicle>,
    rotation: Option<Rotation>,
    /// Index (from 0) of each drone that takes off at the present step, and its position on the ground.
    take_off_from: Vec<(usize, Point)>,
    /// Distance of each pair of drones, m, at the time from which both drones were under automatic control.
    ///
    /// `None` while one of the two drones is on the ground, takes off, lands or is flown by its pilot.
    handed_over_m: Vec<Option<f64>>,
    /// Simulated half-duplex channel that all relays share; `None` for separate lines or an ideal channel.
    medium: Option<Medium>,
    bursts: Option<Bursts>,
    /// Setpoints of all relays at the last agreement; `None` until the chain has agreed.
    agreed: Option<Vec<Placement>>,
    agreements: u32,
    /// True once the relays have made the last measurement of the interference.
    measurements_done: bool,
    /// Statistics of the chain's availability; `None` unless the run has a set end or a shared channel.
    watch: Option<Watch>,
    record: Option<Record>,
}

#[derive(Clone, Copy, Debug)]
struct Start {
    /// Number of the relay that starts, from 1.
    index: u16,
    /// Number of this start of the relay, from 1. If frames are signed, this number is also the epoch.
    number: u32,
    seed: u32,
    now: Instant,
}

/// Creates a relay that is switched on, and restores what it stored before it was switched off.
///
/// `stored` is an uploaded mission, `record` the record of the relay's votes on views.
fn switched_on(
    setup: &Setup,
    start: Start,
    stored: Option<&Upload>,
    record: Option<&ViewRecord>,
) -> Result<Relay, SetupError> {
    let Start {
        index,
        number,
        seed,
        now,
    } = start;
    let own = setup.profiles.iter().find(|(of, _)| *of == index);
    let settings = Settings {
        profile: own.map(|(_, profile)| *profile),
        hold_altitude: setup.held.contains(&index),
        hop_time: setup.hop_time(),
        auth: setup.proof(number).or(setup.settings.auth),
        ..setup.settings
    };
    let identity = Identity {
        network: NETWORK,
        index,
    };
    let mut relay = Relay::new(setup.mission, identity, settings, seed, now)?;
    relay.set_reserve(setup.reserve);
    if let Some(upload) = stored {
        let resumed = relay.resume(upload);
        debug_assert_eq!(resumed, Ok(()), "the upload was made for this mission");
    }
    if let Some(record) = record {
        let resumed = relay.resume_view(now, record);
        debug_assert_eq!(resumed, Ok(()), "the record was made by this relay");
    }
    if setup.spares.contains(&index) {
        relay.wait_as_spare(now);
    }
    Ok(relay)
}

/// Time until a pilot lands a drone, after its relay was switched off or after a permanent takeover.
///
/// The operator also waits for this time before confirming that lost drones have landed.
const LANDS_AFTER: Duration = Duration::from_millis(30_000);

/// Relays whose state an event may have changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum ChangedRelays {
    None,
    /// A single relay with this index, from 0.
    One(usize),
    /// The event may have changed any number of relays, or the links between them.
    All,
}

impl ChangedRelays {
    fn of(event: &QueuedEvent, index: usize) -> Self {
        match event {
            QueuedEvent::Bytes { .. } | QueuedEvent::Wake => Self::One(index),
            QueuedEvent::Air(_)
            | QueuedEvent::StationTimeout
            | QueuedEvent::StationBytes { .. } => Self::None,
            _ => Self::All,
        }
    }
}

/// Ground station at one end of the chain, Tx or Rx. It uploads missions and measures interference.
#[derive(Debug)]
struct Station {
    end: Side,
    ground: Ground,
    line: Line,
    wake: Option<Instant>,
    /// Newest report of each relay. The key is the relay's number.
    reports: BTreeMap<u16, Report>,
    /// Reports received since the last call of [`Chain::arrived`].
    arrived: Vec<Report>,
}

impl Station {
    /// Returns true while the station uploads a mission.
    fn is_busy(&self) -> bool {
        matches!(
            self.ground.progress(),
            Progress::Offering | Progress::Stored { .. } | Progress::Adopted { .. }
        )
    }
}

/// Creates the ground stations that upload or measure. None without a network key, because ground stations sign all
/// frames.
fn stations(setup: &Setup) -> Vec<Station> {
    let Some(proof) = setup.proof(1) else {
        return Vec::new();
    };
    let uploads = setup.uploads.iter().map(|spec| spec.end);
    let watches = setup.watches.iter().map(|(end, _)| *end);
    let measures = setup
        .true_interference
        .as_ref()
        .filter(|true_interference| true_interference.handed.is_empty());
    let both = measures.map(|_| [Side::Upstream, Side::Downstream]);
    let mut ends: Vec<Side> = uploads
        .chain(watches)
        .chain(both.into_iter().flatten())
        .collect();
    ends.sort();
    ends.dedup();
    ends.into_iter()
        .map(|end| Station {
            end,
            ground: Ground::new(&setup.mission, end, NETWORK, setup.settings.wiring, proof),
            line: Line::default(),
            wake: None,
            reports: BTreeMap::new(),
            arrived: Vec::new(),
        })
        .collect()
}

impl Chain {
    /// Creates the chain of `setup` and switches all relays on at time 0.
    ///
    /// `run` simulates chains without faults. Their positions are the reference for the statistics of this run.
    fn begin(setup: Setup, run: Run) -> Result<Self, SetupError> {
        let mut rng = ChaCha8Rng::seed_from_u64(setup.seed);
        let members = members(&setup, &mut rng)?;
        let mut queue = Queue::default();
        let stations = stations(&setup);
        let bursts = (setup.burst > 1.0).then(|| Bursts::new(setup.faults.loss, setup.burst));
        let shared = setup.settings.wiring == Wiring::Shared;
        let medium = (shared && setup.access != Access::Ideal).then(|| {
            let nodes = members.len() + stations.len();
            Medium::new(setup.access, setup.link, nodes, setup.seed)
        });
        for &(index, at) in &setup.kills {
            queue.put(at, usize::from(index.saturating_sub(1)), QueuedEvent::Kill);
        }
        for &(index, at) in &setup.boots {
            queue.put(at, usize::from(index.saturating_sub(1)), QueuedEvent::Boot);
        }
        for &(index, at, endurance_s) in &setup.leaves {
            let event = QueuedEvent::Leave(endurance_s);
            queue.put(at, usize::from(index.saturating_sub(1)), event);
        }
        put_endurances(&setup, &mut queue);
        for &(index, at) in &setup.stays {
            queue.put(at, usize::from(index.saturating_sub(1)), QueuedEvent::Stay);
        }
        for (which, spec) in setup.uploads.iter().enumerate() {
            queue.put(spec.at, which, QueuedEvent::Upload);
        }
        for (which, (_, at)) in setup.watches.iter().enumerate() {
            queue.put(*at, which, QueuedEvent::Watch);
        }
        let mut pending_planned = put_fleet(&setup, &mut queue)
            + setup.kills.len()
            + setup.boots.len()
            + setup.leaves.len()
            + setup.endurances.len()
            + setup.stays.len()
            + setup.uploads.len();
        let parts = setup.partitions.iter().map(|part| (part.from, part.until));
        let deaf = setup.deaf.iter().map(|deaf| (deaf.from, deaf.until));
        for (from, until) in parts.chain(deaf) {
            for at in [Some(from), until].into_iter().flatten() {
                queue.put(at, 0, QueuedEvent::Partition);
                pending_planned += 1;
            }
        }
        let film = setup.film.then(Film::default);
        let track = setup.track.then(Track::default);
        let record = setup.record.then(Record::default);
        let mut chain = Self {
            stations,
            setup,
            members,
            queue,
            rng,
            outcome: Outcome {
                margin_m: f64::INFINITY,
                film,
                track,
                ..Outcome::default()
            },
            now: Instant::ZERO,
            events: 0,
            accepted_positions: 0,
            pending_planned,
            attacker: None,
            flight: None,
            fleet: Vec::new(),
            rotation: None,
            take_off_from: Vec::new(),
            handed_over_m: Vec::new(),
            medium,
            bursts,
            agreed: None,
            agreements: 0,
            measurements_done: false,
            watch: None,
            record,
        };
        if shared || chain.setup.soak.is_some() {
            chain.begin_watch(run);
        }
        if let Some(true_interference) = &chain.setup.true_interference {
            let first = Instant::ZERO + true_interference.period;
            chain.queue.put(first, 0, QueuedEvent::Measure);
        }
        chain.schedule_attack();
        chain.take_off();
        for index in 0..chain.members.len() {
            if chain
                .members
                .get(index)
                .is_some_and(|it| it.killed.is_none())
            {
                chain.drain(index);
            }
        }
        chain.update_statistics(ChangedRelays::All);
        Ok(chain)
    }
}

/// Queues the events that give relays the remaining endurance of their drones.
fn put_endurances(setup: &Setup, queue: &mut Queue) {
    for &(index, at, left_s) in &setup.endurances {
        let event = QueuedEvent::Endurance(left_s);
        queue.put(at, usize::from(index.saturating_sub(1)), event);
    }
}

fn members(setup: &Setup, rng: &mut ChaCha8Rng) -> Result<Vec<Member>, SetupError> {
    let mut members = Vec::new();
    for index in 1..=setup.mission.relays() {
        let start = Start {
            index,
            number: 1,
            seed: rng.random(),
            now: Instant::ZERO,
        };
        let relay = switched_on(setup, start, None, None)?;
        members.push(Member {
            node: index,
            lines: [Line::default(); 2],
            killed: None,
            under_relay_control: false,
            starts: 1,
            swept: 0,
            stored: None,
            record: None,
            safe: None,
            setpoint_bounds: None,
            measured: None,
            filmed: None,
            relay,
            wake: None,
        });
    }
    Ok(members)
}

/// Queues the restarts of autopilots, and the landings of drones whose pilot never hands them back.
///
/// Returns the number of these events.
fn put_fleet(setup: &Setup, queue: &mut Queue) -> usize {
    let Some(fleet) = &setup.fleet else {
        return 0;
    };
    let mut put = |at, relay: u16, event| {
        queue.put(at, usize::from(relay.saturating_sub(1)), event);
    };
    for &(relay, at) in &fleet.restarts {
        put(at, relay, QueuedEvent::Restart);
    }
    // A pilot who keeps the drone lands it; its relay is switched off.
    let kept = fleet.takeovers.iter().filter(|it| it.until.is_none());
    for takeover in kept.clone() {
        put(
            takeover.from + LANDS_AFTER,
            takeover.relay,
            QueuedEvent::Kill,
        );
    }
    fleet.restarts.len() + kept.count()
}

/// Kind of an event in the queue of a run, about one relay or the whole chain.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum QueuedEvent {
    /// Bytes arrive at the relay.
    Bytes {
        /// Port of the relay at which the bytes arrive.
        port: Port,
        /// Bytes that arrive at the relay.
        bytes: Vec<u8>,
    },
    /// The relay's timer expires.
    Wake,
    /// Bytes arrive at a ground station.
    StationBytes {
        /// Bytes that arrive at the ground station.
        bytes: Vec<u8>,
    },
    /// The timer of a ground station expires.
    StationTimeout,
    /// A ground station begins an upload. The event's relay index is the upload's index in the setup.
    Upload,
    /// A ground station begins to request reports. The event's relay index is the index in the setup's `watches`.
    Watch,
    /// The drones fly for one time step of the flight simulation.
    Fly,
    /// The autopilot of the relay's drone restarts.
    Restart,
    /// The relay is switched off: it neither sends nor receives.
    Kill,
    /// The relay is switched on again.
    Boot,
    /// The relay requests to leave the chain. The value is the remaining endurance of its drone, s, if known.
    Leave(Option<u16>),
    /// The relay receives the remaining endurance of its drone, s. The time for the flight home is subtracted.
    Endurance(u16),
    /// The relay withdraws its request to leave the chain, or joins the chain if it is a spare.
    Stay,
    /// A partition or a one-way link failure begins or ends.
    Partition,
    /// An event of a radio on the shared channel is due, such as the end of a frame.
    ///
    /// The event's relay index is unused.
    Air(AirEvent),
    /// Every relay measures the interference at its position.
    Measure,
    /// The attacker sends a frame to a relay.
    Attack(AttackKind),
}

/// Queue of pending events, sorted by time. Events of the same time keep their order of insertion.
#[derive(Debug, Default)]
pub struct Queue {
    /// Relay and kind of each event, by time and order of insertion.
    entries: BTreeMap<(Instant, u64), (usize, QueuedEvent)>,
    order: u64,
}

impl Queue {
    /// Adds the event `event` of relay `relay` (from 0) at the time `at`.
    pub fn put(&mut self, at: Instant, relay: usize, event: QueuedEvent) {
        self.entries.insert((at, self.order), (relay, event));
        self.order += 1;
    }

    /// Removes the earliest event and returns its time, relay (from 0) and kind; `None` if there is none.
    pub fn take(&mut self) -> Option<(Instant, usize, QueuedEvent)> {
        let ((at, _), (relay, event)) = self.entries.pop_first()?;
        Some((at, relay, event))
    }

    /// Removes the earliest event, if its time is not after `until`. The result is as in [`take`](Self::take).
    pub fn take_by(&mut self, until: Instant) -> Option<(Instant, usize, QueuedEvent)> {
        let (next, _) = *self.entries.keys().next()?;
        (next <= until).then(|| self.take())?
    }
}

/// Simulates `setup` with each of `seeds`, on all cores, and returns `of(seed, outcome)` of each run.
///
/// The results are in the order of the seeds.
///
/// # Errors
/// [`SetupError`] if a relay rejects its profile or settings.
pub fn run_seeds<T: Send>(
    setup: &Setup,
    seeds: impl IntoIterator<Item = u64>,
    of: impl Fn(u64, Outcome) -> T + Sync,
) -> Result<Vec<T>, SetupError> {
    let seeds: Vec<u64> = seeds.into_iter().collect();
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(seed) = seeds.get(at).copied() else {
                return done;
            };
            let setup = Setup {
                seed,
                ..setup.clone()
            };
            done.push((at, run(setup).map(|outcome| of(seed, outcome))));
        }
    };
    let mut all: Vec<_> = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores.min(seeds.len()))
            .map(|_| scope.spawn(work))
            .collect();
        let done = workers.into_iter().map(|worker| match worker.join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        done.flatten().collect()
    });
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, result)| result).collect()
}

/// Returns the positions in which a fault-free chain of only the relays `nodes` (from 1) settles.
///
/// `version` is the version of the mission that they fly.
pub fn undisturbed(setup: &Setup, nodes: &[u16], version: u16) -> Places {
    places_of(&run(without_other_relays(setup, nodes, version)?).ok()?)
}
