//! Log lines, written by a separate thread. A slow reader or a full disk never blocks the program.
//!
//! A line that cannot be written is dropped. The next written line reports how many were dropped.

use std::fmt;
use std::fs::File;
use std::io::Write as _;
use std::os::fd::AsFd as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant as Clock, SystemTime};

use clap::Args;
use serde_json::{Map, Value, json};
use uav_relay::Instant;

/// Maximum number of waiting log lines; further lines are dropped.
const QUEUE: usize = 1_024;

/// Options of the log.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Log")]
pub struct LogOptions {
    /// Write every line as one JSON object
    #[arg(long)]
    json: bool,
    /// Append lines to this file, created if missing, instead of standard output
    #[arg(long, value_name = "FILE")]
    pub log_file: Option<PathBuf>,
}

/// Identity of the program, which every log line names. The reason is that logs of several programs are read side by
/// side.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name of the program in a text line, such as `relay 2`.
    pub name: String,
    /// Name of the field that identifies the program in a JSON line, such as `index`.
    pub key: &'static str,
    /// Value of the field that identifies the program in a JSON line.
    pub value: Value,
}

#[derive(Debug)]
struct Format {
    json: bool,
    source: Source,
}

enum Order {
    Line(Instant, String),
    /// Request to confirm, through this channel, that all earlier lines were written or dropped.
    Flush(SyncSender<()>),
}

/// State that callers and writer thread share.
#[derive(Debug, Default)]
struct Shared {
    dropped: AtomicU64,
    reopen: AtomicBool,
}

/// Handle of the log. No call fails, and only `flush` blocks.
#[derive(Clone, Debug)]
pub struct Log {
    orders: SyncSender<Order>,
    shared: Arc<Shared>,
    format: Arc<Format>,
}

