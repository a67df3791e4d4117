//! What systemd is told, by a datagram each: that the relay is ready, and again and again that it is alive (sd_notify(3)). Elsewhere nothing.

use std::ffi::OsStr;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use uav_relay::{Duration, Instant};

/// Where it is told.
#[derive(Debug)]
pub struct Notify {
    socket: UnixDatagram,
    to: SocketAddr,
    /// Between two signs of life, where they are asked for.
    every: Option<Duration>,
    due: Instant,
}

impl Notify {
    /// As the environment asks for it; `None` where it does not, or where that cannot be reached: no reason not to fly.
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

    /// Says that the relay has begun.
    pub fn ready(&self) {
        self.send("READY=1");
    }

    /// Says that it is alive, when it is time to, and when to come back for that.
    pub fn tend(&mut self, now: Instant) -> Option<Instant> {
        let every = self.every?;
        if self.due <= now {
            self.due = now + every;
            self.send("WATCHDOG=1");
        }
        Some(self.due)
    }

    /// Says that it ends as it was told to.
    pub fn stopping(&self) {
        self.send("STOPPING=1");
    }

    fn send(&self, what: &str) {
        let _ = self.socket.send_to_addr(what.as_bytes(), &self.to);
    }
}

/// A path, or behind an @ a name that is in no folder.
fn address(name: &OsStr) -> Option<SocketAddr> {
    #[cfg(target_os = "linux")]
    if let Some(name) = name.to_str().and_then(|name| name.strip_prefix('@')) {
        use std::os::linux::net::SocketAddrExt as _;
        return SocketAddr::from_abstract_name(name).ok();
    }
    SocketAddr::from_pathname(name).ok()
}

/// Half of the silence that is allowed.
fn watchdog() -> Option<Duration> {
    let micros: u64 = std::env::var("WATCHDOG_USEC").ok()?.parse().ok()?;
    let pid = std::env::var("WATCHDOG_PID").ok();
    let is_this = pid.is_none_or(|pid| pid == std::process::id().to_string());
    (is_this && micros > 1).then(|| Duration::from_micros(micros / 2))
}
