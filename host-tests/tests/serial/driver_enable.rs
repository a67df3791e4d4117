//! Driver-enable pin: high while bytes leave, low otherwise.

use std::cell::RefCell;
use std::rc::Rc;

use uav_relay::serial::{Io, Nb, SerialLink, SerialPort, Shared};
use uav_relay::{Instant, Wiring};

use crate::chain::{BAUD, BYTE_TIME};
use crate::uart::{Bench, IoUart, Pin, Uart};
use host_tests::fixtures::wired;

/// Runs a relay without a neighbour for `millis` ms of simulated time. Returns the number of errors of the
/// driver-enable pin.
fn call(port: impl SerialPort, bench: &Rc<RefCell<Bench>>, millis: u64) -> u32 {
    let pin = Pin(Rc::clone(bench));
    let mut driver = Shared::new(SerialLink::half_duplex(port, BAUD, pin));
    let mut relay = wired(2, 1, Wiring::Shared);
    let mut now = Instant::ZERO;
    while now < Instant::from_millis(millis) {
        bench.borrow_mut().clock = now.as_micros();
        let wake = driver.poll(now, &mut relay, |_| true).unwrap();
        assert!(wake > now);
        now = wake.max(Instant::from_micros(bench.borrow().clock));
    }
    assert_eq!(driver.channel.stats().dropped, 0);
    driver.channel.stats().pin
}

/// Checks that the driver-enable pin is high while any byte leaves. It may stay high for `late` µs after the last
/// byte of a burst.
fn check(bench: &Bench, late: u64, name: &str) {
    let mut edges = bench.edges.iter();
    assert_eq!(
        edges.next(),
        Some(&(bench.edges[0].0, false)),
        "{name}: low at first"
    );
    let levels: Vec<bool> = edges.map(|&(_, level)| level).collect();
    assert!(levels.iter().step_by(2).all(|&level| level), "{name}: up");
    assert!(
        levels.iter().skip(1).step_by(2).all(|&level| !level),
        "{name}: and down"
    );
    let bursts: Vec<(u64, u64)> = bench.edges[1..]
        .chunks_exact(2)
        .map(|edges| (edges[0].0, edges[1].0))
        .collect();
    assert!(bursts.len() > 5, "{name}: {} bursts", bursts.len());
    let mut left = bench.bytes.as_slice();
    for &(up, down) in &bursts {
        let count = left.iter().take_while(|byte| byte.0 < down).count();
        let (burst, rest) = left.split_at(count);
        left = rest;
        assert!(count >= 19, "{name}: a whole frame, not {count} bytes");
        let (first, last) = (burst[0], burst[count - 1]);
        assert!(
            up <= first.0,
            "{name}: raised at {up}, first byte at {}",
            first.0
        );
        assert!(
            last.1 <= down,
            "{name}: lowered at {down}, last byte until {}",
            last.1
        );
        assert!(
            down <= last.1 + late,
            "{name}: lowered {} us late",
            down - last.1
        );
    }
}

#[test]
fn the_driver_is_enabled_while_bytes_leave_and_no_longer() {
    let byte_time = BYTE_TIME.as_micros();
    for fifo in [0, 1, 16, 255] {
        for lag in [0, 5, 40, 1_000] {
            let uart = |bench: &Rc<RefCell<Bench>>| Uart {
                bench: Rc::clone(bench),
                byte_time,
                fifo,
                lag,
            };
            let name = format!("fifo {fifo}, lag {lag}");
            let bench = Rc::new(RefCell::new(Bench::default()));
            call(Nb(uart(&bench)), &bench, 20_000);
            check(&bench.borrow(), byte_time + 2 * lag, &format!("nb, {name}"));

            let bench = Rc::new(RefCell::new(Bench::default()));
            call(Io(IoUart(uart(&bench))), &bench, 20_000);
            // The bytes of one poll are counted only in the next poll.
            check(
                &bench.borrow(),
                3 * byte_time + 4 * lag,
                &format!("io, {name}"),
            );
        }
    }
}

#[test]
fn a_pin_error_is_counted_and_retried() {
    let bench = Rc::new(RefCell::new(Bench {
        refusals: [3, 4],
        ..Bench::default()
    }));
    let uart = Uart {
        bench: Rc::clone(&bench),
        byte_time: BYTE_TIME.as_micros(),
        fifo: 16,
        lag: 0,
    };
    assert_eq!(call(Nb(uart), &bench, 20_000), 7);
    assert_eq!(bench.borrow().refusals, [0, 0]);
    check(&bench.borrow(), BYTE_TIME.as_micros(), "refused");
}
