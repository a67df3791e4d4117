//! Byte queues between an interrupt and the main loop, for a UART without a FIFO.
//!
//! Such a UART holds one byte. At 115 200 baud the next one overwrites it after 87 us. A call of a
//! [`Relay`](crate::Relay) may take 3 ms at 16 MHz, so a main loop that reads the port between calls loses bytes. An
//! interrupt therefore moves bytes between the UART and two queues, whose other ends the main loop has. Neither end
//! waits for the other or disables interrupts.
//!
//! No queue is needed for a UART with DMA, with a FIFO as deep as [`queue_depth`] returns, or with a buffered HAL
//! driver (all of Embassy's `BufferedUart`s).
//!
//! ```
//! use core::cell::Cell;
//! use uav_relay::Duration;
//! use uav_relay::serial::{ByteQueues, SerialPort, queue_depth};
//!
//! const BAUD: u32 = 115_200;
//! /// Longest time between two reads of the main loop: one call of the relay, and the work of the firmware.
//! const LONGEST: Duration = Duration::from_millis(10);
//!
//! # let pended = &Cell::new(0);
//! // On a board in a static, by `cortex_m::singleton!` or a `StaticCell`.
//! let mut queues = ByteQueues::<{ queue_depth(BAUD, LONGEST) }, 256>::new();
//! // On a board: `move || NVIC::pend(Interrupt::USART2)`.
//! let (mut interrupt, mut port) = queues.split(move || pended.set(pended.get() + 1));
//!
//! // The main loop has a frame to send.
//! assert_eq!(port.write(&[1, 2, 0])?, 3);
//! assert_eq!(pended.get(), 1, "the interrupt is to begin sending");
//!
//! // The interrupt handler: a byte has been received, and the UART accepts one.
//! interrupt.received(Ok(7));
//! let mut data_register = None;
//! let more = interrupt.send(|byte| {
//!     let free = data_register.is_none();
//!     data_register = data_register.or(Some(byte));
//!     free
//! });
//! assert!(data_register == Some(1) && more, "it stays enabled until the last byte is handed over");
//!
//! let mut bytes = [0; 8];
//! assert_eq!(port.read(&mut bytes)?, 1);
//! assert_eq!((bytes[0], port.lost()), (7, 0));
//! # Ok::<(), uav_relay::serial::Fault>(())
//! ```
//!
//! Each queue is a lock-free ring of atomic cells with one producer and one consumer. heapless's `spsc` is not used,
//! because it cannot be shown to be free of panics. Its ends do not know its length, and so divide and index by a
//! possible zero. Its cells are accessed by unsafe code.

use core::fmt;
use core::sync::atomic::{AtomicU8, AtomicU16, AtomicU32, AtomicUsize, Ordering};

use crate::serial::port::{Fault, SerialPort};
use crate::time::Duration;

/// Returns the necessary depth of the receive queue at `baud` bit/s, with 10 bits per byte.
///
/// It is the number of bytes received in `longest`, the maximum time between two reads of the main loop, plus three.
/// The three are one more byte, a marker of lost bytes, and a cell that a queue never uses.
///
/// | baud | 3 ms | 10 ms | 50 ms |
/// | --- | --- | --- | --- |
/// | 57 600 | 21 | 61 | 291 |
/// | 115 200 | 38 | 119 | 579 |
/// | 230 400 | 73 | 234 | 1 155 |
/// | 921 600 | 280 | 925 | 4 611 |
///
/// A flash write or erase may block the main loop for longer than any queue is deep. The relay then retransmits what is
/// lost.
/// ```
/// use uav_relay::{Duration, serial::queue_depth};
///
/// for (baud, depths) in [
///     (57_600, [21, 61, 291]),
///     (115_200, [38, 119, 579]),
///     (230_400, [73, 234, 1_155]),
///     (921_600, [280, 925, 4_611]),
/// ] {
///     assert_eq!([3, 10, 50].map(|millis| queue_depth(baud, Duration::from_millis(millis))), depths);
/// }
/// ```
#[expect(
    clippy::cast_possible_truncation,
    reason = "a depth beyond the address space is refused by whoever makes the queue"
)]
pub const fn queue_depth(baud: u32, longest: Duration) -> usize {
    let bits = longest.as_micros().saturating_mul(baud as u64);
    bits.div_ceil(10_000_000).saturating_add(3) as usize
}

/// Trigger of a UART's interrupt, whose handler sends the queued bytes. It is a closure, or a type of the firmware.
pub trait Pend {
    /// Makes the interrupt handler run: `NVIC::pend`, or the UART's flag for an empty data register.
    fn pend(&mut self);
}

impl<F: FnMut()> Pend for F {
    fn pend(&mut self) {
        self();
    }
}

