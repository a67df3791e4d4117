//! A relay on an STM32F405 with one UART to a radio that all relays share.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_stm32::gpio::{Level, Output, Speed};
use relay_stm32f405::{block, seed, usart2};

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_stm32::init(embassy_stm32::Config::default());
    let block = block(chip.FLASH);
    let enable = Output::new(chip.PA1, Level::Low, Speed::Low);
    if let Ok(radio) = usart2(chip.USART2, chip.PA2, chip.PA3) {
        match relay_app::fly_shared(&block, seed(), radio, enable).await {}
    }
}
