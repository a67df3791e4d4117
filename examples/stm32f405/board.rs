//! The board: clock, two interrupt-driven serial ports, sleep, and what tells one drone from another. All unsafe is here.
//!
//! | what | where |
//! | --- | --- |
//! | toward the transmitter | USART2: TX PA2, RX PA3 |
//! | toward the receiver | USART3: TX PB10, RX PB11 |
//! | clock | HSI, 16 MHz, no PLL; `SysTick` every millisecond |
//! | number of the relay | word at [`INDEX_WORD`], little-endian |

use core::cell::{Cell, RefCell};
use core::ptr::{read_volatile, write_volatile};
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::interrupt::{Mutex, free};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SCB, SYST};
use cortex_m::{asm, singleton};
use cortex_m_rt::exception;
use heapless::spsc::{Consumer, Producer, Queue};
use panic_halt as _;
use stm32f4xx_hal::nb;
use stm32f4xx_hal::pac::{self, Interrupt, USART2, USART3, interrupt};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;
use stm32f4xx_hal::serial::{self, Error, Event, Instance, Serial};
use uav_relay::Instant;
use uav_relay::serial::{Fault, SerialPort};

/// Bits a second on both ports, 8N1.
pub(crate) const BAUD: u32 = 115_200;

/// Where the number of this relay is kept: the first word of the last flash sector, which the image does not touch.
const INDEX_WORD: *const u32 = 0x080E_0000 as *const u32;

/// `SysTick` cycles in a microsecond, and in the millisecond of its period.
const MICRO: u32 = 16;
const TICK: u32 = 1_000 * MICRO;

/// Received bytes, or what went wrong instead, on their way to the main loop: 11 ms of them at full speed.
type Received = Queue<Result<u8, Fault>, 128>;
/// Bytes on their way out: room for all that a link has waiting, so that the main loop can sleep while they leave.
type Outgoing = Queue<u8, 256>;

/// Milliseconds since the start: 64 bits, so they do not overflow.
static TICKS: Mutex<Cell<u64>> = Mutex::new(Cell::new(0));
/// Whether something has come in since the main loop slept last.
static INPUT: AtomicBool = AtomicBool::new(false);
static UPSTREAM: Slot<USART2> = Mutex::new(RefCell::new(None));
static DOWNSTREAM: Slot<USART3> = Mutex::new(RefCell::new(None));

type Slot<U> = Mutex<RefCell<Option<Driver<U>>>>;

/// The interrupt's end of a port.
struct Driver<U: Instance> {
    uart: Serial<U>,
    received: Producer<'static, Result<u8, Fault>>,
    outgoing: Consumer<'static, u8>,
    /// Whether something was lost for want of room and the main loop has not been told.
    lost: bool,
}

impl<U: Instance> Driver<U> {
    /// Moves bytes both ways until the port has none and takes none.
    fn serve(&mut self) {
        loop {
            let item = match self.uart.read() {
                Ok(byte) => Ok(byte),
                Err(nb::Error::Other(error)) => Err(fault(error)),
                Err(nb::Error::WouldBlock) => break,
            };
            if self.lost && self.received.enqueue(Err(Fault::Overrun)).is_ok() {
                self.lost = false;
            }
            self.lost |= self.received.enqueue(item).is_err();
            INPUT.store(true, Ordering::Relaxed);
        }
        while let Some(&byte) = self.outgoing.peek() {
            if self.uart.write(byte).is_err() {
                return self.uart.listen(Event::TxEmpty);
            }
            let _ = self.outgoing.dequeue();
        }
        self.uart.unlisten(Event::TxEmpty);
    }
}

/// The main loop's end of a port.
pub(crate) struct Port {
    received: Consumer<'static, Result<u8, Fault>>,
    outgoing: Producer<'static, u8>,
    interrupt: Interrupt,
}

impl SerialPort for Port {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        let mut count = 0;
        for place in into {
            match self.received.peek() {
                Some(&Ok(byte)) => *place = byte,
                Some(&Err(fault)) if count == 0 => {
                    let _ = self.received.dequeue();
                    return Err(fault);
                }
                // What came before the fault is handed over first.
                Some(Err(_)) | None => break,
            }
            let _ = self.received.dequeue();
            count += 1;
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let fits = |&&byte: &&u8| self.outgoing.enqueue(byte).is_ok();
        let count = bytes.iter().take_while(fits).count();
        // The interrupt owns the UART and sees to the rest.
        NVIC::pend(self.interrupt);
        Ok(count)
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        Ok(None)
    }
}

/// Time since the start.
pub(crate) struct Clock {
    last: Instant,
}

impl Clock {
    /// Microseconds since the start; never less than before.
    pub(crate) fn now(&mut self) -> Instant {
        let (ticks, count) = free(|cs| {
            let ticks = TICKS.borrow(cs).get();
            let count = SYST::get_current();
            if SCB::is_pendst_pending() {
                // The period has ended, and its interrupt waits for this section to do so.
                (ticks + 1, SYST::get_current())
            } else {
                (ticks, count)
            }
        });
        // The counter runs down from TICK - 1 and begins a period at 0.
        let cycles = (TICK - count) % TICK;
        let now = Instant::from_micros(ticks * 1_000 + u64::from(cycles / MICRO));
        self.last = self.last.max(now);
        self.last
    }

