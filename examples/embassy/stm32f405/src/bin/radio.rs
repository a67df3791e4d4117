//! A relay on an STM32F405 with one UART to a radio that all relays share.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, Speed};
use relay_app::drone::Room;
use relay_stm32f405::{board, feed, init, usart1, usart2};
use static_cell::StaticCell;

static ROOM: StaticCell<Room> = StaticCell::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (chip, reset) = init();
    let board = board(chip.FLASH).reset_by(reset);
    let enable = Output::new(chip.PA1, Level::Low, Speed::Low);
    let autopilot = usart1(chip.USART1, chip.PA9, chip.PA10).ok();
    if let Ok(radio) = usart2(chip.USART2, chip.PA2, chip.PA3) {
        let room = ROOM.init_with(Room::new);
        let _ = relay_app::fly_shared(room, board, radio, enable, autopilot, &mut feed).await;
    }
    relay_app::rest(feed).await;
}
