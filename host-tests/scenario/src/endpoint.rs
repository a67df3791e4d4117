//! UDP address of an autopilot, `udp:HOST:PORT` or `udp:HOST:PORT@LOCAL`.
//!
//! The local port is the same at each start. Until a PX4 restarts, it answers only the first address and port that it
//! received from. With a new local port, a restarted program would get no answer.

use core::fmt;

const PREFIX: &str = "udp:";

/// UDP ports at which PX4's simulation listens for a companion computer: one for each vehicle 0 to 9.
const PX4_LISTENS: core::ops::RangeInclusive<u16> = 14_580..=14_589;
/// Local UDP port to which vehicle 0 of PX4's simulation sends.
///
/// Vehicle n sends to port 14540 + n.
const PX4_SENDS_TO: u16 = 14_540;

/// Difference by which the companion's default local port is larger than the autopilot's port.
///
/// It applies only to autopilot ports outside of [`PX4_LISTENS`]. For ports in that range the local ports start at
/// [`PX4_SENDS_TO`].
const APART: u16 = 1_000;

/// Description of a valid UDP address and its ports, for error messages.
pub const FORM: &str = "udp:HOST:PORT with PORT within 1 to 64535 (the local port is then up to PORT + 1000), or udp:HOST:PORT@LOCAL with PORT and the local port LOCAL within 1 to 65535";

/// UDP address of an autopilot, and the local UDP port through which the companion talks to it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Endpoint {
    /// Host of the autopilot: a name, an IPv4 address, or an IPv6 address in brackets.
    pub host: String,
    /// UDP port of the autopilot.
    pub port: u16,
    /// Local port from which the companion sends, and at which it receives.
    pub local: u16,
    is_stated: bool,
}

impl Endpoint {
    /// Parses an address; `None` for text without the prefix `udp:`, which names a serial port.
    ///
    /// ```
    /// use uav_relay_scenario::endpoint::Endpoint;
    ///
    /// let local = |text| Endpoint::parse(text).map(|found| found.map(|endpoint| endpoint.local));
    /// assert_eq!(local("/dev/ttyAMA0"), None);
    /// assert_eq!(local("udp:localhost:14583"), Some(Ok(14_543)));
    /// assert_eq!(local("udp:10.0.0.2:5760"), Some(Ok(6_760)));
    /// assert_eq!(local("udp:10.0.0.2:5760@9000"), Some(Ok(9_000)));
    /// ```
    ///
    /// # Errors
    /// The part of the address that is missing or wrong.
    pub fn parse(text: &str) -> Option<Result<Self, EndpointError>> {
        Some(of_address(text.strip_prefix(PREFIX)?))
    }
}

fn of_address(address: &str) -> Result<Endpoint, EndpointError> {
    let (remote, stated) = match address.rsplit_once('@') {
        Some((remote, local)) => (remote, Some(local)),
        None => (address, None),
    };
    let (host, port) = match remote.rsplit_once(':') {
        Some((host, port)) => (host, Some(port)),
        None => (remote, None),
    };
    if host.is_empty() {
        return Err(EndpointError::NoHost);
    }
    let port = port.and_then(number).ok_or(EndpointError::NoPort)?;
    let local = match stated {
        Some(local) => number(local).ok_or(EndpointError::NoLocal)?,
        None => default_local(port).ok_or(EndpointError::NoDefault { port })?,
    };
    Ok(Endpoint {
        host: host.to_owned(),
        port,
        local,
        is_stated: stated.is_some(),
    })
}

/// Parses a port number, 1 to 65535, in decimal digits; `None` for any other text.
fn number(text: &str) -> Option<u16> {
    let is_plain = text.bytes().all(|digit| digit.is_ascii_digit());
    let number = text.parse().ok().filter(|port| *port > 0);
    number.filter(|_| is_plain)
}

