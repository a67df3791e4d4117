//! Medium that copies every byte of one tty to all others: two ttys form a wire, more a radio channel.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

use crate::pty::Pty;

/// Probability of each fault, per byte.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    pub(crate) loss: f64,
    pub(crate) corrupt: f64,
    pub(crate) seed: u64,
}

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

/// Numbers of lost and corrupted bytes.
#[derive(Debug, Default)]
struct Counts {
    lost: AtomicU64,
    corrupted: AtomicU64,
}

/// Running medium; its ttys vanish when it is dropped.
#[derive(Debug)]
pub(crate) struct Medium {
    paths: Vec<PathBuf>,
    counts: Arc<Counts>,
    stop: Arc<AtomicBool>,
    pump: Option<JoinHandle<()>>,
}

impl Medium {
    pub(crate) fn new(ttys: usize, noise: Noise) -> Self {
        let ptys: Vec<Pty> = (0..ttys).map(|_| Pty::new()).collect();
        let paths = ptys.iter().map(|pty| pty.path().to_owned()).collect();
        let counts = Arc::new(Counts::default());
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, stopped) = (Arc::clone(&counts), Arc::clone(&stop));
        let pump = std::thread::spawn(move || carry(&ptys, noise, &shared, &stopped));
        Self {
            paths,
            counts,
            stop,
            pump: Some(pump),
        }
    }

    pub(crate) fn tty(&self, index: usize) -> &str {
        self.paths[index].to_str().unwrap()
    }

    /// Adds the numbers of lost and corrupted bytes to `sums`.
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

fn carry(ptys: &[Pty], noise: Noise, counts: &Counts, stop: &AtomicBool) {
    let mut rng = ChaCha8Rng::seed_from_u64(noise.seed);
    let look_up = Timespec {
        tv_sec: 0,
        tv_nsec: 20_000_000,
    };
    let count = |counter: &AtomicU64| counter.fetch_add(1, Ordering::Relaxed);
    while !stop.load(Ordering::Relaxed) {
        let mut fds: Vec<_> = ptys
            .iter()
            .map(|pty| PollFd::new(&pty.wire, PollFlags::IN))
            .collect();
        poll(&mut fds, Some(&look_up)).unwrap();
        for (from, source) in ptys.iter().enumerate() {
            let mut buffer = [0; 256];
            let sent = source.read(&mut buffer);
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
