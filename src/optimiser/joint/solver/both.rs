//! Joint method for both directions: initial chains, interior-point method, and Algorithm 1 at the end.
//!
//! For given lateral offsets and altitudes, Algorithm 1 finds the best x of all relays for both directions, which is a
//! global optimum along the line. The interior-point method ([`interior`](crate::optimiser::joint::interior)) then
//! moves all coordinates to the nearest local optimum. Algorithm 1 at the new lateral offsets and altitudes gives the
//! target that the relays will agree on, with their separation. The best chain is the result.
//!
//! The first chain, at the common altitude, is only compared: so the result is not below that of Algorithm 1. The next
//! five were chosen from 216, one after another, by the number of 3 840 random scenes in which the best result so far
//! misses the optimum. They are described from the end with more power, whose signal may pass the interferer in one
//! hop. Relays away from the interferer or high are mostly better than relays close to it, since the method finds its
//! way down but not around. The last chain keeps relay 1 from the x beyond the interferer. These x are another local
//! optimum for it. From the other chains the method mostly finds that one, as the x of Algorithm 1 are the farthest.

use super::judge::JUDGED;
use crate::optimiser::joint::chain::{Chain, SeatOf};
use crate::optimiser::joint::interior::Interior;
use crate::optimiser::joint::line::Line;
use crate::optimiser::joint::site::{Cell, Cells, Room};
use crate::optimiser::joint::starts::Seek;
use crate::optimiser::search::Infeasible;
use crate::place::{CrossSection, Placement};
use crate::root::sqrt;
use crate::sir::square;
use core::task::Poll;

/// Number of relays that get their initial positions in one call of the solver.
const PUT: u16 = 20;

/// Fraction of the way to even spacing that relays move before the interior-point method starts. The move separates
/// relays that have the same x. The first value is for the first run of this method from an initial chain, the second
/// for repeated runs and for [`Along::Arc`].
const OFF: [f32; 2] = [0.02, 0.002];

/// Description of an initial chain. The first relay is the one next to the end (Tx or Rx) with more power.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Start {
    /// Lateral offsets of the first, the middle and the last relay. They are fractions of the permitted limit that is
    /// farther from the interferer.
    aside: [f32; 3],
    /// Altitudes of the first and the last relay: 0 is the lowest permitted altitude, 1 the highest.
    up: [f32; 2],
    along: Along,
}

/// Method that chooses the x of the relays in an initial chain.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Along {
    /// Best x for the lateral offsets and altitudes of the relays, computed by Algorithm 1.
    Line,
    /// Equal steps in x from the first to the last relay. The fields are the distances of these two relays from the end
    /// (Tx or Rx) with more power. They are fractions of the distance from Tx to Rx.
    Even([f32; 2]),
    /// Best x as for `Line`, but without the range of x that `close_beyond` excludes. Lateral offsets and altitudes
    /// follow a part of an ellipse, and become smaller toward the end (Tx or Rx) with less power.
    Arc,
}

const STARTS: [Start; 6] = [
    Start::new([1.0, 1.0, 1.0], [1.0, 1.0], Along::Line),
    Start::new([0.9, 0.45, 0.0], [0.96, 0.04], Along::Line),
    Start::new([0.96, 0.96, 0.96], [0.96, 0.04], Along::Even([0.5, 1.0])),
    Start::new([0.0, 0.9, 0.0], [0.96, 0.04], Along::Even([0.0, 1.0])),
    Start::new([0.9, 0.45, 0.0], [0.04, 0.96], Along::Even([0.0, 0.5])),
    Start::new([1.0, 1.0, 1.0], [1.0, 1.0], Along::Arc),
];

impl Start {
    const fn new(aside: [f32; 3], up: [f32; 2], along: Along) -> Self {
        Self { aside, up, along }
    }

