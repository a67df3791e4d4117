//! Joint method with a way back: initial chains, the interior-point method, and Algorithm 1 at the found cross-sections.
//!
//! From a cross-section of each relay Algorithm 1 finds the best x of all relays for both directions, which is a global optimum
//! along the line. The interior-point method ([`interior`](crate::optimiser::joint::interior)) then moves all coordinates to the
//! nearest local optimum, and Algorithm 1 at the new cross-sections gives the target that the relays will agree on, with their
//! separation. The best chain is kept.
//!
//! The initial chains were chosen from 216 by the number of random scenes in which the best of them misses the optimum:
//!
//! | start | cross-sections | x |
//! | --- | --- | --- |
//! | `Given` | common altitude; compared only, so that the result is not below Algorithm 1's | Algorithm 1 |
//! | `Away` | highest, at the end of the room away from the interferer | Algorithm 1 |
//! | `Slope` | altitude rises, or falls, from Tx to Rx | Algorithm 1 |
//! | `Half` | lowest | even between the middle and the end with less power |
//! | `Arch` | low at the ends, high in the middle | even |
//!
//! `Half` finds chains whose first hop from a strong Tx passes the interferer.

use super::chain::{Seat, SolverContext};
use super::judge::JUDGED;
use super::Solver;
use crate::optimiser::joint::interior::Interior;
use crate::optimiser::joint::site::{Cell, Room};
use crate::optimiser::joint::starts::Seek;
use crate::optimiser::pass::{Behind, Link};
use crate::optimiser::search::Infeasible;
use crate::optimiser::spacing::RequiredPosition;
use crate::place::{CrossSection, Placement, Station};
use core::task::Poll;

/// Elements of state that exist with the feature `reverse` only.
pub(super) const BOTH: usize = if cfg!(feature = "reverse") { 1 } else { 0 };

/// Relays of one portion of Algorithm 1.
const LINE: u16 = 4;

/// Share of even spacing in initial positions, which separates relays that share one.
const EVEN: f32 = 0.02;

#[derive(Clone, Copy, PartialEq, Debug)]
enum Start {
    Given,
    Away,
    Slope { rises: bool },
    Half,
    Arch,
}

const STARTS: [Start; 6] = [
    Start::Given,
    Start::Away,
    Start::Slope { rises: true },
    Start::Slope { rises: false },
    Start::Half,
    Start::Arch,
];

impl Start {
    /// Returns the cross-section of a relay; `share` is 0 for the first and 1 for the last one.
    fn cross_section(self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>, share: f32, room: Room) -> CrossSection {
        let Room { lateral, band } = room;
        let up = |share: f32| band.least_m + share * band.span_m();
        let on_line = |altitude_m| CrossSection { y_m: 0.0, altitude_m };
        room.nearest(match self {
            Self::Given => on_line(chain.mission.config().common.altitude_m),
            Self::Away => CrossSection {
                y_m: if chain.interferer.y_m > 0.0 {
                    lateral.least_m
                } else {
                    lateral.most_m
                },
                altitude_m: band.most_m,
            },
            Self::Slope { rises: true } => on_line(up(share)),
            Self::Slope { rises: false } => on_line(up(1.0 - share)),
            Self::Half => on_line(band.least_m),
            Self::Arch => on_line(up(1.0 - (2.0 * share - 1.0).abs())),
        })
    }

