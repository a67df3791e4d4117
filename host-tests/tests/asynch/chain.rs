//! Chains of relays on asynchronous ports, each a task of one executor.

use std::cell::RefCell;
use std::pin::Pin;
use std::rc::Rc;

use embassy_futures::join::join;
use futures_executor::LocalPool;
use futures_util::task::LocalSpawnExt as _;
use host_tests::fixtures;
use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, AsyncShared};
use uav_relay::serial::SerialStats;
use uav_relay::{Event, Instant, Placement, Port, Wiring};

use crate::time::Time;
use crate::wire::{BAUD, Rx, Shared, TimedFrame, Tx, WriterFault, line};

/// Fault to inject, if any: index of the relay, its port, and the behaviour of the port's writer.
pub(crate) type InjectedFault = Option<(u16, Port, WriterFault)>;

fn fault_at(injected: InjectedFault, index: u16, port: Port) -> WriterFault {
    match injected {
        Some((of, at, fault)) if (of, at) == (index, port) => fault,
        _ => WriterFault::None,
    }
}

/// Recorded outputs of one relay: setpoint, events and counters.
#[derive(Clone, PartialEq, Debug, Default)]
pub(crate) struct Drone {
    pub(crate) setpoint: Option<Placement>,
    pub(crate) events: Vec<(Instant, Event)>,
    pub(crate) rejected: u32,
    /// Statistics of the relay's ports: the upstream or shared port first, then the downstream port.
    pub(crate) counted: [SerialStats; 2],
}

/// Result of a simulated chain: recorded outputs of each relay, and the frames on each serial line.
pub(crate) struct Flown {
    pub(crate) drones: Vec<Drone>,
    /// Frames on each wire: first the wires toward Rx, then the wires toward Tx. A shared channel is one entry.
    pub(crate) lines: Vec<Vec<TimedFrame>>,
}

/// Simulates a chain until a given time. Each relay has a task, and its firmware has another task.
pub(crate) fn fly(
    wiring: Wiring,
    relays: u16,
    capacity: usize,
    injected: InjectedFault,
    until: Instant,
) -> Flown {
    let time = Time::default();
    let mut pool = LocalPool::new();
    let count = usize::from(relays);
    let lines: Vec<Shared> = match wiring {
        Wiring::Shared => vec![line(count, capacity)],
        Wiring::Pair => (0..2 * (count + 1)).map(|_| line(2, capacity)).collect(),
    };
    let drones: Vec<Rc<RefCell<Drone>>> = (0..count).map(|_| Rc::default()).collect();
    for (index, drone) in (1..=relays).zip(&drones) {
        let at = usize::from(index);
        let drone = Rc::clone(drone);
        let time = time.clone();
        let rx = |line: usize, end| Rx {
            line: Rc::clone(&lines[line]),
            end,
            time: time.clone(),
        };
        let tx = |line: usize, end, port| Tx {
            line: Rc::clone(&lines[line]),
            end,
            time: time.clone(),
            fault: fault_at(injected, index, port),
        };
        // The sender of every wire is at end 0.
        let task: Pin<Box<dyn Future<Output = ()>>> = match wiring {
            Wiring::Pair => {
                let up = (rx(at - 1, 1), tx(count + at, 0, Port::Upstream));
                let down = (rx(count + 1 + at, 1), tx(at, 0, Port::Downstream));
                let [up, down] = [up, down].map(|(rx, tx)| AsyncLink::new(rx, tx, BAUD));
                let mut ports = AsyncPair::new(up, down);
                let time = time.clone();
                Box::pin(async move {
                    let mut relay = fixtures::wired(relays, index, wiring);
                    let relay = AsyncRelay::new(&mut relay);
                    let runs = ports.run(&relay, &time, |_| true);
                    join(runs, firmware(&relay, &time, &drone)).await;
                })
            }
            Wiring::Shared => {
                let (rx, tx) = (rx(0, at - 1), tx(0, at - 1, Port::Shared));
                let mut ports = AsyncShared::new(AsyncLink::new(rx, tx, BAUD));
                let time = time.clone();
                Box::pin(async move {
                    let mut relay = fixtures::wired(relays, index, wiring);
                    let relay = AsyncRelay::new(&mut relay);
                    let runs = ports.run(&relay, &time, |_| true);
                    join(runs, firmware(&relay, &time, &drone)).await;
                })
            }
        };
        pool.spawner().spawn_local(task).unwrap();
    }
    time.run(&mut pool, until);
    Flown {
        drones: drones.iter().map(|drone| drone.borrow().clone()).collect(),
        lines: lines
            .iter()
            .map(|line| line.borrow().frames.clone())
            .collect(),
    }
}

/// Runs a relay's firmware: records the relay's events, setpoint and counters.
async fn firmware(relay: &AsyncRelay<'_>, time: &Time, drone: &RefCell<Drone>) {
    use uav_relay::asynch::Clock as _;
    loop {
        let event = relay.next_event().await;
        let mut drone = drone.borrow_mut();
        drone.events.push((time.now(), event));
        relay.with(|relay| {
            drone.setpoint = relay.setpoint();
            drone.rejected = relay.stats().rejected();
        });
        drone.counted = [Port::Upstream, Port::Downstream].map(|port| relay.stats(port));
    }
}

pub(crate) fn setpoints(flown: &Flown) -> Vec<Option<Placement>> {
    flown.drones.iter().map(|drone| drone.setpoint).collect()
}
