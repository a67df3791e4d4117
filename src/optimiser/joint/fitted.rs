//! Fitted slots, each as long as its hop needs: positions of a chain for the largest data rate.
//!
//! With the spectral efficiency b = log2(1 + SINR / gap) of a hop, forward F and backward B, one bit to Rx and r bits back take
//!
//! ```text
//! time = sum over hops of  1 / b(F) + r / b(B)
//! ```
//!
//! in units of 1 / bandwidth; the rate is its inverse. A hop's time rises steeply with its length from 0, and is
//! concave there. So the best chain mostly has a few long hops, and the other relays gather at their minimum
//! separation. The sum has many local optima, and derivatives do not lead from one to another. But each term depends on
//! two neighbours only. So if every relay may stay or move by one or two widths along one coordinate, one pass over the
//! relays finds the best of all 5^N combinations (dynamic programming; Viterbi 1967). The method repeats such passes
//! over x, y and altitude, and halves the width when a round gains little. With the first width, relays jump from one
//! group to another. No step raises the time. The method needs no derivatives, and the minimum separation is simply a
//! condition of each hop.
//!
//! The initial chains are evenly spaced over the line and over its halves, and gathered at Tx, in the middle and at Rx. Lengths are in
//! units of D, in which the widths are powers of two: the relays of a group keep their distances exactly.

use super::chain::{Chain, Gains, SeatOf};
use super::hop::{Triple, minus};
use crate::mission::{Band, FINEST_STEP};
use crate::optimiser::search::Infeasible;
use crate::place::{CrossSection, Placement};
use crate::sir::{in_noise, square};
use core::f32::consts::LN_2;
use core::task::Poll;

/// Number of positions that are tried for each relay: the present one, and two on each side of it. They are tried in
/// every pass over the relays.
const STATES: usize = 5;
/// Moves of a relay that are tried in each pass over the relays, in units of the current step width. If two moves are
/// equally good, the one listed first is used.
const MOVES: [f32; STATES] = [0.0, -2.0, -1.0, 1.0, 2.0];
/// Number of bits of one choice in `Fitted::choices`. A choice is an index in [`MOVES`].
const BITS: usize = 3;

/// Smallest width of a relay's moves, divided by the distance from Tx to Rx. Below it, the search goes on to the next
/// initial chain.
const NARROWEST: f32 = 1.0 / 131_072.0;
/// Relative decrease of the total hop time in one round, below which the width of the moves is halved. A round is a
/// pass over all relays for each coordinate that may change.
const LITTLE: f32 = 1e-3;
/// Maximum number of rounds from one initial chain. A round is a pass over all relays for each coordinate that may
/// change: x, y and altitude.
const ROUNDS: u8 = 200;

/// Number of relays that one call of the solver handles in a forward pass, from Tx to Rx.
const AT_ONCE: u16 = 3;
/// Number of relays that one call of the solver handles in all work except a forward pass.
const OTHERS_AT_ONCE: u16 = 10;

/// Amount added to each squared hop length, so that no hop time is 0. The unit is the squared distance from Tx to Rx.
const SHORTEST: f32 = 1e-12;

/// Initial chains: two ends of an interval of x, and the first step width. The unit is the distance from Tx to Rx. The
/// relays are evenly spaced between the ends. If the ends are equal, the relays are grouped around this x, each at the
/// minimum separation from the next.
const STARTS: [[f32; 3]; 8] = [
    [0.5, 0.5, 0.125],
    [0.0, 1.0, 0.125],
    [0.0, 0.0, 0.125],
    [1.0, 1.0, 0.125],
    [0.5, 1.0, 0.125],
    [0.0, 0.5, 0.125],
    [0.0, 0.0, 0.007_812_5],
    [1.0, 1.0, 0.007_812_5],
];
/// Index, from 0, of the initial chain that is the best chain found by moves along x alone. Used only if the mission
/// allows several lateral offsets or altitudes.
const BEST: u8 = 8;
/// First step width of the moves from initial chain [`BEST`], divided by the distance from Tx to Rx.
const BEST_WIDTH: f32 = 1.0 / 16.0;
/// Lateral offset and altitude of further initial chains, as fractions of their ranges. The lateral offset ranges from
/// 0 to its limit on the side of the line Tx-Rx opposite the interferer. The altitude ranges from the mission's common
/// altitude to the highest altitude.
const ACROSS: [[f32; 2]; 2] = [[0.0, 0.5], [0.5, 0.0]];

