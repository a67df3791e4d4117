//! Conversion of numbers: f64 of files to f32 of relays, decibels to factors.

/// Returns the nearest f32, the precision of relays.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the ranges of options and scenarios lie well inside those of an f32"
)]
pub fn narrow(value: f64) -> f32 {
    value as f32
}

/// Returns the ratio that `db` decibels express.
#[must_use]
pub fn factor(db: f64) -> f64 {
    10_f64.powf(db / 10.0)
}

/// Returns the power of `dbm`, W.
#[must_use]
pub fn watts(dbm: f64) -> f64 {
    factor(dbm - 30.0)
}
