//! The chain by the rules of the sweep: where relays may stand, and where they have to hold back.

use super::chain::SolverContext;
use super::seat::Seat;
use super::segment::{SEGMENT, SEGMENT_RELAYS, relays_of};
use super::state::Solver;
use crate::mission::Mission;
use crate::optimiser::spacing::{Hop, Stand};
use crate::place::CrossSection;

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// The hop to relay `index` of the chain as it is, by the rules of the sweep; no farther than `end_m`.
    pub(super) fn hop(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        index: u16,
        end_m: f32,
    ) -> Hop {
        let at = |index| self.at(index, (chain.seat_of)(index));
        let before = if index > 1 {
            at(index - 1)
        } else {
            CrossSection::default()
        };
        let sender = chain.sender(index, before.at(0.0));
        Hop::new(
            chain.mission,
            chain.interferer,
            sender,
            index,
            at(index),
            0.0,
        )
        .ending(end_m)
    }

    /// The least step along x between relay `index` and the one before it, which keep their separation.
    pub(super) fn least_step(
        &self,
        mission: &Mission,
        seat_of: &impl Fn(u16) -> Seat,
        index: u16,
    ) -> f32 {
        if index <= 1 {
            return 0.0;
        }
        let at = |index| self.at(index, seat_of(index));
        let across = at(index).apart_squared(at(index - 1));
        mission.step_with_room(across)
    }

    /// The last place along x that leaves the relays after `index` of a solved chain their room, m: to the bit what the passes
    /// by the rules of the sweep go by.
    pub fn end_m(&self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat, index: u16) -> f32 {
        let steps = (1..=mission.relays()).map(|at| self.least_step(mission, seat_of, at));
        let first = mission.config().distance_m - steps.clone().sum::<f32>();
        steps
            .take(index.into())
            .fold(first, |end_m, step| Self::end_after(mission, end_m, step))
    }

    pub(super) fn end_after(mission: &Mission, end_m: f32, step: f32) -> f32 {
        (end_m + step).min(mission.config().distance_m)
    }

    /// Where the relay before `segment` is to stand.
    pub(super) fn stands(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        mut place_m: f32,
        target: f32,
    ) -> Option<f32> {
        let relays = chain.mission.relays();
        let [mut x_m, ..] = self.marks.get(usize::from(segment))?.slope;
        let mut end_m = self.end_m(
            chain.mission,
            chain.seat_of,
            u16::from(segment) * SEGMENT_RELAYS,
        );
        let mut before = [(0.0, 0.0); SEGMENT];
        for (k, index) in relays_of(segment, relays) {
            let step = self.least_step(chain.mission, chain.seat_of, index);
            end_m = Self::end_after(chain.mission, end_m, step);
            *before.get_mut(k)? = (x_m, end_m);
            x_m = self.hop(chain, index, end_m).outermost(target, x_m)?;
        }
        for (k, index) in relays_of(segment, relays).rev() {
            let (from_m, end_m) = *before.get(k)?;
            place_m = match self
                .hop(chain, index, end_m)
                .stand(target, from_m, place_m)?
            {
                Stand::AtReach => from_m,
                Stand::At(x_m) => x_m,
            };
        }
        Some(place_m)
    }
}
