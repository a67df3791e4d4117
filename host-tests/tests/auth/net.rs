//! Simulated chain with ground stations at both ends, on which an attacker records and injects frames.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use host_tests::bench;
use host_tests::fixtures::{NETWORK, mission};
use uav_relay::{
    Auth, Duration, Event, Ground, Identity, Instant, Interference, Interferer, Key, MAX_FRAME,
    Mission, MissionConfig, Port, Relay, Settings, Side, Stats, Upload, Wiring,
};

pub(crate) const KEY: [u8; 32] = *b"the members of network 7 have it";

/// Time that a frame takes between neighbours.
const ON_THE_WAY: Duration = Duration::from_millis(10);

/// Returns an upload of mission version `version`. Each version places the interferer elsewhere.
pub(crate) fn newer(base: &Mission, version: u16) -> Upload {
    let config = MissionConfig {
        interference: Interference::Source(Interferer {
            power_w: 80.0,
            x_m: 900.0 - 150.0 * f32::from(version),
            y_m: -300.0,
        }),
        ..*base.config()
    };
    Upload::new(base, version, config).unwrap()
}

/// Frame that the attacker has recorded.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Heard {
    pub(crate) from: u16,
    pub(crate) to: u16,
    /// Start counts of the sender and of the receiver when the frame was sent.
    pub(crate) lives: (u32, u32),
    /// Index of this frame among all recorded frames.
    pub(crate) number: usize,
    pub(crate) wire: Vec<u8>,
}

/// Scheduled event of the simulation.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Deed {
    /// Event: the relay of this index reboots without the mission upload that it had stored.
    Reboot(u16),
    /// Event: the relay of this index reboots with the mission upload that it had stored.
    Resume(u16),
    /// Event: the ground station at this end uploads a mission of this version.
    Upload(Side, u16),
    /// Event: the leader restarts the agreement on positions.
    Restart,
}

#[derive(Clone)]
pub(crate) struct Net {
    pub(crate) relays: Vec<Relay>,
    /// Ground stations: one at the transmitter, one at the receiver.
    pub(crate) grounds: [Ground; 2],
    stored: Vec<Option<Upload>>,
    /// Number of starts of each relay, which is also its epoch.
    pub(crate) lives: Vec<u32>,
    pub(crate) now: Instant,
    pub(crate) heard: Vec<Heard>,
    /// Indices of the recorded frames that offer a newer mission.
    pub(crate) offers: Vec<usize>,
    pub(crate) handshakes: Vec<usize>,
    /// Number of genuine messages that each relay has received since its start.
    pub(crate) genuine: Vec<u32>,
    /// Start counts of both ends of each link (from, to) when a message was last accepted there.
    pub(crate) proven: BTreeMap<(u16, u16), (u32, u32)>,
    /// Start count of the sender that the receiver last learned, and the receiver's own then, by link.
    learned: BTreeMap<(u16, u16), (u32, u32)>,
    /// Indices of frames whose sender signed them before it learned of the receiver's last start.
    outdated: BTreeSet<usize>,
    /// Frames in transit: arrival time, and index of the frame.
    under_way: VecDeque<(Instant, usize)>,
    pub(crate) deeds: VecDeque<(Instant, Deed)>,
    wiring: Wiring,
    pub(crate) happenings: u64,
}

