//! Relay of `stm32f405` on asynchronous ports, run by `uav_relay::asynch` on an executor of 30 lines.
//!
//! Wiring, drone and log are the same.
//!
//! This image is for comparison with the polled image (`cargo cost`), and for the emulator (`cargo test --test qemu`).
//! Embassy would wait forever for a clock that QEMU lacks. For your own board begin with `examples/embassy`. It has no
//! autopilot link: a drone whose block has Tx and Rx positions does not join the chain.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod executor;
#[cfg(target_os = "none")]
#[allow(
    dead_code,
    reason = "parts that only polled ports or an autopilot need"
)]
mod firmware;
#[cfg(target_os = "none")]
#[allow(dead_code, reason = "what only polled ports call")]
mod no_autopilot;
#[cfg(target_os = "none")]
mod ports;
#[cfg(target_os = "none")]
mod wires;

#[cfg(target_os = "none")]
use firmware::{board, chip, clock, drone, log, port};
#[cfg(target_os = "none")]
use no_autopilot as autopilot;

#[cfg(target_os = "none")]
#[cortex_m_rt::entry]
fn main() -> ! {
    use uav_relay::Wiring;

    let Some((mut clock, upstream, downstream, uart)) = wires::start() else {
        board::stop()
    };
    // A drone without a valid configuration sleeps forever.
    let Some(drone) = drone::begin(Wiring::Pair, uart, clock.now()) else {
        board::stop()
    };
    fly(clock, upstream, downstream, drone)
}

#[cfg(target_os = "none")]
fn fly(
    clock: clock::Clock,
    upstream: port::Port,
    downstream: port::Port,
    drone: drone::Drone,
) -> ! {
    use core::cell::RefCell;
    use core::pin::pin;

    use embassy_futures::select::select;
    use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay};

    let time = executor::Time::new(clock);
    let drone::Drone {
        relay,
        views,
        autopilot: None,
    } = drone
    else {
        board::stop()
    };
    let relay = AsyncRelay::new(relay);
    let (upstream, downstream) = (RefCell::new(upstream), RefCell::new(downstream));
    let link = |port| {
        let (rx, tx) = ports::halves(port, &time);
        AsyncLink::new(rx, tx, port::BAUD)
    };
    let mut ports = AsyncPair::new(link(&upstream), link(&downstream));
    let store = |record: &uav_relay::ViewRecord| views.store(record);
    let runs = ports.run(&relay, &time, store);
    executor::run(pin!(select(runs, log_events(&relay))), &time, || {
        let now = uav_relay::asynch::Clock::now(&time);
        relay.look(|relay| chip::end_turn(relay, now));
        if log::counters_requested() {
            relay.look(log::counters);
            for port in [uav_relay::Port::Upstream, uav_relay::Port::Downstream] {
                log::link_counters(&relay.stats(port));
            }
        }
    })
}

/// Logs the relay's events, and stores uploaded missions.
#[cfg(target_os = "none")]
async fn log_events(relay: &uav_relay::asynch::AsyncRelay<'_>) -> core::convert::Infallible {
    loop {
        let event = relay.next_event().await;
        relay.look(|relay| {
            log::event(event, relay);
            #[cfg(feature = "upload")]
            if event == uav_relay::Event::Uploaded {
                firmware::persistent::store_upload(relay);
            }
        });
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    println!(
        "The firmware of a relay on an STM32F405, with an asynchronous serial port to each neighbour.\n\
         Build it with: cargo build --profile firmware --target thumbv7em-none-eabihf --example stm32f405_async --features async"
    );
}
