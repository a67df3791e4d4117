//! Search for the highest feasible target of a chain, and the steps that follow it.
//!
//! After the target of a chain is found, the next initial chain follows. After the last one the polish follows: single
//! relays try other positions, because the derivatives do not show every gain.

use super::{OneWay, Purpose, Work};
use crate::mission::Mission;
use crate::optimiser::joint::ascent::{Ascent, AscentStep};
use crate::optimiser::joint::chain::{Chain, SeatOf, far_off};
use crate::optimiser::joint::site::{Cell, MARGIN, Room};
use crate::optimiser::joint::starts::{Seek, Start};
use crate::optimiser::search::Infeasible;
use crate::place::CrossSection;
use core::task::Poll;

/// Precision, in ln(SIR), of the search for a chain's highest target after its improvement. The improvement moves the
/// relays of the chain.
pub(super) const JUDGED: f32 = 4e-6;

/// Tolerance of the upper bound that the first and the last hop set on the chain's SIR, in ln(SIR). The search for
/// better chains ends if a chain reaches the bound within this tolerance.
pub(super) const CEILING: f32 = 5e-5;

/// First upper limit on a chain's target, minus the upper bound on the SIR of all chains, in ln(SIR).
///
/// When the improvement of a chain reaches this limit, the search checks if the chain reaches the upper bound. If so,
/// no further initial chain is tried.
const PROBED: f32 = 3e-4;

impl<const RELAYS: usize, const SEGMENTS: usize> OneWay<RELAYS, SEGMENTS> {
    pub(super) fn seek(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        seek: Seek,
        purpose: Purpose,
    ) -> Poll<Result<f32, Infeasible>> {
        let met = if purpose.is_sweep() {
            let (cells, notes) = (&self.cells, &mut self.notes);
            self.line.step(chain, cells, notes, [0.0; 2], seek.sigma)
        } else {
            let slack = self.plain(chain, seek.sigma, purpose, false);
            slack.map(|slack| slack.is_some_and(|slack| slack >= 0.0).then_some(false))
        };
        match met {
            Poll::Ready(met) => self.tried(chain, seek, purpose, met),
            Poll::Pending => Poll::Pending,
        }
    }

    /// Records if the chain meets the tried target, and selects the next piece of work.
    ///
    /// `met` is `None` if the target is infeasible. Otherwise it is true if some relays must stay closer to Tx than
    /// their farthest x, the largest x at which the hop to the relay meets the target.
    pub(super) fn tried(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        mut seek: Seek,
        purpose: Purpose,
        met: Option<bool>,
    ) -> Poll<Result<f32, Infeasible>> {
        self.restart();
        if purpose == Purpose::Probe {
            // If the chain does not meet the ceiling, its other hops have to be shorter.
            self.work = if met.is_some() {
                self.again = true;
                let sigma = chain.ceiling() + 2.0 * CEILING;
                Work::Seek(Seek::down(sigma, 1e-5, 2.0, 1e-6), Purpose::Last)
            } else {
                let turn = self.ascent.probed();
                self.next(turn, chain)
            };
            return Poll::Pending;
        }
        if purpose == Purpose::Move {
            self.work = if let Some(holds_back) = met {
                self.moved = self.moved.saturating_add(1);
                Work::Seek(Seek::up(seek.sigma, holds_back, GAIN, 1e-6), Purpose::Last)
            } else {
                let (index, _, _) = self.move_of(chain.mission);
                self.keep(index, 0.0, self.kept);
                self.moving += 1;
                Work::Polish(seek.sigma - GAIN)
            };
            return Poll::Pending;
        }
        self.work = if seek.tried(met) {
            Work::Seek(seek, purpose)
        } else {
            match (seek.found(), purpose) {
                (Some((sigma, holds_back)), Purpose::Last) if self.again => {
                    self.holds_back = holds_back;
                    Work::Polish(sigma)
                }
                (Some((sigma, _)), Purpose::Last) => {
                    if self.best.is_none_or(|(best, _)| sigma > best) {
                        self.best = Some((sigma, self.number));
                        // Searches with the hops exactly as in flight do not change the cells.
                        self.best_cells = self.cells;
                        self.best_judged = self.judged_at;
                        // A diverged ascent has not reached its target.
                        self.highest = self.ascent.sigma.min(sigma + 3.0 * JUDGED).max(sigma);
                    }
                    self.given_up()
                }
                (Some((sigma, _)), Purpose::Raise) => {
                    Work::Settle(sigma.min(self.ascent.limit), purpose)
                }
                (Some((sigma, _)), _) => Work::Settle(sigma, purpose),
                (None, Purpose::Last) if self.again => return Poll::Ready(Err(Infeasible)),
                (None, _) => self.given_up(),
            }
        };
        Poll::Pending
    }

