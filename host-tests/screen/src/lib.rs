//! A page in a browser that shows a relay chain in flight, on a map, in a table, and by alarms.
//!
//! [`Screen::start`] serves the page at an address. [`Screen::show`] passes a [`Snapshot`] to all browsers that have the page open;
//! it never waits for a browser.
//!
//! ```
//! use uav_relay_screen::{Position, RelaySnapshot, Screen, Snapshot};
//!
//! let screen = Screen::start("127.0.0.1:0".parse()?)?;
//! println!("open {}", screen.url());
//! screen.show(Snapshot {
//!     relays: vec![RelaySnapshot {
//!         position: Some(Position { x_m: 110.0, y_m: 0.0, altitude_m: Some(20.0) }),
//!         ..RelaySnapshot::new(1)
//!     }],
//!     ..Snapshot::default()
//! });
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | content |
//! | --- | --- |
//! | `snapshot` | the state that the page shows |
//! | `chain` | snapshot of a chain from the reports of its relays |
//! | `hops` | SIR of every hop by the mission's model |
//! | `alarms` | list of the alarms, which begin and end |
//! | `station` | alarms and log lines of a ground station, from changes of the reports |
//! | `server` | connections, their limits, and the stream of snapshots |
//! | `clean` | values that the page cannot show |
//! | `request` | checks of a request, and the files of the page |
//!
//! # Security
//!
//! The page of [`Screen::start`] only shows: no request changes anything. The page of [`Screen::start_acting`] can give tasks to the
//! program, by POST requests that have a token. The token is random at each start, and only pages of this server can read it.
//! The server refuses requests with other methods, requests for
//! another host, and requests that the browser marks as those of another site's page, by `Origin` or `Sec-Fetch-Site`. Browsers send
//! `Sec-Fetch-Site` only to loopback addresses as long as the page comes by plain HTTP. At other addresses the server answers a foreign
//! page's GET without `Origin`, as for a picture or a script, and only the browser keeps the answer from that page:
//! by `Cross-Origin-Resource-Policy`, `nosniff`, and because no answer allows another origin. The page loads nothing
//! from elsewhere, and its content security policy allows only its own files. Without a password everyone who reaches the address
//! can use the page. [`Screen::is_public`] tells whether other computers can reach it. The password is sent in the clear, and wrong ones
//! are limited: five a minute from one address.

pub mod alarms;
pub mod chain;
mod clean;
pub mod hops;
mod request;
mod server;
mod snapshot;
pub mod station;

use std::fmt;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;

pub use alarms::{list, named};
pub use clean::clean;
pub use request::{FILES, Task};
pub use server::{MAX_CONNECTIONS, MAX_PER_ADDRESS, MAX_STREAMS, Post, Screen, TileReader, Tiles};
pub use snapshot::{
    Alarm, ChainSize, Condition, Fence, Frame, GroundProfile, Hop, InterfererSnapshot, LogLine,
    Node, Position, RelaySnapshot, Snapshot, Urgency,
};

/// Reason why a screen cannot be served.
#[derive(Debug)]
pub enum ScreenError {
    /// The text is not an address with a port.
    Address,
    /// The server cannot listen at this address, because of this error of the operating system.
    Bind(SocketAddr, io::Error),
    /// The operating system cannot start a thread for the server.
    Thread(io::Error),
}

impl fmt::Display for ScreenError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address => f.write_str(
                "must be ADDRESS:PORT, as 127.0.0.1:8080, [::1]:8080 or localhost:8080, with a port of 0 to 65535 (0: any free port)",
            ),
            Self::Bind(address, error) => match error.kind() {
                ErrorKind::AddrInUse => write!(
                    f,
                    "port {} is in use by another program: give another port, or 0 for any free port",
                    address.port()
                ),
                ErrorKind::AddrNotAvailable => write!(
                    f,
                    "{} is not an address of this computer: give 127.0.0.1 for this computer alone, or 0.0.0.0 for all its addresses",
                    address.ip()
                ),
                ErrorKind::PermissionDenied => write!(
                    f,
                    "port {} needs more rights: give a port within 1024 to 65535",
                    address.port()
                ),
                _ => write!(f, "cannot be bound: {error}"),
            },
            Self::Thread(error) => write!(f, "cannot start a thread: {error}"),
        }
    }
}

impl std::error::Error for ScreenError {}

/// Parses an address with a port, for example `127.0.0.1:8080`. `localhost` is 127.0.0.1.
///
/// # Errors
/// [`ScreenError::Address`] for other text.
pub fn address(text: &str) -> Result<SocketAddr, ScreenError> {
    let plain = text.strip_prefix("localhost:");
    let numeric = plain.map(|port| format!("127.0.0.1:{port}"));
    let address = numeric.as_deref().unwrap_or(text).parse();
    address.map_err(|_| ScreenError::Address)
}

#[cfg(test)]
mod tests {
    use super::address;

    #[test]
    fn an_address_is_an_ip_address_or_localhost_with_a_port() {
        for (text, same) in [
            ("127.0.0.1:8080", "127.0.0.1:8080"),
            ("localhost:0", "127.0.0.1:0"),
            ("[::1]:65535", "[::1]:65535"),
        ] {
            assert_eq!(
                address(text).map(|it| it.to_string()).ok().as_deref(),
                Some(same)
            );
        }
        for text in [
            "",
            "8080",
            "127.0.0.1",
            "127.0.0.1:65536",
            "example.org:80",
            "localhost:",
        ] {
            assert!(address(text).is_err(), "{text}");
        }
    }
}
