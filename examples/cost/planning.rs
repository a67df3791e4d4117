//! What it costs to place one relay, and to count relays, on board.

use core::hint::black_box;
use cortex_m_semihosting::hprintln;
use uav_relay::placement::fleet;
use uav_relay::placement::single::{free, given_altitude, given_x};

use super::counter::instructions;
use super::missions::{HIGH, MISSION};

/// The theorems in the scenario with a band of altitudes, and the fewest relays for a target.
pub(crate) fn planning() {
    let common = HIGH.config().common;
    let (mission, x_m) = (black_box(&HIGH), black_box(700.0));
    let first = instructions(|| given_altitude::best_place(mission, common));
    let second = instructions(|| given_x::best_place(mission, x_m, common.power_w));
    let third = instructions(|| free::best_place(mission, common.power_w));
    hprintln!("theorem_1 {}", first);
    hprintln!("theorem_2 {}", second);
    hprintln!("theorem_3 {}", third);
    let mut relays = 0;
    let count = instructions(|| {
        relays = fleet::fewest(black_box(&MISSION), black_box(5.0), |_| common)
            .map_or(0, |found| found.relays);
    });
    hprintln!("fewest {}", count);
    hprintln!("fewest_relays {}", relays);
}
