//! Frame faults on any link: loss, corruption, duplication and reordering, with a counter for each.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Probability of each fault per frame, 0 to 0.9. Faults are independent: several may affect one frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Faults {
    /// The frame never arrives.
    pub loss: f64,
    /// Frame corruption: one to eight bytes change; the delimiter may be among them.
    pub corrupt: f64,
    /// The frame arrives twice.
    pub duplicate: f64,
    /// The frame arrives so late that later frames may overtake it.
    pub reorder: f64,
}

/// Counts of the injected faults.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Injected {
    /// Lost frames.
    pub lost: u64,
    /// Corrupted frames.
    pub corrupted: u64,
    /// Duplicated frames.
    pub duplicated: u64,
    /// Delayed frames.
    pub reordered: u64,
}

/// Arrival of a frame at a receiver.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Arrival {
    /// Received bytes.
    pub bytes: Vec<u8>,
    /// Extra delay in frame times.
    pub late: u64,
}

impl Faults {
    /// High rates of all four faults at once.
    pub const BAD_DAY: Self = Self {
        loss: 0.3,
        corrupt: 0.15,
        duplicate: 0.1,
        reorder: 0.1,
    };

    /// Returns true if all probabilities are 0.
    pub fn none(&self) -> bool {
        *self == Self::default()
    }

    /// Draws the faults of `frame`. Returns no, one or two arrivals.
    pub fn inject(
        &self,
        frame: &[u8],
        rng: &mut ChaCha8Rng,
        injected: &mut Injected,
    ) -> Vec<Arrival> {
        if self.none() {
            return vec![Arrival {
                bytes: frame.to_vec(),
                late: 0,
            }];
        }
        if rng.random_bool(self.loss) {
            injected.lost += 1;
            return Vec::new();
        }
        let copies = if rng.random_bool(self.duplicate) {
            injected.duplicated += 1;
            2
        } else {
            1
        };
        (0..copies)
            .map(|_| {
                let mut bytes = frame.to_vec();
                if rng.random_bool(self.corrupt) {
                    injected.corrupted += 1;
                    for _ in 0..rng.random_range(1..=8) {
                        let at = rng.random_range(0..bytes.len());
                        if let Some(byte) = bytes.get_mut(at) {
                            *byte ^= rng.random_range(1..=u8::MAX);
                        }
                    }
                }
                let late = if rng.random_bool(self.reorder) {
                    injected.reordered += 1;
                    rng.random_range(1..=12)
                } else {
                    0
                };
                Arrival { bytes, late }
            })
            .collect()
    }
}
