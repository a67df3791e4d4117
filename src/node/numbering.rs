//! Counter of late messages in a row, which detects a restarted leader.

/// Late messages in a row after which they count as messages of a restarted leader.
pub(crate) const SUSPICIOUS: u8 = 4;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Stragglers(u8);

impl Stragglers {
    pub(crate) const NONE: Self = Self(0);

    /// Counts a late message; returns true if there are too many, and starts again from zero.
    pub(crate) const fn one_more(&mut self) -> bool {
        self.0 = self.0.saturating_add(1);
        let suspicious = self.0 >= SUSPICIOUS;
        if suspicious {
            self.0 = 0;
        }
        suspicious
    }
}
