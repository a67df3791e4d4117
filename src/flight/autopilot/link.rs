//! Link to one autopilot: its reports, the resulting control state, and the targets sent to it.

use super::carrot::Target;
use super::report::{AutopilotEvent, Events};
use super::state::{FlightMode, Kind, Release, ReleaseCause, WaitReason};
use super::vehicle::millis;
use super::vehicle::{OffLine, OffLineDetector};
use crate::event::Event;
use crate::features::UPLOAD;
use crate::flight::autopilot::carrot::{Carrot, Pace};
use crate::flight::autopilot::clearance::{CLEAR_LOST, Clearance};
use crate::flight::autopilot::report::{Line, Report, Topic};
use crate::flight::autopilot::state::{Observed, State};
use crate::flight::autopilot::streams::Streams;
use crate::flight::autopilot::trust::Trust;
use crate::flight::autopilot::vehicle::{Position, RadioNoise, Vehicle, VehicleUpdate};
use crate::flight::axis::Axis;
use crate::flight::mavlink::frame::Address;
use crate::flight::mavlink::incoming::{Counters, Incoming, Parser, Received};
use crate::flight::mavlink::outgoing::{FRAME, FrameBytes, Outgoing};
use crate::geodetic::{Geodetic, Sites};
use crate::guard::HoldReason;
use crate::place::Placement;
use crate::pointing::Bearing;
use crate::relay::Relay;
use crate::sample::Sample;
use crate::side::Side;
use crate::time::{Duration, Instant, MonotonicClock};

use crate::flight::mavlink::signing::Signing;

/// MAVLink component number of this link: an onboard computer, `MAV_COMP_ID_ONBOARD_COMPUTER`.
const COMPONENT: u8 = 191;

/// MAVLink system number of this component until the autopilot's number is known. Autopilots use this number by
/// default.
const SYSTEM: u8 = 1;

const HEARTBEAT: Duration = Duration::from_millis(1_000);

/// Maximum time between two targets to a PX4. After a longer time the PX4 is possibly in its failsafe.
const OVERDUE: Duration = Duration::from_millis(600);

/// Duration of regular position messages after which the state [`State::Blind`] (position lost) ends.
const RECOVERY: Duration = Duration::from_millis(1_000);
/// Duration used instead of [`RECOVERY`] if the position is lost twice within [`SHORT_TIME`].
const LONG_RECOVERY: Duration = Duration::from_millis(10_000);
/// Time after a loss of the position. If the position is lost again within it, [`LONG_RECOVERY`] applies.
const SHORT_TIME: Duration = Duration::from_millis(60_000);

/// Maximum time from an ArduCopter's mode change after a geofence breach to its report of the breach.
const FENCE_SHOWN: Duration = Duration::from_millis(1_300);

/// Minimum time for which the reason why the relay cannot control the drone must be unchanged. It is then reported.
const SETTLED: Duration = Duration::from_millis(1_000);
/// Minimum time between two reports why the relay cannot control the drone.
const NEXT_REASON: Duration = Duration::from_millis(5_000);

/// Time for which the guard must hold the drone back before the reason is reported to the operator. The guard avoids
/// collisions.
const HOLD_SETTLED: Duration = Duration::from_millis(3_000);

/// Link to one autopilot over MAVLink: control state, targets, and reports for the operator.
///
/// # Contract
/// - *Inputs* take anything, never fail and do a bounded amount of work.
/// - *Time* is an argument. A backward step of the caller's clock counts as no time between the two calls.
/// - After every input call [`exchange`](Self::exchange), then [`poll_transmit`](Self::poll_transmit) and [`poll_event`](Self::poll_event) until
///   each returns `None`; then sleep until [`poll_timeout`](Self::poll_timeout) or the next byte. `exchange` calls
///   [`handle_timeout`](Self::handle_timeout), and the other inputs and outputs that concern the relay.
#[derive(Clone, Debug)]
pub struct Autopilot {
    pub(super) axis: Axis,
    /// Tx and Rx positions with which the link was created. Empty without the feature `upload`.
    loaded: [Sites; UPLOAD as usize],
    pace: Pace,
    clock: MonotonicClock,
    began: Instant,
    parser: Parser,
    trust: Trust,
    vehicle: Vehicle,
    streams: Streams,
    state: State,
    setpoint: Option<Placement>,
    bearing: Option<Bearing>,
    /// Side of the neighbour to which a directional antenna points; `None` if `point_antenna` has set none.
    antenna: Option<Side>,
    target: Option<Target>,
    /// Position at which the moving target stops after the setpoint has been withdrawn. `None` while there is a
    /// setpoint.
    stop: Option<Placement>,
    /// Time at which the autopilot last stopped reporting the drone's position; `None` if it never did.
    blind_at: Option<Instant>,
    /// Time since which position messages arrive again in the state [`State::Blind`] (position lost). `None` in all
    /// other states, and while no position arrives.
    located_at: Option<Instant>,
    /// Time for which positions must arrive regularly before the present state [`State::Blind`] ends.
    recovery: Duration,
    /// Loss of control over the drone that has not been reported yet, and the time by which it is reported. `None` if
    /// there is none.
    release: Option<(Release, Instant)>,
    /// Reason why the pilot cannot give the relay control of the drone, and the time of its last change. `None` if the
    /// pilot can give control.
    wait: (Option<WaitReason>, Instant),
    /// Last report why the pilot cannot give the relay control, and its time; `None` if never reported. The inner
    /// `None` stands for the report that the pilot can give control.
    reported_wait: Option<(Option<WaitReason>, Instant)>,
    /// True while the firmware reports that the relay is ready to control the drone.
    ready: bool,
    /// Reported reasons why the guard (collision avoidance) holds the drone back. The first entry is the reason due to
    /// the upstream neighbour, the second the reason due to the downstream neighbour.
    hold: [Option<HoldReason>; 2],
    /// Newest reasons why the guard holds the drone back, and the time of their last change. The order of the two sides
    /// is that of `hold`.
    newest_hold: ([Option<HoldReason>; 2], Instant),
    /// True from the acceptance of a new view (list of relays) until its relays have agreed on positions.
    is_new_view: bool,
    report: Report,
    position: Option<Position>,
    off_line_detector: OffLineDetector,
    clearance: Clearance,
    /// Newest noise measurement of a SiK radio, and the drone's position at that time.
    noise: RadioNoise,
    events: Events,
    sequence: u8,
    heartbeat_at: Instant,
}

