//! Link to the drone's autopilot over a tty or UDP. A tty is reopened whenever it disappears.

use std::fmt;
use std::os::fd::BorrowedFd;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use rustix::event::PollFlags;
use serde_json::{Value, json};
use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::autopilot::state::State;
use uav_relay::flight::autopilot::trust::Mistrust;
use uav_relay::flight::autopilot::{
    Address, Autopilot, AutopilotEvent, FlightMode, Kind, ReleaseCause, Signing, Stamp, WaitReason,
};
use uav_relay::flight::axis::Axis;
use uav_relay::serial::SerialPort as _;
use uav_relay::{Band, Event, Instant, Placement, Relay, Side, Sites};

use crate::datagrams::Datagrams;
use crate::lost;
use crate::off_line::{OffLineMonitor, OffLineReport};
use crate::relay::seed;
use crate::unanswered::{AnswerMonitor, Received};
use uav_relay_linux::log::Log;
use uav_relay_linux::replug::Replug;
use uav_relay_scenario::endpoint::Endpoint;

/// Capacity of the send queue of a slow tty, bytes: some seconds of traffic.
const WAITING: usize = 4_096;

const EVENT: &str = "autopilot";

/// Link ID of this program in its MAVLink signatures.
const LINK: u8 = 0;

#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum AutopilotPort {
    Tty(PathBuf, u32),
    Udp(Endpoint),
}

impl fmt::Display for AutopilotPort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tty(path, _) => write!(f, "--autopilot {}", path.display()),
            Self::Udp(endpoint) => write!(f, "--autopilot {endpoint}"),
        }
    }
}

#[derive(Clone, Copy)]
pub(crate) struct SigningKey(pub(crate) [u8; 32]);

impl fmt::Debug for SigningKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("SigningKey(..)")
    }
}

#[derive(Clone, Debug)]
pub(crate) struct AutopilotPlan {
    pub(crate) port: AutopilotPort,
    pub(crate) sites: Sites,
    pub(crate) pace: Pace,
    /// Side of the chain to which the drone's directional antenna points; `None` without such an antenna.
    pub(crate) antenna: Option<Side>,
    pub(crate) key: Option<SigningKey>,
    /// Flight time with a full battery, s (NaN if unknown), return speed and descent speed, m/s.
    ///
    /// `None` if the autopilot's battery messages are not used.
    pub(crate) endurance: Option<[f32; 3]>,
}

/// Open port of an autopilot.
#[derive(Debug)]
pub(crate) enum Port {
    Tty(Replug),
    Udp(Datagrams),
}

impl Port {
    /// Reads bytes from the autopilot's port; returns their number, or `None` if no byte was received.
    pub(crate) fn read(&mut self, into: &mut [u8]) -> Option<usize> {
        let count = match self {
            Self::Tty(tty) => tty.read(into).ok(),
            Self::Udp(datagrams) => Some(datagrams.read(into)),
        };
        count.filter(|count| *count > 0)
    }

    /// Sends a frame. If the tty is full, the rest of the frame is lost.
    pub(crate) fn write(&mut self, frame: &[u8]) {
        match self {
            Self::Tty(tty) => drop(tty.write(frame)),
            Self::Udp(datagrams) => datagrams.send(frame),
        }
    }
}

#[derive(Debug)]
pub(crate) struct Companion {
    plan: AutopilotPlan,
    link: Autopilot,
    port: Port,
    waiting: Vec<u8>,
    state: Option<&'static str>,
    answers: AnswerMonitor,
    off_line: OffLineMonitor,
    /// Numbers of lost relays that the operator has reported as landed over MAVLink. `take_cleared` empties the list.
    cleared: Vec<u16>,
}