/// Time slots of the hops to and from a relay, each as long as its hop needs (fitted slots). A slot has a begin and an
/// end, as fractions of the frame, 0 to 1.
///
/// The slots of all hops follow one another in this order: toward Rx from hop 1 (from Tx) to hop N + 1 (to Rx), then
/// back from hop N + 1 to hop 1. A slot begins where the slot before it ends, to the bit. Tx and Rx compute nothing:
/// their slots are `from_tx` and `to_tx` of the first relay, and `to_rx` and `from_rx` of the last one. A radio also
/// needs the length of the frame, and a clock that all nodes share. The numbers are multiples of about 6e-8, so a
/// shorter slot can become empty.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SlotShares {
    /// Begin and end of the slot in which this relay sends to the next node toward Rx.
    pub to_rx: [f32; 2],
    /// Begin and end of the slot in which this relay sends to the next node toward Tx. In a mission with data toward Rx
    /// only, begin and end are 1: the slot is empty.
    pub to_tx: [f32; 2],
    /// Begin and end of the slot in which this relay receives from the next node toward Tx.
    pub from_tx: [f32; 2],
    /// Begin and end of the slot in which this relay receives from the next node toward Rx. In a mission with data
    /// toward Rx only, begin and end are 1: the slot is empty.
    pub from_rx: [f32; 2],
    /// Data rate of the whole chain to Rx, divided by the bandwidth, bit/s/Hz. The data rate from Rx to Tx is r times
    /// this value, with the mission's required ratio r (`reverse`).
    pub bits_per_hz: f32,
}

/// Position tried for a node, and the inverse interference there. The latter is 1 at Tx and Rx, because the gain of a
/// hop to Tx or Rx includes it.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: Triple,
    quiet: f32,
}

/// Position tried for one relay, and the shortest total time of all hops from Tx to that relay.
#[derive(Clone, Copy, Debug)]
struct State {
    spot: Spot,
    time: f32,
}

impl State {
    const NONE: Self = Self {
        spot: Spot {
            at: [0.0; 3],
            quiet: 0.0,
        },
        time: 0.0,
    };
}

/// Hop between two nodes: its gains, its ratio r of data rates, and the separation of its ends. The ratio r is the data
/// rate to Tx divided by the data rate to Rx. `gains` has the gain toward Rx and the gain toward Tx, each divided by
/// the SNR gap.
#[derive(Clone, Copy, Debug)]
struct Hop {
    gains: [f32; 2],
    reverse: f32,
    /// Squared minimum separation of the hop's two relays. `None` for a hop from Tx or to Rx. The unit is the squared
    /// distance from Tx to Rx.
    apart: Option<f32>,
}

impl Hop {
    /// Returns the SINR toward Rx and the SINR toward Tx, linear, each divided by the SNR gap.
    fn sinrs(&self, from: &Spot, to: &Spot) -> [f32; 2] {
        let [x, y, h] = minus(to.at, from.at);
        let l = square(x) + square(y) + square(h) + SHORTEST;
        let [there, back] = self.gains;
        [there * to.quiet / l, back * from.quiet / l]
    }

    /// Returns the time to send one bit toward Rx, and the time to send r bits toward Tx. r is the data rate to Tx
    /// divided by the data rate to Rx. Both times are infinite if the hop's relays are too close or out of order.
    #[inline(never)]
    fn times(&self, from: &Spot, to: &Spot) -> [f32; 2] {
        let [x, y, h] = minus(to.at, from.at);
        let is_apart = match self.apart {
            Some(least) => x >= FINEST_STEP && square(x) + square(y) + square(h) >= least,
            None => x >= 0.0,
        };
        if !is_apart {
            return [f32::INFINITY; 2];
        }
        let [there, back] = self.sinrs(from, to);
        let back = if self.reverse > 0.0 {
            self.reverse * LN_2 / libm::log1pf(back)
        } else {
            0.0
        };
        [LN_2 / libm::log1pf(there), back]
    }
}

