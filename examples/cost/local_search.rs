//! Cost of one relay's local search, and of a measurement.

use core::hint::black_box;
use cortex_m_semihosting::hprintln;
use uav_relay::field::estimate::Estimator;
use uav_relay::optimiser::local::HopEnd;
use uav_relay::optimiser::local::Hops;
use uav_relay::optimiser::local::LocalSearch;
use uav_relay::{Local, Placement};

use super::counter::instructions;
use super::missions::{HIGH, INTERFERER};

/// Measures the instructions for one relay's local search (Algorithm 2) and interference estimate.
#[inline(never)] // keeps its relays off the stack of other measurements
pub(crate) fn local_search() {
    let place = Placement::on_line;
    let beside = |place| HopEnd {
        place,
        apart_m: 4.0,
        power_w: 1.0,
    };
    let (before, after) = (place(250.0, 100.0), place(320.0, 110.0));
    let hops = Hops::new(
        &HIGH,
        &INTERFERER,
        Some(beside(before)),
        1.0,
        Some(beside(after)),
    );
    let hops = black_box(hops);
    let at = black_box(place(280.0, 104.0));
    hprintln!(
        "evaluation {}",
        instructions(|| black_box(&hops).worse(black_box(at)))
    );
    let mut search = LocalSearch::new(Local::Fine, hops, at, 10.0, (20.0, 300.0));
    let (mut all, mut is_finished) = (0, false);
    while !is_finished {
        all += instructions(|| is_finished = search.step(240).is_ready());
    }
    hprintln!("search {}", all);
    hprintln!("size_of_search {}", size_of::<LocalSearch>());
    let mut estimator = Estimator::new(1e-6);
    let mut push = 0;
    for at in 1..=1000_u16 {
        let power_w = black_box(1e-9 * f32::from(at));
        push = push.max(instructions(|| estimator.push(power_w)));
    }
    hprintln!("sample {}", push);
    hprintln!("estimate {}", instructions(|| estimator.estimate()));
}
