//! What a program that runs for days has beside its work: a clock, a log, signals, a socket that tells its counters, and systemd.

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

/// How long the last lines may take.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Where it is not possible to sleep as it should be.
const NAP: Duration = Duration::from_millis(10);

/// All of that.
#[derive(Debug)]
pub struct Service {
    /// Its lines.
    pub log: Log,
    clock: Clock,
    socket: Option<StatusSocket>,
    requests: Requests,
    notify: Option<Notify>,
    stop: UnixStream,
}

impl Service {
    /// Begins: from now on signals are heard, and time runs. Every line of the log names `source`.
    ///
    /// # Errors
    /// One line that says what does not work.
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

    /// Time since the start.
    #[must_use]
    pub fn now(&self) -> Instant {
        now(self.clock)
    }

    /// Tells systemd that it is ready.
    pub fn ready(&self) {
        self.notify.iter().for_each(Notify::ready);
    }

    /// Does what signals and the socket ask for: `answer` gets `None` for the state, or a command and the name of its sender. `who` goes on after
    /// a hang-up. Returns the time to come back at the latest.
    pub fn tend(
        &mut self,
        time: Instant,
        who: &str,
        mut answer: impl FnMut(&Log, Option<(&str, &str)>) -> Value,
    ) -> Option<Instant> {
        let Self { log, requests, .. } = self;
        if requests.take_hangup() {
            log.reopen();
            let what = format_args!("the log was opened again, the {who} goes on");
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

    /// What to sleep on.
    pub fn interests(&self) -> impl Iterator<Item = (BorrowedFd<'_>, PollFlags)> {
        let [hangup, status] = self.requests.fds();
        let socket = self.socket.iter().flat_map(StatusSocket::fds);
        [self.stop.as_fd(), hangup, status]
            .into_iter()
            .chain(socket)
            .map(|fd| (fd, PollFlags::IN))
    }

    /// Whether a signal has asked it to end, by what was found at its [`interests`](Self::interests).
    #[must_use]
    pub fn is_over(found: &[PollFlags]) -> bool {
        found.first().is_some_and(|stop| !stop.is_empty())
    }

    /// How long it is until `wake`; `None` for ever.
    #[must_use]
    pub fn until(&self, wake: Option<Instant>) -> Option<Duration> {
        let time = self.now();
        wake.map(|at| Duration::from_micros(at.since(time).as_micros()))
    }

    /// Sleeps for a moment where it is not possible to sleep as it should be: for want of memory, say.
    pub fn nap(span: Option<Duration>) {
        std::thread::sleep(span.map_or(NAP, |span| span.min(NAP)));
    }

    /// Tells systemd that it ends as it was told to.
    pub fn stopping(&self) {
        self.notify.iter().for_each(Notify::stopping);
    }

    /// Writes the last lines.
    pub fn end(&self) {
        self.log.flush(LAST_LINES);
    }
}
