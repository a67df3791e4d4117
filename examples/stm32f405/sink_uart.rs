//! The log over UART4 (TX PC10, RX PC11), in frames for `defmt-print`. An `s` sent to it asks for the counters.
//!
//! A frame goes into the queue of its port whole or not at all: logging never waits, and what did not fit is counted.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::singleton;
use heapless::Vec;
use stm32f4xx_hal::pac::{Interrupt, UART4, interrupt};
use stm32f4xx_hal::serial::Serial;
use uav_relay::serial::SerialPort;

use crate::port::{self, Port, Queues, RECEIVED, Slot};

/// Room for the longest frame, the relay's counters.
type Frame = Vec<u8, 160>;

/// Bytes of the log that can wait to leave: 89 ms of them.
const ROOM: usize = 1024;

struct Log {
    port: Option<Port>,
    encoder: defmt::Encoder,
    frame: Frame,
    /// Whether the frame is longer than there is room for.
    cut: bool,
    /// Frames that were dropped.
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

/// Opens the port of the log.
pub(crate) fn start(uart: Serial<UART4>) {
    let Some(queues) = singleton!(QUEUES: Queues<ROOM, RECEIVED> = Queues::new()) else {
        return;
    };
    let port = port::open(uart, Interrupt::UART4, &UART, queues);
    with(|log| log.port = Some(port));
}

/// Whether somebody has asked for the counters.
pub(crate) fn asked() -> bool {
    let mut asked = false;
    with(|log| {
        let mut byte = [0];
        if let Some(port) = &mut log.port
            && matches!(port.read(&mut byte), Ok(1))
        {
            asked = byte == *b"s";
        }
    });
    asked
}

/// Frames that were dropped.
pub(crate) fn lost() -> u32 {
    let mut lost = 0;
    with(|log| lost = log.lost);
    lost
}

/// A frame begins; interrupts are off until its end.
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

/// More of the frame.
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

/// The frame is complete: off with it, if there is room.
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
