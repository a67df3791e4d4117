//! Endurance of the drone, and the departure that it causes.
//!
//! The margin is the remaining time of flight less the time of the way home. The rules are in [`docs::batteries`](crate::docs::batteries),
//! section "Endurance". The floor is the reserve, and a part of the time of a replacement by the relay's number.

use super::Relay;
use crate::event::Event;
use crate::node::Node;
use crate::node::context::respacing;
use crate::settings::Settings;
use crate::stats::bump;
use crate::time::{Duration, Instant};

/// Age from which the last endurance value counts as too old.
const STALE: Duration = Duration::from_millis(10_000);
/// Maximum time between two comparisons of the margin with its limit. The margin is the drone's remaining flight time
/// minus the time of the way home.
const REVIEW: Duration = Duration::from_millis(1_000);
/// Time for which a condition of the endurance must hold before the relay acts on it.
const HOLD: Duration = Duration::from_millis(15_000);
/// Hysteresis in the comparison of the margin (remaining flight time minus way home) with its limits. Two successive
/// endurance values that differ by less confirm each other. A relay that requests to leave repeats the request to the
/// leader if the end of the flight has moved by at least this time.
const STEP: Duration = Duration::from_millis(30_000);
/// Minimum time between two events `EnduranceUnknown`, and between two events `AtReserve`.
const AGAIN: Duration = Duration::from_millis(60_000);
/// Usual duration of the replacement of a drone, in units of the setting `dead_after`.
///
/// The leader orders the relay to leave after 8 units. After 4 more units, the remaining relays have agreed on a view
/// (list of members) without this relay, and have reached their new positions.
const REPLACEMENT: u32 = 12;
/// Maximum time that the relay allows for a drone's replacement. The relay requests to leave once the remaining flight
/// time is below the sum of the way home, the reserve and the time for the replacement.
const LONGEST: Duration = Duration::from_millis(240_000);
/// Maximum time between `AtReserve` at one relay and at the next, for drones of equal endurance. It applies unless a
/// departure is impossible by the settings.
const APART: Duration = Duration::from_millis(10_000);
/// Maximum valid flight time and way home, s. A larger value counts as unknown, because no multicopter flies longer.
const MAX_S: f32 = 21_600.0;

/// Condition: a request to leave has to be made or withdrawn. The conditions are indices of [`Endurance::since`].
const CHANGE: usize = 0;
/// Condition: the margin is at or below the floor, where `AtReserve` is raised.
const AT_FLOOR: usize = 1;
/// Condition: the leader has to receive a changed request.
const MOVED: usize = 2;
/// Condition: the margin is at least [`STEP`] above the floor.
const RESTORED: usize = 3;

/// Event `EnduranceUnknown`, as an index of [`Endurance::raised_at`].
const UNKNOWN: usize = 0;
/// Event `AtReserve`, as an index of [`Endurance::raised_at`].
const RESERVE: usize = 1;

#[expect(clippy::struct_excessive_bools, reason = "independent of each other")]
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Endurance {
    /// Flight time to keep in addition to the way home; `None` if only the firmware requests to leave.
    reserve: Option<Duration>,
    /// Time at which the drone's flight time ends, and duration of the way home, from the last valid value. `None`
    /// before a valid value.
    end: Option<(Instant, Duration)>,
    /// Time at which the relay received the last valid value.
    sampled_at: Instant,
    /// Last computed end of the flight that two successive endurance values have confirmed. The two values differed by
    /// less than [`STEP`]. 0 if no value was confirmed since the last 10 s without a value.
    confirmed: Instant,
    /// True from the time at which the endurance becomes unknown to the next valid value.
    is_lost: bool,
    losses: u32,
    /// Times of the last events `EnduranceUnknown` and `AtReserve`; 0 before the first event.
    raised_at: [Instant; 2],
    /// Margin below which the relay requests to leave, as `Relay::stay` has set it. `None` for the usual limit. The
    /// margin is the remaining flight time minus the time of the way home.
    limit: Option<Instant>,
    /// Start times of the four conditions [`CHANGE`] to [`RESTORED`]; 0 for a condition that does not hold.
    since: [Instant; 4],
    /// True if the relay itself has requested to leave, because of its endurance. False if the firmware has made the
    /// request.
    is_own: bool,
    /// True from a margin at or below the floor until the margin is [`STEP`] above the floor. The margin is the
    /// remaining flight time minus the way home, the floor the margin at which `AtReserve` is raised.
    is_spent: bool,
    /// True if the drone landed at its reserve, or while this module had requested to leave. It becomes false once the
    /// relay no longer requests to leave, or the margin (flight time minus way home) is [`STEP`] above the floor.
    keeps_out: bool,
    /// Time at which the remaining flight time will be only the way home and the reserve. The value is the one last
    /// sent to the leader.
    floor_at: Instant,
    reviewed_at: Instant,
}

