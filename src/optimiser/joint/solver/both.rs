//! Joint method for both directions: initial chains, interior-point method, and Algorithm 1 at the end.
//!
//! From a cross-section of each relay Algorithm 1 finds the best x of all relays for both directions, which is a global optimum
//! along the line. The interior-point method ([`interior`](crate::optimiser::joint::interior)) then moves all coordinates to the
//! nearest local optimum, and Algorithm 1 at the new cross-sections gives the target that the relays will agree on, with their
//! separation. The best chain is kept.
//!
//! The first chain is that of the common altitude, which is compared only: the result is not below that of Algorithm 1. The other
//! five were chosen from 216 one after another, by the number of 3 840 random scenes in which the best result so far misses the
//! optimum. They are given from the end with more power on, whose signal may pass the interferer in one hop; relays away from the
//! interferer or high are mostly better than relays close to it, since the method finds its way down but not around.

use super::chain::{Seat, SolverContext};
use super::judge::JUDGED;
use super::passes::end_after;
use crate::mission::Interferer;
use crate::optimiser::joint::interior::Interior;
use crate::optimiser::joint::site::{Cell, Cells, Room};
use crate::optimiser::joint::starts::Seek;
use crate::optimiser::pass::{Behind, Link};
use crate::optimiser::search::Infeasible;
use crate::optimiser::spacing::RequiredPosition;
use crate::place::{CrossSection, Placement, Station};
use core::task::Poll;

/// Relays of one portion of Algorithm 1, and of one that sets positions.
const LINE: u16 = 2;
const PUT: u16 = 20;

/// Share of even spacing in initial positions, which separates relays that share one. Also their margin to the
/// limits. At a start, and for a repetition.
const OFF: [f32; 2] = [0.02, 0.002];

/// Initial chain, from the end with more power to the other one.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Start {
    /// Lateral offset away from the interferer, as a fraction of the permitted one. At the first, the middle and the
    /// last relay.
    aside: [f32; 3],
    /// Altitude of the first and the last relay, as a fraction of the band.
    up: [f32; 2],
    /// Ends of even spacing, in units of D; `None` for the x of Algorithm 1.
    even: Option<[f32; 2]>,
}

const STARTS: [Start; 5] = [
    Start {
        aside: [0.96, 0.96, 0.96],
        up: [0.96, 0.96],
        even: None,
    },
    Start {
        aside: [0.9, 0.45, 0.0],
        up: [0.96, 0.04],
        even: None,
    },
    Start {
        aside: [0.96, 0.96, 0.96],
        up: [0.96, 0.04],
        even: Some([0.5, 1.0]),
    },
    Start {
        aside: [0.0, 0.9, 0.0],
        up: [0.96, 0.04],
        even: Some([0.0, 1.0]),
    },
    Start {
        aside: [0.9, 0.45, 0.0],
        up: [0.04, 0.96],
        even: Some([0.0, 0.5]),
    },
];

