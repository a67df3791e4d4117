//! The altitudes that a relay weighs in one pass, in nine bytes.
//!
//! Two kinds: levels spread evenly over a band, to find out roughly where to fly; and nine about the altitude held so far,
//! a *tube*, at 0, 1/8, 1/4, 1/2 and 1 of its width to either side, so that one pass tries large and small changes at once.

use crate::mission::Band;

/// The most levels there are.
pub const MOST_LEVELS: u8 = 64;

/// Levels of a tube. No even spread has as many.
pub const TUBE: u8 = 9;

/// The level of a tube that is its centre.
const MIDDLE: u8 = TUBE / 2;

/// What a pass has brought, as far as it can tell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Gained {
    /// A target was met that had not been met before.
    Something,
    /// None was, down to the finest that matters.
    Nothing,
    /// None was, but all were far above what had been met.
    Unknown,
}

/// Altitudes, rising.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Levels {
    centre_m: f32,
    /// From the centre to the highest level, m; 0 where there is nothing to choose.
    width_m: f32,
    count: u8,
}

impl Levels {
    /// The one altitude `altitude_m`, m, `count` times over: a relay that holds it among others that choose.
    pub const fn held(altitude_m: f32, count: u8) -> Self {
        Self {
            centre_m: altitude_m,
            width_m: 0.0,
            count,
        }
    }

    /// `count` levels from the lowest altitude of `band` to the highest; `count` is 2 to [`MOST_LEVELS`] and not [`TUBE`].
    pub fn even(band: Band, count: u8) -> Self {
        Self {
            centre_m: 0.5 * (band.least_m + band.most_m),
            width_m: 0.5 * (band.most_m - band.least_m),
            count,
        }
    }

    /// The nine levels about `centre_m`, up to `width_m` away, m.
    pub const fn tube(centre_m: f32, width_m: f32) -> Self {
        Self {
            centre_m,
            width_m,
            count: TUBE,
        }
    }

    /// Levels from their parts, if they are in range: a centre of 0.1 to 1e5 m, a width of 0 to 1e5 m, 1 to 64 levels.
    pub fn from_parts(centre_m: f32, width_m: f32, count: u8) -> Option<Self> {
        let sound = (0.1..=1e5).contains(&centre_m)
            && (0.0..=1e5).contains(&width_m)
            && (1..=MOST_LEVELS).contains(&count);
        sound.then_some(Self {
            centre_m,
            width_m,
            count,
        })
    }

    /// Centre in m, width in m and count, as [`Levels::from_parts`] takes them.
    pub const fn parts(&self) -> (f32, f32, u8) {
        (self.centre_m, self.width_m, self.count)
    }

    /// How many there are.
    pub const fn count(&self) -> u8 {
        self.count
    }

    /// Level `level` from the lowest, 0 to count - 1, m; cut off at `band` where there is something to choose.
    pub fn altitude(&self, band: Band, level: u8) -> f32 {
        if !(self.width_m > 0.0) {
            return self.centre_m;
        }
        let part = if self.count == TUBE {
            match level.abs_diff(MIDDLE) {
                0 => 0.0,
                1 => 0.125,
                2 => 0.25,
                3 => 0.5,
                _ => 1.0,
            }
        } else {
            let last = f32::from(self.count.saturating_sub(1).max(1));
            (2.0 * f32::from(level) / last - 1.0).abs()
        };
        let below = 2 * u16::from(level) < u16::from(self.count.saturating_sub(1));
        let offset = self.width_m * if below { -part } else { part };
        (self.centre_m + offset).max(band.least_m).min(band.most_m)
    }

