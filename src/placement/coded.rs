//! Places in three bytes each: what a relay reaches for every pair of a target and an altitude level.
//!
//! A place is a whole number of steps of D / 16 777 214, rounded toward Tx: at most 6e-8 D, which is what an f32 near D has.
//! In this form a pass of 64 places fits a frame that COBS stuffs with one byte, and the bytes that are kept are the bytes
//! that are sent.

/// The most places of one pass; none where the crate is built without its feature `altitude`.
pub const PLACES: usize = if cfg!(feature = "altitude") { 64 } else { 0 };

/// Bytes of a place.
pub const WIDTH: usize = 3;

/// Steps from Tx to Rx.
const STEPS: f32 = 16_777_214.0;

/// Stands for a pair whose target cannot be met at that level.
const NONE: u32 = 0x00FF_FFFF;

/// Up to [`PLACES`] places between Tx and Rx.
#[derive(Clone, Debug)]
pub struct Coded {
    bytes: [u8; WIDTH * PLACES],
}

impl Coded {
    /// No place at all.
    pub const fn new() -> Self {
        Self {
            bytes: [0xFF; WIDTH * PLACES],
        }
    }

    /// Takes over `bytes`, as they came from a neighbour; what is missing is no place.
    pub fn fill(&mut self, bytes: &[u8]) {
        self.bytes = [0xFF; WIDTH * PLACES];
        for (own, other) in self.bytes.iter_mut().zip(bytes) {
            *own = *other;
        }
    }

    /// The bytes of the first `places`.
    pub fn bytes(&self, places: usize) -> &[u8] {
        self.bytes.get(..WIDTH * places).unwrap_or(&self.bytes)
    }

    /// Place `at` on a link of `distance_m`, m; `None` where there is none.
    pub fn get(&self, at: usize, distance_m: f32) -> Option<f32> {
        let (places, _) = self.bytes.as_chunks::<WIDTH>();
        let [a, b, c] = *places.get(at)?;
        let code = u32::from_le_bytes([a, b, c, 0]);
        (code != NONE).then(|| decode(code, distance_m))
    }

    /// Keeps `x_m`, in [0, `distance_m`], as place `at`.
    pub fn set(&mut self, at: usize, x_m: Option<f32>, distance_m: f32) {
        let code = x_m.map_or(NONE, |x_m| encode(x_m, distance_m));
        let [a, b, c, _] = code.to_le_bytes();
        let (places, _) = self.bytes.as_chunks_mut::<WIDTH>();
        if let Some(place) = places.get_mut(at) {
            *place = [a, b, c];
        }
    }
}

impl Default for Coded {
    fn default() -> Self {
        Self::new()
    }
}

#[expect(clippy::cast_precision_loss, reason = "24 bits fit an f32")]
fn decode(code: u32, distance_m: f32) -> f32 {
    (code as f32 * (distance_m / STEPS)).min(distance_m)
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and STEPS; the cast saturates"
)]
fn encode(x_m: f32, distance_m: f32) -> u32 {
    let code = ((x_m / (distance_m / STEPS)).min(STEPS)) as u32;
    // The two divisions may have rounded up across a step.
    if decode(code, distance_m) > x_m {
        code.saturating_sub(1)
    } else {
        code
    }
}

#[cfg(all(test, feature = "altitude"))]
mod tests {
    use super::{Coded, PLACES};

    #[test]
    fn a_place_is_kept_to_a_step_and_never_moved_toward_rx() {
        let mut coded = Coded::new();
        for distance_m in [1.0_f32, 35.7, 1000.0, 99_999.0, 1e6] {
            let mut x_m = 0.0;
            while x_m <= distance_m {
                coded.set(3, Some(x_m), distance_m);
                let kept = coded.get(3, distance_m).unwrap();
                assert!(
                    kept <= x_m && x_m - kept <= distance_m * 1.3e-7,
                    "{x_m} became {kept}"
                );
                // What has been kept once is kept as it is.
                coded.set(4, Some(kept), distance_m);
                assert!(kept - coded.get(4, distance_m).unwrap() <= distance_m * 6.1e-8);
                x_m += distance_m / 9_973.0;
            }
            coded.set(PLACES - 1, Some(distance_m), distance_m);
            assert!(coded.get(PLACES - 1, distance_m).unwrap() >= distance_m * (1.0 - 2e-7));
        }
        coded.set(3, None, 1000.0);
        assert_eq!(coded.get(3, 1000.0), None);
        assert_eq!(coded.get(PLACES, 1000.0), None);
    }

    #[test]
    fn bytes_travel_as_they_are() {
        let mut coded = Coded::new();
        coded.set(0, Some(12.5), 1000.0);
        coded.set(1, Some(999.0), 1000.0);
        let mut other = Coded::new();
        other.fill(coded.bytes(2));
        assert_eq!(other.get(1, 1000.0), coded.get(1, 1000.0));
        assert_eq!(other.get(2, 1000.0), None);
    }
}