/// Byte queues between an interrupt and the main loop, one to receive and one to send. The queues hold up to `IN` - 1
/// received bytes, and up to `OUT` - 1 bytes to send.
///
/// `OUT` should exceed the longest frame, [`MAX_FRAME`](crate::wire::frame::MAX_FRAME), so that the main loop can
/// sleep while the frame is sent.
#[derive(Debug)]
pub struct ByteQueues<const IN: usize, const OUT: usize> {
    /// Queue of received bytes or faults, encoded by [`encode`].
    received: [AtomicU16; IN],
    outgoing: [AtomicU8; OUT],
    in_indices: RingIndices,
    out_indices: RingIndices,
    lost: AtomicU32,
}

impl<const IN: usize, const OUT: usize> Default for ByteQueues<IN, OUT> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const IN: usize, const OUT: usize> ByteQueues<IN, OUT> {
    /// Creates empty queues.
    pub const fn new() -> Self {
        Self {
            received: [const { AtomicU16::new(0) }; IN],
            outgoing: [const { AtomicU8::new(0) }; OUT],
            in_indices: RingIndices::new(),
            out_indices: RingIndices::new(),
            lost: AtomicU32::new(0),
        }
    }

    /// Returns the interrupt's end and the main loop's end, which uses `pend` to trigger the interrupt.
    pub fn split<K: Pend>(&mut self, pend: K) -> (InterruptEnd<'_>, QueuedPort<'_, K>) {
        let (puts, takes) = ring_ends(&self.received, &mut self.in_indices);
        let (queues, sends) = ring_ends(&self.outgoing, &mut self.out_indices);
        let interrupt = InterruptEnd {
            received: puts,
            outgoing: sends,
            lost: &self.lost,
            gap: false,
        };
        let port = QueuedPort {
            received: takes,
            outgoing: queues,
            lost: &self.lost,
            pend,
        };
        (interrupt, port)
    }
}

/// Interrupt handler's end of the queues. Every call takes constant work per byte.
pub struct InterruptEnd<'q> {
    received: Producer<'q, AtomicU16>,
    outgoing: Consumer<'q, AtomicU8>,
    lost: &'q AtomicU32,
    /// True from the loss of received bytes until a [`Fault::Overrun`] is queued in their place.
    gap: bool,
}

impl fmt::Debug for InterruptEnd<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("InterruptEnd")
            .field("lost", self.lost)
            .finish_non_exhaustive()
    }
}

impl InterruptEnd<'_> {
    /// Queues a received byte or a fault of the UART for the main loop.
    ///
    /// If the queue is full, the byte is lost and counted, and the main loop reads one [`Fault::Overrun`] in place of
    /// consecutive lost bytes.
    pub fn received(&mut self, item: Result<u8, Fault>) {
        if self.gap && self.received.put(encode(Err(Fault::Overrun))) {
            self.gap = false;
        }
        if self.gap || !self.received.put(encode(item)) {
            self.gap = true;
            // Only the interrupt writes this counter. So a load and a store, which every core has, are enough.
            let lost = self.lost.load(Ordering::Relaxed).saturating_add(1);
            self.lost.store(lost, Ordering::Relaxed);
        }
    }

    /// Passes queued bytes to `take` until it returns false or no byte is left. Returns true if bytes are left.
    ///
    /// If bytes are left, the interrupt for an empty data register must stay enabled. Otherwise it must be disabled.
    pub fn send(&mut self, mut take: impl FnMut(u8) -> bool) -> bool {
        while let Some(byte) = self.outgoing.peek() {
            if !take(byte) {
                return true;
            }
            self.outgoing.pop();
        }
        false
    }
}

/// Main loop's end of the queues: a [`SerialPort`] that never waits for the UART.
pub struct QueuedPort<'q, K> {
    received: Consumer<'q, AtomicU16>,
    outgoing: Producer<'q, AtomicU8>,
    lost: &'q AtomicU32,
    pend: K,
}

impl<K> fmt::Debug for QueuedPort<'_, K> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("QueuedPort")
            .field("room", &self.room())
            .field("lost", self.lost)
            .finish_non_exhaustive()
    }
}

impl<K> QueuedPort<'_, K> {
    /// Returns the number of bytes that [`write`](SerialPort::write) would accept now.
    pub fn room(&self) -> usize {
        self.outgoing.room()
    }

    /// Returns the number of received bytes lost because the queue was full. The main loop then reads the queue too
    /// seldom.
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }
}

