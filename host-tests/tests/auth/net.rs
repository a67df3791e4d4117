//! Simulated chain with ground stations at both ends, on which an attacker records and injects frames.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use host_tests::bench;
use host_tests::fixtures::{NETWORK, mission};
use host_tests::make;
use uav_relay::{
    Auth, Duration, Event, Ground, Instant, Interference, MAX_FRAME, Mission, MissionConfig, Port,
    Relay, Settings, Side, Stats, Upload, Wiring,
};

pub(crate) const KEY: [u8; 32] = *b"the members of network 7 have it";

/// Time that a simulated frame takes between neighbours.
const ON_THE_WAY: Duration = Duration::from_millis(10);

/// Returns an upload of mission version `version`. Each version places the interferer elsewhere.
pub(crate) fn newer(base: &Mission, version: u16) -> Upload {
    let config = MissionConfig {
        interference: Interference::Source(make::interferer(
            80.0,
            900.0 - 150.0 * f32::from(version),
            -300.0,
        )),
        ..*base.config()
    };
    Upload::new(base, version, config).unwrap()
}

/// Frame that the attacker has recorded.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct RecordedFrame {
    pub(crate) from: u16,
    pub(crate) to: u16,
    /// Start counts of the sender and of the receiver when the frame was sent.
    pub(crate) epochs: (u32, u32),
    /// Index of this frame among all recorded frames.
    pub(crate) number: usize,
    pub(crate) wire: Vec<u8>,
}

/// Scheduled event of the simulation.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ScheduledEvent {
    /// The relay of this index reboots and loses the mission upload that it had stored.
    Reboot(u16),
    /// The relay of this index reboots and keeps the mission upload that it had stored.
    Resume(u16),
    /// The ground station at this end uploads a mission of this version.
    Upload(Side, u16),
    /// The leader restarts the agreement on positions.
    Restart,
}

#[derive(Clone)]
pub(crate) struct Net {
    pub(crate) relays: Vec<Relay>,
    /// Ground stations: one at the transmitter, one at the receiver.
    pub(crate) grounds: [Ground; 2],
    stored: Vec<Option<Upload>>,
    /// Number of starts of each relay. The number is also the relay's epoch.
    pub(crate) starts: Vec<u32>,
    pub(crate) now: Instant,
    pub(crate) recorded: Vec<RecordedFrame>,
    /// Indices of the recorded frames that offer a newer mission.
    pub(crate) offers: Vec<usize>,
    pub(crate) handshakes: Vec<usize>,
    /// Number of genuine messages that each relay has received since its start.
    pub(crate) genuine: Vec<u32>,
    /// Start counts of sender and receiver when the receiver last accepted a message.
    ///
    /// The key is the link: sender, receiver.
    pub(crate) proven: BTreeMap<(u16, u16), (u32, u32)>,
    /// Start counts of sender and receiver when the receiver last received a frame.
    ///
    /// The key is the link: sender, receiver. The start count of the sender is from the time when the frame was sent.
    learned: BTreeMap<(u16, u16), (u32, u32)>,
    /// Indices of recorded frames that were signed before their sender knew of the receiver's last start.
    outdated: BTreeSet<usize>,
    /// Frames in transit: arrival time, and index of the frame.
    in_transit: VecDeque<(Instant, usize)>,
    pub(crate) events: VecDeque<(Instant, ScheduledEvent)>,
    wiring: Wiring,
    pub(crate) events_done: u64,
}

impl Net {
    /// Starts `relays` relays at time 0. `events`, with times in ms, must be in ascending order of time.
    pub(crate) fn new(relays: u16, wiring: Wiring, events: &[(u64, ScheduledEvent)]) -> Self {
        let mut net = Self {
            relays: (1..=relays)
                .map(|index| relay(relays, index, wiring, (1, Instant::ZERO)))
                .collect(),
            grounds: [Side::Upstream, Side::Downstream].map(|end| {
                let base = mission(relays);
                Ground::new(&base, end, NETWORK, wiring, proof(1))
            }),
            stored: vec![None; relays.into()],
            starts: vec![1; relays.into()],
            now: Instant::ZERO,
            recorded: Vec::new(),
            offers: Vec::new(),
            handshakes: Vec::new(),
            genuine: vec![0; relays.into()],
            proven: BTreeMap::new(),
            learned: BTreeMap::new(),
            outdated: BTreeSet::new(),
            in_transit: VecDeque::new(),
            events: events
                .iter()
                .map(|&(ms, event)| (Instant::from_millis(ms), event))
                .collect(),
            wiring,
            events_done: 0,
        };
        for index in 1..=relays {
            net.drain(index);
        }
        net
    }