    /// Sleeps until `wake`, or until something comes in.
    pub(crate) fn sleep(&mut self, wake: Option<Instant>) {
        while wake.is_none_or(|wake| self.now() < wake) {
            // An interrupt that comes after the look at INPUT stays pending, and `wfi` returns for it.
            let input = free(|_| {
                let input = INPUT.swap(false, Ordering::Relaxed);
                if !input {
                    asm::wfi();
                }
                input
            });
            if input {
                return;
            }
        }
    }
}

/// Sets the board up; once only.
pub(crate) fn start() -> Option<(Clock, Port, Port)> {
    let chip = pac::Peripherals::take()?;
    let mut tick = cortex_m::Peripherals::take()?.SYST;
    let mut rcc = chip.RCC.freeze(Config::hsi());
    let a = chip.GPIOA.split(&mut rcc);
    let b = chip.GPIOB.split(&mut rcc);
    let config = serial::Config::default().baudrate(BAUD.bps());
    let upstream = Serial::new(chip.USART2, (a.pa2, a.pa3), config, &mut rcc).ok()?;
    let downstream = Serial::new(chip.USART3, (b.pb10, b.pb11), config, &mut rcc).ok()?;
    let upstream = open(
        upstream,
        Interrupt::USART2,
        &UPSTREAM,
        singleton!(: Received = Queue::new())?,
        singleton!(: Outgoing = Queue::new())?,
    );
    let downstream = open(
        downstream,
        Interrupt::USART3,
        &DOWNSTREAM,
        singleton!(: Received = Queue::new())?,
        singleton!(: Outgoing = Queue::new())?,
    );
    tick.set_clock_source(SystClkSource::Core);
    tick.set_reload(TICK - 1);
    tick.clear_current();
    tick.enable_counter();
    tick.enable_interrupt();
    let clock = Clock {
        last: Instant::ZERO,
    };
    Some((clock, upstream, downstream))
}

/// Gives one end of a port to its interrupt and the other to the caller.
fn open<U: Instance>(
    mut uart: Serial<U>,
    interrupt: Interrupt,
    slot: &'static Slot<U>,
    received: &'static mut Received,
    outgoing: &'static mut Outgoing,
) -> Port {
    let (received_in, received) = received.split();
    let (outgoing, outgoing_out) = outgoing.split();
    uart.listen(Event::RxNotEmpty);
    free(|cs| {
        slot.borrow(cs).replace(Some(Driver {
            uart,
            received: received_in,
            outgoing: outgoing_out,
            lost: false,
        }));
    });
    // SAFETY: no critical section relies on this interrupt being masked: it is enabled only here, after its driver is in place.
    unsafe { NVIC::unmask(interrupt) };
    Port {
        received,
        outgoing,
        interrupt,
    }
}

/// The number of this relay, or none if the drone has not been given one: erased flash is all ones.
pub(crate) fn relay_index() -> Option<u16> {
    // SAFETY: an aligned word of the flash, which is always readable and which nothing writes while the program runs.
    let word = unsafe { read_volatile(INDEX_WORD) };
    u16::try_from(word).ok()
}

/// A number that differs from one start to the next: what the RAM holds after power-up is noise, and after a reset it is
/// what this function left there.
pub(crate) fn seed() -> u32 {
    const WORDS: usize = 64;
    #[unsafe(link_section = ".uninit.leftover")]
    static mut LEFTOVER: [u32; WORDS] = [0; WORDS];
    let first = (&raw mut LEFTOVER).cast::<u32>();
    // FNV-1a, by words.
    let seed = (0..WORDS).fold(0x811C_9DC5, |hash: u32, word| {
        // SAFETY: within the array, which only this function uses, from the main loop alone.
        (hash ^ unsafe { read_volatile(first.add(word)) }).wrapping_mul(0x0100_0193)
    });
    // SAFETY: as above.
    unsafe { write_volatile(first, seed) };
    seed
}

/// For a drone that cannot take part: sleeps for good.
pub(crate) fn stop() -> ! {
    loop {
        asm::wfi();
    }
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

fn serve<U: Instance>(slot: &Slot<U>) {
    free(|cs| {
        if let Ok(mut driver) = slot.borrow(cs).try_borrow_mut()
            && let Some(driver) = driver.as_mut()
        {
            driver.serve();
        }
    });
}

#[interrupt]
fn USART2() {
    serve(&UPSTREAM);
}

#[interrupt]
fn USART3() {
    serve(&DOWNSTREAM);
}

#[exception]
fn SysTick() {
    free(|cs| {
        let ticks = TICKS.borrow(cs);
        ticks.set(ticks.get() + 1);
    });
}
