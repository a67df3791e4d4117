//! Who hears whom: a thread for each serial port that listens, and one that carries bytes through the medium.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::medium::Medium;
use uav_relay_sim::simulator::faults::Injected;

/// How long a socket may take nothing before its bytes are dropped: nobody reads at the other end.
const PATIENCE: Duration = Duration::from_secs(2);

/// Drones connected to each other. Ends when every drone's sockets have been closed, or when it is dropped.
#[derive(Debug)]
pub struct Network {
    carrier: Option<JoinHandle<()>>,
    stop: Sender<Heard>,
    injected: Arc<Mutex<Injected>>,
}

/// What a port has sent; without bytes, the end.
#[derive(Debug)]
struct Heard {
    sender: usize,
    bytes: Vec<u8>,
}

/// Who hears each port, by their places in the list of ports.
pub type Hearers = Vec<Vec<usize>>;

/// The hearers of a chain whose ports are listed drone by drone, upstream first: each port's is its neighbour's.
pub fn chain(drones: usize) -> Hearers {
    let downstream_of = |drone: usize| drone.checked_sub(1).map(|before| 2 * before + 1);
    let upstream_of = |drone: usize| (drone < drones).then_some(2 * drone);
    (0..drones)
        .flat_map(|drone| [downstream_of(drone), upstream_of(drone + 1)])
        .map(|hearer| hearer.into_iter().collect())
        .collect()
}

/// The hearers of one radio channel, a port for each drone: everybody but the sender within `range` drones.
pub fn radio(drones: usize, range: usize) -> Hearers {
    (0..drones)
        .map(|sender| {
            (sender.saturating_sub(range)..drones.min(sender + range + 1))
                .filter(|hearer| *hearer != sender)
                .collect()
        })
        .collect()
}

impl Network {
    /// Connects `ports` through `medium`.
    ///
    /// # Errors
    /// When a socket cannot be shared between two threads.
    pub fn connect(
        ports: Vec<UnixStream>,
        hearers: Hearers,
        medium: Medium,
    ) -> std::io::Result<Self> {
        let (stop, heard) = channel();
        for (sender, port) in ports.iter().enumerate() {
            port.set_write_timeout(Some(PATIENCE))?;
            let (port, out) = (port.try_clone()?, stop.clone());
            std::thread::spawn(move || listen(port, sender, &out));
        }
        let injected = Arc::new(Mutex::new(Injected::default()));
        let counted = Arc::clone(&injected);
        let carrier = std::thread::spawn(move || carry(&heard, ports, &hearers, medium, &counted));
        Ok(Self {
            carrier: Some(carrier),
            stop,
            injected,
        })
    }

    /// What has been done to frames so far.
    pub fn injected(&self) -> Injected {
        *self.injected.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        _ = self.stop.send(Heard {
            sender: 0,
            bytes: Vec::new(),
        });
        if let Some(carrier) = self.carrier.take() {
            _ = carrier.join();
        }
    }
}

/// Until the drone's end is closed.
fn listen(mut port: UnixStream, sender: usize, out: &Sender<Heard>) {
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = port.read(&mut buffer) {
        let bytes = buffer.get(..count).unwrap_or_default().to_vec();
        if out.send(Heard { sender, bytes }).is_err() {
            return;
        }
    }
}

fn carry(
    heard: &Receiver<Heard>,
    mut ports: Vec<UnixStream>,
    hearers: &Hearers,
    mut medium: Medium,
    injected: &Mutex<Injected>,
) {
    loop {
        let now = Instant::now();
        while let Some((receiver, bytes)) = medium.receive(now) {
            if let Some(port) = ports.get_mut(receiver) {
                // A drone that is switched off hears nothing, and that is all.
                _ = port.write_all(&bytes);
            }
        }
        *injected.lock().unwrap_or_else(PoisonError::into_inner) = medium.injected();
        let pause = medium.next().map_or(Duration::from_secs(1), |next| {
            next.saturating_duration_since(Instant::now())
        });
        match heard.recv_timeout(pause) {
            Ok(Heard { bytes, .. }) if bytes.is_empty() => return,
            Ok(Heard { sender, bytes }) => {
                let receivers = hearers.get(sender).map_or(&[][..], Vec::as_slice);
                medium.send(Instant::now(), sender, &bytes, receivers);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
    }
}