impl Start {
    /// Returns the cross-section in `room` of the relay at `share` of the chain, 0 to 1.
    fn cross_section(self, interferer: &Interferer, share: f32, room: Room) -> CrossSection {
        let Room { lateral, band } = room;
        let ([near, middle, far], [first, last]) = (self.aside, self.up);
        let bent = 2.0 * share - 1.0;
        let aside = middle
            + bent
                * if bent < 0.0 {
                    middle - near
                } else {
                    far - middle
                };
        let away_m = if interferer.y_m > 0.0 {
            lateral.least_m
        } else {
            lateral.most_m
        };
        room.nearest(CrossSection {
            y_m: aside * away_m,
            altitude_m: band.least_m + (first + share * (last - first)) * band.span_m(),
        })
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

#[repr(u8)] // so that the bytes of `Begin` are 0
#[derive(Clone, Copy, Debug)]
enum Work {
    /// Cross-sections of a start, after this relay.
    Begin(u16),
    /// Search for the target at the current cross-sections.
    Seek(Seek, Purpose),
    /// Positions for this target.
    Settle(f32),
    /// First positions of the interior-point method, after this relay.
    Put(u16),
    Interior,
}

/// Current relay of a pass of Algorithm 1 for one target.
#[derive(Clone, Copy, Debug)]
struct Pass {
    /// Next relay, from 0 on, and true on the way back.
    index: u16,
    is_back: bool,
    /// Reach of the relay before, or required position of the relay, m.
    x_m: f32,
    end_m: f32,
}

impl Pass {
    const NONE: Self = Self {
        index: 0,
        is_back: false,
        x_m: 0.0,
        end_m: 0.0,
    };
}

/// Solver of a chain with a way back.
#[derive(Clone, Debug)]
pub(super) struct Both<const RELAYS: usize, const SEGMENTS: usize> {
    pub(super) interior: Interior<RELAYS, SEGMENTS>,
    /// Best target found, in ln(SIR), and its lateral offsets and altitudes.
    best: Option<f32>,
    best_cells: Cells<RELAYS>,
    work: Work,
    pass: Pass,
    /// Result of the interior-point method, in ln(SIR), and number of its repetitions from this start.
    reached: f32,
    again: u8,
    /// Number of the current start; 0 is the common altitude.
    number: u8,
}

impl<const RELAYS: usize, const SEGMENTS: usize> Both<RELAYS, SEGMENTS> {
    /// State before the first portion. All its bytes are 0, so it takes no flash.
    pub(super) const NEW: Self = Self {
        interior: Interior::NEW,
        best: None,
        best_cells: Cells::NEW,
        work: Work::Begin(0),
        pass: Pass::NONE,
        reached: 0.0,
        again: 0,
        number: 0,
    };

    /// Processes one portion. It is two relays of Algorithm 1, ten of a step, or twenty of a merit.
    pub(super) fn step(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
    ) -> Poll<Result<f32, Infeasible>> {
        let next = match self.work {
            Work::Begin(done) => self.begin_start(chain, done),
            Work::Put(done) => self.begin_interior(chain, done),
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
                    Some(()) => Work::Put(0),
                    None => self.next_start(),
                }
            }
            Work::Interior => {
                let Poll::Ready(sigma) = self.interior.step(chain) else {
                    return Poll::Pending;
                };
                self.reached = sigma;
                Work::Seek(
                    Seek::down(sigma + ABOVE, ABOVE, 3.0, JUDGED),
                    Purpose::Result,
                )
            }
        };
        if let Work::Begin(0) = next
            && usize::from(self.number) > STARTS.len()
            && self.best.is_none()
        {
            return Poll::Ready(Err(Infeasible));
        }
        self.work = next;
        Poll::Pending
    }

    fn next_start(&mut self) -> Work {
        self.number += 1;
        self.again = 0;
        Work::Begin(0)
    }

    /// Begins the next start, or the last search after all of them. The first `done` relays have their cross-sections.
    fn begin_start(&mut self, chain: &SolverContext<'_, impl Fn(u16) -> Seat>, done: u16) -> Work {
        let Some(start) = self.start() else {
            self.interior.cells = self.best_cells;
            let sigma = self.best.unwrap_or_default();
            return Work::Seek(Seek::up(sigma, true, 1e-5, 1e-6), Purpose::Last);
        };
        let config = chain.mission.config();
        let relays = chain.mission.relays();
        let end = (done + PUT).min(relays);
        let after = end + 1;
        for index in done + 1..after {
            let share = if relays > 1 {
                f32::from(index - 1) / f32::from(relays - 1)
            } else {
                0.5
            };
            let share = if is_turned(chain) { 1.0 - share } else { share };
            let room = (chain.seat_of)(index).room;
            let at = if self.number > 0 {
                start.cross_section(chain.interferer, share, room)
            } else {
                room.nearest(config.common.on_line().cross_section)
            };
            self.interior.cells.set(index, Cell::of(at, room));
        }
        if end < relays {
            Work::Begin(end)
        } else if start.even.is_some() {
            Work::Put(0)
        } else {
            // The common altitude is compared, so its target is as exact as those of results.
            let width = if self.number > 0 { 0.02 } else { JUDGED };
            Work::Seek(Seek::down(chain.ceiling(), 0.5, 1.5, width), Purpose::Start)
        }
    }

    /// Returns the current start; the first one for the common altitude. `None` after the last one.
    fn start(&self) -> Option<Start> {
        let at = usize::from(self.number).saturating_sub(1);
        STARTS.get(at).copied()
    }

