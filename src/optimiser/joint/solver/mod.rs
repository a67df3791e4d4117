//! Solver of a whole chain by the joint method, from the mission alone and without messages.
//!
//! Differential dynamic programming stores a policy for every relay between the backward and the forward pass. To need only six
//! bytes per relay, the chain is cut into segments: only the value function at the end of each is stored, and the policies of a
//! segment are computed again in the forward pass.
//!
//! A start is dropped as soon as it will end no higher than the best one, or has diverged. The remaining starts are skipped once
//! a chain meets the ceiling of its first or last hop.
//!
//! | file | content |
//! | --- | --- |
//! | `passes` | the backward and the forward pass of an ascent, a pass without changes, and the sweep's rules |
//! | `judge` | the steps after a target is found: the next start, or the polish |
//! | `both` | the joint method with a way back |
//! | `chain` | data shared by the passes; a segment of the chain; the profile of one relay |
//!
//! This file has the state of a solver, its current work and its purpose, and one portion of its work.

mod both;
mod chain;
mod judge;
mod passes;

use crate::mission::Mission;
use crate::optimiser::joint::ascent::Ascent;
use crate::optimiser::joint::site::Cell;
use crate::optimiser::joint::starts::{Seek, Start};
use crate::optimiser::search::Infeasible;
use crate::place::{CrossSection, Placement};
use chain::{Mark, SEGMENT, STAGES, SolverContext, Stage};
use core::task::Poll;

pub use both::Workspace;
pub use chain::Seat;

#[derive(Clone, Copy, Debug, Default)]
struct ForwardPass {
    /// Relays that the pass has completed.
    done: u16,
    /// New position of the last relay computed in this pass.
    from: Placement,
    /// Position of that relay before this pass.
    old: Placement,
    penalty: f32,
    end_m: f32,
    holds_back: bool,
}