impl Autopilot {
    /// Length of the longest frame to send, bytes.
    pub const LONGEST_FRAME: usize = FRAME;

    /// Creates the link to a drone's autopilot. The drone flies along the line `axis` from Tx to Rx, with at most the
    /// speed and acceleration of `pace`.
    pub fn new(axis: Axis, pace: Pace, now: Instant) -> Self {
        Self {
            loaded: [axis.sites(); UPLOAD as usize],
            axis,
            pace,
            clock: MonotonicClock::new(now),
            began: now,
            parser: Parser::new(),
            trust: Trust::default(),
            vehicle: Vehicle::default(),
            streams: Streams::new(now),
            state: State::Silent,
            setpoint: None,
            bearing: None,
            antenna: None,
            target: None,
            stop: None,
            blind_at: None,
            located_at: None,
            recovery: RECOVERY,
            release: None,
            wait: (None, now),
            reported_wait: None,
            ready: true,
            hold: [None; 2],
            newest_hold: ([None; 2], now),
            is_new_view: false,
            report: Report::default(),
            position: None,
            off_line_detector: OffLineDetector::default(),
            clearance: Clearance::default(),
            noise: RadioNoise::NONE,
            events: Events::default(),
            sequence: 0,
            heartbeat_at: now,
        }
    }

    /// Sets a number that differs at each start of the companion, such as the relay's seed.
    ///
    /// The number marks this link's clock requests (TIMESYNC). Otherwise a reply from before a restart of the
    /// companion, buffered in a cable, could count as a reply to this link. A mode that the pilot chose before the
    /// restart would then count as a new choice.
    pub const fn set_seed(&mut self, seed: u32) {
        self.vehicle.echo.seed(seed);
    }

