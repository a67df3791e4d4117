//! Random numbers for timing and session numbers only; positions never depend on them.

use crate::time::Duration;

/// A xorshift generator (Marsaglia 2003, 13-17-5).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Jitter(u32);

impl Jitter {
    pub(crate) const NONE: Self = Self(0);

    /// Creates a generator; distinct seeds give distinct numbers.
    pub(crate) const fn new(seed: u32) -> Self {
        // Any odd multiplier keeps distinct seeds distinct; the generator must not start at zero.
        match seed.wrapping_mul(0x9E37_79B1) {
            0 => Self(1),
            state => Self(state),
        }
    }

    /// Returns the next number, never 0.
    pub(crate) const fn draw(&mut self) -> u32 {
        let mut state = self.0;
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        self.0 = state;
        state
    }

    /// Returns `span` and a random eighth of it at most, so that relays on a shared channel do not stay in step.
    #[inline(never)] // called from many places
    pub(crate) fn spread(&mut self, span: Duration) -> Duration {
        // Multiplication scales the random part, since a Cortex-M has no division of this width.
        let eighth = (span.as_micros() / 8 + 1).min(u64::from(u32::MAX));
        let random = (u64::from(self.draw()) * eighth) >> 32;
        Duration::from_micros(span.as_micros().saturating_add(random))
    }

    /// Returns the next number, 1 to 65535.
    pub(crate) const fn number(&mut self) -> u16 {
        let [_, a, b, _] = self.draw().to_le_bytes();
        match u16::from_le_bytes([a, b]) {
            0 => 1,
            number => number,
        }
    }
}