#[derive(Clone, Copy, Debug)]
enum Work {
    /// Begin the next start.
    Begin,
    /// Search for the highest feasible target of the unchanged chain.
    Seek(Seek, Purpose),
    /// Compute the chain for one target, and store it.
    Settle(f32, Purpose),
    /// Check that relays can hold back: segment, required x of its last relay, m, and the search.
    HoldBack(u8, f32, Seek, Purpose),
    /// Try the next move of the polish; the chain meets this target.
    Polish(f32),
    /// Backward pass at this segment.
    Back(u8),
    /// Forward pass with a fraction of the step and a target; stored if `true`.
    Forward(f32, f32, bool),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Purpose {
    /// Initial chain with the shape of the start.
    Start,
    /// Higher target during an ascent.
    Raise,
    /// New computation of the slack after its cap was lowered.
    Tighten,
    /// Result of an ascent.
    Judge,
    /// Result of an ascent by the sweep's rules.
    Last,
    /// Check of the ceiling, by the sweep's rules.
    Probe,
    /// Check of one relay's move, by the sweep's rules.
    Move,
}

impl Purpose {
    /// Returns true if the pass uses the sweep's rules.
    const fn is_sweep(self) -> bool {
        matches!(self, Self::Last | Self::Probe | Self::Move)
    }
}

/// Solver of a chain of at most `RELAYS` relays; `SEGMENTS` is at least a tenth of that.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is told on its own, by another part of the work"
)]
#[derive(Clone, Debug)]
pub struct Solver<const RELAYS: usize, const SEGMENTS: usize> {
    number: u8,
    start: Start,
    /// Best target found, in ln gamma, and the number of its start.
    best: Option<(f32, u8)>,
    /// Result of the best start's ascent before it was judged, in ln gamma.
    highest: f32,
    /// Cells of the best start, and the target at which it was judged, in ln gamma. `None` if a repetition of it would give
    /// another chain: it was judged before its ascent ended, or without an ascent.
    best_cells: [Cell; RELAYS],
    best_judged: Option<f32>,
    /// Target at which the current start was judged, in ln gamma.
    judged_at: Option<f32>,
    /// True while the current ascent has not been affected by the comparison with the best start.
    is_whole: bool,
    /// True once the best start is judged more finely, and polished.
    again: bool,
    ascent: Ascent,
    work: Work,
    pass: ForwardPass,
    /// True if relays have to hold back for the target found.
    holds_back: bool,
    /// True if any start was limited by the minimum separation.
    walled: bool,
    /// Current move of the polish, number of accepted moves, and the cell of the relay before the move.
    moving: u16,
    moved: u8,
    kept: Cell,
    /// Segment whose policies are in memory.
    loaded_segment: Option<u8>,
    stages: [Stage; STAGES],
    marks: [Mark; SEGMENTS],
    cells: [Cell; RELAYS],
    /// True until the first portion with a way back.
    is_new: bool,
}

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Creates a solver. `None` in a field, for more than `RELAYS` relays, or without the feature `altitude`.
    pub fn new(mission: &Mission) -> Option<Self> {
        let fits = usize::from(mission.relays()) <= RELAYS.min(STAGES * SEGMENTS);
        (fits && mission.interferer().is_some()).then(|| Self {
            number: 0,
            start: Start::Far,
            best: None,
            highest: f32::NEG_INFINITY,
            best_cells: [Cell::default(); RELAYS],
            best_judged: None,
            judged_at: None,
            is_whole: true,
            again: false,
            ascent: Ascent::new(1.0, 0.0, 0.0, 0.0),
            work: Work::Begin,
            pass: ForwardPass::default(),
            holds_back: false,
            walled: false,
            moving: 0,
            moved: 0,
            kept: Cell::default(),
            loaded_segment: None,
            stages: [Stage::default(); STAGES],
            marks: [Mark::default(); SEGMENTS],
            cells: [Cell::default(); RELAYS],
            is_new: true,
        })
    }

    /// Returns the cross-section of relay `index`, once the chain is solved.
    pub fn at(&self, index: u16, seat: Seat) -> CrossSection {
        self.cell(index).place(seat.room)
    }

    #[inline(never)] // called from many places
    fn cell(&self, index: u16) -> Cell {
        let at = usize::from(index).wrapping_sub(1);
        self.cells.get(at).copied().unwrap_or_default()
    }

    /// Processes one portion of the work: ten relays backward and forward, or twenty without a change.
    ///
    /// Ready with the target, a linear SIR, once the chain is solved. `seat_of` returns the profile of relay 1..=N, and must be
    /// constant.
    ///
    /// # Errors
    /// [`Infeasible`] if no target can be met.
    pub fn step(
        &mut self,
        mission: &Mission,
        seat_of: impl Fn(u16) -> Seat,
        space: &mut Workspace<RELAYS, SEGMENTS>,
    ) -> Poll<Result<f32, Infeasible>> {
        let Some(interferer) = mission.interferer() else {
            return Poll::Ready(Err(Infeasible));
        };
        let chain = SolverContext {
            mission,
            interferer,
            seat_of: &seat_of,
            gain: mission.relay_gain(mission.config().common.power_w),
        };
        if mission.reverse() > 0.0 {
            self.holds_back = true;
            return match space.both.first_mut() {
                Some(both) => self.step_both_ways(both, &chain),
                None => Poll::Ready(Err(Infeasible)),
            };
        }
        match self.work {
            Work::Begin => self.begin(&chain),
            Work::Seek(seek, purpose) => self.seek(&chain, seek, purpose),
            Work::Settle(sigma, purpose) => self.settle(&chain, sigma, purpose),
            Work::HoldBack(segment, place_m, seek, purpose) => {
                self.try_hold_back(&chain, segment, place_m, seek, purpose)
            }
            Work::Polish(sigma) => self.polish(&chain, sigma),
            Work::Back(segment) => {
                self.back(&chain, segment);
                Poll::Pending
            }
            Work::Forward(share, sigma, kept) => {
                self.forward(&chain, share, sigma, kept);
                Poll::Pending
            }
        }
    }

    fn restart(&mut self) {
        self.pass = ForwardPass::default();
    }

    /// Stores the cross-section `cell` of relay `index`; at a segment's start, also the x before it, `x_m`.
    #[inline(never)] // called from several places
    fn keep(&mut self, index: u16, x_m: f32, cell: Cell) {
        if let Some(mark) = self.mark(index) {
            mark.x_m = x_m;
        }
        let at = usize::from(index).wrapping_sub(1);
        if let Some(kept) = self.cells.get_mut(at) {
            *kept = cell;
        }
    }

    /// Returns the mark before relay `index` if that is the first of its segment.
    fn mark(&mut self, index: u16) -> Option<&mut Mark> {
        let at = usize::from(index).wrapping_sub(1);
        self.marks
            .get_mut(at / SEGMENT)
            .filter(|_| at.is_multiple_of(SEGMENT))
    }

    /// Returns true if relays have to hold back for the target found.
    pub const fn holds_back(&self) -> bool {
        self.holds_back
    }
}

