//! Endurance of the drone, and the departure that it causes.
//!
//! | state | event | action |
//! | --- | --- | --- |
//! | known | invalid value, or none for [`STALE`] | raise `EnduranceUnknown`; the last value counts on |
//! | any | time left before the way home and the reserve at most that of a replacement, for [`HOLD`] | leave the chain |
//! | departure requested by this | time left more than [`HYSTERESIS`] longer, and known, for [`HOLD`], still in the chain | stay |

use super::Relay;
use crate::event::Event;
use crate::node::departure::Leaving;
use crate::stats::bump;
use crate::time::{Duration, Instant};

/// Age at which the last value is too old.
const STALE: Duration = Duration::from_millis(10_000);
/// Time for which the limit must be crossed before the relay requests to leave, or cancels that.
const HOLD: Duration = Duration::from_millis(5_000);
/// Distance from the limit at which the relay cancels its request to leave.
const HYSTERESIS: Duration = Duration::from_millis(60_000);
/// Maximum time of a replacement, in units of `dead_after`.
///
/// It is 8 until the order, and 4 until the view without the relay is in place.
const REPLACEMENT: u32 = 12;

#[derive(Clone, Copy, Debug)]
pub(super) struct Endurance {
    /// Latest known end of the flight, less its error, and time of the way home; `None` at first.
    end: Option<(Instant, Duration)>,
    /// Time of the last value; `None` if it was invalid or is too old, and before any.
    known_at: Option<Instant>,
    /// True if the last value was invalid or is too old.
    is_lost: bool,
    /// True from the departure that this state has requested until its end.
    leaves: bool,
    /// True from the firmware's own request to leave until `Relay::stay`.
    is_manual: bool,
    /// Time since which `leaves` should have the other value.
    differs_since: Option<Instant>,
}

impl Endurance {
    pub(super) const UNKNOWN: Self = Self {
        end: None,
        known_at: None,
        is_lost: false,
        leaves: false,
        is_manual: false,
        differs_since: None,
    };

    /// Returns the endurance less its error; `None` before a valid value.
    fn remaining(&self, now: Instant) -> Option<Duration> {
        self.end.map(|(end, _)| end.since(now))
    }
}

/// Returns `seconds` as a duration within 0 to a day.
fn duration(seconds: f32) -> Duration {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "0 to 8.64e7"
    )]
    let millis = (seconds.clamp(0.0, 86_400.0) * 1e3) as u64;
    Duration::from_millis(millis)
}

/// Returns a duration of at most a few days in whole seconds, at most 65 534.
fn seconds(span: Duration) -> u16 {
    u16::try_from(span.as_micros() / 1_000_000).map_or(u16::MAX - 1, |s| s.min(u16::MAX - 1))
}

impl Relay {
    /// Records the drone's remaining endurance; requests to leave the chain when it is short.
    ///
    /// Needs the feature `departures`.
    ///
    /// `remaining_s` is the time of flight left, s, with an error of up to `error_s`; `home_s` is the time of the way home, s. Each
    /// is finite and not negative; any other value, such as NaN for an unknown one, makes the endurance unknown
    /// ([`Event::EnduranceUnknown`](crate::Event::EnduranceUnknown)). So does a pause of 10 s. An unknown endurance is never a full battery: the
    /// last valid one counts on, less the time since.
    ///
    /// The relay calls [`leave`](Self::leave) by itself once the endurance less the error has been at most
    /// [`endurance_limit_s`](Self::endurance_limit_s) for 5 s, and [`stay`](Self::stay) if it is a minute above that for 5 s
    /// before the relay is outside of the chain. Takes constant time.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::{Instant, Settings};
    ///
    /// let mut relay = relay(Settings::default());
    /// relay.handle_endurance(Instant::from_millis(1_000), 900.0, 45.0, 60.0);
    /// # #[cfg(feature = "departures")]
    /// assert_eq!(relay.endurance_s(Instant::from_millis(6_000)), Some(850));
    /// // The way home, 3 min of reserve, and 3 min for the replacement.
    /// # #[cfg(feature = "departures")]
    /// assert_eq!(relay.endurance_limit_s(), Some(420));
    /// ```
    pub fn handle_endurance(&mut self, now: Instant, remaining_s: f32, error_s: f32, home_s: f32) {
        let now = self.clock.advance(now);
        let Some(endurance) = self.endurance.first_mut() else {
            return;
        };
        let values = [remaining_s, error_s, home_s];
        if values
            .into_iter()
            .all(|value| value.is_finite() && value >= 0.0)
        {
            endurance.end = Some((now + duration(remaining_s - error_s), duration(home_s)));
            endurance.known_at = Some(now);
            endurance.is_lost = false;
        } else {
            self.lose_endurance();
        }
        self.review_endurance(now);
        if self.endurance.first().is_some_and(|it| it.leaves) {
            self.leave_by_endurance(now);
        }
    }