impl Endurance {
    fn replacement(settings: &Settings) -> Duration {
        let usual = settings.dead_after.times(REPLACEMENT);
        let usual = Instant::ZERO + usual + respacing(settings);
        usual.since(Instant::ZERO).min(LONGEST)
    }

    /// Returns the margin below which the relay requests to leave; `None` without a reserve. The margin is the
    /// remaining flight time minus the time of the way home. The result stands for a duration, counted from time 0.
    fn limit(&self, settings: &Settings) -> Option<Instant> {
        let usual = Instant::ZERO + self.reserve? + Self::replacement(settings);
        Some(self.limit.map_or(usual, |lower| lower.min(usual)))
    }

    /// Returns the remaining time of flight, s; `None` while it is unknown.
    fn known(&self, now: Instant) -> Option<u16> {
        let (end, _) = self.end?;
        (!self.is_lost && !self.is_old(now)).then(|| seconds(end.since(now)))
    }

    fn is_old(&self, now: Instant) -> bool {
        now.since(self.sampled_at) >= STALE
    }

    /// Returns the margin, the remaining flight time minus the time of the way home, counted from time 0. It is an
    /// `Instant`, so that durations can be added. `None` before a valid value.
    fn margin(&self, now: Instant) -> Option<Instant> {
        let (end, home) = self.end?;
        let is_confirmed = self.is_old(now) && self.confirmed > Instant::ZERO;
        let end = if is_confirmed { self.confirmed } else { end };
        Some(Instant::ZERO + end.since(now + home))
    }

    /// Records that the endurance is unknown, and counts this loss of the endurance value. With a reserve it also
    /// raises the event `EnduranceUnknown`.
    fn lose(&mut self, now: Instant, node: &mut Node) {
        if !core::mem::replace(&mut self.is_lost, true) {
            bump(&mut self.losses);
        }
        if self.reserve.is_some() {
            self.raise(now, node, UNKNOWN, Event::EnduranceUnknown);
        }
    }

    /// Raises `event`, at most once per minute ([`AGAIN`]). `which` is the index in `raised_at` of the time at which
    /// this event was last raised.
    fn raise(&mut self, now: Instant, node: &mut Node, which: usize, event: Event) {
        if let Some(last) = self.raised_at.get_mut(which)
            && (*last == Instant::ZERO || now.since(*last) >= AGAIN)
        {
            *last = now;
            node.raise(event);
        }
    }

    /// Records if the condition with the index `which` holds now (`is_true`) and has held for long enough. Returns true
    /// after it has held for 15 s without a break, so that the relay can act on it.
    ///
    /// A single endurance value is not enough: another value must agree with it, or a value must be received after the
    /// condition began. Exception: if `is_low` is true, a single value is enough once it is [`STALE`].
    fn holds(&mut self, now: Instant, which: usize, is_true: bool, is_low: bool) -> bool {
        let is_sure =
            self.end.is_some_and(|(end, _)| end == self.confirmed) || is_low && self.is_old(now);
        let Some(since) = self.since.get_mut(which) else {
            return false;
        };
        let at = Some(*since).filter(|at| *at > Instant::ZERO).unwrap_or(now);
        *since = if is_true { at } else { Instant::ZERO };
        is_true && now.since(at) >= HOLD && (is_sure || at < self.sampled_at)
    }

