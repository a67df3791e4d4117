//! Backward pass, which computes the policies, and forward pass, which tries them.
//!
//! A plain pass changes nothing, or gives an initial chain its shape.

use super::{ForwardPass, OneWay, Purpose, Work};
use crate::mission::Mission;
use crate::optimiser::joint::ascent::AscentStep;
use crate::optimiser::joint::chain::{
    Chain, SEGMENT, SEGMENT_RELAYS, Seat, SeatOf, Stage, last_of, relays_of,
};
use crate::optimiser::joint::hop::{Triple, minus, triple};
use crate::optimiser::joint::outlook::{Brief, Outlook};
use crate::optimiser::joint::site::{Cell, Room, Site};
use crate::optimiser::joint::starts::Start;
use crate::place::Placement;
use core::task::Poll;

impl<const RELAYS: usize, const SEGMENTS: usize> OneWay<RELAYS, SEGMENTS> {
    pub(super) fn look_back(&mut self, mission: &Mission) -> Work {
        self.ascent.look_back();
        Work::Back(last_of(mission))
    }

    /// Computes the policies (moves) of the relays in `segment`. Returns the value function of the last relay before
    /// the segment; `before` is the position of that relay.
    ///
    /// `None` if a hop cannot meet the target. Work: at most ten relays.
    pub(super) fn recall(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        segment: u8,
        before: Placement,
    ) -> Option<Outlook> {
        let target = libm::expf(self.ascent.sigma);
        let relays = chain.relays();
        let mut places = [before; SEGMENT];
        let mut from = before;
        for (k, index) in relays_of(segment, relays) {
            let room = chain.room(index);
            let wanted = self.cells.get(index).place(room);
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
            let room = chain.room(index);
            let link = self.link(chain, index, from, room);
            let policy = link.weigh(target, self.ascent.trust, from, to, &mut outlook);
            self.stages.get_mut(k)?.policy = Brief::of(&policy);
            to = from;
        }
        self.loaded_segment = Some(segment);
        Some(outlook)
    }

    pub(super) fn back(&mut self, chain: &Chain<'_, impl SeatOf>, segment: u8) {
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

    /// Returns the position of the last relay before `segment` in the current chain.
    pub(super) fn nominal_before(&self, chain: &Chain<'_, impl SeatOf>, segment: u8) -> Placement {
        let index = u16::from(segment) * SEGMENT_RELAYS;
        if index == 0 {
            return Placement::default();
        }
        let x_m = self
            .marks
            .get(usize::from(segment))
            .map_or(0.0, |mark| mark.x_m);
        let room = chain.room(index);
        self.cells.get(index).place(room).at(x_m)
    }

    /// Continues the forward pass by one segment (ten relays). If the moves of these relays are not in memory, the call
    /// computes only the moves, and the next call continues. The pass tries the fraction `share` of the moves with the
    /// target `sigma`, in ln(SIR). The chain is stored if `kept` is true.
    pub(super) fn forward(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        share: f32,
        sigma: f32,
        kept: bool,
    ) {
        let relays = chain.relays();
        let target = libm::expf(sigma);
        if self.pass.done >= relays {
            let (slack, _) = chain.tail(target, self.pass.from);
            let slack = slack.min(self.ascent.spare_m()) - self.pass.penalty;
            let turn = if kept {
                self.ascent.penalty = self.pass.penalty;
                self.loaded_segment = None;
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
        if self.loaded_segment != Some(segment) {
            if self.recall(chain, segment, self.pass.old).is_none() {
                self.work = self.next(AscentStep::Over, chain);
            }
            return;
        }
        if self.follow(chain, segment, target, share, kept).is_none() {
            // Only a trial can fail: steps that are stored have been tried.
            let turn = self.ascent.failed();
            self.work = self.next(turn, chain);
        }
    }

    /// Moves the relays of `segment` by the fraction `share` of their computed moves. Stores their new lateral offsets
    /// and altitudes if `kept` is true. `None` if a hop cannot meet `target`.
    pub(super) fn follow(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        segment: u8,
        target: f32,
        share: f32,
        kept: bool,
    ) -> Option<()> {
        for (k, index) in relays_of(segment, chain.relays()) {
            let ForwardPass { from, old, .. } = self.pass;
            let Seat { room, .. } = chain.seat(index);
            let Stage { x_m, policy } = *self.stages.get(k)?;
            let policy = policy.policy();
            let nominal = self.cells.get(index).place(room).at(x_m);
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
            };
        }
        Some(())
    }
}

/// Number of relays that one call handles in a pass that computes only the relays' x.
const PLAIN: u16 = 20;

/// Maximum penalty up to which a chain counts as feasible after moves of its relays. The penalty is for relays too near
/// the interferer. The unit is the distance from Tx to Rx.
const FORGIVEN: f32 = 5e-5;

impl<const RELAYS: usize, const SEGMENTS: usize> OneWay<RELAYS, SEGMENTS> {
    /// Continues a pass that computes only the relays' x, for the target `sigma` = ln(SIR). Lateral offsets and
    /// altitudes stay unchanged. Stores the chain if `kept` is true. At the end of the pass returns the chain's slack
    /// (the length by which it overshoots Rx), m, or `None` if a hop cannot meet the target.
    pub(super) fn plain(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        sigma: f32,
        purpose: Purpose,
        kept: bool,
    ) -> Poll<Option<f32>> {
        let target = libm::expf(sigma);
        let relays = chain.relays();
        for _ in 0..PLAIN {
            let index = self.pass.done + 1;
            if index > relays {
                let (slack, _) = chain.tail(target, self.pass.from);
                let penalty = self.pass.penalty;
                if purpose == Purpose::Judge && penalty > FORGIVEN * chain.distance_m() {
                    return Poll::Ready(Some(-penalty));
                }
                return Poll::Ready(Some(slack.min(self.ascent.spare_m()) - penalty));
            }
            let room = chain.room(index);
            let wanted = self.shaped(chain, index, room, target, purpose);
            let from = self.pass.from;
            let link = self.link(chain, index, from, room);
            let Some(place) = link.at(target, from.x_m, wanted) else {
                return Poll::Ready(None);
            };
            self.pass.penalty += link.penalty(target, place);
            if kept {
                self.keep(index, from.x_m, Cell::of(place.cross_section(), room));
            }
            self.pass.from = place;
            self.pass.done = index;
        }
        Poll::Pending
    }

    /// Returns relay `index` with its hop from a relay at `from`. Initial chains of the kind [`Start::Through`] have no
    /// minimum separation.
    pub(super) fn link<'a>(
        &self,
        chain: &Chain<'a, impl SeatOf>,
        index: u16,
        from: Placement,
        room: Room,
    ) -> Site<'a> {
        let mut link = chain.link(index, from, room);
        if let Start::Through { .. } = self.start {
            link.apart_m = 0.0;
        }
        link
    }
}
