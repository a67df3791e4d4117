//! Checks of the frames that the relay under test sends: valid, from this relay, to an existing node.

use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::wire::message::Message;
use uav_relay::{Port, Relay, Settings, Wiring};

use super::number::number_of;

/// Maximum difference between the node numbers of sender and receiver on a shared channel.
const NEAR: u16 = 4;

/// Network number of every fuzzed relay.
pub const NETWORK: u16 = 9;

/// Checker of a relay's frames. It keeps the numbers, such as the pass number, that the last frames had.
///
/// A pass is a message along the chain and back.
#[derive(Clone, Debug)]
pub(super) struct Frames {
    /// Node number of the relay under test.
    node: u16,
    /// Number of relays in the mission.
    all: u16,
    pub(super) sent: u32,
    pub(super) number: u16,
    /// Session number in the relay's last fence (collision-guard message), 0 for none.
    pub(super) association: u16,
    pub(super) asked: u16,
}

impl Frames {
    pub(super) const fn new(node: u16, all: u16) -> Self {
        Self {
            node,
            all,
            sent: 0,
            number: 0,
            association: 0,
            asked: 0,
        }
    }

    /// Checks a frame: the frame must be valid, from this relay, and to a neighbour at `port`.
    pub(super) fn look(&mut self, relay: &Relay, settings: &Settings, port: Port, bytes: &[u8]) {
        let mut deframer = Deframer::new();
        let mut frames = 0;
        for &byte in bytes {
            let Some(plain) = deframer.push(byte) else {
                continue;
            };
            frames += 1;
            let Ok(Ok(opened)) = plain.map(frame::open) else {
                unreachable!("what is sent is no frame: {bytes:?}");
            };
            let header = opened.header;
            let signs = settings.auth.is_some();
            assert_eq!(opened.tag.is_some(), signs, "{opened:?}");
            assert_eq!((header.network, header.sender), (NETWORK, self.node));
            assert_eq!(header.counter, self.sent, "the counter of frames");
            let far = match settings.wiring {
                Wiring::Pair => 1,
                Wiring::Shared => NEAR,
            };
            let off = self.node.abs_diff(header.destination) <= far;
            let upstream = off && header.destination < self.node;
            let downstream = off && header.destination > self.node;
            // A relay also sends frames to a duplicate of its own index, but only unsigned ones.
            let own = header.destination == self.node && !signs;
            let right = own
                || match (settings.wiring, port) {
                    (Wiring::Pair, Port::Upstream) => upstream,
                    (Wiring::Pair, Port::Downstream) => downstream,
                    (Wiring::Shared, Port::Shared) => upstream || downstream,
                    _ => false,
                };
            assert!(right, "{header:?} through {port:?}");
            let config = relay.mission().config();
            // With a key the relay informs Tx and Rx of its stored mission.
            let all = if signs {
                0..=self.all + 1
            } else {
                1..=self.all
            };
            let there = all.contains(&header.destination);
            assert!(there, "{header:?} to nobody");
            if opened.handshake {
                continue;
            }
            let Ok(message) = Message::decode(opened.body) else {
                unreachable!("what is sent is no message: {opened:?}");
            };
            if let Message::Sweep(sweep) = &message {
                let inside = |place: &f32| (0.0..=config.distance_m).contains(place);
                assert!(sweep.reaches.iter().all(inside), "{sweep:?}");
            }
            self.number = number_of(&message).unwrap_or(self.number);
            if let Message::Hello(hello) = &message {
                self.asked = hello.offer_number;
            }
            if let Message::Fence { fence, .. } = &message {
                self.association = fence.association;
            }
        }
        assert_eq!(frames, 1, "{bytes:?}");
        self.sent += 1;
    }
}
