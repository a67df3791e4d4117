//! Frame-level simulation of relays on one channel, for cases that the simulator does not cover.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::MAX_FRAME;
use uav_relay::{
    Auth, Event, Ground, Identity, Instant, Key, Mission, Port, Relay, Settings, Wiring,
};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission::mission as of_scenario;

/// Time step and duration of a frame, ms.
const STEP_MS: u64 = 10;

pub(crate) const KEY: [u8; 32] = [7; 32];

pub(crate) fn auth(key: [u8; 32], epoch: u32) -> Option<Auth> {
    let key = Key::new(key);
    Some(Auth { key, epoch })
}

pub(crate) struct Air {
    pub(crate) relays: Vec<Relay>,
    /// True for relays that are switched off.
    pub(crate) off: Vec<bool>,
    pub(crate) ground: Option<Ground>,
    /// Share of frames that each receiver loses.
    pub(crate) loss: f64,
    pub(crate) now: Instant,
    /// Events, with the index (from 0) of the relay that raised them.
    pub(crate) told: Vec<(usize, Event)>,
    /// Withheld frames of the ground; `withheld` selects them.
    pub(crate) recorded: Vec<Vec<u8>>,
    pub(crate) withheld: fn(&[u8]) -> bool,
    /// Frames on the air with the sender's index, `usize::MAX` for other senders.
    flying: Vec<(usize, Vec<u8>)>,
    rng: ChaCha8Rng,
}

impl Air {
    pub(crate) fn new(relays: Vec<Relay>, loss: f64, seed: u64) -> Self {
        Self {
            off: vec![false; relays.len()],
            relays,
            ground: None,
            loss,
            now: Instant::ZERO,
            told: Vec::new(),
            recorded: Vec::new(),
            withheld: |_| false,
            flying: Vec::new(),
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    /// Returns a chain with keys and epochs from `auth`, by index from 1.
    pub(crate) fn of(mission: &Mission, auth: impl Fn(u16) -> Option<Auth>, loss: f64) -> Self {
        let relays = (1..=mission.relays())
            .map(|index| relay(mission, index, auth(index), Instant::ZERO))
            .collect();
        Self::new(relays, loss, 1)
    }

    pub(crate) fn join(&mut self, relay: Relay) -> usize {
        self.relays.push(relay);
        self.off.push(false);
        self.relays.len() - 1
    }

    pub(crate) fn run(&mut self, seconds: u64) {
        for _ in 0..seconds * 1_000 / STEP_MS {
            self.now = Instant::from_micros(self.now.as_micros() + 1_000 * STEP_MS);
            self.step();
        }
    }

    fn step(&mut self) {
        let now = self.now;
        let count = self.relays.len();
        for (from, bytes) in std::mem::take(&mut self.flying) {
            for (at, relay) in self.relays.iter_mut().enumerate() {
                if at != from && !self.off[at] && !self.rng.random_bool(self.loss) {
                    relay.handle_bytes(now, Port::Shared, &bytes);
                }
            }
            if from != usize::MAX
                && let Some(ground) = &mut self.ground
                && !self.rng.random_bool(self.loss)
            {
                ground.handle_bytes(&bytes);
            }
        }
        for at in 0..count {
            if self.off[at] {
                continue;
            }
            let relay = &mut self.relays[at];
            if relay.poll_timeout().is_some_and(|due| due <= now) {
                relay.handle_timeout(now);
            }
            let mut frame = [0; MAX_FRAME];
            relay.persist(|_| true);
            while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
                self.flying.push((at, frame[..transmit.len].to_vec()));
            }
            while let Some(event) = relay.poll_event() {
                self.told.push((at, event));
            }
            assert!(relay.poll_timeout().is_none_or(|due| due > now), "it spins");
        }
        if let Some(ground) = &mut self.ground {
            ground.handle_timeout(now);
            let mut frame = [0; MAX_FRAME];
            while let Some(len) = ground.poll_transmit(&mut frame) {
                let bytes = frame[..len].to_vec();
                if (self.withheld)(&bytes) {
                    self.recorded.push(bytes);
                } else {
                    self.flying.push((usize::MAX, bytes));
                }
            }
        }
    }

    /// Sends `bytes` as an unknown sender.
    pub(crate) fn play(&mut self, bytes: &[u8]) {
        self.flying.push((usize::MAX, bytes.to_vec()));
    }

    /// Returns the relay index of each occurrence of `event`.
    pub(crate) fn told(&self, event: Event) -> Vec<usize> {
        let told = self.told.iter().filter(|(_, told)| *told == event);
        told.map(|(by, _)| *by).collect()
    }
}

pub(crate) fn settings(auth: Option<Auth>) -> Settings {
    Settings {
        wiring: Wiring::Shared,
        auth,
        ..Settings::default()
    }
}

pub(crate) fn relay(mission: &Mission, index: u16, auth: Option<Auth>, now: Instant) -> Relay {
    let identity = Identity { network: 7, index };
    let seed = u32::from(index) + u32::try_from(now.as_micros() / 1_000).unwrap();
    Relay::new(*mission, identity, settings(auth), seed, now).unwrap()
}

pub(crate) fn mission(relays: u16) -> Mission {
    of_scenario(&Scenario::default(), relays, 1e-4).unwrap().0
}