/// Stored cells of the best start against those of a repetition of that start.
#[cfg(all(test, feature = "altitude"))]
#[expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a test"
)]
mod tests {
    use core::task::Poll;

    use super::{Seat, Solver, Workspace};
    use crate::channel::{AirGround, Channel};
    use crate::mission::{Band, Interference, Interferer, Mission, MissionConfig, Profile};

    /// Uniform random numbers in 0..1: Knuth's MMIX generator.
    struct Rng(u64);

    impl Rng {
        fn next(&mut self) -> f32 {
            self.0 = (self.0)
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / 16_777_216.0
        }

        fn between(&mut self, least: f32, most: f32) -> f32 {
            least + self.next() * (most - least)
        }
    }

    /// Returns a random mission, and the fixed altitudes of some of its relays.
    fn random(rng: &mut Rng) -> (Mission, [Option<f32>; 50]) {
        let relays = [1, 2, 3, 5, 8, 13, 21, 50][(rng.next() * 8.0) as usize];
        let least_m = rng.between(10.0, 60.0);
        let side = if rng.next() < 0.5 {
            0.0
        } else {
            rng.between(20.0, 300.0)
        };
        let most_m = if side > 0.0 && rng.next() < 0.2 {
            least_m
        } else {
            rng.between(80.0, 300.0)
        };
        let channel = Channel::new(2e9, 1.023_293, 125.892_54, AirGround::Los).expect("in range");
        let mission = Mission::try_new(MissionConfig {
            relays,
            distance_m: rng.between(400.0, 4000.0),
            min_separation_m: rng.between(1.0, 12.0),
            tx_power_w: rng.between(1.0, 100.0),
            common: Profile {
                altitude_m: least_m,
                power_w: 1.0,
            },
            channel,
            band: Band { least_m, most_m },
            lateral: Band {
                least_m: -side,
                most_m: side,
            },
            interference: Interference::Source(Interferer {
                power_w: rng.between(5.0, 100.0),
                x_m: rng.between(-500.0, 4000.0),
                y_m: rng.between(10.0, 900.0),
            }),
            noise_w: 0.0,
            reverse: 0.0,
            rx_power_w: 80.0,
            tolerance: 1e-4,
        });
        let holds = rng.next() < 0.3;
        let held =
            [(); 50].map(|()| (holds && rng.next() < 0.3).then(|| rng.between(least_m, most_m)));
        (mission.expect("in range"), held)
    }

    /// Returns the target and the positions, in bits, and the number of portions.
    fn solved(
        mission: &Mission,
        held: &[Option<f32>; 50],
        once_more: bool,
    ) -> ([[u32; 2]; 51], u32) {
        let common = Seat::common(mission);
        let seat = |index: u16| match held[usize::from(index) - 1] {
            Some(altitude_m) => Seat {
                room: common.room.at_altitude(altitude_m),
                ..common
            },
            None => common,
        };
        let mut solver = Solver::<50, 5>::new(mission).expect("it fits");
        let mut portions = 1;
        let target = loop {
            if once_more {
                solver.best_judged = None;
            }
            if let Poll::Ready(target) = solver.step(mission, seat, &mut Workspace::new()) {
                break target.unwrap_or(-1.0);
            }
            portions += 1;
        };
        let mut bits = [[0; 2]; 51];
        bits[0][0] = target.to_bits();
        for index in 1..=mission.relays() {
            let at = solver.at(index, seat(index));
            bits[usize::from(index)] = [at.y_m.to_bits(), at.altitude_m.to_bits()];
        }
        (bits, portions)
    }

    /// Random missions; their number is `UAV_RELAY_KEPT`, 150 by default.
    #[test]
    fn what_is_kept_of_the_best_start_is_what_it_comes_to_once_more() {
        extern crate std;
        let count =
            std::env::var("UAV_RELAY_KEPT").map_or(150, |count| count.parse().expect("a number"));
        let mut rng = Rng(28);
        let (mut kept, mut again, mut fewer) = (0_u64, 0_u64, 0);
        for number in 0..count {
            let (mission, held) = random(&mut rng);
            let (once, portions) = solved(&mission, &held, false);
            let (twice, more) = solved(&mission, &held, true);
            assert_eq!(once, twice, "mission {number}: {mission:?}");
            assert!(portions <= more, "mission {number}");
            kept += u64::from(portions);
            again += u64::from(more);
            fewer += u32::from(portions < more);
        }
        std::println!(
            "{kept} portions, {again} with the best start done once more; fewer in {fewer} of {count}"
        );
        assert!(fewer * 2 > count);
    }
}
