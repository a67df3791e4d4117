//! A relay on a Pico 2 with a UART to each neighbour.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use relay_app::Buffers;
use relay_app::drone::DroneStorage;
use relay_pico2::{Guard, NO_AUTOPILOT, board, port};
use static_cell::StaticCell;

static STORAGE: StaticCell<DroneStorage> = StaticCell::new();
static UPSTREAM: Buffers = Buffers::new();
static DOWNSTREAM: Buffers = Buffers::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    let (mut guard, reset) = Guard::start(chip.WATCHDOG);
    let board = board(chip.FLASH, chip.TRNG).reset_by(reset);
    let upstream = port(chip.UART0, chip.PIN_0, chip.PIN_1, &UPSTREAM);
    let downstream = port(chip.UART1, chip.PIN_4, chip.PIN_5, &DOWNSTREAM);
    let store = STORAGE.init_with(DroneStorage::new);
    let _ = relay_app::fly(
        store,
        board,
        upstream,
        downstream,
        NO_AUTOPILOT,
        &mut || {
            guard.feed();
        },
    )
    .await;
    relay_app::rest(|| guard.feed()).await;
}
