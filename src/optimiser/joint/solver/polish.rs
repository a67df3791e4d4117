//! The polish: one relay after the other tries another place, where the derivatives see none.

use core::task::Poll;

use super::chain::SolverContext;
use super::seat::Seat;
use super::state::Solver;
use super::work::{Purpose, Work};
use crate::mission::Mission;
use crate::optimiser::joint::cells::Cell;
use crate::optimiser::joint::seek::Seek;
use crate::optimiser::search::Infeasible;

/// Most relays of a chain that is polished, but where some keep to an altitude: the way of the others has kinks there.
const POLISHED: u16 = 5;

/// How often the moves of a polish are halved, and the first of them, as a part of the room.
const HALVINGS: u16 = 12;
const FIRST_MOVE: f32 = 0.25;

/// What a move has to gain, in ln gamma, and how many are taken.
pub(super) const GAIN: f32 = 2e-5;
const MOVES: u8 = 200;

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Whose move is tried, which of four ways, and how often it is halved.
    pub(super) fn move_of(&self, mission: &Mission) -> (u16, u16, u16) {
        // A mission has relays; the compiler does not know that.
        let relays = mission.relays().max(1);
        let tried = self.moving / 6;
        (tried % relays + 1, self.moving % 6, tried / relays)
    }

    /// Tries the next move of a chain that is polished and meets `sigma`: each alone by a part of its room, and by less and less. What
    /// the derivatives do not see, since something else binds there, it may.
    pub(super) fn polish(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        sigma: f32,
    ) -> Poll<Result<f32, Infeasible>> {
        let (index, way, halved) = self.move_of(chain.mission);
        let polished = chain.mission.relays() <= POLISHED || chain.holds();
        if !polished || halved > HALVINGS || self.moved >= MOVES {
            return Poll::Ready(Ok(libm::expf(sigma)));
        }
        let room = (chain.seat_of)(index).room;
        self.kept = self.cell(index);
        let part = FIRST_MOVE
            * libm::ldexpf(1.0, -i32::from(halved))
            * if way % 2 > 0 { 1.0 } else { -1.0 };
        let mut at = self.kept.place(room);
        if way < 2 {
            at.altitude_m += part * room.band.span_m();
        } else {
            at.y_m += part * room.lateral.span_m();
        }
        let mut moved = Cell::of(at, room);
        if way > 3 {
            let other = if way == 4 {
                index + 2
            } else {
                index.saturating_sub(2)
            };
            if other < 1 || other > chain.mission.relays() {
                self.moving += 1;
                return Poll::Pending;
            }
            moved = Cell::of(self.cell(other).place((chain.seat_of)(other).room), room);
        }
        if moved == self.kept {
            self.moving += 1;
            return Poll::Pending;
        }
        self.keep(index, 0.0, moved);
        self.work = Work::Seek(Seek::down(sigma + GAIN, GAIN, 1.0, GAIN), Purpose::Move);
        Poll::Pending
    }
}
