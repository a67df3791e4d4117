//! Radio channel of ttys with names as made by udev. Each can be unplugged, and plugged in as another tty.

use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::pty::Pty;

/// Radio channel that copies every byte of one tty to all others.
#[derive(Debug)]
pub(crate) struct Hub {
    folder: tempfile::TempDir,
    ptys: Arc<Mutex<Vec<Option<Pty>>>>,
    stop: Arc<AtomicBool>,
    pump: Option<JoinHandle<()>>,
}

impl Hub {
    pub(crate) fn new(ttys: usize) -> Self {
        let ptys: Arc<Mutex<Vec<Option<Pty>>>> =
            Arc::new(Mutex::new((0..ttys).map(|_| None).collect()));
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, stopped) = (Arc::clone(&ptys), Arc::clone(&stop));
        let pump = std::thread::spawn(move || {
            while !stopped.load(Ordering::Relaxed) {
                carry(&shared.lock().unwrap());
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        let hub = Self {
            folder: tempfile::tempdir().unwrap(),
            ptys,
            stop,
            pump: Some(pump),
        };
        (0..ttys).for_each(|index| hub.plug(index));
        hub
    }

    /// Returns the folder for the files of the channel's relays.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Returns the name of a tty, counted from 0.
    pub(crate) fn name(&self, index: usize) -> PathBuf {
        self.folder.path().join(format!("radio{index}"))
    }

    /// Unplugs a tty and removes its name.
    pub(crate) fn pull(&self, index: usize) {
        std::fs::remove_file(self.name(index)).unwrap();
        self.ptys.lock().unwrap()[index] = None;
    }

    /// Plugs another tty in under the name.
    pub(crate) fn plug(&self, index: usize) {
        let pty = Pty::new();
        crate::pty::make_raw(pty.path().to_str().unwrap());
        symlink(pty.path(), self.name(index)).unwrap();
        self.ptys.lock().unwrap()[index] = Some(pty);
    }
}

impl Drop for Hub {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        let _ = self.pump.take().map(JoinHandle::join);
    }
}

fn carry(ptys: &[Option<Pty>]) {
    for (from, source) in ptys.iter().enumerate() {
        let mut buffer = [0; 1024];
        let Some(source) = source else { continue };
        let sent = source.read(&mut buffer);
        if sent.is_empty() {
            continue;
        }
        let others = ptys.iter().enumerate().filter(|(to, _)| *to != from);
        for receiver in others.filter_map(|(_, pty)| pty.as_ref()) {
            receiver.write(sent);
        }
    }
}
