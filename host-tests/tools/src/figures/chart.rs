//! Description of a chart before it is drawn: panels, axes and lines.

use std::ops::Range;

use plotters::coord::ranged1d::{
    KeyPointHint, KeyPointWeight, NoDefaultFormatting, Ranged, ValueFormatter,
};

/// Panels, stacked vertically, that share one legend.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Chart {
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
}

/// A pair of axes and its lines.
#[derive(Clone, PartialEq, Debug)]
pub struct Panel {
    /// Heading that distinguishes the panel; empty for a single panel.
    pub heading: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Lines; later ones are drawn on top.
    pub lines: Vec<Line>,
}

/// An axis.
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub title: String,
    /// Linear or logarithmic.
    pub kind: Kind,
    /// End values; `None` to fit the data.
    pub ends: Option<(f64, f64)>,
}

/// A series of points.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// Name in the legend; lines of the same name share one entry, with the look of the first.
    pub name: String,
    /// Colour, stroke and signs.
    pub look: Look,
    /// Points, all finite, in drawing order.
    pub points: Vec<(f64, f64)>,
}

/// Look of a line. Lines of a chart differ in every field, so that no single one has to be recognised.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Look {
    /// Index of the colour and its sign, 0 to 6.
    pub hue: usize,
    /// Stroke between the points.
    pub stroke: Stroke,
    /// Points that are drawn with a marker.
    pub signs: Signs,
}

/// Points of a line that have a sign.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signs {
    /// Draws no signs.
    None,
    /// Every point.
    All,
    /// Points well apart in the picture, and the last one.
    Spaced,
}

/// Stroke between points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stroke {
    /// Draws only the signs.
    None,
    /// Solid line.
    Full,
    /// Dashed line.
    Dashed,
    /// Dotted line.
    Dotted,
}

impl Axis {
    /// Creates a linear axis.
    pub fn linear(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kind: Kind::Linear,
            ends: None,
        }
    }

    /// Creates a logarithmic axis.
    pub fn log(title: &str) -> Self {
        Self {
            kind: Kind::Log,
            ..Self::linear(title)
        }
    }

    /// Sets the ends of the axis.
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
    /// Returns look number `index`: colour, sign and stroke change from one to the next.
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

    /// Draws signs well apart.
    pub const fn spaced(self) -> Self {
        Self {
            signs: Signs::Spaced,
            ..self
        }
    }

    /// Draws no signs.
    pub const fn unsigned(self) -> Self {
        Self {
            signs: Signs::None,
            ..self
        }
    }

    /// Sets the stroke.
    pub const fn joined(self, stroke: Stroke) -> Self {
        Self { stroke, ..self }
    }
}

impl Line {
    /// Creates a line through `points`.
    pub fn new(name: &str, look: Look, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.to_owned(),
            look,
            points: points.into_iter().collect(),
        }
    }
}

impl Chart {
    /// Creates a chart with one panel.
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

    /// Returns true if all numbers are finite, and positive on logarithmic axes.
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

/// Number of decades up to which 2 and 5 are labelled on a logarithmic axis.
const FEW_DECADES: f64 = 2.4;

/// Tolerance of ticks beyond an end, as a fraction of the axis.
const ROUNDING: f64 = 1e-9;

/// Kind of axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// Linear axis.
    Linear,
    /// Logarithmic; all values above 0.
    Log,
}

/// An axis with fixed ends.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Scale {
    kind: Kind,
    from: f64,
    to: f64,
}

impl Scale {
    /// Creates an axis from `from` to `to`, finite, `from` < `to`, and positive on a logarithmic axis.
    pub const fn new(kind: Kind, from: f64, to: f64) -> Self {
        Self { kind, from, to }
    }

    /// Creates an axis that contains `least` to `most`, widened to the next round numbers.
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

    /// Returns a tick label; large numbers of a logarithmic axis in thousands (k) and millions (M).
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

    /// Returns these multiples of every power of ten within the axis, rising.
    fn in_decades(&self, multiples: &[f64]) -> Vec<f64> {
        let (first, last) = (decade(self.from), decade(self.to));
        (first..=last)
            .flat_map(|exponent| multiples.iter().map(move |of| of * 10_f64.powi(exponent)))
            .filter(|value| self.holds(*value))
            .collect()
    }
}

/// Returns the exponent of the power of ten at or below `value` > 0.
#[expect(clippy::cast_possible_truncation, reason = "the exponent of an f64")]
fn decade(value: f64) -> i32 {
    (value.log10() + ROUNDING).floor() as i32
}

/// Returns the step between ticks over `span`: 1, 2 or 5 times a power of ten.
fn step(span: f64) -> f64 {
    let least = span.max(f64::MIN_POSITIVE) / STEPS;
    round_number(least * (1.0 - ROUNDING), true)
}

/// Rounds up or down to 1, 2 or 5 times a power of ten.
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
    // Four digits after the first one are more than any step has.
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
