//! Counters and epochs at their limits, by frames that require the key.

use host_tests::bench;
use host_tests::fixtures::{NETWORK, mission};
use host_tests::make;
use uav_relay::SetupError;
use uav_relay::{Instant, Port, Relay, Settings, Stats, Wiring};

use super::frames::{Plain, SIGNED, handshake, nonce, plain};
use super::kinds::raised;
use super::net::{KEY, relay};

const NOW: Instant = Instant::from_millis(5);

/// Link under test: relay 2 of 3, and a simulated relay 1 that has the key.
struct Link {
    relay: Relay,
    nonces: [u64; 2],
}

impl Link {
    /// Creates a link whose two ends have authenticated each other.
    fn new() -> Self {
        let mut relay = relay(3, 2, Wiring::Pair, (4, Instant::ZERO));
        let mut sent = bench::sent(&mut relay, NOW).into_iter();
        let upstream = sent.rfind(|(port, _)| *port == Port::Upstream);
        let own = upstream.map(|(_, wire)| plain(&wire).nonces()[0]);
        let nonces = [nonce(9, 1), own.unwrap()];
        assert_eq!(nonces[1] >> 32, 4, "the epoch");
        let mut link = Self { relay, nonces };
        assert_eq!(link.handshake(0, nonces), Some("handshakes"));
        link
    }

    fn deliver(&mut self, frame: &Plain) -> Option<&'static str> {
        let before: Stats = *self.relay.stats();
        self.relay.handle_bytes(NOW, Port::Upstream, &frame.wire());
        raised(&before, self.relay.stats())
    }

    fn handshake(&mut self, counter: u32, nonces: [u64; 2]) -> Option<&'static str> {
        let handshake = handshake((NETWORK, 1, 2), counter, nonces, false);
        self.deliver(&handshake.signed(&KEY, nonces))
    }

    /// Sends relay 2 a signed heartbeat with the frame counter `counter`.
    ///
    /// Returns the name of the statistics counter that relay 2 increments, if it increments exactly one.
    fn send_with_counter(&mut self, counter: u32) -> Option<&'static str> {
        let mut frame = Plain::new(NETWORK, 1, 2, SIGNED, counter);
        frame.0.extend([3, 0, 0, 0, 0, 0, 0]);
        let nonces = self.nonces;
        self.deliver(&frame.signed(&KEY, nonces))
    }
}

#[test]
fn a_counter_63_behind_is_accepted_once_and_64_never() {
    let mut link = Link::new();
    for (counter, raises) in [
        (1_000, "received"),
        (1_000, "replayed"),
        (937, "received"),
        (937, "replayed"),
        (936, "replayed"),
        (0, "replayed"),
        (999, "received"),
        (1_001, "received"),
        (938, "received"),
        (937, "replayed"),
    ] {
        assert_eq!(link.send_with_counter(counter), Some(raises), "{counter}");
    }
}

#[test]
fn the_last_counter_is_never_accepted_nor_used() {
    let mut link = Link::new();
    assert_eq!(link.send_with_counter(u32::MAX), Some("replayed"));
    assert_eq!(link.send_with_counter(u32::MAX - 1), Some("received"));
    assert_eq!(link.send_with_counter(u32::MAX), Some("replayed"));
    assert_eq!(link.send_with_counter(0), Some("replayed"));
    // A new session starts at 0.
    link.nonces[0] = nonce(10, 1);
    assert_eq!(link.handshake(0, link.nonces), Some("handshakes"));
    assert_eq!(link.send_with_counter(1), Some("received"));
}

#[test]
fn a_handshakes_counter_is_used_up_too() {
    let mut link = Link::new();
    assert_eq!(link.send_with_counter(0), Some("replayed"));
    assert_eq!(link.send_with_counter(7), Some("received"));
    assert_eq!(link.handshake(7, link.nonces), Some("replayed"));
    assert_eq!(link.handshake(8, link.nonces), Some("handshakes"));
}

#[test]
fn nonces_only_increase() {
    let mut link = Link::new();
    let own = link.nonces[1];
    for (theirs, raises) in [
        (nonce(9, 2), "handshakes"),
        (nonce(9, 1), "replayed"),
        (nonce(8, u32::MAX), "replayed"),
        (nonce(10, 0), "handshakes"),
        (nonce(9, u32::MAX), "replayed"),
        (nonce(u32::MAX, u32::MAX), "handshakes"),
    ] {
        assert_eq!(
            link.handshake(3, [theirs, own]),
            Some(raises),
            "{theirs:#x}"
        );
    }
    assert_eq!(link.handshake(4, [0, own]), Some("forged"), "0 is nobody's");
}

#[test]
fn a_tag_for_other_nonces_counts_as_forged() {
    let mut link = Link::new();
    let [theirs, own] = link.nonces;
    for nonces in [
        [theirs + 1, own],
        [theirs, own + 1],
        [own, theirs],
        [0, 0],
        [theirs, 0],
    ] {
        link.nonces = nonces;
        assert_eq!(link.send_with_counter(5), Some("forged"), "{nonces:x?}");
    }
    link.nonces = [theirs, own];
    assert_eq!(link.send_with_counter(5), Some("received"));
}

/// Checks the warning in the documentation of `Auth::epoch`: a relay must not start with a used epoch.
///
/// If a relay does so, its neighbour ignores the relay's frames as replayed, and the relay accepts old frames of the
/// neighbour.
#[test]
fn a_reused_epoch_is_not_accepted_as_a_restart() {
    let mut link = Link::new();
    for counter in 1..=100 {
        assert_eq!(link.send_with_counter(counter), Some("received"));
    }
    // The same epoch and claim number give the same nonce, but the counter restarts.
    assert_eq!(link.handshake(0, link.nonces), Some("replayed"));
    assert_eq!(link.send_with_counter(1), Some("replayed"));
    assert_eq!(link.send_with_counter(101), Some("received"));
    // Relay 2 restarts with its old epoch: frame 50 is accepted again.
    let mut again = Link::new();
    assert_eq!(again.send_with_counter(50), Some("received"));
}

#[test]
fn epoch_0_is_refused() {
    let settings = Settings {
        auth: Some(make::auth(KEY, 0)),
        ..Settings::default()
    };
    let identity = make::identity(1);
    let relay = Relay::new(mission(2), identity, settings, 1, Instant::ZERO);
    assert_eq!(relay.err(), Some(SetupError::Epoch));
}

/// Checks that logs do not show the key.
#[test]
fn debug_output_does_not_show_the_key() {
    let shown = format!("{:?}", relay(3, 2, Wiring::Pair, (4, Instant::ZERO)));
    assert!(shown.contains("Key(..)"));
    assert!(
        !shown.contains(
            &format!("{:?}", &KEY[..4])
                .trim_matches(['[', ']'])
                .to_owned()
        )
    );
}
