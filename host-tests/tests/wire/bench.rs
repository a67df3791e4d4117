//! Relay without a key, the frames of its neighbours, and all that it sends.

use std::iter;
use std::ops::{Deref, DerefMut};

use host_tests::fixtures::{self, NETWORK, paper};
use host_tests::make;
use uav_relay::wire::digest::digest;
use uav_relay::wire::frame::{self, MAX_FRAME};
use uav_relay::{
    Duration, Event, Instant, Mission, MissionConfig, Port, Relay, Settings, Stats, Wiring,
};
use uav_relay_fuzz::counted::named;

use super::message::{WireMessage, plain_of, wire};

/// Test bench: a relay without a key, and the current time.
#[derive(Clone, Debug)]
pub(crate) struct Bench {
    relay: Relay,
    /// Node number of the relay under test.
    pub(crate) own: u16,
    /// Digest of the mission that the relay has before flight.
    pub(crate) mission: u16,
    pub(crate) now: Instant,
}

impl Deref for Bench {
    type Target = Relay;

    fn deref(&self) -> &Relay {
        &self.relay
    }
}

impl DerefMut for Bench {
    fn deref_mut(&mut self) -> &mut Relay {
        &mut self.relay
    }
}

impl Bench {
    /// Creates relay `own` of `relays` relays in the paper's scenario.
    pub(crate) fn new(own: u16, relays: u16, wiring: Wiring) -> Self {
        Self::of(paper(relays), own, wiring)
    }

    pub(crate) fn of(mission: MissionConfig, own: u16, wiring: Wiring) -> Self {
        let settings = Settings {
            wiring,
            ..Settings::default()
        };
        Self::with(mission, own, settings)
    }

    pub(crate) fn with(mission: MissionConfig, own: u16, settings: Settings) -> Self {
        let mission = Mission::try_new(mission).unwrap();
        Self {
            relay: fixtures::relay(mission, own, settings),
            own,
            mission: digest(&mission),
            now: Instant::ZERO,
        }
    }

    /// Delivers a message of the neighbour at `port`. Returns the ports and messages that the relay then sends.
    pub(crate) fn receive(
        &mut self,
        port: Port,
        message: &WireMessage,
    ) -> Vec<(Port, WireMessage)> {
        let sender = match port {
            Port::Upstream => self.own - 1,
            _ => self.own + 1,
        };
        self.receive_from(sender, port, message)
    }

    /// Delivers a message of node `sender`. Returns the ports and messages that the relay then sends.
    pub(crate) fn receive_from(
        &mut self,
        sender: u16,
        port: Port,
        message: &WireMessage,
    ) -> Vec<(Port, WireMessage)> {
        let bytes = frame_between(sender, self.own, message);
        self.relay.handle_bytes(self.now, port, &bytes);
        self.sent()
    }

    /// Returns the ports and messages that the relay sends now, without index claims.
    pub(crate) fn sent(&mut self) -> Vec<(Port, WireMessage)> {
        let mut out = self.sent_with_claims();
        out.retain(|(_, message)| !message.is("Claim"));
        out
    }

    /// Returns the ports and messages that the relay sends now. Checks that each is valid, and that the next timeout
    /// is in the future.
    pub(crate) fn sent_with_claims(&mut self) -> Vec<(Port, WireMessage)> {
        let mut out = Vec::new();
        let mut buffer = [0; MAX_FRAME];
        self.relay.persist(|_| true);
        while let Some(transmit) = self.relay.poll_transmit(self.now, &mut buffer) {
            let plain = plain_of(&buffer[..transmit.len]);
            let read = frame::decode(&plain);
            let (header, _) = read.unwrap_or_else(|error| panic!("{error}: {plain:02x?}"));
            assert_eq!(header.network, NETWORK);
            let message = WireMessage::read(&plain[10..plain.len() - 4]).unwrap();
            out.push((transmit.port, message));
        }
        let next = self.relay.poll_timeout();
        assert!(next.is_none_or(|next| next > self.now));
        out
    }

    /// Advances the time by a millisecond. Returns the ports and messages that the relay then sends.
    pub(crate) fn advance_1_ms(&mut self) -> Vec<(Port, WireMessage)> {
        self.now = self.now + Duration::from_millis(1);
        self.relay.handle_timeout(self.now);
        self.sent()
    }

    /// Advances the time to the relay's next timeout. Returns the ports and messages that it then sends.
    pub(crate) fn advance_to_timeout(&mut self) -> Vec<(Port, WireMessage)> {
        self.now = self.relay.poll_timeout().unwrap();
        self.relay.handle_timeout(self.now);
        self.sent()
    }

    /// Advances the time by a second. Returns the ports and messages that the relay sends meanwhile.
    pub(crate) fn advance_1_s(&mut self) -> Vec<(Port, WireMessage)> {
        let mut out = self.sent();
        out.extend((0..1000).flat_map(|_| self.advance_1_ms()));
        out
    }

    pub(crate) fn events(&mut self) -> Vec<Event> {
        events(&mut self.relay)
    }

    /// Returns the names of the relay's counters of received frames and messages that are above zero.
    pub(crate) fn counted(&self) -> Vec<&'static str> {
        counted(self.relay.stats())
    }
}

pub(crate) fn events(relay: &mut Relay) -> Vec<Event> {
    iter::from_fn(|| relay.poll_event()).collect()
}

/// Encodes a message of node `sender` to node `destination` as a frame on the wire.
pub(crate) fn frame_between(sender: u16, destination: u16, message: &WireMessage) -> Vec<u8> {
    let header = make::header(sender, destination, 0);
    wire(header, message.body())
}

/// Names of the statistics counters of received frames. Each received frame increments exactly one of them.
pub(crate) const OF_FRAMES: [&str; 9] = [
    "received",
    "overheard",
    "oversized",
    "truncated",
    "crc",
    "version",
    "malformed",
    "foreign",
    "misaddressed",
];

/// Names of the statistics counters of received messages. `unsigned` counts only at a relay without a key.
const OF_MESSAGES: [&str; 6] = [
    "repeated",
    "unsigned",
    "misdirected",
    "mission",
    "view",
    "stale",
];

/// Returns the names and values of the counters in [`OF_FRAMES`]. Each received frame increments exactly one of them.
pub(crate) fn of_frames(stats: &Stats) -> Vec<(&'static str, u32)> {
    let mut all = named(stats).to_vec();
    all.retain(|(name, _)| OF_FRAMES.contains(name));
    all
}

/// Returns the names of the counters of received frames and messages that are above zero.
pub(crate) fn counted(stats: &Stats) -> Vec<&'static str> {
    let mut names: Vec<&str> = named(stats)
        .into_iter()
        .filter(|(name, count)| {
            *count > 0 && (OF_FRAMES.contains(name) || OF_MESSAGES.contains(name))
        })
        .map(|(name, _)| name)
        .collect();
    names.sort_unstable();
    names
}
