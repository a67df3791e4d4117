//! Event-driven medium on the public interface of `Relay`. It has one-way links, and reboots with stored votes.

use std::collections::BTreeMap;
use std::rc::Rc;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{
    Auth, Event, Identity, Instant, Key, MAX_FRAME, Mission, Phase, Port, Relay, Settings, Upload,
    ViewRecord, Wiring,
};
use uav_relay_sim::simulator::watch::{ObservedState, groups};

/// Bit rate of a wire, and of each relay's transmitter on the channel.
const BAUD: u64 = 115_200;

/// Time from the last bit sent to the last bit received, µs.
const LATENCY_US: u64 = 2_000;

/// Kind of a simulated chain: the relays' settings, and the faults that they have from the start.
#[derive(Clone, Debug)]
pub(crate) struct Kind {
    pub(crate) mission: Mission,
    pub(crate) wiring: Wiring,
    pub(crate) signed: bool,
    pub(crate) seed: u64,
    /// Reception range on a shared channel, as a difference of relay indices.
    pub(crate) reach: usize,
    /// Relay (from 0) that has another mission than the others before flight, if any, and that mission.
    pub(crate) stranger: Option<(usize, Mission)>,
    /// Relay (from 0) whose epoch is lower after its second start than before, if any. An epoch is a number that
    /// otherwise rises at each start of a relay.
    pub(crate) goes_back: Option<usize>,
    /// Relay (from 0) that has a copy, a second drone with the same index; `None` if no relay has one.
    ///
    /// The number of the copy follows the numbers of all relays.
    pub(crate) copied: Option<usize>,
}

/// Scheduled event at a relay or link. Relays are counted from 0.
#[derive(Clone, Debug)]
pub(crate) enum ScheduledEvent {
    /// The relay is switched on. After a reboot it has its stored votes and upload.
    On(usize),
    Off(usize),
    /// An operator informs the relay that the other drone with the same index has been removed.
    Clear(usize),
    /// The relay requests to leave the chain, with this remaining endurance, s.
    Leave(usize, Option<u16>),
    /// The relay becomes a spare (waits outside of the chain), if it has taken no part in the protocol yet.
    Spare(usize),
    /// The relay cancels its departure, or joins the chain again.
    Stay(usize),
    /// The link from `from` to `to` is cut. Several cuts of one link add up.
    Cut {
        from: usize,
        to: usize,
    },
    /// A cut of the link from `from` to `to` ends. The link works again if no other cut is left.
    Mend {
        from: usize,
        to: usize,
    },
    /// Frames are lost with this probability on every link from now on.
    Loss(f64),
    /// A mission is uploaded to the relay.
    Upload(usize, Box<Upload>),
    /// The relay's clock steps by this many µs, but not below 0. The fields are the relay and the step.
    Step(usize, i64),
}

#[derive(Clone, Debug)]
enum QueuedEvent {
    Scheduled(ScheduledEvent),
    Frame {
        from: usize,
        to: usize,
        port: Port,
        bytes: Rc<[u8]>,
    },
    Wake(usize),
}

#[derive(Debug)]
struct Drone {
    relay: Relay,
    is_on: bool,
    starts: u32,
    stored: (Option<ViewRecord>, Option<Upload>),
    wake_us: Option<u64>,
    /// Reading of the drone's clock minus the simulated time, µs.
    ahead_us: i64,
    /// Time at which the drone's transmitter is free again, for each port, µs.
    free_us: [u64; 2],
}

