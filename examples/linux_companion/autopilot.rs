//! The drone's autopilot, over a tty or UDP: opened again whenever it vanishes.

use std::fmt;
use std::net::{ToSocketAddrs as _, UdpSocket};
use std::os::fd::{AsFd as _, BorrowedFd};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use rustix::event::PollFlags;
use serde_json::{Value, json};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::autopilot::trust::Mistrust;
use uav_relay::flight::autopilot::{Autopilot, AutopilotEvent, Kind};
use uav_relay::flight::axis::Axis;
use uav_relay::flight::mavlink::signing::{Signing, Stamp};
use uav_relay::serial::SerialPort as _;
use uav_relay::{Event, Instant, Relay, Sites};

use uav_relay_linux::log::Log;
use uav_relay_linux::replug::Replug;

/// What waits for a tty that is slow, at most, bytes: some seconds of what is said.
const WAITING: usize = 4_096;

/// What its lines are about.
const EVENT: &str = "autopilot";

/// The number of this link in what is signed.
const LINK: u8 = 0;

/// Where it is.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Where {
    /// On a tty, at that many bit/s.
    Tty(PathBuf, u32),
    /// At a host and port, from where it answers.
    Udp(String),
}

impl fmt::Display for Where {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tty(path, _) => write!(f, "--autopilot {}", path.display()),
            Self::Udp(address) => write!(f, "--autopilot udp:{address}"),
        }
    }
}

/// What the autopilot signs with.
#[derive(Clone, Copy)]
pub(crate) struct SigningKey(pub(crate) [u8; 32]);

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SigningKey(..)")
    }
}

/// What to reach, and between which sites it flies.
#[derive(Clone, Debug)]
pub(crate) struct AutopilotPlan {
    pub(crate) place: Where,
    pub(crate) sites: Sites,
    pub(crate) pace: Pace,
    pub(crate) key: Option<SigningKey>,
}

#[derive(Debug)]
enum Port {
    Tty(Replug),
    Udp(UdpSocket),
}

/// The link, and what it goes over.
#[derive(Debug)]
pub(crate) struct Companion {
    plan: AutopilotPlan,
    link: Autopilot,
    /// Between which sites it flies.
    between: Sites,
    port: Port,
    waiting: Vec<u8>,
    state: Option<&'static str>,
}

impl Companion {
    /// Opens it. That has to work once: a wrong name is a mistake, a cable that comes loose is not.
    ///
    /// # Errors
    /// One line that says what does not work.
    pub(crate) fn open(plan: &AutopilotPlan, now: Instant) -> Result<Self, String> {
        let port = port(&plan.place)?;
        let axis = Axis::between(plan.sites).map_err(|error| error.to_string())?;
        let mut link = Autopilot::new(axis, plan.pace, now);
        if let Some(SigningKey(key)) = plan.key {
            link.sign(Signing::new(key, LINK, stamp(), now));
        }
        Ok(Self {
            link,
            between: plan.sites,
            plan: plan.clone(),
            port,
            waiting: Vec::new(),
            state: None,
        })
    }

    /// Says what is flown by what.
    pub(crate) fn started(&self, log: &Log) {
        let (place, pace) = (&self.plan.place, self.plan.pace);
        log.tell(
            Instant::ZERO,
            EVENT,
            format_args!(
                "by {place}, {} m/s at most; flies once its pilot chooses OFFBOARD (PX4) or GUIDED (ArduCopter) in the air",
                pace.speed_m_s
            ),
        );
        if self.plan.key.is_some() {
            let what = "frames are signed, and only what is signed with its key counts";
            log.tell(Instant::ZERO, EVENT, format_args!("{what}"));
        }
    }

    /// Says what was not believed.
    pub(crate) fn stopped(&self, now: Instant, log: &Log) {
        let refused = self.link.refused();
        if refused > 0 {
            log.tell(
                now,
                EVENT,
                format_args!("{refused} frames refused by their signatures"),
            );
        }
    }

    /// What it has counted, and how it is.
    pub(crate) fn status(&self) -> Value {
        let port = match &self.port {
            Port::Tty(tty) => tty.status(),
            Port::Udp(_) => json!({ "port": self.plan.place.to_string(), "open": true }),
        };
        json!({
            "port": port,
            "state": self.state,
            "flown": self.link.is_flown(),
            "frames_refused": self.link.refused(),
        })
    }

    /// Moves bytes either way; hands the relay where the drone is and whether its setpoints are flown, and the autopilot the setpoint.
    pub(crate) fn drive(&mut self, now: Instant, log: &Log, relay: &mut Relay) {
        if let Port::Tty(tty) = &mut self.port {
            tty.tend(now, log);
        }
        self.follow(now, relay);
        let mut bytes = [0; 1_024];
        while let Some(count) = self.read(&mut bytes) {
            self.link
                .handle_bytes(now, bytes.get(..count).unwrap_or_default());
        }
        self.link.handle_timeout(now);
        relay.handle_control(now, self.link.is_flown());
        while let Some(position) = self.link.poll_position() {
            relay.handle_position(now, position.at, position.place);
        }
        while let Some(sample) = self.link.poll_sample() {
            relay.handle_sample(now, sample);
        }
        self.link.handle_setpoint(now, relay.setpoint());
        let sir_db = relay.target().map(|target| 10.0 * target.log10());
        self.link.handle_values(now, sir_db, relay.setpoint());
        while let Some(frame) = self.link.poll_transmit(now) {
            self.send(&frame);
        }
        self.flush();
        while let Some(event) = self.link.poll_event() {
            if let AutopilotEvent::State(state) = event {
                self.state = Some(word(state));
            }
            said(now, log, event);
        }
    }