impl<K: Pend> SerialPort for QueuedPort<'_, K> {
    #[inline(never)] // its stack would stay below the relay's deepest call in `SerialLink::receive`
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        let mut count = 0;
        for place in into {
            match self.received.peek().map(decode) {
                Some(Ok(byte)) => *place = byte,
                // Bytes received before a fault are returned before it.
                Some(Err(fault)) if count == 0 => {
                    self.received.pop();
                    return Err(fault);
                }
                _ => break,
            }
            self.received.pop();
            count += 1;
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let fits = |&&byte: &&u8| self.outgoing.put(byte);
        let count = bytes.iter().take_while(fits).count();
        // The interrupt owns the UART and sends the rest.
        self.pend.pend();
        Ok(count)
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        Ok(None)
    }
}

/// Encodes a received byte as itself, and a fault as a code above 255.
const fn encode(item: Result<u8, Fault>) -> u16 {
    match item {
        Ok(byte) => byte as u16,
        Err(Fault::Overrun) => 0x100,
        Err(Fault::Framing) => 0x101,
        Err(Fault::Parity) => 0x102,
        Err(Fault::Noise) => 0x103,
        Err(Fault::Other) => 0x104,
    }
}

const fn decode(code: u16) -> Result<u8, Fault> {
    let [byte, above] = code.to_le_bytes();
    match (above, byte) {
        (0, byte) => Ok(byte),
        (_, 0) => Err(Fault::Overrun),
        (_, 1) => Err(Fault::Framing),
        (_, 2) => Err(Fault::Parity),
        (_, 3) => Err(Fault::Noise),
        _ => Err(Fault::Other),
    }
}

/// Atomic cell of a ring buffer. Accesses use relaxed memory ordering, because the ring's indices synchronise the
/// access.
pub(super) trait AtomicSlot {
    type Item: Copy;

    fn load(&self) -> Self::Item;
    fn store(&self, item: Self::Item);
}

impl AtomicSlot for AtomicU8 {
    type Item = u8;

    fn load(&self) -> u8 {
        self.load(Ordering::Relaxed)
    }

    fn store(&self, item: u8) {
        self.store(item, Ordering::Relaxed);
    }
}

impl AtomicSlot for AtomicU16 {
    type Item = u16;

    fn load(&self) -> u16 {
        self.load(Ordering::Relaxed)
    }

    fn store(&self, item: u16) {
        self.store(item, Ordering::Relaxed);
    }
}

/// Indices of a ring buffer: first item, and cell after the last item. Equal indices mean an empty ring, so one cell
/// always stays unused.
#[derive(Debug)]
pub(super) struct RingIndices {
    first: AtomicUsize,
    end: AtomicUsize,
}

impl RingIndices {
    pub(super) const fn new() -> Self {
        Self {
            first: AtomicUsize::new(0),
            end: AtomicUsize::new(0),
        }
    }
}

#[derive(Debug)]
struct RingEnd<'q, P> {
    slots: &'q [P],
    indices: &'q RingIndices,
}

/// Producer's end of a ring buffer, which appends items.
#[derive(Debug)]
pub(super) struct Producer<'q, P>(RingEnd<'q, P>);

/// Consumer's end of a ring buffer, which takes items.
#[derive(Debug)]
pub(super) struct Consumer<'q, P>(RingEnd<'q, P>);

/// Returns the producer's and the consumer's end of a ring buffer. The exclusive borrow of `indices` prevents a second
/// pair of ends.
pub(super) fn ring_ends<'q, P>(
    slots: &'q [P],
    indices: &'q mut RingIndices,
) -> (Producer<'q, P>, Consumer<'q, P>) {
    let indices = &*indices;
    (
        Producer(RingEnd { slots, indices }),
        Consumer(RingEnd { slots, indices }),
    )
}

impl<P> RingEnd<'_, P> {
    const fn next(&self, at: usize) -> usize {
        let next = at.saturating_add(1);
        if next < self.slots.len() { next } else { 0 }
    }
}

impl<P: AtomicSlot> Producer<'_, P> {
    /// Appends an item to the ring. Returns false if the ring is full.
    pub(super) fn put(&mut self, item: P::Item) -> bool {
        let RingEnd { slots, indices } = &self.0;
        let end = indices.end.load(Ordering::Relaxed);
        let next = self.0.next(end);
        if next == indices.first.load(Ordering::Acquire) {
            return false;
        }
        let Some(place) = slots.get(end) else {
            return false;
        };
        place.store(item);
        indices.end.store(next, Ordering::Release);
        true
    }

    pub(super) fn room(&self) -> usize {
        let RingEnd { slots, indices } = &self.0;
        let end = indices.end.load(Ordering::Relaxed);
        let first = indices.first.load(Ordering::Acquire);
        let used = if end >= first {
            end.saturating_sub(first)
        } else {
            slots.len().saturating_sub(first.saturating_sub(end))
        };
        slots.len().saturating_sub(1).saturating_sub(used)
    }
}

