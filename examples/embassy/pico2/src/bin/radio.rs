//! Relay on a Pico 2 with one UART to a radio shared by all relays, and one UART to an autopilot.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_rp::gpio::{Level, Output};
use relay_app::drone::DroneStorage;
use relay_app::{BURST, Buffers};
use relay_pico2::{Guard, board, port};
use static_cell::StaticCell;

static STORAGE: StaticCell<DroneStorage> = StaticCell::new();
static RADIO: Buffers = Buffers::new();
static AUTOPILOT: Buffers<BURST> = Buffers::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    let (mut guard, reset) = Guard::start(chip.WATCHDOG);
    let board = board(chip.FLASH, chip.TRNG).reset_by(reset);
    let radio = port(chip.UART0, chip.PIN_0, chip.PIN_1, &RADIO);
    let autopilot = port(chip.UART1, chip.PIN_4, chip.PIN_5, &AUTOPILOT);
    let enable = Output::new(chip.PIN_2, Level::Low);
    let store = STORAGE.init_with(DroneStorage::new);
    let _ = relay_app::fly_shared(store, board, radio, enable, Some(autopilot), &mut || {
        guard.feed();
    })
    .await;
    relay_app::rest(|| guard.feed()).await;
}
