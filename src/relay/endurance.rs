//! Endurance of the drone, and the departure that it causes.
//!
//! The margin is the remaining time of flight less the time of the way home.
//!
//! | event | action |
//! | --- | --- |
//! | invalid value; no valid one for [`STALE`]; setpoint control without any | raise `EnduranceUnknown` once; the last valid one counts down |
//! | margin below the limit: for [`HOLD`], or at once before the relay has taken part in anything | request to leave |
//! | `Relay::stay` | lower the limit to half of the present margin |
//! | `Relay::leave` | restore the limit |
//! | drone on the ground | forget the endurance and the lower limit |

use super::Relay;
use crate::event::Event;
use crate::node::departure::Leaving;
use crate::stats::bump;
use crate::time::{Duration, Instant};

/// Age at which the last value is too old.
const STALE: Duration = Duration::from_millis(10_000);
/// Maximum time between two comparisons of the margin with the limit.
const REVIEW: Duration = Duration::from_millis(1_000);
/// Time for which the margin must be below the limit before a member requests to leave.
const HOLD: Duration = Duration::from_millis(5_000);
/// Reserve until `Relay::set_reserve`.
const RESERVE: Duration = Duration::from_millis(180_000);
/// Time after the margin has reached the reserve at which the pilot is told to leave in any case.
const LAST: Duration = Duration::from_millis(10_000);
/// Maximum time of a replacement, in units of `dead_after`.
///
/// It is 8 until the order, and 4 until the view without the relay is in place.
const REPLACEMENT: u32 = 12;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Endurance {
    /// Last known end of the flight, and the time of the way home; `None` before a valid value.
    end: Option<(Instant, Duration)>,
    /// Time of the last value; `None` if it was invalid or is too old, and before any.
    known_at: Option<Instant>,
    /// True from `EnduranceUnknown` to the next valid value.
    is_lost: bool,
    losses: u32,
    /// Reserve beyond the way home and the time of a replacement; `None` for [`RESERVE`].
    reserve: Option<Duration>,
    /// Limit of the margin since `Relay::stay`; `None` for the usual one.
    limit: Option<Duration>,
    /// Time since which the margin is below the limit.
    low_since: Option<Instant>,
    reviewed_at: Instant,
}

/// Returns `seconds` as a duration of at most a day; `None` if it is negative or not finite.
fn duration(seconds: f32) -> Option<Duration> {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked below"
    )]
    let millis = (seconds.min(86_400.0) * 1e3) as u64;
    (seconds.is_finite() && seconds >= 0.0).then_some(Duration::from_millis(millis))
}

/// Returns a duration in whole seconds, at most 65 534: the maximum is the mark of an unknown one.
fn seconds(span: Duration) -> u16 {
    u16::try_from(span.as_micros() / 1_000_000).map_or(u16::MAX - 1, |s| s.min(u16::MAX - 1))
}

impl Relay {
    /// Records the drone's remaining time of flight and the time of its way home, s.
    ///
    /// Needs the feature `departures`. The time of flight is the least likely one. Any value that is not finite or is negative, such as NaN for an unknown one, and a
    /// pause of 10 s make the endurance unknown ([`Event::EnduranceUnknown`](crate::Event::EnduranceUnknown)): the last valid one counts down.
    ///
    /// The relay calls [`leave`](Self::leave) by itself once the endurance has been below [`endurance_limit_s`](Self::endurance_limit_s) for
    /// 5 s; as a spare, or before it has taken part in anything, at once. It never cancels that. Takes constant time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// relay.handle_endurance(Instant::from_millis(1_000), 900.0, 60.0);
    /// # #[cfg(feature = "departures")]
    /// assert_eq!(relay.endurance_s(Instant::from_millis(6_000)), Some(895));
    /// // The way home, 3 min of reserve, and 3 min for the replacement.
    /// # #[cfg(feature = "departures")]
    /// assert_eq!(relay.endurance_limit_s(), Some(420));
    /// ```
    pub fn handle_endurance(&mut self, now: Instant, remaining_s: f32, home_s: f32) {
        let now = self.clock.advance(now);
        let times = duration(remaining_s).zip(duration(home_s));
        if let (Some((left, home)), Some(endurance)) = (times, self.endurance.first_mut()) {
            endurance.end = Some((now + left, home));
            endurance.known_at = Some(now);
            endurance.is_lost = false;
        } else {
            self.lose_endurance();
        }
        self.review_endurance(now);
    }

    /// Sets the reserve of the endurance beyond the way home and the time of a replacement; at first 3 min.
    pub fn set_reserve(&mut self, reserve: Duration) {
        if let Some(endurance) = self.endurance.first_mut() {
            endurance.reserve = Some(reserve);
        }
    }

    fn reserve(&self) -> Duration {
        let reserve = self.endurance.first().and_then(|it| it.reserve);
        reserve.unwrap_or(RESERVE)
    }

