//! Algorithm 2's local search: the position of one relay that maximises the worse of its two hops.
//!
//! It searches between the neighbours along x, and within `explore` of the current altitude, by one of two methods. The
//! paper's method is a grid. The other method goes from coarse to fine: of five altitudes, the best one and its
//! neighbours bound the next five. At each altitude, the x where the SIRs of both hops are equal is found by bisection.
//! Where all hops are equal, as after Algorithm 1, a grid has no better point, but this method finds one.
//!
//! With data in both directions each hop counts by its worse direction, and a relay close to the interferer receives
//! both neighbours worse. So there may be several maxima along x on each side of the interferer: smooth ones, and
//! narrow ones where the SIRs of both hops are equal. Each side is sampled evenly. The best sample is improved by steps
//! that halve, and equal SIRs are found by bisection.
//!
//! Accuracy and effect: `host-tests/tests/adjust.rs`.

use core::task::Poll;

use super::reverse::Back;
use crate::features::REVERSE;
use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement};
use crate::root::{bisected, sqrt};
use crate::sir::{Sender, in_noise, square};

/// Number of altitudes in one round of the coarse-to-fine search for a relay's best position. The search is a part of
/// Algorithm 2.
const ROWS: u8 = 5;

/// Number of rounds of the coarse-to-fine search. Each round halves the range of altitudes.
const ROUNDS: u8 = 9;

/// Number of bisection steps along x for each altitude of the coarse-to-fine search.
const HALVINGS: u8 = 20;

/// Number of equal intervals of x on each side of the interferer, for data in both directions. One side is toward Tx,
/// the other toward Rx. The search evaluates both hops of the relay at the ends of the intervals.
const SAMPLES: u8 = 12;

const ROUNDING: f32 = 3e-7;

/// Method by which one relay searches for its best position between its neighbours (Algorithm 2).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Local {
    /// Coarse-to-fine search over altitudes. It evaluates the relay's two hops at up to 1080 positions; for data in
    /// both directions, at up to 8730 positions.
    #[default]
    Fine,
    /// Search on a grid of positions, as in the paper. It evaluates the relay's two hops at `columns` times `rows`
    /// positions.
    Grid {
        /// Number of positions of the grid along x, including the positions of the neighbours, 2 to 255.
        columns: u8,
        /// Number of altitudes (rows) in the grid of candidate positions, 2 to 255.
        rows: u8,
    },
}

/// Neighbour of a relay whose position is searched: the far end of one of the relay's two hops.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HopEnd {
    /// Position of the neighbour.
    pub place: Placement,
    /// Minimum distance between the neighbour and the relay, m.
    pub apart_m: f32,
    /// Transmit power of the neighbouring node, W.
    pub power_w: f32,
}

/// Two hops of a relay at any position: with the next node toward Tx, and with the next node toward Rx.
///
/// l is the squared length of a hop, q the inverse interference at the relay, and A and A' are gains. The SIRs for data
/// toward Rx are A q / l from the node toward Tx, and `received` / l to the node toward Rx. The SIRs for data toward Tx
/// (backward) are A' q / l from the node toward Rx, and `returned` / l to the node toward Tx. These two are divided by
/// r, the required ratio of backward to forward SIR.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hops {
    before: HopEnd,
    after: HopEnd,
    /// Gain A of the hop from the node toward Tx. The hop's SIR is A times the inverse interference, divided by the
    /// squared length.
    gain: f32,
    /// SIR of the hop from this relay to the next node toward Rx, times the squared hop length, m^2.
    received: f32,
    back: WayBack,
    interferer: Interferer,
    /// Receiver noise divided by the interferer's power received at 1 m (nu), 1/m^2; 0 without noise.
    noise: f32,
}

/// Gains of both hops for data from Rx to Tx, divided by r. r is the required ratio of backward to forward SIR. The
/// gains are infinite for a mission without data from Rx to Tx.
#[derive(Clone, Copy, PartialEq, Debug)]
struct WayBack {
    /// SIR of the backward hop to the next node toward Tx, times the squared hop length, m^2. The SIR is divided by r,
    /// as in [`WayBack`].
    returned: f32,
    /// Gain A' of the backward hop (data toward Tx) from the next node toward Rx to this relay.
    gain: f32,
}

