//! Solver of a whole chain by the joint method, from the mission alone and without messages.
//!
//! Differential dynamic programming stores a policy for every relay between the backward and the forward pass. To need
//! only six bytes per relay, the chain is cut into segments. Only the value function at the end of each segment is
//! stored, and the policies of a segment are computed again in the forward pass.
//!
//! An initial chain is dropped as soon as it will end no higher than the best one, or has diverged. The remaining
//! initial chains are skipped once a chain meets the maximum SIR of its first or last hop.
//!
//! | file | content |
//! | --- | --- |
//! | `passes` | the backward and the forward pass of an ascent, and a pass without changes |
//! | `line` | Algorithm 1 for the stored lateral offsets and altitudes, exactly as the relays compute it in flight |
//! | `judge` | the steps after a target is found: the next initial chain, or the polish |
//! | `both` | the solver for both directions |
//!
//! This file has the states of the solvers, the current work for one direction and its purpose, and one portion of the work.

mod both;
mod judge;
mod passes;

use crate::features::{ALTITUDE, REVERSE};
use crate::mission::Mission;
use crate::optimiser::joint::ascent::Ascent;
use crate::optimiser::joint::chain::{Chain, Mark, SEGMENT, STAGES, Seat, SeatOf, Stage};
use crate::optimiser::joint::fitted::{Fitted, SlotShares};
use crate::optimiser::joint::site::{Cell, Cells};
use crate::optimiser::joint::starts::{Seek, Start};
use crate::optimiser::search::Infeasible;
use crate::place::{CrossSection, Placement};
use core::task::Poll;

use crate::optimiser::joint::line::Line;
use both::Both;

#[derive(Clone, Copy, Debug)]
struct ForwardPass {
    /// Number of relays that the forward pass, from Tx to Rx, has moved.
    done: u16,
    /// Position of the last moved relay after its move.
    from: Placement,
    /// Position of the last moved relay before its move.
    old: Placement,
    penalty: f32,
}

impl ForwardPass {
    const NONE: Self = Self {
        done: 0,
        from: Placement::on_line(0.0, 0.0),
        old: Placement::on_line(0.0, 0.0),
        penalty: 0.0,
    };
}

