//! Setpoint on the way to the agreed position. Limited by the [guard](crate::guard), or without a guard the agreed position.

use super::context::{earliest, tenths};
use crate::features::{DEPARTURES, GUARD};
use crate::guard::config::Geofence;
use crate::guard::{Fence, Guard, HoldReason};
use crate::place::Placement;
use crate::settings::Settings;
use crate::side::Side;
use crate::time::{Duration, Instant};

/// Interval at which the relay repeats its fence messages to the neighbours. A message can be lost. A fence is the
/// plane across x that keeps two neighbours apart.
const REMINDER: Duration = Duration::from_millis(1_000);

/// Shortest interval of these repetitions while the relay waits for a neighbour's message.
const EARLY: Duration = Duration::from_millis(250);

/// Setpoint control of one relay: moves the setpoint to the agreed position, if the guard permits it.
#[derive(Clone, Debug)]
pub(crate) struct Steering {
    guard: Option<Guard>,
    remind_at: Option<Instant>,
    /// Setpoint last reported to the firmware. `None` before the first report, and if the last report was that there is
    /// no setpoint.
    reported_setpoint: Option<Placement>,
    /// Stepwise motion to a new agreed position; the array is empty without the feature `departures`.
    respacing: [Respacing; DEPARTURES as usize],
}

/// Base-2 logarithm of the number of steps in a motion to a new agreed position.
const STEPS: u32 = 5;

/// Motion to a new agreed position: start, duration, time of the next step, and completed fraction.
#[derive(Clone, Copy, Debug)]
struct Motion {
    since: Instant,
    span: Duration,
    at: Instant,
    done: f32,
    /// True until the common start time of all relays of the view is known.
    waits: bool,
}

/// Common start time of the relays' motions to newly agreed positions.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Begin {
    /// The start time.
    At(Instant),
    /// Latest start time: the motion begins at this time if the common start time remains unknown.
    By(Instant),
}

/// Stepwise motion of the setpoint to a new agreed position. It takes the same time at all relays of a chain, so that
/// they arrive together.
#[derive(Clone, Copy, Debug)]
struct Respacing {
    /// Agreed position at the last call of `advance`. The next field, `waypoint`, is the position to fly to now: it
    /// approaches the agreed position in steps.
    agreed: Option<Placement>,
    waypoint: Option<Placement>,
    /// Motion to the agreed position; `None` once the position to fly to has reached the agreed position.
    motion: Option<Motion>,
}

impl Respacing {
    const NONE: Self = Self {
        agreed: None,
        waypoint: None,
        motion: None,
    };

    /// Returns the position to fly to at `now`; `None` without an agreed position. If the agreed position `agreed` has
    /// changed, the position to fly to moves there in 32 steps within the time `span`.
    ///
    /// `begin` states the common start time of this motion at all relays of the view, or the latest start time while
    /// the common one is unknown.
    fn advance(
        &mut self,
        now: Instant,
        agreed: Option<Placement>,
        span: Duration,
        begin: Begin,
    ) -> Option<Placement> {
        if let (Some(motion), Begin::At(begin)) = (&mut self.motion, begin)
            && core::mem::take(&mut motion.waits)
            && now < motion.since
        {
            (motion.since, motion.at) = (begin, begin);
        }
        self.step(now);
        if agreed == self.agreed {
            return self.waypoint;
        }
        self.agreed = agreed;
        if span == Duration::from_micros(0) || agreed.is_none() || self.waypoint.is_none() {
            (self.motion, self.waypoint) = (None, agreed);
        } else if self.motion.is_none() {
            let (since, waits) = match begin {
                Begin::At(_) => (now, false),
                Begin::By(latest) => (latest, true),
            };
            self.motion = Some(Motion {
                since,
                span,
                at: since,
                done: 0.0,
                waits,
            });
        }
        // A motion that is changed on its way ends as planned, so that frequent agreements do not put off its end.
        self.step(now);
        self.waypoint
    }

