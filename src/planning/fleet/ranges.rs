//! Equal relays in a field: the exact solution of the paper's Problem 1.
//!
//! Without a minimum separation, more equal relays never have a lower SIR. N of them meet a target if and only if the ranges of
//! [`retreat`](crate::optimiser::retreat) end at a position within the reach of the first hop.

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

use super::Fewest;
use crate::mission::{MAX_RELAYS, Mission, Profile};
use crate::optimiser::walk::Walk;
use crate::root::sqrt;
use crate::sir::square;

/// Number of additional relays that are tried with a minimum separation.
const MORE: u16 = 32;

const TARGETS: u8 = 48;

fn is_met(mission: &Mission, target: f32, profile: Profile) -> bool {
    let chain = Walk {
        mission,
        target,
        plain: false,
        profile_of: &|_| profile,
    };
    chain.ends(|_, _| {}).is_some_and(|(slack, _)| slack >= 0.0)
}

/// Returns the minimum number of equal relays for `target` in a field; see [`super::fewest`]. Without a separation it is found by
/// bisection.
pub(super) fn fewest(mission: &Mission, target: f32, profile: Profile) -> Option<Fewest> {
    let met_by = |mission: &Mission, relays: u16| {
        mission
            .with_relays(relays)
            .is_ok_and(|mission| is_met(&mission, target, profile))
    };
    let freely = mission.unseparated();
    let (mut too_few, mut enough) = (0, 1);
    while !met_by(&freely, enough) {
        if enough >= MAX_RELAYS {
            return None;
        }
        too_few = enough;
        enough = (enough * 2).min(MAX_RELAYS);
    }
    while enough - too_few > 1 {
        let middle = too_few + (enough - too_few) / 2;
        if met_by(&freely, middle) {
            enough = middle;
        } else {
            too_few = middle;
        }
    }
    (enough..=enough.saturating_add(MORE))
        .find(|&relays| met_by(mission, relays))
        .map(|relays| Fewest {
            relays,
            proven: true,
        })
}

/// Returns the highest target (linear, to an f32's step) of the mission's N equal relays in its field.
///
/// `None` without a field, or if no target is met. It is the optimum if no minimum separation is binding:
/// `the_best_of_equals_in_a_field` in `host-tests/tests/fleet/`. Algorithm 4 may be below it in an uneven field. Work: 48 chains,
/// each three square roots for every point of the field and relay.
pub fn best(mission: &Mission, profile: Profile) -> Option<f32> {
    mission.field()?;
    let met = |target: f32| is_met(mission, target, profile);
    // SIR of the last hop from right above Rx.
    let mut high = mission.receiver_gain(profile.power_w) / square(profile.altitude_m);
    if met(high) {
        return Some(high);
    }
    let mut low = 0.0;
    for _ in 0..TARGETS {
        // Geometric bisection first, since the targets span many decades.
        let middle = if high > 4.0 * low {
            sqrt(high * low.max(high * 1e-6))
        } else {
            0.5 * (low + high)
        };
        if !(middle > low && middle < high) {
            break;
        }
        if met(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low > 0.0).then_some(low)
}
