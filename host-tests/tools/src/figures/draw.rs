//! Draws a chart as SVG for half a page.
//!
//! At a width of 8 cm the smallest letters are 6.5 points high.

use std::fmt::Display;

use plotters::element::{DashedPathElement, Drawable, PointCollection};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters_backend::{BackendCoord, DrawingErrorKind};

use super::chart::{Chart, Line, Look, Panel, Scale, Signs, Stroke};

const WIDTH: u32 = 960;
const PANEL: u32 = 560;
const PANEL_OF_SEVERAL: u32 = 470;
const ROW: u32 = 44;
const GAP: u32 = 10;
const LETTER: u32 = 17;
const SAMPLE: u32 = 104;

const FONT: &str = "Helvetica, Arial, 'DejaVu Sans', sans-serif";
/// Font size of all text. The drawing library divides sizes by 1.24, hence the factor.
const LETTERS: f64 = 28.0 * 1.24;
const INK: RGBColor = RGBColor(34, 34, 34);
const GRID: RGBColor = RGBColor(205, 205, 205);
const FINE_GRID: RGBColor = RGBColor(236, 236, 236);
const PEN: u32 = 4;
const APART: f64 = 105.0;
/// Shift of a curve's markers along the curve for each colour number, in picture units.
///
/// The markers of curves that coincide are then next to each other.
const APART_BY_HUE: u8 = 25;

/// Error: the chart cannot be drawn, for this reason.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NotDrawn(pub String);

impl NotDrawn {
    fn from(error: impl Display) -> Self {
        Self(error.to_string())
    }
}

/// Draws `chart` as SVG text; `title` is read by screen readers.
pub fn draw(chart: &Chart, title: &str) -> Result<String, NotDrawn> {
    if !chart.is_drawable() {
        return Err(NotDrawn(
            "a value is not finite, or not above 0 on a logarithmic axis".to_owned(),
        ));
    }
    let entries = entries(chart);
    let columns = columns(&entries);
    let rows = u32::try_from(entries.len().div_ceil(columns)).unwrap_or(u32::MAX);
    let panel = match chart.panels.len() {
        1 => PANEL,
        _ => PANEL_OF_SEVERAL,
    };
    let plots = panel * u32::try_from(chart.panels.len()).unwrap_or(1);
    let height = plots + rows * ROW + 2 * GAP;
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE).map_err(NotDrawn::from)?;
        let (above, below) = root.split_vertically(plots);
        for (area, panel) in above
            .split_evenly((chart.panels.len(), 1))
            .iter()
            .zip(&chart.panels)
        {
            draw_panel(area, panel)?;
        }
        draw_legend(&below, &entries, columns)?;
        root.present().map_err(NotDrawn::from)?;
    }
    Ok(with_title(&svg, title))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn letters(colour: RGBColor) -> TextStyle<'static> {
    (FONT, LETTERS).into_font().color(&colour)
}

fn draw_panel(area: &Area<'_>, panel: &Panel) -> Result<(), NotDrawn> {
    let points = || panel.lines.iter().flat_map(|line| &line.points);
    let x = panel.x.scale(points().map(|point| point.0));
    let y = panel.y.scale(points().map(|point| point.1));
    let mut builder = ChartBuilder::on(area);
    builder
        .margin_top(16)
        .margin_left(8)
        .margin_right(48)
        .x_label_area_size(92)
        .y_label_area_size(128);
    if !panel.heading.is_empty() {
        builder.caption(&panel.heading, letters(INK));
    }
    let mut plot = builder.build_cartesian_2d(x, y).map_err(NotDrawn::from)?;
    plot.configure_mesh()
        .bold_line_style(GRID.stroke_width(2))
        .light_line_style(FINE_GRID.stroke_width(2))
        .axis_style(INK.stroke_width(3))
        .label_style(letters(INK))
        .axis_desc_style(letters(INK))
        .set_all_tick_mark_size(8)
        .x_label_formatter(&|value| x.label(*value))
        .y_label_formatter(&|value| y.label(*value))
        .x_desc(&panel.x.title)
        .y_desc(&panel.y.title)
        .draw()
        .map_err(NotDrawn::from)?;
    for line in &panel.lines {
        draw_line(&mut plot, line)?;
    }
    Ok(())
}

