//! Description of a chart: panels, axes and curves.

use std::ops::Range;

use plotters::coord::ranged1d::{
    KeyPointHint, KeyPointWeight, NoDefaultFormatting, Ranged, ValueFormatter,
};

/// Chart: one or more panels below each other, with one legend.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Chart {
    /// Panels of the chart from top to bottom, each with its own axes.
    pub panels: Vec<Panel>,
}

/// Panel of a chart: a pair of axes and the curves drawn in it.
#[derive(Clone, PartialEq, Debug)]
pub struct Panel {
    /// Heading that distinguishes the panels of a chart; empty for a single panel.
    pub heading: String,
    /// Horizontal axis of the panel.
    pub x: Axis,
    /// Vertical axis of the panel.
    pub y: Axis,
    /// Curves in drawing order; later curves are on top.
    pub lines: Vec<Line>,
}

/// Axis of a chart's panel.
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    /// Label of the axis: quantity and unit.
    pub title: String,
    /// Scale of the axis, linear or logarithmic.
    pub kind: Kind,
    /// Values at the two ends of the axis; `None` to fit the data.
    pub ends: Option<(f64, f64)>,
}

/// Curve of a chart: a series of points with a name and a style.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// Name of the curve in the legend.
    ///
    /// Curves of the same name share one entry, in the style of the first.
    pub name: String,
    /// Style of the curve: colour, stroke and markers.
    pub look: Look,
    /// Points of the curve in drawing order, all finite.
    pub points: Vec<(f64, f64)>,
}

/// Style of a curve: colour, stroke and markers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Look {
    /// Number of the colour, 0 to 6. The number also selects the shape of the markers.
    pub hue: usize,
    /// Stroke between the curve's points: full, dashed or dotted.
    pub stroke: Stroke,
    /// Choice of the points that have a marker.
    pub signs: Signs,
}

/// Points of a curve that have a marker.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signs {
    /// Curve without markers.
    None,
    /// Marker at every point.
    All,
    /// Markers at points that are not too close to each other in the picture, and at the last point.
    Spaced,
}

/// Stroke of the line between the points of a curve.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stroke {
    /// Points are not connected; only their markers are drawn.
    None,
    /// Solid line through the points.
    Full,
    /// Dashed line through the points.
    Dashed,
    /// Dotted line through the points.
    Dotted,
}

impl Axis {
    /// Creates a linear axis with the label `title`. Its ends fit the data.
    pub fn linear(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kind: Kind::Linear,
            ends: None,
        }
    }

    /// Creates a logarithmic axis with the label `title`. Its ends fit the data.
    pub fn log(title: &str) -> Self {
        Self {
            kind: Kind::Log,
            ..Self::linear(title)
        }
    }

    /// Sets the values at the two ends of the axis.
    pub fn between(self, from: f64, to: f64) -> Self {
        Self {
            ends: Some((from, to)),
            ..self
        }
    }

    pub(super) fn scale(&self, values: impl Iterator<Item = f64> + Clone) -> Scale {
        if let Some((from, to)) = self.ends {
            return Scale::new(self.kind, from, to);
        }
        let least = values.clone().reduce(f64::min).unwrap_or(1.0);
        let most = values.reduce(f64::max).unwrap_or(1.0);
        Scale::around(self.kind, least, most)
    }
}

impl Look {
    /// Returns the style of curve number `index` of a chart, from 0.
    ///
    /// Consecutive styles differ in colour, marker and stroke.
    pub const fn number(index: usize) -> Self {
        let stroke = match index % 3 {
            0 => Stroke::Full,
            1 => Stroke::Dashed,
            _ => Stroke::Dotted,
        };
        Self {
            hue: index,
            stroke,
            signs: Signs::All,
        }
    }

    /// Returns the style with markers at only some of the points ([`Signs::Spaced`]).
    pub const fn spaced(self) -> Self {
        Self {
            signs: Signs::Spaced,
            ..self
        }
    }

    /// Returns the style without markers.
    pub const fn unsigned(self) -> Self {
        Self {
            signs: Signs::None,
            ..self
        }
    }

    /// Returns the style with the stroke `stroke` between the points.
    pub const fn joined(self, stroke: Stroke) -> Self {
        Self { stroke, ..self }
    }
}

impl Line {
    /// Creates a curve through `points`, with a name for the legend.
    pub fn new(name: &str, look: Look, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.to_owned(),
            look,
            points: points.into_iter().collect(),
        }
    }
}

impl Chart {
    /// Creates a chart with a single panel.
    pub fn of(x: Axis, y: Axis, lines: Vec<Line>) -> Self {
        Self {
            panels: vec![Panel {
                heading: String::new(),
                x,
                y,
                lines,
            }],
        }
    }

    /// Returns true if all points are finite, and positive on logarithmic axes.
    pub fn is_drawable(&self) -> bool {
        let fits = |axis: &Axis, value: f64| {
            value.is_finite() && (axis.kind == Kind::Linear || value > 0.0)
        };
        self.panels.iter().all(|panel| {
            let mut points = panel.lines.iter().flat_map(|line| &line.points);
            points.all(|&(x, y)| fits(&panel.x, x) && fits(&panel.y, y))
        })
    }
}

const STEPS: f64 = 6.0;

