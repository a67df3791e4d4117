//! Guarantees of the port runner: delivery, termination of truncated frames, fairness, pin timing.

use std::cell::{Cell, RefCell};
use std::future::{pending, poll_fn};
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use embedded_hal::digital::{ErrorType as PinType, OutputPin};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use futures_executor::LocalPool;
use futures_util::task::LocalSpawnExt as _;
use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, AsyncShared, Clock};
use uav_relay::wire::deframe::Deframer;
use uav_relay::{Instant, Port, Wiring};

use crate::time::Time;
use crate::wire::{BAUD, BYTE_TIME, Rx, Tx, WriterFault, line};
use host_tests::fixtures::wired;

/// Simulated port writer that accepts only part of the bytes of a write, or blocks for ever, or fails.
#[derive(Default)]
struct Taker {
    taken: Rc<RefCell<Vec<u8>>>,
    /// Number of writes that still complete. The write after them blocks for ever.
    writes: Rc<Cell<usize>>,
    /// Number n such that every n-th write fails; 0 if no write fails.
    fails: usize,
    done: usize,
}

impl Taker {
    /// Creates a writer that blocks for ever after `writes` writes.
    fn until(writes: usize) -> Self {
        Self {
            writes: Rc::new(Cell::new(writes)),
            ..Self::default()
        }
    }
}

struct Silent;

/// Simulated port reader that never waits: it always has a byte or an error.
struct Flood {
    fails: bool,
}

impl ErrorType for Taker {
    type Error = ErrorKind;
}
impl ErrorType for Silent {
    type Error = ErrorKind;
}
impl ErrorType for Flood {
    type Error = ErrorKind;
}

impl Write for Taker {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if self.writes.get() == 0 {
            pending::<()>().await;
        }
        self.writes.set(self.writes.get() - 1);
        self.done += 1;
        let count = bytes.len().min(7);
        self.taken.borrow_mut().extend(&bytes[..count]);
        if self.fails > 0 && self.done.is_multiple_of(self.fails) {
            return Err(ErrorKind::Other);
        }
        Ok(count)
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

impl Read for Silent {
    async fn read(&mut self, _: &mut [u8]) -> Result<usize, ErrorKind> {
        pending().await
    }
}

impl Read for Flood {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.fails {
            return Err(ErrorKind::Other);
        }
        into.fill(3);
        Ok(into.len())
    }
}

/// Polls `runner`, which runs a relay's ports, once in each millisecond of `millis`, then drops it.
fn run_for(time: &Time, millis: std::ops::Range<u64>, runner: impl Future) {
    let (mut pool, mut cx) = (LocalPool::new(), Context::from_waker(Waker::noop()));
    let mut runner = pin!(runner);
    for millis in millis {
        time.run(&mut pool, Instant::from_millis(millis));
        assert!(runner.as_mut().poll(&mut cx).is_pending());
    }
}

/// Returns the numbers of intact frames and of damaged frames in a byte stream.
fn deframed(bytes: &[u8]) -> [usize; 2] {
    let mut deframer = Deframer::new();
    let mut counted = [0; 2];
    for &byte in bytes {
        match deframer.push(byte) {
            Some(Ok(plain)) => {
                let (body, sum) = plain.split_at(plain.len() - 4);
                let whole = uav_relay::CRC_32C.checksum(body).to_le_bytes() == *sum;
                counted[usize::from(!whole)] += 1;
            }
            Some(Err(_)) => counted[1] += 1,
            None => {}
        }
    }
    counted
}

/// Checks that dropping the port runner during a write truncates at most one frame.
///
/// When the runner runs again, it ends the truncated frame before it sends the next one.
#[test]
fn a_frame_that_is_cut_short_is_ended_before_the_next() {
    for cut in 1..12 {
        let time = Time::default();
        let down = Taker::until(cut);
        let (taken, writes) = (Rc::clone(&down.taken), Rc::clone(&down.writes));
        let mut ports = AsyncPair::new(
            AsyncLink::new(Silent, Taker::default(), BAUD),
            AsyncLink::new(Silent, down, BAUD),
        );
        let mut relay = wired(2, 1, Wiring::Pair);
        let relay = AsyncRelay::new(&mut relay);
        run_for(&time, 0..3_000, ports.run(&relay, &time, |_| true));
        assert_eq!(writes.get(), 0);
        let before = taken.borrow().len();
        let half = taken.borrow().last() != Some(&0);
        writes.set(usize::MAX);
        run_for(&time, 3_000..9_000, ports.run(&relay, &time, |_| true));
        let taken = taken.borrow();
        let [whole, spoiled] = deframed(&taken);
        println!("dropped behind {before} bytes: {whole} whole frames, {spoiled} cut short");
        assert!(whole > 5, "{cut}: {whole}");
        assert_eq!(spoiled, usize::from(half), "{cut}");
        // The repeated frame starts behind a delimiter.
        assert_eq!(taken[before], 0, "{cut}");
    }
}

