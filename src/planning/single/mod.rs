//! One relay alone between Tx and Rx: where the worse of its two hops is best.
//!
//! | what is given | file | source |
//! | --- | --- | --- |
//! | the altitude, one interferer | [`given_altitude`] | Corollary 1, Theorem 1 |
//! | the place along x, one interferer | [`given_x`] | Theorem 2 |
//! | neither, one interferer | [`free`] | Theorem 3, as corrected |
//! | with room beside the line, one interferer | [`aside`] | not in the paper |
//! | the altitude, a field of interference | [`stochastic`] | Algorithm 3, as corrected |
//! | noise alone | [`noise`] | the paper's special case without interference |
//!
//! They rest on where the two SIRs are equal ([`locus`], Lemma 1) and on where that of the first hop turns
//! ([`crate::sir::first_hop_turn`], Lemma 2); [`guide`] has C_1, C_2 and C_3, the ratios of powers at which the cases change.
//! SIR_2 rises with x and falls with the altitude, always. Where receivers have noise SIR_1 may turn once more, and the best place of
//! Theorem 3 may lie inside the box (`touching`); the mission's noise is in all of them but [`noise`], which has its own.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

pub mod aside;
mod corridor;
mod edge;
mod edge_noise;
pub mod free;
pub mod given_altitude;
pub mod given_x;
#[cfg(not(feature = "internals"))]
pub(crate) mod guide;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod guide;
#[cfg(not(feature = "internals"))]
pub(crate) mod locus;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod locus;
pub mod noise;
pub mod stochastic;
mod touching;

use crate::mission::{Mission, Profile};
use crate::place::Placement;
use crate::sir::{self, Sender};

/// Halvings of a stretch for the place where the SIRs cross: to an f32's own step, even next to Tx.
const HALVINGS: u8 = 40;

/// Where a relay stands, and the SIR (linear; expected, in a field) of the worse of its two hops.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Found {
    /// Where.
    pub place: Placement,
    /// The worse of SIR_1 and SIR_2.
    pub sir: f32,
}

impl Found {
    /// The better of two; this one if they are equal.
    fn or(self, other: Self) -> Self {
        if other.sir > self.sir { other } else { self }
    }
}

/// The two hops of the only relay of a mission, at one altitude.
#[derive(Clone, Copy)]
struct Two<'a> {
    mission: &'a Mission,
    profile: Profile,
}

impl Two<'_> {
    fn at(&self, x_m: f32) -> Placement {
        Placement::on_line(x_m, self.profile.altitude_m)
    }

    fn first(&self, x_m: f32) -> f32 {
        Sender::transmitter(self.mission).sir_at(self.mission, 0.0, self.at(x_m))
    }

    fn second(&self, x_m: f32) -> f32 {
        sir::at_receiver(self.mission, self.at(x_m), self.profile.power_w)
    }

    fn found(&self, x_m: f32) -> Found {
        Found {
            place: self.at(x_m),
            sir: self.first(x_m).min(self.second(x_m)),
        }
    }

    /// The best of the two places next to where SIR_1 falls below SIR_2, in [`low`, `high`]: not below at the one end, and at
    /// the other.
    fn crossing(&self, low: f32, high: f32) -> Found {
        let (mut low, mut high) = (low, high);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if !(middle > low && middle < high) {
                break;
            }
            if self.first(middle) > self.second(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.found(low).or(self.found(high))
    }
}