#[repr(u8)] // so that the bytes of `Begin` are 0
#[derive(Clone, Copy, Debug)]
enum Work {
    /// Choice of the positions of an initial chain, some relays per call. The field is the number of relays done.
    Begin(u16),
    /// Forward pass of the dynamic programming, from Tx to Rx: finds the fastest combination of moves. The field is
    /// the next node to process: 1 for the first relay, N + 1 for Rx.
    Pass(u16),
    /// Backward pass, from the last relay to the first: moves the relays as in the best combination. The fields are the
    /// next relay to move, and the index of its move in [`MOVES`].
    Back(u16, u8),
    /// Summation of the hop times of the best chain, and search for its lowest SIR. The field is the next node to
    /// process.
    Sum(u16),
}

/// Solver of a chain with fitted slots: time slots as long as each hop needs. It maximises the data rate.
#[derive(Clone, Debug)]
pub(super) struct Fitted<const RELAYS: usize> {
    /// Gains of the hops from relays of 1 W, each divided by the SNR gap.
    gains: Gains,
    /// Positions of the relays in the current chain, in units of the distance from Tx to Rx.
    places: [Triple; RELAYS],
    /// Positions of the relays in the best chain, in units of the distance from Tx to Rx. After the search, the times
    /// of all hops from Tx to each relay are stored here instead: the time toward Rx in place of x, and the time toward
    /// Tx in place of y.
    best_places: [Triple; RELAYS],
    /// Best choice among the positions of the previous relay, for each of a relay's five tried positions. The previous
    /// relay is the one toward Tx. A choice is an index in [`MOVES`], and takes three bits.
    choices: [u16; RELAYS],
    front: [State; STATES],
    work: Work,
    /// Number of the current initial chain, from 0.
    number: u8,
    rounds: u8,
    /// Coordinate that the current pass over the relays changes: 0 for x, 1 for y, 2 for the altitude.
    axis: u8,
    width: f32,
    /// Total hop time of the current chain, which is to be minimised. Infinite if relays are too close.
    time: f32,
    /// Total hop time of the current chain at the start of this round. A round is a pass over all relays for each
    /// coordinate that may change.
    before: f32,
    /// Total hop time of the best chain found; 0 until a chain is found.
    best: f32,
    /// Sum of all hop times of the solved chain for data toward Rx, and the sum for data toward Tx.
    sums: [f32; 2],
    worst: f32,
}

impl<const RELAYS: usize> Fitted<RELAYS> {
    /// State of the solver before its first call. All its bytes are 0, so that it needs no flash memory.
    pub(super) const NEW: Self = Self {
        gains: Gains::NONE,
        places: [[0.0; 3]; RELAYS],
        best_places: [[0.0; 3]; RELAYS],
        choices: [0; RELAYS],
        front: [State::NONE; STATES],
        work: Work::Begin(0),
        number: 0,
        rounds: 0,
        axis: 0,
        width: 0.0,
        time: 0.0,
        before: 0.0,
        best: 0.0,
        sums: [0.0; 2],
        worst: 0.0,
    };

    /// Continues the solution by a bounded amount of work. `Ready` once the chain is solved, with the linear SIR of the
    /// worst hop.
    pub(super) fn step(&mut self, chain: &Chain<'_, impl SeatOf>) -> Poll<Result<f32, Infeasible>> {
        let relays = chain.relays();
        match self.work {
            Work::Begin(0) if usize::from(self.number) >= starts(chain) => {
                if !(self.best > 0.0) {
                    return Poll::Ready(Err(Infeasible));
                }
                self.places = self.best_places;
                self.worst = f32::INFINITY;
                self.work = Work::Sum(1);
            }
            Work::Begin(done) => self.begin(chain, done),
            Work::Pass(index) => self.pass(chain, index),
            Work::Back(index, state) => self.back(chain, index, state),
            Work::Sum(index) => {
                let end = (index + OTHERS_AT_ONCE).min(relays + 2);
                for index in index..end {
                    let [there, back] = self.hop_times(chain, index);
                    let [all_there, all_back] = self.sums;
                    self.sums = [all_there + there, all_back + back];
                    let [there, back] = self.sums;
                    if let Some(kept) = self.best_places.get_mut(usize::from(index - 1)) {
                        *kept = [there, back, 0.0];
                    }
                }
                if end > relays + 1 {
                    return Poll::Ready(Ok(self.worst));
                }
                self.work = Work::Sum(end);
            }
        }
        Poll::Pending
    }

