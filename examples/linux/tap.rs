//! What goes over the neighbours' ports, in a capture that `cargo decode` and Wireshark read. It is written by a thread of its own: a slow
//! disk holds up nobody, and what the thread cannot keep up with is left out and counted.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use uav_relay_capture::{Capture, Cut, Direction, Frame, Interface};

/// Pieces that wait to be written, at most.
const WAITING: usize = 1_024;

/// What came or went at once, at a port of that number.
struct Piece {
    port: usize,
    at: Duration,
    direction: Direction,
    bytes: Vec<u8>,
}

/// What became of a capture, as all its taps see it.
#[derive(Debug, Default)]
struct Fate {
    /// Why it ended before the program did.
    fault: OnceLock<String>,
    is_told: AtomicBool,
}

/// The tap of one port.
#[derive(Debug)]
pub struct Tap {
    port: usize,
    fate: Arc<Fate>,
    sender: SyncSender<Piece>,
    left_out: u64,
    is_over: bool,
}

impl Tap {
    /// Bytes have come or gone.
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
        };
        match self.sender.try_send(piece) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => self.left_out = self.left_out.saturating_add(1),
            Err(TrySendError::Disconnected(_)) => self.is_over = true,
        }
    }

    /// Whether the file could not be written any more.
    pub const fn is_over(&self) -> bool {
        self.is_over
    }

    /// Why the file could not be written any more; said by the first of its taps that is asked.
    #[must_use]
    pub fn fault(&self) -> Option<&str> {
        let is_told = self.fate.is_told.swap(true, Ordering::Relaxed);
        let fault = self.fate.fault.get().map_or("its writer is gone", |it| it);
        (!is_told).then_some(fault)
    }

    /// Pieces that are missing in it.
    pub const fn left_out(&self) -> u64 {
        self.left_out
    }
}

/// Begins the capture of `program` at `path`, in place of what was there, and gives a tap for each of the ports of these names.
///
/// # Errors
/// One line that names the file.
pub fn taps(program: &str, path: &Path, ports: &[String]) -> Result<Vec<Tap>, String> {
    let wrong = |error: io::Error| format!("--capture {}: {error}", path.display());
    let out = BufWriter::new(File::create(path).map_err(wrong)?);
    let mut capture = Capture::new(out, program, "").map_err(wrong)?;
    let interfaces: Vec<Interface> = ports
        .iter()
        .map(|name| capture.interface(name, "").map_err(wrong))
        .collect::<Result<_, _>>()?;
    capture.flush().map_err(wrong)?;
    let (sender, receiver) = sync_channel(WAITING);
    let fate = Arc::new(Fate::default());
    let ended = Arc::clone(&fate);
    std::thread::spawn(move || {
        // Whoever taps is told by the channel that is gone.
        if let Err(error) = write(&mut capture, &interfaces, &receiver) {
            _ = ended.fault.set(error.to_string());
        }
    });
    Ok((0..ports.len())
        .map(|port| Tap {
            port,
            fate: Arc::clone(&fate),
            sender: sender.clone(),
            left_out: 0,
            is_over: false,
        })
        .collect())
}

/// Cuts what comes into frames, and writes them; what is written is in the file whenever nothing more waits.
fn write(
    capture: &mut Capture<BufWriter<File>>,
    interfaces: &[Interface],
    pieces: &Receiver<Piece>,
) -> io::Result<()> {
    let mut cuts: Vec<[Cut; 2]> = interfaces.iter().map(|_| <[Cut; 2]>::default()).collect();
    while let Ok(first) = pieces.recv() {
        let mut next = Some(first);
        while let Some(piece) = next {
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
                        comment: "",
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
