//! Scales from metres to picture coordinates, and axes with round ticks.

use super::canvas::{Canvas, Point};

/// Linear map from a quantity to a picture coordinate.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    from: (f64, f64),
    to: (f64, f64),
}

/// Scales of a plot: along the line, and the height or, in the top view, the lateral offset.
pub(super) struct Frame {
    pub(super) x: Scale,
    pub(super) h: Scale,
}

impl Scale {
    pub(super) const fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        Self { from, to }
    }

    /// Returns the coordinate of a quantity, limited to the scale's ends.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = ((value - self.from.0) / (self.from.1 - self.from.0)).clamp(0.0, 1.0);
        self.to.0 + share * (self.to.1 - self.to.0)
    }

    /// Returns true if a quantity is on the scale.
    pub(super) fn holds(&self, value: f64) -> bool {
        (self.from.0..=self.from.1).contains(&value)
    }

    /// Returns about `most` round ticks and their number of decimals.
    fn ticks(&self, most: f64) -> (Vec<f64>, usize) {
        let step = round_step((self.from.1 - self.from.0) / most);
        let first = (self.from.0 / step).ceil();
        let ticks = (0..50).map(|count| (first + f64::from(count)) * step + 0.0);
        let mut decimals = 0;
        let mut scaled = step;
        while scaled < 0.999 && decimals < 12 {
            scaled *= 10.0;
            decimals += 1;
        }
        (
            ticks.take_while(|tick| *tick <= self.from.1).collect(),
            decimals,
        )
    }
}

impl Frame {
    pub(super) fn at(&self, (x, h): (f64, f64)) -> Point {
        (self.x.at(x), self.h.at(h))
    }
}

/// Returns the smallest of 1, 2 and 5 times a power of ten that is at least `least`.
pub(super) fn round_step(least: f64) -> f64 {
    let power = 10.0_f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|digit| digit * power);
    // The tolerance allows for the rounding of the power of ten.
    steps
        .into_iter()
        .find(|step| *step >= 0.999_999 * least)
        .unwrap_or(10.0 * power)
}

/// Draws the grid and the axes; `upright` is the name of the vertical axis.
pub(super) fn draw(canvas: &mut Canvas, frame: &Frame, upright: &str) {
    let (left, right) = frame.x.to;
    let (low, high) = frame.h.to;
    let (bottom, top) = (low.max(high), low.min(high));
    let (ticks, decimals) = frame.h.ticks(8.0);
    for tick in ticks {
        let y = frame.h.at(tick);
        canvas.line((left, y), (right, y), "grid");
        canvas.line((left - 4.0, y), (left, y), "tick");
        canvas.text((left - 7.0, y + 3.5), "end", &format!("{tick:.decimals$}"));
    }
    let (ticks, decimals) = frame.x.ticks(8.0);
    for tick in ticks {
        let x = frame.x.at(tick);
        canvas.line((x, bottom), (x, bottom + 4.0), "tick");
        canvas.text((x, bottom + 15.0), "tick", &format!("{tick:.decimals$}"));
    }
    canvas.line((left, top), (left, bottom), "axis");
    canvas.line((left, bottom), (right, bottom), "axis");
    canvas.text((f64::midpoint(left, right), bottom + 31.0), "axis", "x (m)");
    canvas.upward((14.0, f64::midpoint(top, bottom)), "axis", upright);
}