    /// Returns the remaining endurance less its error, s; `None` while it is unknown. Takes constant time.
    pub fn endurance_s(&self, now: Instant) -> Option<u16> {
        let endurance = self.endurance.first()?;
        endurance.known_at?;
        endurance.remaining(self.clock.internal(now)).map(seconds)
    }

    /// Returns the endurance at which the relay requests to leave, s; `None` before a valid value. Takes constant time.
    ///
    /// It is the time of the way home, the reserve ([`Settings::reserve`](crate::Settings::reserve)), and that of a
    /// replacement: twelve times `dead_after`, and `respacing`.
    pub fn endurance_limit_s(&self) -> Option<u16> {
        let (_, home) = self.endurance.first()?.end?;
        Some(seconds(self.endurance_limit(home)))
    }

    fn endurance_limit(&self, home: Duration) -> Duration {
        let settings = &self.node.member().settings;
        let replacement = settings.dead_after.times(REPLACEMENT);
        let sum = Instant::ZERO + home + settings.reserve + replacement;
        (sum + Leaving::respacing(settings)).since(Instant::ZERO)
    }

    /// Records if the firmware itself has requested to leave.
    pub(super) fn set_manual(&mut self, is_manual: bool) {
        if let Some(endurance) = self.endurance.first_mut() {
            endurance.is_manual = is_manual;
        }
    }

    fn lose_endurance(&mut self) {
        if let Some(endurance) = self.endurance.first_mut() {
            endurance.known_at = None;
            if !core::mem::replace(&mut endurance.is_lost, true) {
                bump(&mut self.node.stats_mut().endurance_unknown);
                self.node.raise(Event::EnduranceUnknown);
            }
        }
    }

    /// Requests to leave. The endurance for the leader ends when the drone must be on its way home with its reserve.
    fn leave_by_endurance(&mut self, now: Instant) {
        let reserve = self.node.member().settings.reserve;
        if let Some((end, home)) = self.endurance.first().and_then(|it| it.end) {
            let left = end.since(now + home + reserve);
            self.node.leave(now, Some(seconds(left)));
        }
    }

    /// Compares the endurance with the limit; requests to leave, or cancels that.
    pub(super) fn review_endurance(&mut self, now: Instant) {
        let Some(Endurance { end, known_at, .. }) = self.endurance.first().copied() else {
            return;
        };
        if known_at.is_some_and(|at| now.since(at) >= STALE) {
            self.lose_endurance();
        }
        let limit = end.map(|(_, home)| self.endurance_limit(home));
        let is_outside = self.node.is_outside();
        let Some((endurance, limit)) = self.endurance.first_mut().zip(limit) else {
            return;
        };
        let left = endurance.remaining(now).unwrap_or_default();
        let wants = if endurance.leaves {
            let is_fixed = is_outside || endurance.is_manual || endurance.known_at.is_none();
            is_fixed || Instant::ZERO + left <= Instant::ZERO + limit + HYSTERESIS
        } else {
            left <= limit
        };
        if wants == endurance.leaves {
            endurance.differs_since = None;
        } else if now.since(*endurance.differs_since.get_or_insert(now)) >= HOLD {
            endurance.leaves = wants;
            endurance.differs_since = None;
            if wants {
                self.leave_by_endurance(now);
            } else {
                self.node.stay(now);
            }
        }
    }

    /// Returns the time of the next call of [`review_endurance`](Self::review_endurance).
    pub(super) fn endurance_timeout(&self) -> Option<Instant> {
        let endurance = self.endurance.first()?;
        let (end, home) = endurance.end?;
        let limit = self.endurance_limit(home);
        let low_at = Instant::from_micros(end.as_micros().saturating_sub(limit.as_micros()));
        let is_high = !endurance.leaves && endurance.differs_since.is_none();
        let low_at = Some(low_at).filter(|_| is_high);
        let stale_at = endurance.known_at.map(|at| at + STALE);
        let switch_at = endurance.differs_since.map(|at| at + HOLD);
        [low_at, stale_at, switch_at].into_iter().flatten().min()
    }
}
