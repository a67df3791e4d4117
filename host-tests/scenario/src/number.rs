//! Conversion of numbers: f64 of files to f32 of relays and back, decibels to factors; numbers as text.

/// Returns the f32 nearest to `value`. Relays compute in f32.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the ranges of options and scenarios lie well inside those of an f32"
)]
pub fn narrow(value: f64) -> f32 {
    value as f32
}

/// Returns the f64 with the shortest decimal form that rounds to `value` in f32.
///
/// Files and reports then have short numbers.
#[must_use]
pub fn shortest(value: f32) -> f64 {
    format!("{value}").parse().unwrap_or_else(|_| value.into())
}

/// Formats a number in few characters: from 100000 and below 0.001 with an exponent, as in 1e6.
#[must_use]
pub fn brief(value: f64) -> String {
    let size = value.abs();
    if size > 0.0 && !(1e-3..1e5).contains(&size) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
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
