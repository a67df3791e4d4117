//! File written in flight by a separate thread, so that a slow or full disk never blocks the relay. After a failed write the
//! relay flies on; the failure is logged once, counted, and retried every second.

use std::io::{Read as _, Write as _};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration as Span, Instant as Clock};

use serde_json::json;
use uav_relay::{Duration, Instant};
use uav_relay_linux::atomic_file::replace;
use uav_relay_linux::log::Log;

const AGAIN: Duration = Duration::from_millis(1_000);

const LAST: Span = Span::from_millis(500);

type Done = (std::io::Result<()>, Span);

#[derive(Debug)]
pub(crate) struct StoredFile {
    option: &'static str,
    file: PathBuf,
    orders: SyncSender<Vec<u8>>,
    done: Receiver<Done>,
    /// Receives a byte for each finished write, for poll(2).
    ended: UnixStream,
    is_writing: bool,
    writes: u64,
    slowest: Span,
    failures: u64,
    failing: bool,
    again_at: Instant,
}

impl StoredFile {
    /// Starts the writer thread of `file`, given by `option`; writes nothing yet.
    pub(crate) fn new(option: &'static str, file: &Path) -> Result<Self, String> {
        let named = |error: std::io::Error| format!("{option} {}: {error}", file.display());
        let (ended, mut end) = UnixStream::pair().map_err(named)?;
        ended.set_nonblocking(true).map_err(named)?;
        let (orders, taken) = sync_channel::<Vec<u8>>(1);
        let (told, done) = sync_channel(1);
        let path = file.to_owned();
        let serve = move || {
            for bytes in taken {
                let begun = Clock::now();
                let result = replace(&path, &bytes);
                if told.send((result, begun.elapsed())).is_err() {
                    return;
                }
                // It has room for this byte: the earlier one was read together with its result.
                let _ = end.write(&[0]);
            }
        };
        std::thread::Builder::new()
            .name("file".to_owned())
            .spawn(serve)
            .map_err(named)?;
        Ok(Self {
            option,
            file: file.to_owned(),
            orders,
            done,
            ended,
            is_writing: false,
            writes: 0,
            slowest: Span::ZERO,
            failures: 0,
            failing: false,
            again_at: Instant::ZERO,
        })
    }

    pub(crate) const fn is_writing(&self) -> bool {
        self.is_writing
    }

    /// Returns true unless the last attempt has failed less than a second ago.
    pub(crate) fn is_due(&self, now: Instant) -> bool {
        !self.failing || self.again_at <= now
    }

    pub(crate) fn wake(&self) -> Option<Instant> {
        (self.failing && !self.is_writing).then_some(self.again_at)
    }

    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.ended.as_fd()
    }

    /// Starts replacing the file's content with `bytes`; does nothing while a write is in progress.
    pub(crate) fn put(&mut self, bytes: Vec<u8>) {
        self.is_writing |= self.orders.try_send(bytes).is_ok();
    }

    /// Returns the result of a finished write: true if it succeeded.
    pub(crate) fn tend(&mut self, now: Instant, log: &Log) -> Option<bool> {
        let mut bytes = [0; 8];
        let _ = (&self.ended).read(&mut bytes);
        let (result, took) = self.done.try_recv().ok()?;
        Some(self.took(now, log, result, took))
    }

    /// Waits at most 0.5 s for a write in progress, at exit.
    pub(crate) fn finish(&mut self, now: Instant, log: &Log) {
        if self.is_writing
            && let Ok((result, took)) = self.done.recv_timeout(LAST)
        {
            self.took(now, log, result, took);
        }
    }

    fn took(&mut self, now: Instant, log: &Log, result: std::io::Result<()>, took: Span) -> bool {
        self.is_writing = false;
        self.slowest = self.slowest.max(took);
        let is_kept = result.is_ok();
        let was = core::mem::replace(&mut self.failing, !is_kept);
        let (option, name) = (self.option, self.file.display().to_string());
        match result {
            Ok(()) => {
                self.writes += 1;
                if was {
                    let failures = self.failures;
                    log.say(
                        now,
                        "file",
                        json!({ "file": name, "failures": failures }),
                        format_args!(
                            "{option} {name}: is written again, after {failures} failures"
                        ),
                    );
                }
            }
            Err(error) => {
                self.failures += 1;
                self.again_at = now + AGAIN;
                if !was {
                    log.say(
                        now,
                        "file",
                        json!({ "file": name, "failures": self.failures }),
                        format_args!(
                            "{option} {name}: cannot be written: {error}; the relay flies on, and tries again every second"
                        ),
                    );
                }
            }
        }
        is_kept
    }

    pub(crate) const fn writes(&self) -> u64 {
        self.writes
    }

    pub(crate) fn slowest_ms(&self) -> f64 {
        1e3 * self.slowest.as_secs_f64()
    }

    pub(crate) const fn failures(&self) -> u64 {
        self.failures
    }
}
