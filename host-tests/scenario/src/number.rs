//! Conversion of numbers: f64 of files to f32 of relays, decibels to factors.

/// Returns the f32 nearest to `value`. Relays compute in f32.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the ranges of options and scenarios lie well inside those of an f32"
)]
pub fn narrow(value: f64) -> f32 {
    value as f32
}

/// Converts decibels `db` to a linear ratio of powers.
#[must_use]
pub fn factor(db: f64) -> f64 {
    10_f64.powf(db / 10.0)
}

/// Converts a power from dBm to W.
#[must_use]
pub fn watts(dbm: f64) -> f64 {
    factor(dbm - 30.0)
}
