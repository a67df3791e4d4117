//! How many relays a target SIR needs, and where they go: the paper's eq. (Opt), and Problem 1 in a field.
//!
//! | interference | relays | file | how good |
//! | --- | --- | --- | --- |
//! | one interferer | any | [`farthest`] | exact where it says so: no chain with one relay fewer meets the target |
//! | a field | all alike | `ranges` | exact, in an uneven field too, which the paper leaves to an exhaustive search |
//! | a field | other | [`farthest`] | what Algorithm 4 finds; not proven |
//!
//! A least separation can only raise the number: a number that is the same without it is proven, any other is not.
//! Nothing here is meant for a relay's main loop; nothing allocates either.

pub mod farthest;
#[cfg(not(feature = "internals"))]
pub(crate) mod ranges;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod ranges;

use crate::mission::{MAX_RELAYS, Mission, Profile};
use crate::place::Placement;
use crate::sir;

/// The answer to how many relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fewest {
    /// That many relays meet the target.
    pub relays: u16,
    /// Whether it is certain that no fewer do.
    pub proven: bool,
}

/// The most that any number of relays can have.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Most {
    /// The highest target that is met, linear SIR, to 1e-6 relative.
    pub target: f32,
    /// The fewest relays that meet it.
    pub relays: u16,
}

/// How far below the ceiling of the first hop [`Most::of`] looks.
const DEPTH: f32 = 1e-20;

/// Halvings of that range, in its logarithm: 46 in it, to 1e-8.
const HALVINGS: u8 = 32;

impl Fewest {
    /// The fewest relays that meet `target` (linear SIR, above 0), at most [`Mission::MAX_RELAYS`]; the mission's own number is not looked at.
    ///
    /// `profile_of` gives what relay 1..=N holds. Equal to an exhaustive count wherever `proven`:
    /// `as_few_as_an_exhaustive_count` in `host-tests/tests/fleet/`. Work: with one interferer a reach for each relay, and once more all
    /// of them where they must keep a distance; in a field at most 32 chains of `ranges`.
    /// `None` when no number of relays meets it; [`Most::of`] has what they can meet.
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
    /// The highest target that any number of relays meets; `None` where none does down to 1e-20 of what the first hop can have.
    ///
    /// With relays of different altitudes, or a least separation, it is one that is met, not certainly the highest. Work: 33 times that of [`Fewest::of`].
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
    /// Writes the places of the N relays for `target` into `places`, relay 1 first. Returns false if they do not meet it, or if
    /// `places` is shorter than N.
    ///
    /// Every hop but one is as long as the target allows, and meets it to 1e-4 relative. Work as that of a chain in [`Fewest::of`].
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

/// The fewest relays; `proven` leaves the separation out of account.
fn counted(mission: &Mission, target: f32, profile_of: &impl Fn(u16) -> Profile) -> Option<Fewest> {
    if mission.field().is_some() && alike(MAX_RELAYS, profile_of) {
        ranges::fewest(mission, target, profile_of(1))
    } else {
        farthest::fewest(mission, target, profile_of)
    }
}

/// Whether relays 1 to `last` hold the same.
fn alike(last: u16, profile_of: &impl Fn(u16) -> Profile) -> bool {
    let first = profile_of(1);
    (2..=last).all(|index| profile_of(index) == first)
}