/// Simulated chain in flight, with its medium and statistics.
#[derive(Debug)]
pub(crate) struct Air {
    kind: Kind,
    drones: Vec<Drone>,
    /// Pending events, by time, µs, and order of insertion.
    queue: BTreeMap<(u64, u64), QueuedEvent>,
    order: u64,
    pub(crate) now_us: u64,
    cuts: Vec<u16>,
    loss: f64,
    rng: ChaCha8Rng,
    seen: Vec<ObservedState>,
    /// Largest number of groups of relays at any time so far. A group consists of all relays that use the positions of the same agreement.
    pub(crate) groups: usize,
    /// Simulated time at which the number of groups first reached the maximum in `groups`, µs.
    pub(crate) groups_us: u64,
    /// Time since which all relays have had agreed positions in one view, µs; `None` while some have not. A view is
    /// the agreed membership of the chain.
    pub(crate) whole_since_us: Option<u64>,
    /// Number of relays that may lack an agreed position in the time that counts as flown (`flown_us`).
    pub(crate) spare: usize,
    /// Total time in which all relays, except at most `spare`, had positions of one agreement, µs.
    pub(crate) flown_us: u64,
    /// First time at which all relays, except at most `spare`, had positions of one agreement, µs. `None` before.
    pub(crate) first_us: Option<u64>,
    /// Longest time in which more than `spare` relays lacked an agreed position, µs.
    pub(crate) longest_us: u64,
    flies: bool,
    changed_us: u64,
    /// Number of frames sent by all relays.
    pub(crate) frames: u64,
    /// Last times at which the copied relay received its copy, and the copy received the relay, µs. `None` before the
    /// first.
    received_us: [Option<u64>; 2],
    /// Time since which a relay and its copy have both had setpoints, µs.
    ///
    /// `None` while one of the two has no setpoint, or while the two do not receive each other.
    both_us: Option<u64>,
    /// Longest time in which a relay and its copy had setpoints although they received each other, µs.
    pub(crate) longest_both_us: u64,
    pub(crate) events: BTreeMap<(usize, String), u32>,
    pub(crate) story: bool,
}

impl Drone {
    /// Returns the drone's clock reading at simulated time `us`.
    fn clock(&self, us: u64) -> Instant {
        Instant::from_micros(us.saturating_add_signed(self.ahead_us))
    }
}

impl Air {
    /// Stores the record of votes from an earlier flight at relay `at`.
    pub(crate) fn store(&mut self, at: usize, record: ViewRecord) {
        self.drones[at].stored.0 = Some(record);
    }

