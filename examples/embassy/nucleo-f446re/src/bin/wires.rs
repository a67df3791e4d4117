//! A relay on a NUCLEO-F446RE with a UART to each neighbour.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use relay_app::drone::DroneStorage;
use relay_app::{BURST, Buffers};
use relay_nucleo_f446re::{Irqs, PLAN, board};
use relay_stm32::{feed, init, port};
use static_cell::StaticCell;

static STORAGE: StaticCell<DroneStorage> = StaticCell::new();
static UPSTREAM: Buffers = Buffers::new();
static DOWNSTREAM: Buffers = Buffers::new();
static AUTOPILOT: Buffers<BURST> = Buffers::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (chip, reset) = init(&PLAN);
    let board = board(chip.FLASH).reset_by(reset);
    let upstream = port(chip.USART1, chip.PA9, chip.PA10, Irqs, &UPSTREAM);
    let downstream = port(chip.USART3, chip.PC10, chip.PC11, Irqs, &DOWNSTREAM);
    let autopilot = port(chip.USART6, chip.PC6, chip.PC7, Irqs, &AUTOPILOT).ok();
    if let (Ok(upstream), Ok(downstream)) = (upstream, downstream) {
        let store = STORAGE.init_with(DroneStorage::new);
        let _ = relay_app::fly(store, board, upstream, downstream, autopilot, &mut feed).await;
    }
    relay_app::rest(feed).await;
}