    /// Moves the position to fly to. It makes all steps of the current motion that are due at `now`.
    fn step(&mut self, now: Instant) {
        let (Some(motion), Some(from), Some(to)) = (&mut self.motion, self.waypoint, self.agreed)
        else {
            return;
        };
        if now < motion.at {
            return;
        }
        let spent = u32::from(tenths(now.since(motion.since))) << STEPS;
        let steps = spent / u32::from(tenths(motion.span).max(1));
        let Some(steps) = u8::try_from(steps)
            .ok()
            .filter(|steps| *steps >> STEPS == 0)
        else {
            (self.motion, self.waypoint) = (None, Some(to));
            return;
        };
        let each = Duration::from_micros((motion.span.as_micros() >> STEPS).max(1));
        let next = motion.since + each.times(u32::from(steps) + 1);
        motion.at = if next > now { next } else { now + each };
        // Slow at both ends, where a relay that is late costs most.
        let part = f32::from(steps) / 32.0;
        let done = part * part * (3.0 - 2.0 * part);
        let part = (done - motion.done) / (1.0 - motion.done);
        motion.done = done;
        let between = |from: f32, to: f32| from + (to - from) * part;
        self.waypoint = Some(Placement {
            x_m: between(from.x_m, to.x_m),
            y_m: between(from.y_m, to.y_m),
            altitude_m: between(from.altitude_m, to.altitude_m),
        });
    }
}

/// Returns the interval of the fence messages of a waiting relay: eight hop times, 250 ms to 1 s.
fn early(hop_time: Duration) -> Duration {
    hop_time.times(8).max(EARLY).min(REMINDER)
}

impl Steering {
    /// State before the call of [`begin`](Self::begin): no guard (collision avoidance), and no setpoint.
    pub(crate) const NONE: Self = Self {
        guard: None,
        remind_at: None,
        reported_setpoint: None,
        respacing: [Respacing::NONE; DEPARTURES as usize],
    };

    /// Creates the guard (collision avoidance), if `settings` request a guard. `neighbours` are the node numbers of
    /// this relay's two neighbours in the chain; `None` at an end of the chain.
    #[inline(never)] // a guard is built on the stack
    pub(crate) fn begin(
        &mut self,
        settings: &Settings,
        neighbours: [Option<u16>; 2],
        seed: u32,
        now: Instant,
    ) {
        let config = settings.guard.filter(|_| GUARD);
        self.guard = config.map(|config| Guard::new(config, neighbours, seed, now));
    }

    /// Returns the guard (collision avoidance); `None` if this relay has no guard.
    pub(crate) fn known_guard(&self) -> Option<&Guard> {
        self.guard.as_ref().filter(|_| GUARD)
    }

    fn guard(&mut self) -> Option<&mut Guard> {
        self.guard.as_mut().filter(|_| GUARD)
    }

    /// Moves the setpoint toward the position `agreed` as far as the guard allows at `now`. Returns true if the
    /// setpoint has changed. If `agreed` is new, the motion to it begins at `begin`, and takes the time `span`.
    ///
    /// `hop_time` is the setting of this name.
    pub(crate) fn steer(
        &mut self,
        now: Instant,
        agreed: Option<Placement>,
        (span, hop_time): (Duration, Duration),
        begin: Begin,
    ) -> bool {
        let waypoint = match self.respacing.first_mut() {
            Some(respacing) => respacing.advance(now, agreed, span, begin),
            None => agreed,
        };
        if let Some(waypoint) = waypoint
            && let Some(guard) = self.guard()
        {
            let known = guard.is_for(waypoint);
            if !known {
                guard.set_goal(waypoint);
            }
            guard.steer(now);
            if !known {
                guard.end_second();
            }
            let soon = Some(now + early(hop_time)).filter(|_| guard.is_waiting());
            if !known {
                self.remind_at = Some(now + REMINDER);
            }
            if let Some(soon) = soon.filter(|soon| self.remind_at.is_none_or(|at| at > *soon)) {
                self.remind_at = Some(soon);
                if let Some(guard) = self.guard() {
                    guard.restart_second();
                }
            }
        }
        let setpoint = self.setpoint(waypoint);
        let changed = setpoint != self.reported_setpoint;
        self.reported_setpoint = setpoint;
        changed
    }

    /// Returns true while the setpoint moves to a new agreed position.
    pub(crate) fn is_moving(&self) -> bool {
        matches!(&self.respacing[..], [respacing] if respacing.motion.is_some())
    }

    /// Returns the point that the motion to the agreed position has reached, before the guard limits it. `None` until
    /// the chain has agreed on positions.
    pub(crate) fn waypoint(&self) -> Option<Placement> {
        self.respacing.first()?.waypoint
    }

