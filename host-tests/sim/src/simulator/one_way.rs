//! One-way link failure: a relay does not receive another one, which may still receive it.

use uav_relay::Instant;

/// Period in which relay `by` does not receive relay `of`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OneWayFailure {
    /// The relay that does not receive, from 1.
    pub by: u16,
    /// The relay that is not received, from 1.
    pub of: u16,
    /// Start time.
    pub from: Instant,
    /// End time; `None` if the failure is permanent.
    pub until: Option<Instant>,
}

impl OneWayFailure {
    /// Returns true if this failure keeps `by` from receiving `of` at `now`.
    pub fn applies(&self, by: u16, of: u16, now: Instant) -> bool {
        (self.by, self.of) == (by, of)
            && now >= self.from
            && self.until.is_none_or(|until| now < until)
    }
}