impl Companion {
    /// Opens the autopilot's port. The port must exist at the start, because a wrong name is a mistake.
    pub(crate) fn open(plan: &AutopilotPlan, now: Instant) -> Result<Self, String> {
        let port = port(&plan.port)?;
        let axis = Axis::between(plan.sites).map_err(|error| error.to_string())?;
        let mut link = Autopilot::new(axis, plan.pace, now);
        link.set_seed(seed());
        link.point_antenna(plan.antenna);
        if let Some([full_s, return_m_s, descent_m_s]) = plan.endurance {
            link.set_endurance(full_s, return_m_s, descent_m_s);
        }
        if let Some(SigningKey(key)) = plan.key {
            link.sign(Signing::new(key, LINK, stamp(), now));
        }
        Ok(Self {
            link,
            plan: plan.clone(),
            port,
            waiting: Vec::new(),
            state: None,
            answers: AnswerMonitor::new(now),
            off_line: OffLineMonitor::default(),
            cleared: Vec::new(),
        })
    }

    /// Logs the autopilot's port, the drone's speed limit, and whether frames are signed.
    pub(crate) fn started(&self, log: &Log) {
        let (place, pace) = (&self.plan.port, self.plan.pace);
        let from = match place {
            AutopilotPort::Tty(..) => String::new(),
            AutopilotPort::Udp(endpoint) => format!(" from local port {}", endpoint.local),
        };
        log.line(
            Instant::ZERO,
            EVENT,
            format_args!(
                "opened {place}{from}, maximum speed of the drone {} m/s; setpoint control begins when the pilot chooses OFFBOARD (PX4) or GUIDED (ArduCopter) in the air",
                pace.speed_m_s
            ),
        );
        if self.plan.key.is_some() {
            let what = "frames to the autopilot are signed; frames from the autopilot that are not signed with the same key are ignored";
            log.line(Instant::ZERO, EVENT, what);
        }
    }

    pub(crate) fn stopped(&self, now: Instant, log: &Log) {
        let refused = self.link.refused();
        if refused > 0 {
            let what = format_args!(
                "{refused} frames from the autopilot were rejected because of their signatures: check that --autopilot-key-file has the autopilot's key"
            );
            log.line(now, EVENT, what);
        }
    }

    pub(crate) fn status(&self) -> Value {
        let port = match &self.port {
            Port::Tty(tty) => tty.status(),
            Port::Udp(datagrams) => datagrams.status(),
        };
        json!({
            "port": port,
            "state": self.state,
            "flown": self.link.is_flown(),
            "frames_refused": self.link.refused(),
            "unanswered": self.answers.missing().map(|missing| self.unanswered(missing)),
            "position": self.off_line.status(),
        })
    }

    /// Returns the drone's position in the mission's coordinates; `None` if the position is older than 3 s.
    pub(crate) fn place(&self, now: Instant) -> Option<Placement> {
        self.off_line.place(now)
    }

    /// Exchanges bytes with the autopilot and data with the relay; logs the events.
    pub(crate) fn exchange(&mut self, now: Instant, log: &Log, relay: &mut Relay) {
        if let Port::Tty(tty) = &mut self.port {
            tty.tend(now, log);
        }
        let mut bytes = [0; 1_024];
        while let Some(count) = self.port.read(&mut bytes) {
            let bytes = bytes.get(..count).unwrap_or_default();
            self.link.handle_bytes(now, bytes);
        }
        if let (_, Some(position)) = self.link.exchange(relay, now) {
            self.off_line.handle_place(now, position.place);
        }
        while let Some(frame) = self.link.poll_transmit(now) {
            self.send(&frame);
        }
        self.flush();
        let sites = relay.sites().unwrap_or(self.plan.sites);
        while let Some(event) = self.link.poll_event() {
            match event {
                AutopilotEvent::OffLine(off_line) => {
                    if let Some(off) = self.off_line.line_report(sites, off_line) {
                        self.report_off_line(now, log, off);
                    }
                    continue;
                }
                AutopilotEvent::State(state) => self.state = Some(word(state)),
                AutopilotEvent::LostCleared { relays, .. } => self.cleared.extend(numbers(&relays)),
                _ => {}
            }
            log_event(now, log, event);
        }
        self.log_unanswered(now, log);
        self.check_fence(now, log, sites, relay.mission().config().lateral);
    }

