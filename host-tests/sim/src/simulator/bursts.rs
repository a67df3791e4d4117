//! Losses in runs: the model of Gilbert and Elliott, in which a link is good or bad and loses every frame while it is bad.

use std::collections::HashMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The links that lose frames in runs, each by itself and either direction by itself.
#[derive(Debug)]
pub struct Bursts {
    /// The mean share of lost frames, and so that of bad links.
    share: f64,
    /// From a good link to a bad one, per frame.
    worsens: f64,
    /// From a bad one to a good one: one over the mean length of a run.
    heals: f64,
    /// Whether a link is bad, by sender and receiver.
    bad: HashMap<(usize, usize), bool>,
}

impl Bursts {
    /// Links that lose `share` of the frames, 0 to 0.9, in runs of `length` frames on average, at least [`Bursts::shortest`].
    pub fn new(share: f64, length: f64) -> Self {
        let heals = 1.0 / length.max(1.0);
        Self {
            share,
            worsens: (share * heals / (1.0 - share)).min(1.0),
            heals,
            bad: HashMap::new(),
        }
    }

    /// The mean length of a run of losses where frames are lost independently: with `share` lost, no model makes sense below it.
    pub fn shortest(share: f64) -> f64 {
        1.0 / (1.0 - share)
    }

    /// Whether the next frame on a link is lost.
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