    /// Makes or withdraws the request to leave, and raises `AtReserve`, according to the margin. The margin is the
    /// remaining flight time minus the way home. The request is made below the limit of the margin; the event is raised
    /// at a lower margin, the floor.
    fn review(&mut self, now: Instant, node: &mut Node) {
        if self.end.is_some() && self.is_old(now) {
            self.lose(now, node);
        }
        let settings = node.member().settings;
        let all = (self.reserve, self.limit(&settings), self.margin(now));
        let (Some(reserve), Some(limit), Some(margin)) = all else {
            return;
        };
        self.reviewed_at = now;
        let leaves = node.departure_granted().is_some();
        let changes = if leaves {
            self.is_own && margin >= limit + STEP
        } else {
            margin < limit
        };
        // Pilots of a fleet of equal endurance are told one by one, in the leader's order, also if it is slow or refuses all.
        let (number, all) = (node.member().node, node.member().all);
        let each = Self::replacement(&settings).as_micros() / u64::from(all.max(1));
        let each = if node.can_never_leave(now) {
            Duration::from_micros(each)
        } else {
            Duration::from_micros(each / 2).min(APART)
        };
        let floor = Instant::ZERO + reserve + each.times(all.saturating_sub(number).into());
        let is_restored = self.holds(now, RESTORED, margin >= floor + STEP, false);
        self.is_spent =
            self.holds(now, AT_FLOOR, margin <= floor, true) || self.is_spent && !is_restored;
        self.keeps_out &= leaves && !is_restored;
        node.set_too_low(self.is_spent || self.keeps_out);
        if self.is_spent {
            self.raise(now, node, RESERVE, Event::AtReserve);
        }
        // The leader's order is due before the reserve is used.
        let left = margin.since(Instant::ZERO + reserve);
        let floor_at = now + left;
        let moved = apart(floor_at, self.floor_at);
        let is_due = self.holds(now, CHANGE, changes, !leaves);
        let is_moved = self.holds(now, MOVED, leaves && self.is_own && moved >= STEP, true);
        if is_due {
            self.holds(now, CHANGE, false, true);
        }
        if is_due && leaves {
            self.is_own = !node.withdraw(now);
        } else if is_due || is_moved {
            self.is_own |= !leaves;
            self.floor_at = floor_at;
            node.leave(now, Some(seconds(left)));
        }
    }
}

fn apart(one: Instant, other: Instant) -> Duration {
    one.since(other).max(other.since(one))
}

/// Returns `seconds` as a duration; `None` if it is negative, not finite, or more than [`MAX_S`].
fn duration(seconds: f32) -> Option<Duration> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked"
    )]
    (0.0..=MAX_S)
        .contains(&seconds)
        .then(|| Duration::from_millis((seconds * 1e3) as u64))
}

/// Returns a duration in whole seconds, at most 65 534, because 65 535 stands for an unknown duration.
fn seconds(span: Duration) -> u16 {
    u16::try_from(span.as_micros() / 1_000_000).map_or(u16::MAX - 1, |s| s.min(u16::MAX - 1))
}

impl Relay {
    /// Records the drone's remaining time of flight and the time of its way home, s, 0 to 21 600.
    ///
    /// Needs the feature `departures`. A value out of this range, such as NaN, makes the endurance unknown, and so does
    /// a pause of 10 s without a call.
    ///
    /// With a reserve ([`set_reserve`](Self::set_reserve)) the relay requests to leave by itself below
    /// [`endurance_limit_s`](Self::endurance_limit_s), as with [`leave`](Self::leave). The rules are in
    /// [`docs::batteries`](crate::docs::batteries). Takes constant time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Duration, Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// relay.set_reserve(Some(Duration::from_millis(180_000)));
    /// relay.handle_endurance(Instant::from_millis(1_000), 900.0, 60.0);
    /// // The way home, 3 min of reserve, and 3 min for the replacement.
    /// # #[cfg(feature = "departures")]
    /// assert_eq!(relay.endurance_limit_s(), Some(420));
    /// ```
    pub fn handle_endurance(&mut self, now: Instant, remaining_s: f32, home_s: f32) {
        let now = self.clock.advance(now);
        let Some(endurance) = self.endurance.first_mut() else {
            return;
        };
        if let Some((left, home)) = duration(remaining_s).zip(duration(home_s)) {
            let end = now + left;
            let last = endurance.end.replace((end, home));
            if last.is_some_and(|(last, _)| apart(last, end) < STEP) {
                endurance.confirmed = end;
            } else if endurance.is_old(now) {
                endurance.confirmed = Instant::ZERO;
            }
            endurance.sampled_at = now;
            endurance.is_lost = false;
        } else {
            endurance.lose(now, &mut self.node);
        }
        endurance.review(now, &mut self.node);
    }

