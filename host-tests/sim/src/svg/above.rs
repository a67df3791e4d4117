//! The chain from above, below the view from the side: the room beside the line, and the interferers where they stand.
//!
//! y is to the right of x, so it grows downward.

use super::axis::{self, Frame, Scale};
use super::canvas::Canvas;
use super::labels::{Area, Labels, width};
use super::picture::{ABOVE, BOTTOM, LEFT, Picture, RIGHT, Room, TOP, length};
use super::{hops, nodes, sources};

/// The plot, edge by edge: as high as fits, below the axis of the view from the side.
const PLOT_TOP: f64 = BOTTOM + 52.0;
const PLOT_BOTTOM: f64 = BOTTOM + ABOVE;

/// Height of the words.
const SIZE: f64 = 10.0;

/// Interferers farther aside than this many times the room, or where there is none than the line is long, are told of at the edge of the plot.
const FARTHEST: f64 = 2.0;

/// Draws the view; `side` has the scale along the line.
pub(super) fn draw(canvas: &mut Canvas, side: &Frame, picture: &Picture, room: &Room) {
    let xs = picture.nodes.iter().map(|(x, _)| *x);
    let ys = room.y_m.iter().copied().chain(std::iter::repeat(f64::NAN));
    let seen = Picture {
        nodes: xs.zip(ys).collect(),
        ..picture.clone()
    };
    let frame = Frame {
        x: side.x,
        h: upright(&seen, room),
    };
    canvas.text((LEFT, TOP - 5.0), "start", "from the side");
    canvas.text((LEFT, PLOT_TOP - 5.0), "start", "from above");
    let mut labels = Labels::inside((LEFT, PLOT_TOP), (RIGHT, PLOT_BOTTOM));
    axis::draw(canvas, &frame, "y (m)");
    let edges = [room.least_m, room.most_m].map(|y| frame.h.at(y));
    for edge in edges.into_iter().filter(|_| !room.is_line()) {
        canvas.edge((LEFT, edge), (RIGHT, edge));
    }
    let hops = hops::of(&seen, &frame);
    hops::draw(canvas, &mut labels, &hops);
    nodes::relays(canvas, &mut labels, &frame, &seen, "y");
    ends(canvas, &mut labels, &frame, length(&seen));
    let placed = sources::from_above(canvas, &mut labels, &frame, &seen);
    sources::label_from_above(canvas, &mut labels, &placed);
    hops::label(canvas, &mut labels, &hops);
    if room.is_line() {
        nodes::label(canvas, &mut labels, &frame, &seen);
        return;
    }
    // What has a halo may stand on an edge, what has none may not.
    for edge in edges {
        labels.take_line([(LEFT, edge), (RIGHT, edge)]);
    }
    nodes::label(canvas, &mut labels, &frame, &seen);
    label(canvas, &mut labels, edges);
}

/// The scale aside: it holds the room, all relays, and the interferers that are not too far.
fn upright(seen: &Picture, room: &Room) -> Scale {
    let (mut low, mut high) = (room.least_m.min(0.0), room.most_m.max(0.0));
    let reach = if room.is_line() {
        length(seen)
    } else {
        FARTHEST * high.max(-low).max(1e-3)
    };
    let relays = seen.nodes.iter().map(|(_, y)| *y);
    let interferers = seen.interferers.iter().chain(&seen.others);
    let sources = interferers.map(|(_, _, y)| *y);
    for y in relays.chain(sources).filter(|y| y.abs() <= reach) {
        (low, high) = (low.min(y), high.max(y));
    }
    let margin = 0.12 * (high - low).max(1e-3);
    Scale::new((low - margin, high + margin), (PLOT_TOP, PLOT_BOTTOM))
}

/// Draws Tx and Rx with their names outside the chain.
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

/// Says what the dashed lines are: below the left edge or above the right one, at either end.
fn label(canvas: &mut Canvas, labels: &mut Labels, [left, right]: [f64; 2]) {
    let words = "edges of the room for relays";
    let size = (width(words, SIZE) + 4.0, SIZE + 1.0);
    let columns = [RIGHT - 0.5 * size.0 - 3.0, LEFT + 0.5 * size.0 + 3.0];
    let rows = [right + 8.5, left - 8.5, right - 8.5, left + 8.5];
    let mut places = rows.into_iter().flat_map(|y| columns.map(|x| (x, y)));
    if let Some((x, y)) = places.find(|at| labels.try_take(Area::around(*at, size))) {
        canvas.text((x, y + 0.36 * SIZE), "faint", words);
    }
}