    /// Moves relays to their positions in the current initial chain. `done` is the number of relays moved by earlier
    /// calls. One call moves up to [`OTHERS_AT_ONCE`] relays. After the last relay, the first pass over the chain
    /// begins.
    fn begin(&mut self, chain: &Chain<'_, impl SeatOf>, done: u16) {
        let config = chain.mission.config();
        let relays = chain.relays();
        if done == 0 {
            let gap = chain.mission.fitted_gap();
            self.gains = Gains::new(chain, 1.0, |gain| gain / gap);
        }
        let number = usize::from(self.number);
        let is_best = self.number == BEST;
        let (number, across) = match number.checked_sub(STARTS.len() + 1) {
            Some(number) => (number % STARTS.len(), ACROSS.get(number / STARTS.len())),
            None => (number, None),
        };
        let [first, last, width] = *STARTS.get(number).unwrap_or(&[0.0, 0.0, BEST_WIDTH]);
        let [aside, up] = *across.unwrap_or(&[0.0; 2]);
        let step = chain.mission.step_with_room(0.0) / config.distance_m;
        let gathered = f32::from(relays - 1) * step;
        let at = (first - 0.5 * gathered).min(1.0 - gathered).max(0.0);
        let end = (done + OTHERS_AT_ONCE).min(relays);
        let after = end + 1;
        for index in done + 1..after {
            let room = chain.room(index);
            let x = if first < last {
                first + (last - first) * f32::from(index) / f32::from(relays + 1)
            } else {
                at + f32::from(index - 1) * step
            };
            let low_m = config.common.altitude_m;
            let place = CrossSection {
                y_m: aside * room.away_m(chain.interferer),
                altitude_m: low_m + up * (room.band.most_m - low_m),
            };
            let place = room.nearest(place);
            let unit = 1.0 / config.distance_m;
            let at = [x.min(1.0), place.y_m * unit, place.altitude_m * unit];
            let best = self.best_places.get(usize::from(index - 1));
            self.set(index, *best.filter(|_| is_best).unwrap_or(&at));
        }
        self.work = if end < relays {
            Work::Begin(end)
        } else {
            (self.rounds, self.axis, self.width) = (0, 0, width);
            (self.time, self.before) = (f32::INFINITY, f32::INFINITY);
            Work::Pass(1)
        };
    }

    fn set(&mut self, index: u16, at: Triple) {
        if let Some(place) = self.places.get_mut(usize::from(index).wrapping_sub(1)) {
            *place = at;
        }
    }

    /// Returns the position of node `index`, moved by `by` along the coordinate of the current pass. The result stays
    /// within the limits of this coordinate. Index 0 is Tx, and N + 1 is Rx; both do not move.
    #[inline(never)]
    fn spot(&self, chain: &Chain<'_, impl SeatOf>, index: u16, by: f32) -> Spot {
        let place = self.places.get(usize::from(index).wrapping_sub(1));
        let Some(&place) = place.filter(|_| index <= chain.relays()) else {
            let x = if index > 0 { 1.0 } else { 0.0 };
            return Spot {
                at: [x, 0.0, 0.0],
                quiet: 1.0,
            };
        };
        let unit = 1.0 / chain.distance_m();
        let room = chain.room(index);
        let mut at = place;
        let limits = |band: Band| [band.least_m * unit, band.most_m * unit];
        let limits = [[0.0, 1.0], limits(room.lateral), limits(room.band)];
        let axis = usize::from(self.axis);
        if let (Some(cell), Some([low, high])) = (at.get_mut(axis), limits.get(axis)) {
            *cell = (*cell + by).max(*low).min(*high);
        }
        Spot {
            at,
            quiet: self.gains.quiet(at),
        }
    }

