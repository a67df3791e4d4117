//! Cost of the joint method on board.

use cortex_m_semihosting::hprintln;
use uav_relay::Mission;
use uav_relay::optimiser::joint::{Seat, Solver};

use super::counter::instructions;
use super::missions::{BOTH, FITTED, FITTED_HIGH, HIGH, WIDE};

/// Solves a chain of `relays` relays by the joint method, in several calls.
///
/// Returns the number of instructions of all calls together, that of the most expensive call, and the number of calls.
fn solve_instructions(of: &Mission, relays: u16) -> (u32, u32, u32) {
    let Ok(mission) = of.with_relays(relays) else {
        return (0, 0, 0);
    };
    let Some(mut solver) = Solver::<100, 10>::new(&mission) else {
        return (0, 0, 0);
    };
    let seat = Seat::common(&mission);
    let (mut total, mut longest_call, mut calls) = (0_u32, 0, 0);
    loop {
        let mut is_finished = false;
        let cost = instructions(|| is_finished = solver.step(&mission, |_| seat).is_ready());
        total = total.saturating_add(cost);
        longest_call = longest_call.max(cost);
        calls += 1;
        if is_finished {
            return (total, longest_call, calls);
        }
    }
}

/// Measures the instructions of the joint method's solver, without messages.
#[inline(never)]
pub(crate) fn joint() {
    for (of, relays, suffix) in [
        (&HIGH, 8, ""),
        (&HIGH, 20, ""),
        (&HIGH, 50, ""),
        (&WIDE, 50, "_wide"),
        (&HIGH, 100, ""),
        (&BOTH, 5, "_both"),
        (&BOTH, 8, "_both"),
        (&BOTH, 20, "_both"),
        (&BOTH, 50, "_both"),
        (&BOTH, 100, "_both"),
        (&FITTED, 8, "_fitted"),
        (&FITTED, 50, "_fitted"),
        (&FITTED_HIGH, 8, "_fitted_high"),
        (&FITTED_HIGH, 20, "_fitted_high"),
        (&FITTED_HIGH, 50, "_fitted_high"),
        (&FITTED_HIGH, 100, "_fitted_high"),
    ] {
        let (total, longest_call, calls) = solve_instructions(of, relays);
        hprintln!("solved_{}{} {}", relays, suffix, total);
        hprintln!("portion_{}{} {}", relays, suffix, longest_call);
        hprintln!("portions_{}{} {}", relays, suffix, calls);
    }
    hprintln!("size_of_solver {}", size_of::<Solver<100, 10>>());
}
