//! Interference measured at the station, read as lines from a FIFO, a file, or datagrams.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom};
use std::net::UdpSocket;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use uav_relay::{Duration, Instant, Side};
use uav_relay_linux::lines::{self, Fifo, InvalidLines, PartialLine};
use uav_relay_linux::log::Log;

const OPTION: &str = "--measurements";

/// Interval at which a file is checked for changes. It is needed because poll(2) does not report changes of a file.
const LOOK: Duration = Duration::from_millis(500);

const READS: usize = 16;

/// Number of bytes read from the end of a file: enough for its last two lines.
const TAIL: u64 = 1_024;

/// Minimum time between two measurements sent to the relays, so that they do not fill the channel.
const EVERY: Duration = Duration::from_millis(500);

/// Time without a measurement after which the log reports that measurements are missing.
const SILENCE: Duration = Duration::from_millis(60_000);

#[derive(Debug)]
enum Source {
    Fifo(Fifo),
    Udp(UdpSocket),
    File(Watched),
}

/// Watched file with measurements. `seen` identifies the content that was read last: inode, length, and modification
/// time in s and ns. If they differ, the file has changed.
#[derive(Debug)]
struct Watched {
    path: PathBuf,
    seen: Option<[i128; 4]>,
    look_at: Instant,
}

#[derive(Debug)]
pub(crate) struct Measurements {
    source: Source,
    name: String,
    end: Side,
    /// Newest measured power that has not been sent to the relays yet, W.
    newest_w: Option<f32>,
    next_at: Instant,
    /// Time of the last valid line; `None` before the first valid line.
    last_at: Option<Instant>,
    is_silent: bool,
    last_w: Option<f32>,
    taken: u64,
    bad: InvalidLines,
}

impl Measurements {
    /// Opens the FIFO, file or UDP socket `name`. `end` is this station's end of the chain: transmitter or receiver.
    pub(crate) fn open(name: &str, end: Side) -> Result<Self, String> {
        let named = |error: &str| format!("{OPTION} {name}: {error}");
        let path = Path::new(name);
        let source = if let Some(address) = name.strip_prefix("udp:") {
            Source::Udp(socket(address).map_err(|error| named(&error.to_string()))?)
        } else if path.is_file() {
            File::open(path).map_err(|error| named(&error.to_string()))?;
            Source::File(Watched {
                path: path.to_owned(),
                seen: None,
                look_at: Instant::ZERO,
            })
        } else {
            Source::Fifo(Fifo::open(OPTION, path)?)
        };
        Ok(Self {
            source,
            name: name.to_owned(),
            end,
            newest_w: None,
            next_at: Instant::ZERO,
            last_at: None,
            is_silent: false,
            last_w: None,
            taken: 0,
            bad: InvalidLines::default(),
        })
    }

    /// Returns the newest measured power, W, if it was not returned before.
    ///
    /// `None` if there is no new measurement, or if the last one was returned less than 0.5 s ago. One call reads at
    /// most 64 KiB of lines.
    pub(crate) fn newest(&mut self, now: Instant, log: &Log) -> Option<f32> {
        self.read(now, log);
        let silent_at = self.last_at.map(|at| at + SILENCE);
        if !self.is_silent && silent_at.is_some_and(|at| at <= now) {
            self.is_silent = true;
            let (name, seconds) = (&self.name, SILENCE.as_micros() / 1_000_000);
            log.line(
                now,
                "measurement",
                format_args!(
                    "no valid measurement of the interference from {name} for {seconds} s"
                ),
            );
        }
        let newest_w = self.newest_w.take_if(|_| self.next_at <= now)?;
        self.next_at = now + EVERY;
        self.taken += 1;
        self.last_w = Some(newest_w);
        Some(newest_w)
    }

    fn read(&mut self, now: Instant, log: &Log) {
        let Self { source, .. } = self;
        let mut lines: Vec<Vec<u8>> = Vec::new();
        let mut line = |text: &[u8]| lines.push(text.to_owned());
        match source {
            Source::Fifo(fifo) => fifo.read(&mut line),
            Source::Udp(socket) => {
                let mut buffer = [0; 4_096];
                for _ in 0..READS {
                    let count = match socket.recv(&mut buffer) {
                        Ok(count) => count,
                        Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                        Err(_) => break,
                    };
                    // The last line of a datagram needs no line feed.
                    let text = buffer.get(..count).unwrap_or_default();
                    let mut partial_line = PartialLine::default();
                    partial_line.take(text, &mut line);
                    if !text.ends_with(b"\n") {
                        partial_line.take(b"\n", &mut line);
                    }
                }
            }
            Source::File(file) => file.last(now).iter().for_each(|text| line(text)),
        }
        for text in lines {
            self.take(now, log, &text);
        }
    }

