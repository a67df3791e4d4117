//! Watchdog: fed only while the relay's ports and timers are served.

use relay_app::EmbassyClock;
use uav_relay::asynch::Clock as _;
use uav_relay::{Duration, Event, Placement};
use uav_relay_chip::reset::Reset;

use crate::bench::{Bench, FED, SITES, block, block_alone};
use crate::ram::Ram;
use crate::vehicle::Vehicle;

#[test]
fn a_loop_that_hangs_stops_feeding_the_watchdog() {
    let mut bench = Bench::new();
    bench.boot(Ram::blank().board(&block(Some(1), None), 1));
    FED.with_borrow_mut(Vec::clear);
    assert!(bench.run(60_000).contains(&Event::Converged));
    let fed = FED.with_borrow_mut(core::mem::take);
    assert!((120..=121).contains(&fed.len()), "{}", fed.len());
    for pair in fed.windows(2) {
        assert_eq!(pair[1].since(pair[0]), Duration::from_millis(500));
    }
    // The relay's task hangs for longer than the watchdog's timeout.
    bench.hang(12_000);
    assert!(FED.with_borrow(Vec::is_empty));
    // The watchdog restarts the chip, and the relay rejoins before its neighbour counts it as lost.
    let board = Ram::blank().board(&block(Some(2), None), 2);
    bench.boot(board.reset_by(Reset::Watchdog));
    let events = bench.run(30_000);
    println!("{events:?}");
    assert!(events.contains(&Event::Converged), "{events:?}");
    assert!(FED.with_borrow(Vec::len) >= 60);
}

/// Checks that the watchdog is not fed if the relay's task hangs for 12 s each time it runs.
///
/// The executor still polls the future that feeds the watchdog, but the relay's timers are late.
#[test]
fn late_timers_stop_feeding_the_watchdog() {
    let mut bench = Bench::new();
    bench.boot(Ram::blank().board(&block(Some(1), None), 1));
    assert!(bench.run(60_000).contains(&Event::Converged));
    let before = EmbassyClock.now();
    bench.stall_uart(12_000);
    // The relay sends within seconds, and hangs from then on.
    bench.run(10_000);
    let took = EmbassyClock.now().since(before);
    assert!(took > Duration::from_millis(1_000_000), "{took:?}");
    FED.with_borrow_mut(Vec::clear);
    bench.run(100);
    assert!(FED.with_borrow(Vec::is_empty));
    // A task that recovers feeds the watchdog again.
    bench.stall_uart(0);
    bench.run(10_000);
    assert!(FED.with_borrow(Vec::len) >= 18);
}

#[test]
fn the_operator_is_informed_of_a_watchdog_restart() {
    for (reset, is_expected) in [(Reset::Watchdog, true), (Reset::Power, false)] {
        let mut bench = Bench::with(Vehicle::new(Placement::on_line(100.0, 20.0)));
        bench.boot(Ram::blank().board(&block_alone(SITES), 1).reset_by(reset));
        bench.run(5_000);
        let line = "relay: restarted by its watchdog";
        let is_reported = bench.vehicle().texts.iter().any(|text| text == line);
        assert_eq!(is_reported, is_expected, "{:?}", bench.vehicle().texts);
    }
}
