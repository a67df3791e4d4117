//! From the f64 of files and options to the f32 of relays.

/// The nearest f32: what a relay works with.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the ranges of options and scenarios lie well inside those of an f32"
)]
pub fn narrow(value: f64) -> f32 {
    value as f32
}
