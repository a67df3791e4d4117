//! Picture of the chain as a self-contained SVG file.
//!
//! A side view; and a top view if relays may leave the line or an interferer is beside it. The markup is written by hand, without
//! a crate: there are few shapes, and the same run gives the same bytes.

mod canvas;
mod nodes;
mod picture;
mod sources;

use canvas::{Area, Canvas, Frame, Labels, Scale, width};
use nodes::{CLASSES, cross};
use picture::{
    ABOVE, BOTTOM, LEFT, RIGHT, TOP, WIDTH, bottom, decibels, length, near, placed, worst,
};
pub use picture::{LateralView, OtherInterferers, Picture, lateral_view};
use sources::{diamond, has_beside};

/// Draws the chain as an SVG document: from the side and, if `lateral_view` is given, from above.
///
/// Numbers that would overlap are omitted, but every hop and relay has a tooltip. The work is at most quadratic in the
/// number of relays.
#[must_use]
pub fn draw(picture: &Picture) -> String {
    let frame = frame(picture);
    let mut canvas = Canvas::new(WIDTH, bottom(picture) + events_height(picture));
    let mut labels = Labels::inside((LEFT, TOP), (RIGHT, BOTTOM));
    let hops = nodes::hops(picture, &frame);
    canvas.describe(&format!("Relay chain: {}", summary(picture)));
    title(&mut canvas, picture);
    canvas::draw_axes(&mut canvas, &frame, "h (m)");
    nodes::draw_hops(&mut canvas, &mut labels, &hops);
    nodes::relays(&mut canvas, &mut labels, &frame, picture, "h");
    sources::others(&mut canvas, &mut labels, &frame, picture);
    sources::draw(&mut canvas, &mut labels, &frame, picture);
    nodes::ends(&mut canvas, &mut labels, &frame, length(picture));
    sources::label(&mut canvas, &mut labels, &frame, picture);
    sources::label_others(&mut canvas, &mut labels, &frame, picture);
    nodes::label_hops(&mut canvas, &mut labels, &hops);
    nodes::label(&mut canvas, &mut labels, &frame, picture);
    if let Some(view) = &picture.lateral_view {
        draw_above(&mut canvas, &frame, picture, view);
    }
    draw_legend(&mut canvas, picture);
    draw_events(&mut canvas, picture);
    canvas.finish()
}

/// Returns the scales of the side view's axes.
///
/// The x axis includes the chain, and all interferers whose x is -0.2 to 1.2 times the distance from Tx to Rx. The
/// height axis begins at the ground.
fn frame(picture: &Picture) -> Frame {
    let distance = length(picture);
    let (mut low, mut high, mut top) = (0.0_f64, distance, 0.0_f64);
    for (_, (x, h)) in placed(picture) {
        // Limit x so that a relay far off the line (a bug elsewhere) does not shrink the rest to a dot.
        let x = x.clamp(-distance, 2.0 * distance);
        (low, high, top) = (low.min(x), high.max(x), top.max(h));
    }
    for (_, x, _) in picture.interferers.iter().chain(&picture.others) {
        if near(*x, distance) {
            (low, high) = (low.min(*x), high.max(*x));
        }
    }
    let margin = 0.07 * (high - low);
    // Room above the highest relay for its numbers and for the text about far interferers.
    let share = 1.0 - (46.0 + sources::headroom(picture)) / (BOTTOM - TOP);
    let top = if top > 0.0 { top / share } else { 1.0 };
    Frame {
        x: Scale::new((low - margin, high + margin), (LEFT, RIGHT)),
        h: Scale::new((0.0, top), (BOTTOM, TOP)),
    }
}

/// Returns a summary of the picture for its title, which screen readers read: method, relays and SIR.
fn summary(picture: &Picture) -> String {
    let sir = worst(picture).map_or_else(|| "unknown".to_owned(), both_units);
    format!(
        "{}, {}, chain SIR {sir}",
        picture.title_method,
        count(picture)
    )
}

/// Formats the number of relays: "N = 8", or "6 of 8" if some have left the chain.
fn count(picture: &Picture) -> String {
    let all = picture.nodes.len();
    if picture.left_out.is_empty() {
        format!("N = {all}")
    } else {
        let left = (1..=all).filter(|number| !picture.left_out.contains(number));
        format!("{} of {all}", left.count())
    }
}

fn both_units(sir: f64) -> String {
    let linear = if (1e-3..1e5).contains(&sir) {
        format!("{sir:.4}")
    } else {
        format!("{sir:.3e}")
    };
    format!("{linear} ({:.2} dB)", decibels(sir).unwrap_or_default())
}

fn title(canvas: &mut Canvas, picture: &Picture) {
    let relays = if picture.nodes.len() == 1 {
        "relay"
    } else {
        "relays"
    };
    let method: String = picture.title_method.chars().take(50).collect();
    let middle = f64::midpoint(LEFT, RIGHT);
    canvas.text(
        (middle, 18.0),
        "title",
        &format!("{method}, {} {relays}", count(picture)),
    );
    let sir = worst(picture).map_or_else(|| "unknown".to_owned(), both_units);
    canvas.subscripted(
        (middle, 35.0),
        "subtitle",
        ("SIR", "S", &format!("= {sir}")),
    );
}

