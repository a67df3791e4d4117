//! Number of relays for a target SIR, and their positions: the paper's eq. (Opt), and Problem 1 in a field.
//!
//! | interference | profiles | file | accuracy |
//! | --- | --- | --- | --- |
//! | one interferer | any | [`farthest`] | exact if `proven`: no chain with one relay fewer meets the target |
//! | a field | equal | `ranges` | exact, also in an uneven field, which the paper leaves to an exhaustive search |
//! | a field | different | [`farthest`] | result of Algorithm 4; not proven |
//!
//! A minimum separation can only raise the number. A number that is the same without it is proven, any other is not. These
//! functions do not allocate, but are not intended for a relay's main loop.

pub mod farthest;
#[cfg(not(feature = "internals"))]
pub(crate) mod ranges;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod ranges;

use crate::mission::{MAX_RELAYS, Mission, Profile};
use crate::place::Placement;
use crate::sir;

/// Minimum number of relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fewest {
    /// Number of relays that meets the target.
    pub relays: u16,
    /// True if no smaller number meets it.
    pub proven: bool,
}

/// Maximum SIR of any number of relays.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Most {
    /// Highest target that is met, linear SIR, to 1e-6 relative.
    pub target: f32,
    /// Minimum number of relays that meets it.
    pub relays: u16,
}

/// Lower limit of the search in [`Most::of`], relative to the ceiling of the first hop.
const DEPTH: f32 = 1e-20;

/// Bisection steps of that range in its logarithm, which is 46 wide: to 1e-8.
const HALVINGS: u8 = 32;

impl Fewest {
    /// Returns the minimum number of relays for `target` (linear SIR, above 0), at most [`Mission::MAX_RELAYS`].
    ///
    /// The mission's own number is ignored. `profile_of` returns the profile of relay 1..=N. Equal to an exhaustive count if
    /// `proven`: `as_few_as_an_exhaustive_count` in `host-tests/tests/fleet/`. Work: with one interferer a reach for each relay,
    /// and all of them again with a minimum separation; in a field at most 32 chains of `ranges`.
    ///
    /// `None` if no number of relays meets it; [`Most::of`] returns the best that they can meet.
    pub fn of(mission: &Mission, target: f32, profile_of: impl Fn(u16) -> Profile) -> Option<Self> {
        let found = counted(mission, target, &profile_of)?;
        if !(mission.config().min_separation_m > 0.0) || !found.proven {
            return Some(found);
        }
        let freely = counted(&mission.unseparated(), target, &profile_of);
        Some(Self {
            proven: freely.is_some_and(|freely| freely.relays == found.relays),
            ..found
        })
    }
}

impl Most {
    /// Returns the highest target that any number of relays meets; `None` if it is below 1e-20 of the first hop's ceiling.
    ///
    /// With different altitudes, or a minimum separation, it is a feasible target but not certainly the highest. Work: 33 times
    /// that of [`Fewest::of`].
    pub fn of(mission: &Mission, profile_of: impl Fn(u16) -> Profile) -> Option<Self> {
        let meets = |target: f32| {
            let found = counted(mission, target, &profile_of)?;
            Some(Self {
                target,
                relays: found.relays,
            })
        };
        let ceiling = sir::first_hop_ceiling(mission, profile_of(1).altitude_m);
        if !(ceiling > 0.0) {
            return None;
        }
        if let Some(most) = meets(ceiling) {
            return Some(most);
        }
        let (mut low, mut high) = (libm::logf(DEPTH), 0.0);
        let mut best = None;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if let Some(most) = meets(ceiling * libm::expf(middle)) {
                best = Some(most);
                low = middle;
            } else {
                high = middle;
            }
        }
        best
    }
}

impl Mission {
    /// Writes the positions of the mission's N relays for `target` to `places`, relay 1 first.
    ///
    /// Returns false if they do not meet it, or `places` is shorter than N. Every hop but one has its maximum length, and meets
    /// the target to 1e-4 relative. Work as that of a chain in [`Fewest::of`].
    pub fn places_for(
        &self,
        target: f32,
        profile_of: impl Fn(u16) -> Profile,
        places: &mut [Placement],
    ) -> bool {
        let Some(places) = places.get_mut(..usize::from(self.relays())) else {
            return false;
        };
        farthest::places(self, target, &profile_of, places)
    }
}

/// Returns the minimum number of relays; `proven` ignores the separation.
fn counted(mission: &Mission, target: f32, profile_of: &impl Fn(u16) -> Profile) -> Option<Fewest> {
    if mission.field().is_some() && alike(MAX_RELAYS, profile_of) {
        ranges::fewest(mission, target, profile_of(1))
    } else {
        farthest::fewest(mission, target, profile_of)
    }
}

/// Returns true if relays 1 to `last` have the same profile.
fn alike(last: u16, profile_of: &impl Fn(u16) -> Profile) -> bool {
    let first = profile_of(1);
    (2..=last).all(|index| profile_of(index) == first)
}