    pub(crate) fn setpoint(&self, agreed: Option<Placement>) -> Option<Placement> {
        match &self.guard {
            Some(guard) if GUARD => guard.setpoint(),
            _ if self.is_moving() => self.waypoint(),
            _ => agreed,
        }
    }

    /// Sets the neighbour at `side`; `None` at the end of the chain.
    pub(crate) fn set_neighbour(&mut self, side: Side, neighbour: Option<u16>) {
        if let Some(guard) = self.guard() {
            guard.set_neighbour(side, neighbour);
        }
    }

    /// Records the relay that has the order to leave, 0 for none.
    pub(crate) fn set_leaver(&mut self, node: u16) {
        if let Some(guard) = self.guard().filter(|_| DEPARTURES) {
            guard.set_leaver(node);
        }
    }

    /// Handles a fence message of the neighbour `from` at `side`. A fence is the plane across x that keeps two
    /// neighbours apart.
    pub(crate) fn handle(&mut self, side: Side, from: u16, fence: &Fence) {
        if let Some(guard) = self.guard() {
            guard.handle_fence(side, from, fence);
        }
    }

    /// Schedules the fence messages to both neighbours again if their timer has expired.
    pub(crate) fn handle_timeout(&mut self, now: Instant, hop_time: Duration) {
        if self.remind_at.is_some_and(|at| at <= now) {
            self.remind_at = None;
            if let Some(guard) = self.guard() {
                let early = early(hop_time);
                // Rounded up, so that a second of the guard is not shorter than a second.
                let times = REMINDER.as_micros().div_ceil(early.as_micros());
                guard.remind_early(u8::try_from(times).unwrap_or(1));
                let wait = if guard.is_waiting() {
                    early
                } else {
                    guard.end_second();
                    REMINDER
                };
                self.remind_at = Some(now + wait);
            }
        }
    }

    /// Schedules the fence messages to both neighbours again.
    ///
    /// No effect if the neighbour toward Rx has answered the newest fence.
    pub(crate) fn repeat_fence(&mut self) {
        if let Some(waypoint) = self.waypoint()
            && let Some(guard) = self.guard().filter(|guard| !guard.is_answered())
        {
            guard.set_goal(waypoint);
        }
    }

    /// Records if the drone follows the setpoints (`flown` is true) or not (false) at the time `now`. Returns true if
    /// this changes the state of the guard.
    pub(crate) fn handle_control(&mut self, now: Instant, flown: bool) -> bool {
        let is_news = self.guard().is_some_and(|guard| guard.control(now, flown));
        if is_news {
            self.remind_at = Some(now + REMINDER);
        }
        is_news
    }

    /// Restarts the guard with another x axis, because the positions of Tx and Rx have changed. `now` is `None` after
    /// a start of the relay.
    pub(crate) fn switch_line(&mut self, now: Option<Instant>) {
        if let Some(guard) = self.guard() {
            guard.leave_line(now);
        }
    }

    pub(crate) fn set_geofence(&mut self, fence: Option<Geofence>) {
        if let Some(guard) = self.guard()
            && let Some(fence) = fence
        {
            guard.set_geofence(fence);
        }
    }

    pub(crate) fn handle_position(&mut self, measured_at: Instant, place: Placement) {
        if let Some(guard) = self.guard() {
            guard.position(measured_at, place);
        }
    }

    /// Removes the limits that keep the setpoint clear of lost relays at `side`. Called when these relays are no longer
    /// in the air. `others` is true if the view has relays at this side that are not lost. Until the guard has
    /// received a message of one of these remaining relays, it does not move the setpoint toward this side.
    pub(crate) fn clear_lost(&mut self, side: Side, others: bool) {
        if let Some(guard) = self.guard() {
            guard.forget(side, others);
        }
    }

    /// Returns true if some lost relay on the side `side` may still hover in the air.
    pub(crate) fn has_lost(&self, side: Side) -> bool {
        self.known_guard().is_some_and(|guard| guard.has_lost(side))
    }

    pub(crate) fn hold_reason(&self, side: Side) -> Option<HoldReason> {
        self.known_guard()?.hold_reason(side)
    }

