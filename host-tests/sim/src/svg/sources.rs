//! Interferers: symbols on the ground if they are within the plot, else arrows toward them.

use super::canvas::{Area, Canvas, Frame, Labels, Point, width};
use super::picture::{LEFT, OtherInterferers, Picture, RIGHT, TOP, length, near};

/// Font size of the labels of interferers, in picture units.
const SIZE: f64 = 10.0;
/// Distance between two lines of text in labels of interferers, in picture units.
const LINE: f64 = 12.0;

/// Largest number of interferers that each have a label. If there are more interferers, all of them have one common
/// label.
const CROWD: usize = 8;

/// Largest number of lines of text about interferers outside the plot.
const FAR_LINES: usize = 4;

/// Interferer: transmit power, W, x from Tx toward Rx, m, and y to the right as seen from Tx, m.
type Source = (f64, f64, f64);

/// Splits interferers into two lists: within the plot, and outside. Values that are not finite are left out.
///
/// `distance` is the distance from Tx to Rx, m.
fn sorted(all: &[Source], distance: f64) -> (Vec<Source>, Vec<Source>) {
    let known = |(power, x, y): &Source| [power, x, y].iter().all(|part| part.is_finite());
    all.iter()
        .copied()
        .filter(known)
        .partition(|(_, x, _)| near(*x, distance))
}

/// Returns the height of the text about interferers outside the plot, in picture units.
pub(super) fn headroom(picture: &Picture) -> f64 {
    let (_, far) = sorted(&picture.interferers, length(picture));
    far.len().min(FAR_LINES) as f64 * LINE
}

/// Draws interferers in the side view: symbols on the ground or, outside the plot, arrows with a text.
pub(super) fn draw(canvas: &mut Canvas, labels: &mut Labels, frame: &Frame, picture: &Picture) {
    let (inside, far) = sorted(&picture.interferers, length(picture));
    draw_distant(canvas, labels, &far);
    let ground = frame.h.at(0.0);
    for (power, x, y) in inside {
        let at = frame.x.at(x);
        let tip = format!("interferer: {}", description((power, x, y)));
        let class = if y == 0.0 { "source" } else { "source beside" };
        canvas.marked(&diamond((at, ground)), class, &tip);
        labels.take(Area::around((at, ground - 3.0), (12.0, 6.0)));
    }
}

pub(super) fn diamond((x, y): Point) -> [Point; 4] {
    [(x, y - 6.0), (x + 6.0, y), (x, y + 6.0), (x - 6.0, y)]
}

/// Returns an arrow for an interferer outside of the vertical range of the view from above.
///
/// `down` is true at the lower edge of the view, where the arrow points down, and false at the upper edge.
fn arrow((x, y): Point, down: bool) -> [Point; 3] {
    let inward = if down { -1.0 } else { 1.0 };
    let (tip, back) = (y + 2.0 * inward, y + 10.0 * inward);
    [(x, tip), (x - 4.5, back), (x + 4.5, back)]
}

/// Returns true if the side view shows an interferer that is beside the line. The legend then explains its symbol.
pub(super) fn has_beside(picture: &Picture) -> bool {
    let (inside, _) = sorted(&picture.interferers, length(picture));
    inside.iter().any(|(_, _, y)| *y != 0.0)
}

fn description((power, x, y): Source) -> String {
    format!("{} W, x = {} m, y = {} m", plain(power), plain(x), plain(y))
}

/// Returns the earlier or estimated interferers to draw, each with its x in picture units.
///
/// An earlier interferer is left out if the symbol of a present interferer would cover it.
fn past_or_estimated(picture: &Picture, frame: &Frame) -> Vec<(f64, Source)> {
    let (inside, _) = sorted(&picture.interferers, length(picture));
    let (before, _) = sorted(&picture.others, length(picture));
    let all = before
        .into_iter()
        .map(|source| (frame.x.at(source.1), source));
    all.filter(|(at, _)| {
        let covers = |(_, x, _): &Source| (frame.x.at(*x) - at).abs() < 12.0;
        picture.others_are == OtherInterferers::NewEstimate || !inside.iter().any(covers)
    })
    .collect()
}

