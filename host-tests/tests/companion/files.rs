//! Folder of a test: key and epoch files, FIFOs, and the status sockets of processes.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::net::Shutdown;
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fs::{CWD, Mode, mkfifoat};
use serde_json::Value;

use crate::process::{LIMIT, wait_until};

/// Temporary folder of a test, with the key files `key` and `other`.
pub(crate) struct Files(tempfile::TempDir);

impl Files {
    pub(crate) fn new() -> Self {
        let files = Self(tempfile::tempdir().unwrap());
        files.write_key("key", &"5eC2e7".repeat(11)[..64]);
        files.write_key("other", &"00000001".repeat(8));
        files
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Returns the path of a file as text, for a command-line option.
    pub(crate) fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    /// Writes a file. Returns its path as text, for a command-line option.
    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), text).unwrap();
        self.text(name)
    }

    /// Writes a key file that only its owner can read. Returns its path as text, for an option.
    pub(crate) fn write_key(&self, name: &str, key: &str) -> String {
        let file = self.write(name, key);
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o600)).unwrap();
        file
    }

    /// Returns the options for signed frames: a key file and an epoch file.
    pub(crate) fn signed(&self, key: &str, epoch: &str) -> String {
        format!(
            "--key-file {} --epoch-file {}",
            self.text(key),
            self.text(epoch)
        )
    }

    /// Creates a FIFO. Returns its path as text, for a command-line option.
    pub(crate) fn fifo(&self, name: &str) -> String {
        mkfifoat(CWD, self.path(name), Mode::RUSR | Mode::WUSR).unwrap();
        self.text(name)
    }
}

/// Writes `text` to the FIFO at `path`, as a measuring program does.
pub(crate) fn write(path: impl AsRef<Path>, text: &str) {
    let mut file = File::options().write(true).open(path).unwrap();
    file.write_all(text.as_bytes()).unwrap();
}

/// Sends `request` to a process's socket and returns the answer.
///
/// If `is_whole` is true, the client then closes its sending side, and the process answers at once.
pub(crate) fn answer(socket: impl AsRef<Path>, request: &str, is_whole: bool) -> String {
    let mut stream = None;
    wait_until(|| {
        stream = UnixStream::connect(&socket).ok();
        stream.is_some()
    });
    let mut stream = stream.unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    if is_whole {
        let _ = stream.shutdown(Shutdown::Write);
    }
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    text
}

/// Returns the status answer of a process's socket.
pub(crate) fn status_of(socket: impl AsRef<Path>) -> Value {
    let text = answer(socket, "", true);
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

/// Returns the status answer of a process's socket; `None` without an answer within `limit`.
pub(crate) fn status_within(socket: impl AsRef<Path>, limit: Duration) -> Option<Value> {
    let mut stream = UnixStream::connect(&socket).ok()?;
    stream.set_read_timeout(Some(limit)).unwrap();
    let _ = stream.shutdown(Shutdown::Write);
    let mut text = String::new();
    stream.read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

/// Queries the status of a process until `is_so` is true for the status. Returns that status.
pub(crate) fn until(socket: impl AsRef<Path>, is_so: impl Fn(&Value) -> bool) -> Value {
    let mut said = Value::Null;
    wait_until(|| {
        said = status_of(&socket);
        is_so(&said)
    });
    said
}