    /// Processes any number of bytes received from the autopilot.
    pub fn handle_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let now = self.clock.advance(now);
        for byte in bytes {
            self.parser.push(*byte);
            while let Some(received) = self.trust.next_received(now, &mut self.parser) {
                self.noise.record(now, &received, &self.vehicle);
                self.handle_command(&received);
                let was_breached = self.vehicle.is_breached;
                let heard = self.vehicle.read(now, &received, &self.axis);
                if self.vehicle.is_breached && !was_breached {
                    self.events.breached = true;
                    let text = ["relay: autopilot fence breached", ""];
                    self.report.queue_line(Line::warning(Topic::Fence, text));
                }
                if heard != VehicleUpdate::Nothing {
                    self.streams.count_message(received.id);
                }
                self.apply_update(now, heard);
            }
        }
    }

    /// Processes an operator's command to this companion. Any sender whose frames the link accepts can send commands.
    fn handle_command(&mut self, received: &Received) {
        let Some(Incoming::CommandLong {
            command: CLEAR_LOST,
            parameters,
            to,
            is_repeated,
        }) = received.message
        else {
            return;
        };
        let is_busy = self.clearance.is_busy() || self.events.clearance.is_some();
        if to != self.own() || is_busy {
            return;
        }
        let event = self
            .clearance
            .command(received.from, parameters, is_repeated);
        let line = match event {
            Some(AutopilotEvent::LostCleared { .. }) => {
                Line::info(Topic::Clearance, "relay: lost drones reported as gone")
            }
            Some(_) => {
                let text = ["relay: denied: name all lost relays toward Tx/Rx", ""];
                Line::warning(Topic::Clearance, text)
            }
            None => return,
        };
        self.events.clearance = event;
        self.report.queue_line(line);
    }

    fn apply_update(&mut self, now: Instant, update: VehicleUpdate) {
        match update {
            VehicleUpdate::Nothing | VehicleUpdate::StateChanged => {}
            VehicleUpdate::Found => {
                self.events.found = self.vehicle.kind();
                self.streams = Streams::new(now);
            }
            VehicleUpdate::Restarted => {
                self.events.restarted = true;
                self.streams = Streams::new(now);
            }
            VehicleUpdate::Position(position) => {
                self.position = Some(position);
                self.off_line_detector.returned();
            }
            VehicleUpdate::OffLine(at) => {
                let is_in_air = !matches!(self.state, State::Silent | State::Grounded);
                if self.off_line_detector.record(now, at, is_in_air) {
                    self.events.off_line = OffLine::new(at, &self.axis);
                }
            }
            VehicleUpdate::RequestResult(result) => self.streams.answer(result),
            VehicleUpdate::Target(lat_e7, lon_e7) => {
                if self.state == State::Engaged
                    && let Some(target) = &mut self.target
                {
                    self.events.refused |= target.compare(now, &self.axis, lat_e7, lon_e7);
                }
            }
        }
        self.review(now);
    }

    /// Sets the line from Tx to Rx after a mission has changed the position of Tx or Rx. Call it when `Relay::sites`
    /// has changed, before the next [`handle_setpoint`](Self::handle_setpoint).
    ///
    /// The drone holds its position until the next setpoint, because the present setpoint belongs to the previous line.
    /// A call with an unchanged line has no effect. Constant work.
    pub fn fly_along(&mut self, now: Instant, axis: Axis) {
        let now = self.clock.advance(now);
        if axis == self.axis {
            return;
        }
        let before = core::mem::replace(&mut self.axis, axis);
        let moved = |place| before.point(place).and_then(|point| axis.place(point));
        self.vehicle.move_places(moved);
        (self.setpoint, self.bearing, self.stop) = (None, None, None);
        // The stored position was measured before the relay knew the new line.
        self.position = None;
        self.off_line_detector = OffLineDetector::default();
        self.target = self.target.and_then(|target| {
            let at = moved(target.carrot.place);
            at.map(|place| Target::at(place, now))
        });
        if self.target.is_none() && self.state.is_flown() {
            self.target = self.at_own_place(now);
        }
    }

    /// Sets the position to fly to, from `Relay::setpoint`. The drone holds its position if there is no setpoint, or if
    /// the setpoint is not finite or too far from the line Tx to Rx.
    pub fn handle_setpoint(&mut self, now: Instant, setpoint: Option<Placement>) {
        let now = self.clock.advance(now);
        let setpoint = setpoint.filter(|place| self.axis.is_around(*place));
        if self.setpoint != setpoint {
            let before = core::mem::replace(&mut self.setpoint, setpoint);
            let stops = |target: Target| Some(target.carrot.stop(before?, self.pace));
            self.stop = match setpoint {
                Some(_) => None,
                None => self.target.and_then(stops),
            };
            if let Some(target) = &mut self.target {
                target.renew(now);
            }
        }
    }

    /// Sets the heading that a directional antenna needs. `None`, or an invalid azimuth, leaves the heading to the autopilot.
    pub fn handle_bearing(&mut self, bearing: Option<Bearing>) {
        self.bearing = bearing.filter(|look| look.azimuth_rad.abs() <= core::f32::consts::PI);
    }

    /// Sets the side of the neighbour to which a directional antenna points. The antenna is mounted facing forward.
    ///
    /// With `None` no heading is sent to the autopilot.
    ///
    /// If a side is set, [`exchange`](Self::exchange) calls [`handle_bearing`](Self::handle_bearing) with
    /// [`Relay::bearing`].
    pub const fn point_antenna(&mut self, side: Option<Side>) {
        self.antenna = side;
    }

    /// Sets the time of flight with a full battery, s, and the speeds of return and descent, m/s.
    ///
    /// Before the first call these three values are NaN, 5 and 1.5. With a time of NaN the battery's percentage gives
    /// no remaining time. The speeds are clamped to 0.1 to 20. From the first call on, the link requests the battery
    /// messages of an ArduCopter.
    pub const fn set_endurance(&mut self, full_s: f32, return_m_s: f32, descent_m_s: f32) {
        let [level, down] = [return_m_s.clamp(0.1, 20.0), descent_m_s.clamp(0.1, 20.0)];
        self.vehicle.battery.setup = Some([full_s, level, down]);
    }

    /// Sets the numbers sent to the operator once a second: the chain's SIR, dB, and the setpoint `place`. `None` means
    /// unknown.
    pub fn handle_values(&mut self, now: Instant, sir_db: Option<f32>, place: Option<Placement>) {
        self.report.values(self.clock.advance(now), sir_db, place);
    }

    /// Records whether the relay is ready to control the drone; initially true. While the relay is not ready, a PX4 in
    /// [`State::Standby`] receives no targets, so that the PX4 refuses the mode OFFBOARD.
    ///
    /// Nothing else changes: a drone that the relay controls stays under control, and an ArduCopter accepts GUIDED in
    /// any case.
    pub fn handle_ready(&mut self, now: Instant, ready: bool) {
        let now = self.clock.advance(now);
        let before = core::mem::replace(&mut self.ready, ready);
        if before != ready && self.state == State::Standby {
            // A PX4 gets targets again only after its next heartbeat, because a PX4 that entered OFFBOARD without
            // targets is in its failsafe.
            self.target = None;
            if self.vehicle.kind() == Some(Kind::Px4) {
                self.vehicle.unchoose();
            }
        }
        self.review(now);
    }

    /// Reports to the operator why the guard (collision avoidance) holds the relay back, for each side.
    ///
    /// A reason is sent while the relay controls the drone or in [`State::Standby`], once the reason has lasted for 3
    /// s. Shorter holds are normal while the relays agree on new positions. The same text is sent at most once in 10 s.
    pub fn handle_hold(&mut self, now: Instant, reasons: [Option<HoldReason>; 2]) {
        let now = self.clock.advance(now);
        if self.newest_hold.0 != reasons {
            self.newest_hold = (reasons, now);
        }
        if matches!(self.state, State::Silent | State::Grounded) {
            self.hold = [None; 2];
            return;
        }
        if now.since(self.newest_hold.1) < HOLD_SETTLED {
            return;
        }
        let before = core::mem::replace(&mut self.hold, reasons);
        let sides = [Side::Upstream, Side::Downstream];
        for ((side, reason), before) in sides.into_iter().zip(reasons).zip(before) {
            if reason != before {
                self.report.queue_line(Line::hold(side, reason));
            }
        }
    }

    /// Queues a text of at most 50 bytes for the operator. Returns true if the queue had room for it, or already
    /// contained it. The queue holds three texts. The same text is sent at most once in 10 s.
    pub fn send_text(&mut self, text: &str) -> bool {
        self.report.queue_text(text)
    }

    /// Processes an event of the relay. The operator is sent a text about events such as a lost neighbour.
    ///
    /// After a new view (list of relays), the text is sent once the relays have agreed on their positions. It is sent
    /// only if the relay controls the drone and the guard does not hold the drone back.
    /// [`handle_hold`](Self::handle_hold) reports why a drone is held back.
    pub fn handle_event(&mut self, event: Event) {
        self.clearance.handle_event(event);
        match event {
            Event::ViewAccepted => self.is_new_view = true,
            Event::Converged => {
                let is_new = core::mem::take(&mut self.is_new_view);
                if is_new && self.state == State::Engaged && self.hold == [None; 2] {
                    let line = Line::info(Topic::Relay, "relay: flies to new position");
                    self.report.queue_line(line);
                }
            }
            _ => {}
        }
        if let Some(line) = Line::of(event) {
            self.report.queue_line(line);
        }
    }

    /// Handles the timers of the autopilot link that are due at `now`. The work per call is constant.
    pub fn handle_timeout(&mut self, now: Instant) {
        let now = self.clock.advance(now);
        self.streams.handle_timeout(now);
        self.review(now);
    }

    /// Updates the control state from the latest messages of the autopilot at `now`.
    fn review(&mut self, now: Instant) {
        self.vehicle.review_choice(now);
        let before = self.state;
        let mut observed = self.vehicle.observed(now);
        self.recover(now, &mut observed);
        self.state = before.next(observed);
        self.review_wait(now);
        self.review_release(now);
        if self.state == before {
            return;
        }
        self.events.state = Some(self.state);
        self.located_at = None;
        self.target = match self.state {
            // The target starts at the drone's position, because the drone may have drifted while its position was
            // unknown.
            State::Engaged => self.at_own_place(now),
            State::Blind => self.target,
            State::Silent | State::Grounded | State::Standby => None,
        };
        self.stop = None;
        let line = match (before, self.state) {
            (State::Blind, State::Engaged) => "relay: position known again",
            (_, State::Engaged) => {
                self.streams.renew();
                "relay: engaged, flies to position"
            }
            (_, State::Blind) => {
                self.blind_at = Some(now);
                if self.vehicle.echo.is_late(now) {
                    "relay: link delayed, keeps last target"
                } else {
                    "relay: no position, keeps last target"
                }
            }
            (State::Engaged | State::Blind, State::Standby) => {
                let release = self.release();
                let is_unclear = release.cause == ReleaseCause::Chosen
                    && self.vehicle.kind() == Some(Kind::ArduCopter)
                    && !matches!(release.mode, FlightMode::Sticks | FlightMode::Hold);
                let until = if is_unclear { now + FENCE_SHOWN } else { now };
                self.release = Some((release, until));
                return self.review_release(now);
            }
            _ => return,
        };
        self.release = None;
        self.report.queue_line(Line::info(Topic::Control, line));
    }

    /// Reports that the relay has lost control of the drone, once the cause is known.
    fn review_release(&mut self, now: Instant) {
        let Some((mut release, until)) = self.release else {
            return;
        };
        let is_fence = self.vehicle.is_breached && release.cause == ReleaseCause::Chosen;
        if until > now && !is_fence {
            return;
        }
        if is_fence {
            release.cause = ReleaseCause::Fence;
        }
        self.release = None;
        self.events.released = Some(release);
        let line = Line::warning(Topic::Control, release.text());
        self.report.queue_line(line);
    }

    /// Keeps the state [`State::Blind`] (position lost) until positions have come regularly for some time. Otherwise
    /// every position of an irregular sequence would change the state.
    fn recover(&mut self, now: Instant, observed: &mut Observed) {
        if self.state != State::Blind {
            self.located_at = None;
            if self.state == State::Engaged && !observed.located {
                let is_again = self.blind_at.is_some_and(|at| now.since(at) < SHORT_TIME);
                self.recovery = if is_again { LONG_RECOVERY } else { RECOVERY };
            }
            return;
        }
        self.located_at = self.located_at.or(Some(now)).filter(|_| observed.located);
        observed.located = self
            .located_at
            .is_some_and(|at| now.since(at) >= self.recovery);
    }

    /// Returns the cause of a loss of control that happens now, and the present mode of the autopilot.
    fn release(&self) -> Release {
        let vehicle = &self.vehicle;
        let mode = vehicle.mode().unwrap_or(FlightMode::Other);
        let cause = if vehicle.is_breached {
            ReleaseCause::Fence
        } else if vehicle.is_critical() {
            ReleaseCause::Failsafe
        } else if vehicle.is_granted() {
            ReleaseCause::Link
        } else {
            ReleaseCause::Chosen
        };
        Release { cause, mode }
    }

    /// Returns the reason why the pilot cannot give the relay control now; `None` if there is none.
    fn wait_reason(&self, now: Instant) -> Option<WaitReason> {
        let vehicle = &self.vehicle;
        let is_px4 = vehicle.kind() == Some(Kind::Px4);
        if is_px4 && vehicle.is_critical() {
            Some(WaitReason::Failsafe)
        } else if vehicle.is_late(now) && vehicle.has_time_stamp() {
            Some(WaitReason::Link)
        } else if vehicle.is_granted() && !vehicle.is_chosen() {
            Some(WaitReason::Found)
        } else if !vehicle.is_chosen() {
            Some(WaitReason::Unseen)
        } else if vehicle.position(now).is_none() {
            Some(WaitReason::Position)
        } else if is_px4 && !self.ready {
            Some(WaitReason::NotReady)
        } else {
            None
        }
    }

    /// Reports the reason why the relay cannot control the drone, once it has lasted for 1 s.
    fn review_wait(&mut self, now: Instant) {
        if self.state != State::Standby {
            self.reported_wait = None;
            self.wait = (None, now);
            return;
        }
        let reason = self.wait_reason(now);
        if self.wait.0 != reason {
            self.wait = (reason, now);
        }
        if self.wait_report_due().is_none_or(|at| at > now) {
            return;
        }
        self.reported_wait = Some((reason, now));
        let (event, line) = match reason {
            Some(reason) => (
                AutopilotEvent::Waits(reason),
                Line::warning(Topic::Wait, [reason.text(), ""]),
            ),
            None => (
                AutopilotEvent::Ready,
                Line::info(Topic::Wait, "relay: ready, choose OFFBOARD or GUIDED"),
            ),
        };
        self.events.waits = Some(event);
        self.report.queue_line(line);
    }

    /// Returns the time at which the reason why the relay cannot control the drone must be reported. `None` once it has
    /// been reported.
    fn wait_report_due(&self) -> Option<Instant> {
        let (reason, since) = self.wait;
        if self.state != State::Standby {
            return None;
        }
        let settled = since + SETTLED;
        match self.reported_wait {
            None => Some(settled),
            Some((reported, _)) if reported == reason => None,
            Some((_, at)) => Some(settled.max(at + NEXT_REASON)),
        }
    }

    fn at_own_place(&self, now: Instant) -> Option<Target> {
        let position = self.vehicle.position(now)?;
        Some(Target::at(position.place, now))
    }

    /// Returns the next frame to send. Call it until it returns `None`.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<FrameBytes> {
        let now = self.clock.advance(now);
        if now == Instant::from_micros(u64::MAX) {
            // The signing clock does not advance here, and frames that are due stay due.
            return None;
        }
        let frame = self.next_frame(now)?;
        Some(self.trust.sign(now, frame))
    }

    /// Returns the next frame to the autopilot; the frame is not signed yet. `None` if none is pending.
    fn next_frame(&mut self, now: Instant) -> Option<FrameBytes> {
        if let Some((to, result)) = self.clearance.take_answer() {
            let command = CLEAR_LOST;
            return Some(self.frame(Outgoing::CommandAck {
                command,
                result,
                to,
            }));
        }
        if self.heartbeat_at <= now {
            self.heartbeat_at = now + HEARTBEAT;
            return Some(self.frame(Outgoing::Heartbeat));
        }
        if self.state != State::Silent
            && let Some(kind) = self.vehicle.kind()
        {
            let counts = self.vehicle.battery.setup.is_some();
            if let Some((id, interval_us)) = self.streams.take(now, kind, counts) {
                return Some(self.frame(Outgoing::SetMessageInterval { id, interval_us }));
            }
            if let Some(asked) = self.vehicle.echo.take(now) {
                return Some(self.frame(Outgoing::TimeSync { asked }));
            }
        }
        if let Some(frame) = self.next_target(now) {
            return Some(frame);
        }
        if self.state == State::Silent {
            return None;
        }
        let boot_ms = self.boot_ms(now);
        let (from, to, sequence) = (self.own(), self.peer(), self.sequence);
        let frame = self
            .report
            .take(now, boot_ms, |message| message.encode(from, to, sequence))?;
        self.sequence = sequence.wrapping_add(1);
        Some(frame)
    }

    /// Returns the frame with the next target for the autopilot; `None` if no target must be sent now.
    fn next_target(&mut self, now: Instant) -> Option<FrameBytes> {
        let kind = self.vehicle.kind()?;
        let is_overdue = |target: Target| now.since(target.due) > OVERDUE;
        if kind == Kind::Px4 && self.target.is_some_and(is_overdue) {
            self.vehicle.unchoose();
            self.target = None;
            self.review(now);
            return None;
        }
        if self.state == State::Standby && kind == Kind::Px4 {
            // The drone's present position is sent as the target, so that the pilot can enter the mode.
            let due = self.target.map_or(now, |target| target.due);
            if due > now {
                return None;
            }
            let is_streamed = self.ready && self.vehicle.is_chosen();
            self.target = self.at_own_place(now).filter(|_| is_streamed);
            let target = self.target.as_mut()?;
            target.on_own_place_sent(now);
            let carrot = target.carrot;
            return self.target_frame(now, &carrot);
        }
        let mut target = self.target.filter(|target| target.due <= now)?;
        match (self.state, self.setpoint.or(self.stop)) {
            (State::Engaged, Some(setpoint)) => {
                let position = self.vehicle.position(now);
                let drone = position.map(|it| (it.place, now.since(it.at)));
                target.carrot.advance(now, setpoint, self.pace, drone);
            }
            (State::Engaged, None) | (State::Blind, _) => {
                target.carrot = Carrot::at(target.carrot.place, now);
            }
            _ => return None,
        }
        let is_sent = target.should_send(now, kind);
        self.target = Some(target);
        if !is_sent {
            return None;
        }
        self.target_frame(now, &target.carrot)
    }

    /// Returns the frame that sends the moving target `carrot` to the autopilot. `None` if this target is too far from
    /// the line Tx to Rx.
    fn target_frame(&mut self, now: Instant, carrot: &Carrot) -> Option<FrameBytes> {
        let at: Geodetic = self.axis.point(carrot.place)?;
        let x_m = carrot.place.x_m;
        let velocity_m_s =
            (!carrot.is_standing()).then(|| self.axis.to_ned(x_m, carrot.velocity_m_s));
        let yaw_rad = self
            .bearing
            .map(|look| self.axis.heading_rad(x_m, look.azimuth_rad));
        Some(self.frame(Outgoing::SetPosition {
            boot_ms: self.boot_ms(now),
            at,
            velocity_m_s,
            yaw_rad,
        }))
    }

    fn frame(&mut self, message: Outgoing<'_>) -> FrameBytes {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        message.encode(self.own(), self.peer(), sequence)
    }

    /// Returns the MAVLink address of this component. The system number is the autopilot's, because this component is a
    /// part of the vehicle.
    fn own(&self) -> Address {
        Address {
            component: COMPONENT,
            ..self.peer()
        }
    }

    fn peer(&self) -> Address {
        self.vehicle.address().unwrap_or(Address {
            system: SYSTEM,
            component: 1,
        })
    }

    const fn boot_ms(&self, now: Instant) -> u32 {
        millis(now.since(self.began).as_micros())
    }

    /// Returns the drone's newest measured position and its time, for `Relay::handle_position`. `None` if there is no
    /// new one since the last call.
    pub fn poll_position(&mut self) -> Option<Position> {
        let position = self.position.take()?;
        let at = self.clock.external(position.at);
        Some(Position { at, ..position })
    }

    /// Returns the position of a drone too far from the line Tx to Rx, and its distance from this line. Such a drone
    /// has no position in the mission's coordinates.
    ///
    /// `None` if the drone is near the line, or if its last position is older than 3 s. Constant work.
    pub fn off_line(&self, now: Instant) -> Option<OffLine> {
        let at = self.off_line_detector.newest(self.clock.internal(now))?;
        OffLine::new(at, &self.axis)
    }

    /// Returns the newest noise measured in the air by a SiK radio, and the drone's position at that time.
    ///
    /// The noise is from RADIO_STATUS. The caller passes both to `Relay::handle_sample`. `None` if there is no new
    /// measurement since the last call, or without the feature `sensing`.
    pub fn poll_sample(&mut self) -> Option<Sample> {
        self.noise.take()
    }

    /// Returns the side whose lost relays the operator has reported as landed. The caller passes the side to
    /// `Relay::clear_lost`. `None` if there is no new report since the last call.
    pub const fn poll_cleared(&mut self) -> Option<Side> {
        self.clearance.take_cleared()
    }

    /// Returns the next event of this link for the firmware; `None` if there is none.
    pub fn poll_event(&mut self) -> Option<AutopilotEvent> {
        let hears = self.streams.answers_requests();
        let mistrusted = || {
            let mistrust = self.trust.take_event(hears)?;
            Some(AutopilotEvent::Mistrusted(mistrust))
        };
        self.events.take().or_else(mistrusted)
    }

    /// Returns the time by which [`handle_timeout`](Self::handle_timeout) must be called.
    pub fn poll_timeout(&self, now: Instant) -> Instant {
        let now = self.clock.internal(now);
        let target = self.target.map(|target| target.due);
        let report = self
            .report
            .next_timeout(now)
            .filter(|_| self.state != State::Silent);
        let recovered = self.located_at.map(|at| at + self.recovery);
        let streams = self.streams.next_timeout(now);
        let due = [target, report, self.vehicle.next_timeout(now)]
            .into_iter()
            .chain([recovered, self.wait_report_due()])
            .chain([self.release.map(|(_, until)| until)])
            .flatten()
            .fold(self.heartbeat_at.min(streams), Instant::min);
        self.clock.external(due)
    }

    /// Returns the control state of the drone.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Returns true if the drone flies to the relay's setpoint.
    pub const fn is_flown(&self) -> bool {
        self.state.is_flown()
    }

    /// Returns true while the drone is disarmed, or has reported for 2 s that it is on the ground.
    pub fn is_landed(&self, now: Instant) -> bool {
        self.state == State::Grounded && self.vehicle.is_landed(self.clock.internal(now))
    }

    /// Returns the numbers of intact and corrupted messages from the autopilot.
    pub const fn counters(&self) -> Counters {
        self.parser.counters()
    }

    /// Signs all frames with the key of `signing`, and accepts only frames signed with this key. The only exception is
    /// the unsigned RADIO_STATUS of a radio, because a radio cannot sign. A ground station sets the autopilot's key
    /// (SETUP_SIGNING).
    #[cfg(feature = "mavlink-signing")]
    pub const fn sign(&mut self, signing: Signing) {
        self.trust.sign_with(signing);
    }

    /// Returns the number of intact frames that were rejected because of their signatures.
    pub const fn refused(&self) -> u32 {
        self.trust.refused()
    }
}