    /// Returns the remaining time of flight, s; `None` while it is unknown. Takes constant time.
    pub fn endurance_s(&self, now: Instant) -> Option<u16> {
        let Endurance { end, known_at, .. } = self.endurance.first()?;
        let now = self.clock.internal(now);
        known_at.filter(|at| now.since(*at) < STALE)?;
        end.map(|(end, _)| seconds(end.since(now)))
    }

    /// Returns the endurance below which the relay requests to leave, s; `None` before a valid value.
    ///
    /// It is the time of the way home, the reserve ([`set_reserve`](Self::set_reserve)), twelve times `dead_after` for the replacement, and
    /// `respacing`; after [`stay`](Self::stay) at most the way home and half of what was left beyond it. Takes constant time.
    pub fn endurance_limit_s(&self) -> Option<u16> {
        let (_, home) = self.endurance.first()?.end?;
        let limit = Instant::ZERO + home + self.margin_limit();
        Some(seconds(limit.since(Instant::ZERO)))
    }

    /// Returns the number of times that the endurance became unknown.
    pub fn endurance_losses(&self) -> u32 {
        self.endurance.first().map_or(0, |it| it.losses)
    }

    fn margin(&self, now: Instant) -> Option<Duration> {
        let (end, home) = self.endurance.first()?.end?;
        Some(end.since(now + home))
    }

    fn margin_limit(&self) -> Duration {
        let settings = &self.node.member().settings;
        let replacement = settings.dead_after.times(REPLACEMENT);
        let usual = Instant::ZERO + self.reserve() + replacement + Leaving::respacing(settings);
        let usual = usual.since(Instant::ZERO);
        let lower = self.endurance.first().and_then(|it| it.limit);
        lower.map_or(usual, |lower| lower.min(usual))
    }

    /// Returns true if the pilot has to fly home.
    ///
    /// The drone may leave, or it has requested that and its margin reached the reserve [`LAST`] ago.
    pub(crate) fn must_leave(&self, now: Instant) -> bool {
        let last = (Instant::ZERO + self.reserve()).since(Instant::ZERO + LAST);
        let margin = self.margin(self.clock.internal(now));
        let is_last = margin.is_some_and(|margin| margin <= last);
        self.node.leaves().is_some_and(|is_free| is_free || is_last)
    }

    /// Forgets the endurance of a drone on the ground. A departure goes on.
    pub(crate) fn reset_endurance(&mut self) {
        self.endurance = self.endurance.map(|it| Endurance {
            losses: it.losses,
            reserve: it.reserve,
            ..Endurance::default()
        });
    }

    /// Records an order of the firmware. After `stay` the limit is at most half of the present margin.
    pub(super) fn override_endurance(&mut self, now: Instant, stays: bool) {
        let margin = self.margin(now).unwrap_or_else(|| self.margin_limit());
        if let Some(endurance) = self.endurance.first_mut() {
            endurance.limit = stays.then_some(Duration::from_micros(margin.as_micros() / 2));
            endurance.low_since = None;
        }
    }

    /// Reports an endurance that is unknown, once until the next valid value.
    pub(super) fn lose_endurance(&mut self) {
        if let Some(endurance) = self.endurance.first_mut() {
            endurance.known_at = None;
            if !core::mem::replace(&mut endurance.is_lost, true) {
                bump(&mut endurance.losses);
                self.node.raise(Event::EnduranceUnknown);
            }
        }
    }

    /// Compares the margin with the limit; requests to leave, or renews the request's endurance.
    pub(super) fn review_endurance(&mut self, now: Instant) {
        let known_at = self.endurance.first().and_then(|it| it.known_at);
        if known_at.is_some_and(|at| now.since(at) >= STALE) {
            self.lose_endurance();
        }
        let (limit, reserve) = (self.margin_limit(), self.reserve());
        let (Some(margin), Some(endurance)) = (self.margin(now), self.endurance.first_mut()) else {
            return;
        };
        endurance.reviewed_at = now;
        let low_since = endurance.low_since.unwrap_or(now);
        endurance.low_since = (margin < limit).then_some(low_since);
        let is_due = !self.node.has_joined() || now.since(low_since) >= HOLD;
        if self.node.leaves().is_some() || margin < limit && is_due {
            // The leader's order is due before the reserve is used.
            let left = (Instant::ZERO + margin).since(Instant::ZERO + reserve);
            self.node.leave(now, Some(seconds(left)));
        }
    }

    /// Returns the time of the next comparison of margin and limit; `None` before a valid value.
    pub(super) fn endurance_timeout(&self) -> Option<Instant> {
        let endurance = self.endurance.first().filter(|it| it.end.is_some())?;
        Some(endurance.reviewed_at + REVIEW)
    }
}
