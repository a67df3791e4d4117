//! Where relays are across the line, in six bytes each.

use super::room::Room;
use crate::mission::Band;
use crate::place::CrossSection;

/// The largest code of three bytes.
const LAST: f32 = 16_777_215.0;

/// One relay's (y, h), each in three bytes as a part of its room.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct Cell([u8; 6]);

impl Cell {
    /// The cell nearest to `at` in `room`.
    pub(super) fn of(at: CrossSection, room: Room) -> Self {
        let [a, b, c, _] = code(at.y_m, room.lateral).to_le_bytes();
        let [d, e, f, _] = code(at.altitude_m, room.band).to_le_bytes();
        Self([a, b, c, d, e, f])
    }

    /// Where that is.
    pub(super) fn place(self, room: Room) -> CrossSection {
        let Self([a, b, c, d, e, f]) = self;
        CrossSection {
            y_m: value([a, b, c, 0], room.lateral),
            altitude_m: value([d, e, f, 0], room.band),
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "between 0 and LAST; the cast saturates"
)]
fn code(at: f32, band: Band) -> u32 {
    if band.is_single() {
        return 0;
    }
    ((at - band.least_m) / band.span_m() * LAST + 0.5).clamp(0.0, LAST) as u32
}

#[expect(clippy::cast_precision_loss, reason = "24 bits fit an f32")]
fn value(bytes: [u8; 4], band: Band) -> f32 {
    let code = u32::from_le_bytes(bytes) as f32;
    if code >= LAST {
        return band.most_m;
    }
    band.nearest(band.least_m + code * (band.span_m() / LAST))
}
