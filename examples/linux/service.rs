//! Services of a long-running program: clock, sleep, log, signals, status socket and systemd.

use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant as Clock};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::io::Errno;
use serde_json::Value;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::iterator::backend::SignalDelivery;
use signal_hook::iterator::exfiltrator::SignalOnly;
use uav_relay::Instant;

use crate::log::{Log, LogOptions, Source};
use crate::notify::Notify;
use crate::replug::Replug;
use crate::socket::StatusSocket;

/// Maximum wait at exit for the log to write its last lines.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Longest sleep after poll(2) has failed, so that a lasting failure does not keep the CPU busy.
const NAP: Duration = Duration::from_millis(10);

/// Common services of a long-running program: log, clock, signals, status socket and systemd.
#[derive(Debug)]
pub struct Service {
    /// Log of the program.
    pub log: Log,
    clock: Clock,
    socket: Option<StatusSocket>,
    signals: SignalDelivery<UnixStream, SignalOnly>,
    /// True after a SIGHUP signal, until the log file is reopened.
    hangup: bool,
    /// True from a SIGUSR1 until the status is logged.
    asks_status: bool,
    notify: Option<Notify>,
}

impl Service {
    /// Registers the signals, and starts the clock, the log and the status socket. Every log line names `source`.
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

    /// Returns the time since the start of the program.
    #[must_use]
    pub fn now(&self) -> Instant {
        let micros = self.clock.elapsed().as_micros();
        Instant::from_micros(u64::try_from(micros).unwrap_or(u64::MAX))
    }

    /// Reports to systemd that the program is ready.
    pub fn ready(&self) {
        self.notify.iter().for_each(Notify::ready);
    }

    /// Handles signals and status requests, and reports to systemd's watchdog.
    ///
    /// Returns the time by which the next call is due, if any.
    ///
    /// `answer` returns the program's answer to a request. Its argument is `None` for a request of the status,
    /// otherwise a command and the command's sender. `who` is the name of the program in the log line after a SIGHUP.
    pub fn tend(
        &mut self,
        time: Instant,
        who: &str,
        mut answer: impl FnMut(&Log, Option<(&str, &str)>) -> Value,
    ) -> Option<Instant> {
        let log = &self.log;
        if std::mem::take(&mut self.hangup) {
            log.reopen();
            let what = format_args!("the log file was reopened after SIGHUP; the {who} continues");
            log.line(time, "hang-up", what);
        }
        if std::mem::take(&mut self.asks_status) {
            let status = answer(log, None);
            let text = status.to_string();
            log.event(time, "status", status, text);
        }
        let socket = self.socket.as_mut();
        let (questions, again) = socket.map(|it| it.questions(time)).unwrap_or_default();
        for question in questions {
            let user = question.user();
            let command = question.command.as_deref().map(|it| (it, user.as_str()));
            let said = answer(log, command);
            question.answer(&said);
        }
        let alive = self.notify.as_mut().and_then(|it| it.tend(time));
        again.into_iter().chain(alive).min()
    }

    /// Sleeps until the time `wake`, a signal, a status request, or input on one of `ttys` or `others`.
    ///
    /// Without `wake` the sleep has no time limit. A tty whose send buffer was full also ends the sleep when it accepts
    /// bytes.
    ///
    /// Returns the poll(2) events of each of `others`, and true after SIGINT or SIGTERM.
    pub fn sleep<'a>(
        &mut self,
        wake: Option<Instant>,
        ttys: impl Iterator<Item = &'a mut Replug>,
        others: &[(BorrowedFd<'_>, PollFlags)],
    ) -> (Vec<PollFlags>, bool) {
        let time = self.now();
        let span = wake.map(|at| Duration::from_micros(at.since(time).as_micros()));
        // A time that is too long for a `Timespec` counts as no limit.
        let timeout = span.and_then(|span| Timespec::try_from(span).ok());
        let mut ttys: Vec<&mut Replug> = ttys.filter(|tty| tty.is_open()).collect();
        let on_ttys = ttys.iter().filter_map(|tty| tty.interest());
        let socket = self.socket.iter().flat_map(StatusSocket::fds);
        let own = std::iter::once(self.signals.get_read().as_fd()).chain(socket);
        let own = own.map(|fd| (fd, PollFlags::IN));
        let mut fds: Vec<PollFd<'_>> = others
            .iter()
            .copied()
            .chain(on_ttys)
            .chain(own)
            .map(|(fd, interest)| PollFd::from_borrowed_fd(fd, interest))
            .collect();
        let result = poll(&mut fds, timeout.as_ref());
        let mut found: Vec<PollFlags> = fds.iter().map(PollFd::revents).collect();
        if !matches!(result, Ok(_) | Err(Errno::INTR)) {
            // poll(2) has failed, for example for lack of memory. The program continues.
            std::thread::sleep(span.map_or(NAP, |span| span.min(NAP)));
            found.fill(PollFlags::empty());
        }
        let on_ttys = found.split_off(others.len());
        for (tty, events) in ttys.iter_mut().zip(on_ttys) {
            tty.noticed(events);
        }
        (found, self.is_over())
    }

    /// Reads the signals that have arrived; returns true after SIGINT or SIGTERM.
    fn is_over(&mut self) -> bool {
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

    /// Reports to systemd that the program stops on request.
    pub fn stopping(&self) {
        self.notify.iter().for_each(Notify::stopping);
    }

    /// Waits until the last log lines are written, for at most 0.5 s.
    pub fn end(&self) {
        self.log.flush(LAST_LINES);
    }
}

/// Registers the signals that the program handles. A SIGXFSZ then causes a write error, like a full disk, and does not
/// end the program.
fn signals() -> std::io::Result<SignalDelivery<UnixStream, SignalOnly>> {
    signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
    let (ours, theirs) = UnixStream::pair()?;
    let signals = [SIGINT, SIGTERM, SIGHUP, SIGUSR1];
    SignalDelivery::with_pipe(ours, theirs, SignalOnly, signals)
}