    /// Sets the reserve: flight time to keep in addition to the way home and the time of a replacement. With `None`,
    /// the initial value, the relay does not request to leave by itself.
    pub fn set_reserve(&mut self, reserve: Option<Duration>) {
        if let Some(endurance) = self.endurance.first_mut() {
            endurance.reserve = reserve;
        }
    }

    /// Returns the remaining time of flight, s; `None` while it is unknown. Takes constant time.
    pub fn endurance_s(&self, now: Instant) -> Option<u16> {
        self.endurance.first()?.known(self.clock.internal(now))
    }

    /// Returns the remaining flight time below which the relay requests to leave, s.
    ///
    /// It is the time of the way home plus the limit in [`docs::batteries`](crate::docs::batteries). `None` without a reserve, and before a
    /// valid value.
    pub fn endurance_limit_s(&self) -> Option<u16> {
        let endurance = self.endurance.first()?;
        let limit = endurance.limit(&self.node.member().settings)?;
        let (_, home) = endurance.end?;
        Some(seconds((limit + home).since(Instant::ZERO)))
    }

    /// Returns the number of times that the endurance became unknown.
    pub fn endurance_losses(&self) -> u32 {
        self.endurance.first().map_or(0, |it| it.losses)
    }

    /// Returns true while the relay requests to leave because of its endurance.
    pub fn leaves_by_endurance(&self) -> bool {
        let is_own = self.endurance.first().is_some_and(|it| it.is_own);
        is_own && self.node.departure_granted().is_some()
    }

    /// Returns true if the pilot has to fly the drone home now.
    ///
    /// This is so if the relay has requested to leave, and either the chain allows the drone to leave ([`Event::MayLeave`]), or only the
    /// way home and the reserve are left. Takes constant time.
    pub fn must_leave(&self) -> bool {
        let leaves = self.node.departure_granted();
        leaves.is_some_and(|is_free| is_free || self.is_at_reserve())
    }

    /// Returns true while the endurance is no more than the way home and the reserve. See [`Event::AtReserve`].
    pub fn is_at_reserve(&self) -> bool {
        self.endurance.first().is_some_and(|it| it.is_spent)
    }

    /// Forgets the endurance of a drone that is on the ground. A departure in progress continues.
    pub(crate) fn reset_endurance(&mut self) {
        let keeps_out = self.leaves_by_endurance() || self.is_at_reserve();
        self.endurance = self.endurance.map(|it| Endurance {
            reserve: it.reserve,
            losses: it.losses,
            raised_at: it.raised_at,
            is_own: it.is_own,
            keeps_out: it.keeps_out || keeps_out,
            ..Endurance::default()
        });
        if keeps_out {
            self.node.set_too_low(true);
        }
    }

    /// Records that the firmware has called `stay` (`stays` is true) or `leave`. After `stay`, the relay requests to
    /// leave only once the margin is below half of its present value. The margin is the remaining flight time minus the
    /// way home.
    pub(super) fn override_endurance(&mut self, now: Instant, stays: bool) {
        if let Some(endurance) = self.endurance.first_mut() {
            let limit = endurance.limit(&self.node.member().settings);
            let margin = endurance.margin(now).or(limit).filter(|_| stays);
            endurance.limit = margin.map(|margin| Instant::from_micros(margin.as_micros() / 2));
            let [_, floor, _, restored] = endurance.since;
            endurance.since = [Instant::ZERO, floor, Instant::ZERO, restored];
            endurance.is_own = false;
        }
    }

    /// Compares the remaining flight time with the time at which the relay has to request to leave. While the drone
    /// follows the setpoints (`flown`), it also reports an unknown endurance.
    pub(super) fn review_endurance(&mut self, now: Instant, flown: bool) {
        if let Some(endurance) = self.endurance.first_mut() {
            if flown && endurance.known(now).is_none() {
                endurance.lose(now, &mut self.node);
            }
            endurance.review(now, &mut self.node);
        }
    }

    /// Returns the time at which the remaining flight time must be compared with its limit again. `None` without a
    /// reserve, and before a valid value.
    pub(super) fn endurance_timeout(&self) -> Option<Instant> {
        let endurance = self.endurance.first()?;
        let is_compared = endurance.reserve.is_some() && endurance.end.is_some();
        is_compared.then_some(endurance.reviewed_at + REVIEW)
    }
}