    /// Returns the agreed position of the neighbour at `side`. `None` while it is unknown, and without a guard.
    pub(crate) fn neighbour_place(&self, side: Side) -> Option<Placement> {
        self.known_guard()?.neighbour_place(side)
    }

    /// Returns the next fence message, with its side and its destination node; `None` if none is pending.
    pub(crate) fn poll_transmit(&mut self) -> Option<(Side, u16, Fence)> {
        self.guard()?.poll()
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        match self.respacing.first() {
            Some(way) => earliest(self.remind_at, way.motion.map(|motion| motion.at)),
            None => self.remind_at,
        }
    }
}

#[cfg(all(test, feature = "departures"))]
mod tests {
    use super::{Begin, Steering};
    use crate::place::Placement;
    use crate::time::{Duration, Instant};

    const fn unknown(now_ms: u64) -> Begin {
        Begin::By(Instant::from_millis(now_ms + 15_000))
    }

    const HOP: Duration = Duration::from_millis(30);

    fn at_ms(ms: u64) -> Instant {
        Instant::ZERO + Duration::from_millis(ms)
    }

    /// Checks that relays that learn their positions at different times move together.
    #[test]
    fn relays_begin_at_the_same_time() {
        let span = Duration::from_millis(20_000);
        let place = |x_m: f32| Some(Placement::on_line(x_m, 100.0));
        let mut all = [Steering::NONE; 2].map(|mut steering| {
            steering.steer(at_ms(0), place(0.0), (span, HOP), unknown(0));
            steering
        });
        let [one, other] = &mut all;
        one.steer(at_ms(1_000), place(100.0), (span, HOP), unknown(1_000));
        other.steer(at_ms(2_300), place(100.0), (span, HOP), unknown(2_300));
        for ms in (2_500..30_000).step_by(500) {
            // The second one learns the beginning after it.
            let begin = |known_at: u64| {
                if ms >= known_at {
                    Begin::At(at_ms(3_000))
                } else {
                    unknown(ms)
                }
            };
            one.steer(at_ms(ms), place(100.0), (span, HOP), begin(2_500));
            other.steer(at_ms(ms), place(100.0), (span, HOP), begin(4_500));
            let [x_m, other_m] = [&one, &other].map(|it| it.setpoint(place(100.0)).unwrap().x_m);
            assert!(ms > 3_000 || x_m == 0.0, "{ms}: {x_m}");
            let apart_m = (x_m - other_m).abs();
            assert!(ms < 4_500 || apart_m < 0.1, "{ms}: {x_m} and {other_m}");
            assert_eq!(one.is_moving(), ms < 23_000, "{ms}: {x_m}");
        }
        // Without a beginning, after the longest wait.
        one.steer(at_ms(30_000), place(0.0), (span, HOP), unknown(30_000));
        one.steer(at_ms(44_900), place(0.0), (span, HOP), unknown(44_900));
        assert_eq!(one.setpoint(place(0.0)), place(100.0));
        one.steer(at_ms(55_000), place(0.0), (span, HOP), unknown(55_000));
        let half_m = one.setpoint(place(0.0)).unwrap().x_m;
        assert!((half_m - 50.0).abs() < 0.1, "{half_m}");
    }

    /// Checks that the motion ends in time even if new agreements arrive before its end.
    #[test]
    fn frequent_agreements_do_not_put_off_the_arrival() {
        let span = Duration::from_millis(20_000);
        let place = |x_m: f32| Some(Placement::on_line(x_m, 100.0));
        let mut steering = Steering::NONE;
        steering.steer(at_ms(0), place(0.0), (span, HOP), unknown(0));
        let mut reached_m = 0.0;
        let mut agreed = None;
        for step in 0..20 {
            // Every second another agreement, a little farther.
            agreed = place(100.0 + step as f32 / 10.0);
            steering.steer(
                at_ms(1_000 * step),
                agreed,
                (span, HOP),
                Begin::At(at_ms(0)),
            );
            let x_m = steering.setpoint(agreed).unwrap().x_m;
            assert!(
                x_m >= reached_m && x_m <= reached_m + 10.0,
                "{x_m} after {reached_m}"
            );
            reached_m = x_m;
        }
        steering.steer(at_ms(20_000), agreed, (span, HOP), Begin::At(at_ms(0)));
        assert!(!steering.is_moving() && steering.setpoint(agreed) == agreed);
    }
}
