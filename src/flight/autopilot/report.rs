//! Texts and numbers for the operator, shown by a ground station, and events for the firmware.
//!
//! Equal lines are sent at most once per [`SPACING`], critical ones once per [`URGENT`]. Within [`SPACING`] at most
//! [`RECENT`] different lines are sent. A newer line of the same [`Topic`] replaces a waiting line, so the last line on
//! a topic is always current.

use heapless::{Deque, String, Vec};

use crate::event::Event;
use crate::flight::autopilot::state::{Kind, Release, State, WaitReason};
use crate::flight::autopilot::trust::Mistrust;
use crate::flight::autopilot::vehicle::{OffLine, millis};
use crate::flight::mavlink::frame::Address;
use crate::flight::mavlink::outgoing::{Outgoing, severity};
use crate::guard::HoldReason;
use crate::place::Placement;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// Minimum time between two transmissions of the same text line to the operator, ms. Critical lines use [`URGENT`]
/// instead.
const SPACING: u32 = 10_000;

/// Minimum time between two transmissions of the same critical text line to the operator, ms.
const URGENT: u32 = 5_000;

/// Maximum number of different text lines sent to the operator within [`SPACING`].
const RECENT: usize = 16;

/// Maximum number of queued text lines that this autopilot link has written for the operator.
const LINES: usize = 6;
/// Maximum number of queued texts that the firmware has written for the operator.
const TEXTS: usize = 3;

/// Interval at which the chain's SIR and the setpoint's coordinates are sent to the operator.
const PERIOD: Duration = Duration::from_millis(1_000);

const NAMES: [&str; 4] = ["sir_db", "relay_x", "relay_y", "relay_h"];

/// Topic of a text line to the operator. A newer line makes an unsent older line of the same topic obsolete.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Topic {
    /// Event about the control of the drone: the relay takes or loses control.
    Control,
    /// Reason why the relay cannot control the drone now.
    Wait,
    /// Reason why the guard holds the drone back because of the upstream neighbour.
    Upstream,
    /// Reason why the guard holds the drone back because of the downstream neighbour.
    Downstream,
    /// Event of the relay that the operator must see, such as a lost neighbour.
    Relay,
    /// Breach of the autopilot's geofence.
    Fence,
    /// Command of the operator that reports lost relays as landed.
    Clearance,
    /// Order to the pilot to fly home.
    Leave,
}

impl Topic {
    const COUNT: usize = 8;
}

/// Line of text for the operator, in two parts that are joined when it is sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Line {
    topic: Topic,
    severity: u8,
    text: [&'static str; 2],
}

impl Line {
    /// Returns the order to the pilot to fly home. `is_battery` is true if the reason is the battery, and false if the
    /// operator or the firmware has requested the departure.
    pub(super) const fn leave(is_battery: bool) -> Self {
        let why = if is_battery { "battery" } else { "relay" };
        Self {
            topic: Topic::Leave,
            severity: severity::CRITICAL,
            text: [why, ": leave now"],
        }
    }

    pub(super) const fn info(topic: Topic, text: &'static str) -> Self {
        Self {
            topic,
            severity: severity::INFO,
            text: [text, ""],
        }
    }

    pub(super) const fn warning(topic: Topic, text: [&'static str; 2]) -> Self {
        Self {
            topic,
            severity: severity::WARNING,
            text,
        }
    }

    /// Returns the text for the reason why the guard (collision avoidance) holds the drone back on `side`.
    ///
    /// If `reason` is `None`, the text says that the guard no longer holds the drone back on this side.
    pub(super) const fn hold(side: Side, reason: Option<HoldReason>) -> Self {
        let (topic, whom) = match side {
            Side::Upstream => (Topic::Upstream, " the previous drone"),
            Side::Downstream => (Topic::Downstream, " the next drone"),
        };
        let what = match reason {
            Some(HoldReason::Unheard) => "relay: waits, no position from",
            Some(HoldReason::Order) => "relay: waits, wrong order with",
            Some(HoldReason::Close) => "relay: waits, too close to",
            Some(HoldReason::Lost) => "relay: waits, lost relay near",
            Some(HoldReason::NotFlown) => "relay: waits, not engaged:",
            Some(HoldReason::Pending) => "relay: waits, space used by",
            Some(HoldReason::Halted) => "relay: stops, bad order beyond",
            None => "relay: no longer waits for",
        };
        Self::warning(topic, [what, whom])
    }

    /// Returns the text for the operator about an event of the relay; `None` for events without a text.
    pub(super) const fn of(event: Event) -> Option<Self> {
        let text = match event {
            Event::EnduranceUnknown => "battery: endurance unknown",
            Event::AtReserve => "battery: at the reserve",
            Event::Infeasible => "relay: no target SIR met, keeps position",
            Event::NeighbourLost { .. } => "relay: neighbour lost",
            Event::NoQuorum => "relay: no quorum, holds position",
            Event::LeaseLapsed => "relay: agreement expired, keeps setpoint",
            Event::Adopted => "relay: new mission adopted",
            Event::UploadRefused { .. } => "relay: mission rejected, see sites and geofence",
            Event::DuplicateIndex { .. } => "relay: duplicate relay number, land one",
            _ => return None,
        };
        if matches!(event, Event::EnduranceUnknown | Event::AtReserve) {
            return Some(Self::warning(Topic::Relay, [text, ""]));
        }
        Some(Self::info(Topic::Relay, text))
    }

    /// Returns the FNV-1a hash of the line's text, by which equal lines are recognised.
    fn hash(&self) -> u32 {
        hash(self.text)
    }
}

/// Returns the FNV-1a hash of both parts of a text.
fn hash(text: [&str; 2]) -> u32 {
    let bytes = text.into_iter().flat_map(str::bytes);
    bytes.fold(0x811C_9DC5, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    })
}