impl Log {
    /// Starts the writer thread; each line names `source`.
    ///
    /// # Errors
    /// One line that names the file that cannot be opened.
    pub fn open(options: &LogOptions, source: Source) -> Result<Self, String> {
        let path = options.log_file.clone();
        let file = match &path {
            Some(path) => {
                appended(path).map_err(|error| format!("--log-file {}: {error}", path.display()))?
            }
            // `Stdout` is not used, because its flush at exit could block forever.
            None => std::io::stdout()
                .as_fd()
                .try_clone_to_owned()
                .map_err(|error| format!("standard output: {error}"))?
                .into(),
        };
        let (orders, taken) = sync_channel(QUEUE);
        let shared = Arc::new(Shared::default());
        let format = Arc::new(Format {
            json: options.json,
            source,
        });
        let mut writer = Writer {
            file,
            path,
            torn: false,
            reported_drops: 0,
            format: Arc::clone(&format),
            shared: Arc::clone(&shared),
        };
        std::thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || writer.serve(&taken))
            .map_err(|error| format!("cannot start the thread that writes the log: {error}"))?;
        Ok(Self {
            orders,
            shared,
            format,
        })
    }

    /// Logs an event at `now`: short name, data fields for programs, and a text for people.
    pub fn event(&self, now: Instant, event: &str, fields: Value, text: impl fmt::Display) {
        let line = self.format.line(now, event, fields, &text.to_string());
        if self.orders.try_send(Order::Line(now, line)).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Logs an event without data fields.
    pub fn line(&self, now: Instant, event: &str, text: impl fmt::Display) {
        self.event(now, event, Value::Null, text);
    }

    /// Logs that frames are signed, and the signing epoch (counter of the program's starts).
    pub fn signed(&self, epoch: u32) {
        let what =
            format_args!("frames are signed; epoch {epoch} (start counter, larger at every start)");
        self.event(Instant::ZERO, "signed", json!({ "epoch": epoch }), what);
    }

    /// Reopens the log file before the next line, for log rotation.
    pub fn reopen(&self) {
        self.shared.reopen.store(true, Ordering::Relaxed);
    }

    /// Returns the number of log lines dropped so far.
    pub fn dropped(&self) -> u64 {
        self.shared.dropped.load(Ordering::Relaxed)
    }

    /// Waits until all log lines are written, for at most the time `at_most`.
    pub fn flush(&self, at_most: Duration) {
        let end = Clock::now() + at_most;
        let (done, flushed) = sync_channel(1);
        while let Err(TrySendError::Full(_)) = self.orders.try_send(Order::Flush(done.clone())) {
            if Clock::now() >= end {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let left = end.saturating_duration_since(Clock::now());
        let heard = flushed.recv_timeout(left);
        debug_assert!(heard != Err(RecvTimeoutError::Disconnected));
    }
}

fn appended(path: &Path) -> std::io::Result<File> {
    File::options().append(true).create(true).open(path)
}

struct Writer {
    file: File,
    path: Option<PathBuf>,
    /// True if the last line is torn: only a part of it was written, for example because the disk is full.
    torn: bool,
    /// Number of dropped lines already reported in the log.
    reported_drops: u64,
    format: Arc<Format>,
    shared: Arc<Shared>,
}

impl Writer {
    fn serve(&mut self, orders: &Receiver<Order>) {
        for order in orders {
            match order {
                Order::Line(now, line) => self.line(now, &line),
                Order::Flush(done) => drop(done.try_send(())),
            }
        }
    }

    fn line(&mut self, now: Instant, line: &str) {
        if self.shared.reopen.swap(false, Ordering::Relaxed)
            && let Some(path) = &self.path
            && let Ok(file) = appended(path)
        {
            self.file = file;
            self.torn = false;
        }
        let dropped = self.shared.dropped.load(Ordering::Relaxed);
        let mut text = String::new();
        if self.torn {
            text.push('\n');
        }
        if dropped > self.reported_drops {
            let more = dropped - self.reported_drops;
            let fields = json!({ "dropped": dropped });
            let notice = format!(
                "{more} log lines dropped: the disk was full, or the program that reads the log was too slow or had ended"
            );
            text += &self.format.line(now, "log", fields, &notice);
        }
        text += line;
        if self.put(text.as_bytes()) {
            self.reported_drops = dropped;
        } else {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn put(&mut self, mut bytes: &[u8]) -> bool {
        while !bytes.is_empty() {
            match self.file.write(bytes) {
                Ok(count @ 1..) => {
                    bytes = bytes.get(count..).unwrap_or_default();
                    self.torn = !bytes.is_empty();
                }
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                _ => return false,
            }
        }
        true
    }
}

impl Format {
    /// Formats a log line: time of day in UTC, time since the start, source, event, text and a line feed.
    fn line(&self, now: Instant, event: &str, fields: Value, text: &str) -> String {
        let time = humantime::format_rfc3339_millis(SystemTime::now()).to_string();
        let micros = now.as_micros();
        let Source { name, key, value } = &self.source;
        if self.json {
            let mut entry = Map::new();
            if let Value::Object(fields) = fields {
                entry.extend(fields);
            }
            entry.insert("time".to_owned(), time.into());
            entry.insert(
                "monotonic_s".to_owned(),
                (f64::from(u32::try_from(micros / 1_000).unwrap_or(u32::MAX)) / 1e3).into(),
            );
            entry.insert((*key).to_owned(), value.clone());
            entry.insert("event".to_owned(), event.into());
            entry.insert("text".to_owned(), text.into());
            return format!("{}\n", Value::Object(entry));
        }
        let (seconds, millis) = (micros / 1_000_000, micros / 1_000 % 1_000);
        let text = printable(text);
        format!("{time} {seconds:>6}.{millis:03} s  {name}  {event}: {text}\n")
    }
}

/// Escapes control characters, so that a text with a line feed stays one line.
fn printable(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for sign in text.chars() {
        if sign.is_control() {
            out.extend(sign.escape_default());
        } else {
            out.push(sign);
        }
    }
    out
}
