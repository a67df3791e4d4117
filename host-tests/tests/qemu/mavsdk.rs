//! MAVSDK as the autopilot of an emulated drone, on a tty wired to its USART1.

use std::io::{BufRead as _, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};

use host_tests::make;
use host_tests::python;
use rustix::fs::{Mode, OFlags, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serde_json::Value;
use uav_relay::Geodetic;

/// Process with MAVSDK as the autopilot, and the messages that it has received.
pub(crate) struct Mavsdk {
    child: Child,
    orders: ChildStdin,
    new: Receiver<Value>,
    pub(crate) heard: Vec<Value>,
}

impl Mavsdk {
    /// Starts MAVSDK as the autopilot at the end of `socket`, for a drone at `at`.
    pub(crate) fn start(socket: UnixStream, at: Geodetic) -> Self {
        let tty = wired(socket);
        let script =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/companion/mavsdk_autopilot.py");
        let degrees = [at.lat_e7, at.lon_e7].map(|units| (f64::from(units) / 1e7).to_string());
        let mut child = Command::new(python::interpreter())
            .arg(script)
            .arg(format!("serial://{}:115200", tty.display()))
            .args(degrees)
            .arg((f64::from(at.amsl_mm) / 1e3).to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (lines, new) = channel();
        let said = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in said.lines().map_while(Result::ok) {
                if lines.send(serde_json::from_str(&line).unwrap()).is_err() {
                    return;
                }
            }
        });
        Self {
            orders: child.stdin.take().unwrap(),
            child,
            new,
            heard: Vec::new(),
        }
    }

    pub(crate) fn order(&mut self, order: &str) {
        writeln!(self.orders, "{order}").unwrap();
    }

    /// Collects the messages that MAVSDK has received.
    pub(crate) fn drain_messages(&mut self) {
        self.heard.extend(self.new.try_iter());
    }

    pub(crate) fn has_received(&self, name: &str) -> bool {
        self.heard
            .iter()
            .any(|heard| heard["mavpackettype"] == name)
    }

    /// Returns true if the operator has received the status text `text`.
    pub(crate) fn has_text(&self, text: &str) -> bool {
        self.heard.iter().any(|heard| heard["text"] == text)
    }

    /// Returns true if the companion has requested message `id`.
    pub(crate) fn has_request_for(&self, id: u32) -> bool {
        let asks = |heard: &&Value| heard["command"] == 511;
        let mut asked = self.heard.iter().filter(asks);
        asked.any(|heard| heard["param1"].as_f64() == Some(id.into()))
    }

    pub(crate) fn target(&self) -> Option<Geodetic> {
        let is_target = |heard: &&Value| heard["mavpackettype"] == "SET_POSITION_TARGET_GLOBAL_INT";
        let last = self.heard.iter().rev().find(is_target)?;
        Some(make::geodetic(
            last["lat_int"].as_i64().unwrap() as i32,
            last["lon_int"].as_i64().unwrap() as i32,
            (last["alt"].as_f64().unwrap() * 1e3).round() as i32,
        ))
    }
}

impl Drop for Mavsdk {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Creates a tty whose other side is connected to `socket`. Returns its path.
fn wired(socket: UnixStream) -> PathBuf {
    let side = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
    grantpt(&side).unwrap();
    unlockpt(&side).unwrap();
    let path = ptsname(&side, Vec::new()).unwrap().into_string().unwrap();
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let tty = open(&path, flags, Mode::empty()).unwrap();
    // A tty that is not raw would echo bytes before it is opened.
    let mut line = tcgetattr(&tty).unwrap();
    line.make_raw();
    tcsetattr(&tty, OptionalActions::Now, &line).unwrap();
    let side = std::fs::File::from(side);
    let (other, back) = (side.try_clone().unwrap(), socket.try_clone().unwrap());
    std::thread::spawn(move || carry(socket, side));
    std::thread::spawn(move || {
        carry(other, back);
        // The tty must exist until MAVSDK opens it.
        drop(tty);
    });
    PathBuf::from(path)
}

/// Copies bytes from `from` to the other stream until one of the two is closed.
fn carry(mut from: impl Read, mut to: impl Write) {
    let mut bytes = [0; 512];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        if to.write_all(&bytes[..count]).is_err() {
            return;
        }
    }
}
