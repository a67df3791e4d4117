//! Independent autopilot as a process: the messages it receives, and commands to it.

use std::io::Write as _;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};
use host_tests::python;
use serde_json::Value;
use uav_relay::Geodetic;
use uav_relay::flight::axis::Axis;

use crate::process::{LIMIT, Relay, lines_of};

/// Point on earth: latitude and longitude in degrees, and height above mean sea level in m.
pub(crate) type Site = [f64; 3];

pub(crate) const TX: Site = [47.40, 8.54, 420.0];
pub(crate) const RX: Site = [47.41, 8.55, 431.0];

/// Returns the distance of the transmitter from a receiver at `rx`, m.
pub(crate) fn distance_to_m(rx: Site) -> f64 {
    between_m(TX, rx)
}

/// Returns the distance of two points on earth as the crate computes it, m.
pub(crate) fn between_m(tx: Site, rx: Site) -> f64 {
    let [tx, rx] = [tx, rx].map(|[lat, lon, amsl]| Geodetic::from_degrees(lat, lon, amsl).unwrap());
    Axis::try_new(tx, rx).unwrap().distance_m()
}

/// Returns the earth coordinates of a point along the line to the receiver, by geodesics.
pub(crate) fn on_earth(x_m: f64, altitude_m: f64) -> Site {
    toward(RX, x_m, altitude_m)
}

/// Returns the earth coordinates of a point along the line to a receiver at `rx`.
pub(crate) fn toward(rx: Site, x_m: f64, altitude_m: f64) -> Site {
    let earth = Geodesic::wgs84();
    let (length, azimuth, _, _): (f64, f64, f64, f64) = earth.inverse(TX[0], TX[1], rx[0], rx[1]);
    let (lat, lon): (f64, f64) = earth.direct(TX[0], TX[1], azimuth, x_m);
    [
        lat,
        lon,
        TX[2] + (rx[2] - TX[2]) * x_m / length + altitude_m,
    ]
}

/// Returns the distance of two points, m.
pub(crate) fn apart_m(a: Site, b: Site) -> f64 {
    let level: f64 = Geodesic::wgs84().inverse(a[0], a[1], b[0], b[1]);
    level.hypot(a[2] - b[2])
}

pub(crate) fn text(site: Site) -> String {
    site.map(|number| number.to_string()).join(",")
}

/// Returns the options of a relay between `TX` and `RX` that is connected to `autopilot`.
pub(crate) fn options(autopilot: &str) -> String {
    let (tx, rx, distance) = (text(TX), text(RX), distance_to_m(RX));
    format!("--distance {distance} --site-tx {tx} --site-rx {rx} --autopilot {autopilot}")
}

/// Starts the only relay of a chain, connected to `autopilot`, with `more` options.
pub(crate) fn relay(autopilot: &str, more: &str) -> Relay {
    Relay::start(&format!("--index 1 --of 1 {} {more}", options(autopilot)))
}

/// Returns the agreed position of a single relay without an autopilot.
pub(crate) fn agreed() -> Site {
    agreed_toward(RX)
}

/// Returns the agreed position of a single relay for a receiver at `rx`.
pub(crate) fn agreed_toward(rx: Site) -> Site {
    let distance = distance_to_m(rx);
    let mut relay = Relay::start(&format!("--index 1 --of 1 --distance {distance}"));
    let [x_m, y_m, altitude_m, _] = relay.settled().map(f32::from_bits);
    assert_eq!(y_m, 0.0, "it is on the line");
    toward(rx, x_m.into(), altitude_m.into())
}

/// Running script that simulates an autopilot, with its input and output.
#[derive(Debug)]
pub(crate) struct Peer {
    child: Child,
    orders: Option<ChildStdin>,
    lines: Receiver<String>,
}

/// MAVLink message that the simulated autopilot has received, as JSON fields.
#[derive(Clone, Debug)]
pub(crate) struct ReceivedMessage(pub(crate) Value);

impl ReceivedMessage {
    pub(crate) fn is(&self, name: &str) -> bool {
        self.0["mavpackettype"] == name
    }

    pub(crate) fn is_any(&self) -> bool {
        self.0["own"].is_object()
    }

    /// Returns the UDP port to which the simulated drone sends, if it uses UDP.
    pub(crate) fn partner(&self) -> Option<u16> {
        let port = self.0["own"]["partner"][1].as_u64()?;
        u16::try_from(port).ok()
    }

    pub(crate) fn is_target(&self) -> bool {
        self.is("SET_POSITION_TARGET_GLOBAL_INT")
    }

    /// Returns true if this message is a STATUSTEXT with `text`.
    pub(crate) fn is_text(&self, text: &str) -> bool {
        self.is("STATUSTEXT") && self.0["text"] == text
    }

