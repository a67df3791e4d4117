//! The pass back, which works out the policies, and the pass forward, which tries them.

use super::chain::SolverContext;
use super::seat::Seat;
use super::segment::{SEGMENT, SEGMENT_RELAYS, Stage, last_of, relays_of};
use super::state::Solver;
use super::work::{ForwardPass, Work};
use crate::mission::Mission;
use crate::optimiser::joint::ascent::AscentStep;
use crate::optimiser::joint::axis::{Triple, minus, triple};
use crate::optimiser::joint::cells::Cell;
use crate::optimiser::joint::outlook::Outlook;
use crate::optimiser::joint::policy::Brief;
use crate::place::Placement;

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    pub(super) fn look_back(&mut self, mission: &Mission) -> Work {
        self.ascent.look_back();
        Work::Back(last_of(mission))
    }

    /// Works out the policies of `segment`, whose relays come after one at `before`; what that one sees. Bounded by ten relays.
    pub(super) fn recall(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        before: Placement,
    ) -> Option<Outlook> {
        let target = libm::expf(self.ascent.sigma);
        let relays = chain.mission.relays();
        let mut places = [before; SEGMENT];
        let mut from = before;
        for (k, index) in relays_of(segment, relays) {
            let room = (chain.seat_of)(index).room;
            let wanted = self.cell(index).place(room);
            let to = self
                .link(chain, index, from, room)
                .at(target, from.x_m, wanted)?;
            *places.get_mut(k)? = from;
            self.stages.get_mut(k)?.x_m = to.x_m;
            from = to;
        }
        let is_last = (usize::from(segment) + 1) * SEGMENT >= usize::from(relays);
        let mut outlook = if is_last {
            let (slack, outlook) = chain.tail(target, from);
            if slack > self.ascent.spare_m() {
                Outlook::default()
            } else {
                outlook
            }
        } else {
            self.marks.get(usize::from(segment))?.outlook()
        };
        let mut to = from;
        for (k, index) in relays_of(segment, relays).rev() {
            let from = *places.get(k)?;
            let room = (chain.seat_of)(index).room;
            let link = self.link(chain, index, from, room);
            let policy = link.weigh(target, self.ascent.trust, from, to, &mut outlook);
            self.stages.get_mut(k)?.policy = Brief::of(&policy);
            to = from;
        }
        self.held = Some(segment);
        Some(outlook)
    }

    pub(super) fn back(&mut self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>, segment: u8) {
        let before = self.nominal_before(chain, segment);
        let Some(outlook) = self.recall(chain, segment, before) else {
            self.work = self.next(AscentStep::Over, chain);
            return;
        };
        self.ascent.add(&outlook);
        self.work = if let Some(next) = segment.checked_sub(1) {
            if let Some(mark) = self.marks.get_mut(usize::from(next)) {
                mark.look(&outlook);
            }
            Work::Back(next)
        } else {
            let turn = self.ascent.weighed();
            if self.is_dropped(turn) {
                self.given_up()
            } else {
                self.next(turn, chain)
            }
        };
    }

    /// Where the relay before `segment` is.
    pub(super) fn nominal_before(
        &self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
    ) -> Placement {
        let index = u16::from(segment) * SEGMENT_RELAYS;
        if index == 0 {
            return Placement::default();
        }
        let x_m = self
            .marks
            .get(usize::from(segment))
            .map_or(0.0, |mark| mark.x_m);
        self.at(index, (chain.seat_of)(index)).at(x_m)
    }

    /// One segment more of a pass with the policies, or what is needed for it.
    pub(super) fn forward(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        share: f32,
        sigma: f32,
        kept: bool,
    ) {
        let relays = chain.mission.relays();
        let target = libm::expf(sigma);
        if self.pass.done >= relays {
            let (slack, _) = chain.tail(target, self.pass.from);
            let slack = slack.min(self.ascent.spare_m()) - self.pass.penalty;
            let turn = if kept {
                self.ascent.penalty = self.pass.penalty;
                self.held = None;
                self.ascent.taken(share, sigma, slack)
            } else if self.ascent.is_gain(sigma, slack) {
                self.restart();
                self.work = Work::Forward(share, sigma, true);
                return;
            } else {
                self.ascent.failed()
            };
            self.work = self.next(turn, chain);
            return;
        }
        let segment = u8::try_from(usize::from(self.pass.done) / SEGMENT).unwrap_or(u8::MAX);
        if self.held != Some(segment) {
            if self.recall(chain, segment, self.pass.old).is_none() {
                self.work = self.next(AscentStep::Over, chain);
            }
            return;
        }
        if self.follow(chain, segment, target, share, kept).is_none() {
            // Only of a trial: what is kept has been tried.
            let turn = self.ascent.failed();
            self.work = self.next(turn, chain);
        }
    }

    /// The relays of `segment` take `share` of their steps.
    pub(super) fn follow(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        segment: u8,
        target: f32,
        share: f32,
        kept: bool,
    ) -> Option<()> {
        for (k, index) in relays_of(segment, chain.mission.relays()) {
            let ForwardPass { from, old, .. } = self.pass;
            let Seat { room, .. } = (chain.seat_of)(index);
            let Stage { x_m, policy } = *self.stages.get(k)?;
            let policy = policy.policy();
            let nominal = self.cell(index).place(room).at(x_m);
            let change: Triple = minus(triple(from), triple(old));
            let link = self.link(chain, index, from, room);
            let wanted = link.wanted(target, from, nominal, &policy, share, change);
            let cell = Cell::of(link.at(target, from.x_m, wanted)?.cross_section(), room);
            let place = link.at(target, from.x_m, cell.place(room))?;
            if kept {
                self.keep(index, from.x_m, cell);
            }
            self.pass = ForwardPass {
                done: index,
                from: place,
                old: nominal,
                penalty: self.pass.penalty + link.penalty(target, place),
                ..self.pass
            };
        }
        Some(())
    }
}
