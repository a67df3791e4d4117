//! A relay on a Pico 2 with one UART to a radio that all relays share.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use embassy_rp::gpio::{Level, Output};
use relay_pico2::{block, seed, uart0};

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    let (block, seed) = (block(chip.FLASH), seed(chip.TRNG));
    let radio = uart0(chip.UART0, chip.PIN_0, chip.PIN_1);
    let enable = Output::new(chip.PIN_2, Level::Low);
    match relay_app::fly_shared(&block, seed, radio, enable).await {}
}