    /// Returns the id and interval, µs, of the requested message; `None` if this message is no request.
    pub(crate) fn requested_interval(&self) -> Option<(u64, u64)> {
        let asks = self.is("COMMAND_LONG") && self.0["command"] == 511;
        let number = |name: &str| self.0[name].as_f64().unwrap() as u64;
        asks.then(|| (number("param1"), number("param2")))
    }

    pub(crate) fn has_velocity(&self) -> bool {
        self.0["type_mask"].as_u64().unwrap() & 0b11_1000 == 0
    }

    /// Returns the target position in a message to the autopilot.
    pub(crate) fn to(&self) -> Site {
        let number = |name: &str| self.0[name].as_f64().unwrap();
        [
            number("lat_int") / 1e7,
            number("lon_int") / 1e7,
            number("alt"),
        ]
    }

    /// Returns the drone's own position at the time it received this message.
    pub(crate) fn own(&self) -> Site {
        let at = &self.0["own"]["at"];
        [0, 1, 2].map(|part| at[part].as_f64().unwrap())
    }

    /// Returns true if this target message has a position that the drone has recently reported as its own.
    pub(crate) fn is_to_own_place(&self) -> bool {
        let said = self.0["own"]["said"].as_array().unwrap().iter();
        let mut said = said.map(|at| [0, 1, 2].map(|part| at[part].as_f64().unwrap()));
        said.any(|at| apart_m(self.to(), at) < 0.05)
    }

    pub(crate) fn mode(&self) -> &str {
        self.0["own"]["mode"].as_str().unwrap()
    }
}

impl Peer {
    /// Starts a Python script with its arguments, and waits until it is ready.
    pub(crate) fn start(script: &str, arguments: &[&str]) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/companion");
        let mut child = Command::new(python::interpreter())
            .arg(folder.join(script))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let peer = Self {
            orders: child.stdin.take(),
            lines: lines_of(child.stdout.take().unwrap()),
            child,
        };
        peer.receive(|heard| heard.is("READY"));
        peer
    }

    /// Starts an autopilot of `kind` (px4 or arducopter) at `link`, on the ground at `x_m` along the line.
    pub(crate) fn autopilot(kind: &str, link: &str, x_m: f64, more: Option<&str>) -> Self {
        let [lat, lon, amsl] = on_earth(x_m, 0.0).map(|number| number.to_string());
        let mut arguments = vec![kind, link, &lat, &lon, &amsl];
        arguments.extend(more);
        Self::start("autopilot.py", &arguments)
    }

    pub(crate) fn order(&mut self, order: &str) {
        writeln!(self.orders.as_mut().unwrap(), "{order}").unwrap();
    }

    /// Arms the simulated drone and takes off under its pilot's control.
    pub(crate) fn takes_off(&mut self) {
        self.order("arm");
        self.order("takeoff");
    }

    /// Waits for the next message for which `wanted` is true, and returns it.
    pub(crate) fn receive(&self, wanted: impl Fn(&ReceivedMessage) -> bool) -> ReceivedMessage {
        self.receive_until(wanted).pop().unwrap()
    }

    /// Receives messages until `wanted` is true for one of them. Returns all received messages, the wanted one last.
    pub(crate) fn receive_until(
        &self,
        wanted: impl Fn(&ReceivedMessage) -> bool,
    ) -> Vec<ReceivedMessage> {
        let end = Instant::now() + LIMIT;
        let mut all = Vec::new();
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let Ok(line) = self.lines.recv_timeout(left) else {
                let from = all.len().saturating_sub(10);
                panic!("it was not heard; the last: {:#?}", &all[from..]);
            };
            let heard = ReceivedMessage(serde_json::from_str(&line).unwrap());
            let is_wanted = wanted(&heard);
            all.push(heard);
            if is_wanted {
                return all;
            }
        }
    }

    /// Returns the messages that arrive during the next `span`.
    pub(crate) fn receive_for(&self, span: Duration) -> Vec<ReceivedMessage> {
        self.forget();
        std::thread::sleep(span);
        self.so_far()
    }

    /// Returns the messages that have arrived and were not returned before.
    pub(crate) fn so_far(&self) -> Vec<ReceivedMessage> {
        let lines = self.lines.try_iter();
        lines
            .map(|line| ReceivedMessage(serde_json::from_str(&line).unwrap()))
            .collect()
    }

    pub(crate) fn forget(&self) {
        drop(self.so_far());
    }

    /// Waits until the companion has requested all of the messages `wanted`: their ids and intervals in µs.
    pub(crate) fn wait_for_requests(&self, wanted: &[(u64, u64)]) {
        let mut left = wanted.to_vec();
        while !left.is_empty() {
            let heard = self.receive(|heard| heard.requested_interval().is_some());
            left.retain(|asked| heard.requested_interval() != Some(*asked));
        }
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // The script ends when its commands end; if it hangs it is killed.
        self.orders = None;
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
