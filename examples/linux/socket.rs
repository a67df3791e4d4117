//! Unix socket for the operator: one JSON object for each connection, which is then closed.
//!
//! A client that sends a line gives a command, and the object is its result. A client that sends nothing gets the
//! state. The program never waits for a client: an answer that does not fit the kernel's buffer is cut.

use std::io::{ErrorKind, Read as _, Write as _};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use serde_json::Value;
use uav_relay::{Duration, Instant};

use crate::lines::LONGEST;

/// Maximum number of new connections that one call of [`StatusSocket::questions`] accepts.
const ANSWERS: usize = 4;

/// Maximum number of clients with an incomplete request. If there are more, the oldest requests count as complete, and
/// are answered.
const CLIENTS: usize = 16;

const PATIENCE: Duration = Duration::from_millis(200);

/// Unix socket that accepts status requests and commands; its file is removed on drop.
#[derive(Debug)]
pub struct StatusSocket {
    listener: UnixListener,
    path: PathBuf,
    clients: Vec<Client>,
}

#[derive(Debug)]
struct Client {
    stream: UnixStream,
    received: Vec<u8>,
    until: Instant,
}

/// Complete request of a client.
#[derive(Debug)]
pub struct Question {
    stream: UnixStream,
    /// Command that the client has sent; `None` if the client requests the state.
    pub command: Option<String>,
}

impl StatusSocket {
    /// Creates the socket. A socket file left by an earlier program is replaced.
    ///
    /// # Errors
    /// One line that names the socket and the fault.
    pub fn open(path: &Path) -> Result<Self, String> {
        let named =
            |error: &dyn std::fmt::Display| format!("--status-socket {}: {error}", path.display());
        if let Ok(there) = path.symlink_metadata() {
            if !there.file_type().is_socket() {
                return Err(named(
                    &"a file that is not a socket has this name: give another name, or remove that file",
                ));
            }
            if UnixStream::connect(path).is_ok() {
                return Err(named(&"is already in use"));
            }
            std::fs::remove_file(path).map_err(|error| named(&error))?;
        }
        let listener = UnixListener::bind(path).map_err(|error| named(&error))?;
        listener
            .set_nonblocking(true)
            .map_err(|error| named(&error))?;
        Ok(Self {
            listener,
            path: path.to_owned(),
            clients: Vec::new(),
        })
    }

    /// Returns the file descriptors to poll: the listening socket, and the connected clients.
    pub fn fds(&self) -> impl Iterator<Item = BorrowedFd<'_>> {
        let clients = self.clients.iter().map(|client| client.stream.as_fd());
        std::iter::once(self.listener.as_fd()).chain(clients)
    }

    /// Accepts connections and reads from them; returns the complete requests.
    ///
    /// The second result is the time by which the next call is due; `None` without clients.
    pub fn questions(&mut self, now: Instant) -> (Vec<Question>, Option<Instant>) {
        let accepted = (0..ANSWERS).map_while(|_| self.listener.accept().ok());
        let accepted = accepted.filter(|(stream, _)| stream.set_nonblocking(true).is_ok());
        self.clients.extend(accepted.map(|(stream, _)| Client {
            stream,
            received: Vec::new(),
            until: now + PATIENCE,
        }));
        let over = self.clients.len().saturating_sub(CLIENTS);
        let mut at = 0;
        let complete = self.clients.extract_if(.., |client| {
            at += 1;
            client.is_complete(now) || at <= over
        });
        let questions = complete.map(Client::question).collect();
        let wake = self.clients.iter().map(|client| client.until).min();
        (questions, wake)
    }
}

impl Client {
    /// Reads from the client; returns true if the request is complete.
    ///
    /// A request is complete after a line feed, at the end of the stream, above the maximum length, or after a timeout.
    fn is_complete(&mut self, now: Instant) -> bool {
        let mut bytes = [0; LONGEST];
        let has_ended = match self.stream.read(&mut bytes) {
            Ok(0) => true,
            Ok(count) => {
                self.received.extend(bytes.get(..count).unwrap_or_default());
                false
            }
            Err(error) => error.kind() != ErrorKind::WouldBlock,
        };
        let is_long = self.received.len() > LONGEST;
        has_ended || is_long || self.received.contains(&b'\n') || self.until <= now
    }

    fn question(self) -> Question {
        let text = String::from_utf8_lossy(&self.received);
        let line = text.lines().next().map(str::trim).unwrap_or_default();
        Question {
            command: (!line.is_empty()).then(|| line.to_owned()),
            stream: self.stream,
        }
    }
}

impl Question {
    /// Returns the user and the process that sent the request, as reported by the system.
    #[must_use]
    pub fn user(&self) -> String {
        #[cfg(target_os = "linux")]
        if let Ok(peer) = rustix::net::sockopt::socket_peercred(&self.stream) {
            let (uid, pid) = (peer.uid.as_raw(), peer.pid.as_raw_nonzero());
            return format!("user {uid}, process {pid}");
        }
        "an unknown user".to_owned()
    }

    /// Sends the answer and closes the connection. If the kernel's buffer is full, only a part is sent.
    pub fn answer(mut self, answer: &Value) {
        let _ = self.stream.write_all(format!("{answer}\n").as_bytes());
    }
}

impl Drop for StatusSocket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}
