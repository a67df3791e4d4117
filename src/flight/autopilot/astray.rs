//! Detection of a drone so far from its line that it has no place along it.
//!
//! Sites with latitude and longitude swapped are valid places, and nothing else shows the mistake.
//!
//! | position | effect |
//! | --- | --- |
//! | near the line | re-arms the report on the ground |
//! | off the line, on the ground | reported once |
//! | off the line, in the air | reported at most once in 10 s |

use crate::flight::axis::Axis;
use crate::geodetic::Geodetic;
use crate::time::{Duration, Instant};

/// Minimum time between two events.
const AGAIN: Duration = Duration::from_millis(10_000);

/// Maximum age of a position that is used.
const STALE: Duration = Duration::from_millis(3_000);

/// Position of a drone that has no place along its line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OffLine {
    /// Position that the autopilot reports.
    pub at: Geodetic,
    /// Distance along the ground to the nearest point of the line, m.
    pub away_m: u32,
}

impl OffLine {
    /// Returns the distance of a drone at `at` from the line `axis`. `None` for a place that is not on earth. Constant work.
    pub fn new(at: Geodetic, axis: &Axis) -> Option<Self> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "no distance on earth is longer"
        )]
        let away_m = axis.away_m(at)? as u32;
        Some(Self { at, away_m })
    }
}

/// Positions off the line.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Astray {
    newest: Option<(Instant, Geodetic)>,
    told_at: Option<Instant>,
    /// True once it was reported on the ground.
    told_on_ground: bool,
}

impl Astray {
    /// Records a position off the line; returns true if it has to be reported.
    pub(super) fn hear(&mut self, now: Instant, at: Geodetic, is_in_air: bool) -> bool {
        self.newest = Some((now, at));
        let is_wanted = is_in_air || !self.told_on_ground;
        let is_due = self.told_at.is_none_or(|told| now.since(told) >= AGAIN);
        if !is_wanted || !is_due {
            return false;
        }
        self.told_at = Some(now);
        self.told_on_ground |= !is_in_air;
        true
    }

    /// Records a position near the line.
    pub(super) const fn returned(&mut self) {
        self.newest = None;
        self.told_on_ground = false;
    }

    /// Returns the newest position if it was off the line.
    pub(super) fn newest(&self, now: Instant) -> Option<Geodetic> {
        let fresh = self.newest.filter(|(at, _)| now.since(*at) < STALE);
        fresh.map(|(_, at)| at)
    }
}
