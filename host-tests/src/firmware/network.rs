//! Network of emulated drones: a thread reads each port, and one more carries bytes through the links.
//!
//! Bytes not read in time are lost, so a drone that falls behind receives less, and not later and later.

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

/// Timeout of a write to a drone that has accepted only a part of a frame.
const PATIENCE: Duration = Duration::from_secs(10);

/// Kernel's send buffer of a drone's port, bytes: about four frames.
const WAITING: usize = 16_384;

/// Running network of emulated drones. It ends on drop, or when the drones close their sockets.
#[derive(Debug)]
pub struct Network {
    carrier: Option<JoinHandle<()>>,
    stop: Sender<PortBytes>,
    injected: Arc<Mutex<Injected>>,
}

/// Bytes that a drone has sent on the port with the index `sender`. An empty message ends the network.
#[derive(Debug)]
struct PortBytes {
    sender: usize,
    bytes: Vec<u8>,
}

/// Topology of a network: entry n has the indices of the ports that receive the bytes of port n.
pub type Hearers = Vec<Vec<usize>>;

/// Returns the topology of a chain of `drones` with wires to the neighbours.
///
/// Each drone has two ports, the upstream port first.
pub fn chain(drones: usize) -> Hearers {
    let downstream_of = |drone: usize| drone.checked_sub(1).map(|before| 2 * before + 1);
    let upstream_of = |drone: usize| (drone < drones).then_some(2 * drone);
    (0..drones)
        .flat_map(|drone| [downstream_of(drone), upstream_of(drone + 1)])
        .map(|hearer| hearer.into_iter().collect())
        .collect()
}

/// Returns the topology of a radio channel that reaches up to `range` drones in each direction.
///
/// Each drone has one port.
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
    /// Connects the drones' `ports` through `medium`. Complete frames that have already arrived are discarded.
    ///
    /// # Errors
    /// A socket cannot be read, configured, or shared between two threads.
    pub fn connect(
        ports: Vec<UnixStream>,
        hearers: Hearers,
        mut medium: Medium,
    ) -> std::io::Result<Self> {
        let (stop, heard) = channel();
        for (sender, port) in ports.iter().enumerate() {
            port.set_write_timeout(Some(PATIENCE))?;
            set_socket_send_buffer_size(port, WAITING)?;
            medium.send(Instant::now(), sender, &begun(port)?, &[]);
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

    /// Returns how many frames were lost, corrupted, duplicated and reordered so far.
    pub fn injected(&self) -> Injected {
        *self.injected.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Network {
    fn drop(&mut self) {
        _ = self.stop.send(PortBytes {
            sender: 0,
            bytes: Vec::new(),
        });
        if let Some(carrier) = self.carrier.take() {
            _ = carrier.join();
        }
    }
}

/// Reads the bytes that have arrived at a port. Returns the bytes after the last complete frame.
fn begun(mut port: &UnixStream) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    port.set_nonblocking(true)?;
    let read = port.read_to_end(&mut bytes);
    port.set_nonblocking(false)?;
    match read {
        Err(error) if error.kind() != std::io::ErrorKind::WouldBlock => return Err(error),
        _ => {}
    }
    let complete = bytes.iter().rposition(|byte| *byte == 0);
    Ok(bytes.split_off(complete.map_or(0, |at| at + 1)))
}

/// Forwards the bytes that a drone sends on a port to `out`, until the drone closes the port.
fn listen(mut port: UnixStream, sender: usize, out: &Sender<PortBytes>) {
    let mut buffer = [0; 1024];
    while let Ok(count @ 1..) = port.read(&mut buffer) {
        let bytes = buffer.get(..count).unwrap_or_default().to_vec();
        if out.send(PortBytes { sender, bytes }).is_err() {
            return;
        }
    }
}

/// Returns true if bytes can be written to the port without waiting.
fn has_room(port: &UnixStream) -> bool {
    let mut asked = [PollFd::new(port, PollFlags::OUT)];
    poll(&mut asked, Some(&Timespec::default())).is_ok_and(|ready| ready > 0)
}

fn carry(
    heard: &Receiver<PortBytes>,
    mut ports: Vec<UnixStream>,
    hearers: &Hearers,
    mut medium: Medium,
    injected: &Mutex<Injected>,
) {
    loop {
        let now = Instant::now();
        while let Some((receiver, bytes)) = medium.receive(now) {
            if let Some(port) = ports.get_mut(receiver).filter(|port| has_room(port)) {
                // A write to a drone that is switched off fails; this is ignored.
                _ = port.write_all(&bytes);
            }
        }
        *injected.lock().unwrap_or_else(PoisonError::into_inner) = medium.injected();
        let pause = medium.next().map_or(Duration::from_secs(1), |next| {
            next.saturating_duration_since(Instant::now())
        });
        match heard.recv_timeout(pause) {
            Ok(PortBytes { bytes, .. }) if bytes.is_empty() => return,
            Ok(PortBytes { sender, bytes }) => {
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
    use uav_relay_sim::simulator::faults::{Faults, LinkSpec};

    #[test]
    fn a_frame_in_transit_is_carried_to_its_end() {
        let (mut ends, mut ports) = (Vec::new(), Vec::new());
        for _ in 0..2 {
            let (end, port) = UnixStream::pair().unwrap();
            end.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
            ends.push(end);
            ports.push(port);
        }
        let medium = Medium::new(2, LinkSpec::default(), Faults::default(), 1, Instant::now());
        ends[0].write_all(&[9, 9, 0, 1, 2]).unwrap();
        let _network = Network::connect(ports, radio(2, 1), medium).unwrap();
        ends[0].write_all(&[3, 0]).unwrap();
        let mut heard = [0; 4];
        ends[1].read_exact(&mut heard).unwrap();
        assert_eq!(heard, [1, 2, 3, 0]);
    }

    #[test]
    fn an_unread_port_delays_no_other_port() {
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
        // More bytes than a socket holds. The third port is not read.
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