    /// Between the sites of a mission that has just been adopted, before anything is told that is along its line.
    fn follow(&mut self, now: Instant, relay: &Relay) {
        let sites = relay.sites().unwrap_or(self.plan.sites);
        // The relay has found that they make a line.
        if core::mem::replace(&mut self.between, sites) != sites
            && let Ok(axis) = Axis::between(sites)
        {
            self.link.fly_along(now, axis);
        }
    }

    /// Has the operator's ground station show what happened.
    pub(crate) fn tell(&mut self, event: Event) {
        self.link.handle_event(event);
    }

    /// When to come back at the latest.
    pub(crate) fn wake(&self, now: Instant) -> Instant {
        let link = self.link.poll_timeout(now);
        let again = match &self.port {
            Port::Tty(tty) => tty.wake(),
            Port::Udp(_) => None,
        };
        again.map_or(link, |again| link.min(again.max(now)))
    }

    /// What to sleep on.
    pub(crate) fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        match &self.port {
            Port::Tty(tty) => tty.interest(),
            Port::Udp(socket) => Some((socket.as_fd(), PollFlags::IN)),
        }
    }

    /// Takes note of what poll(2) has found.
    pub(crate) fn noticed(&mut self, events: PollFlags) {
        if let Port::Tty(tty) = &mut self.port {
            tty.noticed(events);
        }
    }

    /// How many bytes have come; none where there are none.
    fn read(&mut self, into: &mut [u8]) -> Option<usize> {
        let count = match &mut self.port {
            Port::Tty(tty) => tty.read(into).ok(),
            // Nobody there yet is no reason to give up.
            Port::Udp(socket) => socket.recv(into).ok(),
        };
        count.filter(|count| *count > 0)
    }

    fn send(&mut self, frame: &[u8]) {
        match &self.port {
            // One that does not take it is too slow for the next one as well: the newest counts.
            Port::Udp(socket) => drop(socket.send(frame)),
            Port::Tty(_) if self.waiting.len() + frame.len() <= WAITING => {
                self.waiting.extend_from_slice(frame);
            }
            Port::Tty(_) => {}
        }
    }

    fn flush(&mut self) {
        if let Port::Tty(tty) = &mut self.port
            && !self.waiting.is_empty()
        {
            let sent = tty.write(&self.waiting).unwrap_or(0);
            self.waiting.drain(..sent);
        }
    }
}

fn said(now: Instant, log: &Log, event: AutopilotEvent) {
    match event {
        AutopilotEvent::Found(kind) => {
            log.tell(now, EVENT, format_args!("found {}", called(kind)));
        }
        AutopilotEvent::Restarted => log.tell(now, EVENT, format_args!("was switched off and on")),
        AutopilotEvent::Refused => log.tell(
            now,
            EVENT,
            format_args!("does not fly where it is told to; is the place outside its fence?"),
        ),
        AutopilotEvent::State(state) => {
            let what = match state {
                State::Silent => "silent; look at the cable, the baud rate and MAVLink 2",
                State::Grounded => "on the ground, or not armed",
                State::Standby => "in the air, flown by its pilot",
                State::Engaged => "flies to the relay's setpoints",
                State::Blind => "no position; keeps its last target",
            };
            let fields = json!({ "state": word(state) });
            log.say(now, EVENT, fields, format_args!("{what}"));
        }
        AutopilotEvent::Mistrusted(why) => {
            log.tell(now, EVENT, format_args!("{}", mistrusted(why)));
        }
        other => log.tell(now, EVENT, format_args!("{other:?}")),
    }
}

/// A state in one word, for programs.
const fn word(state: State) -> &'static str {
    match state {
        State::Silent => "silent",
        State::Grounded => "grounded",
        State::Standby => "standby",
        State::Engaged => "engaged",
        State::Blind => "blind",
    }
}

const fn mistrusted(why: Mistrust) -> &'static str {
    match why {
        Mistrust::NoKey => {
            "signs its frames, and ignores what is not signed: give --autopilot-key-file"
        }
        Mistrust::Unsigned => {
            "does not sign, and is not heard: set its key, or leave out --autopilot-key-file"
        }
        Mistrust::OtherKey => {
            "signs with another key than that of --autopilot-key-file, and is not heard"
        }
        Mistrust::Old => "signs with a time of the past, and is not heard: look at its clock",
        _ => "is not believed",
    }
}

/// The stamp of this machine's clock. One that is behind the autopilot's takes that of what it hears.
fn stamp() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let micros = since.map_or(0, |since| since.as_micros());
    Stamp::of_unix_micros(u64::try_from(micros).unwrap_or(u64::MAX))
}

const fn called(kind: Kind) -> &'static str {
    match kind {
        Kind::Px4 => "a PX4",
        Kind::ArduCopter => "an ArduCopter",
    }
}

fn port(place: &Where) -> Result<Port, String> {
    match place {
        Where::Tty(path, baud) => Replug::open("--autopilot", path, *baud).map(Port::Tty),
        Where::Udp(address) => socket(address)
            .map(Port::Udp)
            .map_err(|error| format!("{place}: {error}")),
    }
}

fn socket(address: &str) -> std::io::Result<UdpSocket> {
    let unknown = || std::io::Error::other("is no host and port");
    let peer = address.to_socket_addrs()?.next().ok_or_else(unknown)?;
    let any = if peer.is_ipv4() {
        "0.0.0.0:0"
    } else {
        "[::]:0"
    };
    let socket = UdpSocket::bind(any)?;
    socket.connect(peer)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}