#[repr(u8)] // so that the bytes of `Begin` are 0
#[derive(Clone, Copy, Debug)]
enum Work {
    /// Begin the next initial chain.
    Begin,
    /// Search for the highest target SIR that the chain meets at its lateral offsets and altitudes.
    Seek(Seek, Purpose),
    /// Compute the chain for one target, as ln(SIR), and store it.
    Settle(f32, Purpose),
    /// Try the next move of one relay. The field is the highest target that the chain met before this move, in ln(SIR).
    Polish(f32),
    /// Run the backward pass, which computes the relays' moves, for one segment (ten relays). The field is the
    /// segment's number.
    Back(u8),
    /// Run the forward pass, which moves the relays. The fields are the fraction of the computed moves, the target in
    /// ln(SIR), and a flag: true to store the chain, false for a trial.
    Forward(f32, f32, bool),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Purpose {
    /// Search for the highest target SIR of an initial chain, before its relays are moved.
    Start,
    /// Search for the highest target of the current chain at unchanged lateral offsets and altitudes.
    Raise,
    /// Computation of the chain's slack, after the upper limit on the slack was lowered. The slack is the length by
    /// which the chain reaches beyond Rx. Slack above the limit does not count.
    Tighten,
    /// Search for the highest target of a chain after its improvement. Hops are computed as in the improvement, not
    /// exactly as in flight.
    Judge,
    /// Search for the highest target of a chain after its improvement. Hops are computed exactly as in flight.
    Last,
    /// Check if the chain reaches the upper bound on the SIR of all chains. Hops are computed exactly as in flight.
    Probe,
    /// Check of a trial move of one relay, with the hops computed exactly as in flight.
    Move,
}

impl Purpose {
    /// Returns true if hops are computed exactly as the relays compute them in flight, from messages.
    ///
    /// A relay is then allowed to stay closer to Tx than the largest x at which the hop to it meets the target.
    const fn is_sweep(self) -> bool {
        matches!(self, Self::Last | Self::Probe | Self::Move)
    }
}

/// Joint solver of a chain that carries data in one direction only, from Tx to Rx.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is told on its own, by another part of the work"
)]
#[derive(Clone, Debug)]
struct OneWay<const RELAYS: usize, const SEGMENTS: usize> {
    number: u8,
    start: Start,
    /// Best target SIR found, in ln(SIR), and the number of the initial chain that led to it.
    best: Option<(f32, u8)>,
    /// Highest target that any chain has reached by moves of its relays, in ln(SIR). The improvement of a chain stops
    /// once it is predicted to end below this target.
    highest: f32,
    best_cells: Cells<RELAYS>,
    /// Target at which the improvement of the best chain ended, in ln(SIR). The final search for the highest target of
    /// this chain starts at this value.
    best_judged: Option<f32>,
    /// Target at which the current chain's improvement ended, in ln(SIR). `None` while the improvement runs, or if it
    /// was stopped early.
    judged_at: Option<f32>,
    /// True unless the current chain's improvement was stopped early, because the chain was not promising.
    is_whole: bool,
    /// True in the last phase: finer search of the best chain's target, and trial moves of single relays.
    again: bool,
    ascent: Ascent,
    work: Work,
    pass: ForwardPass,
    line: Line,
    /// x of each relay, and the upper limit of this x, m. Used only while hops are computed exactly as in flight.
    notes: [[f32; 2]; RELAYS],
    /// True if some relays have to stay closer to Tx than their farthest x to meet the target found. The farthest x is
    /// the largest x at which the hop to the relay meets the target.
    holds_back: bool,
    /// True if the improvement of some chain ended with a penalty for too little separation of relays.
    walled: bool,
    /// Number of the next trial move of a single relay; see [`OneWay::move_of`]. Single relays are moved after the
    /// search over the initial chains.
    moving: u16,
    /// Number of accepted trial moves of single relays, after the search over the initial chains.
    moved: u8,
    /// Lateral offset and altitude of a relay before its current trial move.
    kept: Cell,
    /// Number of the segment (ten relays) whose computed moves are in memory; `None` if there is none.
    loaded_segment: Option<u8>,
    stages: [Stage; STAGES],
    marks: [Mark; SEGMENTS],
    cells: Cells<RELAYS>,
}

impl<const RELAYS: usize, const SEGMENTS: usize> OneWay<RELAYS, SEGMENTS> {
    /// State of the solver before the first call of `step`. All its bytes are 0, so that it needs no flash memory.
    const NEW: Self = Self {
        number: 0,
        start: Start::Arch {
            aside: 0.0,
            up: 0.0,
        },
        best: None,
        highest: 0.0,
        best_cells: Cells::NEW,
        best_judged: None,
        judged_at: None,
        is_whole: false,
        again: false,
        ascent: Ascent::NONE,
        work: Work::Begin,
        pass: ForwardPass::NONE,
        line: Line::NEW,
        notes: [[0.0; 2]; RELAYS],
        holds_back: false,
        walled: false,
        moving: 0,
        moved: 0,
        kept: Cell::NONE,
        loaded_segment: None,
        stages: [Stage::NONE; STAGES],
        marks: [Mark::NONE; SEGMENTS],
        cells: Cells::NEW,
    };

    fn step(&mut self, chain: &Chain<'_, impl SeatOf>) -> Poll<Result<f32, Infeasible>> {
        match self.work {
            Work::Begin => self.begin(chain),
            Work::Seek(seek, purpose) => self.seek(chain, seek, purpose),
            Work::Settle(sigma, purpose) => self.settle(chain, sigma, purpose),
            Work::Polish(sigma) => self.polish(chain, sigma),
            Work::Back(segment) => {
                self.back(chain, segment);
                Poll::Pending
            }
            Work::Forward(share, sigma, kept) => {
                self.forward(chain, share, sigma, kept);
                Poll::Pending
            }
        }
    }