    pub(crate) fn relay(&mut self, index: u16) -> &mut Relay {
        &mut self.relays[usize::from(index) - 1]
    }

    pub(crate) fn stats(&self, index: u16) -> Stats {
        *self.relays[usize::from(index) - 1].stats()
    }

    /// Returns the number of starts of a node; 1 for a ground station.
    pub(crate) fn start_count(&self, node: u16) -> u32 {
        if self.is_relay(node) {
            self.starts[usize::from(node) - 1]
        } else {
            1
        }
    }

    pub(crate) fn is_relay(&self, node: u16) -> bool {
        (1..=self.len()).contains(&node)
    }

    pub(crate) fn len(&self) -> u16 {
        u16::try_from(self.relays.len()).unwrap()
    }

    /// Returns the port at which `to` receives frames of `from`.
    pub(crate) fn port(&self, from: u16, to: u16) -> Port {
        match self.wiring {
            Wiring::Shared => Port::Shared,
            Wiring::Pair if from < to => Port::Upstream,
            Wiring::Pair => Port::Downstream,
        }
    }

    /// Returns true if both ends of the link have authenticated each other since their last starts.
    pub(crate) fn is_proven(&self, from: u16, to: u16) -> bool {
        self.proven.get(&(from, to)) == Some(&(self.start_count(from), self.start_count(to)))
    }

    pub(crate) fn has_arrived(&self, heard: &RecordedFrame) -> bool {
        self.in_transit
            .front()
            .is_none_or(|(_, next)| heard.number < *next)
    }

    /// Returns true if the tag of a recorded frame has the nonces that the receiver still uses.
    pub(crate) fn is_of_current_starts(&self, heard: &RecordedFrame) -> bool {
        let RecordedFrame {
            from,
            to,
            epochs: starts,
            ..
        } = heard;
        starts.1 == self.start_count(*to)
            && self.learned.get(&(*from, *to)) == Some(starts)
            && !self.outdated.contains(&heard.number)
    }

    /// Processes the next event if its time is not later than `until`. Returns false if there is no such event.
    pub(crate) fn step(&mut self, until: Instant) -> bool {
        let wake = (1..=self.len())
            .filter_map(|index| Some((self.relay(index).poll_timeout()?, index)))
            .min();
        let arrives = self.in_transit.front().map(|(at, _)| *at);
        let does = self.events.front().map(|(at, _)| *at);
        let asks = (0..2)
            .filter_map(|end| Some((self.grounds[end].poll_timeout()?, end)))
            .min();
        let times = [
            arrives,
            does,
            wake.map(|(at, _)| at),
            asks.map(|(at, _)| at),
        ];
        let next = times.into_iter().flatten().min();
        let Some(next) = next.filter(|at| *at <= until) else {
            return false;
        };
        self.now = self.now.max(next);
        self.events_done += 1;
        if does == Some(next) {
            self.act();
        } else if arrives == Some(next) {
            self.deliver();
        } else if let Some((at, end)) = asks.filter(|(at, _)| *at == next) {
            self.grounds[end].handle_timeout(at);
            self.drain_ground(end);
        } else if let Some((at, index)) = wake {
            self.relay(index).handle_timeout(at);
            self.drain(index);
        }
        true
    }

    pub(crate) fn run(&mut self, until: Instant) {
        while self.step(until) {}
    }

    fn act(&mut self) {
        let Some((_, event)) = self.events.pop_front() else {
            return;
        };
        match event {
            ScheduledEvent::Reboot(index) => self.reboot(index, self.start_count(index) + 1),
            ScheduledEvent::Resume(index) => {
                let stored = self.stored[usize::from(index) - 1];
                self.start(index, self.start_count(index) + 1, stored);
            }
            ScheduledEvent::Upload(side, version) => {
                let (now, end) = (self.now, usize::from(side == Side::Downstream));
                let upload = newer(&mission(self.len()), version);
                self.grounds[end].upload(now, upload).unwrap();
                self.drain_ground(end);
            }
            ScheduledEvent::Restart => {
                let now = self.now;
                self.relay(1).restart(now);
                self.drain(1);
            }
        }
    }

    pub(crate) fn reboot(&mut self, index: u16, epoch: u32) {
        self.start(index, epoch, None);
    }

    fn start(&mut self, index: u16, epoch: u32, stored: Option<Upload>) {
        let place = usize::from(index) - 1;
        self.starts[place] = epoch;
        self.genuine[place] = 0;
        let now = self.now;
        let start = (epoch, now);
        *self.relay(index) = started(self.len(), index, self.wiring, start, stored);
        self.stored[place] = stored;
        self.drain(index);
    }