    /// Keeps the current positions if they are the best, and returns the next step of the work. If Algorithm 1 has
    /// found new positions, that is the interior-point method from there.
    fn found(&mut self, sigma: f32, purpose: Purpose) -> Work {
        if self.best.is_none_or(|best| sigma > best) {
            self.best = Some(sigma);
            self.best_cells = self.interior.cells;
        }
        let is_new = match purpose {
            Purpose::Start => self.number > 0,
            Purpose::Result => sigma > self.reached + NEW && self.again < AGAIN,
            Purpose::Last => false,
        };
        if is_new {
            self.again += 1;
            Work::Settle(sigma)
        } else {
            self.next_start()
        }
    }

    /// Starts the interior-point method at the cells, with x of a pass or evenly spaced. The first `done` relays are
    /// there.
    fn begin_interior(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        done: u16,
    ) -> Work {
        let distance_m = chain.distance_m();
        let relays = chain.mission.relays();
        let even = self.start().and_then(|start| start.even);
        let even = even.filter(|_| self.again == 0);
        let is_again = self.again > 1;
        let [far, close] = OFF;
        let off = if is_again { close } else { far };
        let end = (done + PUT).min(relays);
        let after = end + 1;
        for index in done + 1..after {
            let room = (chain.seat_of)(index).room;
            let place = self.interior.cells.get(index).place(room).at(0.0);
            let share = f32::from(index) / f32::from(relays + 1);
            let turned = |x: f32| if is_turned(chain) { 1.0 - x } else { x };
            let x_m = if let Some([first, last]) = even {
                turned(first + turned(share) * (last - first)) * distance_m
            } else {
                let [x_m, _] = self.interior.noted(index);
                x_m + off * (share * distance_m - x_m)
            };
            self.interior
                .put(chain, index, Placement { x_m, ..place }, off);
        }
        if end < relays {
            return Work::Put(end);
        }
        self.interior.start(chain, is_again);
        Work::Interior
    }

    /// Continues Algorithm 1 for `sigma`. Ready with `Some` if all relays have positions; their x is noted.
    fn line(
        &mut self,
        chain: &SolverContext<'_, impl Fn(u16) -> Seat>,
        sigma: f32,
    ) -> Poll<Option<()>> {
        let mut pass = self.pass;
        let target = libm::expf(sigma);
        if pass.index == 0 && !pass.is_back {
            pass.end_m = self.interior.cells.end_m(chain.mission, chain.seat_of, 0);
        }
        for _ in 0..LINE {
            let met = if pass.is_back {
                self.line_back(chain, target, &mut pass)
            } else {
                self.line_there(chain, target, &mut pass)
            };
            let over = pass.is_back && pass.index == 0;
            if over || met.is_none() {
                self.pass = Pass::NONE;
                return Poll::Ready(met);
            }
        }
        self.pass = pass;
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
        let step = self
            .interior
            .cells
            .least_step(chain.mission, chain.seat_of, index);
        pass.end_m = end_after(chain.mission, pass.end_m, step);
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
        self.interior.note(index, [x_m, pass.end_m]);
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
        let [_, end_m] = self.interior.noted(pass.index);
        let before = pass.index.saturating_sub(1);
        let [reach, before_m] = self.interior.noted(before);
        let link = self.line_link(chain, pass.index, end_m);
        pass.x_m = match link.required_position(target, reach, pass.x_m)? {
            RequiredPosition::AtReach => reach,
            RequiredPosition::At(x_m) => x_m,
        };
        pass.index = before;
        self.interior.note(before, [pass.x_m, before_m]);
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
                cross_section: self.interior.cells.get(index).place(seat.room),
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

/// Returns true if Rx has more power than Tx.
fn is_turned(chain: &SolverContext<'_, impl Fn(u16) -> Seat>) -> bool {
    let config = chain.mission.config();
    config.rx_power_w > config.tx_power_w
}

/// Gain of Algorithm 1, in ln(SIR), above which the interior-point method is repeated. Then the number of
/// repetitions.
const NEW: f32 = 3e-4;
const AGAIN: u8 = 4;

/// Distance of the first target above the interior-point method's, in ln gamma: its m mu.
const ABOVE: f32 = 1e-4;