    fn restart(&mut self) {
        self.pass = ForwardPass::NONE;
    }

    /// Stores the lateral offset and altitude `cell` of relay `index`. If the relay is the first of a segment, the
    /// function also stores `x_m`, the x of relay `index` - 1, m.
    #[inline(never)] // called from several places
    fn keep(&mut self, index: u16, x_m: f32, cell: Cell) {
        if let Some(mark) = self.mark(index) {
            mark.x_m = x_m;
        }
        self.cells.set(index, cell);
    }

    /// Returns the stored state of the segment whose first relay is `index`. `None` if no segment begins there.
    fn mark(&mut self, index: u16) -> Option<&mut Mark> {
        let at = usize::from(index).wrapping_sub(1);
        self.marks
            .get_mut(at / SEGMENT)
            .filter(|_| at.is_multiple_of(SEGMENT))
    }
}

/// Number of solvers for data in both directions: 1 with the features `altitude` and `reverse`, else 0.
const BOTH: usize = (ALTITUDE && REVERSE) as usize;

/// Number of solvers for fitted slots: 1 with the feature `altitude`, else 0. A fitted slot is as long as its hop
/// needs.
const FITTED: usize = ALTITUDE as usize;

/// Joint solver of a chain: for data in one direction or in both directions, or for fitted slots.
///
/// A mission needs only one of the three, so they share their memory.
#[cfg_attr(
    feature = "altitude",
    expect(
        clippy::large_enum_variant,
        reason = "a relay has a single value of this type, and this crate does not allocate"
    )
)]
#[repr(u8)]
#[derive(Clone, Debug)]
enum Way<const RELAYS: usize, const SEGMENTS: usize> {
    OneWay(OneWay<RELAYS, SEGMENTS>),
    Both([Both<RELAYS, SEGMENTS>; BOTH]),
    Fitted([Fitted<RELAYS>; FITTED]),
}

