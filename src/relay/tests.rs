//! Tests at the end of the frame counter's range, which a test cannot reach by sending frames.

use super::Relay;
use crate::mission::tests::paper;
use crate::wire::auth::{Auth, Key};
use crate::wire::frame::MAX_FRAME;
use crate::{Identity, Instant, Mission, Settings};

fn relay(auth: Option<Auth>) -> Relay {
    let mission = Mission::try_new(paper(2)).unwrap();
    let identity = Identity {
        network: 7,
        index: 1,
    };
    let settings = Settings {
        auth,
        ..Settings::default()
    };
    Relay::new(mission, identity, settings, 1, Instant::ZERO).unwrap()
}

/// Checks that a signing relay stops sending once its frame counter is used up. If counters were used again, a recorded
/// frame could count as a new one.
#[test]
fn a_signing_relay_stops_at_its_last_counter() {
    let auth = Auth {
        key: Key::new([1; 32]),
        epoch: 1,
    };
    let mut frame = [0; MAX_FRAME];
    for (auth, silent) in [(Some(auth), true), (None, false)] {
        let mut relay = relay(auth);
        *relay.endpoint.counter_mut() = u32::MAX - 1;
        let mut counters = 0;
        for seconds in 0..100 {
            let now = Instant::from_millis(1_000 * seconds);
            relay.handle_timeout(now);
            relay.persist(|_| true);
            while relay.poll_transmit(now, &mut frame).is_some() {
                counters += 1;
            }
        }
        if silent {
            assert_eq!((counters, *relay.endpoint.counter_mut()), (1, u32::MAX));
        } else {
            assert!(
                counters > 2 && *relay.endpoint.counter_mut() < 1000,
                "it wraps"
            );
        }
    }
}
