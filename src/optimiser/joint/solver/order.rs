//! The order of the starts, and the shape that a chain begins with.

use core::task::Poll;

use super::chain::{SolverContext, far_off};
use super::judge::{CEILING, JUDGED};
use super::seat::Seat;
use super::state::Solver;
use super::work::{Purpose, Work};
use crate::optimiser::joint::ascent::Ascent;
use crate::optimiser::joint::cells::Cell;
use crate::optimiser::joint::room::Room;
use crate::optimiser::joint::seek::Seek;
use crate::optimiser::joint::site::MARGIN;
use crate::optimiser::joint::starts::Start;
use crate::optimiser::search::Infeasible;
use crate::place::CrossSection;

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// The next start, or the end.
    pub(super) fn begin(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
    ) -> Poll<Result<f32, Infeasible>> {
        let next = Start::number(self.number, Room::of(chain.mission));
        let complete = !self.again && self.is_complete(chain.ceiling());
        let Some(start) = next.filter(|_| !complete) else {
            // All have been tried, or the others are no use.
            let Some((_, number)) = self.best else {
                return Poll::Ready(Err(Infeasible));
            };
            (self.number, self.again) = (number, true);
            if let Some(sigma) = self.best_judged {
                self.cells = self.best_cells;
                self.restart();
                self.work = self.judged(sigma, chain.ceiling());
            }
            return Poll::Pending;
        };
        let Some(start) = start else {
            self.number += 1;
            return Poll::Pending;
        };
        let floor = chain.floor();
        if matches!(start, Start::Near)
            && !self.again
            && self.best.is_some_and(|(best, _)| best > floor)
        {
            self.number += 1;
            return Poll::Pending;
        }
        if matches!(start, Start::Through { .. } | Start::Turns) && !self.walled {
            self.number += 1;
            return Poll::Pending;
        }
        if matches!(start, Start::Held { .. }) && !chain.holds() {
            self.number += 1;
            return Poll::Pending;
        }
        self.start = start;
        self.ascent = Ascent::new(chain.distance_m(), 0.0, 0.0, 0.0);
        (self.judged_at, self.is_whole) = (None, true);
        self.restart();
        self.work = match start {
            Start::Near => Work::Settle(floor + 0.04, Purpose::Start),
            Start::Turns => {
                for index in 1..=chain.mission.relays() {
                    let room = (chain.seat_of)(index).room;
                    let apart_m = MARGIN * chain.mission.config().min_separation_m;
                    let at = Start::in_turn(index, chain.interferer, room, apart_m);
                    self.keep(index, 0.0, Cell::of(at, room));
                }
                let sigma = chain.ceiling() + 2.0 * CEILING;
                Work::Seek(Seek::down(sigma, 0.1, 1.5, JUDGED), Purpose::Last)
            }
            Start::Arch { .. }
            | Start::Around { .. }
            | Start::Far
            | Start::Through { .. }
            | Start::Held { .. } => {
                Work::Seek(Seek::down(chain.ceiling(), 0.5, 1.5, 0.02), Purpose::Start)
            }
        };
        Poll::Pending
    }

    /// Nothing came of the start.
    pub(super) fn given_up(&mut self) -> Work {
        self.number += 1;
        Work::Begin
    }

    /// Where relay `index` is wanted on a pass that changes nothing, or gives the chain its first shape.
    pub(super) fn shaped(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        index: u16,
        room: Room,
        target: f32,
        purpose: Purpose,
    ) -> CrossSection {
        if purpose != Purpose::Start {
            return self.cell(index).place(room);
        }
        let wanted = match self.start {
            Start::Far => {
                let top = far_off(chain, room);
                let relays = f32::from(chain.mission.relays().saturating_sub(1).max(1));
                let down = f32::from(index - 1) / relays;
                CrossSection {
                    y_m: top.y_m * (1.0 - down),
                    altitude_m: top.altitude_m + down * (room.band.least_m - top.altitude_m),
                }
            }
            start @ Start::Around { .. } => {
                let c = chain.loudness(index, self.pass.from, target);
                start.around(
                    chain.distance_m(),
                    chain.interferer,
                    self.pass.from,
                    c,
                    room,
                )
            }
            start @ Start::Held { level, .. } => CrossSection {
                altitude_m: chain.altitude_between(index, level),
                ..start.across(chain.distance_m(), self.pass.from.x_m, room)
            },
            start => start.across(chain.distance_m(), self.pass.from.x_m, room),
        };
        Cell::of(wanted, room).place(room)
    }
}