    fn pass(&mut self, chain: &Chain<'_, impl SeatOf>, first: u16) {
        let relays = chain.relays();
        if first <= 1 {
            let spot = self.spot(chain, 0, 0.0);
            self.front = [State { spot, time: 0.0 }; STATES];
        }
        let end = (first + AT_ONCE).min(relays + 2);
        for index in first..end {
            let hop = self.gains.hop(chain, index);
            let mut next = [State::NONE; STATES];
            let mut choices = 0;
            for (k, (state, by)) in next.iter_mut().zip(MOVES).enumerate() {
                let spot = self.spot(chain, index, by * self.width);
                let mut best = (f32::INFINITY, 0);
                for (before, from) in self.front.iter().zip(0_u16..) {
                    if !(before.time < best.0) {
                        continue;
                    }
                    let [there, back] = hop.times(&before.spot, &spot);
                    let time = before.time + there + back;
                    if time < best.0 {
                        best = (time, from);
                    }
                }
                *state = State { spot, time: best.0 };
                choices |= best.1 << (BITS * k);
            }
            self.front = next;
            if let Some(kept) = self.choices.get_mut(usize::from(index - 1))
                && index <= relays
            {
                *kept = choices;
            } else {
                // Rx has a single state. Its choice is the state of the last relay.
                let [rx, ..] = next;
                self.conclude(chain, rx.time, (choices & 7) as u8);
                return;
            }
        }
        self.work = Work::Pass(end);
    }

    /// Continues after a forward pass, which has found the best combination of all relays' moves. `time` is the total
    /// hop time with these moves. `state` is the index of the last relay's move in [`MOVES`].
    fn conclude(&mut self, chain: &Chain<'_, impl SeatOf>, time: f32, state: u8) {
        if time < self.time {
            self.time = time;
            self.work = Work::Back(chain.relays(), state);
        } else {
            self.next_pass(chain);
        }
    }

    /// Moves relays to their best positions, from relay `index` toward Tx. `state` is the index of that relay's move in
    /// [`MOVES`].
    fn back(&mut self, chain: &Chain<'_, impl SeatOf>, index: u16, state: u8) {
        let end = index.saturating_sub(OTHERS_AT_ONCE);
        let mut state = usize::from(state);
        for index in (end + 1..=index).rev() {
            let by = MOVES.get(state).copied().unwrap_or_default();
            let Spot { at, .. } = self.spot(chain, index, by * self.width);
            self.set(index, at);
            let choices = self.choices.get(usize::from(index - 1));
            state = usize::from(choices.copied().unwrap_or_default() >> (BITS * state) & 7);
        }
        if end > 0 {
            self.work = Work::Back(end, u8::try_from(state).unwrap_or_default());
        } else {
            self.next_pass(chain);
        }
    }

    /// Selects the coordinate and the step width of the next pass over the relays. A pass changes one coordinate of all
    /// relays. After the last pass from an initial chain, the function stores the chain if it is the best so far, and
    /// goes on to the next initial chain.
    fn next_pass(&mut self, chain: &Chain<'_, impl SeatOf>) {
        let config = chain.mission.config();
        self.axis += 1;
        if self.number < BEST {
            self.axis = 3;
        }
        if self.axis == 1 && config.lateral.is_single() {
            self.axis = 2;
        }
        if self.axis == 2 && config.band.is_single() {
            self.axis = 3;
        }
        if self.axis > 2 {
            self.axis = 0;
            self.rounds += 1;
            if !(self.time < self.before * (1.0 - LITTLE)) {
                self.width *= 0.5;
            }
            self.before = self.time;
        }
        self.work = if self.width >= NARROWEST && self.rounds < ROUNDS {
            Work::Pass(1)
        } else {
            if self.time < f32::INFINITY && !(self.best > 0.0 && self.best <= self.time) {
                (self.best_places, self.best) = (self.places, self.time);
            }
            self.number += 1;
            Work::Begin(0)
        };
    }