/// Largest number of decades of an axis that has tick labels at 1, 2 and 5 times a power of ten.
///
/// A longer axis has labels at powers of ten only.
const FEW_DECADES: f64 = 2.4;

/// Largest distance of a tick beyond the end of an axis, due to rounding, as a fraction of the axis.
const ROUNDING: f64 = 1e-9;

/// Scale of an axis, linear or logarithmic.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Linear axis.
    Linear,
    /// Logarithmic axis; all its values are above 0.
    Log,
}

/// Axis with known ends. It positions and labels its ticks.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Scale {
    kind: Kind,
    from: f64,
    to: f64,
}

impl Scale {
    /// Creates an axis that begins at `from` and ends at `to`.
    ///
    /// Both are finite, `from` < `to`, and positive on a logarithmic axis.
    pub const fn new(kind: Kind, from: f64, to: f64) -> Self {
        Self { kind, from, to }
    }

    /// Creates an axis for data from `least` to `most`. Its ends are the next round numbers outside of this range.
    pub fn around(kind: Kind, least: f64, most: f64) -> Self {
        match kind {
            Kind::Linear => {
                let step = step(most - least);
                let from = (least / step + ROUNDING).floor() * step;
                let to = (most / step - ROUNDING).ceil() * step;
                Self::new(kind, from, to.max(from + step))
            }
            Kind::Log => {
                let from = round_number(least * (1.0 + ROUNDING), false);
                let to = round_number(most * (1.0 - ROUNDING), true);
                Self::new(kind, from, to.max(2.0 * from))
            }
        }
    }

    /// Returns the label of a tick at `value`.
    ///
    /// A logarithmic axis has large numbers in thousands (k) and millions (M).
    pub fn label(&self, value: f64) -> String {
        match self.kind {
            Kind::Log if value >= 1e6 => digits(value / 1e6) + " M",
            Kind::Log if value >= 1e4 => digits(value / 1e3) + " k",
            _ => digits(value),
        }
    }

    fn part(&self, value: f64) -> f64 {
        match self.kind {
            Kind::Linear => (value - self.from) / (self.to - self.from),
            Kind::Log => (value / self.from).ln() / (self.to / self.from).ln(),
        }
    }

    fn holds(&self, value: f64) -> bool {
        (-ROUNDING..=1.0 + ROUNDING).contains(&self.part(value))
    }

    fn ticks(&self) -> Vec<f64> {
        match self.kind {
            Kind::Linear => {
                let step = step(self.to - self.from);
                let first = (self.from / step).floor();
                (0..20)
                    .map(|k| (first + f64::from(k)) * step)
                    .filter(|value| self.holds(*value))
                    .collect()
            }
            Kind::Log if (self.to / self.from).log10() <= FEW_DECADES => {
                self.in_decades(&[1.0, 2.0, 5.0])
            }
            Kind::Log => self.in_decades(&[1.0]),
        }
    }

    fn minor(&self) -> Vec<f64> {
        match self.kind {
            Kind::Linear => Vec::new(),
            Kind::Log => self.in_decades(&[2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]),
        }
    }

    /// Returns the products of `multiples` and powers of ten that lie on the axis, in rising order.
    fn in_decades(&self, multiples: &[f64]) -> Vec<f64> {
        let (first, last) = (decade(self.from), decade(self.to));
        (first..=last)
            .flat_map(|exponent| multiples.iter().map(move |of| of * 10_f64.powi(exponent)))
            .filter(|value| self.holds(*value))
            .collect()
    }
}

/// Returns the exponent of the largest power of ten that is at most `value`, a number above 0.
#[expect(clippy::cast_possible_truncation, reason = "the exponent of an f64")]
fn decade(value: f64) -> i32 {
    (value.log10() + ROUNDING).floor() as i32
}

/// Returns the distance between ticks on an axis of length `span`: 1, 2 or 5 times a power of ten.
fn step(span: f64) -> f64 {
    let least = span.max(f64::MIN_POSITIVE) / STEPS;
    round_number(least * (1.0 - ROUNDING), true)
}

/// Rounds `value` to 1, 2 or 5 times a power of ten, upward if `up`, otherwise downward.
fn round_number(value: f64, up: bool) -> f64 {
    let power = 10_f64.powi(decade(value));
    let mut candidates = [1.0, 2.0, 5.0, 10.0].map(|of| of * power).into_iter();
    if up {
        candidates.find(|candidate| *candidate >= value)
    } else {
        candidates.rfind(|candidate| *candidate <= value)
    }
    .unwrap_or(power)
}

fn digits(value: f64) -> String {
    if value.abs() < 1e-12 {
        return "0".to_owned();
    }
    // No step has more than four digits after its first digit.
    let decimals = usize::try_from(4 - decade(value.abs())).unwrap_or(0);
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    #[expect(clippy::cast_possible_truncation, reason = "a place on the canvas")]
    fn map(&self, value: &f64, (low, high): (i32, i32)) -> i32 {
        low + (f64::from(high - low) * self.part(*value)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match hint.weight() {
            KeyPointWeight::Bold => self.ticks(),
            KeyPointWeight::Any => self.minor(),
        }
    }

    fn range(&self) -> Range<f64> {
        self.from..self.to
    }
}

impl ValueFormatter<f64> for Scale {
    fn format(value: &f64) -> String {
        digits(*value)
    }
}
