//! A unix socket that answers each connection with one JSON object and closes it. What a client does not take it does not get: nobody
//! is waited for.

use std::io::Write as _;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};

use serde_json::Value;

/// Connections that are answered at once, at most.
const ANSWERS: usize = 4;

/// The socket; its name is removed in the end.
#[derive(Debug)]
pub struct StatusSocket {
    listener: UnixListener,
    path: PathBuf,
}

impl StatusSocket {
    /// Makes it, in place of one that a program before has left behind.
    ///
    /// # Errors
    /// One line that names it and what is wrong.
    pub fn open(path: &Path) -> Result<Self, String> {
        let named =
            |error: &dyn std::fmt::Display| format!("--status-socket {}: {error}", path.display());
        if let Ok(there) = path.symlink_metadata() {
            if !there.file_type().is_socket() {
                return Err(named(&"there is another file of that name"));
            }
            if UnixStream::connect(path).is_ok() {
                return Err(named(&"is in use already"));
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
        })
    }

    /// What to sleep on.
    pub fn fd(&self) -> BorrowedFd<'_> {
        self.listener.as_fd()
    }

    /// Whoever has connected since.
    pub fn clients(&self) -> Vec<UnixStream> {
        let accepted = (0..ANSWERS).map_while(|_| self.listener.accept().ok());
        accepted.map(|(client, _)| client).collect()
    }
}

/// Answers with `status`. It fits into what the kernel holds for a connection; who leaves no room gets less.
pub fn answer(mut client: UnixStream, status: &Value) {
    if client.set_nonblocking(true).is_ok() {
        let _ = client.write_all(format!("{status}\n").as_bytes());
    }
}

impl Drop for StatusSocket {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}
