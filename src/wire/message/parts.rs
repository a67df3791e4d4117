//! What bodies of several kinds have in common, and the ranges of their numbers. A type of its own costs no byte, and saves
//! the code to read it once more.

use serde::{Deserialize, Serialize};

use crate::mission::{MAX_RELAYS, Profile};
use crate::place::Placement;
use crate::wire::digest::MissionId;

/// No slack or reach in metres is larger: a place is at most 1e6, a reach of the last hop is cut at 1e9.
pub(super) const FARTHEST_M: f32 = 2e9;

/// Which pass, of which mission.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct PassId {
    number: [u8; 2],
    mission: [u8; 2],
}

impl PassId {
    pub(super) const fn new(number: u16, mission: u16) -> Self {
        Self {
            number: number.to_le_bytes(),
            mission: mission.to_le_bytes(),
        }
    }

    pub(super) const fn number(self) -> u16 {
        u16::from_le_bytes(self.number)
    }

    pub(super) const fn mission(self) -> u16 {
        u16::from_le_bytes(self.mission)
    }
}

/// A place above the line.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct PlaceBody {
    x_m: f32,
    altitude_m: f32,
}

impl PlaceBody {
    pub(super) const fn of(place: Placement) -> Self {
        Self {
            x_m: place.x_m,
            altitude_m: place.altitude_m,
        }
    }

    /// The place, if a relay may be there.
    pub(super) fn checked(self) -> Option<Placement> {
        let place = Placement::on_line(self.x_m, self.altitude_m);
        is_place(place).then_some(place)
    }
}

/// What a hello, a proposal and a decision are alike: a view's number, four numbers and a byte of flags. What the numbers mean
/// depends, and those that mean nothing are 0.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct ViewBody {
    /// The number is that of a view.
    pub(super) pass: PassId,
    one: [u8; 2],
    other: [u8; 2],
    more: [u8; 2],
    version: [u8; 2],
    flags: u8,
}

impl ViewBody {
    /// Bytes of a body of this kind.
    pub(super) const LENGTH: usize = 14;

    pub(super) const fn new(pass: PassId, numbers: [u16; 4], flags: u8) -> Self {
        let [one, other, more, version] = numbers;
        Self {
            pass,
            one: one.to_le_bytes(),
            other: other.to_le_bytes(),
            more: more.to_le_bytes(),
            version: version.to_le_bytes(),
            flags,
        }
    }

    /// The numbers, of which the first two are of relays, the third one of a view or a digest, and the flags.
    pub(super) fn parts(self) -> Option<(u16, u16, u16, u8)> {
        let one = u16::from_le_bytes(self.one);
        let other = u16::from_le_bytes(self.other);
        let more = u16::from_le_bytes(self.more);
        (one <= MAX_RELAYS && other <= MAX_RELAYS).then_some((one, other, more, self.flags))
    }

    pub(super) const fn mission_id(self, digest: u16) -> MissionId {
        MissionId {
            version: u16::from_le_bytes(self.version),
            digest,
        }
    }
}

/// Whether a relay may be there.
pub(super) fn is_place(at: Placement) -> bool {
    (0.0..=1e6).contains(&at.x_m) && is_beside(at.y_m) && (0.1..=1e5).contains(&at.altitude_m)
}

/// Whether a relay may be so far from the line, m.
pub(super) fn is_beside(y_m: f32) -> bool {
    (-1e5..=1e5).contains(&y_m)
}

/// The profile of these numbers, if they are in range.
pub(super) fn profile(altitude_m: f32, power_w: f32) -> Option<Profile> {
    let profile = Profile {
        altitude_m,
        power_w,
    };
    profile.is_valid().then_some(profile)
}

/// Whether all numbers are within [`least`, `FARTHEST_M`].
pub(super) fn in_range(numbers: &[f32], least: f32) -> bool {
    numbers
        .iter()
        .all(|number| (least..=FARTHEST_M).contains(number))
}
