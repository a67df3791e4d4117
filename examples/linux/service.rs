//! Services of a long-running program: clock, log, signals, status socket and systemd.

use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant as Clock};

use rustix::event::PollFlags;
use serde_json::Value;
use uav_relay::Instant;

use crate::log::{Log, LogOptions, Source};
use crate::notify::Notify;
use crate::requests::Requests;
use crate::socket::StatusSocket;
use crate::system::{now, on_stop};

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
    requests: Requests,
    notify: Option<Notify>,
    stop: UnixStream,
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
        let (stop, requests) = (on_stop()?, Requests::new()?);
        let socket = status_socket.map(StatusSocket::open).transpose()?;
        Ok(Self {
            log: Log::open(log, source)?,
            clock: Clock::now(),
            socket,
            requests,
            notify: Notify::open(),
            stop,
        })
    }

    /// Returns the time since the start.
    #[must_use]
    pub fn now(&self) -> Instant {
        now(self.clock)
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
        let Self { log, requests, .. } = self;
        if requests.take_hangup() {
            log.reopen();
            let what = format_args!("the log file was reopened; the {who} continues");
            log.tell(time, "hang-up", what);
        }
        if requests.take_status() {
            let status = answer(log, None);
            let text = status.to_string();
            log.say(time, "status", status, format_args!("{text}"));
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
        let [hangup, status] = self.requests.fds();
        let socket = self.socket.iter().flat_map(StatusSocket::fds);
        [self.stop.as_fd(), hangup, status]
            .into_iter()
            .chain(socket)
            .map(|fd| (fd, PollFlags::IN))
    }

    /// Returns true if SIGINT or SIGTERM arrived, given the poll results of [`interests`](Self::interests).
    #[must_use]
    pub fn is_over(found: &[PollFlags]) -> bool {
        found.first().is_some_and(|stop| !stop.is_empty())
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
