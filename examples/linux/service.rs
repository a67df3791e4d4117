//! Services of a long-running program: clock, log, signals, status socket and systemd.

use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant as Clock};

use rustix::event::PollFlags;
use serde_json::Value;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::iterator::backend::SignalDelivery;
use signal_hook::iterator::exfiltrator::SignalOnly;
use uav_relay::Instant;

use crate::log::{Log, LogOptions, Source};
use crate::notify::Notify;
use crate::socket::StatusSocket;

/// Maximum time for the last log lines at exit.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Longest sleep after poll(2) has failed.
const NAP: Duration = Duration::from_millis(10);

/// Services of a long-running program.
#[derive(Debug)]
pub struct Service {
    /// Log of the program.
    pub log: Log,
    clock: Clock,
    socket: Option<StatusSocket>,
    signals: SignalDelivery<UnixStream, SignalOnly>,
    /// True after SIGHUP, a request to reopen the log, until it is handled.
    hangup: bool,
    /// True after SIGUSR1, a request to log the status, until it is handled.
    asks_status: bool,
    notify: Option<Notify>,
}

impl Service {
    /// Registers the signals and starts the clock, the log and the socket. Every log line names `source`.
    ///
    /// # Errors
    /// One line that names the fault.
    pub fn begin(
        log: &LogOptions,
        source: Source,
        status_socket: Option<&Path>,
    ) -> Result<Self, String> {
        let signals = signals().map_err(|error| format!("cannot wait for signals: {error}"))?;
        let socket = status_socket.map(StatusSocket::open).transpose()?;
        Ok(Self {
            log: Log::open(log, source)?,
            clock: Clock::now(),
            socket,
            signals,
            hangup: false,
            asks_status: false,
            notify: Notify::open(),
        })
    }

    /// Returns the time since the start.
    #[must_use]
    pub fn now(&self) -> Instant {
        let micros = self.clock.elapsed().as_micros();
        Instant::from_micros(u64::try_from(micros).unwrap_or(u64::MAX))
    }

    /// Reports to systemd that the program is ready.
    pub fn ready(&self) {
        self.notify.iter().for_each(Notify::ready);
    }

    /// Handles signals and status requests, and reports to the watchdog; returns the time of the next call.
    ///
    /// `answer` gets `None` for a status request, or a command and its sender. `who` names the program in the line after a
    /// SIGHUP.
    pub fn tend(
        &mut self,
        time: Instant,
        who: &str,
        mut answer: impl FnMut(&Log, Option<(&str, &str)>) -> Value,
    ) -> Option<Instant> {
        let log = &self.log;
        if std::mem::take(&mut self.hangup) {
            log.reopen();
            let what = format_args!("the log file was reopened; the {who} continues");
            log.tell(time, "hang-up", what);
        }
        if std::mem::take(&mut self.asks_status) {
            let status = answer(log, None);
            let text = status.to_string();
            log.say(time, "status", status, text);
        }
        let socket = self.socket.as_mut();
        let (questions, again) = socket.map(|it| it.questions(time)).unwrap_or_default();
        for question in questions {
            let said = match &question.command {
                Some(command) => answer(log, Some((command, &question.user()))),
                None => answer(log, None),
            };
            question.answer(&said);
        }
        let alive = self.notify.as_mut().and_then(|it| it.tend(time));
        again.into_iter().chain(alive).min()
    }

    /// Returns the file descriptors and events to poll.
    pub fn interests(&self) -> impl Iterator<Item = (BorrowedFd<'_>, PollFlags)> {
        let socket = self.socket.iter().flat_map(StatusSocket::fds);
        std::iter::once(self.signals.get_read().as_fd())
            .chain(socket)
            .map(|fd| (fd, PollFlags::IN))
    }

    /// Reads the signals that have arrived; returns true after SIGINT or SIGTERM.
    #[must_use]
    pub fn is_over(&mut self) -> bool {
        let mut is_over = false;
        for signal in self.signals.pending() {
            match signal {
                SIGHUP => self.hangup = true,
                SIGUSR1 => self.asks_status = true,
                _ => is_over = true,
            }
        }
        is_over
    }

    /// Returns the time left until `wake`; `None` means for ever.
    #[must_use]
    pub fn until(&self, wake: Option<Instant>) -> Option<Duration> {
        let time = self.now();
        wake.map(|at| Duration::from_micros(at.since(time).as_micros()))
    }

    /// Sleeps for at most 10 ms, as a substitute when poll(2) fails, for want of memory for instance.
    pub fn nap(span: Option<Duration>) {
        std::thread::sleep(span.map_or(NAP, |span| span.min(NAP)));
    }

    /// Reports to systemd that the program stops on request.
    pub fn stopping(&self) {
        self.notify.iter().for_each(Notify::stopping);
    }

    /// Writes the last log lines.
    pub fn end(&self) {
        self.log.flush(LAST_LINES);
    }
}

/// Registers the signals. SIGXFSZ becomes a write error, like a full disk, and does not end the program.
fn signals() -> std::io::Result<SignalDelivery<UnixStream, SignalOnly>> {
    signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
    let (ours, theirs) = UnixStream::pair()?;
    let signals = [SIGINT, SIGTERM, SIGHUP, SIGUSR1];
    SignalDelivery::with_pipe(ours, theirs, SignalOnly, signals)
}
