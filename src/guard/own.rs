//! State of the relay itself: agreed position, setpoint and reachable positions.
//!
//! The reachable interval is the x at which the relay may be between its last report and its setpoints. After its
//! setpoint turns back, a relay first flies on, but never beyond its earlier setpoints, where it could have stopped. So
//! it may be anywhere between its reported x and all setpoints within the [`lag`](GuardConfig::lag) before that report.

use super::config::GuardConfig;
use crate::place::{CrossSection, Placement};
use crate::side::Side;
use crate::time::{Duration, Instant};

#[derive(Clone, Copy, PartialEq, Debug)]
struct Span {
    low_m: f32,
    high_m: f32,
}

impl Span {
    const fn at(x_m: f32) -> Self {
        Self {
            low_m: x_m,
            high_m: x_m,
        }
    }

    fn union(self, other: Self) -> Self {
        Self {
            low_m: self.low_m.min(other.low_m),
            high_m: self.high_m.max(other.high_m),
        }
    }
}

/// Interval of x in which this relay can be, m. It contains the last reported x, and all setpoints that the drone may
/// still be flying to.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ReachableInterval {
    pub(super) setpoint_m: f32,
    pub(super) low_m: f32,
    pub(super) high_m: f32,
    /// Time of the last change of the setpoint's x.
    changed_at: Instant,
    /// Interval of the x of all setpoints since `recent_since`, m.
    recent_span: Span,
    recent_since: Instant,
    /// Interval of the x of older setpoints, m. The relay was possibly still flying to one of them at the last position
    /// report.
    earlier_span: Span,
    reported_at: Instant,
    /// True once a position report is recent enough to show that the drone follows its first setpoint. Also true if the
    /// drone hovered before the first setpoint.
    pub(super) known: bool,
}

impl ReachableInterval {
    /// Returns the state before the first setpoint, with an unknown x.
    pub(super) const fn unknown(now: Instant) -> Self {
        Self::at(0.0, now)
    }

    /// Returns the interval after the first setpoint, at `x_m`. The interval counts as unknown until a position report
    /// shows the effect of this setpoint, because the drone possibly still flies somewhere else.
    pub(super) const fn at(x_m: f32, now: Instant) -> Self {
        Self {
            setpoint_m: x_m,
            low_m: x_m,
            high_m: x_m,
            changed_at: now,
            recent_span: Span::at(x_m),
            recent_since: now,
            earlier_span: Span::at(x_m),
            reported_at: now,
            known: false,
        }
    }

    fn set_span(&mut self, span: Span) {
        (self.low_m, self.high_m) = (span.low_m, span.high_m);
    }

    const fn span(&self) -> Span {
        Span {
            low_m: self.low_m,
            high_m: self.high_m,
        }
    }

    /// Extends the interval by the new setpoint `x_m`. The drone possibly flies on toward the previous setpoint before
    /// it turns to the new one.
    pub(super) fn extend_to(&mut self, x_m: f32, now: Instant) {
        if (x_m - self.setpoint_m).abs() > 0.0 {
            self.setpoint_m = x_m;
            self.changed_at = now;
            self.recent_span = self.recent_span.union(Span::at(x_m));
            self.set_span(self.span().union(Span::at(x_m)));
        }
    }

    /// Updates the interval by a position report measured at time `at`. Afterwards it contains the reported x, and the
    /// x of all setpoints that the drone may still be flying to.
    pub(super) fn report(&mut self, at: Instant, x_m: f32, config: &GuardConfig) {
        let hovers = (x_m - self.setpoint_m).abs() <= config.hover_m + config.rounding();
        let here = Span::at(if hovers { self.setpoint_m } else { x_m });
        if at >= self.recent_since + config.lag {
            self.known = true;
            self.earlier_span = self.recent_span;
            self.recent_span = Span::at(self.setpoint_m);
            self.recent_since = self.changed_at;
        }
        if at >= self.changed_at + config.lag {
            self.earlier_span = self.recent_span;
        }
        if self.known && at >= self.reported_at {
            self.reported_at = at;
            self.set_span(self.earlier_span.union(self.recent_span).union(here));
        } else {
            self.set_span(self.span().union(here));
        }
    }

    pub(super) const fn is_known(&self) -> bool {
        self.known
    }

    /// Returns true if the relay has arrived at the x of its setpoint.
    pub(super) fn has_arrived(&self) -> bool {
        self.known && self.high_m <= self.low_m
    }
}

/// Maximum time between two position reports of a drone that counts as hovering.
const HOVER_REPORTS: Duration = Duration::from_millis(2_500);