type Plot<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Scale, Scale>>;

fn draw_line(plot: &mut Plot<'_, '_>, line: &Line) -> Result<(), NotDrawn> {
    let colour = colour_of_hue(line.look.hue);
    let points = line.points.iter().copied();
    match dash(line.look.stroke) {
        None => {}
        Some((_, 0)) => {
            plot.draw_series(LineSeries::new(points, colour.stroke_width(PEN)))
                .map_err(NotDrawn::from)?;
        }
        Some((size, gap)) => {
            plot.draw_series(DashedLineSeries::new(
                points,
                size,
                gap,
                colour.stroke_width(PEN),
            ))
            .map_err(NotDrawn::from)?;
        }
    }
    let hue = line.look.hue;
    let signed = signed(plot, line);
    plot.draw_series(signed.into_iter().map(|at| Sign { at, hue }))
        .map_err(NotDrawn::from)?;
    Ok(())
}

fn signed(plot: &Plot<'_, '_>, line: &Line) -> Vec<(f64, f64)> {
    match line.look.signs {
        Signs::None => Vec::new(),
        Signs::All => line.points.clone(),
        Signs::Spaced => {
            let mut signed = Vec::new();
            // A different offset for each colour keeps the markers of overlapping curves apart.
            let mut since =
                APART - f64::from(APART_BY_HUE * u8::try_from(line.look.hue).unwrap_or(0));
            let mut before: Option<(i32, i32)> = None;
            for &point in &line.points {
                let (x, y) = plot.backend_coord(&point);
                if let Some((old_x, old_y)) = before {
                    since += f64::from(x - old_x).hypot(f64::from(y - old_y));
                }
                before = Some((x, y));
                if since >= APART {
                    signed.push(point);
                    since = 0.0;
                }
            }
            if since >= APART / 3.0 {
                signed.extend(line.points.last());
            }
            signed
        }
    }
}

/// Returns the lengths of a stroke's dashes and gaps, in picture units; `None` for no line.
///
/// A solid line has gaps of 0.
const fn dash(stroke: Stroke) -> Option<(i32, i32)> {
    match stroke {
        Stroke::None => None,
        Stroke::Full => Some((0, 0)),
        Stroke::Dashed => Some((18, 10)),
        Stroke::Dotted => Some((5, 8)),
    }
}

/// Returns the entries of the legend: each name once, with the style of its first curve.
fn entries(chart: &Chart) -> Vec<(&str, Look)> {
    let mut entries: Vec<(&str, Look)> = Vec::new();
    for line in chart.panels.iter().flat_map(|panel| &panel.lines) {
        if !line.name.is_empty() && entries.iter().all(|(name, _)| *name != line.name) {
            entries.push((&line.name, line.look));
        }
    }
    entries
}

fn columns(entries: &[(&str, Look)]) -> usize {
    let letters = entries.iter().map(|(name, _)| name.chars().count()).max();
    let widest = SAMPLE + LETTER * u32::try_from(letters.unwrap_or(0)).unwrap_or(0);
    usize::try_from((WIDTH - 40) / widest.max(1))
        .unwrap_or(1)
        .clamp(1, entries.len().max(1))
}