    /// Returns the lateral offset and altitude in `room` of relay `index` of this initial chain.
    fn cross_section(self, chain: &Chain<'_, impl SeatOf>, index: u16, room: Room) -> CrossSection {
        let (relays, before) = (chain.relays(), before(chain, index));
        // 0 for the relay at the end with more power, 1 for the relay at the other end.
        let share = if relays > 1 {
            f32::from(before) / f32::from(relays - 1)
        } else {
            0.5
        };
        let scale = match self.along {
            Along::Arc => quarter(before, relays + 1)[0],
            Along::Line | Along::Even(_) => 1.0,
        };
        let Room { band, .. } = room;
        let ([near, middle, far], [first, last]) = (self.aside, self.up);
        let bent = 2.0 * share - 1.0;
        let aside = middle
            + bent
                * if bent < 0.0 {
                    middle - near
                } else {
                    far - middle
                };
        room.nearest(CrossSection {
            y_m: scale * aside * room.away_m(chain.interferer),
            altitude_m: scale * (band.least_m + (first + share * (last - first)) * band.span_m()),
        })
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Purpose {
    /// Search for the highest target SIR of an initial chain, before the interior-point method runs.
    Start,
    /// Search for the highest target SIR after a run of the interior-point method. The lateral offsets and altitudes
    /// are the result of this run.
    Result,
    /// Search for the best chain's highest target with a smaller tolerance, at the end of the solution.
    Last,
}

#[repr(u8)] // so that the bytes of `Begin` are 0
#[derive(Clone, Copy, Debug)]
enum Work {
    /// Choice of the lateral offsets and altitudes of an initial chain. The field is the number of relays for which
    /// they are chosen already.
    Begin(u16),
    /// Search for the highest target that Algorithm 1 meets at the current lateral offsets and altitudes.
    Seek(Seek, Purpose),
    /// Computation of the x of all relays by Algorithm 1. The field is the target that the hops have to meet, in
    /// ln(SIR).
    Settle(f32),
    /// Choice of the positions at which the interior-point method starts. The field is the number of relays for which
    /// they are chosen already.
    Put(u16),
    Interior,
}

/// Joint solver of a chain that carries data in both directions.
#[derive(Clone, Debug)]
pub(super) struct Both<const RELAYS: usize, const SEGMENTS: usize> {
    pub(super) interior: Interior<RELAYS, SEGMENTS>,
    /// Best target found, in ln(SIR); `None` until a target is found.
    best: Option<f32>,
    /// Lateral offsets and altitudes of the chain that meets the best target.
    best_cells: Cells<RELAYS>,
    work: Work,
    line: Line,
    /// Target that the last run of the interior-point method has reached, in ln(SIR).
    reached: f32,
    /// Number of repeated runs of the interior-point method for the current initial chain.
    again: u8,
    /// Number of the current initial chain. In chain 0 all relays are at the common altitude.
    number: u8,
}

impl<const RELAYS: usize, const SEGMENTS: usize> Both<RELAYS, SEGMENTS> {
    /// State of the solver before the first call of `step`. All its bytes are 0, so that it needs no flash memory.
    pub(super) const NEW: Self = Self {
        interior: Interior::NEW,
        best: None,
        best_cells: Cells::NEW,
        work: Work::Begin(0),
        line: Line::NEW,
        reached: 0.0,
        again: 0,
        number: 0,
    };

    /// Continues the solution by one bounded step; ready with the target SIR, linear, at the end. A step handles two
    /// relays of Algorithm 1, ten relays of a Newton step, or twenty relays of other work.
    pub(super) fn step(&mut self, chain: &Chain<'_, impl SeatOf>) -> Poll<Result<f32, Infeasible>> {
        let next = match self.work {
            Work::Begin(done) => self.begin_start(chain, done),
            Work::Put(done) => self.begin_interior(chain, done),
            Work::Seek(mut seek, purpose) => {
                let Poll::Ready(met) = self.line(chain, seek.sigma) else {
                    return Poll::Pending;
                };
                if seek.tried(met) {
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
                    Some(_) => Work::Put(0),
                    None => self.next_start(),
                }
            }
            Work::Interior => {
                let Poll::Ready(sigma) = self.interior.step(chain) else {
                    return Poll::Pending;
                };
                self.reached = sigma;
                self.interior.closed = [0.0; 2];
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

    /// Returns true if the initial x of the current chain are chosen by [`Along::Arc`].
    fn is_arc(&self) -> bool {
        self.start().is_some_and(|start| start.along == Along::Arc)
    }

    fn next_start(&mut self) -> Work {
        self.number += 1;
        self.again = 0;
        Work::Begin(0)
    }

    /// Chooses the lateral offsets and altitudes of up to 20 relays of the current initial chain. The first `done`
    /// relays have them already. Returns the next work; after the last initial chain this is the final search for the
    /// best chain's target.
    fn begin_start(&mut self, chain: &Chain<'_, impl SeatOf>, done: u16) -> Work {
        let Some(start) = self.start() else {
            self.interior.cells = self.best_cells;
            let sigma = self.best.unwrap_or_default();
            return Work::Seek(Seek::up(sigma, true, 1e-5, 1e-6), Purpose::Last);
        };
        let config = chain.mission.config();
        let relays = chain.relays();
        let end = (done + PUT).min(relays);
        let after = end + 1;
        for index in done + 1..after {
            let room = chain.room(index);
            let at = if self.number > 0 {
                start.cross_section(chain, index, room)
            } else {
                room.nearest(config.common.on_line().cross_section)
            };
            self.interior.cells.set(index, Cell::of(at, room));
        }
        self.interior.closed = [0.0; 2];
        if start.along == Along::Arc {
            self.close_beyond(chain);
        }
        if end < relays {
            Work::Begin(end)
        } else if let Along::Even(_) = start.along {
            Work::Put(0)
        } else {
            // Results are compared with the chain at the common altitude, so its target is as exact as theirs.
            let width = if self.number > 0 { 0.02 } else { JUDGED };
            Work::Seek(Seek::down(chain.ceiling(), 0.5, 1.5, width), Purpose::Start)
        }
    }

    /// Excludes a range of x for the relay next to the end (Tx or Rx) with more power. In this range, beyond the
    /// interferer as seen from that end, the relay's SIR rises with its distance from the end.
    ///
    /// Let the relay be at x from that end, the interferer at X, and a the distance of the interferer from the line
    /// Tx-Rx. The SIR is then proportional to ((x - X)^2 + a^2) / (x^2 + a^2), which is smallest at x (x - X) = a^2.
    /// Instead of this a, the function uses the interferer's distance from the relay's lateral offset and altitude.
    fn close_beyond(&mut self, chain: &Chain<'_, impl SeatOf>) {
        let (distance_m, is_turned) = (chain.distance_m(), is_turned(chain));
        let index = if is_turned { chain.relays() } else { 1 };
        let at = self.interior.cells.get(index).place(chain.room(index));
        let a_squared = square(at.y_m - chain.interferer.y_m) + square(at.altitude_m);
        let x_m = if is_turned {
            distance_m - chain.interferer.x_m
        } else {
            chain.interferer.x_m
        };
        let lowest_m = 0.5 * (x_m + sqrt(square(x_m) + 4.0 * a_squared));
        let closed = (1.0 - lowest_m / distance_m).max(0.0);
        self.interior.closed = if is_turned {
            [0.0, closed]
        } else {
            [closed, 0.0]
        };
    }

    /// Returns the description of the current initial chain; `None` after the last one. For chain 0, at the common
    /// altitude, it returns the description of chain 1. Only the field `along` of it is used.
    fn start(&self) -> Option<Start> {
        let at = usize::from(self.number).saturating_sub(1);
        STARTS.get(at).copied()
    }

    /// Stores the current chain if its target `sigma`, in ln(SIR), is the best so far. Returns the next work: a run of
    /// the interior-point method from this chain, or the next initial chain. The method runs again only if Algorithm 1
    /// has found a higher target than the last run.
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

    /// Chooses the positions of up to 20 relays at which the interior-point method starts. The first `done` relays have
    /// them already. The lateral offsets and altitudes are the stored ones; the x come from Algorithm 1, or are evenly
    /// spaced. After the last relay the method starts.
    fn begin_interior(&mut self, chain: &Chain<'_, impl SeatOf>, done: u16) -> Work {
        let distance_m = chain.distance_m();
        let relays = chain.relays();
        let along = match self.start() {
            Some(start) if self.again == 0 => start.along,
            _ => Along::Line,
        };
        let is_close = self.again > 1 || self.is_arc();
        let [far, close] = OFF;
        let off = if is_close { close } else { far };
        let end = (done + PUT).min(relays);
        let after = end + 1;
        for index in done + 1..after {
            let room = chain.room(index);
            let place = self.interior.cells.get(index).place(room).at(0.0);
            let share = f32::from(index) / f32::from(relays + 1);
            let turned = |x: f32| if is_turned(chain) { 1.0 - x } else { x };
            let x_m = match along {
                Along::Line | Along::Arc => {
                    let x_m = self.interior.noted_x_m(index);
                    x_m + off * (share * distance_m - x_m)
                }
                Along::Even([first, last]) => {
                    turned(first + turned(share) * (last - first)) * distance_m
                }
            };
            self.interior
                .put(chain, index, Placement { x_m, ..place }, off);
        }
        if end < relays {
            return Work::Put(end);
        }
        self.interior.start(chain, is_close);
        Work::Interior
    }

    /// Continues Algorithm 1 for the target `sigma`, in ln(SIR). Ready with `None` if the target cannot be met.
    fn line(&mut self, chain: &Chain<'_, impl SeatOf>, sigma: f32) -> Poll<Option<bool>> {
        let Interior {
            cells,
            nodes,
            closed,
            ..
        } = &mut self.interior;
        self.line.step(chain, cells, nodes, *closed, sigma)
    }
}

/// Returns true if the initial chains are described from Rx to Tx, false if from Tx to Rx. The result is true if Rx has
/// more power than Tx. With equal powers it is true if the required SIR toward Tx is lower than that toward Rx.
fn is_turned(chain: &Chain<'_, impl SeatOf>) -> bool {
    let config = chain.mission.config();
    let (tx_w, rx_w) = (config.tx_power_w, config.rx_power_w);
    rx_w > tx_w || (rx_w >= tx_w && config.reverse < 1.0)
}

/// Returns the number of relays between relay `index` and the end (Tx or Rx) with more power.
fn before(chain: &Chain<'_, impl SeatOf>, index: u16) -> u16 {
    if is_turned(chain) {
        chain.relays() - index
    } else {
        index - 1
    }
}

/// Returns a point on the unit circle: from (1, 0) for `part` = 0 to (0, 1) for `part` = `whole`.
fn quarter(part: u16, whole: u16) -> [f32; 2] {
    let [a, b] = [whole.saturating_sub(part), part].map(f32::from);
    let radius = sqrt(square(a) + square(b));
    [a / radius, b / radius]
}

/// Minimum gain for another run of the interior-point method, in ln(SIR). The gain is the target that Algorithm 1 meets
/// after the last run, minus the target of that run.
const NEW: f32 = 3e-4;
/// Maximum number of interior-point runs per initial chain that start from a result of Algorithm 1.
const AGAIN: u8 = 4;

/// Excess of the first target for Algorithm 1 over that of the interior-point method, in ln(SIR). The excess allows for
/// the error of the interior-point method.
const ABOVE: f32 = 1e-4;