    /// Removes and returns the numbers of lost relays that have landed, as reported over MAVLink.
    pub(crate) fn take_cleared(&mut self) -> Vec<u16> {
        std::mem::take(&mut self.cleared)
    }

    /// Reports that the drone is outside its geofence, if such a report is due.
    ///
    /// Every report is logged, and some are also sent to the operator.
    fn check_fence(&mut self, now: Instant, log: &Log, sites: Sites, lateral: Band) {
        let is_in_air = match self.link.state() {
            State::Silent | State::Grounded => false,
            State::Standby | State::Engaged | State::Blind => true,
        };
        let off_line = self.link.off_line(now);
        let off = self
            .off_line
            .check(now, sites, lateral, off_line, is_in_air);
        if let Some(off) = off {
            self.report_off_line(now, log, off);
        }
    }

    fn report_off_line(&mut self, now: Instant, log: &Log, off: OffLineReport) {
        log.event(now, EVENT, off.fields(), off);
        if let Some(text) = off.for_operator() {
            self.link.send_text(&text);
        }
    }

    /// Logs that no autopilot has been found since the start, once for each kind of data received instead.
    fn log_unanswered(&mut self, now: Instant, log: &Log) {
        let received = self.received_kind();
        if let Some(missing) = self.answers.check(now, received) {
            self.state = Some(word(State::Silent));
            let fields = json!({ "state": self.state });
            log.event(now, EVENT, fields, self.unanswered(missing));
        }
    }

    /// Returns the kind of received data, for example noise; `None` once the autopilot is found.
    fn received_kind(&self) -> Option<Received> {
        // A rejected signature is logged elsewhere.
        if self.link.state() != State::Silent || self.link.refused() > 0 {
            return None;
        }
        let bytes = match &self.port {
            Port::Tty(tty) => tty.bytes_in(),
            Port::Udp(datagrams) => datagrams.bytes_in(),
        };
        Some(match (bytes, self.link.counters().frames) {
            (0, _) => Received::Nothing,
            (_, 0) => Received::Noise,
            _ => Received::Others,
        })
    }

    /// Returns the log text about an autopilot that was not found, with hints for the operator.
    ///
    /// `answer` is the kind of data received instead.
    fn unanswered(&self, answer: Received) -> String {
        match (answer, &self.port) {
            (Received::Nothing, Port::Udp(datagrams)) => {
                format!("no answer at {}", datagrams.silence())
            }
            (Received::Nothing, Port::Tty(tty)) => format!(
                "no bytes received at {}, {} bit/s: check that the autopilot is switched on, that its TX is wired to this computer's RX and its RX to this computer's TX, and that its port has this data rate",
                tty.path().display(),
                tty.baud()
            ),
            (Received::Noise, port) => format!(
                "the bytes received at {} are not MAVLink 2: check that {}, and that the autopilot sends MAVLink 2",
                self.plan.port,
                match port {
                    Port::Udp(_) => "this is the address of the autopilot".to_owned(),
                    Port::Tty(tty) => format!("the autopilot's port has {} bit/s", tty.baud()),
                }
            ),
            (Received::Others, _) => format!(
                "MAVLink frames are received at {}, but none from a PX4 or an ArduCopter: connect the relay to the autopilot itself (MAVLink component 1)",
                self.plan.port
            ),
        }
    }

    /// Sends a text to the operator.
    pub(crate) fn send_text(&mut self, text: &str) {
        self.link.send_text(text);
    }

    /// Returns the control state of the drone.
    pub(crate) const fn control(&self) -> State {
        self.link.state()
    }

