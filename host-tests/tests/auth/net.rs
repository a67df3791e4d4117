//! A chain on a clock of its own, every frame of which can be listened to and added to: what an attacker has.

use std::collections::{BTreeMap, VecDeque};

use host_tests::brief::of_link;
use host_tests::reference::Link;
use uav_relay::wire::frame::MAX_FRAME;
use uav_relay::{
    Auth, Duration, Event, Identity, Instant, Key, Mission, Port, Relay, Settings, Stats, Wiring,
};

pub(crate) const NETWORK: u16 = 7;
pub(crate) const KEY: [u8; 32] = *b"the members of network 7 have it";

/// From one relay to the next.
const ON_THE_WAY: Duration = Duration::from_millis(10);

pub(crate) fn mission(relays: u16) -> Mission {
    of_link(&Link::paper(usize::from(relays)), 1e-4).unwrap().0
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
    /// The leader has the chain agree again.
    Restart,
}

#[derive(Clone)]
pub(crate) struct Net {
    pub(crate) relays: Vec<Relay>,
    /// How often each relay has been switched on; its epoch.
    pub(crate) lives: Vec<u32>,
    pub(crate) now: Instant,
    pub(crate) heard: Vec<Heard>,
    /// Messages that genuine frames have brought, for each relay since it was switched on.
    pub(crate) genuine: Vec<u32>,
    /// Links (from, to) on which a message has been taken since both ends were switched on.
    pub(crate) proven: BTreeMap<(u16, u16), (u32, u32)>,
    /// For each of them, the sender's life that the receiver has heard of last, and its own at that time.
    learned: BTreeMap<(u16, u16), (u32, u32)>,
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
            lives: vec![1; relays.into()],
            now: Instant::ZERO,
            heard: Vec::new(),
            genuine: vec![0; relays.into()],
            proven: BTreeMap::new(),
            learned: BTreeMap::new(),
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

    pub(crate) fn life(&self, index: u16) -> u32 {
        self.lives[usize::from(index) - 1]
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
        lives.1 == self.life(*to) && self.learned.get(&(*from, *to)) == Some(lives)
    }

    /// Does what is next, unless that is later than `until`; whether something was.
    pub(crate) fn step(&mut self, until: Instant) -> bool {
        let wake = (1..=self.len())
            .filter_map(|index| Some((self.relay(index).poll_timeout()?, index)))
            .min();
        let arrives = self.under_way.front().map(|(at, _)| *at);
        let does = self.deeds.front().map(|(at, _)| *at);
        let next = [arrives, does, wake.map(|(at, _)| at)]
            .into_iter()
            .flatten()
            .min();
        let Some(next) = next.filter(|at| *at <= until) else {
            return false;
        };
        self.now = self.now.max(next);
        self.happenings += 1;
        if does == Some(next) {
            self.act();
        } else if arrives == Some(next) {
            self.deliver();
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
            Deed::Restart => {
                let now = self.now;
                self.relay(1).restart(now);
                self.drain(1);
            }
        }
    }

    pub(crate) fn reboot(&mut self, index: u16, epoch: u32) {
        let place = usize::from(index) - 1;
        self.lives[place] = epoch;
        self.genuine[place] = 0;
        let now = self.now;
        *self.relay(index) = relay(self.len(), index, self.wiring, (epoch, now));
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
            ..
        } = self.heard[heard].clone();
        self.learned.insert((from, to), (lives.0, self.life(to)));
        let before = self.stats(to).received;
        self.give(to, self.port(from, to), &wire);
        let messages = self.stats(to).received - before;
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
            let lives = (self.life(index), self.life(to));
            let number = self.heard.len();
            self.under_way.push_back((now + ON_THE_WAY, number));
            self.heard.push(Heard {
                from: index,
                to,
                lives,
                number,
                wire,
            });
        }
        while let Some(event) = self.relay(index).poll_event() {
            assert!(
                !matches!(event, Event::NeighbourLost(_)),
                "{index}: {event:?} at {now:?}"
            );
        }
        sent
    }

    /// Where the relays were told to fly, and for which target, to the bit.
    pub(crate) fn bits(&self) -> Vec<Option<(u32, u32, u32)>> {
        self.relays
            .iter()
            .map(|relay| {
                let (place, target) = (relay.setpoint()?, relay.target()?);
                Some((
                    place.x_m.to_bits(),
                    place.altitude_m.to_bits(),
                    target.to_bits(),
                ))
            })
            .collect()
    }
}

/// Relay `index` of `of`, switched on with an epoch at a time.
pub(crate) fn relay(of: u16, index: u16, wiring: Wiring, (epoch, now): (u32, Instant)) -> Relay {
    let settings = Settings {
        wiring,
        auth: Some(Auth {
            key: Key::new(KEY),
            epoch,
        }),
        ..Settings::default()
    };
    let identity = Identity {
        network: NETWORK,
        index,
    };
    let seed = u32::from(index) << 8 | epoch;
    Relay::new(mission(of), identity, settings, seed, now).unwrap()
}
