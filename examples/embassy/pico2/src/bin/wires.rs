//! A relay on a Pico 2 with a UART to each neighbour.
#![no_std]
#![no_main]

use embassy_executor::Spawner;
use relay_pico2::{block, seed, uart0, uart1};

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_rp::init(embassy_rp::config::Config::default());
    let (block, seed) = (block(chip.FLASH), seed(chip.TRNG));
    let upstream = uart0(chip.UART0, chip.PIN_0, chip.PIN_1);
    let downstream = uart1(chip.UART1, chip.PIN_4, chip.PIN_5);
    match relay_app::fly(&block, seed, upstream, downstream).await {}
}