/// Number of seconds without a change of the setpoint after which a neighbour counts as the obstacle.
const MAX_REMINDERS_STILL: u8 = 5;

#[derive(Clone, Copy, Debug)]
pub(super) struct Own {
    pub(super) config: GuardConfig,
    pub(super) node: u16,
    /// Number of the relay with the order to leave the chain, 0 for none. That relay holds its position.
    pub(super) leaver: u16,
    /// Position to fly to now, inside the geofence: the agreed position, or a point on the way there. `None` before the
    /// first agreement.
    pub(super) goal: Option<Placement>,
    pub(super) setpoint: Option<Placement>,
    pub(super) reachable: ReachableInterval,
    /// Time of the last change of the setpoint's lateral offset or altitude.
    cross_section_changed_at: Instant,
    /// True once the relay has arrived at the setpoint's lateral offset and altitude.
    pub(super) arrived: bool,
    /// True while this relay or a neighbour requests an open chain. In an open chain all relays are at least the
    /// minimum separation apart along x.
    pub(super) open: bool,
    /// True while this relay holds its position because the order along x is wrong or unknown.
    pub(super) halted: bool,
    pub(super) reported: Option<Placement>,
    /// Position in the last message sent while the drone did not fly to setpoints.
    pub(super) sent_place: Placement,
    /// Number of reminders (seconds) since the last change of the setpoint.
    reminders: u8,
    /// Last setpoint at which this relay has arrived, or its first setpoint. Before the first setpoint it is the
    /// position at which the drone hovers. A relay that halts outside of the geofence stops where it is, but at most as
    /// far outside as this position.
    last_arrival: Placement,
}

impl Own {
    pub(super) const fn new(config: GuardConfig, node: u16, now: Instant) -> Self {
        Self {
            config,
            node,
            leaver: 0,
            goal: None,
            setpoint: None,
            reachable: ReachableInterval::unknown(now),
            cross_section_changed_at: now,
            arrived: false,
            open: false,
            halted: true,
            reported: None,
            sent_place: Placement::on_line(0.0, 0.0),
            reminders: 0,
            last_arrival: Placement::on_line(0.0, 0.0),
        }
    }

    pub(super) fn set_setpoint(&mut self, setpoint: Placement, now: Instant) {
        if self.cross_section() != setpoint.cross_section() {
            self.cross_section_changed_at = now;
            self.arrived = false;
        }
        if self.setpoint != Some(setpoint) {
            self.reminders = 0;
        }
        self.setpoint = Some(setpoint);
    }

    /// Returns the position from which the relay's next path starts: `setpoint` once it has arrived there.
    ///
    /// Before that, lateral offset and altitude are those of `setpoint`. The x is the last reported x, moved toward the
    /// setpoint's x by at most the error of a position report.
    pub(super) fn path_start(&self, setpoint: Placement) -> Placement {
        let ReachableInterval { low_m, high_m, .. } = self.reachable;
        let (at_m, off_m) = match self.reported {
            Some(place) if !self.reachable.has_arrived() => (place.x_m, self.config.hover_m),
            _ => return setpoint,
        };
        let least_m = (at_m - off_m).max(low_m);
        let most_m = (at_m + off_m).min(high_m);
        let x_m = setpoint.x_m.max(least_m).min(most_m);
        setpoint.cross_section().at(x_m)
    }

    pub(super) const fn count_reminder(&mut self) {
        self.reminders = self.reminders.saturating_add(1);
    }

    /// Returns true if the setpoint has not moved for five seconds, possibly because of one neighbour.
    ///
    /// The neighbour at `side` can be the cause if the agreed position is farther toward `side`. It also can be the
    /// cause if its side forbids a needed change of lateral offset or altitude (`may_cross` is false).
    pub(super) fn is_held_up(&self, side: Side, may_cross: bool) -> bool {
        let Some((setpoint, target)) = self.setpoint.zip(self.goal) else {
            return false;
        };
        let ahead_m = match side {
            Side::Upstream => setpoint.x_m - target.x_m,
            Side::Downstream => target.x_m - setpoint.x_m,
        };
        let moves =
            ahead_m > self.config.rounding() || !may_cross && !self.has_agreed_cross_section();
        self.reminders >= MAX_REMINDERS_STILL && moves
    }

    /// Returns true if the relay has moved away from `sent_place`, the position in its last message.
    pub(super) fn has_moved(&self) -> bool {
        self.reported
            .is_some_and(|place| !self.is_at(place, self.sent_place))
    }

