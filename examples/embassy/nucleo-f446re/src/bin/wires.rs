//! A relay on a NUCLEO-F446RE with a UART to each neighbour.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use relay_app::drone::Room;
use relay_nucleo_f446re::{board, feed, init, usart1, usart3, usart6};
use static_cell::StaticCell;

static ROOM: StaticCell<Room> = StaticCell::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let (chip, reset) = init();
    let board = board(chip.FLASH).reset_by(reset);
    let upstream = usart1(chip.USART1, chip.PA9, chip.PA10);
    let downstream = usart3(chip.USART3, chip.PC10, chip.PC11);
    let autopilot = usart6(chip.USART6, chip.PC6, chip.PC7).ok();
    if let (Ok(upstream), Ok(downstream)) = (upstream, downstream) {
        let room = ROOM.init_with(Room::new);
        let _ = relay_app::fly(room, board, upstream, downstream, autopilot, &mut feed).await;
    }
    relay_app::rest(feed).await;
}