    pub(super) fn settle(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        sigma: f32,
        purpose: Purpose,
    ) -> Poll<Result<f32, Infeasible>> {
        let Poll::Ready(slack) = self.plain(chain, sigma, purpose, true) else {
            return Poll::Pending;
        };
        self.ascent.penalty = self.pass.penalty;
        self.restart();
        self.loaded_segment = None;
        let Some(slack) = slack else {
            self.work = self.given_up();
            return Poll::Pending;
        };
        self.work = match purpose {
            Purpose::Start => {
                let floor = match self.start {
                    Start::Near => chain.floor(),
                    _ => f32::NEG_INFINITY,
                };
                let penalty = self.ascent.penalty;
                self.ascent = Ascent::new(chain.distance_m(), sigma, slack, floor)
                    .probed_at(chain.ceiling() + PROBED);
                self.ascent.penalty = penalty;
                self.look_back(chain.mission)
            }
            Purpose::Raise => {
                let turn = self.ascent.raised(sigma, slack);
                self.next(turn, chain)
            }
            Purpose::Tighten => {
                let turn = self.ascent.tightened(slack);
                self.next(turn, chain)
            }
            Purpose::Judge | Purpose::Last | Purpose::Probe | Purpose::Move => {
                self.judged_at = Some(sigma).filter(|_| self.is_whole);
                self.judged(sigma, chain.ceiling())
            }
        };
        Poll::Pending
    }

    /// Returns the work that searches for the current chain's highest target after its improvement.
    ///
    /// Hops are computed exactly as the relays compute them from their messages. A relay is allowed to stay closer to
    /// Tx than the largest x at which its hop meets the target. `sigma` is the target at which the improvement ended,
    /// and `ceiling` the upper bound of all chains, both in ln(SIR).
    pub(super) fn judged(&self, sigma: f32, ceiling: f32) -> Work {
        let sigma = sigma.min(ceiling + CEILING);
        let seek = if self.again {
            Seek::down(sigma + 2e-5, 1e-5, 2.0, 1e-6)
        } else {
            Seek::down(sigma + JUDGED, JUDGED, 3.0, JUDGED)
        };
        Work::Seek(seek, Purpose::Last)
    }

    /// Returns true if the current chain can still become the best chain. Its improvement is then repeated.
    pub(super) fn is_promising(&self) -> bool {
        let higher = || self.best.is_none_or(|(best, _)| self.ascent.sigma > best);
        self.again || (higher() && self.ascent.is_kept_up_with())
    }

    /// Returns true if the current chain can no longer become the best chain. Its improvement then ends. `turn` is the
    /// next action of the improvement.
    pub(super) fn is_dropped(&self, turn: AscentStep) -> bool {
        let other = !self.again && self.best.is_some();
        other && (self.ascent.is_astray() || self.ascent.ends_below(turn, self.highest))
    }

    pub(super) fn next(&mut self, turn: AscentStep, chain: &Chain<'_, impl SeatOf>) -> Work {
        self.restart();
        match turn {
            AscentStep::Try { share, sigma } => Work::Forward(share, sigma, false),
            AscentStep::Raise if self.ascent.at_limit() => {
                let sigma = chain.ceiling() - CEILING;
                Work::Seek(Seek::down(sigma, 1e-5, 2.0, 1e-6), Purpose::Probe)
            }
            AscentStep::Raise => {
                let Ascent { sigma, .. } = self.ascent;
                Work::Seek(Seek::up(sigma, false, 0.02, 1e-5), Purpose::Raise)
            }
            AscentStep::Again => self.look_back(chain.mission),
            AscentStep::Over if self.is_promising() && self.ascent.tighten() => {
                Work::Settle(self.ascent.sigma, Purpose::Tighten)
            }
            AscentStep::Over => {
                self.is_whole &= !self.ascent.may_tighten();
                self.walled |= self.ascent.penalty > 0.0;
                let sigma = self.ascent.sigma;
                Work::Seek(
                    Seek::down(sigma + JUDGED, JUDGED, 3.0, JUDGED),
                    Purpose::Judge,
                )
            }
        }
    }
}

/// Maximum number of relays in a chain for which trial moves of single relays are made. These moves follow the search
/// over the initial chains. In a chain with fixed altitudes of some relays there is no maximum.
const POLISHED: u16 = 5;

/// Number of times that the length of the trial moves of single relays is halved. These moves follow the search over
/// the initial chains.
const HALVINGS: u16 = 12;
/// First trial move of a single relay, as a fraction of its allowed range. Single relays are moved after the search
/// over the initial chains.
const FIRST_MOVE: f32 = 0.25;