    /// Returns the time of the hop to node `index` toward Rx, and its time toward Tx. Updates `worst`, the lowest SIR
    /// of all hops so far.
    fn hop_times(&mut self, chain: &Chain<'_, impl SeatOf>, index: u16) -> [f32; 2] {
        let hop = self.gains.hop(chain, index);
        let (from, to) = (
            self.spot(chain, index - 1, 0.0),
            self.spot(chain, index, 0.0),
        );
        let gap = chain.mission.fitted_gap();
        let [there, back] = hop.sinrs(&from, &to).map(|sinr| sinr * gap);
        self.worst = self.worst.min(there);
        if hop.reverse > 0.0 {
            self.worst = self.worst.min(back / hop.reverse);
        }
        hop.times(&from, &to)
    }

    /// Returns the end of hop `hop`'s slot toward Rx, and the begin of its slot toward Tx. Both are fractions of the
    /// frame. `hop` is at most N + 1. For `hop` 0, the result is the begin and the end of the frame: 0 and 1.
    fn bounds(&self, relays: u16, hop: u16) -> [f32; 2] {
        let kept = self.best_places.get(usize::from(hop).wrapping_sub(1));
        let [there, back] = match (kept, hop) {
            (_, 0) => [0.0; 2],
            (Some(&[there, back, _]), _) if hop <= relays => [there, back],
            _ => self.sums,
        };
        let [all_there, all_back] = self.sums;
        let share = |time: f32| time / (all_there + all_back);
        // The slots of the two directions meet at one number, to the bit.
        let middle = 1.0 - share(all_back);
        let end = if hop > relays { 1.0 } else { share(there) };
        [end.min(middle), 1.0 - share(back)]
    }

    /// Returns the position of relay `index` and its time slots. The chain must be solved.
    pub(super) fn place(
        &self,
        chain: &Chain<'_, impl SeatOf>,
        index: u16,
    ) -> (Placement, SlotShares) {
        let bounds = |hop| self.bounds(chain.relays(), hop);
        let [[begin, last], [middle, begin_back], [end, first_back]] = [
            bounds(index.saturating_sub(1)),
            bounds(index),
            bounds(index + 1),
        ];
        let [x_m, y_m, altitude_m] = self
            .spot(chain, index, 0.0)
            .at
            .map(|d| d * chain.distance_m());
        let at = chain.room(index).nearest(CrossSection { y_m, altitude_m });
        let shares = SlotShares {
            to_rx: [middle, end],
            to_tx: [begin_back, last],
            from_tx: [begin, middle],
            from_rx: [first_back, begin_back],
            bits_per_hz: 1.0 / self.sums.iter().sum::<f32>(),
        };
        (at.at(x_m), shares)
    }
}

/// Returns the number of initial chains. There are more if several lateral offsets or altitudes are allowed.
fn starts(chain: &Chain<'_, impl SeatOf>) -> usize {
    let config = chain.mission.config();
    if config.band.is_single() && config.lateral.is_single() {
        STARTS.len()
    } else {
        STARTS.len() * (1 + ACROSS.len()) + 1
    }
}

impl Gains {
    fn quiet(&self, at: Triple) -> f32 {
        let [x, y, h] = minus(at, self.source);
        in_noise(square(x) + square(y) + square(h), self.noise)
    }

    /// Returns the hop to node `index`, 1 to N + 1 (Rx).
    fn hop(&self, chain: &Chain<'_, impl SeatOf>, index: u16) -> Hop {
        let (config, relays) = (chain.mission.config(), chain.relays());
        let is_between = index > 1 && index <= relays;
        let least = config.min_separation_m / config.distance_m + 0.5 * FINEST_STEP;
        Hop {
            gains: self.of(index, relays, |gain, index| {
                gain * chain.seat(index).power_w
            }),
            reverse: chain.mission.reverse(),
            apart: is_between.then_some(square(least)),
        }
    }
}
