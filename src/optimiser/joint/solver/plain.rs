//! A pass that changes nothing, or gives a chain its first shape.

use core::task::Poll;

use super::chain::SolverContext;
use super::seat::Seat;
use super::state::Solver;
use super::work::Purpose;
use crate::optimiser::joint::cells::Cell;
use crate::optimiser::joint::outlook::Outlook;
use crate::optimiser::joint::room::Room;
use crate::optimiser::joint::site::Site;
use crate::optimiser::joint::starts::Start;
use crate::place::Placement;
use crate::root::sqrt;

/// Relays in one portion of a pass that changes nothing.
const PLAIN: u16 = 20;

/// What penalty a chain may have that is judged, in parts of D.
const FORGIVEN: f32 = 5e-5;

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Goes on with a pass for `sigma`; ready with the slack at its end, `None` if a hop cannot meet the target.
    pub(super) fn plain(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        sigma: f32,
        purpose: Purpose,
        kept: bool,
    ) -> Poll<Option<f32>> {
        let target = libm::expf(sigma);
        let relays = chain.mission.relays();
        if purpose.is_sweep() && self.pass.done == 0 {
            self.pass.end_m = self.end_m(chain.mission, chain.seat_of, 0);
        }
        for _ in 0..PLAIN {
            let index = self.pass.done + 1;
            if index > relays {
                if purpose.is_sweep() {
                    let power_w = (chain.seat_of)(relays).power_w;
                    let reach_m = sqrt(chain.mission.receiver_gain(power_w) / target);
                    let (slack, _) = Outlook::tail(reach_m, chain.distance_m(), self.pass.from);
                    return Poll::Ready(Some(slack));
                }
                let (slack, _) = chain.tail(target, self.pass.from);
                let penalty = self.pass.penalty;
                if purpose == Purpose::Judge && penalty > FORGIVEN * chain.distance_m() {
                    return Poll::Ready(Some(-penalty));
                }
                return Poll::Ready(Some(slack.min(self.ascent.spare_m()) - penalty));
            }
            let room = (chain.seat_of)(index).room;
            let wanted = self.shaped(chain, index, room, target, purpose);
            let from = self.pass.from;
            let place = if purpose.is_sweep() {
                let step = self.least_step(chain.mission, chain.seat_of, index);
                self.pass.end_m = Self::end_after(chain.mission, self.pass.end_m, step);
                if let Some(mark) = self.mark(index) {
                    // From one pass back to the next nobody sees anything, and there is room.
                    mark.slope = [from.x_m, 0.0, 0.0];
                }
                let hop = self.hop(chain, index, self.pass.end_m);
                let reach = hop.reach(target, from.x_m);
                self.pass.holds_back |= reach.is_none();
                reach
                    .or_else(|| hop.outermost(target, from.x_m))
                    .map(|x_m| wanted.at(x_m))
            } else {
                let link = self.link(chain, index, from, room);
                link.at(target, from.x_m, wanted).inspect(|at| {
                    self.pass.penalty += link.penalty(target, *at);
                })
            };
            let Some(place) = place else {
                return Poll::Ready(None);
            };
            if kept {
                self.keep(index, from.x_m, Cell::of(place.cross_section(), room));
            }
            self.pass.from = place;
            self.pass.done = index;
        }
        Poll::Pending
    }

    /// Relay `index`, fed from `from`, as the start has it.
    pub(super) fn link<'a>(
        &self,
        chain: &SolverContext<'a, impl Fn(u16) -> Seat>,
        index: u16,
        from: Placement,
        room: Room,
    ) -> Site<'a> {
        let link = chain.link(index, from, room);
        match self.start {
            Start::Through { .. } => link.unparted(),
            _ => link,
        }
    }
}
