//! Result of a check before flight (`--check`): colours, end and last line.

use uav_relay::{Duration, Instant};

/// Result of one checked item, with its text: `Ok` means passed (green), `Err` means failed (red).
pub type Finding = Result<String, String>;

/// Returns the colour word of a checked item: `green` if `is_green` (passed), otherwise `red`.
#[must_use]
pub const fn colour(is_green: bool) -> &'static str {
    if is_green { "green" } else { "red" }
}

/// Returns the last line of a check: how many of its `all` items are red (failed).
///
/// `items` is the noun for the items in this line, such as `relays`.
///
/// # Errors
/// The line, if at least one item is red.
pub fn verdict(red: usize, all: usize, items: &str) -> Finding {
    if red == 0 {
        Ok(format!("all {all} {items} are green"))
    } else {
        Err(format!("{red} of {all} {items} are red: do not fly"))
    }
}

/// End of a check: all items have stayed green (passed) for `green_for`, or the time `limit` has come.
#[derive(Debug)]
pub struct End {
    /// Time at which the check ends even if an item is red.
    pub limit: Instant,
    /// Minimum time for which all items must be green.
    pub green_for: Duration,
    /// Time since which all items have been green; `None` if an item is red.
    pub green_since: Option<Instant>,
}

impl End {
    /// Records the present state of the items, and returns true at the end of the check.
    ///
    /// `are_green` is true if all items are green (passed) at `now`.
    pub fn is_reached(&mut self, now: Instant, are_green: bool) -> bool {
        let since = self.green_since.filter(|_| are_green);
        self.green_since = are_green.then(|| since.unwrap_or(now));
        let is_settled = self
            .green_since
            .is_some_and(|since| now.since(since) >= self.green_for);
        is_settled || now >= self.limit
    }
}
