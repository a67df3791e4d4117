//! Chain of relays on a virtual clock, for any set of features. It needs only `uav-relay`.
#![cfg(not(target_os = "none"))]

use std::collections::VecDeque;

use uav_relay::CRC_32C;
use uav_relay::MAX_FRAME;
use uav_relay::SetupError;
use uav_relay::channel::AirGround;
use uav_relay::{
    Band, Channel, Duration, Identity, Instant, Interference, Interferer, Mission, MissionConfig,
    Port, Profile, Relay, Settings, Wiring,
};

/// Returns the paper's multi-hop mission: 1 km, and an interferer of 80 W, 400 m beside the middle.
///
/// # Panics
/// Never: its numbers are in range.
#[expect(clippy::expect_used, reason = "numbers that are known to be in range")]
pub fn paper(relays: u16) -> Mission {
    Mission::try_new(MissionConfig {
        relays,
        distance_m: 1000.0,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        common: Profile {
            altitude_m: 20.0,
            power_w: 1.0,
        },
        channel: Channel::from_db(2e9, 0.1, 21.0, AirGround::Los).expect("in range"),
        band: Band::at(20.0),
        lateral: Band::NONE,
        interference: Interference::Source(Interferer {
            power_w: 80.0,
            x_m: 500.0,
            y_m: 400.0,
        }),
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: 80.0,
        fitted_gap: 0.0,
        tolerance: 1e-4,
    })
    .expect("in range")
}

const FLIGHT: Duration = Duration::from_millis(2);

/// Radio range on a shared channel: number of relays that a frame reaches in each direction.
const RANGE: usize = 4;

struct Arrival {
    at: Instant,
    relay: usize,
    port: Port,
    bytes: Vec<u8>,
}

/// Simulated chain: relays, frames in transit, and virtual time.
#[derive(Debug)]
pub struct Chain {
    relays: Vec<Relay>,
    silent: Vec<bool>,
    under_way: VecDeque<Arrival>,
    now: Instant,
    said: Vec<u8>,
}

impl core::fmt::Debug for Arrival {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} bytes for {}", self.bytes.len(), self.relay + 1)
    }
}

impl Chain {
    /// Creates and starts the relays of `mission`, all with the same `settings`.
    ///
    /// # Errors
    /// The error of the first relay that rejects the mission or the settings.
    pub fn new(mission: Mission, settings: Settings) -> Result<Self, SetupError> {
        let relay = |index| {
            let identity = Identity { network: 7, index };
            let seed = 1000 + u32::from(index);
            Relay::new(mission, identity, settings, seed, Instant::ZERO)
        };
        let relays = (1..=mission.relays())
            .map(relay)
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            silent: vec![false; relays.len()],
            relays,
            under_way: VecDeque::new(),
            now: Instant::ZERO,
            said: Vec::new(),
        })
    }

    /// Returns the relays in the order of the chain, from Tx.
    pub fn relays(&self) -> &[Relay] {
        &self.relays
    }

    /// Returns the relays, mutable, so that their functions can be called as a firmware calls them.
    pub fn relays_mut(&mut self) -> &mut [Relay] {
        &mut self.relays
    }

    /// Returns the current virtual time.
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Disconnects relay `index`, from 1: it sends and receives nothing more.
    pub fn silence(&mut self, index: usize) {
        if let Some(silent) = self.silent.get_mut(index.wrapping_sub(1)) {
            *silent = true;
        }
    }

    /// Returns the CRC-32C of all bytes that the relays have sent, in order.
    pub fn crc_of_sent(&self) -> u32 {
        CRC_32C.checksum(&self.said)
    }

    /// Runs the chain for `span` of virtual time.
    pub fn fly(&mut self, span: Duration) {
        let end = self.now + span;
        loop {
            self.drain();
            let arrival = self.under_way.front().map(|arrival| arrival.at);
            let due = |(relay, silent): (&Relay, &bool)| relay.poll_timeout().filter(|_| !*silent);
            let timeouts = self.relays.iter().zip(&self.silent).filter_map(due);
            let Some(next) = timeouts.chain(arrival).min().filter(|next| *next <= end) else {
                break;
            };
            self.now = next.max(self.now);
            self.deliver();
            for (relay, silent) in self.relays.iter_mut().zip(&self.silent) {
                if !silent && relay.poll_timeout().is_some_and(|at| at <= self.now) {
                    relay.handle_timeout(self.now);
                }
            }
        }
        self.now = end;
    }

    fn drain(&mut self) {
        let mut frame = [0; MAX_FRAME];
        let count = self.relays.len();
        for (index, (relay, silent)) in self.relays.iter_mut().zip(&self.silent).enumerate() {
            relay.persist(|_| true);
            while let Some(transmit) = relay
                .poll_transmit(self.now, &mut frame)
                .filter(|_| !silent)
            {
                let bytes = frame.get(..transmit.len).unwrap_or_default();
                self.said.extend_from_slice(bytes);
                for (hearer, port) in hearers(index, transmit.port, count) {
                    self.under_way.push_back(Arrival {
                        at: self.now + FLIGHT,
                        relay: hearer,
                        port,
                        bytes: bytes.to_vec(),
                    });
                }
            }
            while relay.poll_event().is_some() {}
        }
    }

    fn deliver(&mut self) {
        let has_come = |arrival: &Arrival| arrival.at <= self.now;
        while self.under_way.front().is_some_and(has_come) {
            let Some(arrival) = self.under_way.pop_front() else {
                return;
            };
            if let (Some(relay), Some(false)) = (
                self.relays.get_mut(arrival.relay),
                self.silent.get(arrival.relay),
            ) {
                relay.handle_bytes(self.now, arrival.port, &arrival.bytes);
            }
        }
    }
}

/// Returns the index, from 0, and the port of each relay that receives a frame.
///
/// The frame is sent on `port` by relay `index` (from 0) of `count` relays.
fn hearers(index: usize, port: Port, count: usize) -> Vec<(usize, Port)> {
    let next = |at: usize, port| (at < count).then_some((at, port));
    match port {
        Port::Upstream => index
            .checked_sub(1)
            .map(|at| (at, Port::Downstream))
            .into_iter()
            .collect(),
        Port::Downstream => next(index + 1, Port::Upstream).into_iter().collect(),
        Port::Shared => (index.saturating_sub(RANGE)..=index + RANGE)
            .filter(|at| *at != index)
            .filter_map(|at| next(at, port))
            .collect(),
    }
}

/// Returns default settings with one radio channel for all relays.
pub fn shared() -> Settings {
    Settings {
        wiring: Wiring::Shared,
        ..Settings::default()
    }
}