    fn deliver(&mut self) {
        let Some((_, heard)) = self.in_transit.pop_front() else {
            return;
        };
        let RecordedFrame {
            from,
            to,
            epochs: starts,
            wire,
            number,
            ..
        } = self.recorded[heard].clone();
        if !self.is_relay(to) {
            let end = usize::from(to != 0);
            self.grounds[end].handle_bytes(&wire);
            return self.drain_ground(end);
        }
        self.learned
            .insert((from, to), (starts.0, self.start_count(to)));
        let before = self.stats(to);
        self.deliver_bytes(to, self.port(from, to), &wire);
        let after = self.stats(to);
        if after.forged > before.forged {
            self.outdated.insert(number);
        }
        let messages = after.received - before.received;
        self.genuine[usize::from(to) - 1] += messages;
        if messages > 0 {
            self.proven
                .insert((from, to), (starts.0, self.start_count(to)));
        }
    }

    /// Delivers bytes to relay `to`. Returns the number of frames that the relay sends in response.
    pub(crate) fn deliver_bytes(&mut self, to: u16, port: Port, wire: &[u8]) -> usize {
        let now = self.now;
        self.relay(to).handle_bytes(now, port, wire);
        self.drain(to)
    }

    fn drain(&mut self, index: u16) -> usize {
        let now = self.now;
        let sent = bench::sent(self.relay(index), now);
        let count = sent.len();
        for (port, wire) in sent {
            let to = match port {
                Port::Upstream => index - 1,
                Port::Downstream => index + 1,
                Port::Shared => super::frames::plain(&wire).destination(),
            };
            self.transmit(index, to, wire);
        }
        while let Some(event) = self.relay(index).poll_event() {
            if event == Event::Uploaded {
                self.stored[usize::from(index) - 1] = self.relay(index).upload().copied();
            }
            assert!(
                !matches!(event, Event::NeighbourLost { .. }),
                "{index}: {event:?} at {now:?}"
            );
        }
        count
    }

    fn drain_ground(&mut self, end: usize) {
        let mut frame = [0; MAX_FRAME];
        while let Some(len) = self.grounds[end].poll_transmit(&mut frame) {
            let wire = frame[..len].to_vec();
            let from = [0, self.len() + 1][end];
            let to = super::frames::plain(&wire).destination();
            self.transmit(from, to, wire);
        }
    }

    /// Records a frame from node `from` to node `to`, and puts it in transit.
    fn transmit(&mut self, from: u16, to: u16, wire: Vec<u8>) {
        let starts = (self.start_count(from), self.start_count(to));
        let number = self.recorded.len();
        self.in_transit.push_back((self.now + ON_THE_WAY, number));
        if super::offers::is_offer(&super::frames::plain(&wire)) {
            self.offers.push(number);
        }
        if super::frames::plain(&wire).is_handshake() {
            self.handshakes.push(number);
        }
        self.recorded.push(RecordedFrame {
            from,
            to,
            epochs: starts,
            number,
            wire,
        });
    }

    /// Returns each relay's setpoint and target SIR as bits, for exact comparison. `None` for a relay without them.
    pub(crate) fn bits(&self) -> Vec<Option<([u32; 3], u32)>> {
        self.relays
            .iter()
            .map(|relay| {
                let (place, target) = (relay.setpoint()?, relay.target()?);
                let at = [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits);
                Some((at, target.to_bits()))
            })
            .collect()
    }
}

fn proof(epoch: u32) -> Auth {
    make::auth(KEY, epoch)
}

/// Creates relay `index` of `of` relays. `start` is the relay's epoch and the current time.
pub(crate) fn relay(of: u16, index: u16, wiring: Wiring, start: (u32, Instant)) -> Relay {
    started(of, index, wiring, start, None)
}

/// Creates relay `index` of `of` relays; `stored` is the mission upload from its earlier start, if any.
fn started(
    of: u16,
    index: u16,
    wiring: Wiring,
    (epoch, now): (u32, Instant),
    stored: Option<Upload>,
) -> Relay {
    let settings = Settings {
        wiring,
        auth: Some(proof(epoch)),
        ..Settings::default()
    };
    let identity = make::identity(index);
    let seed = u32::from(index) << 8 | epoch;
    let mut relay = Relay::new(mission(of), identity, settings, seed, now).unwrap();
    if let Some(upload) = stored {
        relay.resume(&upload).unwrap();
    }
    relay
}