    /// Clears the setpoint and the known x. Called when the drone no longer flies to setpoints, or the line from Tx to
    /// Rx changes.
    pub(super) const fn release(&mut self, now: Instant) {
        self.setpoint = None;
        self.reachable = ReachableInterval::unknown(now);
        (self.cross_section_changed_at, self.arrived) = (now, false);
        (self.open, self.halted) = (false, true);
    }

    /// Starts (`halted` is true) or ends a halt of this relay. If the relay halts on its way, it stops at its last
    /// reported position.
    pub(super) fn halt(&mut self, halted: bool, now: Instant) {
        let begins = halted && !self.halted;
        self.halted = halted;
        if let Some(mut stop) = self.setpoint.filter(|_| begins)
            && let Some(reported) = self.reported
        {
            let ReachableInterval { low_m, high_m, .. } = self.reachable;
            let reported = self.config.clamp_toward(reported, self.last_arrival);
            if !self.reachable.has_arrived() {
                stop.x_m = reported.x_m.max(low_m).min(high_m);
            }
            if !self.arrived {
                stop = reported.cross_section().at(stop.x_m);
            }
            self.reachable.extend_to(stop.x_m, now);
            self.set_setpoint(stop, now);
        }
    }

    pub(super) fn begin(&mut self, place: Placement, now: Instant) {
        self.last_arrival = place;
        self.set_setpoint(place, now);
    }

    /// Handles a position report of time `at` before the first setpoint. A drone that reports equal positions hovers.
    pub(super) fn report_hover(&mut self, at: Instant, place: Placement) {
        let stays = self.is_at(place, self.last_arrival);
        if !(stays && at < self.reachable.reported_at + HOVER_REPORTS) {
            self.last_arrival = place;
            self.reachable.changed_at = at;
        }
        self.reachable.reported_at = at;
    }

    /// Returns true if the drone has hovered at least for the time [`lag`](GuardConfig::lag). Used before the first
    /// setpoint.
    pub(super) fn hovers(&self, now: Instant) -> bool {
        let ReachableInterval {
            reported_at,
            changed_at,
            ..
        } = self.reachable;
        reported_at >= changed_at + self.config.lag && now < reported_at + HOVER_REPORTS
    }

    /// Handles a position report, measured at time `at`. The report can show that the relay has arrived at the lateral
    /// offset and altitude of its setpoint. It counts for this only if `at` is at least the lag after the last change
    /// of either.
    pub(super) fn report(&mut self, at: Instant, place: Placement) {
        self.arrived |= at >= self.cross_section_changed_at + self.config.lag
            && self.is_near(place.cross_section(), self.cross_section());
        if let Some(setpoint) = self.setpoint.filter(|_| self.arrived) {
            self.last_arrival = setpoint;
        }
    }

    /// Returns true if two positions agree, within a hovering relay's position error.
    fn is_at(&self, is: Placement, to_be: Placement) -> bool {
        let most = self.config.hover_m + self.config.rounding();
        self.is_near(is.cross_section(), to_be.cross_section())
            && (is.x_m - to_be.x_m).abs() <= most
    }

    /// Returns true if two pairs of lateral offset and altitude agree. They agree if they differ by at most a hovering
    /// relay's position error.
    fn is_near(&self, is: CrossSection, to_be: CrossSection) -> bool {
        let most = self.config.hover_m + self.config.rounding();
        (is.y_m - to_be.y_m).abs() <= most && (is.altitude_m - to_be.altitude_m).abs() <= most
    }

    pub(super) fn cross_section(&self) -> CrossSection {
        self.setpoint.unwrap_or_default().cross_section()
    }

    /// Returns true if the setpoint has the agreed lateral offset and altitude.
    #[inline(never)] // called from several places
    pub(super) fn has_agreed_cross_section(&self) -> bool {
        self.goal
            .is_none_or(|target| target.cross_section() == self.cross_section())
    }

    pub(super) fn target_m(&self) -> f32 {
        self.goal.unwrap_or_default().x_m
    }

    pub(super) fn goal_m(&self) -> f32 {
        self.goal_of(self.node, self.target_m())
    }

    /// Returns the x to which relay `node` should fly now, m: `target_m`, or its x in an open chain. In an open chain
    /// all relays are at least the minimum separation apart along x.
    pub(super) fn goal_of(&self, node: u16, target_m: f32) -> f32 {
        if self.open {
            self.config.open_chain_x(node, target_m)
        } else {
            target_m
        }
    }

    /// Returns true if two relays `step_m` apart along x are closer than the minimum separation.
    pub(super) fn is_close(&self, step_m: f32) -> bool {
        step_m < self.config.separation_m - self.config.rounding()
    }
}