    /// Returns the first and the last x of even spacing, in units of D; `None` for Algorithm 1.
    fn even(self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>) -> Option<[f32; 2]> {
        let config = chain.mission.config();
        match self {
            Self::Arch => Some([0.0, 1.0]),
            Self::Half if config.tx_power_w >= config.rx_power_w => Some([0.5, 1.0]),
            Self::Half => Some([0.0, 0.5]),
            _ => None,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Purpose {
    /// Positions of a start.
    Start,
    /// Result of the interior-point method.
    Result,
    /// Exact target of the best chain.
    Last,
}

#[derive(Clone, Copy, Debug)]
enum Work {
    Begin,
    /// Search for the target at the current cross-sections.
    Seek(Seek, Purpose),
    /// Positions for this target.
    Settle(f32),
    Interior,
}

/// Current relay of a pass of Algorithm 1 for one target.
#[derive(Clone, Copy, Debug, Default)]
struct Pass {
    /// Next relay, from 0 on, and true on the way back.
    index: u16,
    is_back: bool,
    /// Reach of the relay before, or required position of the relay, m.
    x_m: f32,
    end_m: f32,
}

/// State of the joint method with a way back.
#[derive(Clone, Debug)]
pub(super) struct Both<const RELAYS: usize, const SEGMENTS: usize> {
    interior: Interior<RELAYS, SEGMENTS>,
    work: Work,
    pass: Pass,
}

impl<const RELAYS: usize, const SEGMENTS: usize> Both<RELAYS, SEGMENTS> {
    pub(super) fn new() -> Self {
        Self {
            interior: Interior::new(),
            work: Work::Begin,
            pass: Pass::default(),
        }
    }
}

impl<const RELAYS: usize, const SEGMENTS: usize> Solver<RELAYS, SEGMENTS> {
    /// Processes one portion with a way back: four reaches, ten relays of a step, or twenty of a merit.
    pub(super) fn step_both_ways(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
    ) -> Poll<Result<f32, Infeasible>> {
        let Some(Both { work, .. }) = self.both.first() else {
            return Poll::Ready(Err(Infeasible));
        };
        let next = match *work {
            Work::Begin => self.begin_start(chain),
            Work::Seek(mut seek, purpose) => {
                let Poll::Ready(met) = self.line(chain, seek.sigma) else {
                    return Poll::Pending;
                };
                if seek.tried(met.map(|()| true)) {
                    Work::Seek(seek, purpose)
                } else {
                    match (seek.found(), purpose) {
                        (Some((sigma, _)), Purpose::Last) => {
                            return Poll::Ready(Ok(libm::expf(sigma)));
                        }
                        (Some((sigma, _)), _) => self.found(sigma, purpose),
                        (None, _) => self.next_start(),
                    }
                }
            }
            Work::Settle(sigma) => {
                let Poll::Ready(met) = self.line(chain, sigma) else {
                    return Poll::Pending;
                };
                match met {
                    Some(()) => self.begin_interior(chain, None),
                    None => self.next_start(),
                }
            }
            Work::Interior => {
                let best = self.best.map_or(f32::NEG_INFINITY, |(best, _)| best);
                let Some(both) = self.both.first_mut() else {
                    return Poll::Ready(Err(Infeasible));
                };
                let Poll::Ready(sigma) = both.interior.step(chain.mission, chain.seat_of, best) else {
                    return Poll::Pending;
                };
                for index in 1..=chain.mission.relays() {
                    let Some(both) = self.both.first() else { break };
                    let at = both.interior.cross_section(chain.mission, index);
                    self.keep(index, 0.0, Cell::of(at, (chain.seat_of)(index).room));
                }
                Work::Seek(Seek::down(sigma + ABOVE, ABOVE, 3.0, JUDGED), Purpose::Result)
            }
        };
        if let Work::Begin = next
            && usize::from(self.number) >= STARTS.len()
            && self.best.is_none()
        {
            return Poll::Ready(Err(Infeasible));
        }
        if let Some(both) = self.both.first_mut() {
            both.work = next;
        }
        Poll::Pending
    }

    fn next_start(&mut self) -> Work {
        self.number += 1;
        Work::Begin
    }

    /// Begins the next start, or the last search after all of them.
    fn begin_start(&mut self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>) -> Work {
        let Some(&start) = STARTS.get(usize::from(self.number)) else {
            self.cells = self.best_cells;
            let sigma = self.best.map_or(0.0, |(best, _)| best);
            return Work::Seek(Seek::up(sigma, true, 1e-5, 1e-6), Purpose::Last);
        };
        let relays = chain.mission.relays();
        for index in 1..=relays {
            let share = if relays > 1 {
                f32::from(index - 1) / f32::from(relays - 1)
            } else {
                0.5
            };
            let room = (chain.seat_of)(index).room;
            self.keep(index, 0.0, Cell::of(start.cross_section(chain, share, room), room));
        }
        match start.even(chain) {
            Some(ends) => self.begin_interior(chain, Some(ends)),
            None => Work::Seek(Seek::down(chain.ceiling(), 0.5, 1.5, 0.02), Purpose::Start),
        }
    }

    /// Keeps the current cells if they are the best, and returns what follows.
    fn found(&mut self, sigma: f32, purpose: Purpose) -> Work {
        if self.best.is_none_or(|(best, _)| sigma > best) {
            self.best = Some((sigma, self.number));
            self.best_cells = self.cells;
        }
        if purpose == Purpose::Start && self.number > 0 {
            Work::Settle(sigma)
        } else {
            self.next_start()
        }
    }

    /// Starts the interior-point method at the cells, with x of a pass or between `even` ends.
    fn begin_interior(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        even: Option<[f32; 2]>,
    ) -> Work {
        let distance_m = chain.distance_m();
        let relays = chain.mission.relays();
        for index in 1..=relays {
            let seat = (chain.seat_of)(index);
            let place: Placement = self.at(index, seat).at(0.0);
            let Some(both) = self.both.first_mut() else { break };
            let share = f32::from(index) / f32::from(relays + 1);
            let x_m = match even {
                Some([first, last]) => (first + share * (last - first)) * distance_m,
                None => {
                    let [x_m, _] = both.interior.noted(index);
                    x_m + EVEN * (share * distance_m - x_m)
                }
            };
            both.interior
                .put(chain.mission, seat, index, Placement { x_m, ..place });
        }
        if let Some(both) = self.both.first_mut() {
            both.interior.start(chain.mission, chain.interferer);
        }
        Work::Interior
    }

    /// Continues Algorithm 1 for `sigma`. Ready with `Some` if all relays have positions; their x is noted.
    fn line(&mut self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>, sigma: f32) -> Poll<Option<()>> {
        let Some(mut pass) = self.both.first().map(|both| both.pass) else {
            return Poll::Ready(None);
        };
        let target = libm::expf(sigma);
        if pass.index == 0 && !pass.is_back {
            pass.end_m = self.end_m(chain.mission, chain.seat_of, 0);
        }
        for _ in 0..LINE {
            let met = if pass.is_back {
                self.line_back(chain, target, &mut pass)
            } else {
                self.line_there(chain, target, &mut pass)
            };
            let over = pass.is_back && pass.index == 0;
            if over || met.is_none() {
                if let Some(both) = self.both.first_mut() {
                    both.pass = Pass::default();
                }
                return Poll::Ready(met);
            }
        }
        if let Some(both) = self.both.first_mut() {
            both.pass = pass;
        }
        Poll::Pending
    }

    /// Computes the reach of the next relay.
    fn line_there(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        target: f32,
        pass: &mut Pass,
    ) -> Option<()> {
        let index = pass.index + 1;
        let step = self.least_step(chain.mission, chain.seat_of, index);
        pass.end_m = Self::end_after(chain.mission, pass.end_m, step);
        let link = self.line_link(chain, index, pass.end_m);
        let mut x_m = link.reach(target, pass.x_m)?;
        if index >= chain.mission.relays() {
            let (slack, place) = link.ending(target, pass.x_m, x_m)?;
            if !(slack >= 0.0) {
                return None;
            }
            x_m = place;
            pass.is_back = true;
        }
        self.both.first_mut()?.interior.note(index, [x_m, pass.end_m]);
        (pass.index, pass.x_m) = (index, x_m);
        Some(())
    }

    /// Computes the position of the relay before the current one, which is at `pass.x_m`.
    fn line_back(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        target: f32,
        pass: &mut Pass,
    ) -> Option<()> {
        let both = self.both.first()?;
        let [_, end_m] = both.interior.noted(pass.index);
        let before = pass.index.saturating_sub(1);
        let [reach, before_m] = both.interior.noted(before);
        let link = self.line_link(chain, pass.index, end_m);
        pass.x_m = match link.required_position(target, reach, pass.x_m)? {
            RequiredPosition::AtReach => reach,
            RequiredPosition::At(x_m) => x_m,
        };
        pass.index = before;
        self.both.first_mut()?.interior.note(before, [pass.x_m, before_m]);
        Some(())
    }

    /// Returns relay `index` in a pass of Algorithm 1, as the relay itself will compute it.
    fn line_link<'a>(
        &self,
        chain: &SolverContext<'a, impl Fn(u16) -> Seat>,
        index: u16,
        end_m: f32,
    ) -> Link<'a> {
        let station = |index: u16| {
            let seat = (chain.seat_of)(index);
            Station {
                cross_section: self.at(index, seat),
                power_w: seat.power_w,
            }
        };
        Link {
            mission: chain.mission,
            behind: (index > 1).then(|| Behind {
                relay: station(index - 1),
                measured_per_w: None,
            }),
            index,
            own: station(index),
            measured_per_w: None,
            plain: false,
            end_m: Some(end_m),
        }
    }
}

/// Distance of the first target above the interior-point method's, in ln gamma: its m mu.
const ABOVE: f32 = 1e-4;
