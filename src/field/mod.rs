//! Interference field: interference that is known as a distribution along x, not by its source.
//!
//! With the interference power I(x) a random variable, the expected SIR at x is the received signal power times Upsilon(x) = E[1
//! / I(x)], in 1/W; placement needs nothing else of the distribution. A [`Field`] is a table of Upsilon along x. If I / `I_max`
//! has a Beta distribution there is a closed form, [`FieldPoint::beta_upsilon`]; from measurements, [`estimate::Estimator`] fits one.

pub mod estimate;
mod in_noise;

pub(crate) use in_noise::InNoise;

/// Allowed range of Upsilon = E[1/I], 1/W. The limits correspond to an interference power of 1e9 W and of 1e-32 W. No
/// receiver can measure so wide a range.
const UPSILON: (f32, f32) = (1e-9, 1e32);

/// Point of a [`Field`]: an x, and Upsilon = E[1/I] at this x. Upsilon is the mean of the inverse interference power.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FieldPoint {
    /// Position along the line from Tx (0) to Rx (D), m: -1e7 to 1e7.
    pub x_m: f32,
    /// Upsilon = E[1/I] at this x, 1/W: 1e-9 to 1e32.
    pub upsilon_per_w: f32,
}

/// Reason why [`Field::try_new`] rejects a table of points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum FieldError {
    /// The table has no point, or more than [`Field::MAX_POINTS`].
    Points,
    /// The x of a point of the interference field, `x_m`, is not within -1e7 to 1e7 m.
    Place,
    /// The `x_m` of a point is not larger than the `x_m` of the previous point.
    Order,
    /// The `upsilon_per_w` of a point is not within 1e-9 to 1e32.
    Upsilon,
}

error_texts!(FieldError {
    Points => "an interference field must have 1 to 1024 points",
    Place => "x_m of each point of the interference field must be within -1e7 to 1e7",
    Order => "x_m of the points of the interference field must increase from point to point",
    Upsilon => "upsilon_per_w (mean of 1 / interference power, in 1/W) must be within 1e-9 to 1e32",
});

/// Interference field: a checked table of Upsilon = E[1/I] along x. Upsilon is linear between two adjacent points, and
/// constant beyond the ends of the table.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Field {
    points: &'static [FieldPoint],
    smallest: f32,
    largest: f32,
}

impl Field {
    /// Maximum number of points of an interference field.
    pub const MAX_POINTS: usize = 1024;

    /// Creates an interference field from a table, after checking every point.
    ///
    /// Usable in a constant, where [`Field::new`] turns an error into a failed build.
    ///
    /// Work: a few comparisons for each point.
    ///
    /// # Errors
    /// [`FieldError`] names the first value that is outside its range.
    pub const fn try_new(points: &'static [FieldPoint]) -> Result<Self, FieldError> {
        if points.is_empty() || points.len() > Self::MAX_POINTS {
            return Err(FieldError::Points);
        }
        let (mut smallest, mut largest) = (f32::MAX, 0.0);
        let mut before = f32::NEG_INFINITY;
        let mut rest = points;
        while let [point, after @ ..] = rest {
            if !(point.x_m >= -1e7 && point.x_m <= 1e7) {
                return Err(FieldError::Place);
            }
            if !(point.x_m > before) {
                return Err(FieldError::Order);
            }
            let upsilon = point.upsilon_per_w;
            if !is_upsilon(upsilon) {
                return Err(FieldError::Upsilon);
            }
            if upsilon < smallest {
                smallest = upsilon;
            }
            if upsilon > largest {
                largest = upsilon;
            }
            before = point.x_m;
            rest = after;
        }
        Ok(Self {
            points,
            smallest,
            largest,
        })
    }