impl WayBack {
    const NONE: Self = Self {
        returned: f32::INFINITY,
        gain: f32::INFINITY,
    };

    #[inline(never)] // keeps the code for one direction small
    fn new(
        mission: &Mission,
        before: Option<HopEnd>,
        power_w: f32,
        after: Option<HopEnd>,
    ) -> Option<Self> {
        let reverse = mission.reverse();
        if !(reverse > 0.0) {
            return None;
        }
        let to = before.map_or(CrossSection::on_line(0.0), |relay| {
            relay.place.cross_section()
        });
        let back = Back::new(mission, to, power_w, before.is_none())?;
        let gain = match after {
            Some(relay) => mission.relay_gain(relay.power_w),
            None => Sender::receiver(mission).gain,
        };
        Some(Self {
            returned: back.hears(before.map_or(0.0, |relay| relay.place.x_m)),
            gain: gain.value() / reverse,
        })
    }
}

impl Hops {
    /// Returns the two hops of a relay of `power_w` watts. `before` is the node toward Tx (`None` for Tx), `after` the
    /// node toward Rx (`None` for Rx).
    pub fn new(
        mission: &Mission,
        interferer: &Interferer,
        before: Option<HopEnd>,
        power_w: f32,
        after: Option<HopEnd>,
    ) -> Self {
        let ground = |x_m| HopEnd {
            place: Placement::on_line(x_m, 0.0),
            apart_m: 0.0,
            power_w: 0.0,
        };
        let noise = mission.noise_at_a_metre();
        Self {
            before: before.unwrap_or(ground(0.0)),
            after: after.unwrap_or(ground(mission.config().distance_m)),
            gain: match before {
                Some(relay) => mission.relay_gain(relay.power_w).value(),
                None => mission.tx_gain().value(),
            },
            received: match after {
                Some(HopEnd { place: to, .. }) => {
                    let s = square(interferer.x_m - to.x_m)
                        + square(interferer.y_m)
                        + square(to.altitude_m);
                    mission.relay_gain(power_w).value() * in_noise(s, noise)
                }
                None => mission.receiver_gain(power_w),
            },
            back: WayBack::new(mission, before, power_w, after).unwrap_or(WayBack::NONE),
            interferer: *interferer,
            noise,
        }
    }

    /// Returns the SIRs of the hops to and from the relay at `at`, linear, computed as in [`crate::sir`].
    ///
    /// For data in both directions, each result is the smaller of two values: the forward SIR, and the backward SIR
    /// divided by r. r is the required ratio of backward to forward SIR.
    pub fn both(&self, at: Placement) -> (f32, f32) {
        let (x, h) = (at.x_m, at.altitude_m);
        let s = square(self.interferer.x_m - x) + square(self.interferer.y_m) + square(h);
        let quiet = in_noise(s, self.noise);
        let squared = |of: Placement| square(x - of.x_m) + square(h - of.altitude_m);
        let (before, after) = (squared(self.before.place), squared(self.after.place));
        let (incoming, outgoing) = (self.gain * quiet, self.received);
        if !self.is_both_ways() {
            return (incoming / before, outgoing / after);
        }
        (
            incoming.min(self.back.returned) / before,
            outgoing.min(self.back.gain * quiet) / after,
        )
    }

    fn is_both_ways(&self) -> bool {
        REVERSE && self.back.gain < f32::INFINITY
    }

    /// Returns the SIR of the worse of the two hops, with the relay at `at`. The paper calls it the local SIR.
    pub fn worse(&self, at: Placement) -> f32 {
        let (incoming, outgoing) = self.both(at);
        incoming.min(outgoing)
    }

    /// Returns true if the outgoing hop of the relay at `at` has a lower SIR than the incoming hop.
    fn is_out_worse(&self, at: Placement) -> bool {
        let (incoming, outgoing) = self.both(at);
        incoming > outgoing
    }

