//! Asynchronous ports in memory: wires and a shared channel, with the transmission time of each byte.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::{pending, poll_fn};
use std::rc::Rc;
use std::task::{Poll, Waker};

use embedded_io_async::{ErrorType, Read, Write};
use uav_relay::asynch::Clock;
use uav_relay::{Duration, Instant};

use crate::time::Time;

pub(crate) const BAUD: u32 = 115_200;

/// Transmission time of a byte at [`BAUD`].
pub(crate) const BYTE_TIME: Duration = Duration::from_micros(87);

/// Frame with the arrival time of its last byte.
pub(crate) type TimedFrame = (Instant, Vec<u8>);

/// Behaviour of a simulated port writer: correct or with a fault.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum WriterFault {
    None,
    /// `write` never completes, from the first byte on.
    Stuck,
    /// Bytes take their transmission time, but reach no reader.
    Cut,
}

/// Bytes in transit to one reader or waiting for it, with their arrival times.
#[derive(Default)]
struct Inbox {
    bytes: VecDeque<(Instant, u8)>,
    waits: Option<Waker>,
}

/// Simulated serial line or shared channel, on which one end at a time sends a frame.
pub(crate) struct Line {
    inboxes: Vec<Inbox>,
    /// Times at which accepted bytes leave the line's send buffer.
    leaving: VecDeque<Instant>,
    capacity: usize,
    talker: Option<usize>,
    frame: Vec<u8>,
    /// Completed frames of all ends, with the times at which they arrived.
    pub(crate) frames: Vec<TimedFrame>,
}

pub(crate) type Shared = Rc<RefCell<Line>>;

/// Creates a line with `ends` ends and a send buffer of `capacity` bytes.
pub(crate) fn line(ends: usize, capacity: usize) -> Shared {
    Rc::new(RefCell::new(Line {
        inboxes: (0..ends).map(|_| Inbox::default()).collect(),
        leaving: VecDeque::new(),
        capacity,
        talker: None,
        frame: Vec::new(),
        frames: Vec::new(),
    }))
}

pub(crate) struct Rx {
    pub(crate) line: Shared,
    pub(crate) end: usize,
    pub(crate) time: Time,
}

pub(crate) struct Tx {
    pub(crate) line: Shared,
    pub(crate) end: usize,
    pub(crate) time: Time,
    pub(crate) fault: WriterFault,
}

impl ErrorType for Rx {
    type Error = Infallible;
}

impl ErrorType for Tx {
    type Error = Infallible;
}

impl Read for Rx {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        loop {
            let (count, next) = {
                let mut line = self.line.borrow_mut();
                let bytes = &mut line.inboxes[self.end].bytes;
                let now = self.time.now();
                let there = bytes.iter().take_while(|byte| byte.0 <= now).count();
                let count = there.min(into.len());
                for (place, (_, byte)) in into.iter_mut().zip(bytes.drain(..count)) {
                    *place = byte;
                }
                (count, bytes.front().map(|byte| byte.0))
            };
            match next {
                _ if count > 0 => return Ok(count),
                Some(next) => self.time.sleep_until(next).await,
                None => self.readable().await,
            }
        }
    }
}

impl Rx {
    async fn readable(&self) {
        poll_fn(|cx| {
            let inbox = &mut self.line.borrow_mut().inboxes[self.end];
            if inbox.bytes.is_empty() {
                inbox.waits = Some(cx.waker().clone());
                Poll::Pending
            } else {
                Poll::Ready(())
            }
        })
        .await;
    }
}

impl Write for Tx {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if self.fault == WriterFault::Stuck {
            pending::<()>().await;
        }
        loop {
            let wait = {
                let line = &mut *self.line.borrow_mut();
                let now = self.time.now();
                while line.leaving.front().is_some_and(|left| *left <= now) {
                    line.leaving.pop_front();
                }
                let room = line.capacity.saturating_sub(line.leaving.len());
                if line.talker.is_none_or(|talker| talker == self.end) && room > 0 {
                    let count =
                        line.put(self.end, &bytes[..room.min(bytes.len())], now, self.fault);
                    return Ok(count);
                }
                line.leaving.front().map_or(now + BYTE_TIME, |left| *left)
            };
            self.time.sleep_until(wait).await;
        }
    }

    /// Waits until all but the last 4 bytes have left, like a HAL that ignores the UART's FIFO of 4 bytes.
    async fn flush(&mut self) -> Result<(), Infallible> {
        let left = {
            let line = self.line.borrow();
            let ring = line.leaving.len().saturating_sub(5);
            ring.checked_sub(1).map(|last| line.leaving[last])
        };
        if let Some(left) = left {
            self.time.sleep_until(left).await;
        }
        Ok(())
    }
}

impl Line {
    /// Sends bytes from end `from`, up to the end of a frame. Returns the number of bytes sent.
    fn put(&mut self, from: usize, bytes: &[u8], now: Instant, fault: WriterFault) -> usize {
        let mut count = 0;
        for &byte in bytes {
            let left = self.leaving.back().map_or(now, |last| now.max(*last)) + BYTE_TIME;
            self.leaving.push_back(left);
            self.frame.push(byte);
            self.talker = (byte != 0).then_some(from);
            count += 1;
            for (_, inbox) in (self.inboxes.iter_mut().enumerate())
                .filter(|(end, _)| *end != from && fault == WriterFault::None)
            {
                inbox.bytes.push_back((left, byte));
                if let Some(waits) = inbox.waits.take() {
                    waits.wake();
                }
            }
            if byte == 0 {
                let frame = std::mem::take(&mut self.frame);
                self.frames.push((left, frame));
                break;
            }
        }
        count
    }
}
