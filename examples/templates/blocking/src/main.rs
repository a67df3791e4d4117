//! A relay on an STM32F405: an interrupt serves each UART, and one loop polls the relay.
//!
//! | pins | connected to |
//! | --- | --- |
//! | USART2: TX PA2, RX PA3 | the neighbour toward the transmitter |
//! | USART3: TX PB10, RX PB11 | the neighbour toward the receiver |
//! | PC13 | an LED, lit by a low level while the relay has a setpoint |
#![no_std]
#![no_main]

mod mission;

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::NVIC;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use critical_section::Mutex;
use mission::{BAUD, IDENTITY, MISSION};
use panic_halt as _;
use stm32f4xx_hal::pac::{self, Interrupt, USART2, USART3, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::serial::{Config, Error, Event as UartEvent, Instance, Serial};
use stm32f4xx_hal::{nb, rcc, signature::Uid};
use uav_relay::serial::{ByteQueues, Fault, InterruptEnd, Pair, SerialLink, queue_depth};
use uav_relay::{Duration, Event, Instant, Relay, Settings};

/// Queues of a UART: 10 ms of received bytes, and 256 bytes to send, more than the longest frame.
type Queues = ByteQueues<{ queue_depth(BAUD, Duration::from_millis(10)) }, 256>;

/// UART and its queues, as the interrupt handler uses them.
struct Served<U: Instance> {
    uart: Serial<U>,
    end: InterruptEnd<'static>,
}

static UPSTREAM: Mutex<RefCell<Option<Served<USART2>>>> = Mutex::new(RefCell::new(None));
static DOWNSTREAM: Mutex<RefCell<Option<Served<USART3>>>> = Mutex::new(RefCell::new(None));

/// Milliseconds since the start. The count overflows after 49 days.
static MILLIS: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    let chip = pac::Peripherals::take().unwrap();
    let core = cortex_m::Peripherals::take().unwrap();
    let mut rcc = chip.RCC.freeze(rcc::Config::hsi().sysclk(84.MHz()));
    let a = chip.GPIOA.split(&mut rcc);
    let b = chip.GPIOB.split(&mut rcc);
    let c = chip.GPIOC.split(&mut rcc);
    let mut led = c.pc13.into_push_pull_output();
    led.set_high();

    let mut tick = core.SYST;
    tick.set_clock_source(SystClkSource::Core);
    tick.set_reload(rcc.clocks.sysclk().raw() / 1_000 - 1);
    tick.clear_current();
    tick.enable_counter();
    tick.enable_interrupt();

    let config = || Config::default().baudrate(BAUD.bps());
    let mut usart2 = Serial::new(chip.USART2, (a.pa2, a.pa3), config(), &mut rcc).unwrap();
    let mut usart3 = Serial::new(chip.USART3, (b.pb10, b.pb11), config(), &mut rcc).unwrap();
    usart2.listen(UartEvent::RxNotEmpty);
    usart3.listen(UartEvent::RxNotEmpty);

    let up = cortex_m::singleton!(UP: Queues = Queues::new()).unwrap();
    let down = cortex_m::singleton!(DOWN: Queues = Queues::new()).unwrap();
    let (up_end, up_port) = up.split(|| NVIC::pend(Interrupt::USART2));
    let (down_end, down_port) = down.split(|| NVIC::pend(Interrupt::USART3));
    critical_section::with(|cs| {
        UPSTREAM.borrow(cs).replace(Some(Served {
            uart: usart2,
            end: up_end,
        }));
        DOWNSTREAM.borrow(cs).replace(Some(Served {
            uart: usart3,
            end: down_end,
        }));
    });
    // SAFETY: both drivers are in place, and no critical section relies on a single masked interrupt.
    unsafe {
        NVIC::unmask(Interrupt::USART2);
        NVIC::unmask(Interrupt::USART3);
    }

    let mut ports = Pair::new(
        SerialLink::new(up_port, BAUD),
        SerialLink::new(down_port, BAUD),
    );
    let id = Uid::get();
    let seed = u32::from(id.x()) << 16 ^ u32::from(id.y()) ^ u32::from(id.waf_num()) << 8;
    let mut relay = Relay::new(MISSION, IDENTITY, Settings::wires(BAUD), seed, now()).unwrap();
    loop {
        // This board stores no votes. So leave the relay off after a reboot in flight.
        ports.poll(now(), &mut relay, |_| true);
        while let Some(event) = relay.poll_event() {
            if event == Event::SetpointChanged {
                // Pass `relay.setpoint()` to the flight controller here.
                led.set_state(relay.setpoint().is_none().into());
            }
        }
        // The call returns at the next byte, or at the next millisecond.
        cortex_m::asm::wfi();
    }
}

fn now() -> Instant {
    Instant::from_millis(MILLIS.load(Ordering::Relaxed).into())
}

#[exception]
fn SysTick() {
    MILLIS.fetch_add(1, Ordering::Relaxed);
}

#[interrupt]
fn USART2() {
    serve(&UPSTREAM);
}

#[interrupt]
fn USART3() {
    serve(&DOWNSTREAM);
}

/// Moves bytes from the UART to the receive queue, and from the send queue to the UART.
fn serve<U: Instance>(slot: &Mutex<RefCell<Option<Served<U>>>>) {
    critical_section::with(|cs| {
        let mut slot = slot.borrow_ref_mut(cs);
        let Some(Served { uart, end }) = slot.as_mut() else {
            return;
        };
        loop {
            match uart.read() {
                Ok(byte) => end.received(Ok(byte)),
                Err(nb::Error::Other(error)) => end.received(Err(fault(error))),
                Err(nb::Error::WouldBlock) => break,
            }
        }
        if end.send(|byte| uart.write(byte).is_ok()) {
            uart.listen(UartEvent::TxEmpty);
        } else {
            uart.unlisten(UartEvent::TxEmpty);
        }
    });
}

fn fault(error: Error) -> Fault {
    match error {
        Error::Overrun => Fault::Overrun,
        Error::FrameFormat => Fault::Framing,
        Error::Parity => Fault::Parity,
        Error::Noise => Fault::Noise,
        _ => Fault::Other,
    }
}
