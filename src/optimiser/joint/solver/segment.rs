//! A chain in segments: of each only the outlook at its end is kept, and the policies of one are at hand.

use crate::mission::Mission;
use crate::optimiser::joint::axis::Triple;
use crate::optimiser::joint::outlook::Outlook;
use crate::optimiser::joint::policy::Brief;

/// Relays in a segment.
pub(super) const SEGMENT: usize = 10;
/// How many of them are held; without the feature `altitude` nobody solves a chain.
pub(super) const STAGES: usize = if cfg!(feature = "altitude") {
    SEGMENT
} else {
    0
};
/// The same number as of a segment, to count relays by.
pub(super) const SEGMENT_RELAYS: u16 = 10;

/// The chain up to the end of a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Mark {
    /// Where the relay before the segment is along x, m.
    pub(super) x_m: f32,
    /// What the last relay of the segment sees, but for what a pass back alone has to know.
    pub(super) slope: Triple,
    pub(super) bend: [f32; 6],
}

impl Mark {
    pub(super) fn look(&mut self, outlook: &Outlook) {
        let [[xx, xy, xh], [_, yy, yh], [_, _, hh]] = outlook.bend;
        self.slope = outlook.slope;
        self.bend = [xx, xy, xh, yy, yh, hh];
    }

    pub(super) fn outlook(&self) -> Outlook {
        let [xx, xy, xh, yy, yh, hh] = self.bend;
        Outlook {
            slope: self.slope,
            bend: [[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]],
            ..Outlook::default()
        }
    }
}

/// A relay of the segment at hand.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stage {
    pub(super) x_m: f32,
    pub(super) policy: Brief,
}

/// The last segment.
pub(super) fn last_of(mission: &Mission) -> u8 {
    let last = (usize::from(mission.relays()) - 1) / SEGMENT;
    u8::try_from(last).unwrap_or(u8::MAX)
}

/// The numbers of the relays in `segment`.
pub(super) fn relays_of(segment: u8, relays: u16) -> impl DoubleEndedIterator<Item = (usize, u16)> {
    let first = u16::from(segment) * SEGMENT_RELAYS;
    // Counted in u16, which both are: to zip two ranges backward may panic.
    (0..SEGMENT_RELAYS)
        .map(move |k| (usize::from(k), first + 1 + k))
        .filter(move |(_, index)| *index <= relays)
}