/// Joint solver of a chain of at most `RELAYS` relays, for data in one direction or in both directions.
///
/// `SEGMENTS` is at least a tenth of `RELAYS`, since a segment has ten relays.
#[derive(Clone, Debug)]
pub struct Solver<const RELAYS: usize, const SEGMENTS: usize>(Way<RELAYS, SEGMENTS>);

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Initial state of the solver, before [`Solver::begin`] prepares it for a mission.
    pub(crate) const NEW: Self = Self(Way::OneWay(OneWay::NEW));

    /// Creates a joint solver. `None` for an interference field, for more than `RELAYS` relays, or without the feature
    /// `altitude`.
    pub fn new(mission: &Mission) -> Option<Self> {
        let mut solver = Self::NEW;
        solver.begin(mission).then_some(solver)
    }

    /// Prepares the solver for the directions of `mission`. Returns false for an interference field, or for too many
    /// relays.
    #[inline(never)] // it may build the state on the stack first
    pub(crate) fn begin(&mut self, mission: &Mission) -> bool {
        if mission.fitted_gap() > 0.0 {
            self.0 = Way::Fitted([const { Fitted::NEW }; FITTED]);
        } else if mission.reverse() > 0.0 {
            self.0 = Way::Both([const { Both::NEW }; BOTH]);
        }
        let fits = usize::from(mission.relays()) <= RELAYS.min(STAGES * SEGMENTS);
        fits && mission.interferer().is_some()
    }

    fn cells(&self) -> Option<&Cells<RELAYS>> {
        match &self.0 {
            Way::OneWay(solver) => Some(&solver.cells),
            Way::Both(solver) => solver.first().map(|both| &both.interior.cells),
            Way::Fitted(_) => None,
        }
    }

    /// Returns the lateral offset and altitude of relay `index`. The chain must be solved. `seat` is that relay's
    /// profile.
    pub fn at(&self, index: u16, seat: Seat) -> CrossSection {
        let cell = self.cells().map(|cells| cells.get(index));
        cell.unwrap_or_default().place(seat.room)
    }

    /// Returns the largest x of relay `index`, m. It leaves the relays toward Rx space for their separation.
    ///
    /// The chain must be solved. The limit is equal, to the bit, to the limit that the solver used.
    pub fn end_m(&self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat, index: u16) -> f32 {
        let chain = Chain::new(mission, seat_of);
        let solved = chain.zip(self.cells());
        solved.map_or(0.0, |(chain, cells)| cells.end_m(&chain, index))
    }

    /// Returns true if some relays have to stay closer to Tx than their farthest x, for the target found. The farthest
    /// x is the largest x at which the hop to the relay meets the target.
    pub const fn holds_back(&self) -> bool {
        match &self.0 {
            Way::OneWay(solver) => solver.holds_back,
            Way::Both(_) => true,
            Way::Fitted(_) => false,
        }
    }

    /// Continues to solve the chain by one bounded step. With data in one direction, a step handles ten relays of a
    /// pass that moves them, or twenty relays of any other pass. With data in both directions it handles at least two
    /// relays.
    ///
    /// Ready with the target SIR, linear, once the chain is solved. `seat_of` returns the profile of relay 1..=N, which
    /// must not change between calls.
    ///
    /// # Errors
    /// [`Infeasible`] if no target can be met.
    pub fn step(
        &mut self,
        mission: &Mission,
        seat_of: impl Fn(u16) -> Seat,
    ) -> Poll<Result<f32, Infeasible>> {
        let Some(chain) = Chain::new(mission, &seat_of) else {
            return Poll::Ready(Err(Infeasible));
        };
        let solved = match &mut self.0 {
            Way::OneWay(solver) => Some(solver.step(&chain)),
            Way::Both(solver) => solver.first_mut().map(|solver| solver.step(&chain)),
            Way::Fitted(solver) => solver.first_mut().map(|solver| solver.step(&chain)),
        };
        solved.unwrap_or(Poll::Ready(Err(Infeasible)))
    }

    /// Returns the position of relay `index` and its time slots. The chain must be solved. `None` unless the mission
    /// has fitted slots: time slots as long as each hop needs.
    pub fn fitted(
        &self,
        mission: &Mission,
        seat_of: &impl Fn(u16) -> Seat,
        index: u16,
    ) -> Option<(Placement, SlotShares)> {
        let Way::Fitted(solver) = &self.0 else {
            return None;
        };
        let chain = Chain::new(mission, seat_of)?;
        Some(solver.first()?.place(&chain, index))
    }
}

/// Checks that the stored best chain equals the best chain computed a second time.
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

    use super::{Seat, Solver, Way};
    use crate::mission::tests::paper;
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
        let mission = Mission::try_new(MissionConfig {
            distance_m: rng.between(400.0, 4000.0),
            min_separation_m: rng.between(1.0, 12.0),
            tx_power_w: rng.between(1.0, 100.0),
            common: Profile {
                altitude_m: least_m,
                power_w: 1.0,
            },
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
            ..paper(relays)
        });
        let holds = rng.next() < 0.3;
        let held =
            [(); 50].map(|()| (holds && rng.next() < 0.3).then(|| rng.between(least_m, most_m)));
        (mission.expect("in range"), held)
    }

    /// Returns the result of the solver as bits of f32 numbers, and the number of `step` calls. The first number is the
    /// target; then follow each relay's lateral offset and altitude. If `once_more` is true, the solver computes the
    /// best chain again, and does not use its stored copy.
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
            if once_more && let Way::OneWay(solver) = &mut solver.0 {
                solver.best_judged = None;
            }
            if let Poll::Ready(target) = solver.step(mission, seat) {
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

    /// Checks for random missions that the stored best chain equals one computed a second time, to the bit. The
    /// environment variable `UAV_RELAY_KEPT` sets the number of missions, 150 by default.
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
            "calls of the solver until the result: {kept} if the best chain is stored, {again} if it is computed again; storing takes fewer calls in {fewer} of {count} missions"
        );
        assert!(fewer * 2 > count);
    }
}