/// Returns the time from `now` to `until`, in ms that wrap after 49 days; `None` if `until` has passed.
fn left(now: Instant, until: u32) -> Option<Duration> {
    let left = until.wrapping_sub(millis(now.as_micros()));
    (1..=SPACING)
        .contains(&left)
        .then(|| Duration::from_millis(left.into()))
}

/// Queue of the texts and named values for the operator.
#[derive(Clone, Debug, Default)]
pub(super) struct Report {
    lines: Vec<Line, LINES>,
    texts: Deque<String<50>, TEXTS>,
    /// Hashes of the lines sent in the last 10 s. Each hash has the earliest time at which the same line may be sent
    /// again, in ms that wrap after 49 days.
    recent: Vec<(u32, u32), RECENT>,
    /// Hash of the last line sent on each topic; 0 before the first line. If the same line is queued again and cannot
    /// be sent at once, it is dropped.
    newest_sent: [u32; Topic::COUNT],
    values: [Option<f32>; NAMES.len()],
    /// Number of values (SIR and position) sent to the operator in the present second.
    sent: usize,
    next_values_at: Option<Instant>,
}

impl Report {
    /// Queues a line for the operator. If the queue is full, its oldest line is dropped.
    pub(super) fn queue_line(&mut self, line: Line) {
        let newest = self.lines.iter().rfind(|other| other.topic == line.topic);
        if newest == Some(&line) {
            return;
        }
        if self.lines.is_full() {
            self.lines.remove(0);
        }
        // The line fits, because a full queue has just dropped one.
        let _ = self.lines.push(line);
    }

    /// Queues a text line of the firmware for the operator. Returns true if the line was queued, or if it is already
    /// waiting.
    pub(super) fn queue_text(&mut self, text: &str) -> bool {
        let mut line = String::new();
        for character in text.chars() {
            if line.push(character).is_err() {
                break;
            }
        }
        self.texts.iter().any(|text| *text == line) || self.texts.push_back(line).is_ok()
    }

    /// Returns true if a line with the hash `hash` may be sent at `now`, and then records it as sent. The same line may
    /// be sent again after `spacing` ms.
    fn passes(&mut self, now: Instant, hash: u32, spacing: u32) -> bool {
        self.recent.retain(|(_, until)| left(now, *until).is_some());
        let until = millis(now.as_micros()).wrapping_add(spacing);
        self.recent.iter().all(|(of, _)| *of != hash) && self.recent.push((hash, until)).is_ok()
    }

    /// Removes the line at index `at`. Unlike `Vec::remove`, the function does not panic if there is no such line.
    fn remove_line(&mut self, at: usize) {
        let mut index = 0;
        self.lines.retain(|_| {
            index += 1;
            index != at + 1
        });
    }

    /// Removes and returns the next line that may be sent at `now`, with its severity. `None` if there is none.
    fn next_line(&mut self, now: Instant) -> Option<(u8, String<50>)> {
        let mut at = 0;
        while let Some(line) = self.lines.get(at).copied() {
            let hash = line.hash();
            let is_known = self.newest_sent.get(line.topic as usize) == Some(&hash);
            let rest = self.lines.get(at + 1..).unwrap_or_default();
            let is_overtaken = rest.iter().any(|other| other.topic == line.topic);
            let is_urgent = line.severity == severity::CRITICAL;
            let spacing = if is_urgent { URGENT } else { SPACING };
            if self.passes(now, hash, spacing) {
                self.remove_line(at);
                if let Some(newest) = self.newest_sent.get_mut(line.topic as usize) {
                    *newest = hash;
                }
                let mut text = String::new();
                for part in line.text {
                    // No line is longer than 50 bytes.
                    let _ = text.push_str(part);
                }
                return Some((line.severity, text));
            }
            if is_overtaken || is_known {
                self.remove_line(at);
            } else {
                at += 1;
            }
        }
        for _ in 0..self.texts.len() {
            let text = self.texts.pop_front()?;
            if self.passes(now, hash([&text, ""]), SPACING) {
                return Some((severity::INFO, text));
            }
            // The queue has room for the text.
            let _ = self.texts.push_back(text);
        }
        None
    }

