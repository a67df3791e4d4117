//! Processor load of an idle relay.

use std::time::Duration;

use crate::chain::Chain;
use crate::process::{Relay, wait_until};
use crate::pty::Pty;

#[test]
fn a_settled_relay_sleeps() {
    let mut chain = Chain::start(3, "--probe-after-ms 500 --dead-after-ms 10000");
    chain.settled();
    assert_idle(&chain.relays, 100);
    for relay in &mut chain.relays {
        assert!(
            !relay.has_printed("lost"),
            "it has heard the others all the time"
        );
    }
}

#[test]
fn the_process_sleeps_while_a_tty_accepts_no_bytes() {
    let pty = Pty::new();
    pty.stuff();
    let path = pty.path().display();
    let mut relay = Relay::start(&format!("--index 1 --of 2 --downstream {path}"));
    relay.line("started: ");
    // The facade retries every 128 byte times: 90 times a second.
    let relays = [relay];
    assert_idle(&relays, 300);
    // Frames are sent as soon as there is room again.
    let mut buffer = [0; 4096];
    wait_until(|| pty.read(&mut buffer).contains(&0));
}

/// Asserts that each of `relays` is idle for 2 s. An idle relay uses almost no processor time, and wakes up at most `at_most` times.
fn assert_idle(relays: &[Relay], at_most: u64) {
    // Activity of the start has ended by then.
    std::thread::sleep(Duration::from_millis(500));
    let before: Vec<_> = relays.iter().map(Relay::cost).collect();
    std::thread::sleep(Duration::from_secs(2));
    for (relay, before) in relays.iter().zip(before) {
        let (used, woken) = relay.cost_since(before);
        assert!(used < Duration::from_millis(100), "{used:?}");
        assert!(woken <= at_most, "woken {woken} times");
    }
}