    /// Returns true if the relay at `at` keeps its minimum distance from both neighbours.
    fn is_clear(&self, at: Placement) -> bool {
        let clear = |of: HopEnd| {
            square(at.x_m - of.place.x_m) + square(at.altitude_m - of.place.altitude_m)
                >= square(of.apart_m)
        };
        clear(self.before) && clear(self.after)
    }
}

/// Search for a relay's best position between its two neighbours, in steps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LocalSearch {
    how: Local,
    hops: Hops,
    bottom_m: f32,
    top_m: f32,
    /// Lowest altitude that the current round of the coarse-to-fine search tries, m.
    low_m: f32,
    /// Highest altitude that the current round of the coarse-to-fine search tries, m.
    high_m: f32,
    round: u8,
    row: u8,
    column: u8,
    /// Altitude of the current round at which the worse hop is best, m, and the SIR of this hop.
    best_row: (f32, f32),
    /// Best position found so far; `None` if no position is better than the relay's current one.
    found: Option<Placement>,
    /// Linear SIR of the worse hop at `found`, or at the current position if `found` is `None`.
    best_sir: f32,
    /// Number of evaluations of both hops at the current altitude. The count stays 0 in a mission with data in one
    /// direction.
    evaluations: u16,
}

impl LocalSearch {
    /// Starts the search for the position at which the worse of the relay's two hops, `hops`, is best. The relay is at
    /// `at`.
    ///
    /// The search reaches up to `explore_m` metres above and below the present altitude. `band` is the lowest and the
    /// highest allowed altitude, m.
    pub fn new(how: Local, hops: Hops, at: Placement, explore_m: f32, band: (f32, f32)) -> Self {
        let low_m = (at.altitude_m - explore_m).max(band.0);
        let high_m = (at.altitude_m + explore_m).min(band.1);
        // A relay that is more than `explore_m` outside of the band has no allowed altitude.
        let nowhere = !(low_m <= high_m);
        Self {
            how,
            hops,
            bottom_m: low_m,
            top_m: high_m,
            low_m,
            high_m,
            round: if nowhere { ROUNDS } else { 0 },
            row: 0,
            column: if nowhere { u8::MAX } else { 0 },
            // If no altitude of a round is allowed, this one bounds the next round, so it must be inside the band.
            best_row: (at.altitude_m.max(low_m).min(high_m), -1.0),
            found: None,
            best_sir: hops.worse(at),
            evaluations: 0,
        }
    }

    /// Continues the search until at least `budget` evaluations of both hops are used. The call also completes the
    /// search at the current altitude, which can take 24 evaluations, or 194 for data in both directions.
    ///
    /// Ready at the end of the search, with the best position if it is strictly better than the current one.
    pub fn step(&mut self, budget: u16) -> Poll<Option<Placement>> {
        let mut left = budget;
        while left > 0 {
            let spent = match self.how {
                Local::Fine => self.fine(),
                Local::Grid { columns, rows } => self.point(columns, rows),
            };
            let Some(spent) = spent else {
                return Poll::Ready(self.found);
            };
            left = left.saturating_sub(spent);
        }
        Poll::Pending
    }

    /// Records `at` as the best position if it is better than all earlier positions. The relay at `at` must keep its
    /// minimum distance from both neighbours. Returns the SIR of the worse hop at this position, or -1 if the relay is
    /// too close to a neighbour.
    fn weigh(&mut self, at: Placement) -> f32 {
        self.record(at, self.hops.worse(at))
    }

    /// Records the position `at` as [`weigh`](Self::weigh) does. `sir` is the SIR of the worse hop there.
    fn record(&mut self, at: Placement, sir: f32) -> f32 {
        if !self.hops.is_clear(at) {
            return -1.0;
        }
        if sir > self.best_sir {
            self.best_sir = sir;
            self.found = Some(at);
        }
        sir
    }

    /// Returns an altitude in the range of the current round, m. `part` is 0 for the lowest altitude, 1 for the
    /// highest. Rounding never raises the result above the highest altitude.
    fn altitude(&self, part: f32) -> f32 {
        (self.low_m + (self.high_m - self.low_m) * part).min(self.high_m)
    }

