//! Log over UART4 (TX PC10, RX PC11), in frames for `defmt-print`. A received `s` requests the counters.
//!
//! A frame is queued whole or dropped and counted, so logging never blocks.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::singleton;
use heapless::Vec;
use stm32f4xx_hal::pac::{Interrupt, UART4, interrupt};
use stm32f4xx_hal::serial::Serial;
use uav_relay::serial::SerialPort;

use super::port::{self, Port, Queues, RECEIVED, Slot};

/// Buffer of a log frame. The frame with the relay's counters is the longest.
type Frame = Vec<u8, 160>;

/// Capacity of the log's send queue, bytes. A full queue takes 89 ms to send.
const ROOM: usize = 1024;

struct Log {
    port: Option<Port>,
    encoder: defmt::Encoder,
    frame: Frame,
    /// True if the log frame being written exceeds its buffer and must be dropped.
    cut: bool,
    lost: u32,
}

static UART: Slot<UART4> = Mutex::new(RefCell::new(None));
static LOG: Mutex<RefCell<Log>> = Mutex::new(RefCell::new(Log {
    port: None,
    encoder: defmt::Encoder::new(),
    frame: Frame::new(),
    cut: false,
    lost: 0,
}));

pub(crate) fn start(uart: Serial<UART4>) {
    let Some(queues) = singleton!(QUEUES: Queues<ROOM, RECEIVED> = Queues::new()) else {
        return;
    };
    let port = port::open(uart, Interrupt::UART4, &UART, queues);
    with(|log| log.port = Some(port));
}

/// Returns true if the counters were requested, by the byte `s` on the log's UART.
pub(crate) fn counters_requested() -> bool {
    let mut counters_requested = false;
    with(|log| {
        let mut byte = [0];
        if let Some(port) = &mut log.port
            && matches!(port.read(&mut byte), Ok(1))
        {
            counters_requested = byte == *b"s";
        }
    });
    counters_requested
}

pub(crate) fn lost() -> u32 {
    let mut lost = 0;
    with(|log| lost = log.lost);
    lost
}

/// Begins a log frame. Interrupts are off until the end of the frame.
pub(crate) fn begin() {
    with(|log| {
        log.frame.clear();
        log.cut = false;
        let Log {
            encoder,
            frame,
            cut,
            ..
        } = log;
        encoder.start_frame(|bytes| *cut |= frame.extend_from_slice(bytes).is_err());
    });
}

pub(crate) fn write(bytes: &[u8]) {
    with(|log| {
        let Log {
            encoder,
            frame,
            cut,
            ..
        } = log;
        encoder.write(bytes, |bytes| {
            *cut |= frame.extend_from_slice(bytes).is_err();
        });
    });
}

/// Ends the log frame: queues it, or drops it if the queue has no room.
pub(crate) fn end() {
    with(|log| {
        let Log {
            port,
            encoder,
            frame,
            cut,
            lost,
        } = log;
        encoder.end_frame(|bytes| *cut |= frame.extend_from_slice(bytes).is_err());
        match port {
            Some(port) if !*cut && port.room() >= frame.len() => {
                let _ = port.write(frame);
            }
            _ => *lost = lost.saturating_add(1),
        }
    });
}

fn with(work: impl FnOnce(&mut Log)) {
    free(|cs| {
        if let Ok(mut log) = LOG.borrow(cs).try_borrow_mut() {
            work(&mut log);
        }
    });
}

#[interrupt]
fn UART4() {
    port::serve(&UART);
}
