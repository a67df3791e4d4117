//! Trait of a serial port, and its implementations for two families of HAL traits.

use embedded_hal_nb::nb;
use embedded_hal_nb::serial::{Error as _, ErrorKind};

/// Error reported by the serial port, in most cases for a received byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Fault {
    /// A byte was received before the previous byte was read.
    Overrun,
    /// The byte had no stop bit: wrong baud rate, break condition, or loose wire.
    Framing,
    /// The serial port received a byte with the wrong parity bit.
    Parity,
    /// The serial port sampled a byte on a noisy line.
    Noise,
    /// The serial port reported a receive error of any other kind, or of an unknown kind.
    Other,
}

error_texts!(Fault {
    Overrun => "receive overrun: a byte was lost because it was read too late",
    Framing => "framing error: a received byte had no stop bit",
    Parity => "parity error in a received byte",
    Noise => "noise error: a byte was received with noise on the line",
    Other => "unknown error of the serial port",
});

/// Serial port whose calls never block.
///
/// [`Nb`] and [`Io`] adapt a HAL's port; a firmware with its own queues or DMA can implement it directly.
pub trait SerialPort {
    /// Moves received bytes to the front of `into` (never empty), and returns their number. The number is 0 if no bytes
    /// were received.
    ///
    /// # Errors
    /// [`Fault`] for a byte with a reception error; the next call continues with the next byte.
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault>;

    /// Takes bytes to send from the front of `bytes` (never empty), and returns their number. 0 if the port is full.
    ///
    /// # Errors
    /// [`Fault`] if no byte was accepted, for a reason other than lack of room; the same bytes are offered again.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault>;

    /// Returns true if the last bit of all accepted bytes has left the port; `None` if unknown.
    ///
    /// # Errors
    /// [`Fault`] if the query fails; the caller treats an error as `None`.
    fn has_left(&mut self) -> Result<Option<bool>, Fault>;
}

/// Port with [`embedded_hal_nb`] traits. This port moves one byte per call, and can report that the last byte has left.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Nb<S>(pub S);

impl<S> SerialPort for Nb<S>
where
    S: embedded_hal_nb::serial::Read<u8> + embedded_hal_nb::serial::Write<u8>,
{
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        let Some(place) = into.first_mut() else {
            return Ok(0);
        };
        let byte = embedded_hal_nb::serial::Read::read(&mut self.0);
        Ok(match ready::<S, _>(byte)? {
            Some(byte) => {
                *place = byte;
                1
            }
            None => 0,
        })
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        let Some(&byte) = bytes.first() else {
            return Ok(0);
        };
        let taken = embedded_hal_nb::serial::Write::write(&mut self.0, byte);
        Ok(usize::from(ready::<S, _>(taken)?.is_some()))
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        let flushed = embedded_hal_nb::serial::Write::flush(&mut self.0);
        Ok(Some(ready::<S, _>(flushed)?.is_some()))
    }
}

/// Converts the result of an `nb` call. `None` stands for `WouldBlock`: the call would have to wait.
fn ready<S, T>(result: nb::Result<T, S::Error>) -> Result<Option<T>, Fault>
where
    S: embedded_hal_nb::serial::ErrorType,
{
    match result {
        Ok(value) => Ok(Some(value)),
        Err(nb::Error::WouldBlock) => Ok(None),
        Err(nb::Error::Other(error)) => Err(match error.kind() {
            ErrorKind::Overrun => Fault::Overrun,
            ErrorKind::FrameFormat => Fault::Framing,
            ErrorKind::Parity => Fault::Parity,
            ErrorKind::Noise => Fault::Noise,
            _ => Fault::Other,
        }),
    }
}

/// Port with [`embedded_io`] traits.
///
/// Its `read` and `write` may block, so each is called only after the port has reported that it will not block. Its
/// `flush` may block and is never called. So the port cannot report when the last byte has left, and the time for a
/// driver-enable pin is computed from the byte time. For this the port must send at once and without gaps, as a UART
/// with a FIFO or a ring buffer does, but not a USB adapter.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Io<S>(pub S);

impl<S> SerialPort for Io<S>
where
    S: embedded_io::Read + embedded_io::ReadReady + embedded_io::Write + embedded_io::WriteReady,
{
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault> {
        if self.0.read_ready().map_err(|_| Fault::Other)? {
            self.0.read(into).map_err(|_| Fault::Other)
        } else {
            Ok(0)
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault> {
        if self.0.write_ready().map_err(|_| Fault::Other)? {
            self.0.write(bytes).map_err(|_| Fault::Other)
        } else {
            Ok(0)
        }
    }

    fn has_left(&mut self) -> Result<Option<bool>, Fault> {
        Ok(None)
    }
}