/// Returns the default local port for an autopilot at `port`; `None` if that port would exceed 65535.
fn default_local(port: u16) -> Option<u16> {
    if PX4_LISTENS.contains(&port) {
        Some(port - PX4_LISTENS.start() + PX4_SENDS_TO)
    } else {
        port.checked_add(APART)
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { host, port, .. } = self;
        write!(f, "{PREFIX}{host}:{port}")?;
        if self.is_stated {
            write!(f, "@{}", self.local)?;
        }
        Ok(())
    }
}

/// Error in a UDP address: the part that is missing or wrong.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum EndpointError {
    /// The address has no host.
    NoHost,
    /// The autopilot's port is missing, or not within 1 to 65535.
    NoPort,
    /// The local port after `@` is not within 1 to 65535.
    NoLocal,
    /// The address states no local port, and the default, PORT + 1000, exceeds 65535.
    NoDefault {
        /// PORT of the address: the autopilot's UDP port.
        port: u16,
    },
}

impl fmt::Display for EndpointError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoHost => f.write_str("has no HOST"),
            Self::NoPort => f.write_str("has no valid PORT"),
            Self::NoLocal => f.write_str("has a LOCAL that is not within 1 to 65535"),
            Self::NoDefault { port } => write!(
                f,
                "needs @LOCAL, because the default local port, PORT + {APART} = {}, is above 65535",
                u32::from(*port) + u32::from(APART)
            ),
        }
    }
}

impl core::error::Error for EndpointError {}

#[cfg(test)]
mod tests {
    use super::{Endpoint, EndpointError};

    fn parsed(text: &str) -> Result<(String, u16, u16), EndpointError> {
        let endpoint = Endpoint::parse(text).expect("it begins with udp:")?;
        assert_eq!(endpoint.to_string(), text);
        Ok((endpoint.host, endpoint.port, endpoint.local))
    }

    #[test]
    fn the_local_port_follows_from_the_port_unless_it_is_stated() {
        let local = |text: &str| parsed(text).map(|(_, _, local)| local);
        for i in 0..10 {
            let text = format!("udp:h:{}", 14_580 + i);
            assert_eq!(local(&text), Ok(14_540 + i));
        }
        assert_eq!(local("udp:h:14579"), Ok(15_579));
        assert_eq!(local("udp:h:14590"), Ok(15_590));
        assert_eq!(local("udp:h:1"), Ok(1_001));
        assert_eq!(local("udp:h:64535"), Ok(65_535));
        assert_eq!(local("udp:h:64535@1"), Ok(1));
        assert_eq!(local("udp:h:65535@65535"), Ok(65_535));
        let none = EndpointError::NoDefault { port: 64_536 };
        assert_eq!(local("udp:h:64536"), Err(none));
        assert_eq!(
            none.to_string(),
            "needs @LOCAL, because the default local port, PORT + 1000 = 65536, is above 65535"
        );
    }

    #[test]
    fn hosts_are_names_and_addresses() {
        for host in ["localhost", "127.0.0.1", "[::1]", "::1", "fc.example"] {
            let text = format!("udp:{host}:5760@5761");
            assert_eq!(parsed(&text), Ok((host.to_owned(), 5_760, 5_761)));
        }
    }

    #[test]
    fn errors_of_an_address_are_named() {
        use EndpointError::{NoHost, NoLocal, NoPort};
        for (text, error) in [
            ("udp:", NoHost),
            ("udp::14580", NoHost),
            ("udp:@14540", NoHost),
            ("udp:h", NoPort),
            ("udp:h:", NoPort),
            ("udp:h:0", NoPort),
            ("udp:h:+1", NoPort),
            ("udp:h:65536", NoPort),
            ("udp:h:x@1", NoPort),
            ("udp:h@1", NoPort),
            ("udp:h:1@", NoLocal),
            ("udp:h:1@0", NoLocal),
            ("udp:h:1@+5", NoLocal),
            ("udp:h:1@65536", NoLocal),
            ("udp:h:1@ 5", NoLocal),
        ] {
            assert_eq!(parsed(text), Err(error), "{text}");
        }
        assert_eq!(Endpoint::parse("/dev/ttyAMA0"), None);
    }
}