    /// Sets the numbers to send to the operator: SIR, dB, and position of the relay. `None` means unknown.
    pub(super) fn values(&mut self, now: Instant, sir_db: Option<f32>, place: Option<Placement>) {
        let [x, y, h] = match place {
            Some(place) => [place.x_m, place.y_m, place.altitude_m].map(Some),
            None => [None; 3],
        };
        self.values = [sir_db, x, y, h].map(|value| value.filter(|value| value.is_finite()));
        if self.next_values_at.is_none() {
            self.next_values_at = Some(now);
        }
    }

    /// Removes the next text or number that is due, and returns it encoded by `encode`. `None` if nothing is due.
    pub(super) fn take<T>(
        &mut self,
        now: Instant,
        boot_ms: u32,
        encode: impl FnOnce(Outgoing<'_>) -> T,
    ) -> Option<T> {
        if let Some((severity, text)) = self.next_line(now) {
            return Some(encode(Outgoing::StatusText {
                severity,
                text: &text,
            }));
        }
        if self.next_values_at.is_none_or(|at| at > now) {
            return None;
        }
        let left = self.values.into_iter().zip(NAMES).skip(self.sent);
        for (value, name) in left {
            self.sent += 1;
            if let Some(value) = value {
                return Some(encode(Outgoing::NamedValue {
                    boot_ms,
                    name,
                    value,
                }));
            }
        }
        self.sent = 0;
        self.next_values_at = Some(now + PERIOD);
        None
    }

    /// Returns the time at which the next line or number is due; `None` if none waits to be sent.
    pub(super) fn next_timeout(&self, now: Instant) -> Option<Instant> {
        let waits = !(self.lines.is_empty() && self.texts.is_empty());
        let lines = self.recent.iter().filter(|_| waits);
        let lines = lines.filter_map(|(_, until)| Some(now + left(now, *until)?));
        lines.chain(self.next_values_at).min()
    }
}

/// Maximum number of lost relays in one command of the operator.
pub(super) const MOST: usize = 7;

/// Numbers of the relays in a command; unused entries are 0.
pub(super) type RelayNumbers = [u16; MOST];

/// Event of the link to an autopilot, for the firmware.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum AutopilotEvent {
    /// The first message of an autopilot has been received. The value is the kind of autopilot.
    Found(Kind),
    /// The autopilot has restarted.
    Restarted,
    /// Change of the control state of the drone: see [`State`].
    State(State),
    /// The relay has lost control of the drone. This event comes together with [`State::Standby`], or up to 1.3 s later
    /// if the cause is possibly a geofence.
    Released(Release),
    /// The relay cannot control the drone now. The value is the reason.
    ///
    /// Either the pilot cannot give the relay control by OFFBOARD or GUIDED, or the pilot has chosen one of these modes
    /// and the relay does not use it.
    Waits(WaitReason),
    /// The pilot can now give the relay control of the drone by OFFBOARD or GUIDED.
    Ready,
    /// The autopilot refuses the target: for 3 s it has reported targets other than the sent ones.
    ///
    /// The sent position is outside the autopilot's geofence, or a second companion sends targets to the same
    /// autopilot.
    Refused,
    /// The autopilot reports that the drone is outside of the autopilot's geofence.
    FenceBreached,
    /// The drone is so far from the line Tx to Rx that it has no position in the mission's coordinates.
    ///
    /// Check that the configured positions of Tx and Rx belong to this flight. The event is raised once on the ground,
    /// and at most once in 10 s in the air.
    OffLine(OffLine),
    /// The link accepted an operator's command that reports the lost relays of one side as landed.
    ///
    /// The command came over MAVLink. [`Autopilot::poll_cleared`](super::Autopilot::poll_cleared) returns the side for
    /// the relay.
    LostCleared {
        /// Side of this relay whose lost relays have landed.
        side: Side,
        /// Node numbers of the relays that have landed, padded with zeros.
        relays: [u16; MOST],
        /// MAVLink address of the command's sender.
        from: Address,
    },
    /// The link denied an operator's command that reports lost relays as landed.
    ///
    /// The numbers in the command are not exactly the numbers of all lost relays of one side.
    ClearRefused {
        /// Numbers of the relays in the command, padded with zeros.
        relays: [u16; MOST],
        /// MAVLink address of the command's sender.
        from: Address,
    },
    /// The signatures of the autopilot and of this link do not match. The value is the kind of mismatch.
    Mistrusted(Mistrust),
}

