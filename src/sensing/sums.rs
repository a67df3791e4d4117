//! Sums of the measurements, collected by a pass along the chain: eighteen numbers for the fit.
//!
//! `Terms` are the terms of a position. 1 / I is a linear combination of them, and a source has one coefficient for
//! each. A [`Level`] is the interference at an end of the chain, on the ground, within the measurable range of powers.
//! A `Listener` has the measurements of one relay: the average at its position, and faded sums of earlier positions.

use crate::mission::{Interferer, Mission};
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::square;
use crate::time::{Duration, Instant};

/// Range of measurable interference power, W, without the receiver's noise.
///
/// Powers outside of the range are rejected. Within the range, the square of a value is finite in the units of
/// [`sensing`](crate::sensing), and so is the square of the ratio of two values.
pub const MEASURED_W: (f32, f32) = (1e-30, 1e6);

/// Mean interference power that was measured at Tx or at Rx, and the number of its measurements.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Level {
    /// Mean interference power at this ground station, W; 0 without a measurement.
    pub power_w: f32,
    /// Number of measurements in the mean; an older measurement counts as less than one.
    pub count: f32,
}

/// Flags for the levels measured at Tx and Rx: true if a level does not fit the relays' measurements.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct EndsOff {
    pub(crate) transmitter: bool,
    pub(crate) receiver: bool,
    /// True if the measurements at Tx and Rx contradict each other. It is unknown which of the two is faulty.
    pub(crate) unknown: bool,
}

impl EndsOff {
    pub(crate) const NONE: Self = Self {
        transmitter: false,
        receiver: false,
        unknown: false,
    };
}

/// Interference levels measured at Tx and Rx, and the result of their last check. The check compares them with the
/// relays' measurements.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Levels {
    pub(crate) transmitter: Level,
    pub(crate) receiver: Level,
    pub(crate) off: EndsOff,
}

impl Level {
    pub(crate) fn is_sound(self) -> bool {
        is_power(self.power_w) && (0.0..=1e9).contains(&self.count)
    }

    pub(crate) fn is_heard(self) -> bool {
        self.power_w > 0.0 && self.count > 0.0
    }
}

/// Returns true if `power_w` is a valid interference level, W, or 0, which stands for no measurement.
pub(crate) fn is_power(power_w: f32) -> bool {
    power_w.to_bits() == 0 || is_level(power_w)
}

/// Returns true if `power_w` is within the measurable range of interference power, [`MEASURED_W`].
pub(crate) fn is_level(power_w: f32) -> bool {
    (MEASURED_W.0..=MEASURED_W.1).contains(&power_w)
}

/// Four terms of a position. The inverse interference of a source is a linear combination of them. The terms are 1, u,
/// u^2 - 1/3 + t^2 + z^2 and t, with u = 2 x / D - 1, t = 2 y / D, z = 2 h / D, and D the distance from Tx to Rx.
pub(crate) type Terms = [f32; 4];

/// Returns the four terms of the position `at`. A source's inverse interference there is a linear combination of
/// them. `distance_m` is the distance from Tx to Rx.
pub(crate) fn terms(distance_m: f32, at: Placement) -> Terms {
    let half = 0.5 * distance_m;
    let (u, t, z) = (at.x_m / half - 1.0, at.y_m / half, at.altitude_m / half);
    [1.0, u, u * u - 1.0 / 3.0 + t * t + z * z, t]
}

/// Unit of interference power, W. Measurements are used as v = 1e-12 W / I. The unit is in the middle of the measurable
/// range, so that the square of v is within the range of an f32.
pub(crate) const UNIT_W: f32 = 1e-12;

/// Range of v = 1e-12 W / I for the measurable range of the interference I, [`MEASURED_W`].
const V: (f32, f32) = (1e-18, 1e18);

/// Converts an expected v = 1e-12 W / I (I is the interference power) to f32. `None` outside of the measurable range.
pub(crate) fn expected_v(v: f64) -> Option<f32> {
    let (least, most) = (f64::from(V.0), f64::from(V.1));
    #[expect(
        clippy::cast_possible_truncation,
        reason = "within the range of an f32"
    )]
    (least..=most).contains(&v).then_some(v as f32)
}

