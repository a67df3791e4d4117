//! A relay on an STM32F405 with one UART to a radio that all relays share.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, Speed};
use relay_app::drone::DroneStorage;
use relay_app::{BURST, Buffers};
use relay_stm32::{feed, init, port};
use relay_stm32f405::{Irqs, PLAN, board};
use static_cell::StaticCell;

static STORAGE: StaticCell<DroneStorage> = StaticCell::new();
static RADIO: Buffers = Buffers::new();
static AUTOPILOT: Buffers<BURST> = Buffers::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (chip, reset) = init(&PLAN);
    let board = board(chip.FLASH).reset_by(reset);
    let enable = Output::new(chip.PA1, Level::Low, Speed::Low);
    let autopilot = port(chip.USART1, chip.PA9, chip.PA10, Irqs, &AUTOPILOT).ok();
    if let Ok(radio) = port(chip.USART2, chip.PA2, chip.PA3, Irqs, &RADIO) {
        let store = STORAGE.init_with(DroneStorage::new);
        let _ = relay_app::fly_shared(store, board, radio, enable, autopilot, &mut feed).await;
    }
    relay_app::rest(feed).await;
}
