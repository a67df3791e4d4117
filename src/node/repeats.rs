//! How long what comes back of a pass is awaited before the pass is sent again.

use crate::time::Duration;

/// How many times longer than a sweep a pass may take on which relays compute: its frames are more than twice as long, and
/// a relay's share of it takes up to thirty portions.
const SLOW: u32 = 4;

/// What is known of the current pass's getting through, and where the random part of a wait comes from.
#[derive(Clone, Debug)]
pub(crate) struct Repeats {
    /// How often the pass has been sent again since anything was heard of it.
    unheard: u8,
    random: u32,
}

impl Repeats {
    /// `random` must not be 0.
    pub(crate) const fn new(random: u32) -> Self {
        Self { unheard: 0, random }
    }

    /// A neighbour has said that the pass has arrived, or there is a new one.
    pub(crate) const fn heard(&mut self) {
        self.unheard = 0;
    }

    /// The pass is sent again.
    pub(crate) const fn unheard(&mut self) {
        self.unheard = self.unheard.saturating_add(1);
    }

    /// How long what comes back of a pass sent now may take: there and back over the `hops` that are left, and two to spare,
    /// each `hop_time`; [`SLOW`] times as long where relays compute on the way.
    ///
    /// The relay next to a lost frame runs out of patience first, so one loss costs one repetition. From then on it is
    /// known that frames get lost here, and the pass is repeated sooner, first after four hops' time and then after twice
    /// as long each, until a neighbour says that it has arrived. A random eighth keeps relays on a shared channel from
    /// repeating in step.
    pub(crate) fn patience(&mut self, hop_time: Duration, hops: u32, slow: bool) -> Duration {
        let answer = (2 * hops + 2) * if slow { SLOW } else { 1 };
        let hops = match self.unheard {
            0 => answer,
            again => answer.min(2 << u32::from(again).min(16)),
        };
        let patience = hop_time.times(hops).as_micros();
        // A part of the eighth by multiplication: there is no division of this width on a Cortex-M.
        let eighth = (patience / 8 + 1).min(u64::from(u32::MAX));
        let random = (u64::from(self.draw()) * eighth) >> 32;
        Duration::from_micros(patience.saturating_add(random))
    }

    /// A xorshift generator (Marsaglia 2003, 13-17-5): only timing depends on it, never a placement.
    fn draw(&mut self) -> u32 {
        let mut x = self.random;
        x ^= x << 13;
        x ^= x >> 17;
        x ^= x << 5;
        self.random = x;
        x
    }
}