fn draw_legend(area: &Area<'_>, entries: &[(&str, Look)], columns: usize) -> Result<(), NotDrawn> {
    let column = (WIDTH - 40) / u32::try_from(columns).unwrap_or(1);
    for (index, (name, look)) in (0_u32..).zip(entries) {
        let columns = u32::try_from(columns).unwrap_or(1);
        let place = |units: u32| i32::try_from(units).unwrap_or(0);
        let x = place(40 + index % columns * column);
        let y = place(GAP + ROW / 2 + index / columns * ROW);
        let colour = colour_of_hue(look.hue);
        let sample = [(x, y), (x + 76, y)];
        match dash(look.stroke) {
            None => {}
            Some((_, 0)) => area
                .draw(&PathElement::new(sample, colour.stroke_width(PEN)))
                .map_err(NotDrawn::from)?,
            Some((size, gap)) => area
                .draw(&DashedPathElement::new(
                    sample,
                    size,
                    gap,
                    colour.stroke_width(PEN),
                ))
                .map_err(NotDrawn::from)?,
        }
        if look.signs != Signs::None {
            area.draw(&Sign {
                at: (x + 38, y),
                hue: look.hue,
            })
            .map_err(NotDrawn::from)?;
        }
        let words = letters(INK).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(name, &words, (x + 92, y))
            .map_err(NotDrawn::from)?;
    }
    Ok(())
}

fn with_title(svg: &str, title: &str) -> String {
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    match svg.split_once(">\n") {
        Some((head, body)) => format!("{head} role=\"img\">\n<title>{title}</title>\n{body}"),
        None => svg.to_owned(),
    }
}

/// Colours of the curves: the palette of Okabe and Ito, beginning with black, without its yellow.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 0, 0),
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
];

const SIZE: i32 = 9;

/// Returns the colour with the number `hue`. The numbers start again after the last colour.
pub(super) fn colour_of_hue(hue: usize) -> RGBColor {
    let [black, ..] = COLOURS;
    COLOURS.get(hue % COLOURS.len()).copied().unwrap_or(black)
}

/// Marker of a point, with a shape for each colour.
///
/// The shapes are disc, square, diamond, triangle, cross, ring and inverted triangle.
pub(super) struct Sign<C> {
    pub(super) at: C,
    pub(super) hue: usize,
}

impl<'a, C> PointCollection<'a, C> for &'a Sign<C> {
    type Point = &'a C;
    type IntoIter = std::iter::Once<&'a C>;

    fn point_iter(self) -> Self::IntoIter {
        std::iter::once(&self.at)
    }
}

impl<C, B: DrawingBackend> Drawable<B> for Sign<C> {
    fn draw<I: Iterator<Item = BackendCoord>>(
        &self,
        mut places: I,
        backend: &mut B,
        _: (u32, u32),
    ) -> Result<(), DrawingErrorKind<B::ErrorType>> {
        let Some((x, y)) = places.next() else {
            return Ok(());
        };
        let colour = colour_of_hue(self.hue);
        let corners: &[BackendCoord] = match self.hue % COLOURS.len() {
            0 => return backend.draw_circle((x, y), SIZE.unsigned_abs(), &colour, true),
            4 => return cross(backend, (x, y), &colour.stroke_width(5)),
            5 => {
                let rim = colour.stroke_width(4);
                return backend.draw_circle((x, y), SIZE.unsigned_abs(), &rim, false);
            }
            1 => &[(-8, -8), (8, -8), (8, 8), (-8, 8)],
            2 => &[(0, -12), (12, 0), (0, 12), (-12, 0)],
            3 => &[(0, -11), (10, 7), (-10, 7)],
            _ => &[(0, 11), (10, -7), (-10, -7)],
        };
        let around = corners.iter().map(|(dx, dy)| (x + dx, y + dy));
        backend.fill_polygon(around, &colour)
    }
}

fn cross<B: DrawingBackend>(
    backend: &mut B,
    (x, y): BackendCoord,
    style: &ShapeStyle,
) -> Result<(), DrawingErrorKind<B::ErrorType>> {
    backend.draw_line((x - SIZE, y - SIZE), (x + SIZE, y + SIZE), style)?;
    backend.draw_line((x - SIZE, y + SIZE), (x + SIZE, y - SIZE), style)
}
