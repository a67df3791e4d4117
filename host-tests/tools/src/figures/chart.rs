//! Description of a chart before it is drawn: panels, axes and lines.

use super::scale::{Kind, Scale};

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
    /// Points that have a sign.
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

    /// Sets the end values.
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