/// Converts a source's power to its strength k = eta D^2 [`UNIT_W`] / (4 P). The same formula converts a strength to a
/// power. P is `power_w`, in W, eta the mission's path-loss factor to the ground, and D its distance from Tx to Rx.
pub(crate) fn strength(mission: &Mission, power_w: f64) -> f64 {
    let config = mission.config();
    let d = f64::from(config.distance_m);
    0.25 * config.channel.eta() * d * d * f64::from(UNIT_W) / power_w
}

/// Returns the four coefficients of `source`, which turn a position's terms into v = 1e-12 W / I. The coefficients are
/// k (X'^2 + Y'^2 + 1/3), -2 k X', k and -2 k Y'. X' and Y' are the position in units of half the distance from Tx to
/// Rx, and k is the [`strength`].
pub(crate) fn coefficients(mission: &Mission, source: &Interferer) -> [f64; 4] {
    let config = mission.config();
    let half = 0.5 * f64::from(config.distance_m);
    let k = strength(mission, f64::from(source.power_w));
    let (x, y) = (
        f64::from(source.x_m) / half - 1.0,
        f64::from(source.y_m) / half,
    );
    [
        k * (x * x + y * y + 1.0 / 3.0),
        -2.0 * k * x,
        k,
        -2.0 * k * y,
    ]
}

pub(crate) fn value(coefficients: &[f64; 4], terms: &Terms) -> f64 {
    let [a, b, c, d] = coefficients;
    let [one, u, q, t] = terms.map(f64::from);
    a * one + b * u + c * q + d * t
}

/// Number of sums that a sensing pass collects. The sums are over products of terms, terms times v, v squared, number
/// of positions, number of measurements, and age.
pub const SUMS: usize = 18;

/// Weighted sums over the measured positions, from which the interferer is estimated.
///
/// The sums for each position: w a b for every two of the four terms a and b, w a v for each term, w v^2, the
/// position's share, its number of measurements, and its share times its age in seconds. The share is 1 for a new
/// position and fades. The weight w is 2 (v / e)^(1/2) / (v^2 + e^2), with the measured v and the expected value e of
/// v. w is 1 / e^2 if v equals e. Errors that are equal in decibels have equal weights, and no position dominates the
/// sums.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sums {
    pub(crate) numbers: [f32; SUMS],
}

/// Limit of each sum of measurements, which keeps it finite.
const MOST: f32 = 1e38;

fn within(sum: f32) -> f32 {
    sum.clamp(-MOST, MOST)
}

impl Sums {
    /// Sums before any measurement: all of them are zero.
    pub const NONE: Self = Self {
        numbers: [0.0; SUMS],
    };

    /// Adds a measured position with its `terms`, the measured `v`, and the `expected` v, both above 0. v is 1e-12 W /
    /// I, with the interference power I. The position's weight is computed from `v` and `expected`, and multiplied by
    /// `share`. `measured` is the number of measurements at the position. At most 60 instructions.
    pub(crate) fn add(&mut self, terms: &Terms, v: f32, expected: f32, share: f32, measured: f32) {
        let even = sqrt(v / expected);
        let weight = 2.0 * share * even / (v * v + expected * expected);
        let [a, b, c, d] = *terms;
        let row = [
            a * a,
            a * b,
            a * c,
            a * d,
            b * b,
            b * c,
            b * d,
            c * c,
            c * d,
            d * d,
            a * v,
            b * v,
            c * v,
            d * v,
            v * v,
        ];
        for (sum, number) in self.numbers.iter_mut().zip(row) {
            *sum = within(*sum + weight * number);
        }
        let [.., count, measurements, _] = &mut self.numbers;
        *count += share;
        *measurements += share * measured;
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        for (sum, number) in self.numbers.iter_mut().zip(other.numbers) {
            *sum = within(*sum + number);
        }
    }

