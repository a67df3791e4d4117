//! Bursts of frame losses: Gilbert-Elliott model with a good and a bad state per link. Every frame is lost in the bad state.

use std::collections::HashMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Burst state of all links; each direction of a link is independent.
#[derive(Debug)]
pub struct Bursts {
    /// Mean share of lost frames, equal to the share of time in the bad state.
    share: f64,
    /// Probability per frame of the transition from good to bad.
    worsens: f64,
    /// Probability per frame of the transition from bad to good: the inverse of the mean burst length.
    heals: f64,
    /// True for a bad link, by sender and receiver.
    bad: HashMap<(usize, usize), bool>,
}

impl Bursts {
    /// Creates the model: a `share` of lost frames, 0 to 0.9, and a mean burst `length`. The length is at least
    /// [`Bursts::shortest`].
    pub fn new(share: f64, length: f64) -> Self {
        let heals = 1.0 / length.max(1.0);
        Self {
            share,
            worsens: (share * heals / (1.0 - share)).min(1.0),
            heals,
            bad: HashMap::new(),
        }
    }

    /// Returns the mean burst length of independent losses with probability `share`. The model's lower limit.
    pub fn shortest(share: f64) -> f64 {
        1.0 / (1.0 - share)
    }

    /// Returns true if the link's next frame is lost.
    pub fn loses(&mut self, from: usize, to: usize, rng: &mut ChaCha8Rng) -> bool {
        let share = self.share;
        let Some(bad) = self.bad.get_mut(&(from, to)) else {
            let bad = rng.random_bool(share);
            self.bad.insert((from, to), bad);
            return bad;
        };
        let turns = if *bad { self.heals } else { self.worsens };
        *bad ^= rng.random_bool(turns);
        *bad
    }
}