impl Net {
    /// Starts `relays` relays at time 0. The events `deeds`, with times in ms, must be in order of time.
    pub(crate) fn new(relays: u16, wiring: Wiring, deeds: &[(u64, Deed)]) -> Self {
        let mut net = Self {
            relays: (1..=relays)
                .map(|index| relay(relays, index, wiring, (1, Instant::ZERO)))
                .collect(),
            grounds: [Side::Upstream, Side::Downstream].map(|end| {
                let base = mission(relays);
                Ground::new(&base, end, NETWORK, wiring, proof(1))
            }),
            stored: vec![None; relays.into()],
            lives: vec![1; relays.into()],
            now: Instant::ZERO,
            heard: Vec::new(),
            offers: Vec::new(),
            handshakes: Vec::new(),
            genuine: vec![0; relays.into()],
            proven: BTreeMap::new(),
            learned: BTreeMap::new(),
            outdated: BTreeSet::new(),
            under_way: VecDeque::new(),
            deeds: deeds
                .iter()
                .map(|&(ms, deed)| (Instant::from_millis(ms), deed))
                .collect(),
            wiring,
            happenings: 0,
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
    pub(crate) fn life(&self, node: u16) -> u32 {
        if self.is_relay(node) {
            self.lives[usize::from(node) - 1]
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
        self.proven.get(&(from, to)) == Some(&(self.life(from), self.life(to)))
    }

    pub(crate) fn has_arrived(&self, heard: &Heard) -> bool {
        self.under_way
            .front()
            .is_none_or(|(_, next)| heard.number < *next)
    }

    /// Returns true if the receiver still uses the nonces with which a recorded frame was signed.
    pub(crate) fn is_of_now(&self, heard: &Heard) -> bool {
        let Heard {
            from, to, lives, ..
        } = heard;
        lives.1 == self.life(*to)
            && self.learned.get(&(*from, *to)) == Some(lives)
            && !self.outdated.contains(&heard.number)
    }

    /// Processes the next event unless it is later than `until`. Returns false if there is none.
    pub(crate) fn step(&mut self, until: Instant) -> bool {
        let wake = (1..=self.len())
            .filter_map(|index| Some((self.relay(index).poll_timeout()?, index)))
            .min();
        let arrives = self.under_way.front().map(|(at, _)| *at);
        let does = self.deeds.front().map(|(at, _)| *at);
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
        self.happenings += 1;
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
        let Some((_, deed)) = self.deeds.pop_front() else {
            return;
        };
        match deed {
            Deed::Reboot(index) => self.reboot(index, self.life(index) + 1),
            Deed::Resume(index) => {
                let stored = self.stored[usize::from(index) - 1];
                self.start(index, self.life(index) + 1, stored);
            }
            Deed::Upload(side, version) => {
                let (now, end) = (self.now, usize::from(side == Side::Downstream));
                let upload = newer(&mission(self.len()), version);
                self.grounds[end].upload(now, upload).unwrap();
                self.drain_ground(end);
            }
            Deed::Restart => {
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
        self.lives[place] = epoch;
        self.genuine[place] = 0;
        let now = self.now;
        let start = (epoch, now);
        *self.relay(index) = started(self.len(), index, self.wiring, start, stored);
        self.stored[place] = stored;
        self.drain(index);
    }

    fn deliver(&mut self) {
        let Some((_, heard)) = self.under_way.pop_front() else {
            return;
        };
        let Heard {
            from,
            to,
            lives,
            wire,
            number,
            ..
        } = self.heard[heard].clone();
        if !self.is_relay(to) {
            let end = usize::from(to != 0);
            self.grounds[end].handle_bytes(&wire);
            return self.drain_ground(end);
        }
        self.learned.insert((from, to), (lives.0, self.life(to)));
        let before = self.stats(to);
        self.give(to, self.port(from, to), &wire);
        let after = self.stats(to);
        if after.forged > before.forged {
            self.outdated.insert(number);
        }
        let messages = after.received - before.received;
        self.genuine[usize::from(to) - 1] += messages;
        if messages > 0 {
            self.proven.insert((from, to), (lives.0, self.life(to)));
        }
    }

    /// Delivers bytes to a relay. Returns the number of frames that it sends in response.
    pub(crate) fn give(&mut self, to: u16, port: Port, wire: &[u8]) -> usize {
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
            self.say(index, to, wire);
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
            self.say(from, to, wire);
        }
    }

    /// Records a frame from node `from` to node `to`, and puts it in transit.
    fn say(&mut self, from: u16, to: u16, wire: Vec<u8>) {
        let lives = (self.life(from), self.life(to));
        let number = self.heard.len();
        self.under_way.push_back((self.now + ON_THE_WAY, number));
        if super::offers::is_offer(&super::frames::plain(&wire)) {
            self.offers.push(number);
        }
        if super::frames::plain(&wire).is_handshake() {
            self.handshakes.push(number);
        }
        self.heard.push(Heard {
            from,
            to,
            lives,
            number,
            wire,
        });
    }

    /// Returns the bits of each relay's setpoint and target SIR, for exact comparison.
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
    Auth {
        key: Key::new(KEY),
        epoch,
    }
}

/// Creates relay `index` of `of` relays. `start` has its epoch and the current time.
pub(crate) fn relay(of: u16, index: u16, wiring: Wiring, start: (u32, Instant)) -> Relay {
    started(of, index, wiring, start, None)
}

/// Creates relay `index` of `of` relays with the mission upload that it had stored, if any.
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
    let identity = Identity {
        network: NETWORK,
        index,
    };
    let seed = u32::from(index) << 8 | epoch;
    let mut relay = Relay::new(mission(of), identity, settings, seed, now).unwrap();
    if let Some(upload) = stored {
        relay.resume(&upload).unwrap();
    }
    relay
}