    /// Adds `seconds` to the age of all measurements in the sums, and multiplies their weight by `share`.
    pub(crate) fn fade(&mut self, share: f32, seconds: f32) {
        let [.., count, _, age] = &mut self.numbers;
        *age += *count * seconds;
        for sum in &mut self.numbers {
            *sum *= share;
        }
    }

    /// Returns the number of measured positions in the sums. Older positions count less.
    pub fn count(&self) -> f32 {
        let [.., count, _, _] = self.numbers;
        count
    }

    /// Returns the mean number of measurements per measured position.
    pub(crate) fn measured(&self) -> f32 {
        let [.., count, measured, _] = self.numbers;
        if count > 0.0 { measured / count } else { 0.0 }
    }

    pub(crate) fn weight(&self) -> f32 {
        let [weight, ..] = self.numbers;
        weight
    }

    /// Returns the mean age of the measurements in the sums, s.
    pub fn age_s(&self) -> f32 {
        let [.., count, _, age] = self.numbers;
        if count > 0.0 { age / count } else { 0.0 }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "what is too old, or no number, is cut"
    )]
    pub(crate) fn age_us(&self) -> u64 {
        (self.age_s() * 1e6) as u64
    }

    /// Returns true if these sums are possible: all are finite, and sums of squares are not negative.
    pub(crate) fn is_sound(&self) -> bool {
        let [aa, .., vv, count, measurements, age] = self.numbers;
        self.numbers.iter().all(|number| number.is_finite())
            && [aa, vv, count, measurements, age]
                .iter()
                .all(|number| *number >= 0.0)
    }
}

/// Minimum distance between two positions that count as different. It is a fraction of the distance from Tx to Rx.
const APART: f32 = 1.0 / 200.0;

/// Measurements of one relay: the mean at its current position, and the sums of its earlier positions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listener {
    half_life: Duration,
    past: Sums,
    faded: Instant,
    /// Mean of the positions at which the relay measured since it last moved.
    at: Placement,
    /// Mean interference measured at the relay's current position, in units of `UNIT_W`.
    heard: Average,
}

/// Current position of a relay, as terms for the fit, and the measurement there. The measurement is v = 1e-12 W / I,
/// with the interference power I.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) terms: Terms,
    pub(crate) v: f32,
}

impl Listener {
    pub(crate) const fn new(half_life: Duration, now: Instant) -> Self {
        Self {
            half_life,
            past: Sums::NONE,
            faded: now,
            at: Placement::on_line(0.0, 0.0),
            heard: Average::NONE,
        }
    }

    pub(crate) const fn half_life(&self) -> Duration {
        self.half_life
    }

    /// Adds a measurement of the interference at the position `at`. `heard` is the measured power, above 0, in units of
    /// [`UNIT_W`]. `expected` returns the 1e-12 W / I that the current estimate predicts for the terms of a position;
    /// the weights need it.
    pub(crate) fn add(
        &mut self,
        now: Instant,
        distance_m: f32,
        at: Placement,
        heard: f32,
        expected: impl Fn(&Terms) -> Option<f32>,
    ) {
        let off = square(at.x_m - self.at.x_m)
            + square(at.y_m - self.at.y_m)
            + square(at.altitude_m - self.at.altitude_m);
        if !(off <= square(APART * distance_m)) {
            self.past = self.sums(now, distance_m, expected);
            self.faded = now;
            self.at = at;
            self.heard = Average::NONE;
        }
        self.heard.add(now, self.half_life, heard);
        let share = 1.0 / self.heard.weight;
        self.at.x_m += (at.x_m - self.at.x_m) * share;
        self.at.y_m += (at.y_m - self.at.y_m) * share;
        self.at.altitude_m += (at.altitude_m - self.at.altitude_m) * share;
    }

    pub(crate) fn place(&self, distance_m: f32) -> Option<Place> {
        (self.heard.mean > 0.0).then(|| Place {
            terms: terms(distance_m, self.at),
            v: 1.0 / self.heard.mean,
        })
    }

