//! What the facade needs of a serial port, and the two families of ports that have it.

use embedded_hal_nb::nb;
use embedded_hal_nb::serial::{Error as _, ErrorKind};

/// Something that went wrong in this relay's own serial port.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Fault {
    /// A byte came before the one ahead of it had been read.
    Overrun,
    /// A byte without its stop bit: another baud rate, a break, a loose wire.
    Framing,
    /// A byte with the wrong parity bit.
    Parity,
    /// A byte sampled on a noisy line.
    Noise,
    /// Anything else, or the port does not say.
    Other,
}

impl core::fmt::Display for Fault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Overrun => "a received byte was overrun by the next one",
            Self::Framing => "a received byte had no stop bit",
            Self::Parity => "a received byte had the wrong parity",
            Self::Noise => "a byte was received from a noisy line",
            Self::Other => "the serial port failed",
        })
    }
}

impl core::error::Error for Fault {}

/// A serial port of which every call returns at once.
///
/// [`Nb`] and [`Io`] make one of what a HAL offers; a firmware with queues or DMA of its own may implement it directly.
pub trait SerialPort {
    /// Moves bytes that have come in to the front of `into` (never empty) and says how many; 0 if none is there.
    ///
    /// # Errors
    /// [`Fault`] for a byte that was received badly; the call after it goes on with the next one.
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Fault>;

    /// Takes bytes from the front of `bytes` (never empty) and says how many; 0 if there is no room now.
    ///
    /// # Errors
    /// [`Fault`] if nothing was taken and that is not for want of room; the same bytes are offered again later.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Fault>;

    /// Whether the last bit of all that was taken is on the line; `None` if the port cannot tell.
    ///
    /// # Errors
    /// [`Fault`] if the port should know and does not; as good as `None`.
    fn has_left(&mut self) -> Result<Option<bool>, Fault>;
}

/// A port that speaks [`embedded_hal_nb`]: a byte a call, and it knows when the last one has left.
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

/// What has come of an `nb` call; `None` if nothing has yet.
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

/// A port that speaks [`embedded_io`]. Its reads and writes may block, so each is made only where the port has just said
/// that the next call will not; its `flush` may block as well and is never called.
///
/// That leaves no way to ask when the last byte has left, so a driver-enable pin goes by the time that the bytes take. For
/// that the port must begin to send what it was given at once and without gaps: a UART with a FIFO or a ring buffer does,
/// a USB adapter does not.
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
