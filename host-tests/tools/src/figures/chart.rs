//! What a chart shows, before it is drawn: panels one above the other, their axes and lines.

use super::scale::{Kind, Scale};

/// Panels one above the other that share one legend.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Chart {
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

/// One pair of axes, and what is drawn between them.
#[derive(Clone, PartialEq, Debug)]
pub struct Panel {
    /// What distinguishes it from the other panels; empty for a chart of one.
    pub heading: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The lines; later ones lie above.
    pub lines: Vec<Line>,
}

/// What an axis measures.
#[derive(Clone, PartialEq, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub title: String,
    /// How values go along it.
    pub kind: Kind,
    /// Its ends; where there are none, those of what it has to hold.
    pub ends: Option<(f64, f64)>,
}

/// Points, joined or not.
#[derive(Clone, PartialEq, Debug)]
pub struct Line {
    /// What the legend says; lines of one name have one entry, with the look of the first.
    pub name: String,
    /// How it is told from the others.
    pub look: Look,
    /// Finite numbers, in the order in which they are joined.
    pub points: Vec<(f64, f64)>,
}

/// How a line looks: each of these differs between the lines of a chart, so that none of them alone has to be seen.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Look {
    /// Which colour, and which sign with it: 0 to 6.
    pub hue: usize,
    /// How the points are joined.
    pub stroke: Stroke,
    /// Which points have a sign.
    pub signs: Signs,
}

/// Which points of a line have the sign of its colour.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Signs {
    /// None.
    None,
    /// Every one.
    All,
    /// Some, well apart in the picture, and the last.
    Spaced,
}

/// How points are joined.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Stroke {
    /// Not at all.
    None,
    /// A full line.
    Full,
    /// A line of dashes.
    Dashed,
    /// A line of dots.
    Dotted,
}

impl Axis {
    /// An even axis.
    pub fn linear(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            kind: Kind::Linear,
            ends: None,
        }
    }

    /// A logarithmic axis.
    pub fn log(title: &str) -> Self {
        Self {
            kind: Kind::Log,
            ..Self::linear(title)
        }
    }

    /// The same, from `from` to `to`.
    pub fn between(self, from: f64, to: f64) -> Self {
        Self {
            ends: Some((from, to)),
            ..self
        }
    }

    /// The axis as it is drawn, for `values`.
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
    /// The look of the line number `index` of several: colour, sign and stroke change from one to the next.
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

    /// The same with signs well apart.
    pub const fn spaced(self) -> Self {
        Self {
            signs: Signs::Spaced,
            ..self
        }
    }

    /// The same without a sign.
    pub const fn unsigned(self) -> Self {
        Self {
            signs: Signs::None,
            ..self
        }
    }

    /// The same with its points joined like that.
    pub const fn joined(self, stroke: Stroke) -> Self {
        Self { stroke, ..self }
    }
}

impl Line {
    /// A line through `points`.
    pub fn new(name: &str, look: Look, points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self {
            name: name.to_owned(),
            look,
            points: points.into_iter().collect(),
        }
    }
}

impl Chart {
    /// A chart of one panel.
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

    /// Whether every number in it is finite, and above 0 where it goes on a logarithmic axis.
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