#[test]
fn a_failed_write_is_counted_and_the_frame_sent_again() {
    let time = Time::default();
    let down = Taker {
        fails: 23,
        ..Taker::until(usize::MAX)
    };
    let taken = Rc::clone(&down.taken);
    let mut ports = AsyncPair::new(
        AsyncLink::new(Silent, Taker::default(), BAUD),
        AsyncLink::new(Silent, down, BAUD),
    );
    let mut relay = wired(2, 1, Wiring::Pair);
    let relay = AsyncRelay::new(&mut relay);
    run_for(&time, 0..20_000, ports.run(&relay, &time, |_| true));
    let [whole, spoiled] = deframed(&taken.borrow());
    let stats = relay.stats(Port::Downstream);
    println!(
        "{whole} whole frames, {spoiled} cut short, {} failed writes",
        stats.write
    );
    assert!(stats.write > 5 && spoiled > 0);
    assert!(spoiled <= usize::try_from(stats.write).unwrap());
    let sent = relay.with(|relay| relay.stats().sent).unwrap();
    // Every frame for this port except queued ones.
    assert!(whole + 3 >= usize::try_from(sent).unwrap() / 2, "{sent}");
}

/// Checks that a port that is always ready, or always fails, lets all other ports run.
#[test]
fn an_always_ready_port_starves_no_other_port() {
    for fails in [false, true] {
        let time = Time::default();
        let down = Taker::until(usize::MAX);
        let taken = Rc::clone(&down.taken);
        let mut ports = AsyncPair::new(
            AsyncLink::new(Flood { fails }, Taker::default(), BAUD),
            AsyncLink::new(Silent, down, BAUD),
        );
        let mut relay = wired(2, 1, Wiring::Pair);
        let relay = AsyncRelay::new(&mut relay);
        run_for(&time, 0..3_000, ports.run(&relay, &time, |_| true));
        assert!(deframed(&taken.borrow())[0] > 3, "{fails}");
        let failed = relay.stats(Port::Upstream).other;
        assert_eq!(failed > 10, fails, "{failed}");
    }
}

/// Output pin that records its edges with their times.
#[derive(Clone)]
struct Pin {
    time: Time,
    edges: Rc<RefCell<Vec<(Instant, bool)>>>,
    refuses: Rc<Cell<u32>>,
}

impl PinType for Pin {
    type Error = embedded_hal::digital::ErrorKind;
}

impl Pin {
    fn set(&self, high: bool) -> Result<(), embedded_hal::digital::ErrorKind> {
        if self.refuses.get() > 0 {
            self.refuses.set(self.refuses.get() - 1);
            return Err(embedded_hal::digital::ErrorKind::Other);
        }
        let mut edges = self.edges.borrow_mut();
        if edges.last().is_none_or(|edge| edge.1 != high) {
            edges.push((self.time.now(), high));
        }
        Ok(())
    }
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        self.set(true)
    }
}

/// Checks that the transmit-enable pin is high while bytes leave, and at most two byte times longer.
///
/// This must hold although the writer's `flush` returns while up to 4 bytes are still in a FIFO.
#[test]
fn the_pin_is_high_while_bytes_leave_and_little_longer() {
    for capacity in [1, 4, 16, 1_000] {
        let time = Time::default();
        let mut pool = LocalPool::new();
        let air = line(2, capacity);
        let pin = Pin {
            time: time.clone(),
            edges: Rc::default(),
            refuses: Rc::new(Cell::new(3)),
        };
        let rx = Rx {
            line: Rc::clone(&air),
            end: 0,
            time: time.clone(),
        };
        let tx = Tx {
            line: Rc::clone(&air),
            end: 0,
            time: time.clone(),
            fault: WriterFault::None,
        };
        let edges = Rc::clone(&pin.edges);
        let task = {
            let time = time.clone();
            async move {
                let mut ports = AsyncShared::new(AsyncLink::half_duplex(rx, tx, BAUD, pin));
                let mut relay = wired(2, 1, Wiring::Shared);
                let relay = AsyncRelay::new(&mut relay);
                let counted = poll_fn(|_| {
                    // The statistics are checked at every poll.
                    assert!(relay.stats(Port::Shared).pin <= 3);
                    Poll::<()>::Pending
                });
                embassy_futures::join::join(ports.run(&relay, &time, |_| true), counted).await;
            }
        };
        pool.spawner().spawn_local(task).unwrap();
        time.run(&mut pool, Instant::from_millis(20_000));
        let (edges, heard) = (edges.borrow(), &air.borrow().frames);
        assert!(heard.len() > 10, "{}", heard.len());
        assert!(edges.len() > 10, "{capacity}: {edges:?}");
        let (mut latest, mut bursts) = (0, 0);
        for (left, frame) in heard {
            let begun = left.as_micros() - BYTE_TIME.as_micros() * frame.len() as u64;
            let up = edges.iter().rev().find(|(at, _)| at.as_micros() <= begun);
            assert_eq!(
                up.map(|edge| edge.1),
                Some(true),
                "{capacity}: raised before {begun}"
            );
            let down = edges.iter().find(|(at, _)| at.as_micros() > begun);
            let late = down.map_or(0, |(at, _)| at.as_micros() - left.as_micros());
            assert!(
                down.is_none_or(|(at, high)| !high && at >= left),
                "{capacity}"
            );
            // The pin falls two byte times after the last byte, unless another frame follows at once.
            let follows = heard.iter().find(|next| next.0 > *left);
            let alone = follows.is_none_or(|(at, frame)| {
                let begun = at.as_micros() - BYTE_TIME.as_micros() * frame.len() as u64;
                begun > left.as_micros() + 3 * BYTE_TIME.as_micros()
            });
            if alone {
                latest = latest.max(late);
                bursts += 1;
            }
        }
        println!(
            "capacity {capacity}: {bursts} bursts, lowered {latest} us behind the last byte at most"
        );
        assert!(
            bursts > 5 && latest <= 3 * BYTE_TIME.as_micros(),
            "{latest}"
        );
    }
}
