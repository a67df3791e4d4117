//! Capture of the traffic with the neighbours, for `cargo decode` and Wireshark.
//!
//! A separate thread writes it, so a slow disk blocks nothing. Traffic that exceeds the queue is left out and counted.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde_json::json;
use uav_relay::Instant;
use uav_relay_capture::{Capture, Direction, Frame, FrameSplitter, Interface};

use crate::log::Log;
use crate::replug::Replug;

/// Maximum number of captured reads and writes that wait for the writer thread. Further ones are not captured.
const QUEUE: usize = 1_024;

const MAX_CAPTURES: u32 = 9_999;

/// Bytes that one call has received or sent at the port with number `port`.
struct Piece {
    port: usize,
    at: Duration,
    direction: Direction,
    bytes: Vec<u8>,
    /// Comment on the next frame; empty for none.
    note: String,
}

/// State of a capture of serial traffic, shared by all its ports.
#[derive(Debug, Default)]
struct CaptureState {
    /// Error that ended the capture, if any.
    fault: OnceLock<String>,
    is_reported: AtomicBool,
}

/// Capture of one port. The capture passes the traffic to the writer thread.
#[derive(Debug)]
pub struct Tap {
    port: usize,
    state: Arc<CaptureState>,
    sender: SyncSender<Piece>,
    /// Comment on the next frame; empty for none.
    note: String,
    left_out: u64,
    is_over: bool,
}

impl Tap {
    /// Queues received or sent bytes for the capture.
    pub fn take(&mut self, direction: Direction, bytes: &[u8]) {
        if bytes.is_empty() || self.is_over {
            return;
        }
        let at = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        let piece = Piece {
            port: self.port,
            at,
            direction,
            bytes: bytes.to_vec(),
            note: std::mem::take(&mut self.note),
        };
        match self.sender.try_send(piece) {
            Ok(()) => {}
            Err(TrySendError::Full(piece)) => {
                self.note = piece.note;
                self.left_out = self.left_out.saturating_add(1);
            }
            Err(TrySendError::Disconnected(_)) => self.is_over = true,
        }
    }

    /// Adds a comment to the next frame of this port.
    pub fn note(&mut self, note: &str) {
        if !self.note.is_empty() {
            self.note.push_str("; ");
        }
        self.note.push_str(note);
    }

    /// Returns true if the capture has ended because its file could not be written.
    pub const fn is_over(&self) -> bool {
        self.is_over
    }

    /// Returns the error that ended the capture. Only the first call returns it, though all ports share the capture.
    #[must_use]
    pub fn fault(&self) -> Option<&str> {
        let was_reported = self.state.is_reported.swap(true, Ordering::Relaxed);
        let fault = self
            .state
            .fault
            .get()
            .map_or("the thread that writes it has stopped", |it| it);
        (!was_reported).then_some(fault)
    }

    /// Returns the number of reads and writes left out because the queue was full.
    pub const fn left_out(&self) -> u64 {
        self.left_out
    }
}

/// Captures all further traffic of `ttys` in the file `asked`, or in a new file if `asked` exists.
///
/// An earlier capture is never overwritten, because it may be the only record of a crash. A new file has the name
/// `asked` with a number added, and its name is logged.
///
/// # Errors
/// One line that names the file.
pub fn attach<'a>(
    log: &Log,
    program: &str,
    asked: &Path,
    ttys: impl Iterator<Item = &'a mut Replug>,
) -> Result<(), String> {
    let (file, path) = create(asked)?;
    let wrong = |error: io::Error| format!("--capture {}: {error}", path.display());
    let mut capture = Capture::new(BufWriter::new(file), program, "").map_err(wrong)?;
    let (sender, receiver) = sync_channel(QUEUE);
    let state = Arc::new(CaptureState::default());
    let mut interfaces = Vec::new();
    for (port, tty) in ttys.enumerate() {
        let interface = capture.interface(&tty.to_string(), "").map_err(wrong)?;
        interfaces.push(interface);
        tty.tapped(Tap {
            port,
            state: Arc::clone(&state),
            sender: sender.clone(),
            note: String::new(),
            left_out: 0,
            is_over: false,
        });
    }
    capture.flush().map_err(wrong)?;
    std::thread::spawn(move || {
        // Each `Tap` notices that the channel is closed.
        if let Err(error) = write(&mut capture, &interfaces, &receiver) {
            _ = state.fault.set(error.to_string());
        }
    });
    if path != asked {
        let (name, asked) = (path.display().to_string(), asked.display());
        let what = format_args!("written to {name}, because {asked} holds an earlier capture");
        log.event(Instant::ZERO, "capture", json!({ "file": name }), what);
    }
    Ok(())
}

/// Creates the capture file under the first unused name: `path`, or `path` with a number added.
///
/// A device or FIFO is opened under its own name.
fn create(path: &Path) -> Result<(File, PathBuf), String> {
    let named = |error: io::Error| format!("--capture {}: {error}", path.display());
    let is_other = path.metadata().is_ok_and(|it| !it.is_file());
    if is_other {
        let file = File::options().write(true).open(path).map_err(named)?;
        return Ok((file, path.to_owned()));
    }
    for number in 1..=MAX_CAPTURES {
        let path = numbered(path, number);
        match File::options().write(true).create_new(true).open(&path) {
            Ok(file) => return Ok((file, path)),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(named(error)),
        }
    }
    Err(format!(
        "--capture {}: {MAX_CAPTURES} captures of this name already exist: move them away",
        path.display()
    ))
}

/// Returns the name of capture file `number`: `relay2.pcapng`, `relay2-2.pcapng`, `relay2-3.pcapng`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    if number == 1 {
        return path.to_owned();
    }
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{number}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// Splits the traffic into frames, and writes them. Flushes the file when the queue is empty.
fn write(
    capture: &mut Capture<BufWriter<File>>,
    interfaces: &[Interface],
    pieces: &Receiver<Piece>,
) -> io::Result<()> {
    let mut cuts: Vec<[FrameSplitter; 2]> = interfaces
        .iter()
        .map(|_| <[FrameSplitter; 2]>::default())
        .collect();
    let mut note = String::new();
    while let Ok(first) = pieces.recv() {
        let mut next = Some(first);
        while let Some(piece) = next {
            if !piece.note.is_empty() {
                note.push_str(if note.is_empty() { "" } else { "; " });
                note.push_str(&piece.note);
            }
            let way = usize::from(piece.direction == Direction::Out);
            let port = interfaces.get(piece.port).zip(cuts.get_mut(piece.port));
            if let Some((&interface, [into, out])) = port {
                let cut = if way == 0 { into } else { out };
                cut.push(&piece.bytes, |frame| {
                    let frame = Frame {
                        at: piece.at,
                        bytes: frame.bytes,
                        len: frame.len,
                        direction: piece.direction,
                        comment: &std::mem::take(&mut note),
                    };
                    capture.frame(interface, &frame)
                })?;
            }
            next = pieces.try_recv().ok();
        }
        capture.flush()?;
    }
    Ok(())
}
