//! State of a solver, and its work in portions.

use core::task::Poll;

use super::chain::Seat;
use super::chain::SolverContext;
use super::chain::{Mark, SEGMENT, STAGES, Stage};
use super::work::{ForwardPass, Work};
use crate::mission::Mission;
use crate::optimiser::joint::ascent::Ascent;
use crate::optimiser::joint::site::Cell;
use crate::optimiser::joint::starts::Start;
use crate::optimiser::search::Infeasible;
use crate::place::CrossSection;

/// Solver of a chain of at most `RELAYS` relays; `SEGMENTS` is at least a tenth of that.
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is told on its own, by another part of the work"
)]
#[derive(Clone, Debug)]
pub struct Solver<const RELAYS: usize, const SEGMENTS: usize> {
    pub(super) number: u8,
    pub(super) start: Start,
    /// Best target so far, in ln gamma, and the number of its start.
    pub(super) best: Option<(f32, u8)>,
    /// Result of that start's ascent before it was judged, in ln gamma.
    pub(super) highest: f32,
    /// Cells of that start, and the target at which it was judged, in ln gamma. `None` if a repetition of the start would give
    /// another chain: it was judged before its ascent ended, or without an ascent.
    pub(super) best_cells: [Cell; RELAYS],
    pub(super) best_judged: Option<f32>,
    /// Target at which the current start was judged, in ln gamma.
    pub(super) judged_at: Option<f32>,
    /// True while the current ascent is the same as without a best start to compare it with.
    pub(super) is_whole: bool,
    /// True once the best start is judged more finely, and polished.
    pub(super) again: bool,
    pub(super) ascent: Ascent,
    pub(super) work: Work,
    pub(super) pass: ForwardPass,
    /// True if relays have to hold back for the target found.
    pub(super) holds_back: bool,
    /// True if any start was limited by the minimum separation.
    pub(super) walled: bool,
    /// Current move of the polish, number of accepted moves, and the cell of the relay before the move.
    pub(super) moving: u16,
    pub(super) moved: u8,
    pub(super) kept: Cell,
    /// Segment whose policies are in memory.
    pub(super) held: Option<u8>,
    pub(super) stages: [Stage; STAGES],
    pub(super) marks: [Mark; SEGMENTS],
    pub(super) cells: [Cell; RELAYS],
}

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Creates a solver; `None` in a field, for more than `RELAYS` relays, or without the feature `altitude`.
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
            held: None,
            stages: [Stage::default(); STAGES],
            marks: [Mark::default(); SEGMENTS],
            cells: [Cell::default(); RELAYS],
        })
    }

    /// Returns the cross-section of relay `index`, once the chain is solved.
    pub fn at(&self, index: u16, seat: Seat) -> CrossSection {
        self.cell(index).place(seat.room)
    }

    #[inline(never)] // called from many places
    pub(super) fn cell(&self, index: u16) -> Cell {
        let at = usize::from(index).wrapping_sub(1);
        self.cells.get(at).copied().unwrap_or_default()
    }

    /// Does one portion of the work: ten relays backward and forward, or twenty without a change.
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
        match self.work {
            Work::Begin => self.begin(&chain),
            Work::Seek(seek, purpose) => self.seek(&chain, seek, purpose),
            Work::Settle(sigma, purpose) => self.settle(&chain, sigma, purpose),
            Work::Stand(segment, place_m, seek, purpose) => {
                self.stand(&chain, segment, place_m, seek, purpose)
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

    pub(super) fn restart(&mut self) {
        self.pass = ForwardPass::default();
    }

    /// Stores the `cell` of relay `index`, which comes after one at `x_m`.
    #[inline(never)] // called from several places
    pub(super) fn keep(&mut self, index: u16, x_m: f32, cell: Cell) {
        if let Some(mark) = self.mark(index) {
            mark.x_m = x_m;
        }
        let at = usize::from(index).wrapping_sub(1);
        if let Some(kept) = self.cells.get_mut(at) {
            *kept = cell;
        }
    }

    /// Returns the mark before relay `index` if that is the first of its segment.
    pub(super) fn mark(&mut self, index: u16) -> Option<&mut Mark> {
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
