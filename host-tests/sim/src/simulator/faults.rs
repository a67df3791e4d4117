//! What may happen to a frame on its way: a layer of its own, on top of any link, that counts everything it does.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Probability of each fault, per frame, 0 to 0.9. They are drawn independently, so several may hit one frame.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Faults {
    /// The frame never arrives.
    pub loss: f64,
    /// One to eight of its bytes arrive changed, the delimiter among them perhaps.
    pub corrupt: f64,
    /// It arrives twice.
    pub duplicate: f64,
    /// It arrives late enough for others to overtake it.
    pub reorder: f64,
}

/// How often each fault was injected.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Injected {
    /// Frames that never arrived.
    pub lost: u64,
    /// Frames that arrived changed.
    pub corrupted: u64,
    /// Frames that arrived twice.
    pub duplicated: u64,
    /// Frames that were held back.
    pub reordered: u64,
}

/// One arrival of a frame.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Arrival {
    /// The bytes, as they arrive.
    pub bytes: Vec<u8>,
    /// How many frame times later than usual.
    pub late: u64,
}

impl Faults {
    /// Everything at once, as a bad day has it.
    pub const BAD_DAY: Self = Self {
        loss: 0.3,
        corrupt: 0.15,
        duplicate: 0.1,
        reorder: 0.1,
    };

    /// Whether nothing can happen.
    pub fn none(&self) -> bool {
        *self == Self::default()
    }

    /// What becomes of `frame`: none, one or two arrivals.
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
