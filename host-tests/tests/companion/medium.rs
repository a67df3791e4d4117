//! Medium that copies every byte of one tty to all others: two ttys form a wire, more a radio channel.
//!
//! Ttys of a pluggable medium have names as made by udev; each can be unplugged, and plugged in as another tty.

use std::os::unix::fs::symlink;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU16, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tempfile::TempDir;

use crate::pty::{Pty, make_raw};

/// Noise of a medium: the probability per byte of a loss and of a corruption.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    pub(crate) loss: f64,
    pub(crate) corrupt: f64,
    pub(crate) seed: u64,
}

/// Maximum delay of the channel's thread for which the channel compensates by sending faster.
const LATEST: Duration = Duration::from_millis(20);

pub(crate) const QUIET: Noise = Noise {
    loss: 0.0,
    corrupt: 0.0,
    seed: 0,
};

impl Noise {
    /// Returns noise that damages about three in five of the longer frames.
    pub(crate) const fn bad(seed: u64) -> Self {
        Self {
            loss: 0.005,
            corrupt: 0.005,
            seed,
        }
    }
}

/// Numbers of bytes that a medium has lost and corrupted.
#[derive(Debug, Default)]
struct Counts {
    lost: AtomicU64,
    corrupted: AtomicU64,
}

/// Filter for the bytes that tty `from` has sent: true if the other ttys receive them.
type Gate = Box<dyn FnMut(usize, &[u8]) -> bool + Send>;

/// Ttys of a medium; `None` for an unplugged tty.
type Ttys = Mutex<Vec<Option<Arc<Pty>>>>;

/// Running radio channel or wire: copies the bytes of each tty to all other ttys.
///
/// The ttys vanish when the `Medium` is dropped.
#[derive(Debug)]
pub(crate) struct Medium {
    paths: Vec<PathBuf>,
    ptys: Arc<Ttys>,
    counts: Arc<Counts>,
    /// Bit mask of the ttys whose sent bytes are lost.
    cut: Arc<AtomicU16>,
    stop: Arc<AtomicBool>,
    pump: Option<JoinHandle<()>>,
    /// Folder with the names of the ttys; `None` unless the ttys of this medium can be unplugged.
    _folder: Option<TempDir>,
}

impl Medium {
    pub(crate) fn new(ttys: usize, noise: Noise) -> Self {
        let ptys: Vec<Pty> = (0..ttys).map(|_| Pty::new()).collect();
        let paths = ptys.iter().map(|pty| pty.path().to_owned()).collect();
        let ptys = ptys.into_iter().map(|pty| Some(Arc::new(pty))).collect();
        Self::of(paths, ptys, noise, Box::new(|_, _| true), None)
    }

    /// Creates a wire without noise that carries only the bytes that `gate` lets pass.
    pub(crate) fn gated(gate: impl FnMut(usize, &[u8]) -> bool + Send + 'static) -> Self {
        let ptys = [Pty::new(), Pty::new()];
        let paths = ptys.iter().map(|pty| pty.path().to_owned()).collect();
        let ptys = ptys.map(|pty| Some(Arc::new(pty)));
        Self::of(paths, ptys.into(), QUIET, Box::new(gate), None)
    }

    /// Creates a radio channel without noise, on which one sender at a time sends `baud` bit/s.
    pub(crate) fn paced(ttys: usize, baud: u32) -> Self {
        let ptys: Vec<Pty> = (0..ttys).map(|_| Pty::new()).collect();
        let paths: Vec<PathBuf> = ptys.iter().map(|pty| pty.path().to_owned()).collect();
        for path in &paths {
            make_raw(path.to_str().unwrap());
        }
        let ptys = ptys.into_iter().map(|pty| Some(Arc::new(pty))).collect();
        let byte = Duration::from_secs(10) / baud;
        let mut free = Instant::now();
        let paced = move |_, sent: &[u8]| {
            // A busy machine wakes this thread late. The next frame makes up for that, so that the data rate stays.
            let begin = Instant::now()
                .checked_sub(LATEST)
                .map_or(free, |at| at.max(free));
            free = begin + byte * u32::try_from(sent.len()).unwrap();
            std::thread::sleep(free.saturating_duration_since(Instant::now()));
            true
        };
        Self::of(paths, ptys, QUIET, Box::new(paced), None)
    }

