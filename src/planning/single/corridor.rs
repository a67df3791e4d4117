//! One relay with lateral freedom and noise: search of the corridor at one altitude, if the touching position is outside.
//!
//! Without noise no position inside the rectangle can then be optimal. With noise there may be a second position at which two
//! level lines touch from within, on the other side of the interferer's line; near Y = 0 it is almost the mirror image of the
//! first. There is no proof of their number, so the plane is searched. Each line along x is solved exactly, by `edge`. The best
//! line is searched on lines that are closer near y = 0, and by golden section about the three best.

use super::Found;
use super::edge::{Edge, EdgeCoordinate, TwoHops};
use crate::mission::{Band, Interferer};
use crate::place::Placement;

/// Number of lines on either side of y = 0.
const LINES: u8 = 24;

/// Number of the best lines that are refined.
const FOLLOWED: usize = 3;

/// Golden-section steps about each.
const STEPS: u8 = 32;

const GOLDEN: f32 = 0.618_034;

/// Returns the best position at `altitude_m` in `along` by `across`. Work: at most 145 lines of some 90 evaluations.
pub(super) fn best(
    hops: &TwoHops<'_>,
    interferer: &Interferer,
    along: Band,
    across: Band,
    altitude_m: f32,
) -> Found {
    let line = |y_m: f32| {
        let through = Placement {
            x_m: 0.0,
            y_m,
            altitude_m,
        };
        let free = EdgeCoordinate::Along;
        let room = along;
        Edge {
            free,
            through,
            room,
        }
        .best(hops, interferer)
    };
    let mut best = line(0.0);
    // The best three, and the lines beside each.
    let mut followed = [(0.0_f32, 0.0_f32, 0.0_f32); FOLLOWED];
    for end in [across.least_m, across.most_m] {
        let at = |step: u8| {
            let part = f32::from(step) / f32::from(LINES);
            end * (part * part * part)
        };
        let (mut before, mut here) = (0.0, best.sir.max(line(0.0).sir));
        for step in 1..=LINES {
            let found = line(at(step));
            let after = found.sir;
            best = best.or(found);
            if here >= before && here >= after {
                keep(&mut followed, (here, at(step.saturating_sub(2)), at(step)));
            }
            (before, here) = (here, after);
        }
        keep(&mut followed, (here, at(LINES - 1), end));
    }
    for (sir, low, high) in followed {
        if !(sir > 0.0) {
            continue;
        }
        let (mut low, mut high) = (low, high);
        for _ in 0..STEPS {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            let (one, other) = (line(a), line(b));
            best = best.or(one).or(other);
            if one.sir > other.sir {
                high = b;
            } else {
                low = a;
            }
        }
    }
    best
}

/// Inserts `new` into the best lines, best first.
fn keep(followed: &mut [(f32, f32, f32); FOLLOWED], new: (f32, f32, f32)) {
    let mut new = new;
    for slot in followed {
        if new.0 > slot.0 {
            core::mem::swap(slot, &mut new);
        }
    }
}