    /// Searches the best x at the next altitude of the coarse-to-fine search. Returns the number of evaluations of both
    /// hops, or `None` after the last round.
    fn fine(&mut self) -> Option<u16> {
        if self.row >= ROWS {
            let (h, _) = self.best_row;
            let spacing = (self.high_m - self.low_m) / f32::from(ROWS - 1);
            self.low_m = (h - spacing).max(self.bottom_m);
            self.high_m = (h + spacing).min(self.top_m);
            self.best_row = (h, -1.0);
            self.row = 0;
            self.round += 1;
        }
        if self.round >= ROUNDS {
            return None;
        }
        self.evaluations = 0;
        let part = f32::from(self.row) / f32::from(ROWS - 1);
        let altitude_m = self.altitude(part);
        let sir = self.crossing(altitude_m);
        if sir > self.best_row.1 {
            self.best_row = (altitude_m, sir);
        }
        self.row += 1;
        Some(if self.hops.is_both_ways() {
            self.evaluations.max(1)
        } else {
            u16::from(HALVINGS) + 4
        })
    }

    /// Searches the best x at `altitude_m`. For data in one direction, both hops usually have equal SIRs at the best x.
    /// Returns the SIR of the worse hop at the best x found, or -1 if no x is allowed.
    fn crossing(&mut self, altitude_m: f32) -> f32 {
        let gap = |of: HopEnd| {
            let climb = altitude_m - of.place.altitude_m;
            // The distance must be sufficient after the position has been rounded.
            sqrt(square(of.apart_m) - square(climb)) + ROUNDING * of.place.x_m
        };
        let (before, after) = (self.hops.before, self.hops.after);
        let mut low = before.place.x_m + gap(before);
        let mut high = after.place.x_m - gap(after);
        if !(low <= high) {
            return -1.0;
        }
        if self.hops.is_both_ways() {
            let middle = self.hops.interferer.x_m.max(low).min(high);
            let side = self.peak(altitude_m, low, middle);
            return side.max(self.peak(altitude_m, middle, high));
        }
        let at = |x_m| Placement::on_line(x_m, altitude_m);
        // Beyond the interferer the incoming hop may improve with its length; then an end of the row is best.
        let ends = self.weigh(at(low)).max(self.weigh(at(high)));
        (low, high) = bisected(low, high, HALVINGS, |x_m| self.hops.is_out_worse(at(x_m)));
        ends.max(self.weigh(at(low))).max(self.weigh(at(high)))
    }

    /// Returns the best SIR of the worse hop for x in `low` to `high`, for data in both directions.
    ///
    /// The search evaluates evenly spaced x, and improves the best of them by steps, each half as long as the last. A
    /// maximum where the SIRs of both hops are equal can be narrower than the spacing, so the first two x with equal
    /// SIRs are searched by bisection.
    fn peak(&mut self, altitude_m: f32, low: f32, high: f32) -> f32 {
        let mut step = (high - low) / f32::from(SAMPLES);
        if !(step > 0.0) {
            return -1.0;
        }
        let place = |x_m: f32| Placement::on_line(x_m.max(low).min(high), altitude_m);
        let (mut best, mut top) = (-1.0, low);
        let mut crossings = [None; 2];
        let mut before = None;
        for at in 0..=SAMPLES {
            let x_m = low + step * f32::from(at);
            let (incoming, outgoing) = self.hops.both(place(x_m));
            let sir = self.record(place(x_m), incoming.min(outgoing));
            if sir > best {
                (best, top) = (sir, x_m);
            }
            let sign = incoming > outgoing;
            if before.is_some_and(|before| before != sign)
                && let Some(crossing) = crossings.iter_mut().find(|one| one.is_none())
            {
                *crossing = Some((x_m - step, x_m, sign));
            }
            before = Some(sign);
        }
        for _ in 0..HALVINGS {
            step *= 0.5;
            let from = top;
            for x_m in [from - step, from + step] {
                let sir = self.weigh(place(x_m));
                if sir > best {
                    (best, top) = (sir, x_m);
                }
            }
        }
        self.evaluations += u16::from(SAMPLES) + 1 + 2 * u16::from(HALVINGS);
        for (left, right, sign) in crossings.into_iter().flatten() {
            let (left, right) = bisected(left, right, HALVINGS, |x_m| {
                self.hops.is_out_worse(place(x_m)) != sign
            });
            best = best
                .max(self.weigh(place(left)))
                .max(self.weigh(place(right)));
            self.evaluations += u16::from(HALVINGS) + 2;
        }
        best
    }