    /// Creates a medium without noise whose ttys can be unplugged.
    pub(crate) fn pluggable(ttys: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let name = |index| folder.path().join(format!("radio{index}"));
        let paths = (0..ttys).map(name).collect();
        let open = Box::new(|_, _: &[u8]| true);
        let medium = Self::of(paths, vec![None; ttys], QUIET, open, Some(folder));
        (0..ttys).for_each(|index| medium.plug(index));
        medium
    }

    fn of(
        paths: Vec<PathBuf>,
        ptys: Vec<Option<Arc<Pty>>>,
        noise: Noise,
        gate: Gate,
        folder: Option<TempDir>,
    ) -> Self {
        let (ptys, counts) = (Arc::new(Mutex::new(ptys)), Arc::new(Counts::default()));
        let stop = Arc::new(AtomicBool::new(false));
        let cut = Arc::new(AtomicU16::new(0));
        let (lost, mut passes) = (Arc::clone(&cut), gate);
        let gate: Gate = Box::new(move |from, sent| {
            passes(from, sent) && lost.load(Ordering::Relaxed) >> from & 1 == 0
        });
        let shared = (Arc::clone(&ptys), Arc::clone(&counts), Arc::clone(&stop));
        let pump = std::thread::spawn(move || carry(&shared.0, noise, gate, &shared.1, &shared.2));
        Self {
            paths,
            ptys,
            counts,
            cut,
            stop,
            pump: Some(pump),
            _folder: folder,
        }
    }

    pub(crate) fn tty(&self, index: usize) -> &str {
        self.paths[index].to_str().unwrap()
    }

    /// Unplugs tty `index` of a pluggable medium, and removes its name.
    pub(crate) fn pull(&self, index: usize) {
        std::fs::remove_file(&self.paths[index]).unwrap();
        self.ptys.lock().unwrap()[index] = None;
    }

    /// Plugs a new tty in under the name of tty `index`.
    pub(crate) fn plug(&self, index: usize) {
        let pty = Pty::new();
        make_raw(pty.path().to_str().unwrap());
        symlink(pty.path(), &self.paths[index]).unwrap();
        self.ptys.lock().unwrap()[index] = Some(Arc::new(pty));
    }

    /// Loses all bytes that the ttys of the bit mask `ttys` send from now on; 0 ends all losses.
    pub(crate) fn cut(&self, ttys: u16) {
        self.cut.store(ttys, Ordering::Relaxed);
    }

    /// Adds the numbers of lost and corrupted bytes so far to `sums`.
    pub(crate) fn count(&self, sums: &mut [u64; 2]) {
        sums[0] += self.counts.lost.load(Ordering::Relaxed);
        sums[1] += self.counts.corrupted.load(Ordering::Relaxed);
    }
}

impl Drop for Medium {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let ended = self.pump.take().map(JoinHandle::join);
        assert!(
            std::thread::panicking() || matches!(ended, Some(Ok(()))),
            "the pump has panicked"
        );
    }
}

fn carry(shared: &Ttys, noise: Noise, mut gate: Gate, counts: &Counts, stop: &AtomicBool) {
    let mut rng = ChaCha8Rng::seed_from_u64(noise.seed);
    let look_up = Timespec {
        tv_sec: 0,
        tv_nsec: 20_000_000,
    };
    let count = |counter: &AtomicU64| counter.fetch_add(1, Ordering::Relaxed);
    while !stop.load(Ordering::Relaxed) {
        // A copy: a tty can be unplugged while the others are waited for.
        let ptys: Vec<_> = shared.lock().unwrap().iter().flatten().cloned().collect();
        let mut fds: Vec<_> = ptys
            .iter()
            .map(|pty| PollFd::new(&pty.wire, PollFlags::IN))
            .collect();
        poll(&mut fds, Some(&look_up)).unwrap();
        for (from, source) in ptys.iter().enumerate() {
            let mut buffer = [0; 256];
            let sent = source.read(&mut buffer);
            if sent.is_empty() || !gate(from, sent) {
                continue;
            }
            let others = ptys.iter().enumerate().filter(|(to, _)| *to != from);
            for (_, receiver) in others {
                let mut arriving = Vec::new();
                for &byte in sent {
                    if rng.random_bool(noise.loss) {
                        count(&counts.lost);
                    } else if rng.random_bool(noise.corrupt) {
                        count(&counts.corrupted);
                        arriving.push(byte ^ rng.random_range(1..=u8::MAX));
                    } else {
                        arriving.push(byte);
                    }
                }
                // Bytes that do not fit are lost, as on a UART that is not read.
                receiver.write(&arriving);
            }
        }
    }
}
