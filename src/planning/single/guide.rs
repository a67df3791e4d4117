//! Guide for the powers of Tx and relay: the ratios p_t / p_u at which the cases of Corollary 1 change.
//!
//! SIR_1 / SIR_2 is proportional to p_t / p_u, so each is the ratio at which the two are equal at one position: above Tx (C_1),
//! above Rx (C_2), and at the minimum of SIR_1 (C_3). The paper prints them as formulas; here they are computed from the SIRs.

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

use super::Two;
use crate::mission::{Mission, Profile};
use crate::sir::{Extremum, first_hop_turn};

/// Ratios p_t / p_u, linear.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Guide {
    /// C_1: below it the first hop is the worse one even right above Tx; 0 with the interferer at Rx.
    pub c1: f32,
    /// C_2: above it the first hop is the better one even right above Rx.
    pub c2: f32,
    /// C_3: above it the first hop is the better one even at the minimum of SIR_1, between Tx and Rx or beyond. `None` for X <=
    /// 0; with noise, the minimum before the maximum.
    pub c3: Option<f32>,
}

/// Returns the ratios for a relay at `altitude_m`, m, above 0; `None` in a field.
///
/// Relative error below 1e-4: `the_guide_agrees_with_the_cases` in `host-tests/tests/theorems/`. Constant work.
pub fn ratios(mission: &Mission, altitude_m: f32) -> Option<Guide> {
    let interferer = mission.interferer()?;
    let config = mission.config();
    let profile = Profile {
        altitude_m,
        power_w: config.common.power_w,
    };
    let two = Two { mission, profile };
    let present = config.tx_power_w / profile.power_w;
    let equal_at = |x_m: f32| present * (two.second(x_m) / two.first(x_m));
    Some(Guide {
        c1: equal_at(0.0),
        c2: equal_at(config.distance_m),
        c3: match first_hop_turn(mission, interferer, altitude_m) {
            Extremum::Valley(bottom) | Extremum::ValleyAndHill(bottom, _) if bottom < 1e18 => {
                Some(equal_at(bottom))
            }
            _ => None,
        },
    })
}
