//! What a number that is not the expected one means.

/// So many stragglers in a row are none: frames come late twice, a leader that was rebooted insists.
pub(crate) const SUSPICIOUS: u8 = 4;

/// Messages in a row of something that should be over.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stragglers(u8);

impl Stragglers {
    pub(crate) const NONE: Self = Self(0);

    /// One more; whether they are too many to be late ones.
    pub(crate) const fn one_more(&mut self) -> bool {
        self.0 = self.0.saturating_add(1);
        let suspicious = self.0 >= SUSPICIOUS;
        if suspicious {
            self.0 = 0;
        }
        suspicious
    }
}