impl<P: AtomicSlot> Consumer<'_, P> {
    /// Returns the first item of the ring without removing it; `None` if the ring is empty.
    pub(super) fn peek(&self) -> Option<P::Item> {
        let RingEnd { slots, indices } = &self.0;
        let first = indices.first.load(Ordering::Relaxed);
        if first == indices.end.load(Ordering::Acquire) {
            return None;
        }
        slots.get(first).map(P::load)
    }

    /// Removes the first item of the ring, if there is one.
    pub(super) fn pop(&mut self) {
        let indices = self.0.indices;
        let first = indices.first.load(Ordering::Relaxed);
        if first != indices.end.load(Ordering::Acquire) {
            indices.first.store(self.0.next(first), Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{ByteQueues, Fault, SerialPort, decode, encode};

    #[test]
    fn lost_bytes_are_counted_and_read_as_one_overrun() {
        let mut queues = ByteQueues::<5, 4>::new();
        let (mut interrupt, mut port) = queues.split(|| {});
        for byte in 0..9 {
            interrupt.received(Ok(byte));
        }
        assert_eq!(port.lost(), 5);
        let mut bytes = [0; 3];
        assert_eq!((port.read(&mut bytes), bytes), (Ok(3), [0, 1, 2]));
        // The queue has room for the overrun fault and the item after it.
        interrupt.received(Ok(9));
        interrupt.received(Err(Fault::Noise));
        assert_eq!((port.read(&mut bytes), bytes[0]), (Ok(1), 3));
        assert_eq!(port.read(&mut bytes), Err(Fault::Overrun));
        assert_eq!((port.read(&mut bytes), bytes[0]), (Ok(1), 9));
        assert_eq!(port.read(&mut bytes), Err(Fault::Noise));
        assert_eq!((port.read(&mut bytes), port.lost()), (Ok(0), 5));
    }

    #[test]
    fn the_interrupt_keeps_bytes_that_the_uart_rejects() {
        let mut pended = 0;
        let mut queues = ByteQueues::<4, 4>::new();
        let (mut interrupt, mut port) = queues.split(|| pended += 1);
        assert_eq!((port.room(), port.write(&[1, 2, 3, 4])), (3, Ok(3)));
        let mut sent = [0; 2];
        let mut at = 0;
        let more = interrupt.send(|byte| {
            sent.get_mut(at).is_some_and(|place| {
                *place = byte;
                at += 1;
                true
            })
        });
        assert!(more && sent == [1, 2] && port.room() == 2);
        let mut last = 0;
        let take = |byte| {
            last = byte;
            true
        };
        assert!(!interrupt.send(take) && last == 3);
        assert_eq!(pended, 1);
    }

    #[test]
    fn every_item_comes_back_from_its_code() {
        let faults = [
            Fault::Overrun,
            Fault::Framing,
            Fault::Parity,
            Fault::Noise,
            Fault::Other,
        ];
        let bytes = (0..=u8::MAX).map(Ok);
        for item in bytes.chain(faults.map(Err)) {
            assert_eq!(decode(encode(item)), item);
        }
    }
}

#[cfg(test)]
mod ring_tests {
    extern crate std;

    use super::{AtomicU16, RingIndices, ring_ends};

    #[test]
    fn a_ring_holds_one_item_less_than_its_slots_in_order() {
        let slots = [const { AtomicU16::new(0) }; 4];
        let mut indices = RingIndices::new();
        let (mut producer, mut consumer) = ring_ends(&slots, &mut indices);
        for round in 0..9 {
            for item in 0..3 {
                assert_eq!(producer.room(), 3 - usize::from(item));
                assert!(producer.put(10 * round + item));
            }
            assert!(!producer.put(99));
            for item in 0..3 {
                assert_eq!(consumer.peek(), Some(10 * round + item));
                consumer.pop();
            }
            assert_eq!(consumer.peek(), None);
            consumer.pop();
        }
    }

    #[test]
    fn a_ring_without_slots_accepts_nothing() {
        let mut indices = RingIndices::new();
        let (mut producer, mut consumer) = ring_ends::<AtomicU16>(&[], &mut indices);
        assert!(!producer.put(1));
        consumer.pop();
        assert_eq!((producer.room(), consumer.peek()), (0, None));
    }

    #[test]
    fn two_threads_lose_no_item_and_keep_the_order() {
        let slots = [const { AtomicU16::new(0) }; 7];
        let mut indices = RingIndices::new();
        let (mut producer, mut consumer) = ring_ends(&slots, &mut indices);
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for item in 0..2_000 {
                    while !producer.put(item) {
                        std::thread::yield_now();
                    }
                }
            });
            for item in 0..2_000 {
                let got = loop {
                    if let Some(got) = consumer.peek() {
                        break got;
                    }
                    std::thread::yield_now();
                };
                assert_eq!(got, item);
                consumer.pop();
            }
        });
    }
}
