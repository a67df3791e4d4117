//! UDP port of an autopilot. The local port is the same at every start.

use std::io::ErrorKind;
use std::net::{SocketAddr, ToSocketAddrs as _, UdpSocket};
use std::os::fd::{AsFd as _, BorrowedFd};

use serde_json::{Value, json};
use uav_relay_scenario::endpoint::Endpoint;

/// Maximum number of attempts of a socket call.
///
/// The reason is that a call can fail because the peer has refused an earlier datagram.
const ATTEMPTS: usize = 4;

#[derive(Debug)]
pub(crate) struct Datagrams {
    socket: UdpSocket,
    peer: SocketAddr,
    endpoint: Endpoint,
    read: u64,
    written: u64,
    /// Number of "connection refused" replies: no program listens at the autopilot's port.
    refused: u64,
}

impl Datagrams {
    /// Binds the local UDP port. Only datagrams from the autopilot's address and port are accepted.
    pub(crate) fn open(endpoint: &Endpoint) -> Result<Self, String> {
        let Endpoint {
            host, port, local, ..
        } = endpoint;
        let resolved = format!("{host}:{port}").to_socket_addrs();
        let peer = resolved
            .map_err(|error| format!("HOST {host} is not found: {error}"))?
            .next()
            .ok_or_else(|| format!("HOST {host} has no address"))?;
        let any = if peer.is_ipv4() { "0.0.0.0" } else { "::" };
        let socket = UdpSocket::bind((any, *local)).map_err(|error| unbound(*local, &error))?;
        socket
            .connect(peer)
            .map_err(|error| format!("{peer} cannot be reached: {error}"))?;
        if socket.local_addr().is_ok_and(|own| own == peer) {
            return Err(format!(
                "{peer} is this program's own address and port: give a LOCAL within 1 to 65535 that differs from PORT in udp:HOST:PORT@LOCAL"
            ));
        }
        let ready = socket.set_nonblocking(true);
        ready.map_err(|error| format!("{peer} cannot be used: {error}"))?;
        Ok(Self {
            socket,
            peer,
            endpoint: endpoint.clone(),
            read: 0,
            written: 0,
            refused: 0,
        })
    }

    /// Reads one datagram; returns its length, or 0 if none was received.
    pub(crate) fn read(&mut self, into: &mut [u8]) -> usize {
        let count = self.call(|socket| socket.recv(into));
        self.read += count as u64;
        count
    }

    /// Sends a frame as one datagram. If the kernel's buffer is full, the frame is dropped, because the next one has
    /// newer data.
    pub(crate) fn send(&mut self, frame: &[u8]) {
        let count = self.call(|socket| socket.send(frame));
        self.written += count as u64;
    }

    fn call(&mut self, mut call: impl FnMut(&UdpSocket) -> std::io::Result<usize>) -> usize {
        for _ in 0..ATTEMPTS {
            match call(&self.socket) {
                // An empty datagram is ignored.
                Ok(0) => {}
                Ok(count) => return count,
                // This error is about an earlier datagram. The present one has not been sent, and received datagrams
                // still wait.
                Err(error) if error.kind() == ErrorKind::ConnectionRefused => self.refused += 1,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => break,
            }
        }
        0
    }

    pub(crate) const fn bytes_in(&self) -> u64 {
        self.read
    }

    /// Returns a log text about an autopilot's address that does not answer, with hints for the operator.
    pub(crate) fn silence(&self) -> String {
        let (peer, local) = (self.peer, self.endpoint.local);
        if self.refused > 0 {
            return format!(
                "{peer} (from local port {local}): connection refused, because no program listens there: check that the autopilot is switched on, and check HOST and PORT of --autopilot"
            );
        }
        format!(
            "{peer} (from local port {local}): check that the autopilot is switched on and sends to local port {local}. A PX4 answers only the first port that has sent to it: restart the PX4, or give that port as LOCAL in udp:HOST:PORT@LOCAL"
        )
    }

    pub(crate) fn status(&self) -> Value {
        json!({
            "option": "--autopilot",
            "port": self.endpoint.to_string(),
            "open": true,
            "local_port": self.endpoint.local,
            "bytes_in": self.read,
            "bytes_out": self.written,
            "times_refused": self.refused,
        })
    }

    pub(crate) fn fd(&self) -> BorrowedFd<'_> {
        self.socket.as_fd()
    }
}

fn unbound(local: u16, error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::AddrInUse => format!(
            "local port {local} is in use by another program: end that program, or give another port as LOCAL in udp:HOST:PORT@LOCAL, within 1 to 65535"
        ),
        ErrorKind::PermissionDenied => format!(
            "local port {local} may not be used by this user: give another port as LOCAL in udp:HOST:PORT@LOCAL, within 1024 to 65535"
        ),
        _ => format!("local port {local} cannot be used: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use super::Datagrams;
    use uav_relay_scenario::endpoint::Endpoint;

    /// Checks that the datagram after a refused one is not lost, neither in sending nor in receiving.
    #[test]
    fn a_refusal_loses_no_datagram() {
        let free = || {
            let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
            socket.local_addr().expect("bound").port()
        };
        let (port, local) = (free(), free());
        let listen = || {
            let socket = UdpSocket::bind(("127.0.0.1", port)).expect("the port is free");
            let limit = std::time::Duration::from_secs(10);
            socket.set_read_timeout(Some(limit)).expect("a limit");
            socket
        };
        let text = format!("udp:127.0.0.1:{port}@{local}");
        let endpoint = Endpoint::parse(&text).expect("UDP").expect("an address");
        let mut datagrams = Datagrams::open(&endpoint).expect("free ports");
        let mut bytes = [0; 16];
        datagrams.send(b"nobody listens");
        let peer = listen();
        datagrams.send(b"one");
        assert_eq!(peer.recv(&mut bytes).ok(), Some(3));
        drop(peer);
        datagrams.send(b"nobody listens");
        let peer = listen();
        peer.send_to(b"", ("127.0.0.1", local)).expect("sent");
        peer.send_to(b"four", ("127.0.0.1", local)).expect("sent");
        assert_eq!(datagrams.read(&mut bytes), 4);
        assert_eq!(datagrams.read(&mut bytes), 0);
        assert_eq!((datagrams.refused, datagrams.bytes_in()), (2, 4));
    }
}
