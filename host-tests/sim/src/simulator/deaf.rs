//! A relay that does not hear another one, while that one may well hear it.

use uav_relay::Instant;

/// A time in which relay `by` does not hear relay `of`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Deaf {
    /// The relay that does not hear, from 1.
    pub by: u16,
    /// The relay that it does not hear, from 1.
    pub of: u16,
    /// When it begins.
    pub from: Instant,
    /// When it ends, if it does.
    pub until: Option<Instant>,
}

impl Deaf {
    /// Whether it is `by` that does not hear `of` at `now`.
    pub fn applies(&self, by: u16, of: u16, now: Instant) -> bool {
        (self.by, self.of) == (by, of)
            && now >= self.from
            && self.until.is_none_or(|until| now < until)
    }
}
