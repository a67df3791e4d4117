//! Relay on an STM32F405 with Embassy. One port receives by interrupts, the other by DMA.
//!
//! | pins | connected to |
//! | --- | --- |
//! | USART2: TX PA2, RX PA3 | the neighbour toward the transmitter |
//! | USART3: TX PB10, RX PB11 | the neighbour toward the receiver |
//! | PC13 | an LED, lit by a low level while the relay has a setpoint |
#![no_std]
#![no_main]

mod mission;

use core::future::Future;

use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{DMA1_CH1, DMA1_CH3, USART2, USART3};
use embassy_stm32::usart::{self, BufferedInterruptHandler, BufferedUart, Uart};
use embassy_stm32::{bind_interrupts, dma};
use embassy_time::Timer;
use mission::{BAUD, IDENTITY, MISSION};
use panic_halt as _;
use static_cell::StaticCell;
use uav_relay::asynch::{AsyncLink, AsyncPair, AsyncRelay, Clock};
use uav_relay::{Event, Instant, Relay, Settings};

bind_interrupts!(struct Irqs {
    USART2 => BufferedInterruptHandler<USART2>;
    USART3 => usart::InterruptHandler<USART3>;
    DMA1_STREAM1 => dma::InterruptHandler<DMA1_CH1>;
    DMA1_STREAM3 => dma::InterruptHandler<DMA1_CH3>;
});

/// Clock of the relay, based on Embassy's time driver.
struct EmbassyClock;

impl Clock for EmbassyClock {
    fn now(&self) -> Instant {
        Instant::from_micros(embassy_time::Instant::now().as_micros())
    }

    fn sleep_until(&self, at: Instant) -> impl Future<Output = ()> {
        Timer::at(embassy_time::Instant::from_micros(at.as_micros()))
    }
}

/// Static storage of the relay: about 10 KB, too large for the stack.
static RELAY: StaticCell<Option<Relay>> = StaticCell::new();
static SENT: StaticCell<[u8; 256]> = StaticCell::new();
static RECEIVED: StaticCell<[u8; 256]> = StaticCell::new();
static RING: StaticCell<[u8; 256]> = StaticCell::new();

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let chip = embassy_stm32::init(embassy_stm32::Config::default());
    let mut led = Output::new(chip.PC13, Level::High, Speed::Low);
    let mut config = usart::Config::default();
    config.baudrate = BAUD;

    // The driver's interrupt moves single bytes to and from two buffers.
    let (sent, received) = (SENT.init([0; 256]), RECEIVED.init([0; 256]));
    let upstream = BufferedUart::new(
        chip.USART2,
        chip.PA3,
        chip.PA2,
        sent,
        received,
        Irqs,
        config,
    );
    let (up_tx, up_rx) = upstream.unwrap().split();

    // DMA writes received bytes into a ring buffer. `read` returns when no more bytes arrive or half of the buffer is
    // full.
    let downstream = Uart::new(
        chip.USART3,
        chip.PB11,
        chip.PB10,
        chip.DMA1_CH3,
        chip.DMA1_CH1,
        Irqs,
        config,
    );
    let (down_tx, down_rx) = downstream.unwrap().split();
    let down_rx = down_rx.into_ring_buffered(RING.init([0; 256]));

    let seed = seed(embassy_stm32::uid::uid());
    let slot = RELAY.init(None);
    let now = EmbassyClock.now();
    let relay = Relay::new_in(slot, &MISSION, IDENTITY, &Settings::wires(BAUD), seed, now).unwrap();
    let relay = AsyncRelay::new(relay);
    let mut ports = AsyncPair::new(
        AsyncLink::new(up_rx, up_tx, BAUD),
        AsyncLink::new(down_rx, down_tx, BAUD),
    );
    let firmware = async {
        loop {
            if relay.next_event().await == Event::SetpointChanged {
                // Pass the setpoint to the flight controller here.
                let setpoint = relay.look(Relay::setpoint).flatten();
                led.set_level(setpoint.is_none().into());
            }
        }
    };
    // This board stores no votes. So leave the relay off after a reboot in flight.
    join(ports.run(&relay, &EmbassyClock, |_| true), firmware).await;
}

/// Returns a seed: an FNV-1a hash of the chip's unique number.
fn seed(id: [u8; 12]) -> u32 {
    id.into_iter().fold(0x811C_9DC5, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    })
}
