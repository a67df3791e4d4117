//! The application of every board here: it reads the configuration block, makes the relay, runs its ports, and logs where to fly.
//!
//! A board brings its block, a seed, and the halves of its UARTs. What it does not have: an autopilot, an epoch kept in flash (so it
//! takes no block with a key), and votes that survive a reboot in flight. `examples/stm32f405` has all three.
#![no_std]
#![forbid(unsafe_code)]

use core::convert::Infallible;
use core::future::Future;

use defmt::{error, info};
use embassy_futures::join::join;
use embassy_time::Timer;
use embedded_hal::digital::OutputPin;
use embedded_io_async::{Read, Write};
use static_cell::StaticCell;
use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, AsyncShared, Clock};
use uav_relay::serial::byte_time;
use uav_relay::{Event, Instant, Relay, Settings, Wiring};
use uav_relay_block as config;

/// Bits a second on every port, 8N1.
pub use uav_relay_block::BAUD;

/// Bytes that the driver of a UART holds each way: 22 ms of them, where a call of the relay takes 3.
pub const BUFFER: usize = 256;

/// Embassy's clock.
#[derive(Clone, Copy, Debug)]
pub struct EmbassyClock;

impl Clock for EmbassyClock {
    fn now(&self) -> Instant {
        Instant::from_micros(embassy_time::Instant::now().as_micros())
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        Timer::at(embassy_time::Instant::from_micros(at.as_micros()))
    }
}

/// Flies the relay of `block` with a UART to each neighbour, given as reader and writer. Called once.
pub async fn fly<UR: Read, UW: Write, DR: Read, DW: Write>(
    block: &config::Block,
    seed: u32,
    (up_rx, up_tx): (UR, UW),
    (down_rx, down_tx): (DR, DW),
) -> Infallible {
    let relay = configured(block, Wiring::Pair, seed).await;
    let relay = AsyncRelay::new(relay);
    let mut ports = AsyncPair::new(
        AsyncLink::new(up_rx, up_tx, byte_time(BAUD)),
        AsyncLink::new(down_rx, down_tx, byte_time(BAUD)),
    );
    join(ports.run(&relay, &EmbassyClock), log(&relay)).await.0
}

/// The same with one UART to a radio that all relays share; `pin` is high while this one sends. Called once.
pub async fn fly_shared<R: Read, W: Write, D: OutputPin>(
    block: &config::Block,
    seed: u32,
    (rx, tx): (R, W),
    pin: D,
) -> Infallible {
    let relay = configured(block, Wiring::Shared, seed).await;
    let relay = AsyncRelay::new(relay);
    let link = AsyncLink::half_duplex(rx, tx, byte_time(BAUD), pin);
    let mut ports = AsyncShared::new(link);
    join(ports.run(&relay, &EmbassyClock), log(&relay)).await.0
}

/// The relay of a block; without one to fly by this waits for good.
async fn configured(block: &config::Block, wiring: Wiring, seed: u32) -> &'static mut Relay {
    static FIELD: StaticCell<config::Room> = StaticCell::new();
    static RELAY: StaticCell<Option<Relay>> = StaticCell::new();
    let refused = match config::read(block, FIELD.init(config::EMPTY)) {
        Err(refused) => refused,
        Ok(_) if config::secret(block) != Ok(None) => {
            error!("the block has a key, and this image keeps no epoch: it cannot sign");
            core::future::pending().await
        }
        Ok(said) if said.sites.is_some() => {
            error!("the block has sites, and this image tells no autopilot where to fly");
            core::future::pending().await
        }
        Ok(said) => {
            let identity = said.identity;
            let relays = said.mission.relays();
            info!(
                "relay {} of {}, network {}",
                identity.index, relays, identity.network
            );
            let common = said.mission.config().common;
            let settings = Settings {
                profile: Some(said.profile).filter(|own| said.hold_altitude || *own != common),
                hold_altitude: said.hold_altitude,
                method: said.method,
                measure: said.measure,
                listen: said.listen,
                wiring,
                ..Settings::default()
            };
            let (slot, now) = (RELAY.init(None), EmbassyClock.now());
            match Relay::new_in(slot, &said.mission, identity, &settings, seed, now) {
                Ok(relay) => return relay,
                Err(refused) => {
                    error!("this image cannot fly that: {}", refused);
                    core::future::pending().await
                }
            }
        }
    };
    error!("configuration refused: {}", defmt::Debug2Format(&refused));
    core::future::pending().await
}

/// Logs what happens, and where to fly. An autopilot is told here.
async fn log(relay: &AsyncRelay<'_>) -> Infallible {
    loop {
        let event = relay.next_event().await;
        info!("event {}", event);
        if event == Event::SetpointChanged
            && let Some(place) = relay.look(Relay::setpoint).flatten()
        {
            let bits = [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits);
            info!(
                "setpoint x {} m ({:#010x}) y {} m ({:#010x}) altitude {} m ({:#010x})",
                place.x_m, bits[0], place.y_m, bits[1], place.altitude_m, bits[2]
            );
        }
    }
}