impl Autopilot {
    /// Exchanges data with the relay of the same drone in both directions, and handles the link's timeouts.
    ///
    /// In this documentation the *link* is this object, the link to the autopilot. A call takes five steps:
    ///
    /// | step | from | to | data | why at this point |
    /// | --- | --- | --- | --- | --- |
    /// | 1 | relay | link | line between the Tx and Rx positions of an adopted mission | positions and setpoint of later steps refer to it |
    /// | 2 | | link | timeouts that are due by `now` | an overdue link releases the drone |
    /// | 3 | link | relay | control state | an engaged relay starts from the first position that it receives afterwards |
    /// | 4 | link | relay | position, sample of the radio's noise, endurance, side whose lost relays have landed | the relay computes its setpoint from them |
    /// | 5 | relay | link | readiness, hold reasons, end of the endurance, setpoint, values for the operator | the link sends the newest ones |
    ///
    /// Call it in each turn of the main loop, after [`handle_bytes`](Self::handle_bytes) and before
    /// [`poll_transmit`](Self::poll_transmit). If the relay's ports are served after this call, the relay sends the new
    /// position in the same turn. A loop may call it a second time after that. The link then sends a new setpoint in
    /// the same turn. A call without new data has no effect.
    ///
    /// Returns a flag and a position. The flag is true if the relay received new data from the link. Then the relay's
    /// frames, its events and its next timeout may have changed. The position is the drone's position if the link
    /// passed a new one to the relay; otherwise `None`. A loop that serves the relay's ports after each call can ignore
    /// both results.
    ///
    /// The caller still passes events of the relay to [`handle_event`](Self::handle_event), because
    /// [`Relay::poll_event`] returns each event once. For an antenna that [`point_antenna`](Self::point_antenna) does
    /// not set, it passes the bearing to [`handle_bearing`](Self::handle_bearing). The line from Tx to Rx is at first
    /// the line given to [`new`](Self::new). An exchange replaces a line that [`fly_along`](Self::fly_along) has set.
    ///
    /// Constant work: one call of each input of the relay and of the link. When the positions of Tx and Rx have
    /// changed, also a new [`Axis`](crate::flight::axis::Axis).
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::flight::autopilot::carrot::Pace;
    /// use uav_relay::flight::autopilot::Autopilot;
    /// use uav_relay::flight::axis::Axis;
    /// use uav_relay::{Geodetic, Instant, Relay, Settings};
    ///
    /// /// Runs one turn of the main loop. Returns the time of the next turn.
    /// fn turn(
    ///     link: &mut Autopilot,
    ///     relay: &mut Relay,
    ///     now: Instant,
    ///     received: &[u8],
    ///     mut send: impl FnMut(&[u8]),
    /// ) -> Instant {
    ///     link.handle_bytes(now, received);
    ///     link.exchange(relay, now);
    ///     while let Some(frame) = link.poll_transmit(now) {
    ///         send(&frame);
    ///     }
    ///     link.poll_timeout(now)
    /// }
    ///
    /// let site = |lat, lon, amsl| Geodetic::from_degrees(lat, lon, amsl).expect("a place on earth");
    /// let axis = Axis::try_new(site(47.40, 8.54, 420.0), site(47.41, 8.55, 431.0))?;
    /// let (mut link, mut relay) = (Autopilot::new(axis, Pace::default(), Instant::ZERO), relay(Settings::default()));
    /// let mut frames = 0;
    /// let next = turn(&mut link, &mut relay, Instant::ZERO, &[], |_| frames += 1);
    /// assert_eq!(frames, 1, "a heartbeat");
    /// assert!(next > Instant::ZERO);
    /// # Ok::<(), uav_relay::flight::axis::AxisError>(())
    /// ```
    #[inline(never)] // called from two places of a firmware's loop; its stack frame is released
    pub fn exchange(&mut self, relay: &mut Relay, now: Instant) -> (bool, Option<Position>) {
        self.follow(relay, now);
        self.handle_timeout(now);
        let mut is_news = relay.control(now, self.is_flown());
        #[cfg(feature = "telemetry")]
        {
            let time = self.clock.advance(now);
            let refuses = self.target.is_some_and(|it| it.is_refused(time));
            relay.report_control(self.state(), refuses);
        }
        let position = self.poll_position();
        if let Some(Position { at, place, .. }) = position {
            relay.handle_position(now, place, at);
            is_news = true;
        }
        if let Some(sample) = self.poll_sample() {
            relay.handle_sample(now, sample);
            is_news = true;
        }
        if self.is_landed(now) {
            relay.reset_endurance();
        }
        let internal = self.clock.internal(now);
        if let Some([remaining_s, home_s]) = self.vehicle.take_endurance(internal, &self.axis) {
            relay.handle_endurance(now, remaining_s, home_s);
            is_news |= relay.endurance_limit_s().is_some();
        }
        if let Some(side) = self.poll_cleared() {
            relay.clear_lost(now, side);
            is_news = true;
        }
        let setpoint = relay.setpoint();
        self.handle_ready(now, relay.is_ready());
        let holds = [Side::Upstream, Side::Downstream].map(|side| relay.hold_reason(side));
        self.handle_hold(now, holds);
        if matches!(self.state, State::Engaged | State::Blind) && relay.must_leave() {
            let line = Line::leave(relay.leaves_by_endurance());
            self.report.queue_line(line);
        }
        self.handle_setpoint(now, setpoint);
        if let Some(side) = self.antenna {
            self.handle_bearing(relay.bearing(side));
        }
        let sir_db = relay.target().map(|target| 10.0 * libm::log10f(target));
        self.handle_values(now, sir_db, setpoint);
        (is_news, position)
    }

    /// Replaces this link's line from Tx to Rx by the line of the relay's mission, if the two differ.
    #[inline(never)] // its stack frame is released
    fn follow(&mut self, relay: &Relay, now: Instant) {
        let loaded = self.loaded.first().copied();
        // The relay has already checked that its Tx and Rx positions form a valid line.
        if let Some(sites) = relay.sites().or(loaded)
            && sites != self.axis.sites()
            && let Ok(axis) = Axis::between(sites)
        {
            self.fly_along(now, axis);
        }
    }
}