/// Upper edge of the view from above, in picture units. It lies below the axis of the side view.
const PLOT_TOP: f64 = BOTTOM + 52.0;
/// Lower edge of the view from above, in picture units.
const PLOT_BOTTOM: f64 = BOTTOM + ABOVE;

const SIZE: f64 = 10.0;

/// Largest lateral offset of an interferer in the view from above, as a multiple of the relays' limit.
///
/// An interferer farther away is an arrow at the edge.
const FARTHEST: f64 = 2.0;

/// Lateral size of the view from above, toward an arrow that stands for a distant interferer.
///
/// The size is a fraction of the distance from Tx to Rx, and leaves space for the arrow. It is used if relays must stay
/// on the line, because the view then shows no lateral limits.
const TOWARD_FAR: f64 = 0.4;

/// Draws the view from above. `side` has the scale of x in the side view; `view` has the relays' lateral offsets.
fn draw_above(canvas: &mut Canvas, side: &Frame, picture: &Picture, view: &LateralView) {
    let xs = picture.nodes.iter().map(|(x, _)| *x);
    let ys = view.y_m.iter().copied().chain(std::iter::repeat(f64::NAN));
    let seen = Picture {
        nodes: xs.zip(ys).collect(),
        ..picture.clone()
    };
    let frame = Frame {
        x: side.x,
        h: upright(&seen, view),
    };
    canvas.text((LEFT, TOP - 5.0), "start", "from the side");
    canvas.text((LEFT, PLOT_TOP - 5.0), "start", "from above");
    let mut labels = Labels::inside((LEFT, PLOT_TOP), (RIGHT, PLOT_BOTTOM));
    canvas::draw_axes(canvas, &frame, "y (m)");
    let edges = [view.least_m, view.most_m].map(|y| frame.h.at(y));
    for edge in edges.into_iter().filter(|_| !view.is_line()) {
        canvas.edge((LEFT, edge), (RIGHT, edge));
    }
    let hops = nodes::hops(&seen, &frame);
    nodes::draw_hops(canvas, &mut labels, &hops);
    nodes::relays(canvas, &mut labels, &frame, &seen, "y");
    ends(canvas, &mut labels, &frame, length(&seen));
    let placed = sources::from_above(canvas, &mut labels, &frame, &seen);
    sources::label_from_above(canvas, &mut labels, &placed);
    nodes::label_hops(canvas, &mut labels, &hops);
    if view.is_line() {
        nodes::label(canvas, &mut labels, &frame, &seen);
        return;
    }
    // Labels with a halo may cover an edge; labels without one may not.
    for edge in edges {
        labels.take_line([(LEFT, edge), (RIGHT, edge)]);
    }
    nodes::label(canvas, &mut labels, &frame, &seen);
    label(canvas, &mut labels, edges);
}

/// Returns the vertical scale of the view from above.
///
/// It includes the relays, their lateral limits, and the interferers that are not too far away.
fn upright(seen: &Picture, view: &LateralView) -> Scale {
    let (mut low, mut high) = (view.least_m.min(0.0), view.most_m.max(0.0));
    let reach = if view.is_line() {
        length(seen)
    } else {
        FARTHEST * high.max(-low).max(1e-3)
    };
    let relays = seen.nodes.iter().map(|(_, y)| *y);
    let interferers = seen.interferers.iter().chain(&seen.others);
    let sources = interferers.filter(|(_, x, _)| near(*x, length(seen)));
    let sources = sources.map(|(_, _, y)| *y).filter(|y| y.is_finite());
    for y in relays.chain(sources) {
        let shown = match y {
            y if y.abs() <= reach => y,
            y if view.is_line() => (TOWARD_FAR * reach).copysign(y),
            _ => continue,
        };
        (low, high) = (low.min(shown), high.max(shown));
    }
    let margin = 0.12 * (high - low).max(1e-3);
    Scale::new((low - margin, high + margin), (PLOT_TOP, PLOT_BOTTOM))
}

fn ends(canvas: &mut Canvas, labels: &mut Labels, frame: &Frame, distance: f64) {
    for (name, x, side) in [("Tx", 0.0, -1.0), ("Rx", distance, 1.0)] {
        let (x, y) = frame.at((x, 0.0));
        let corners = [(-4.5, -4.5), (4.5, -4.5), (4.5, 4.5), (-4.5, 4.5)];
        canvas.shape(&corners.map(|(dx, dy)| (x + dx, y + dy)), "ground");
        labels.take(Area::around((x, y), (9.0, 9.0)));
        let at = (x + side * 14.0, y);
        labels.take(Area::around(at, (16.0, 10.0)));
        canvas.text((at.0, at.1 + 3.6), "bold halo", name);
    }
}

