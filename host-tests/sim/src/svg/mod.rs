//! Picture of the chain as a self-contained SVG file.
//!
//! A side view; and a top view if relays may leave the line or an interferer is beside it. The markup is written by hand, without
//! a crate: there are few shapes, and the same run gives the same bytes.

mod above;
mod axis;
mod canvas;
mod events;
mod hops;
mod labels;
mod legend;
mod nodes;
mod picture;
mod sources;

use axis::{Frame, Scale};
use canvas::Canvas;
use labels::Labels;
use picture::{BOTTOM, LEFT, RIGHT, TOP, WIDTH, bottom, decibels, length, placed, worst};
pub use picture::{OtherInterferers, Picture, Room, room};

/// Draws the chain as an SVG document.
///
/// Overlapping numbers are omitted; every hop and relay has its number in a tooltip. The work is at most quadratic in N.
#[must_use]
pub fn draw(picture: &Picture) -> String {
    let frame = frame(picture);
    let mut canvas = Canvas::new(WIDTH, bottom(picture) + events::height(picture));
    let mut labels = Labels::inside((LEFT, TOP), (RIGHT, BOTTOM));
    let hops = hops::of(picture, &frame);
    canvas.describe(&format!("Relay chain: {}", summary(picture)));
    title(&mut canvas, picture);
    axis::draw(&mut canvas, &frame, "h (m)");
    hops::draw(&mut canvas, &mut labels, &hops);
    nodes::relays(&mut canvas, &mut labels, &frame, picture, "h");
    sources::others(&mut canvas, &mut labels, &frame, picture);
    sources::draw(&mut canvas, &mut labels, &frame, picture);
    nodes::ends(&mut canvas, &mut labels, &frame, length(picture));
    sources::label(&mut canvas, &mut labels, &frame, picture);
    sources::label_others(&mut canvas, &mut labels, &frame, picture);
    hops::label(&mut canvas, &mut labels, &hops);
    nodes::label(&mut canvas, &mut labels, &frame, picture);
    if let Some(room) = &picture.room {
        above::draw(&mut canvas, &frame, picture, room);
    }
    legend::draw(&mut canvas, picture);
    events::draw(&mut canvas, picture);
    canvas.finish()
}

/// Returns the scales: x contains the chain and all near interferers, h starts at the ground.
fn frame(picture: &Picture) -> Frame {
    let distance = length(picture);
    let (mut low, mut high, mut top) = (0.0_f64, distance, 0.0_f64);
    for (_, (x, h)) in placed(picture) {
        // Limit x so that a relay far off the line (a bug elsewhere) does not shrink the rest to a dot.
        let x = x.clamp(-distance, 2.0 * distance);
        (low, high, top) = (low.min(x), high.max(x), top.max(h));
    }
    for (_, x, _) in picture.interferers.iter().chain(&picture.others) {
        if picture::near(*x, distance) {
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

/// Returns the text of the title, also used by screen readers.
fn summary(picture: &Picture) -> String {
    let sir = worst(picture).map_or_else(|| "unknown".to_owned(), both_units);
    format!(
        "{}, {}, chain SIR {sir}",
        picture.title_method,
        count(picture)
    )
}

/// Formats the number of relays; with the remaining ones if some have left the chain.
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