    fn take(&mut self, now: Instant, log: &Log, text: &[u8]) {
        let power_w = match level(text, self.end) {
            Ok(power_w) => power_w,
            Err(why) => {
                let expected = format!("POWER or {} POWER", name(self.end));
                let input = format!("{OPTION} {}", self.name);
                let texts = [input.as_str(), why.as_str(), expected.as_str()];
                return self.bad.refuse(now, log, "measurement", text, texts);
            }
        };
        self.newest_w = Some(power_w);
        let is_first = self.last_at.replace(now).is_none();
        if is_first || std::mem::take(&mut self.is_silent) {
            let fields = json!({ "power_w": power_w });
            let name = &self.name;
            log.event(
                now,
                "measurement",
                fields,
                format_args!("measured interference {power_w:.3e} W, from {name}; further measurements are passed to the relays, but not logged"),
            );
        }
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        let look = match &self.source {
            Source::File(file) => Some(file.look_at),
            _ => None,
        };
        let next = self.newest_w.map(|_| self.next_at);
        let silent = self.last_at.filter(|_| !self.is_silent);
        let silent = silent.map(|at| at + SILENCE);
        [look, next, silent].into_iter().flatten().min()
    }

    pub(crate) fn fd(&self) -> Option<BorrowedFd<'_>> {
        match &self.source {
            Source::Fifo(fifo) => Some(fifo.fd()),
            Source::Udp(socket) => Some(socket.as_fd()),
            Source::File(_) => None,
        }
    }

    pub(crate) fn status(&self) -> Value {
        json!({
            "from": self.name,
            "handed_on": self.taken,
            "last_w": self.last_w,
            "refused": self.bad.count(),
            "silent": self.is_silent,
        })
    }
}

impl Watched {
    /// Returns the last complete line of the file; `None` if the file has not changed, or is missing.
    fn last(&mut self, now: Instant) -> Option<Vec<u8>> {
        if now < self.look_at {
            return None;
        }
        self.look_at = now + LOOK;
        // A missing file is being renamed, or will be created again.
        let mut file = File::open(&self.path).ok()?;
        let about = file.metadata().ok()?;
        let seen = [
            i128::from(about.ino()),
            i128::from(about.len()),
            i128::from(about.mtime()),
            i128::from(about.mtime_nsec()),
        ];
        if self.seen.replace(seen) == Some(seen) {
            return None;
        }
        let from = about.len().saturating_sub(TAIL);
        file.seek(SeekFrom::Start(from)).ok()?;
        let mut tail = Vec::new();
        file.take(TAIL).read_to_end(&mut tail).ok()?;
        let mut last = None;
        // A line without a line feed is still being written.
        PartialLine::default().take(&tail, |line| last = Some(line.to_owned()));
        last
    }
}

/// Binds a UDP socket for measurements, on the loopback address if no host is given.
fn socket(address: &str) -> std::io::Result<UdpSocket> {
    let wrong =
        || std::io::Error::other("must be udp:PORT or udp:HOST:PORT, with PORT within 1 to 65535");
    let (host, port) = address.rsplit_once(':').unwrap_or(("127.0.0.1", address));
    let port: u16 = port.parse().map_err(|_| wrong())?;
    if port == 0 || host.is_empty() {
        return Err(wrong());
    }
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let socket = UdpSocket::bind((host, port))?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

pub(crate) const fn name(end: Side) -> &'static str {
    match end {
        Side::Upstream => "transmitter",
        Side::Downstream => "receiver",
    }
}

/// Parses a measured power in W or dBm, and returns it in W.
///
/// The word `transmitter` or `receiver` may precede the power, if it names this station's `end` of the chain. The error
/// is the reason why the line is invalid.
fn level(text: &[u8], end: Side) -> Result<f32, String> {
    let words = lines::words(text)?;
    match words.as_slice() {
        [whose, power @ ..] if *whose == name(end) => lines::power_w(power),
        power => lines::power_w(power),
    }
}
