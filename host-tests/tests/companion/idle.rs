//! Processor load of an idle relay.

use std::time::{Duration, Instant};

use crate::Chain;
use crate::medium::QUIET;
use crate::process::{LIMIT, Relay};
use crate::pty::Pty;

#[test]
fn a_settled_relay_sleeps() {
    let mut chain = Chain::start(
        3,
        QUIET,
        &["--probe-after-ms", "500", "--dead-after-ms", "10000"],
    );
    chain.settled();
    assert_idle(&chain.relays, 100);
    for relay in &mut chain.relays {
        assert!(
            !relay.has_said("lost"),
            "it has heard the others all the time"
        );
    }
}

#[test]
fn a_tty_that_takes_nothing_is_waited_for_asleep() {
    let pty = Pty::new();
    pty.stuff();
    let path = pty.path().to_str().unwrap();
    let mut relay = Relay::start(&["--index", "1", "--of", "2", "--downstream", path]);
    relay.line("started: ");
    // The facade retries every 128 byte times: 90 times a second.
    let relays = [relay];
    assert_idle(&relays, 300);
    // Frames are sent as soon as there is room again.
    let mut buffer = [0; 4096];
    let end = Instant::now() + LIMIT;
    while !pty.read(&mut buffer).contains(&0) {
        assert!(Instant::now() < end, "no frame");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Asserts that each of `relays` is idle. In 2 s it uses almost no processor time and wakes up at most `at_most` times.
fn assert_idle(relays: &[Relay], at_most: u64) {
    // Activity of the start has ended by then.
    std::thread::sleep(Duration::from_millis(500));
    let before: Vec<_> = relays.iter().map(Relay::cost).collect();
    std::thread::sleep(Duration::from_secs(2));
    for (relay, (time, sleeps)) in relays.iter().zip(before) {
        let (time_now, sleeps_now) = relay.cost();
        let (used, woken) = (time_now.saturating_sub(time), sleeps_now - sleeps);
        println!(
            "{} ms of processor time, {woken} wake-ups in 2 s",
            used.as_millis()
        );
        assert!(used < Duration::from_millis(100), "{used:?}");
        assert!(woken <= at_most, "woken {woken} times");
    }
}
