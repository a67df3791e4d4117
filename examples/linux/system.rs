//! Monotonic time and signals.

use std::io;
use std::os::unix::net::UnixStream;
use std::time::Instant as Clock;

use signal_hook::consts::{SIGINT, SIGTERM};
use uav_relay::Instant;

/// Returns the time since `clock`, a monotonic time.
pub fn now(clock: Clock) -> Instant {
    Instant::from_micros(u64::try_from(clock.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// Returns a stream that gets a byte at SIGINT or SIGTERM, for poll(2).
///
/// # Errors
/// One line that names the fault.
pub fn on_stop() -> Result<UnixStream, String> {
    on(&[SIGINT, SIGTERM])
}

/// Returns a stream that gets a byte at each of `signals`.
///
/// # Errors
/// One line that names the fault.
pub fn on(signals: &[i32]) -> Result<UnixStream, String> {
    let pipe = || -> io::Result<UnixStream> {
        let (ours, theirs) = UnixStream::pair()?;
        ours.set_nonblocking(true)?;
        for &signal in signals {
            signal_hook::low_level::pipe::register(signal, theirs.try_clone()?)?;
        }
        Ok(ours)
    };
    pipe().map_err(|error| format!("cannot wait for signals: {error}"))
}
