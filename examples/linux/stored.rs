//! Files that survive a power failure: the epoch, and records written in flight.

use std::fs::{File, remove_file, rename};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration as Span, Instant as Clock, SystemTime, UNIX_EPOCH};

use serde_json::json;
use uav_relay::{CRC_32C, Duration, Instant};

use crate::log::Log;

/// Replaces the content of `file` with `bytes`. After a crash the file holds either the old or the new content.
fn replace(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut beside = file.as_os_str().to_owned();
    beside.push(".new");
    let written = write(Path::new(&beside), bytes).and_then(|()| rename(&beside, file));
    if written.is_err() {
        // Removes the partial file, to free a full disk.
        let _ = remove_file(&beside);
    }
    written?;
    // The directory entry must be synced after the rename, too.
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

fn write(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut new = File::create(file)?;
    new.write_all(bytes)?;
    new.sync_all()
}

/// Returns the signing epoch of this program start: the number in `file` plus one.
///
/// The file is updated before the epoch is used, so that no epoch is used twice, even after a power failure.
///
/// Without a file the epoch is the clock's seconds since 1970, so that a lost file does not restart the epochs at 1.
///
/// # Errors
/// One line that names the file and the fault.
pub fn next_epoch(file: &Path) -> Result<u32, String> {
    let named = |error: &str| format!("--epoch-file {}: {error}", file.display());
    let seconds = || {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        since.map_or(0, |since| u32::try_from(since.as_secs()).unwrap_or(0))
    };
    let last = match std::fs::read_to_string(file) {
        Ok(text) => text.trim().parse().ok(),
        Err(error) if error.kind() == ErrorKind::NotFound => Some(seconds()),
        Err(error) => return Err(named(&format!("cannot be read: {error}"))),
    };
    let last: u32 = last.ok_or_else(|| {
        named("must contain one number within 0 to 4294967294: the epoch (start counter) of the last start")
    })?;
    let epoch = last
        .checked_add(1)
        .ok_or_else(|| named("the epoch (start counter) in the file is the largest one, and every start needs a larger epoch: give all relays a new key, and delete this file"))?;
    replace(file, format!("{epoch}\n").as_bytes())
        .map_err(|error| named(&format!("cannot be written: {error}")))?;
    Ok(epoch)
}

/// Pause before a failed write is retried.
const AGAIN: Duration = Duration::from_millis(1_000);

/// Maximum wait, at exit, for a write that is in progress.
const LAST: Span = Span::from_millis(500);

type Done = (std::io::Result<()>, Span);

/// File with one record and a CRC-32C. A separate thread writes it, so that a slow disk never blocks the program.
///
/// After a failed write the program keeps flying the drone. The failure is logged once and counted, and the write is
/// retried every second.
#[derive(Debug)]
pub struct StoredFile {
    option: &'static str,
    file: PathBuf,
    orders: SyncSender<Vec<u8>>,
    done: Receiver<Done>,
    /// Socket that becomes readable when a write has ended, for poll(2).
    ended: UnixStream,
    /// Newest record, whether or not it is written; `None` without a record.
    record: Option<Vec<u8>>,
    writing: Option<Vec<u8>>,
    /// Record of the last write that has ended, successfully or not.
    tried: Option<Vec<u8>>,
    writes: u64,
    slowest: Span,
    failures: u64,
    failing: bool,
    again_at: Instant,
}

impl StoredFile {
    /// Starts the writer thread of `file`, which `option` names. `record` is the file's present record, if any.
    ///
    /// # Errors
    /// One line that names the file and the fault.
    pub fn new(option: &'static str, file: &Path, record: Option<&[u8]>) -> Result<Self, String> {
        let named = |error: std::io::Error| format!("{option} {}: {error}", file.display());
        let (ended, mut end) = UnixStream::pair().map_err(named)?;
        ended.set_nonblocking(true).map_err(named)?;
        let (orders, taken) = sync_channel::<Vec<u8>>(1);
        let (results, done) = sync_channel(1);
        let path = file.to_owned();
        let serve = move || {
            for bytes in taken {
                let begun = Clock::now();
                let result = replace(&path, &bytes);
                if results.send((result, begun.elapsed())).is_err() {
                    return;
                }
                // The socket has room for this byte, because the previous byte was read together with its result.
                let _ = end.write(&[0]);
            }
        };
        std::thread::Builder::new()
            .name("file".to_owned())
            .spawn(serve)
            .map_err(named)?;
        let record = record.map(<[u8]>::to_vec);
        Ok(Self {
            option,
            file: file.to_owned(),
            orders,
            done,
            ended,
            tried: record.clone(),
            record,
            writing: None,
            writes: 0,
            slowest: Span::ZERO,
            failures: 0,
            failing: false,
            again_at: Instant::ZERO,
        })
    }

    /// Begins to write `record`, unless this was already tried. Returns true once a write of it has succeeded or failed.
    ///
    /// After a failure the program continues: a drone in the air must not become silent because of a full disk.
    pub fn store(&mut self, record: &[u8]) -> bool {
        if self.record.as_deref() != Some(record) {
            self.record = Some(record.to_vec());
        }
        let is_tried = self.tried == self.record;
        if !is_tried {
            self.write();
        }
        is_tried
    }

    /// Handles the end of a write. Then begins to write the newest record, if it differs from the written one.
    ///
    /// Retries a failed write after a pause.
    ///
    /// Returns the time of the retry; `None` if no retry is needed.
    pub fn tend(&mut self, now: Instant, log: &Log) -> Option<Instant> {
        let mut bytes = [0; 8];
        let _ = (&self.ended).read(&mut bytes);
        if let Ok((result, took)) = self.done.try_recv() {
            self.on_written(now, log, result, took);
        }
        let is_due = !self.failing || self.again_at <= now;
        if is_due && (self.failing || self.tried != self.record) {
            self.write();
        }
        (self.failing && self.writing.is_none()).then_some(self.again_at)
    }

    /// Passes the newest record to the writer thread, unless it is busy.
    fn write(&mut self) {
        if let (None, Some(record)) = (&self.writing, &self.record)
            && self
                .orders
                .try_send([&record[..], &sum(record)].concat())
                .is_ok()
        {
            self.writing = Some(record.clone());
        }
    }

    /// Waits at most 0.5 s for a write in progress. Called at exit.
    pub fn finish(&mut self, now: Instant, log: &Log) {
        if self.writing.is_some()
            && let Ok((result, took)) = self.done.recv_timeout(LAST)
        {
            self.on_written(now, log, result, took);
        }
    }

    fn on_written(&mut self, now: Instant, log: &Log, result: std::io::Result<()>, took: Span) {
        self.tried = self.writing.take();
        self.slowest = self.slowest.max(took);
        let was_failing = core::mem::replace(&mut self.failing, result.is_err());
        let (option, name) = (self.option, self.file.display().to_string());
        let text = match result {
            Ok(()) => {
                self.writes += 1;
                let failures = self.failures;
                format!("can be written again, after {failures} failed attempts")
            }
            Err(error) => {
                self.failures += 1;
                self.again_at = now + AGAIN;
                format!(
                    "cannot be written: {error}; the relay continues without it, and tries to write the file again every second"
                )
            }
        };
        if self.failing != was_failing {
            let fields = json!({ "file": name, "failures": self.failures });
            log.event(now, "file", fields, format_args!("{option} {name}: {text}"));
        }
    }

    /// Returns the file descriptor to poll for the end of a write.
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.ended.as_fd()
    }

    /// Returns the number of successful writes.
    pub const fn writes(&self) -> u64 {
        self.writes
    }

    /// Returns the duration of the slowest write, ms.
    pub fn slowest_ms(&self) -> f64 {
        1e3 * self.slowest.as_secs_f64()
    }

    /// Returns the number of failed writes.
    pub const fn failures(&self) -> u64 {
        self.failures
    }
}

/// Reads the file that `option` names; `None` if it does not exist.
///
/// # Errors
/// One line that names the file and the fault.
pub fn load(option: &str, file: &Path) -> Result<Option<Vec<u8>>, String> {
    match std::fs::read(file) {
        Ok(bytes) => Ok(Some(bytes)),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(None),
        Err(error) => Err(format!(
            "{option} {}: cannot be read: {error}",
            file.display()
        )),
    }
}

/// Returns the record in `bytes`, the content of a [`StoredFile`].
///
/// `None` if its CRC is wrong or it does not have `length` bytes.
pub fn record(bytes: &[u8], length: usize) -> Option<&[u8]> {
    let (record, check) = bytes.split_at_checked(length)?;
    (sum(record) == *check).then_some(record)
}

fn sum(bytes: &[u8]) -> [u8; 4] {
    CRC_32C.checksum(bytes).to_le_bytes()
}