/// Minimum gain of the target for which a trial move of a relay is accepted, in ln(SIR).
pub(super) const GAIN: f32 = 2e-5;
/// Maximum number of accepted trial moves, after which the solution ends.
const MOVES: u8 = 200;

impl<const RELAYS: usize, const SEGMENTS: usize> OneWay<RELAYS, SEGMENTS> {
    /// Returns the current trial move: the relay's index, the kind of move, and the number of halvings. Kinds 0 and 1
    /// move the relay down and up, kinds 2 and 3 to its two sides. Kinds 4 and 5 give relay i the lateral offset and
    /// altitude of relay i + 2 or relay i - 2.
    pub(super) fn move_of(&self, mission: &Mission) -> (u16, u16, u16) {
        // A mission has at least one relay, which the compiler does not know.
        let relays = mission.relays().max(1);
        let tried = self.moving / 6;
        (tried % relays + 1, self.moving % 6, tried / relays)
    }

    /// Tries the next move of one relay in a chain that meets the target `sigma`, in ln(SIR).
    ///
    /// The relay moves by a fraction of its allowed range. This fraction is halved after each round over all relays. Or
    /// the relay takes the lateral offset and altitude of a different relay. These moves find improvements that a
    /// search by derivatives misses.
    pub(super) fn polish(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        sigma: f32,
    ) -> Poll<Result<f32, Infeasible>> {
        let (index, way, halved) = self.move_of(chain.mission);
        let polished = chain.relays() <= POLISHED || chain.holds();
        if !polished || halved > HALVINGS || self.moved >= MOVES {
            return Poll::Ready(Ok(libm::expf(sigma)));
        }
        let room = chain.room(index);
        self.kept = self.cells.get(index);
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
            if other < 1 || other > chain.relays() {
                self.moving += 1;
                return Poll::Pending;
            }
            moved = Cell::of(self.cells.get(other).place(chain.room(other)), room);
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

impl<const RELAYS: usize, const SEGMENTS: usize> OneWay<RELAYS, SEGMENTS> {
    /// Begins the search from the next initial chain. After the last one, begins the final search with the best chain
    /// found.
    pub(super) fn begin(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
    ) -> Poll<Result<f32, Infeasible>> {
        let next = Start::number(self.number, Room::of(chain.mission));
        let Some(start) = next else {
            // All starts are done.
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
        let Some(start) = start.filter(|start| !self.is_skipped(chain, *start)) else {
            self.number += 1;
            return Poll::Pending;
        };
        self.start = start;
        self.ascent = Ascent::new(chain.distance_m(), 0.0, 0.0, 0.0);
        (self.judged_at, self.is_whole) = (None, true);
        self.restart();
        self.work = match start {
            Start::Near => Work::Settle(chain.floor() + 0.04, Purpose::Start),
            Start::Turns => {
                for index in 1..=chain.relays() {
                    let room = chain.room(index);
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
            | Start::FixedAltitudes { .. } => {
                Work::Seek(Seek::down(chain.ceiling(), 0.5, 1.5, 0.02), Purpose::Start)
            }
        };
        Poll::Pending
    }

    /// Returns true if the initial chain `start` is not tried. It is not for this mission, or cannot lead to a better
    /// chain than the best one found.
    fn is_skipped(&self, chain: &Chain<'_, impl SeatOf>, start: Start) -> bool {
        match start {
            Start::Near if self.again => false,
            Start::Near => self.best.is_some_and(|(best, _)| best > chain.floor()),
            Start::Through { .. } | Start::Turns => !self.walled,
            Start::FixedAltitudes { .. } => !chain.holds(),
            Start::Arch { .. } | Start::Around { .. } | Start::Far => false,
        }
    }

    pub(super) fn given_up(&mut self) -> Work {
        self.number += 1;
        Work::Begin
    }

    /// Returns the lateral offset and altitude of relay `index`. With [`Purpose::Start`] they are those of the initial
    /// chain to be tried, otherwise the stored ones.
    pub(super) fn shaped(
        &self,
        chain: &Chain<'_, impl SeatOf>,
        index: u16,
        room: Room,
        target: f32,
        purpose: Purpose,
    ) -> CrossSection {
        if purpose != Purpose::Start {
            return self.cells.get(index).place(room);
        }
        let wanted = match self.start {
            Start::Far => {
                let top = far_off(chain, room);
                let relays = f32::from(chain.relays().saturating_sub(1).max(1));
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
            start @ Start::FixedAltitudes { level, .. } => CrossSection {
                altitude_m: chain.altitude_between(index, level),
                ..start.across(chain.distance_m(), self.pass.from.x_m, room)
            },
            start => start.across(chain.distance_m(), self.pass.from.x_m, room),
        };
        Cell::of(wanted, room).place(room)
    }
}
