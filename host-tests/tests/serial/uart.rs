//! Half-duplex UART with transmission times, and its driver-enable pin. Every byte and edge is recorded.

use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

use embedded_hal::digital::{ErrorKind, ErrorType, OutputPin};

/// Record of a UART's bytes and of the edges of its driver-enable pin, with times in µs.
#[derive(Default)]
pub(crate) struct Bench {
    /// Simulated present time, µs. Each poll of the driver also takes simulated time, as on a real processor.
    pub(crate) clock: u64,
    /// Start and end of the transmission of each byte, µs.
    pub(crate) bytes: Vec<(u64, u64)>,
    pub(crate) edges: Vec<(u64, bool)>,
    /// Number of further attempts to set the driver-enable pin that fail: to low, and to high.
    pub(crate) refusals: [u32; 2],
}

impl Bench {
    pub(crate) fn level(&self) -> Option<bool> {
        self.edges.last().map(|&(_, level)| level)
    }

    pub(crate) fn idle_at(&self) -> u64 {
        self.bytes.last().map_or(0, |&(_, end)| end)
    }
}

pub(crate) struct Uart {
    pub(crate) bench: Rc<RefCell<Bench>>,
    pub(crate) byte_time: u64,
    /// Size of the UART's FIFO in bytes, without the byte that is leaving.
    pub(crate) fifo: u64,
    /// Computing time that passes between two reads of the clock, µs.
    pub(crate) lag: u64,
}

impl Uart {
    fn has_room(&self) -> bool {
        let bench = self.bench.borrow();
        let ahead = bench.idle_at().saturating_sub(bench.clock);
        ahead.div_ceil(self.byte_time) <= self.fifo
    }

    fn put(&self) {
        let mut bench = self.bench.borrow_mut();
        assert_eq!(bench.level(), Some(true), "sent while nobody drives");
        let start = bench.idle_at().max(bench.clock);
        bench.bytes.push((start, start + self.byte_time));
    }

    /// Simulates that the driver reads the UART's state: it takes time, and no byte is read.
    fn look(&self) {
        self.bench.borrow_mut().clock += self.lag;
    }
}

pub(crate) struct IoUart(pub Uart);

mod as_nb {
    use super::{Infallible, Uart};
    use embedded_hal_nb::nb;
    use embedded_hal_nb::serial::{ErrorType, Read, Write};

    impl ErrorType for Uart {
        type Error = Infallible;
    }

    impl Read<u8> for Uart {
        fn read(&mut self) -> nb::Result<u8, Infallible> {
            self.look();
            Err(nb::Error::WouldBlock)
        }
    }

    impl Write<u8> for Uart {
        fn write(&mut self, _: u8) -> nb::Result<(), Infallible> {
            if !self.has_room() {
                return Err(nb::Error::WouldBlock);
            }
            self.put();
            Ok(())
        }

        fn flush(&mut self) -> nb::Result<(), Infallible> {
            let bench = self.bench.borrow();
            if bench.clock < bench.idle_at() {
                return Err(nb::Error::WouldBlock);
            }
            Ok(())
        }
    }
}

mod as_io {
    use super::{Infallible, IoUart};
    use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};

    impl ErrorType for IoUart {
        type Error = Infallible;
    }

    impl ReadReady for IoUart {
        fn read_ready(&mut self) -> Result<bool, Infallible> {
            self.0.look();
            Ok(false)
        }
    }

    impl Read for IoUart {
        fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
            panic!("this read would block");
        }
    }

    impl WriteReady for IoUart {
        fn write_ready(&mut self) -> Result<bool, Infallible> {
            Ok(self.0.has_room())
        }
    }

    impl Write for IoUart {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
            let fits = bytes.iter().take_while(|_| {
                let room = self.0.has_room();
                if room {
                    self.0.put();
                }
                room
            });
            let count = fits.count();
            assert!(count > 0, "this write would block");
            Ok(count)
        }

        fn flush(&mut self) -> Result<(), Infallible> {
            panic!("a flush may block");
        }
    }
}

pub(crate) struct Pin(pub Rc<RefCell<Bench>>);

impl Pin {
    fn set(&self, level: bool) -> Result<(), ErrorKind> {
        let mut bench = self.0.borrow_mut();
        let refusals = &mut bench.refusals[usize::from(level)];
        if *refusals > 0 {
            *refusals -= 1;
            return Err(ErrorKind::Other);
        }
        let edge = (bench.clock, level);
        bench.edges.push(edge);
        Ok(())
    }
}

impl ErrorType for Pin {
    type Error = ErrorKind;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), ErrorKind> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), ErrorKind> {
        self.set(true)
    }
}
