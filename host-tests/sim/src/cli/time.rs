//! Times of virtual time in options: `S`, or a period `S-E`.

use uav_relay::Instant;

use crate::command::number;

/// Parses a virtual time in seconds after the start, 0 to 1e6; `None` for other text.
pub(super) fn instant(text: &str) -> Option<Instant> {
    let seconds = number(text, 0.0, 1e6).ok()?;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "within 0 to 1e12"
    )]
    let micros = (seconds * 1e6) as u64;
    Some(Instant::from_micros(micros))
}

/// Parses a period `S-E` of virtual times in seconds, or a start `S` alone. `None` for other text.
pub(super) fn span(text: &str) -> Option<(Instant, Option<Instant>)> {
    if let Some(from) = instant(text) {
        return Some((from, None));
    }
    // A minus sign may also be part of an exponent.
    let mut cuts = text.match_indices('-').filter_map(|(at, _)| {
        let (from, until) = text.split_at_checked(at)?;
        Some((instant(from)?, Some(instant(until.get(1..)?)?)))
    });
    cuts.next()
}