pub(super) fn others(canvas: &mut Canvas, labels: &mut Labels, frame: &Frame, picture: &Picture) {
    let ground = frame.h.at(0.0);
    for (at, source) in past_or_estimated(picture, frame) {
        let tip = format!("{}: {}", picture.others_are.tip(), description(source));
        canvas.marked(&diamond((at, ground)), "before", &tip);
        labels.take(Area::around((at, ground - 3.0), (12.0, 6.0)));
    }
}

pub(super) fn label_others(
    canvas: &mut Canvas,
    labels: &mut Labels,
    frame: &Frame,
    picture: &Picture,
) {
    let ground = frame.h.at(0.0);
    let word = picture.others_are.word();
    for (at, _) in past_or_estimated(picture, frame) {
        let place = (at, ground - 13.0);
        if labels.try_take(Area::around(place, (width(word, SIZE) + 2.0, LINE))) {
            canvas.text((place.0, place.1 + 0.36 * SIZE), "faint halo", word);
        }
    }
}

/// Labels the interferers in the side view. All other labels near the ground must be placed before this call.
pub(super) fn label(canvas: &mut Canvas, labels: &mut Labels, frame: &Frame, picture: &Picture) {
    let (mut inside, _) = sorted(&picture.interferers, length(picture));
    let ground = frame.h.at(0.0);
    if inside.len() > CROWD {
        let span = |part: fn(&Source) -> f64| {
            let parts = || inside.iter().map(part);
            let (low, high) = (
                parts().fold(f64::INFINITY, f64::min),
                parts().fold(0.0, f64::max),
            );
            if low < high {
                format!("{} to {}", plain(low), plain(high))
            } else {
                plain(high)
            }
        };
        let (powers, offsets) = (span(|(power, _, _)| *power), span(|(_, _, y)| y.abs()));
        let words = format!(
            "{} interferers, {powers} W, |y| = {offsets} m",
            inside.len()
        );
        let at = (f64::midpoint(LEFT, RIGHT), ground - 14.0);
        labels.take(Area::around(at, (width(&words, SIZE), LINE)));
        canvas.text((at.0, at.1 + 0.36 * SIZE), "halo", &words);
        return;
    }
    inside.sort_by(|a, b| a.1.total_cmp(&b.1));
    let xs: Vec<f64> = inside.iter().map(|(_, x, _)| frame.x.at(*x)).collect();
    for ((power, x, y), at) in inside.iter().zip(&xs) {
        let lines = [
            format!("{} W", plain(*power)),
            format!("|y| = {} m", plain(y.abs())),
        ];
        let wide = lines
            .iter()
            .map(|line| width(line, SIZE))
            .fold(0.0, f64::max)
            + 4.0;
        // With a neighbour on one side only, shift the label to the other side.
        let crowded = |side: f64| {
            xs.iter()
                .any(|other| (0.1..wide).contains(&(side * (other - at))))
        };
        let lean = f64::from(i8::from(crowded(-1.0)) - i8::from(crowded(1.0)));
        draw_label(
            canvas,
            labels,
            (frame.x.at(*x), ground),
            (lines, wide),
            lean,
        );
    }
}

