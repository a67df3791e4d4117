//! Colours that colour-blind readers can distinguish, each with a sign for print without colours.

use plotters::element::{Drawable, PointCollection};
use plotters::prelude::*;
use plotters_backend::{BackendCoord, DrawingErrorKind};

/// Palette of Okabe and Ito, darkest first, without yellow, which is faint on paper.
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

/// Returns colour number `hue`, modulo the palette.
pub(super) fn colour(hue: usize) -> RGBColor {
    let [black, ..] = COLOURS;
    COLOURS.get(hue % COLOURS.len()).copied().unwrap_or(black)
}

/// The sign of a hue: disc, square, diamond, triangle, cross, ring, inverted triangle.
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
        let colour = colour(self.hue);
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
