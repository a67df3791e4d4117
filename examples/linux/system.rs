//! What the system is asked for: time and signals.

use std::io;
use std::os::unix::net::UnixStream;
use std::time::Instant as Clock;

use signal_hook::consts::{SIGINT, SIGTERM};
use uav_relay::Instant;

/// Time since the start, by a clock that nobody sets.
pub fn now(clock: Clock) -> Instant {
    Instant::from_micros(u64::try_from(clock.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// A stream that gets a byte at SIGINT or SIGTERM, so that poll(2) notices.
///
/// # Errors
/// One line that says what does not work.
pub fn on_stop() -> Result<UnixStream, String> {
    on(&[SIGINT, SIGTERM])
}

/// A stream that gets a byte at each of these signals.
///
/// # Errors
/// One line that says what does not work.
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
