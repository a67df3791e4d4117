//! A relay on an STM32F405 with RTIC 2: a hardware task serves each UART, and `idle` polls the relay.
//!
//! | pins | connected to |
//! | --- | --- |
//! | USART2: TX PA2, RX PA3 | the neighbour toward the transmitter |
//! | USART3: TX PB10, RX PB11 | the neighbour toward the receiver |
//! | PC13 | an LED, lit by a low level while the relay has a setpoint |
#![no_std]
#![no_main]

mod mission;

use panic_halt as _;
use rtic_monotonics::systick::prelude::*;

systick_monotonic!(Mono, 1_000);

#[rtic::app(device = stm32f4xx_hal::pac, peripherals = true)]
mod app {
    use super::Mono;
    use super::mission::{BAUD, IDENTITY, MISSION};
    use rtic_monotonics::Monotonic;
    use stm32f4xx_hal::gpio::{Output, PC13};
    use stm32f4xx_hal::pac::{Interrupt, USART2, USART3};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::serial::{Config, Error, Event as UartEvent, Instance, Serial};
    use stm32f4xx_hal::{nb, rcc, signature::Uid};
    use uav_relay::serial::{
        ByteQueues, Fault, InterruptEnd, Pair, Pend, QueuedPort, SerialLink, queue_depth,
    };
    use uav_relay::{Duration, Event, Instant, Relay, Settings};

    /// Queues of a UART: 10 ms of received bytes, and 256 bytes to send, more than the longest frame.
    type Queues = ByteQueues<{ queue_depth(BAUD, Duration::from_millis(10)) }, 256>;

    /// UART and its queues, as the interrupt handler uses them.
    pub struct Served<U: Instance> {
        uart: Serial<U>,
        end: InterruptEnd<'static>,
    }

    /// Interrupt of a UART. It is set pending to start a transmission.
    pub struct Request(Interrupt);

    impl Pend for Request {
        fn pend(&mut self) {
            rtic::pend(self.0);
        }
    }

    type Port = QueuedPort<'static, Request>;

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        upstream: Served<USART2>,
        downstream: Served<USART3>,
        ports: Pair<Port, Port>,
        relay: Relay,
        led: PC13<Output>,
    }

    #[init(local = [up: Queues = Queues::new(), down: Queues = Queues::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let chip = cx.device;
        let mut rcc = chip.RCC.freeze(rcc::Config::hsi().sysclk(84.MHz()));
        Mono::start(cx.core.SYST, rcc.clocks.sysclk().raw());
        let a = chip.GPIOA.split(&mut rcc);
        let b = chip.GPIOB.split(&mut rcc);
        let c = chip.GPIOC.split(&mut rcc);
        let mut led = c.pc13.into_push_pull_output();
        led.set_high();

        let config = || Config::default().baudrate(BAUD.bps());
        let mut usart2 = Serial::new(chip.USART2, (a.pa2, a.pa3), config(), &mut rcc).unwrap();
        let mut usart3 = Serial::new(chip.USART3, (b.pb10, b.pb11), config(), &mut rcc).unwrap();
        usart2.listen(UartEvent::RxNotEmpty);
        usart3.listen(UartEvent::RxNotEmpty);
        let (up_end, up_port) = cx.local.up.split(Request(Interrupt::USART2));
        let (down_end, down_port) = cx.local.down.split(Request(Interrupt::USART3));
        let ports = Pair::new(
            SerialLink::new(up_port, BAUD),
            SerialLink::new(down_port, BAUD),
        );

        let id = Uid::get();
        let seed = u32::from(id.x()) << 16 ^ u32::from(id.y()) ^ u32::from(id.waf_num()) << 8;
        let relay = Relay::new(MISSION, IDENTITY, Settings::wires(BAUD), seed, now()).unwrap();
        let local = Local {
            upstream: Served {
                uart: usart2,
                end: up_end,
            },
            downstream: Served {
                uart: usart3,
                end: down_end,
            },
            ports,
            relay,
            led,
        };
        (Shared {}, local)
    }

    #[idle(local = [ports, relay, led])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources {
            ports, relay, led, ..
        } = cx.local;
        loop {
            // This board stores no votes. So leave the relay off after a reboot in flight.
            ports.poll(now(), relay, |_| true);
            while let Some(event) = relay.poll_event() {
                if event == Event::SetpointChanged {
                    // Pass `relay.setpoint()` to the flight controller here.
                    led.set_state(relay.setpoint().is_none().into());
                }
            }
            // The call returns at the next byte, or after at most a millisecond.
            rtic::export::wfi();
        }
    }

    #[task(binds = USART2, local = [upstream], priority = 2)]
    fn usart2(cx: usart2::Context) {
        cx.local.upstream.serve();
    }

    #[task(binds = USART3, local = [downstream], priority = 2)]
    fn usart3(cx: usart3::Context) {
        cx.local.downstream.serve();
    }

    impl<U: Instance> Served<U> {
        /// Moves bytes from the UART to the receive queue, and from the send queue to the UART.
        fn serve(&mut self) {
            let Self { uart, end } = self;
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
        }
    }

    fn now() -> Instant {
        Instant::from_millis(Mono::now().ticks())
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
}