/// Symbols of interferers in the view from above: position, label, and style of the label.
pub(super) type PlacedLabels = Vec<(Point, String, &'static str)>;

/// Draws the interferers in the view from above and returns their labels.
///
/// Interferers beyond the vertical range are arrows at the edge.
pub(super) fn from_above(
    canvas: &mut Canvas,
    labels: &mut Labels,
    frame: &Frame,
    picture: &Picture,
) -> PlacedLabels {
    let mut seen = Vec::new();
    for (all, class, tip) in [
        (&picture.others, "before", picture.others_are.tip()),
        (&picture.interferers, "source", "interferer"),
    ] {
        let (inside, _) = sorted(all, length(picture));
        for source @ (power, x, y) in inside {
            let at = frame.at((x, y));
            let tip = format!("{tip}: {}", description(source));
            let beyond = if frame.h.holds(y) {
                canvas.marked(&diamond(at), class, &tip);
                String::new()
            } else {
                canvas.marked(&arrow(at, y > 0.0), class, &tip);
                format!(", y = {} m", plain(y))
            };
            labels.take(Area::around(at, (12.0, 12.0)));
            seen.push(if class == "before" {
                (at, picture.others_are.word().to_owned(), "faint halo")
            } else {
                (at, format!("{} W{beyond}", plain(power)), "halo")
            });
        }
    }
    seen
}

/// Writes the labels `seen` of the interferers in the view from above, where there is free space.
pub(super) fn label_from_above(canvas: &mut Canvas, labels: &mut Labels, seen: &PlacedLabels) {
    for ((x, y), words, class) in seen {
        let wide = width(words, SIZE) + 4.0;
        let (aside, clear) = (0.5 * wide + 8.0, 7.0 + 0.5 * LINE);
        let places = [
            (*x, y + clear),
            (*x, y - clear),
            (x + aside, *y),
            (x - aside, *y),
        ];
        let free = |at: &Point| labels.try_take(Area::around(*at, (wide, LINE)));
        if let Some(at) = places.into_iter().find(free) {
            canvas.text((at.0, at.1 + 0.36 * SIZE), class, words);
        }
    }
}

/// Writes two lines of text above an interferer's symbol, as low as possible.
///
/// If the text is far above the symbol, a line connects them. `lean` is the direction, -1 to 1, in which to move the
/// text if it is crowded.
fn draw_label(
    canvas: &mut Canvas,
    labels: &mut Labels,
    (x, ground): Point,
    (lines, wide): ([String; 2], f64),
    lean: f64,
) {
    let size = (wide, 2.0 * LINE);
    let places = (0..5).flat_map(|row| {
        let height = ground - 20.0 - 13.0 * f64::from(row);
        [0.5 * lean, 0.0, 0.5, -0.5].map(|shift| (x + shift * wide, height))
    });
    for (middle, y) in places {
        let place = (
            middle
                .min(RIGHT - wide / 2.0 - 1.0)
                .max(LEFT + wide / 2.0 + 1.0),
            y,
        );
        let foot = (
            x.min(place.0 + wide / 2.0).max(place.0 - wide / 2.0),
            y + LINE,
        );
        let start = (x, ground - 8.0);
        let tie = [start, foot];
        let apart = ground - foot.1 > 12.0;
        if (apart && !labels.clear(&tie)) || !labels.try_take(Area::around(place, size)) {
            continue;
        }
        if apart {
            labels.take_line(tie);
            canvas.line(start, foot, "leader");
        }
        for (line, words) in [-0.5, 0.5].into_iter().zip(&lines) {
            canvas.text(
                (place.0, place.1 + line * LINE + 0.36 * SIZE),
                "halo",
                words,
            );
        }
        return;
    }
}

/// Writes a line of text for each interferer outside the plot, with an arrow toward it.
fn draw_distant(canvas: &mut Canvas, labels: &mut Labels, far: &[Source]) {
    let shown = if far.len() > FAR_LINES {
        FAR_LINES - 1
    } else {
        far.len()
    };
    let mut y = TOP + 0.5 * LINE;
    for (power, x, offset) in far.iter().take(shown) {
        let words = format!(
            "interferer {} W, x = {} m, |y| = {} m",
            plain(*power),
            plain(*x),
            plain(offset.abs())
        );
        let (edge, inward, class) = if *x < 0.0 {
            (LEFT, 1.0, "start halo")
        } else {
            (RIGHT, -1.0, "end halo")
        };
        let (tip, back) = (edge + inward * 3.0, edge + inward * 11.0);
        canvas.marked(
            &[(tip, y), (back, y - 4.5), (back, y + 4.5)],
            "source",
            &words,
        );
        canvas.text((edge + inward * 16.0, y + 0.36 * SIZE), class, &words);
        let wide = width(&words, SIZE) + 18.0;
        labels.take(Area::around((edge + inward * wide / 2.0, y), (wide, LINE)));
        y += LINE;
    }
    if far.len() > shown {
        let words = format!("and {} interferers more beyond the plot", far.len() - shown);
        canvas.text((RIGHT - 3.0, y + 0.36 * SIZE), "end halo", &words);
        let wide = width(&words, SIZE) + 6.0;
        labels.take(Area::around((RIGHT - wide / 2.0, y), (wide, LINE)));
    }
}

/// Formats a quantity with about four digits, without zeros at the end.
fn plain(value: f64) -> String {
    let size = value.abs();
    if size > 0.0 && !(1e-2..1e6).contains(&size) {
        let text = format!("{value:.2e}");
        return text.replace(".00e", "e");
    }
    let text = if size < 100.0 {
        format!("{value:.2}")
    } else {
        format!("{value:.0}")
    };
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}
