//! Chain on polled ports of `uav_relay::serial`.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal_nb::nb;
use embedded_hal_nb::serial::{ErrorType, Read, Write};
use uav_relay::serial::{Nb, Pair, SerialLink, Shared};
use uav_relay::{Instant, Placement, Relay, Wiring};

use crate::chain::relay;
use crate::wire::{BAUD, BYTE_TIME};

type Bytes = Rc<RefCell<VecDeque<u8>>>;

/// Port that reads one queue and writes several.
struct End {
    from: Bytes,
    to: Vec<Bytes>,
}

impl ErrorType for End {
    type Error = Infallible;
}

impl Read<u8> for End {
    fn read(&mut self) -> nb::Result<u8, Infallible> {
        let byte = self.from.borrow_mut().pop_front();
        byte.ok_or(nb::Error::WouldBlock)
    }
}

impl Write<u8> for End {
    fn write(&mut self, byte: u8) -> nb::Result<(), Infallible> {
        for to in &self.to {
            to.borrow_mut().push_back(byte);
        }
        Ok(())
    }

    fn flush(&mut self) -> nb::Result<(), Infallible> {
        Ok(())
    }
}

fn link(from: &Bytes, to: Vec<Bytes>) -> SerialLink<Nb<End>> {
    let from = Rc::clone(from);
    SerialLink::new(Nb(End { from, to }), BAUD)
}

type Polled = Box<dyn FnMut(Instant, &mut Relay) -> Option<Instant>>;

/// Returns the final positions of the chain.
pub(crate) fn places(wiring: Wiring, relays: u16) -> Vec<Option<Placement>> {
    let count = usize::from(relays);
    let queues: Vec<Bytes> = (0..2 * (count + 1)).map(|_| Bytes::default()).collect();
    let at = |queue: usize| Rc::clone(&queues[queue]);
    let mut polls: Vec<Polled> = Vec::new();
    for one in 1..=count {
        polls.push(match wiring {
            Wiring::Pair => {
                let up = link(&queues[one - 1], vec![at(count + one)]);
                let down = link(&queues[count + 1 + one], vec![at(one)]);
                let mut ports = Pair::new(up, down);
                Box::new(move |now, relay| ports.poll(now, relay, |_| true))
            }
            Wiring::Shared => {
                let others = (1..=count).filter(|other| *other != one).map(at);
                let mut ports = Shared::new(link(&queues[one], others.collect()));
                Box::new(move |now, relay| ports.poll(now, relay, |_| true))
            }
        });
    }
    let mut chain: Vec<Relay> = (1..=relays).map(|one| relay(relays, one, wiring)).collect();
    let mut now = Instant::ZERO;
    while now < Instant::from_millis(20_000) {
        let wakes = (chain.iter_mut().zip(&mut polls)).filter_map(|(relay, poll)| poll(now, relay));
        let wake = wakes.min().unwrap();
        let waits = queues.iter().any(|queue| !queue.borrow().is_empty());
        now = if waits {
            wake.min(now + BYTE_TIME)
        } else {
            wake
        };
        for relay in &mut chain {
            while relay.poll_event().is_some() {}
        }
    }
    chain.iter().map(Relay::setpoint).collect()
}