    /// Creates a chain with all relays switched off and all links intact.
    pub(crate) fn new(kind: Kind) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(kind.seed);
        let all = usize::from(kind.mission.relays()) + usize::from(kind.copied.is_some());
        let drones: Vec<Drone> = (0..all)
            .map(|at| Drone {
                relay: switched_on(&kind, at, 1, rng.random(), Instant::ZERO),
                is_on: false,
                starts: 0,
                stored: (None, None),
                wake_us: None,
                ahead_us: 0,
                free_us: [0; 2],
            })
            .collect();
        let seen = drones
            .iter()
            .map(|drone| ObservedState::of(&drone.relay, false))
            .collect();
        Self {
            kind,
            drones,
            queue: BTreeMap::new(),
            order: 0,
            now_us: 0,
            cuts: vec![0; all * all],
            loss: 0.0,
            rng,
            seen,
            groups: 0,
            groups_us: 0,
            whole_since_us: None,
            spare: 0,
            flown_us: 0,
            first_us: None,
            longest_us: 0,
            flies: false,
            changed_us: 0,
            frames: 0,
            received_us: [None; 2],
            both_us: None,
            longest_both_us: 0,
            events: BTreeMap::new(),
            story: std::env::var_os("STORY").is_some(),
        }
    }

    fn put(&mut self, at_us: u64, event: QueuedEvent) {
        self.queue.insert((at_us, self.order), event);
        self.order += 1;
    }

    pub(crate) fn plan(&mut self, at_us: u64, event: ScheduledEvent) {
        self.put(at_us, QueuedEvent::Scheduled(event));
    }

    pub(crate) fn run(&mut self, until_us: u64) {
        while let Some(next) = self.queue.first_entry()
            && next.key().0 <= until_us
        {
            let ((at_us, _), happening) = next.remove_entry();
            self.now_us = at_us;
            let touched = match happening {
                QueuedEvent::Wake(at) => {
                    let drone = &mut self.drones[at];
                    if drone.wake_us != Some(at_us) || !drone.is_on {
                        continue;
                    }
                    drone.wake_us = None;
                    let now = drone.clock(at_us);
                    drone.relay.handle_timeout(now);
                    at
                }
                QueuedEvent::Frame {
                    from,
                    to,
                    port,
                    bytes,
                } => {
                    if !self.drones[to].is_on {
                        continue;
                    }
                    if self.place(from) == self.place(to) {
                        self.received_us[usize::from(to > from)] = Some(at_us);
                    }
                    let drone = &mut self.drones[to];
                    let now = drone.clock(at_us);
                    drone.relay.handle_bytes(now, port, &bytes);
                    to
                }
                QueuedEvent::Scheduled(event) => {
                    if self.story {
                        println!("{:10.3} {event:?}", at_us as f64 / 1e6);
                    }
                    match self.act(event) {
                        Some(at) => at,
                        None => continue,
                    }
                }
            };
            self.drain(touched);
        }
        self.now_us = until_us;
    }

    fn act(&mut self, event: ScheduledEvent) -> Option<usize> {
        let all = self.drones.len();
        match event {
            ScheduledEvent::On(at) => {
                let seed = self.rng.random();
                let drone = &mut self.drones[at];
                if drone.is_on {
                    return None;
                }
                drone.starts += 1;
                drone.is_on = true;
                drone.wake_us = None;
                let now = drone.clock(self.now_us);
                drone.relay = switched_on(&self.kind, at, drone.starts, seed, now);
                let (record, upload) = &drone.stored;
                if let Some(upload) = upload {
                    drone.relay.resume(upload).unwrap();
                }
                if let Some(record) = record {
                    drone.relay.resume_view(now, record).unwrap();
                }
                return Some(at);
            }
            ScheduledEvent::Off(at) => {
                self.drones[at].is_on = false;
                return Some(at);
            }
            ScheduledEvent::Clear(at) => {
                let drone = &mut self.drones[at];
                let now = drone.clock(self.now_us);
                drone.relay.clear_duplicate_index(now);
                return Some(at);
            }
            ScheduledEvent::Leave(at, endurance_s) => {
                let drone = &mut self.drones[at];
                let now = drone.clock(self.now_us);
                drone.relay.leave(now, endurance_s);
                return Some(at);
            }
            ScheduledEvent::Spare(at) => {
                let drone = &mut self.drones[at];
                let now = drone.clock(self.now_us);
                drone.relay.wait_as_spare(now);
                return Some(at);
            }
            ScheduledEvent::Stay(at) => {
                let drone = &mut self.drones[at];
                let now = drone.clock(self.now_us);
                drone.relay.stay(now);
                return Some(at);
            }
            ScheduledEvent::Cut { from, to } => self.cuts[from * all + to] += 1,
            ScheduledEvent::Mend { from, to } => self.cuts[from * all + to] -= 1,
            ScheduledEvent::Loss(loss) => self.loss = loss,
            ScheduledEvent::Upload(at, upload) => {
                let drone = &mut self.drones[at];
                if drone.is_on {
                    let now = drone.clock(self.now_us);
                    // The relay refuses an upload that is not newer than the stored one.
                    let _ = drone.relay.handle_upload(now, &upload);
                    return Some(at);
                }
            }
            ScheduledEvent::Step(at, by_us) => {
                let drone = &mut self.drones[at];
                let least = i64::try_from(self.now_us).map_or(i64::MIN, |now_us| -now_us);
                drone.ahead_us = (drone.ahead_us + by_us).max(least);
                return Some(at);
            }
        }
        None
    }

    /// Sends the pending frames of relay `at`, and updates its observed state.
    fn drain(&mut self, at: usize) {
        let now = self.drones[at].clock(self.now_us);
        let mut frame = [0; MAX_FRAME];
        if self.drones[at].is_on {
            let drone = &mut self.drones[at];
            if drone.relay.poll_timeout().is_some_and(|due| due <= now) {
                // The timer has expired in the same microsecond.
                drone.relay.handle_timeout(now);
            }
            drone.stored.1 = drone.relay.upload().copied();
            let record = &mut drone.stored.0;
            drone.relay.persist(|changed| {
                *record = Some(*changed);
                true
            });
            while let Some(sent) = self.drones[at].relay.poll_transmit(now, &mut frame) {
                self.send(at, sent.port, &frame[..sent.len]);
            }
            while let Some(event) = self.drones[at].relay.poll_event() {
                self.count_event(at, event);
            }
            let drone = &mut self.drones[at];
            if let Some(wake) = drone.relay.poll_timeout() {
                assert!(wake > now, "it spins");
                let wake_us = self.now_us + wake.since(now).as_micros();
                if drone.wake_us.is_none_or(|known| known != wake_us) {
                    drone.wake_us = Some(wake_us);
                    self.put(wake_us, QueuedEvent::Wake(at));
                }
            }
        }
        self.compare_copies();
        let seen = ObservedState::of(&self.drones[at].relay, self.drones[at].is_on);
        if seen == self.seen[at] {
            return;
        }
        self.seen[at] = seen;
        let groups = groups(&self.uncopied());
        if groups > self.groups {
            self.groups = groups;
            self.groups_us = self.now_us;
        }
        self.measure();
        if self.is_whole() {
            self.whole_since_us.get_or_insert(self.now_us);
        } else {
            self.whole_since_us = None;
        }
    }

    fn count_event(&mut self, at: usize, event: Event) {
        if self.story {
            let relay = &self.drones[at].relay;
            println!(
                "{:10.3} relay {}: {event:?}; view {}.{} of {}, {:?}, {:?}",
                self.now_us as f64 / 1e6,
                at + 1,
                relay.view().number(),
                relay.view().proposer(),
                relay.mission().relays(),
                relay.phase(),
                relay.neighbours()
            );
        }
        let text = format!("{event:?}");
        let name = text.split([' ', '{']).next().unwrap_or_default().to_owned();
        *self.events.entry((at, name)).or_default() += 1;
    }

    fn send(&mut self, from: usize, port: Port, frame: &[u8]) {
        self.frames += 1;
        let line = usize::from(port == Port::Downstream);
        let free_us = &mut self.drones[from].free_us[line];
        *free_us = (*free_us).max(self.now_us) + frame.len() as u64 * 10_000_000 / BAUD;
        let at_us = *free_us + LATENCY_US;
        let (all, reach) = (self.drones.len(), self.kind.reach);
        let place = self.place(from);
        let (places, into) = match port {
            Port::Shared => (place.saturating_sub(reach)..place + reach + 1, port),
            Port::Upstream => (place.saturating_sub(1)..place, Port::Downstream),
            Port::Downstream => (place + 1..place + 2, Port::Upstream),
        };
        let bytes: Rc<[u8]> = frame.into();
        for to in (0..all).filter(|to| *to != from) {
            if places.contains(&self.place(to))
                && self.cuts[from * all + to] == 0
                && self.drones[to].is_on
                && (self.loss == 0.0 || !self.rng.random_bool(self.loss))
            {
                let bytes = Rc::clone(&bytes);
                self.put(
                    at_us,
                    QueuedEvent::Frame {
                        from,
                        to,
                        port: into,
                        bytes,
                    },
                );
            }
        }
    }

    /// Returns the index (from 0) of drone `at` in the chain. A copy has the index of its original.
    fn place(&self, at: usize) -> usize {
        let all = usize::from(self.kind.mission.relays());
        self.kind.copied.filter(|_| at == all).unwrap_or(at)
    }

    /// Returns the observed states of all relays but the duplicated one and its duplicate. The duplicate is a second
    /// drone with the same node number.
    fn uncopied(&self) -> Vec<ObservedState> {
        let drones = (0..self.drones.len()).filter(|at| Some(self.place(*at)) != self.kind.copied);
        drones.map(|at| self.seen[at]).collect()
    }

    /// Measures how long a relay and its copy both have setpoints although they receive each other.
    fn compare_copies(&mut self) {
        let Some(copied) = self.kind.copied else {
            return;
        };
        let pair = [copied, self.drones.len() - 1].map(|at| &self.drones[at]);
        let both = pair
            .iter()
            .all(|drone| drone.is_on && drone.relay.setpoint().is_some());
        let now_us = self.now_us;
        let hear = self
            .received_us
            .iter()
            .all(|at_us| at_us.is_some_and(|at_us| now_us - at_us < 5_000_000));
        if both && hear && self.loss == 0.0 {
            let since_us = *self.both_us.get_or_insert(now_us);
            self.longest_both_us = self.longest_both_us.max(now_us - since_us);
        } else {
            self.both_us = None;
        }
    }

    /// Counts the time since the last change as flown (`flown_us`) or as an interruption (`longest_us`).
    pub(crate) fn measure(&mut self) {
        let span_us = self.now_us - self.changed_us;
        if self.flies {
            self.flown_us += span_us;
        } else if self.first_us.is_some() {
            self.longest_us = self.longest_us.max(span_us);
        }
        let flies = self.flying() + self.spare >= self.seen.len();
        if flies {
            self.first_us.get_or_insert(self.now_us);
        }
        if flies != self.flies || self.flies {
            self.changed_us = self.now_us;
        }
        self.flies = flies;
    }

    /// Returns the size of the largest view whose members all have positions of one agreement.
    fn flying(&self) -> usize {
        let holds = |seen: &&ObservedState| {
            seen.is_on && seen.leased && seen.place.is_some() && seen.phase == Phase::Holding
        };
        let holding: Vec<&ObservedState> = self.seen.iter().filter(holds).collect();
        let of = |one: &&ObservedState| {
            let same = holding.iter().filter(|other| other.view == one.view);
            let count = same.count();
            (count == usize::from(one.relays)).then_some(count)
        };
        holding.iter().filter_map(of).max().unwrap_or(0)
    }

    /// Returns true if all relays are on and have agreed positions in one membership view of all relays.
    fn is_whole(&self) -> bool {
        let all = usize::from(self.kind.mission.relays());
        let is_on = |at: &usize| self.seen[*at].is_on;
        let on = (0..self.seen.len()).filter(is_on);
        let on: Vec<&ObservedState> = on.map(|at| &self.seen[at]).collect();
        let places = (0..self.seen.len()).filter(is_on).map(|at| self.place(at));
        let places: std::collections::BTreeSet<usize> = places.collect();
        places.len() == all
            && on.len() == all
            && on.iter().all(|seen| {
                seen.view == on[0].view
                    && usize::from(seen.relays) == all
                    && seen.place.is_some()
                    && seen.phase == Phase::Holding
                    && seen.target == on[0].target
            })
    }

    /// Returns the state of all relays as text, for failure reports.
    pub(crate) fn described(&self) -> String {
        let each = self.drones.iter().map(|drone| {
            let relay = &drone.relay;
            let ends = relay.neighbours().map(|node| node.unwrap_or(0));
            format!(
                "{}{}.{}/{}{}{:?}{:?}",
                if drone.is_on { "" } else { "off " },
                relay.view().number(),
                relay.view().proposer(),
                relay.mission().relays(),
                if relay.setpoint().is_some() { "*" } else { "" },
                relay.phase(),
                ends
            )
        });
        each.collect::<Vec<_>>().join(" ")
    }
}

fn switched_on(kind: &Kind, at: usize, start: u32, seed: u32, now: Instant) -> Relay {
    let all = usize::from(kind.mission.relays());
    let place = kind.copied.filter(|_| at == all).unwrap_or(at);
    let index = u16::try_from(place + 1).unwrap();
    let auth = kind.signed.then(|| Auth {
        key: Key::new([7; 32]),
        epoch: if kind.goes_back == Some(at) {
            10 - start
        } else {
            start
        },
    });
    let settings = Settings {
        leave_without_guard: true,
        wiring: kind.wiring,
        auth,
        hop_time: uav_relay_sim::simulator::faults::LinkSpec::default().hop_time(),
        ..Settings::default()
    };
    let identity = Identity { network: 7, index };
    let mission = match kind.stranger {
        Some((stranger, mission)) if stranger == at => mission,
        _ => kind.mission,
    };
    Relay::new(mission, identity, settings, seed, now).unwrap()
}
