//! Numbers: from the f64 of files and options to the f32 of relays, and from decibels to factors.

/// The nearest f32: what a relay works with.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the ranges of options and scenarios lie well inside those of an f32"
)]
pub fn narrow(value: f64) -> f32 {
    value as f32
}

/// A ratio of `db` decibels.
#[must_use]
pub fn factor(db: f64) -> f64 {
    10_f64.powf(db / 10.0)
}

/// A power of `dbm` over a milliwatt, W.
#[must_use]
pub fn watts(dbm: f64) -> f64 {
    factor(dbm - 30.0)
}