/// Events that the firmware has not polled yet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Events {
    pub(super) found: Option<Kind>,
    pub(super) restarted: bool,
    pub(super) released: Option<Release>,
    pub(super) state: Option<State>,
    /// Pending [`AutopilotEvent::Waits`] or [`AutopilotEvent::Ready`]; a newer event replaces an older one. `None` if
    /// none is pending.
    pub(super) waits: Option<AutopilotEvent>,
    pub(super) breached: bool,
    pub(super) refused: bool,
    pub(super) off_line: Option<OffLine>,
    /// Pending [`AutopilotEvent::LostCleared`] or [`AutopilotEvent::ClearRefused`]. `None` if none is pending.
    pub(super) clearance: Option<AutopilotEvent>,
}

impl Events {
    /// Removes and returns the next pending event; `None` if there is none.
    pub(super) fn take(&mut self) -> Option<AutopilotEvent> {
        if let Some(kind) = self.found.take() {
            return Some(AutopilotEvent::Found(kind));
        }
        if core::mem::take(&mut self.restarted) {
            return Some(AutopilotEvent::Restarted);
        }
        if core::mem::take(&mut self.breached) {
            return Some(AutopilotEvent::FenceBreached);
        }
        if let Some(release) = self.released.take() {
            return Some(AutopilotEvent::Released(release));
        }
        if let Some(state) = self.state.take() {
            return Some(AutopilotEvent::State(state));
        }
        if let Some(waits) = self.waits.take() {
            return Some(waits);
        }
        if let Some(clearance) = self.clearance.take() {
            return Some(clearance);
        }
        if let Some(off_line) = self.off_line.take() {
            return Some(AutopilotEvent::OffLine(off_line));
        }
        core::mem::take(&mut self.refused).then_some(AutopilotEvent::Refused)
    }
}

#[cfg(test)]
mod tests {
    use super::{HoldReason, Line, Outgoing, Report, Side, Topic};
    use crate::time::Instant;
    use heapless::{String, Vec};

    const fn at(ms: u64) -> Instant {
        Instant::from_millis(ms)
    }

    fn texts(report: &mut Report, now: Instant) -> Vec<String<50>, 32> {
        let mut all = Vec::new();
        while let Some(text) = report.take(now, 0, |message| match message {
            Outgoing::StatusText { text, .. } => String::try_from(text),
            other => panic!("{other:?}"),
        }) {
            all.push(text.expect("50 bytes")).expect("room");
        }
        all
    }

    const ON: Line = Line::info(Topic::Control, "on");
    const OFF: Line = Line::info(Topic::Control, "off");

    #[test]
    fn a_line_is_sent_once_in_ten_seconds_and_the_last_is_current() {
        let mut report = Report::default();
        for i in 0..50_u64 {
            report.queue_line(if i % 2 == 0 { ON } else { OFF });
            let said = texts(&mut report, at(200 * i));
            assert_eq!(said.is_empty(), i >= 2, "{i}: {said:?}");
        }
        // The last line was "off", and it was also the last one that the operator has seen. So no line is sent.
        assert_eq!(texts(&mut report, at(30_000)).len(), 0);
        report.queue_line(ON);
        assert_eq!(texts(&mut report, at(31_000)).as_slice(), ["on"]);
        report.queue_line(OFF);
        assert_eq!(texts(&mut report, at(32_000)).as_slice(), ["off"]);
        report.queue_line(ON);
        assert_eq!(texts(&mut report, at(33_000)).len(), 0);
        assert_eq!(report.next_timeout(at(33_000)), Some(at(41_000)));
        assert_eq!(texts(&mut report, at(41_000)).as_slice(), ["on"]);
    }

    #[test]
    fn lines_of_the_firmware_are_limited_too() {
        let mut report = Report::default();
        assert!(report.queue_text("a") && report.queue_text("b") && report.queue_text("a"));
        assert_eq!(texts(&mut report, at(0)).as_slice(), ["a", "b"]);
        assert!(report.queue_text("a"));
        assert!(texts(&mut report, at(9_000)).is_empty());
        assert_eq!(texts(&mut report, at(10_000)).as_slice(), ["a"]);
    }

    #[test]
    fn every_reason_of_the_guard_fits_into_a_line() {
        use HoldReason::{Close, Halted, Lost, NotFlown, Order, Pending, Unheard};
        for side in [Side::Upstream, Side::Downstream] {
            let all = [Unheard, Order, Close, Lost, NotFlown, Pending, Halted];
            for reason in all.map(Some).into_iter().chain([None]) {
                let line = Line::hold(side, reason);
                assert!(line.text.map(str::len).into_iter().sum::<usize>() <= 50);
            }
        }
    }
}
