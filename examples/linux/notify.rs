//! Notifications to systemd (sd_notify(3)): ready, alive (watchdog) and stopping. They do nothing without systemd.

use std::ffi::OsStr;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use uav_relay::{Duration, Instant};

/// Socket for notifications to systemd.
#[derive(Debug)]
pub struct Notify {
    socket: UnixDatagram,
    to: SocketAddr,
    /// Interval of the reports to systemd's watchdog, half of its timeout; `None` without a watchdog.
    every: Option<Duration>,
    due: Instant,
}

impl Notify {
    /// Opens the socket that `NOTIFY_SOCKET` names; `None` if it is not set or not reachable.
    ///
    /// Without it the program runs without notifications.
    pub fn open() -> Option<Self> {
        let to = address(&std::env::var_os("NOTIFY_SOCKET")?)?;
        let socket = UnixDatagram::unbound().ok()?;
        socket.set_nonblocking(true).ok()?;
        Some(Self {
            socket,
            to,
            every: watchdog(),
            due: Instant::ZERO,
        })
    }

    /// Reports to systemd that the program has started.
    pub fn ready(&self) {
        self.send("READY=1");
    }

    /// Reports to systemd's watchdog if a report is due. Returns the time of the next report; `None` without a
    /// watchdog.
    pub fn tend(&mut self, now: Instant) -> Option<Instant> {
        let every = self.every?;
        if self.due <= now {
            self.due = now + every;
            self.send("WATCHDOG=1");
        }
        Some(self.due)
    }

    /// Reports to systemd that the program stops on request.
    pub fn stopping(&self) {
        self.send("STOPPING=1");
    }

    fn send(&self, what: &str) {
        let _ = self.socket.send_to_addr(what.as_bytes(), &self.to);
    }
}

/// Parses the name of a Unix socket: a path, or `@` and an abstract name.
fn address(name: &OsStr) -> Option<SocketAddr> {
    #[cfg(target_os = "linux")]
    if let Some(name) = name.to_str().and_then(|name| name.strip_prefix('@')) {
        use std::os::linux::net::SocketAddrExt as _;
        return SocketAddr::from_abstract_name(name).ok();
    }
    SocketAddr::from_pathname(name).ok()
}

/// Returns half of the watchdog timeout that systemd sets for this process, if any.
fn watchdog() -> Option<Duration> {
    let micros: u64 = std::env::var("WATCHDOG_USEC").ok()?.parse().ok()?;
    let pid = std::env::var("WATCHDOG_PID").ok();
    let is_this = pid.is_none_or(|pid| pid == std::process::id().to_string());
    (is_this && micros > 1).then(|| Duration::from_micros(micros / 2))
}