    /// Returns true while the autopilot reports that the drone is on the ground.
    pub(crate) fn is_landed(&self, now: Instant) -> bool {
        self.link.is_landed(now)
    }

    /// Passes an event of the relay to the autopilot link, which shows it to the operator.
    pub(crate) fn handle_event(&mut self, event: Event) {
        self.link.handle_event(event);
    }

    /// Returns the time by which [`exchange`](Self::exchange) must be called.
    pub(crate) fn wake(&self, now: Instant) -> Instant {
        let link = self.link.poll_timeout(now);
        let again = match &self.port {
            Port::Tty(tty) => tty.wake(),
            Port::Udp(_) => None,
        };
        let others = [again, self.answers.wake()].into_iter().flatten();
        others.fold(link, |wake, again| wake.min(again.max(now)))
    }

    pub(crate) fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        match &self.port {
            Port::Tty(tty) => tty.interest(),
            Port::Udp(datagrams) => Some((datagrams.fd(), PollFlags::IN)),
        }
    }

    pub(crate) fn noticed(&mut self, events: PollFlags) {
        if let Port::Tty(tty) = &mut self.port {
            tty.noticed(events);
        }
    }

    fn send(&mut self, frame: &[u8]) {
        match &mut self.port {
            Port::Udp(datagrams) => datagrams.send(frame),
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

fn log_event(now: Instant, log: &Log, event: AutopilotEvent) {
    let text = match event {
        AutopilotEvent::Found(Kind::Px4) => "found a PX4".to_owned(),
        AutopilotEvent::Found(Kind::ArduCopter) => "found an ArduCopter".to_owned(),
        AutopilotEvent::Restarted => {
            "rebooted; setpoint control begins when the pilot chooses OFFBOARD or GUIDED again in the air"
                .to_owned()
        }
        AutopilotEvent::Refused => {
            "the autopilot flies to a target other than the setpoint that the relay has sent: check whether the setpoint is outside the autopilot's fence"
                .to_owned()
        }
        AutopilotEvent::State(state) => {
            let what = match state {
                State::Silent => {
                    "no heartbeat for 3 s: check that the autopilot is switched on, check its cable, and set its port to MAVLink 2 and to the data rate of this relay"
                }
                State::Grounded => "on the ground, or not armed",
                State::Standby => "in the air, and not controlled by the relay",
                State::Engaged => "setpoint control engaged",
                State::Blind => "no recent position from the autopilot, so the drone keeps its last target",
            };
            return log.event(now, EVENT, json!({ "state": word(state) }), what);
        }
        AutopilotEvent::Released(release) => {
            let (cause, mode) = (cause(release.cause), mode(release.mode));
            format!("setpoint control released: {cause}; flight mode: {mode}")
        }
        AutopilotEvent::Waits(reason) => format!("setpoint control cannot be engaged: {}", wait_reason(reason)),
        AutopilotEvent::Ready => "ready: the pilot may choose OFFBOARD or GUIDED".to_owned(),
        AutopilotEvent::LostCleared { side, relays, from } => {
            let text = lost::cleared(numbers(&relays), side);
            return log_command(now, log, Ok(text), &relays, from);
        }
        AutopilotEvent::ClearRefused { relays, from } => {
            let text = "the command must name all lost relays on one side of this relay (toward Tx or toward Rx), and no other relay";
            return log_command(now, log, Err(text.to_owned()), &relays, from);
        }
        AutopilotEvent::FenceBreached => "the drone is outside the autopilot's fence".to_owned(),
        AutopilotEvent::Mistrusted(why) => mistrusted(why).to_owned(),
        other => format!("{other:?}"),
    };
    log.line(now, EVENT, text);
}

fn numbers(relays: &[u16]) -> impl Iterator<Item = u16> {
    relays.iter().copied().filter(|node| *node != 0)
}

/// Logs an operator's MAVLink command, its sender and its result.
fn log_command(
    now: Instant,
    log: &Log,
    done: Result<String, String>,
    relays: &[u16],
    from: Address,
) {
    let named: Vec<String> = numbers(relays).map(|node| node.to_string()).collect();
    let command = format!("MAV_CMD_USER_1 {}", named.join(" "));
    let Address { system, component } = from;
    let by = format!("MAVLink system {system}, component {component}");
    let done = done.map(|text| ("cleared", text));
    lost::log_command(now, log, done, command.trim(), &by);
}

const fn cause(cause: ReleaseCause) -> &'static str {
    match cause {
        ReleaseCause::Chosen => "the pilot or a ground station chose another mode",
        ReleaseCause::Failsafe => "failsafe of the autopilot",
        ReleaseCause::Fence => "fence of the autopilot breached",
        ReleaseCause::Link => "the link to the autopilot was interrupted or late",
        _ => "for a reason unknown to this program",
    }
}

const fn mode(mode: FlightMode) -> &'static str {
    match mode {
        FlightMode::Companion => "OFFBOARD or GUIDED, unchanged",
        FlightMode::Sticks => "manual",
        FlightMode::Hold => "Hold or LOITER",
        FlightMode::Brake => "BRAKE",
        FlightMode::Return => "RTL",
        FlightMode::Land => "LAND",
        _ => "another mode, for example mission or take-off",
    }
}

