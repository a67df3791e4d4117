//! A chain on a clock of its own, and the ground at both ends, every frame of which can be listened to and added to: what an
//! attacker has.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use host_tests::fixtures::mission;
use uav_relay::MAX_FRAME;
use uav_relay::{
    Auth, Duration, Event, Ground, Identity, Instant, Interference, Interferer, Key, Mission,
    MissionConfig, Port, Relay, Settings, Side, Stats, Upload, Wiring,
};

pub(crate) const NETWORK: u16 = 7;
pub(crate) const KEY: [u8; 32] = *b"the members of network 7 have it";

/// From one relay to the next.
const ON_THE_WAY: Duration = Duration::from_millis(10);

/// Version `version` of a mission: the interferer is somewhere else in each.
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

/// A frame that was sent, as somebody heard it who listens everywhere.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Heard {
    pub(crate) from: u16,
    pub(crate) to: u16,
    /// How often each end had been switched on.
    pub(crate) lives: (u32, u32),
    /// Frames that were heard before it.
    pub(crate) number: usize,
    pub(crate) wire: Vec<u8>,
}

/// What happens to the chain at a time.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Deed {
    /// Relay of this index is switched off and on.
    Reboot(u16),
    /// The same, and it has stored what was uploaded.
    Resume(u16),
    /// The ground at that end uploads a mission of this version.
    Upload(Side, u16),
    /// The leader has the chain agree again.
    Restart,
}

#[derive(Clone)]
pub(crate) struct Net {
    pub(crate) relays: Vec<Relay>,
    /// The transmitter and the receiver.
    pub(crate) grounds: [Ground; 2],
    /// What each relay has stored of uploads.
    stored: Vec<Option<Upload>>,
    /// How often each relay has been switched on; its epoch.
    pub(crate) lives: Vec<u32>,
    pub(crate) now: Instant,
    pub(crate) heard: Vec<Heard>,
    /// Which of them are offers of a newer mission.
    pub(crate) offers: Vec<usize>,
    /// Which are handshakes.
    pub(crate) handshakes: Vec<usize>,
    /// Messages that genuine frames have brought, for each relay since it was switched on.
    pub(crate) genuine: Vec<u32>,
    /// Links (from, to) on which a message has been taken since both ends were switched on.
    pub(crate) proven: BTreeMap<(u16, u16), (u32, u32)>,
    /// For each of them, the sender's life that the receiver has heard of last, and its own at that time.
    learned: BTreeMap<(u16, u16), (u32, u32)>,
    /// Frames that were signed before their sender knew of the receiver's last start.
    outdated: BTreeSet<usize>,
    /// When frames arrive, and which; in order.
    under_way: VecDeque<(Instant, usize)>,
    pub(crate) deeds: VecDeque<(Instant, Deed)>,
    wiring: Wiring,
    pub(crate) happenings: u64,
}

impl Net {
    /// Switches on `relays` of them at time 0; `deeds` in the order of their times.
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

    /// How often a node has been switched on; the ground has been once.
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

    /// The port of `to` at which frames from `from` come in.
    pub(crate) fn port(&self, from: u16, to: u16) -> Port {
        match self.wiring {
            Wiring::Shared => Port::Shared,
            Wiring::Pair if from < to => Port::Upstream,
            Wiring::Pair => Port::Downstream,
        }
    }

    /// Whether both ends of the link have proven to each other that they are there.
    pub(crate) fn is_proven(&self, from: u16, to: u16) -> bool {
        self.proven.get(&(from, to)) == Some(&(self.life(from), self.life(to)))
    }

    /// Whether a frame has arrived.
    pub(crate) fn has_arrived(&self, heard: &Heard) -> bool {
        self.under_way
            .front()
            .is_none_or(|(_, next)| heard.number < *next)
    }

    /// Whether the receiver of a frame would still know its nonces: both ends are as they were, as far as it has heard.
    pub(crate) fn is_of_now(&self, heard: &Heard) -> bool {
        let Heard {
            from, to, lives, ..
        } = heard;
        lives.1 == self.life(*to)
            && self.learned.get(&(*from, *to)) == Some(lives)
            && !self.outdated.contains(&heard.number)
    }

    /// Does what is next, unless that is later than `until`; whether something was.
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

    /// Runs on until `until`.
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

    /// Hands bytes to a relay, and lets it answer; how many frames that makes it send.
    pub(crate) fn give(&mut self, to: u16, port: Port, wire: &[u8]) -> usize {
        let now = self.now;
        self.relay(to).handle_bytes(now, port, wire);
        self.drain(to)
    }

    fn drain(&mut self, index: u16) -> usize {
        let now = self.now;
        let mut frame = [0; MAX_FRAME];
        let mut sent = 0;
        while let Some(transmit) = self.relay(index).poll_transmit(now, &mut frame) {
            sent += 1;
            let wire = frame[..transmit.len].to_vec();
            let to = match transmit.port {
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
        sent
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

    /// A frame goes on its way.
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

    /// Where the relays were told to fly, and for which target, to the bit.
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

/// Relay `index` of `of`, switched on with an epoch at a time.
pub(crate) fn relay(of: u16, index: u16, wiring: Wiring, start: (u32, Instant)) -> Relay {
    started(of, index, wiring, start, None)
}

/// The same of a relay that has stored an upload, if it has.
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
