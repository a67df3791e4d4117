//! A relay on an STM32F405 with a UART to each neighbour.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use relay_app::drone::Room;
use relay_stm32f405::{board, feed, init, usart1, usart2, usart3};
use static_cell::StaticCell;

static ROOM: StaticCell<Room> = StaticCell::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (chip, reset) = init();
    let board = board(chip.FLASH).reset_by(reset);
    let upstream = usart2(chip.USART2, chip.PA2, chip.PA3);
    let downstream = usart3(chip.USART3, chip.PB10, chip.PB11);
    let autopilot = usart1(chip.USART1, chip.PA9, chip.PA10).ok();
    if let (Ok(upstream), Ok(downstream)) = (upstream, downstream) {
        let room = ROOM.init_with(Room::new);
        let _ = relay_app::fly(room, board, upstream, downstream, autopilot, &mut feed).await;
    }
    relay_app::rest(feed).await;
}
