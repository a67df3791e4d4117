//! Algorithm 1 for a chain with stored lateral offsets and altitudes.
//!
//! It computes the x of all relays for one target, in portions.
//!
//! The pass to Rx computes the farthest x of each relay, exactly as the relays compute it from their messages. With
//! data in one direction this is enough, unless a relay has to stay short of its farthest x. Otherwise a pass back to
//! Tx computes the x that each relay has to take, and checks that it can.

use crate::optimiser::joint::chain::{Chain, SeatOf};
use crate::optimiser::joint::outlook::Outlook;
use crate::optimiser::joint::site::Cells;
use crate::optimiser::pass::{Behind, Link};
use crate::optimiser::spacing::Hop;
use crate::place::{CrossSection, Station};
use crate::root::sqrt;
use core::task::Poll;

/// Number of relays that one call handles: for data in one direction, and for both directions.
const AT_ONCE: [u16; 2] = [20, 2];

/// Memory of Algorithm 1 for one relay: the relay's x, and the upper limit of this x, m. Algorithm 1 computes the x of
/// all relays for one target.
pub(super) trait Noted {
    fn lengths_m(&mut self) -> &mut [f32; 2];
}

impl Noted for [f32; 2] {
    fn lengths_m(&mut self) -> &mut [f32; 2] {
        self
    }
}

/// Progress of Algorithm 1 for one target SIR: a pass over the relays to Rx, then a pass back to Tx. Algorithm 1
/// computes the x of all relays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    /// Index of the relay that was computed last in the current pass over the chain. 0 before the pass to Rx, and at
    /// the end of the pass back to Tx.
    index: u16,
    /// True during the pass along the chain from Rx back to Tx.
    is_back: bool,
    /// True if data flow in both directions, or if some relay has to stay closer to Tx than its farthest x. The
    /// farthest x is the largest x at which the hop to the relay meets the target.
    holds_back: bool,
    /// x of relay `index`, m. In the pass to Rx it is the farthest x that meets the target; in the pass back it is
    /// the final x.
    x_m: f32,
    /// Upper limit of the x of relay `index`, m. It leaves the relays toward Rx space for their separation.
    end_m: f32,
}

impl Line {
    pub(super) const NEW: Self = Self {
        index: 0,
        is_back: false,
        holds_back: false,
        x_m: 0.0,
        end_m: 0.0,
    };

    /// Continues Algorithm 1 by some relays, for the target `sigma`, in ln(SIR). `Ready` with `None` if the target
    /// cannot be met. Otherwise `Ready` with true if data flow in both directions, or if some relay has to stay closer
    /// to Tx than the largest x at which its hop meets the target.
    ///
    /// `cells` has the relays' lateral offsets and altitudes; their x are written to `notes`. `closed` has the minimum
    /// distance along x of relay 1 from Rx and of the last relay from Tx, as fractions of the distance from Tx to Rx.
    pub(super) fn step<const RELAYS: usize>(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        cells: &Cells<RELAYS>,
        notes: &mut [impl Noted],
        closed: [f32; 2],
        sigma: f32,
    ) -> Poll<Option<bool>> {
        let target = libm::expf(sigma);
        let is_both_ways = chain.mission.reverse() > 0.0;
        if self.index == 0 && !self.is_back {
            self.end_m = cells.end_m(chain, 0);
            self.holds_back = is_both_ways;
        }
        let [one_way, both_ways] = AT_ONCE;
        for _ in 0..if is_both_ways { both_ways } else { one_way } {
            let met = if self.is_back {
                self.back(chain, cells, notes, target)
            } else {
                self.there(chain, cells, notes, closed, target)
            };
            if met.is_none() || self.is_back && (self.index == 0 || !self.holds_back) {
                let holds_back = self.holds_back;
                *self = Self::NEW;
                return Poll::Ready(met.map(|()| holds_back));
            }
        }
        Poll::Pending
    }

