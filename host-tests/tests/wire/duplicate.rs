//! Claims to a node number without a key, and frames with a relay's own number under a key.

use host_tests::fixtures::paper;
use host_tests::make;
use uav_relay::MAX_FRAME;
use uav_relay::{Duration, Event, Instant, Mission, Port, Relay, Settings, Wiring};

use super::bench::{Bench, frame_between};
use super::kinds::{FIRST, claim, one_of_each};
use super::message::WireMessage;

const NOW: Instant = Instant::from_millis(1_000);

const ECHO: u8 = 2;

const PORTS: [(Wiring, Port); 2] = [
    (Wiring::Pair, Port::Upstream),
    (Wiring::Shared, Port::Shared),
];

/// Delivers a frame to relay 4 of 8. Returns the index claims, and echoes of claims, that the relay sends.
fn receive(bench: &mut Bench, port: Port, bytes: &[u8]) -> Vec<(Port, WireMessage)> {
    let now = bench.now;
    bench.handle_bytes(now, port, bytes);
    bench.sent_with_claims()
}

/// Returns relay 4 of 8 after it received a sweep message whose sender also has number 4.
///
/// The relay has answered by an index claim, because another node may have its index. Also returns that sweep message
/// and the number of the claim.
fn relay_4(wiring: Wiring, port: Port) -> (Bench, WireMessage, u32) {
    let mut bench = Bench::new(4, 8, wiring);
    bench.now = NOW;
    let sweep = one_of_each(FIRST, bench.mission)[0].clone();
    let out = receive(&mut bench, port, &frame_between(4, 5, &sweep));
    assert_eq!(bench.events(), [], "it may be an echo");
    let number = out[0].1.number("number") as u32;
    assert_eq!(out, [(out[0].0, claim(number, 0, 0))]);
    assert!(number < 1 << 30);
    assert!(!bench.is_passive());
    (bench, sweep, number)
}

#[test]
fn a_neighbours_claim_is_echoed_to_its_number() {
    for (port, from) in [(Port::Upstream, 3), (Port::Downstream, 5)] {
        let (mut bench, _, _) = relay_4(Wiring::Pair, Port::Upstream);
        for flags in 0..2 {
            let out = receive(
                &mut bench,
                port,
                &frame_between(from, 4, &claim(7, 9, flags)),
            );
            assert_eq!(out, [(port, claim(7, 9, flags | ECHO))]);
        }
        assert!(!bench.is_passive() && bench.events().is_empty());
    }
}

/// Checks that a relay turns passive if a claim with a larger number names the relay's own claim.
///
/// A claim that does not name the number of the relay's claim may date from before the relay's start: the relay answers
/// it and stays active.
#[test]
fn the_smaller_claim_turns_passive_and_the_larger_answers() {
    for (wiring, port) in PORTS {
        let (mut bench, _, own) = relay_4(wiring, port);
        bench.now = NOW + Duration::from_millis(200);
        for echo in [false, true] {
            for (number, heard) in [
                (own + 1, own),
                (own - 1, own),
                (own + 1, 0),
                (own + 1, own - 1),
            ] {
                let mut after = bench.clone();
                let bytes = if echo {
                    frame_between(3, 4, &claim(number, heard, ECHO))
                } else {
                    frame_between(4, 3, &claim(number, heard, 0))
                };
                let out = receive(&mut after, port, &bytes);
                let passive = number > own && heard == own;
                assert_eq!(after.is_passive(), passive, "{number} {heard} {echo}");
                let told = (heard == own).then_some(Event::DuplicateIndex { node: 4 });
                assert_eq!(after.events(), Vec::from_iter(told));
                assert_eq!(out.len(), 1);
                assert_eq!(out[0].1, claim(own, number, u8::from(passive)));
            }
        }
    }
}

/// Checks that a relay's own frames have no effect when a radio returns them to the relay.
#[test]
fn its_own_claim_has_no_effect_directly_or_as_an_echo() {
    for (wiring, port) in PORTS {
        let (mut bench, sweep, own) = relay_4(wiring, port);
        bench.now = NOW + Duration::from_millis(200);
        for bytes in [
            frame_between(4, 3, &claim(own, 0, 0)),
            frame_between(3, 4, &claim(own, 0, ECHO)),
            frame_between(4, 5, &sweep),
            frame_between(4, 3, &claim(own, 0, 0)),
        ] {
            assert_eq!(receive(&mut bench, port, &bytes), []);
            assert_eq!(bench.events(), []);
            assert!(!bench.is_passive());
        }
    }
}

/// Returns all frames that a relay sends at time zero.
fn frames(relay: &mut Relay) -> Vec<Vec<u8>> {
    let mut buffer = [0; MAX_FRAME];
    let mut frames = Vec::new();
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(NOW, &mut buffer) {
        frames.push(buffer[..transmit.len].to_vec());
    }
    frames
}

/// Returns relay 4 of 8 with a key, and the two handshakes that it sends first.
fn with_key(key: u8, seed: u32) -> (Relay, Vec<Vec<u8>>) {
    let settings = Settings {
        wiring: Wiring::Shared,
        auth: Some(make::auth([key; 32], 3)),
        ..Settings::default()
    };
    let identity = make::identity(4);
    let mission = Mission::try_new(paper(8)).unwrap();
    let mut relay = Relay::new(mission, identity, settings, seed, NOW).unwrap();
    let frames = frames(&mut relay);
    assert_eq!(frames.len(), 2);
    (relay, frames)
}

/// Checks that handshakes take the place of index claims if relays have a key.
///
/// One of two duplicates (relays with the same index) becomes passive, the other duplicate answers. A relay's own
/// handshakes have no effect on this relay.
#[test]
fn with_a_key_handshakes_are_the_claims() {
    let mut passive = 0;
    for seed in 1..=20 {
        let (relay, own) = with_key(1, seed);
        let (other, others) = with_key(1, seed + 100);
        let (_, forged) = with_key(2, seed + 100);
        let given = |relay: &Relay, frame: &[u8]| {
            let mut relay = relay.clone();
            relay.handle_bytes(NOW, Port::Shared, frame);
            let sent = frames(&mut relay).len();
            (relay.is_passive(), sent)
        };
        for frame in own.iter().chain(&forged) {
            assert_eq!(given(&relay, frame), (false, 0));
        }
        let both = [given(&relay, &others[0]), given(&other, &own[0])];
        assert!(
            [[(true, 0), (false, 1)], [(false, 1), (true, 0)]].contains(&both),
            "{both:?}"
        );
        passive += u32::from(both[0].0);
        // An altered handshake has no effect.
        for at in 1..others[0].len() - 1 {
            let mut altered = others[0].clone();
            altered[at] ^= 1;
            assert_eq!(given(&relay, &altered), (false, 0), "{at}");
        }
    }
    assert!((4..=16).contains(&passive), "{passive} of 20");
}
