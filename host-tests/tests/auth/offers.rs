//! Forged and replayed offers of newer missions.

use host_tests::fixtures::{self, NETWORK, mission};
use rand::RngExt;
use rand::seq::IndexedRandom;
use uav_relay::Upload;
use uav_relay::ground::Progress;
use uav_relay::{Instant, Port, Settings, Side, Wiring};

use super::frames::{HEADER, Plain, SIGNED, TAG, nonce, plain};
use super::kinds::{Attacker, Kind, raised};
use super::net::{Net, RecordedFrame, ScheduledEvent, newer};

/// Message type of a mission offer: the first byte of its body.
const OFFER: u8 = 14;

pub(crate) fn is_offer(frame: &Plain) -> bool {
    !frame.is_handshake() && frame.0.get(HEADER) == Some(&OFFER)
}

/// Returns the message body of an offer of a mission that was never uploaded.
fn offered(relays: u16, version: u16) -> Vec<u8> {
    let mut body = [0; Upload::LENGTH];
    let len = newer(&mission(relays), version).encode(&mut body).unwrap();
    assert_eq!((len, body[0]), (Upload::LENGTH, OFFER));
    // The number of the hello that it answers is not part of the stored upload.
    [&body[..], &version.to_le_bytes()].concat()
}

impl Attacker {
    /// Returns the relay to attack with a recorded frame whose receiver was node `to`.
    ///
    /// Returns `None` if the frame is not for a relay.
    pub(crate) fn target(&mut self, net: &Net, kind: Kind, to: u16) -> Option<u16> {
        if kind == Kind::OfferReplayed && self.rng.random_bool(0.5) {
            return Some(self.rng.random_range(1..=net.len()));
        }
        Some(to).filter(|to| net.is_relay(*to))
    }

    /// Changes one random byte of the frame after its addresses.
    pub(crate) fn altered(&mut self, mut frame: Plain) -> Plain {
        let at = self.rng.random_range(HEADER - 4..frame.0.len());
        frame.0[at] ^= self.rng.random_range(1..=u8::MAX);
        frame
    }

    /// Returns a forged mission offer, or any message that claims to come from the ground station.
    ///
    /// The result is sender, receiver and frame; `None` if the frame would be an unchanged copy of a recorded frame.
    pub(crate) fn pretended(
        &mut self,
        net: &Net,
        kind: Kind,
        heard: &RecordedFrame,
    ) -> Option<(u16, u16, Plain)> {
        let relays = net.len();
        let ends = [0, relays + 1];
        let far = *[1, 4, relays].choose(&mut self.rng)?;
        let off = self.rng.random_range(1..=far);
        let (from, to) = if kind == Kind::FromGround || self.rng.random() {
            let end = *ends.choose(&mut self.rng)?;
            (end, if end == 0 { off } else { end - off })
        } else {
            let to = self.rng.random_range(1..=relays);
            let before = self.rng.random();
            (
                if before {
                    to.saturating_sub(off)
                } else {
                    to + off
                },
                to,
            )
        };
        let mut recorded = plain(&heard.wire);
        let counter = self.counter(&recorded);
        let body = if kind == Kind::FromGround {
            if self.rng.random() {
                recorded.set(0, 0x1000 | from);
                recorded.set(2, recorded.flags() | to);
                // An unchanged frame would be a replay.
                let own = heard.from == from && heard.to == to;
                return Some((from, to, recorded)).filter(|_| !own);
            }
            self.messages.choose(&mut self.rng)?.0.clone()
        } else {
            offered(relays, self.rng.random_range(1..=5))
        };
        let which = self.rng.random_range(0..3);
        let flags = if which == 0 { 0 } else { SIGNED };
        let mut frame = Plain::new(NETWORK, from, to, flags, counter);
        frame.0.extend(body);
        let frame = match which {
            0 => frame,
            1 => {
                frame.0.extend(self.rng.random::<[u8; TAG]>());
                frame
            }
            _ => {
                let nonces =
                    [net.start_count(from), net.start_count(to)].map(|start| nonce(start, 1));
                frame.signed(&self.rng.random(), nonces)
            }
        };
        Some((from, to, frame))
    }
}

/// Checks that a chain without a key accepts no mission, neither from the ground nor from neighbours.
#[test]
fn a_chain_without_tags_accepts_no_offer() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let settings = Settings {
            wiring,
            ..Settings::default()
        };
        let mut relay = fixtures::relay(mission(3), 2, settings);
        for (from, raises) in [
            (1, "unsigned"),
            (3, "unsigned"),
            (0, "misaddressed"),
            (4, "misaddressed"),
        ] {
            let port = match wiring {
                Wiring::Shared => Port::Shared,
                Wiring::Pair if from < 2 => Port::Upstream,
                Wiring::Pair => Port::Downstream,
            };
            for version in 1..=3 {
                let mut frame = Plain::new(NETWORK, from, 2, 0, version.into());
                frame.0.extend(offered(3, version));
                let before = *relay.stats();
                relay.handle_bytes(Instant::ZERO, port, &frame.wire());
                let mut after = *relay.stats();
                // Any message of a neighbour is a sign of life.
                let heard = after.received - before.received;
                assert_eq!(heard, u32::from(raises == "unsigned"));
                after.received = before.received;
                assert_eq!(raised(&before, &after), Some(raises), "{from} {wiring:?}");
                assert_eq!((relay.version(), relay.upload()), (0, None));
            }
        }
        let upload = newer(&mission(3), 1);
        assert!(relay.handle_upload(Instant::ZERO, &upload).is_err());
    }
}

/// Checks that recorded, altered or forged answers do not complete an upload at the ground station.
#[test]
fn the_ground_station_ignores_forged_frames() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let events = [(6_000, ScheduledEvent::Upload(Side::Upstream, 1))];
        let mut net = Net::new(8, wiring, &events);
        net.run(Instant::from_millis(12_000));
        let flown = net.grounds[0].progress();
        assert!(matches!(flown, Progress::Flown { by: 1, .. }), "{flown:?}");
        let told: Vec<RecordedFrame> = net
            .recorded
            .iter()
            .filter(|heard| heard.to == 0)
            .cloned()
            .collect();
        assert!(told.len() >= 3);
        // The newer mission has not reached any relay.
        let mut ground = net.grounds[0].clone();
        ground.upload(net.now, newer(&mission(8), 2)).unwrap();
        let mut attacker = Attacker::new(3);
        let (before, mut attacks) = (ground.refused(), 0);
        for _ in 0..2_000 {
            for heard in &told {
                let recorded = plain(&heard.wire);
                let altered = attacker.altered(recorded.clone());
                for frame in [recorded, altered] {
                    ground.handle_bytes(&frame.wire());
                    attacks += 1;
                    assert_eq!(ground.refused() - before, attacks);
                    assert_eq!(ground.progress(), Progress::Offering);
                }
            }
        }
    }
}
