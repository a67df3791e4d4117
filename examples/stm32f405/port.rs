//! A serial port that an interrupt serves: the main loop hands bytes over and never waits.

use core::cell::RefCell;

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::NVIC;
use heapless::Deque;
use stm32f4xx_hal::nb;
use stm32f4xx_hal::pac::Interrupt;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::{Config, Error, Event, Instance, Serial};
use uav_relay::serial::{Fault, SerialPort};

use super::{board, clock};

/// Bits a second on every port, 8N1.
pub(crate) const BAUD: u32 = 115_200;

/// Received bytes that can wait for the main loop: 11 ms of them at full speed.
const RECEIVED: usize = 128;

/// Bytes that can wait to leave: the longest frame, so that the main loop can sleep meanwhile.
pub(crate) const OUTGOING: usize = 256;

/// Bytes between the interrupt and the main loop: room for `OUT` on their way out, and for `IN` on their way in.
pub(crate) struct Queues<const OUT: usize, const IN: usize = RECEIVED> {
    /// Received bytes, or what went wrong instead.
    received: Deque<Result<u8, Fault>, IN>,
    outgoing: Deque<u8, OUT>,
    /// Whether something was lost for want of room and the main loop has not been told.
    lost: bool,
}

impl<const OUT: usize, const IN: usize> Queues<OUT, IN> {
    pub(crate) const fn new() -> Mutex<RefCell<Self>> {
        Mutex::new(RefCell::new(Self {
            received: Deque::new(),
            outgoing: Deque::new(),
            lost: false,
        }))
    }
}

/// Where the interrupt of a port finds its UART.
pub(crate) type Slot<U> = Mutex<RefCell<Option<Serial<U>>>>;

/// Moves bytes both ways until the port has none and takes none.
fn exchange<U: Instance, const OUT: usize, const IN: usize>(
    uart: &mut Serial<U>,
    queues: &mut Queues<OUT, IN>,
) {
    loop {
        let item = match uart.read() {
            Ok(byte) => Ok(byte),
            Err(nb::Error::Other(error)) => Err(fault(error)),
            Err(nb::Error::WouldBlock) => break,
        };
        if queues.lost && queues.received.push_back(Err(Fault::Overrun)).is_ok() {
            queues.lost = false;
        }
        queues.lost |= queues.received.push_back(item).is_err();
        clock::wake();
    }
    while let Some(&byte) = queues.outgoing.front() {
        if uart.write(byte).is_err() {
            return uart.listen(Event::TxEmpty);
        }
        let _ = queues.outgoing.pop_front();
    }
    uart.unlisten(Event::TxEmpty);
}

/// The main loop's end of a port. Interrupts are off for a byte at a time, so that none is overrun.
pub(crate) struct Port<const OUT: usize = OUTGOING, const IN: usize = RECEIVED> {
    queues: &'static Mutex<RefCell<Queues<OUT, IN>>>,
    interrupt: Interrupt,
}

impl<const OUT: usize, const IN: usize> Port<OUT, IN> {
    fn with<R>(&self, work: impl FnOnce(&mut Queues<OUT, IN>) -> R) -> Option<R> {
        free(|cs| {
            let mut queues = self.queues.borrow(cs).try_borrow_mut().ok()?;
            Some(work(&mut queues))
        })
    }

    /// How many bytes `write` would take now.
    #[cfg(any(feature = "flight", all(feature = "defmt", not(feature = "rtt"))))]
    pub(crate) fn room(&self) -> usize {
        self.with(|queues| OUT.saturating_sub(queues.outgoing.len()))
            .unwrap_or(0)
    }
}

impl<const OUT: usize, const IN: usize> SerialPort for Port<OUT, IN> {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        let mut count = 0;
        for place in into {
            let next = self.with(|queues| {
                // What came before a fault is handed over first.
                if count > 0 && matches!(queues.received.front(), Some(Err(_))) {
                    return None;
                }
                queues.received.pop_front()
            });
            match next.flatten() {
                Some(Ok(byte)) => *place = byte,
                Some(Err(fault)) => return Err(fault),
                None => break,
            }
            count += 1;
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let fits = |&&byte: &&u8| {
            self.with(|queues| queues.outgoing.push_back(byte).is_ok())
                .unwrap_or(false)
        };
        let count = bytes.iter().take_while(fits).count();
        // The interrupt owns the UART and sees to the rest.
        NVIC::pend(self.interrupt);
        Ok(count)
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        Ok(None)
    }
}

/// What every port is set to.
pub(crate) fn config() -> Config {
    Config::default().baudrate(BAUD.bps())
}

/// Gives the UART to its interrupt, and the other end of the queues to the caller.
pub(crate) fn open<U: Instance, const OUT: usize, const IN: usize>(
    mut uart: Serial<U>,
    interrupt: Interrupt,
    slot: &'static Slot<U>,
    queues: &'static Mutex<RefCell<Queues<OUT, IN>>>,
) -> Port<OUT, IN> {
    uart.listen(Event::RxNotEmpty);
    free(|cs| {
        if let Ok(mut place) = slot.borrow(cs).try_borrow_mut() {
            *place = Some(uart);
        }
    });
    board::unmask(interrupt);
    Port { queues, interrupt }
}

/// What the interrupt of a port does.
pub(crate) fn serve<U: Instance, const OUT: usize, const IN: usize>(
    slot: &Slot<U>,
    queues: &Mutex<RefCell<Queues<OUT, IN>>>,
) {
    free(|cs| {
        if let Ok(mut uart) = slot.borrow(cs).try_borrow_mut()
            && let Some(uart) = uart.as_mut()
            && let Ok(mut queues) = queues.borrow(cs).try_borrow_mut()
        {
            exchange(uart, &mut queues);
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