const fn wait_reason(reason: WaitReason) -> &'static str {
    match reason {
        WaitReason::Failsafe => "the autopilot is in a failsafe; choose a mode to end it",
        WaitReason::Link => "messages from the autopilot arrive late: check the link to it",
        WaitReason::Found => {
            "the autopilot was in OFFBOARD or GUIDED before this program started: choose another mode, then OFFBOARD or GUIDED again"
        }
        WaitReason::Unseen => {
            "this program has not received the pilot's choice of a mode yet: end the failsafe if there is one, choose a mode other than OFFBOARD and GUIDED, then OFFBOARD or GUIDED"
        }
        WaitReason::Position => {
            "the drone's position is unknown, or not near the line between transmitter and receiver: wait for a position, or fly the drone nearer to the line"
        }
        WaitReason::NotReady => {
            "the relays are not in the order of their numbers along the line from Tx to Rx: fly this drone to the right side of its neighbour first"
        }
        _ => "the reason is unknown",
    }
}

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
            "signs its frames and ignores unsigned frames: give its key with --autopilot-key-file"
        }
        Mistrust::SignsOnly => {
            "signs its frames, but accepts unsigned frames: the relay controls it without a key, because there is no --autopilot-key-file"
        }
        Mistrust::Unsigned => {
            "does not sign its frames, so they are ignored: load the key of --autopilot-key-file into the autopilot, or leave out that option"
        }
        Mistrust::OtherKey => {
            "signs with another key than that of --autopilot-key-file, so its frames are ignored: give the autopilot and this relay the same key"
        }
        Mistrust::Old => {
            "signs with an old timestamp, so its frames are ignored: check the autopilot's clock"
        }
        _ => "sends frames that are not trusted",
    }
}

/// Returns this machine's time as a timestamp of MAVLink signatures.
///
/// If this machine's clock is behind that of the autopilot, the link continues from the autopilot's timestamps.
pub(crate) fn stamp() -> Stamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let micros = since.map_or(0, |since| since.as_micros());
    Stamp::of_unix_micros(u64::try_from(micros).unwrap_or(u64::MAX))
}

/// Opens the autopilot's port.
pub(crate) fn port(place: &AutopilotPort) -> Result<Port, String> {
    match place {
        AutopilotPort::Tty(path, baud) => Replug::open("--autopilot", path, *baud).map(Port::Tty),
        AutopilotPort::Udp(endpoint) => Datagrams::open(endpoint)
            .map(Port::Udp)
            .map_err(|error| format!("{place}: {error}")),
    }
}
