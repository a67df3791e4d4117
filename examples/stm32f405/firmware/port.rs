//! Interrupt-driven serial port with the library's [`ByteQueues`]. The main loop never waits for it.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use stm32f4xx_hal::nb;
use stm32f4xx_hal::pac::Interrupt;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::{Config, Error, Event, Instance, Serial};
use uav_relay::serial::{ByteQueues, Fault, InterruptEnd, Pend, QueuedPort};
use uav_relay_chip::baud::compensated_baud;

use super::{board, clock};

/// Bit rate of every port, bit/s, 8N1.
pub(crate) use uav_relay_block::BAUD;

/// Capacity of the receive queue, bytes: 11 ms of traffic.
pub(crate) const RECEIVED: usize = 128;

/// Capacity of the send queue, bytes: more than the longest frame.
///
/// The main loop can sleep while a frame is sent.
pub(crate) const OUTGOING: usize = 256;

pub(crate) type Queues<const OUT: usize = OUTGOING, const IN: usize = RECEIVED> =
    ByteQueues<IN, OUT>;

pub(crate) type Port = QueuedPort<'static, Serves>;

pub(crate) struct Serves(Interrupt);

impl Pend for Serves {
    fn pend(&mut self) {
        NVIC::pend(self.0);
    }
}

pub(crate) struct Served<U: Instance> {
    uart: Serial<U>,
    end: InterruptEnd<'static>,
}

pub(crate) type Slot<U> = Mutex<RefCell<Option<Served<U>>>>;

impl<U: Instance> Served<U> {
    /// Moves bytes from the UART to the receive queue and from the send queue to the UART, if possible.
    fn exchange(&mut self) {
        let Self { uart, end } = self;
        loop {
            end.received(match uart.read() {
                Ok(byte) => Ok(byte),
                Err(nb::Error::Other(error)) => Err(fault(error)),
                Err(nb::Error::WouldBlock) => break,
            });
            clock::wake();
        }
        if end.send(|byte| uart.write(byte).is_ok()) {
            uart.listen(Event::TxEmpty);
        } else {
            uart.unlisten(Event::TxEmpty);
        }
    }
}

/// Returns the settings of a UART whose clock has the frequency `apb_hz`, Hz.
///
/// The HAL assumes a different clock frequency, so the bit rate is corrected.
pub(crate) fn config(apb_hz: u32) -> Config {
    Config::default().baudrate(compensated_baud(BAUD, apb_hz).bps())
}

/// Passes the UART to its interrupt handler. Returns the port by which the main loop uses the handler's queues.
pub(crate) fn open<U: Instance, const OUT: usize, const IN: usize>(
    mut uart: Serial<U>,
    interrupt: Interrupt,
    slot: &'static Slot<U>,
    queues: &'static mut Queues<OUT, IN>,
) -> Port {
    uart.listen(Event::RxNotEmpty);
    let (end, port) = queues.split(Serves(interrupt));
    free(|cs| {
        if let Ok(mut place) = slot.borrow(cs).try_borrow_mut() {
            *place = Some(Served { uart, end });
        }
    });
    board::unmask(interrupt);
    port
}

pub(crate) fn serve<U: Instance>(slot: &Slot<U>) {
    free(|cs| {
        if let Ok(mut served) = slot.borrow(cs).try_borrow_mut()
            && let Some(served) = served.as_mut()
        {
            served.exchange();
        }
    });
}

fn fault(error: Error) -> Fault {
    match error {
        Error::Overrun => Fault::Overrun,
        Error::FrameFormat => Fault::Framing,
        Error::Parity => Fault::Parity,
        Error::Noise => Fault::Noise,
        _ => Fault::Other,
    }
}