    /// Returns the sums of all measurements, with weights and ages as of `now`. `expected` returns the v = 1e-12 W / I
    /// that the current estimate predicts for the terms of a position.
    pub(crate) fn sums(
        &self,
        now: Instant,
        distance_m: f32,
        expected: impl Fn(&Terms) -> Option<f32>,
    ) -> Sums {
        let mut sums = self.past;
        self.fade(&mut sums, now.since(self.faded));
        if let Some(place) = self.place(distance_m) {
            let mut own = Sums::NONE;
            let expected = expected(&place.terms).unwrap_or(place.v);
            own.add(&place.terms, place.v, expected, 1.0, self.heard.weight);
            own.fade(1.0, self.heard.behind_s);
            self.fade(&mut own, now.since(self.heard.last));
            sums.merge(&own);
        }
        sums
    }

    fn fade(&self, sums: &mut Sums, age: Duration) {
        let seconds = age.as_micros() as f32 * 1e-6;
        sums.fade(left(age, self.half_life), seconds);
    }

    /// Discards the sums of measurements at earlier positions.
    pub(crate) const fn forget_past(&mut self) {
        self.past = Sums::NONE;
    }
}

/// Returns the fraction of a measurement's weight, 1 to 0, that remains at the age `age`.
pub(crate) fn left(age: Duration, half_life: Duration) -> f32 {
    libm::exp2f(-(age.as_micros() as f32 / half_life.as_micros() as f32))
}

/// Exponentially weighted mean of measurements, whose weight halves in each half-life.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Average {
    /// Weighted mean of the measured values; 0 without any.
    pub(crate) mean: f32,
    pub(crate) weight: f32,
    pub(crate) last: Instant,
    /// Mean age of the measurements as of the time `last`, s, weighted like the mean.
    pub(crate) behind_s: f32,
}

impl Average {
    pub(crate) const NONE: Self = Self {
        mean: 0.0,
        weight: 0.0,
        last: Instant::ZERO,
        behind_s: 0.0,
    };

    pub(crate) fn add(&mut self, now: Instant, half_life: Duration, value: f32) {
        let age = now.since(self.last);
        let before = self.weight * left(age, half_life);
        self.weight = before + 1.0;
        let seconds = age.as_micros() as f32 * 1e-6;
        self.behind_s = (self.behind_s + seconds) * before / self.weight;
        self.mean += (value - self.mean) / self.weight;
        self.last = now;
    }
}

#[cfg(all(test, feature = "sensing"))]
mod tests {
    use super::{UNIT_W, coefficients, strength, terms, value};
    use crate::mission::tests::paper;
    use crate::mission::{Interferer, Mission};
    use crate::place::Placement;

    /// Checks that a source's coefficients give the inverse interference of the channel model. The
    /// interference is P / (eta l^2) for a source of P watts at the distance l.
    #[test]
    fn coefficients_are_those_of_the_channel_model() {
        let mission = Mission::try_new(paper(3)).unwrap();
        let source = Interferer {
            power_w: 7.0,
            x_m: 640.0,
            y_m: -90.0,
        };
        let known = coefficients(&mission, &source);
        let eta = mission.config().channel.eta();
        for (x_m, y_m, altitude_m) in [(0.0, 0.0, 20.0), (600.0, -80.0, 35.0), (990.0, 300.0, 5.0)]
        {
            let at = Placement {
                x_m,
                y_m,
                altitude_m,
            };
            let squared = f64::from(x_m - source.x_m).powi(2)
                + f64::from(y_m - source.y_m).powi(2)
                + f64::from(altitude_m).powi(2);
            let interference_w = f64::from(source.power_w) / (eta * squared);
            let expected = f64::from(UNIT_W) / interference_w;
            let v = value(&known, &terms(mission.config().distance_m, at));
            assert!((v / expected - 1.0).abs() < 1e-4, "{v} {expected}");
        }
        let k = strength(&mission, 7.0);
        assert!((strength(&mission, k) / 7.0 - 1.0).abs() < 1e-12);
    }
}