    /// Creates a field from a table in a `const`; an invalid table fails the build.
    ///
    /// # Panics
    /// Panics on an invalid table: in a `const` this is a failed build, as intended. For values known at run time use
    /// [`Field::try_new`], which makes the same checks.
    ///
    /// ```
    /// use uav_relay::{Field, FieldPoint};
    ///
    /// // Upsilon = E[1 / I], measured at two positions, in 1/W.
    /// const FIELD: Field = Field::new(&[
    ///     FieldPoint { x_m: 0.0, upsilon_per_w: 4.0e5 },
    ///     FieldPoint { x_m: 1000.0, upsilon_per_w: 5.0e5 },
    /// ]);
    /// assert_eq!(FIELD.upsilon(500.0), 4.5e5);
    /// ```
    #[expect(
        clippy::panic,
        reason = "in a constant this fails the build, as documented"
    )]
    pub const fn new(points: &'static [FieldPoint]) -> Self {
        match Self::try_new(points) {
            Ok(field) => field,
            Err(error) => panic!("{}", error.text()),
        }
    }

    /// Returns the points of the interference field, a table of Upsilon = E[1/I] along x.
    pub const fn points(&self) -> &'static [FieldPoint] {
        self.points
    }

    /// Returns the smallest Upsilon = E[1/I] of the table, 1/W: that of the strongest interference.
    pub const fn smallest(&self) -> f32 {
        self.smallest
    }

    /// Returns the largest Upsilon = E[1/I] of the table, 1/W: that of the weakest interference.
    pub const fn largest(&self) -> f32 {
        self.largest
    }

    /// Returns true if Upsilon = E[1/I] is the same at every x, as for the paper's i.i.d. interference.
    pub const fn is_constant(&self) -> bool {
        !(self.smallest < self.largest)
    }

    /// Returns Upsilon = E[1/I] at `x_m`, 1/W, interpolated linearly with a relative error below 4e-7.
    ///
    /// Every `x_m` is valid: beyond an end point the result is the Upsilon of this end point, and for NaN the Upsilon
    /// of the first point. The result is never outside the range of the two points around it. Work: at most eleven
    /// comparisons of a binary search, three divisions. The accuracy is asserted by
    /// `interpolation_agrees_with_f64_and_stays_between_its_neighbours` in `host-tests/tests/field/table.rs`.
    pub const fn upsilon(&self, x_m: f32) -> f32 {
        self.in_noise(0.0).upsilon(x_m)
    }

    /// Returns the two points of the table around `x_m`. If `x_m` is the x of a point, the result is this point and
    /// `None`. If `x_m` is beyond an end of the table, the result is the point at that end and `None`.
    const fn around(&self, x_m: f32) -> (FieldPoint, Option<FieldPoint>) {
        let mut around = self.points;
        while around.len() > 2 {
            let middle = around.len() / 2;
            let (Some((_, after)), Some((before, _))) = (
                around.split_at_checked(middle),
                around.split_at_checked(middle + 1),
            ) else {
                break;
            };
            around = match after {
                [pivot, ..] if pivot.x_m <= x_m => after,
                _ => before,
            };
        }
        match around {
            [left, right] if left.x_m < x_m && x_m < right.x_m => (*left, Some(*right)),
            [_, right] if right.x_m <= x_m => (*right, None),
            [end, ..] => (*end, None),
            // No field is empty.
            [] => (
                FieldPoint {
                    x_m,
                    upsilon_per_w: self.smallest,
                },
                None,
            ),
        }
    }
}

const fn between(left: FieldPoint, right: FieldPoint, x_m: f32) -> f32 {
    let (a, b) = (left.upsilon_per_w, right.upsilon_per_w);
    let step = right.x_m - left.x_m;
    // Two weights, so that only positive numbers are added: a + (b - a) t would lose a small b next to a large a.
    let upsilon = a * ((right.x_m - x_m) / step) + b * ((x_m - left.x_m) / step);
    upsilon.max(a.min(b)).min(a.max(b))
}

pub(crate) const fn is_upsilon(upsilon_per_w: f32) -> bool {
    upsilon_per_w >= UPSILON.0 && upsilon_per_w <= UPSILON.1
}

impl FieldPoint {
    /// Returns Upsilon = E[1/I], 1/W, if I / `i_max_w` has a Beta distribution.
    ///
    /// It is (alpha + beta - 1) / ((alpha - 1) `i_max_w`), with the shape parameters `alpha` and `beta`, and the
    /// maximum power `i_max_w` in W. The paper's formula has no `I_max`, because its I is relative to `I_max`. `None`
    /// unless alpha > 1 (otherwise E[1/I] is infinite), beta > 0, `i_max_w` > 0, and all three and the result are
    /// finite. The computation uses f64, because near alpha = 1 an f32 of alpha would be too coarse. It is intended for
    /// constants, where it takes no run time. Accuracy: `upsilon_of_a_beta_distribution_is_the_integral_of_its_mgf` in
    /// `host-tests/tests/field/closed_forms.rs`.
    pub const fn beta_upsilon(alpha: f64, beta: f64, i_max_w: f64) -> Option<f64> {
        let shapes = alpha > 1.0 && alpha.is_finite() && beta > 0.0 && beta.is_finite();
        if !(shapes && i_max_w > 0.0 && i_max_w.is_finite()) {
            return None;
        }
        let upsilon = ((alpha - 1.0) + beta) / (alpha - 1.0) / i_max_w;
        if upsilon.is_finite() {
            Some(upsilon)
        } else {
            None
        }
    }

    /// Returns the point of a field at `x_m`, m, if I / `i_max_w` has a Beta distribution there. I is the interference
    /// power.
    ///
    /// `None` if [`beta_upsilon`](Self::beta_upsilon) is `None` for the same shapes and `i_max_w`. Constant work.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a field refuses what does not fit"
    )]
    pub const fn from_beta(x_m: f32, alpha: f64, beta: f64, i_max_w: f64) -> Option<Self> {
        match Self::beta_upsilon(alpha, beta, i_max_w) {
            Some(upsilon) => Some(Self {
                x_m,
                upsilon_per_w: upsilon as f32,
            }),
            None => None,
        }
    }
}
