//! Top view of the chain, the room beside the line and the interferers; y (right of x) points downward.

use super::axis::{self, Frame, Scale};
use super::canvas::Canvas;
use super::labels::{Area, Labels, width};
use super::picture::{ABOVE, BOTTOM, LEFT, Picture, RIGHT, Room, TOP, length, near};
use super::{hops, nodes, sources};

/// Edges of the plot, below the axis of the side view.
const PLOT_TOP: f64 = BOTTOM + 52.0;
const PLOT_BOTTOM: f64 = BOTTOM + ABOVE;

const SIZE: f64 = 10.0;

/// Limit of the plot for interferers, in half-widths of the room; farther ones are arrows at its edge.
const FARTHEST: f64 = 2.0;

/// Distance beside the line that is shown toward interferers beyond the limit, in lengths of the line.
const TOWARD_FAR: f64 = 0.4;

/// Draws the top view; `side` provides the scale along the line.
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
    // Labels with a halo may cover an edge; labels without one may not.
    for edge in edges {
        labels.take_line([(LEFT, edge), (RIGHT, edge)]);
    }
    nodes::label(canvas, &mut labels, &frame, &seen);
    label(canvas, &mut labels, edges);
}

/// Returns the vertical scale for the room, all relays, and the interferers within the limit.
fn upright(seen: &Picture, room: &Room) -> Scale {
    let (mut low, mut high) = (room.least_m.min(0.0), room.most_m.max(0.0));
    let reach = if room.is_line() {
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
            y if room.is_line() => (TOWARD_FAR * reach).copysign(y),
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

/// Labels the dashed edges at a free position near either end.
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