    /// Evaluates the next position of the grid. Returns the number of evaluations, 1, or `None` after the last
    /// position.
    fn point(&mut self, columns: u8, rows: u8) -> Option<u16> {
        if self.row >= rows {
            self.row = 0;
            self.column += 1;
        }
        if self.column >= columns {
            return None;
        }
        let part = |at: u8, of: u8| f32::from(at) / f32::from(of.saturating_sub(1).max(1));
        let (from, to) = (self.hops.before.place.x_m, self.hops.after.place.x_m);
        _ = self.weigh(Placement::on_line(
            (from + (to - from) * part(self.column, columns)).min(to),
            self.altitude(part(self.row, rows)),
        ));
        self.row += 1;
        Some(1)
    }
}

#[cfg(test)]
mod tests {
    use core::task::Poll;

    use super::{HopEnd, Hops, Local, LocalSearch, WayBack};
    use crate::mission::Interferer;
    use crate::place::Placement;

    /// Returns a search for the best position of a relay between two neighbours 100 m apart. `altitude_m` is the
    /// relay's altitude, and `beside_m` the altitude of the neighbours. `apart_m` is the minimum separation, and `band`
    /// the allowed altitudes, m.
    fn search(altitude_m: f32, beside_m: f32, apart_m: f32, band: (f32, f32)) -> LocalSearch {
        let at = Placement::on_line;
        let beside = |x_m| HopEnd {
            place: at(x_m, beside_m),
            apart_m,
            power_w: 1.0,
        };
        let hops = Hops {
            before: beside(0.0),
            after: beside(100.0),
            gain: 1.0,
            received: 1e6,
            back: WayBack::NONE,
            interferer: Interferer {
                power_w: 1.0,
                x_m: 50.0,
                y_m: 10.0,
            },
            noise: 0.0,
        };
        LocalSearch::new(Local::Fine, hops, at(50.0, altitude_m), 1e5, band)
    }

    #[test]
    fn from_outside_the_band_it_ends_in_it_or_stays() {
        // With a small separation there is a free position in the band. With a large one there is none, and the relay
        // must stay.
        for (from_m, beside_m, apart_m, band, ends_m) in [
            (80_000.0, 20.0, 0.0, (20.0, 20.0), Some(20.0)),
            (80_000.0, 20.0, 150.0, (20.0, 20.0), None),
            (1.0, 500.0, 0.0, (200.0, 300.0), Some(300.0)),
            (1.0, 500.0, 400.0, (200.0, 300.0), None),
        ] {
            let mut search = search(from_m, beside_m, apart_m, band);
            let over = search.step(u16::MAX);
            let ended = over.map(|found| found.map(|at| at.altitude_m));
            assert_eq!(ended, Poll::Ready(ends_m), "from {from_m} m");
        }
    }

    #[test]
    fn the_highest_row_is_never_above_the_band() {
        let mut state = 1_u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from((state >> 16) as u16) / 7.0 + 0.1
        };
        let mut rounded_up = 0;
        for _ in 0..100_000 {
            let (one, other) = (random(), random());
            let (low_m, high_m) = (one.min(other), one.max(other));
            let top_m = search(low_m, low_m, 0.0, (low_m, high_m)).altitude(1.0);
            assert!(top_m <= high_m, "{top_m} above {high_m}");
            rounded_up += u32::from(low_m + (high_m - low_m) > high_m);
        }
        assert!(rounded_up > 1000, "{rounded_up}");
    }
}