    /// The tube to weigh next by a relay that has been given `level` of these, within `band`.
    ///
    /// A level at the rim of a tube widens it; one near its centre narrows it, as does a pass that brought nothing.
    pub fn about(&self, band: Band, level: u8, gain: Gained) -> Self {
        let centre_m = self.altitude(band, level);
        if !(self.width_m > 0.0) {
            return Self::held(centre_m, TUBE);
        }
        let width_m = if self.count == TUBE {
            match (gain, level.abs_diff(MIDDLE)) {
                (Gained::Unknown, _) | (Gained::Something, 3) => self.width_m,
                (Gained::Nothing, _) | (Gained::Something, 0..=2) => self.width_m * 0.5,
                (Gained::Something, _) => self.width_m * 2.0,
            }
        } else {
            2.0 * self.width_m / f32::from(self.count.saturating_sub(1).max(1))
        };
        Self::tube(
            centre_m,
            width_m.max(LEAST_WIDTH_M).min(band.most_m - band.least_m),
        )
    }

    /// The tube about `altitude_m` for a relay of which a pass over the whole of `band`, in `count` levels, was no use.
    pub fn about_held(band: Band, altitude_m: f32, count: u8) -> Self {
        if band.is_single() {
            return Self::held(altitude_m, TUBE);
        }
        let spacing = (band.most_m - band.least_m) / f32::from(count.saturating_sub(1).max(1));
        Self::tube(altitude_m, spacing.max(LEAST_WIDTH_M))
    }

    /// The tube after a pass of which nothing came at all.
    pub fn narrowed(&self) -> Self {
        let width_m = if self.width_m > 0.0 {
            (self.width_m * 0.5).max(LEAST_WIDTH_M)
        } else {
            0.0
        };
        Self { width_m, ..*self }
    }
}

/// A tube does not get narrower than this: no drone holds its altitude to a millimetre.
const LEAST_WIDTH_M: f32 = 1e-3;

#[cfg(test)]
#[expect(
    clippy::float_cmp,
    clippy::cast_possible_truncation,
    reason = "these are exact, and small"
)]
mod tests {
    use super::{Gained, Levels, TUBE};
    use crate::mission::Band;

    const BAND: Band = Band {
        least_m: 20.0,
        most_m: 300.0,
    };

    #[test]
    fn even_levels_reach_from_end_to_end_of_the_band() {
        let levels = Levels::even(BAND, 8);
        let altitudes: [f32; 8] = core::array::from_fn(|l| levels.altitude(BAND, l as u8));
        assert_eq!(
            altitudes,
            [20.0, 60.0, 100.0, 140.0, 180.0, 220.0, 260.0, 300.0]
        );
    }

    #[test]
    fn a_tube_keeps_its_centre_and_stays_in_the_band() {
        let levels = Levels::tube(280.1, 40.0);
        let altitudes: [f32; 9] = core::array::from_fn(|l| levels.altitude(BAND, l as u8));
        assert_eq!(altitudes[0], 240.1);
        assert_eq!(altitudes[4].to_bits(), 280.1_f32.to_bits());
        assert_eq!(altitudes[8], 300.0);
        assert!(altitudes.windows(2).all(|pair| pair[0] <= pair[1]));
    }

    #[test]
    fn a_tube_widens_at_its_rim_and_narrows_at_its_centre() {
        let tube = Levels::tube(100.0, 8.0);
        assert_eq!(
            tube.about(BAND, 8, Gained::Something),
            Levels::tube(108.0, 16.0)
        );
        assert_eq!(
            tube.about(BAND, 1, Gained::Something),
            Levels::tube(96.0, 8.0)
        );
        assert_eq!(
            tube.about(BAND, 4, Gained::Something),
            Levels::tube(100.0, 4.0)
        );
        assert_eq!(
            tube.about(BAND, 8, Gained::Nothing),
            Levels::tube(108.0, 4.0)
        );
        assert_eq!(tube.narrowed(), Levels::tube(100.0, 4.0));
        assert_eq!(
            Levels::even(BAND, 8).about(BAND, 2, Gained::Something),
            Levels::tube(100.0, 40.0)
        );
        assert_eq!(
            Levels::held(50.0, 9).about(BAND, 3, Gained::Something),
            Levels::held(50.0, TUBE)
        );
    }
}