    /// Computes the farthest x at which the next relay toward Rx meets `target`. For the last relay it computes the
    /// final x. `None` if the target cannot be met.
    fn there<const RELAYS: usize>(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        cells: &Cells<RELAYS>,
        notes: &mut [impl Noted],
        closed: [f32; 2],
        target: f32,
    ) -> Option<()> {
        let [far, near] = closed;
        let distance_m = chain.distance_m();
        let (index, before_m) = (self.index + 1, self.x_m);
        self.end_m = chain.end_after(self.end_m, cells.least_step(chain, index));
        let end_m = if index == 1 {
            self.end_m.min((1.0 - far) * distance_m)
        } else {
            self.end_m
        };
        let hop = hop(chain, cells, index, end_m);
        let reach = if chain.mission.reverse() > 0.0 {
            None
        } else {
            hop.reach(target, before_m)
        };
        self.holds_back |= reach.is_none();
        self.x_m = reach.or_else(|| hop.outermost(target, before_m))?;
        if index >= chain.relays() {
            let (slack, x_m) = ending(chain, cells, target, [before_m, self.x_m], end_m)?;
            if !(slack >= 0.0 && x_m >= near * distance_m) {
                return None;
            }
            self.x_m = x_m;
            self.is_back = true;
        }
        *notes.get_mut(usize::from(self.index))?.lengths_m() = [self.x_m, end_m];
        self.index = index;
        Some(())
    }

    /// Computes the final x of relay `index` - 1, with relay `index` at `x_m`. `None` if `target` cannot be met.
    fn back<const RELAYS: usize>(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        cells: &Cells<RELAYS>,
        notes: &mut [impl Noted],
        target: f32,
    ) -> Option<()> {
        let at = |index: u16| usize::from(index).wrapping_sub(1);
        let [_, end_m] = *notes.get_mut(at(self.index))?.lengths_m();
        let before = self.index.saturating_sub(1);
        let mut tx = [0.0; 2];
        let [reach_m, _] = notes.get_mut(at(before)).map_or(&mut tx, Noted::lengths_m);
        let hop = hop(chain, cells, self.index, end_m);
        let required = hop.required_position(target, *reach_m, self.x_m)?;
        *reach_m = required.or_reach(*reach_m);
        (self.index, self.x_m) = (before, *reach_m);
        Some(())
    }
}

/// Returns the hop to relay `index`, computed exactly as this relay computes it in flight. The x of the hop's end is at
/// most `end_m`, m.
fn hop<const RELAYS: usize>(
    chain: &Chain<'_, impl SeatOf>,
    cells: &Cells<RELAYS>,
    index: u16,
    end_m: f32,
) -> Hop {
    let at = |index| cells.get(index).place(chain.room(index));
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
    .both_ways(chain.mission, chain.seat(index).power_w)
    .ending(end_m)
}

/// Returns the chain's slack, m, and the final x of the last relay, m. The slack is the length by which the chain
/// overshoots Rx. `from_m` and `reach_m` are the farthest x of the second-last relay and of the last relay, m. `end_m`
/// is the upper limit of the last relay's x.
fn ending<const RELAYS: usize>(
    chain: &Chain<'_, impl SeatOf>,
    cells: &Cells<RELAYS>,
    target: f32,
    [from_m, reach_m]: [f32; 2],
    end_m: f32,
) -> Option<(f32, f32)> {
    let (mission, index) = (chain.mission, chain.relays());
    let station = |index: u16| {
        let seat = chain.seat(index);
        Station {
            cross_section: cells.get(index).place(seat.room),
            power_w: seat.power_w,
        }
    };
    let own = station(index);
    if !(mission.reverse() > 0.0) {
        let longest_m = sqrt(mission.receiver_gain(own.power_w) / target);
        let (slack, _) =
            Outlook::tail(longest_m, chain.distance_m(), own.cross_section.at(reach_m));
        return Some((slack, reach_m));
    }
    let link = Link {
        mission,
        behind: (index > 1).then(|| Behind {
            relay: station(index - 1),
            measured_per_w: None,
        }),
        index,
        own,
        measured_per_w: None,
        plain: false,
        end_m: Some(end_m),
        fixed_m: None,
    };
    link.ending(target, from_m, reach_m)
}

impl<const RELAYS: usize> Cells<RELAYS> {
    /// Returns the minimum difference in x, m, that keeps relay `index` separated from relay `index` - 1.
    pub(super) fn least_step(&self, chain: &Chain<'_, impl SeatOf>, index: u16) -> f32 {
        if index <= 1 {
            return 0.0;
        }
        let at = |index| self.get(index).place(chain.room(index));
        let across = at(index).apart_squared(at(index - 1));
        chain.mission.step_with_room(across)
    }

    /// Returns the largest x of relay `index`, m. It leaves the relays toward Rx space for their separation.
    pub(super) fn end_m(&self, chain: &Chain<'_, impl SeatOf>, index: u16) -> f32 {
        let steps = (1..=chain.relays()).map(|at| self.least_step(chain, at));
        let first = chain.distance_m() - steps.clone().sum::<f32>();
        steps
            .take(index.into())
            .fold(first, |end_m, step| chain.end_after(end_m, step))
    }
}
