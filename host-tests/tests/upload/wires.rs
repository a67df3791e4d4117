//! Relays in a row on wires, with ground stations at one end or both.

use std::collections::VecDeque;

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use uav_relay::MAX_FRAME;
use uav_relay::ground::Progress;
use uav_relay::{
    Auth, Event, FlownMission, Ground, Identity, Key, Placement, Port, Relay, Settings, Wiring,
};

use super::*;

const NETWORK: u16 = 7;

/// Interval of all main loops, ms; frames arrive one interval after they are sent.
const TURN_MS: u64 = 5;

/// Distance that a drone flies in an interval, m along each axis.
const MOST_M: f32 = 0.05;

fn auth() -> Auth {
    Auth {
        key: Key::new([7; 32]),
        epoch: 1,
    }
}

/// Frame in transit: receiver, port and bytes.
struct Letter {
    to: usize,
    port: Port,
    bytes: Vec<u8>,
}

/// Chain on lossy wires.
pub(crate) struct Wires {
    relays: Vec<Relay>,
    /// Ground stations at the transmitter and the receiver.
    pub(crate) grounds: [Option<Ground>; 2],
    letters: VecDeque<Letter>,
    rng: ChaCha8Rng,
    pub(crate) loss: f64,
    pub(crate) now: Instant,
    /// Positions of guarded relays' drones.
    places: Vec<Placement>,
    pub(crate) events: Vec<Vec<Event>>,
}

impl Wires {
    /// Creates relays loaded with `base`, each with its own `settings`.
    pub(crate) fn new(base: Mission, seed: u64, settings: impl Fn(u16) -> Settings) -> Self {
        let relays: Vec<Relay> = (1..=base.relays())
            .map(|index| {
                let identity = Identity {
                    network: NETWORK,
                    index,
                };
                let settings = Settings {
                    wiring: Wiring::Pair,
                    auth: Some(auth()),
                    ..settings(index)
                };
                let seed = seed as u32 ^ u32::from(index) << 16;
                Relay::new(base, identity, settings, seed, Instant::ZERO).unwrap()
            })
            .collect();
        Self {
            events: vec![Vec::new(); relays.len()],
            relays,
            grounds: [None, None],
            letters: VecDeque::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
            loss: 0.0,
            places: Vec::new(),
            now: Instant::ZERO,
        }
    }

    /// Uploads `upload` from the ground station at `end`, which knows `base`.
    pub(crate) fn upload(&mut self, base: &Mission, end: Side, upload: Upload) {
        let now = self.now;
        let ground = self.grounds[end as usize]
            .get_or_insert_with(|| Ground::new(base, end, NETWORK, Wiring::Pair, auth()));
        ground.upload(now, upload).unwrap();
    }

    /// Requests the mission in flight from the ground station at `end`, which knows `base`.
    pub(crate) fn ask_flown(&mut self, base: &Mission, end: Side) {
        let now = self.now;
        let ground = self.grounds[end as usize]
            .get_or_insert_with(|| Ground::new(base, end, NETWORK, Wiring::Pair, auth()));
        ground.ask_flown(now);
    }

    pub(crate) fn flown(&self, end: Side) -> Option<FlownMission> {
        self.grounds[end as usize].as_ref()?.flown().copied()
    }

    pub(crate) fn progress(&self, end: Side) -> Progress {
        let ground = self.grounds[end as usize].as_ref();
        ground.map_or(Progress::Idle, Ground::progress)
    }

    pub(crate) fn versions(&self) -> Vec<u16> {
        self.relays.iter().map(Relay::version).collect()
    }

    pub(crate) fn relay(&self, index: usize) -> &Relay {
        &self.relays[index - 1]
    }

    /// Places drones that follow their setpoints from then on.
    pub(crate) fn stand(&mut self, place: impl Fn(u16) -> Placement) {
        self.places = (1..)
            .zip(&self.relays)
            .map(|(index, _)| place(index))
            .collect();
    }

    /// Runs all main loops once.
    pub(crate) fn turn(&mut self) {
        self.now = Instant::from_micros(self.now.as_micros() + 1_000 * TURN_MS);
        let (now, last) = (self.now, self.relays.len() + 1);
        for Letter { to, port, bytes } in std::mem::take(&mut self.letters) {
            if self.rng.random_bool(self.loss) {
                continue;
            }
            match to {
                0 => self.grounds[0]
                    .iter_mut()
                    .for_each(|it| it.handle_bytes(&bytes)),
                to if to == last => self.grounds[1]
                    .iter_mut()
                    .for_each(|it| it.handle_bytes(&bytes)),
                to => self.relays[to - 1].handle_bytes(now, port, &bytes),
            }
        }
        let mut frame = [0; MAX_FRAME];
        for (ground, to, port) in [(0, 1, Port::Upstream), (1, last - 1, Port::Downstream)] {
            let Some(ground) = &mut self.grounds[ground] else {
                continue;
            };
            ground.handle_timeout(now);
            while let Some(len) = ground.poll_transmit(&mut frame) {
                let bytes = frame[..len].to_vec();
                self.letters.push_back(Letter { to, port, bytes });
            }
        }
        for (at, relay) in (1..).zip(&mut self.relays) {
            if let Some(place) = self.places.get_mut(at - 1) {
                let to = relay.setpoint().unwrap_or(*place);
                let step = |is: f32, to: f32| is + (to - is).clamp(-MOST_M, MOST_M);
                *place = Placement {
                    x_m: step(place.x_m, to.x_m),
                    y_m: step(place.y_m, to.y_m),
                    altitude_m: step(place.altitude_m, to.altitude_m),
                };
                relay.handle_position(now, now, *place);
            }
            relay.handle_timeout(now);
            relay.persist(|_| true);
            while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
                let (to, port) = match transmit.port {
                    Port::Upstream => (at - 1, Port::Downstream),
                    _ => (at + 1, Port::Upstream),
                };
                let bytes = frame[..transmit.len].to_vec();
                self.letters.push_back(Letter { to, port, bytes });
            }
            while let Some(event) = relay.poll_event() {
                self.events[at - 1].push(event);
            }
        }
    }

    /// Runs until `over`, for at most `most_s` seconds. Returns true if it holds.
    pub(crate) fn until(&mut self, most_s: u64, mut over: impl FnMut(&Self) -> bool) -> bool {
        for _ in 0..most_s * 1_000 / TURN_MS {
            self.turn();
            if over(self) {
                return true;
            }
        }
        false
    }
}