/// Labels the dashed lateral limits of the relays near the left or right end, if there is free space.
///
/// `left` and `right` are the vertical coordinates of the two limits.
fn label(canvas: &mut Canvas, labels: &mut Labels, [left, right]: [f64; 2]) {
    let words = "limits of the lateral range";
    let size = (width(words, SIZE) + 4.0, SIZE + 1.0);
    let columns = [RIGHT - 0.5 * size.0 - 3.0, LEFT + 0.5 * size.0 + 3.0];
    let rows = [right + 8.5, left - 8.5, right - 8.5, left + 8.5];
    let mut places = rows.into_iter().flat_map(|y| columns.map(|x| (x, y)));
    if let Some((x, y)) = places.find(|at| labels.try_take(Area::around(*at, size))) {
        canvas.text((x, y + 0.36 * SIZE), "faint", words);
    }
}

fn draw_legend(canvas: &mut Canvas, picture: &Picture) {
    let row = bottom(picture) - 27.0;
    canvas.text((24.0, row + 3.6), "start", "Hop SIR above the worst hop's:");
    for ((_, colour, width, words), left) in CLASSES.into_iter().zip([188.0, 264.0, 333.0, 402.0]) {
        canvas.swatch((left, row), 18.0, (colour, width));
        canvas.text((left + 22.0, row + 3.6), "start", words);
    }
    let row = bottom(picture) - 10.0;
    if picture.hop_sir_back.is_empty() {
        canvas.text((24.0, row + 3.6), "start", "Numbers at hops: SIR in dB");
    } else {
        canvas.text((24.0, row + 3.6), "start", "At hops: SIR to Rx / back, dB");
    }
    canvas.disc((180.0, row), 4.0, "relay");
    canvas.text((192.0, row + 3.6), "start", "relay");
    let silent = !picture.lost.is_empty();
    if silent || !picture.left_out.is_empty() {
        canvas.disc((240.0, row), 4.0, "relay lost");
        cross(canvas, (240.0, row), 5.5);
        let words = if silent { "silent" } else { "lost" };
        canvas.text((252.0, row + 3.6), "start", words);
    }
    if picture.interferers.is_empty() {
        return;
    }
    canvas.shape(&diamond((306.0, row)), "source");
    canvas.text((316.0, row + 3.6), "start", "interferer");
    if has_beside(picture) {
        canvas.shape(&diamond((384.0, row)), "beside");
        canvas.text((394.0, row + 3.6), "start", "beside the line");
    }
}

const STRIP: f64 = 84.0;

/// Distance of the horizontal line with the events from the bottom of the legend, in picture units.
const LINE: f64 = 48.0;

/// Space to the left of the first event and to the right of the last event, in picture units.
const MARGIN: f64 = 52.0;

/// Largest number of events in a picture. If there are more, the middle events are merged.
const MOST: usize = 8;

/// Largest number of characters in the text of an event. Longer texts are cut.
const LONGEST: usize = 18;

/// Returns the height of the strip with the events, in picture units; 0 without events.
fn events_height(picture: &Picture) -> f64 {
    if picture.events.is_empty() {
        0.0
    } else {
        STRIP
    }
}

fn draw_events(canvas: &mut Canvas, picture: &Picture) {
    if picture.events.is_empty() {
        return;
    }
    let events = shown(&picture.events);
    let top = bottom(picture);
    let line = top + LINE;
    canvas.text((24.0, top + 9.0), "start", "Events, not to scale:");
    canvas.line((24.0, line), (WIDTH - 24.0, line), "time");
    let gaps = (events.len() as f64 - 1.0).max(1.0);
    for (place, (time, words)) in events.iter().enumerate() {
        let x = MARGIN + place as f64 * (WIDTH - 2.0 * MARGIN) / gaps;
        // Labels alternate below and above the line.
        let (first, second) = if place % 2 == 0 {
            (line + 16.0, line + 27.0)
        } else {
            (line - 20.0, line - 9.0)
        };
        canvas.disc((x, line), 2.5, "ground");
        canvas.text((x, first), "bold event", time);
        canvas.text((x, second), "event", words);
    }
}

/// Returns the times and texts of the events as shown. If there are too many, the middle events are merged.
fn shown(events: &[(f64, String)]) -> Vec<(String, String)> {
    let mut shown: Vec<(String, String)> = events
        .iter()
        .map(|(time, words)| (seconds(*time), shortened(words)))
        .collect();
    if shown.len() > MOST {
        let (before, after) = (MOST / 2, MOST - MOST / 2 - 1);
        let more = shown.len() - before - after;
        let last = shown.split_off(shown.len() - after);
        shown.truncate(before);
        shown.push(("...".to_owned(), format!("{more} more")));
        shown.extend(last);
    }
    shown
}

fn seconds(time: f64) -> String {
    if time.is_finite() {
        format!("{:.3} s", time + 0.0)
    } else {
        "unknown".to_owned()
    }
}

fn shortened(words: &str) -> String {
    if words.chars().count() <= LONGEST {
        return words.to_owned();
    }
    let start: String = words.chars().take(LONGEST - 3).collect();
    start + "..."
}
