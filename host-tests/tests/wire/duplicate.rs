//! Claims to a node number without a key, and frames with a relay's own number under a key.

use uav_relay::MAX_FRAME;
use uav_relay::wire::digest::digest;
use uav_relay::{Auth, Event, Identity, Instant, Key, Port, Relay, Settings, Wiring};

use super::codec::Said;
use super::kinds::{FIRST, framed, one_of_each, sent_with_claims};
use super::receive::relay;
use super::votes::{between, events};

const NOW: Instant = Instant::from_millis(1_000);

const ECHO: u8 = 2;

/// Returns a claim by a node that has received claim `heard`.
const fn claim(number: u32, heard: u32, flags: u8) -> Said {
    Said::Claim {
        number,
        other_number: heard,
        flags,
    }
}

/// Returns relay 4 of 8 and its claim number, with which it answers another frame with its number.
fn relay_4(wiring: Wiring) -> (Relay, u32) {
    let mut relay = relay(4, 8, wiring);
    let sweep = &one_of_each(FIRST, digest(relay.mission()))[0];
    let port = match wiring {
        Wiring::Pair => Port::Upstream,
        Wiring::Shared => Port::Shared,
    };
    relay.handle_bytes(NOW, port, &between(4, 5, sweep));
    assert_eq!(events(&mut relay), [], "it may be an echo");
    let out = sent_with_claims(&mut relay, NOW);
    let [(_, Said::Claim { number, .. })] = out[..] else {
        panic!("{out:?}");
    };
    assert_eq!(out[0].1, claim(number, 0, 0));
    assert!(number < 1 << 30);
    assert!(!relay.is_passive());
    (relay, number)
}

#[test]
fn a_claim_of_a_neighbour_is_repeated_to_its_number() {
    for (port, from) in [(Port::Upstream, 3), (Port::Downstream, 5)] {
        let (mut relay, _) = relay_4(Wiring::Pair);
        for flags in 0..2 {
            relay.handle_bytes(NOW, port, &between(from, 4, &claim(7, 9, flags)));
            let echo = claim(7, 9, flags | ECHO);
            assert_eq!(sent_with_claims(&mut relay, NOW), [(port, echo)]);
        }
        assert!(!relay.is_passive() && events(&mut relay).is_empty());
    }
}

/// Checks claims. One that does not name the relay's own may be from before its start: it is only answered.
#[test]
fn the_smaller_claim_becomes_passive_and_the_larger_one_answers() {
    for (wiring, port) in [
        (Wiring::Pair, Port::Upstream),
        (Wiring::Shared, Port::Shared),
    ] {
        let (relay, own) = relay_4(wiring);
        let late = NOW + uav_relay::Duration::from_millis(200);
        for echo in [false, true] {
            for (number, heard) in [
                (own + 1, own),
                (own - 1, own),
                (own + 1, 0),
                (own + 1, own - 1),
            ] {
                let mut after = relay.clone();
                let bytes = if echo {
                    framed(4, Port::Upstream, &claim(number, heard, ECHO))
                } else {
                    between(4, 3, &claim(number, heard, 0))
                };
                after.handle_bytes(late, port, &bytes);
                let passive = number > own && heard == own;
                assert_eq!(after.is_passive(), passive, "{number} {heard} {echo}");
                let told = events(&mut after);
                let expected: &[Event] = if heard == own {
                    &[Event::DuplicateIndex { node: 4 }]
                } else {
                    &[]
                };
                assert_eq!(told, expected);
                let answer = claim(own, number, u8::from(passive));
                let out = sent_with_claims(&mut after, late);
                assert_eq!(out.len(), 1);
                assert_eq!(out[0].1, answer);
            }
        }
    }
}

/// Checks a radio that returns a relay's own frames.
#[test]
fn its_own_claim_has_no_effect_directly_or_as_an_echo() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let (mut relay, own) = relay_4(wiring);
        let port = match wiring {
            Wiring::Pair => Port::Upstream,
            Wiring::Shared => Port::Shared,
        };
        let sweep = one_of_each(FIRST, digest(relay.mission()))[0].clone();
        let late = NOW + uav_relay::Duration::from_millis(200);
        for bytes in [
            between(4, 3, &claim(own, 0, 0)),
            framed(4, Port::Upstream, &claim(own, 0, ECHO)),
            between(4, 5, &sweep),
            between(4, 3, &claim(own, 0, 0)),
        ] {
            relay.handle_bytes(late, port, &bytes);
            assert_eq!(sent_with_claims(&mut relay, late), []);
            assert_eq!(events(&mut relay), []);
            assert!(!relay.is_passive());
        }
    }
}

/// Returns relay 4 of 8 with a key, and its first two frames, which are handshakes.
fn with_key(key: u8, seed: u32) -> (Relay, Vec<Vec<u8>>) {
    let mission = *relay(4, 8, Wiring::Shared).mission();
    let settings = Settings {
        wiring: Wiring::Shared,
        auth: Some(Auth {
            key: Key::new([key; 32]),
            epoch: 3,
        }),
        ..Settings::default()
    };
    let identity = Identity {
        network: 7,
        index: 4,
    };
    let mut relay = Relay::new(mission, identity, settings, seed, NOW).unwrap();
    let mut buffer = [0; MAX_FRAME];
    let mut frames = Vec::new();
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(NOW, &mut buffer) {
        frames.push(buffer[..transmit.len].to_vec());
    }
    assert_eq!(frames.len(), 2);
    (relay, frames)
}

/// Checks handshakes as claims: the relay becomes passive or answers once; its own have no effect.
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
            let mut buffer = [0; MAX_FRAME];
            let mut sent = 0;
            relay.persist(|_| true);
            while relay.poll_transmit(NOW, &mut buffer).is_some() {
                sent += 1;
            }
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
