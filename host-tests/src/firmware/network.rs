//! Who hears whom: a thread for each serial port that listens, and one that carries bytes through the medium.
//!
//! As at a serial port, what nobody reads in time is lost: a drone that falls behind hears less, not later and later.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::sockopt::set_socket_send_buffer_size;

use super::medium::Medium;
use uav_relay_sim::simulator::faults::Injected;

/// How long a frame may take once there is room for its beginning.
const PATIENCE: Duration = Duration::from_secs(2);

/// What the kernel may use for frames that wait at a port, in bytes: some four, with what it needs for each.
const WAITING: usize = 16_384;

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
            set_socket_send_buffer_size(port, WAITING)?;
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

/// Whether a frame can be written without waiting.
fn has_room(port: &UnixStream) -> bool {
    let mut asked = [PollFd::new(port, PollFlags::OUT)];
    poll(&mut asked, Some(&Timespec::default())).is_ok_and(|ready| ready > 0)
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
            if let Some(port) = ports.get_mut(receiver).filter(|port| has_room(port)) {
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

#[cfg(test)]
mod tests {
    use std::io::{Read as _, Write as _};
    use std::os::unix::net::UnixStream;
    use std::time::{Duration, Instant};

    use super::{Network, radio};
    use crate::firmware::medium::Medium;
    use uav_relay_sim::simulator::faults::Faults;
    use uav_relay_sim::simulator::link::LinkSpec;

    #[test]
    fn a_port_that_nobody_reads_holds_up_no_other() {
        let (mut drones, mut ports) = (Vec::new(), Vec::new());
        for _ in 0..3 {
            let (drone, port) = UnixStream::pair().unwrap();
            drone
                .set_read_timeout(Some(Duration::from_millis(500)))
                .unwrap();
            drones.push(drone);
            ports.push(port);
        }
        let medium = Medium::new(3, LinkSpec::default(), Faults::default(), 1, Instant::now());
        let _network = Network::connect(ports, radio(3, 2), medium).unwrap();
        // More than a socket holds, and nobody reads the third.
        let frame = [[1; 60].as_slice(), &[0]].concat();
        for sent in 0..2_000 {
            drones[0].write_all(&frame).unwrap();
            let mut heard = vec![0; frame.len()];
            drones[1]
                .read_exact(&mut heard)
                .unwrap_or_else(|error| panic!("after {sent} frames: {error}"));
            assert_eq!(heard, frame);
        }
    }
}
