//! Asynchronous halves of an interrupt-driven port.
//!
//! They need no waker, because the executor polls its task after every received byte.

use core::cell::RefCell;
use core::future::poll_fn;
use core::task::Poll;

use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use uav_relay::Duration;
use uav_relay::asynch::Clock as _;
use uav_relay::serial::SerialPort as _;

use crate::executor::Time;
use crate::firmware::port::Port;

/// Pause before the next attempt to write to a port whose send queue is full. In this time the UART sends 11 bytes.
const PAUSE: Duration = Duration::from_millis(1);

pub(crate) struct Rx<'p>(&'p RefCell<Port>);

pub(crate) struct Tx<'p> {
    port: &'p RefCell<Port>,
    time: &'p Time,
}

pub(crate) const fn halves<'p>(port: &'p RefCell<Port>, time: &'p Time) -> (Rx<'p>, Tx<'p>) {
    (Rx(port), Tx { port, time })
}

impl ErrorType for Rx<'_> {
    type Error = ErrorKind;
}

impl ErrorType for Tx<'_> {
    type Error = ErrorKind;
}

impl Read for Rx<'_> {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, ErrorKind> {
        poll_fn(|_| {
            let read = self.0.try_borrow_mut().map(|mut port| port.read(into));
            match read {
                Ok(Ok(0)) | Err(_) => Poll::Pending,
                Ok(Ok(count)) => Poll::Ready(Ok(count)),
                Ok(Err(_)) => Poll::Ready(Err(ErrorKind::Other)),
            }
        })
        .await
    }
}

impl Write for Tx<'_> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        loop {
            let wrote = self.port.try_borrow_mut().map(|mut port| port.write(bytes));
            match wrote {
                Ok(Ok(0)) | Err(_) => {
                    self.time.sleep_until(self.time.now() + PAUSE).await;
                }
                Ok(Ok(count)) => return Ok(count),
                Ok(Err(_)) => return Err(ErrorKind::Other),
            }
        }
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
