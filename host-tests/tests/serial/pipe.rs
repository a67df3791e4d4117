//! Ports over short queues: a wire between two ends, or a shared channel.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use embedded_hal_nb::serial::ErrorKind;

/// Simulated medium that carries the bytes of each end to all others.
struct Medium {
    /// Bytes that each end has received but not yet read.
    inboxes: Vec<VecDeque<u8>>,
    capacity: usize,
    /// True if only one end at a time may send a frame, as with carrier sense.
    turns: bool,
    talker: Option<usize>,
    carried: usize,
}

#[derive(Clone)]
pub(crate) struct End {
    medium: Rc<RefCell<Medium>>,
    number: usize,
}

impl End {
    fn medium(ends: usize, capacity: usize, turns: bool) -> Vec<Self> {
        let medium = Rc::new(RefCell::new(Medium {
            inboxes: vec![VecDeque::new(); ends],
            capacity,
            turns,
            talker: None,
            carried: 0,
        }));
        (0..ends)
            .map(|number| Self {
                medium: Rc::clone(&medium),
                number,
            })
            .collect()
    }

    /// Creates the two ends of a full-duplex wire that holds `capacity` bytes in each direction.
    pub(crate) fn wire(capacity: usize) -> [Self; 2] {
        Self::medium(2, capacity, false).try_into().ok().unwrap()
    }

    /// Creates the ends of a shared channel that holds `capacity` bytes for each end.
    pub(crate) fn channel(ends: usize, capacity: usize) -> Vec<Self> {
        Self::medium(ends, capacity, true)
    }

    /// Returns the number of bytes that this end has received but not yet read.
    pub(crate) fn waiting(&self) -> usize {
        self.medium.borrow().inboxes[self.number].len()
    }

    /// Returns the number of bytes that all ends of the medium have sent.
    pub(crate) fn carried(&self) -> usize {
        self.medium.borrow().carried
    }

    /// Adds bytes to the received bytes of this end.
    pub(crate) fn add_received(&self, bytes: &[u8]) {
        self.medium.borrow_mut().inboxes[self.number].extend(bytes);
    }

    pub(crate) fn get(&self) -> Option<u8> {
        self.medium.borrow_mut().inboxes[self.number].pop_front()
    }

    fn has_room(&self) -> bool {
        let medium = self.medium.borrow();
        let mine = !medium.turns || medium.talker.is_none_or(|talker| talker == self.number);
        let mut others = medium.inboxes.iter().enumerate();
        mine && others.all(|(at, inbox)| at == self.number || inbox.len() < medium.capacity)
    }

    fn put(&self, byte: u8) {
        let mut medium = self.medium.borrow_mut();
        medium.talker = (byte != 0).then_some(self.number);
        medium.carried += 1;
        for (at, inbox) in medium.inboxes.iter_mut().enumerate() {
            if at != self.number {
                inbox.push_back(byte);
            }
        }
    }
}

/// Schedule of read errors: at every `every`-th byte, an error loses one byte.
#[derive(Clone, Default)]
pub(crate) struct ReadErrors {
    pub(crate) every: usize,
    pub(crate) left: usize,
    pub(crate) count: usize,
    seen: usize,
}

const KINDS: [ErrorKind; 5] = [
    ErrorKind::Overrun,
    ErrorKind::FrameFormat,
    ErrorKind::Parity,
    ErrorKind::Noise,
    ErrorKind::Other,
];

impl ReadErrors {
    pub(crate) fn times(left: usize, every: usize) -> Self {
        Self {
            every,
            left,
            ..Self::default()
        }
    }

    fn next_error(&mut self) -> Option<ErrorKind> {
        self.seen += 1;
        if self.left == 0 || !self.seen.is_multiple_of(self.every) {
            return None;
        }
        self.left -= 1;
        self.count += 1;
        Some(KINDS[self.count % KINDS.len()])
    }
}

/// End of a medium as a port of `embedded_hal_nb`.
pub(crate) struct NbEnd {
    pub(crate) end: End,
    pub(crate) trouble: ReadErrors,
}

mod as_nb {
    use super::NbEnd;
    use embedded_hal_nb::nb;
    use embedded_hal_nb::serial::{ErrorKind, ErrorType, Read, Write};

    impl ErrorType for NbEnd {
        type Error = ErrorKind;
    }

    impl Read<u8> for NbEnd {
        fn read(&mut self) -> nb::Result<u8, ErrorKind> {
            let byte = self.end.get().ok_or(nb::Error::WouldBlock)?;
            match self.trouble.next_error() {
                Some(kind) => Err(nb::Error::Other(kind)),
                None => Ok(byte),
            }
        }
    }

    impl Write<u8> for NbEnd {
        fn write(&mut self, byte: u8) -> nb::Result<(), ErrorKind> {
            if !self.end.has_room() {
                return Err(nb::Error::WouldBlock);
            }
            self.end.put(byte);
            Ok(())
        }

        fn flush(&mut self) -> nb::Result<(), ErrorKind> {
            Ok(())
        }
    }
}

/// Port of `embedded_io` at one end of a simulated medium. It panics where a real port would block.
pub(crate) struct IoEnd {
    pub(crate) end: End,
    pub(crate) trouble: ReadErrors,
}

mod as_io {
    use super::IoEnd;
    use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write, WriteReady};

    impl ErrorType for IoEnd {
        type Error = ErrorKind;
    }

    impl ReadReady for IoEnd {
        fn read_ready(&mut self) -> Result<bool, ErrorKind> {
            Ok(self.end.waiting() > 0)
        }
    }

    impl Read for IoEnd {
        fn read(&mut self, into: &mut [u8]) -> Result<usize, ErrorKind> {
            assert!(self.end.waiting() > 0, "this read would block");
            let mut count = 0;
            // The trait permits reads of fewer bytes than available: here at most 5.
            for place in into.iter_mut().take(5) {
                let Some(byte) = self.end.get() else { break };
                if self.trouble.next_error().is_some() {
                    return if count == 0 {
                        Err(ErrorKind::Other)
                    } else {
                        Ok(count)
                    };
                }
                *place = byte;
                count += 1;
            }
            Ok(count)
        }
    }

    impl WriteReady for IoEnd {
        fn write_ready(&mut self) -> Result<bool, ErrorKind> {
            Ok(self.end.has_room())
        }
    }

    impl Write for IoEnd {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            assert!(self.end.has_room(), "this write would block");
            let fits = bytes.iter().take_while(|&&byte| {
                let room = self.end.has_room();
                if room {
                    self.end.put(byte);
                }
                room
            });
            Ok(fits.count())
        }

        fn flush(&mut self) -> Result<(), ErrorKind> {
            panic!("a flush may block");
        }
    }
}
