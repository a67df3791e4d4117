//! A picture of the chain from the side, and from above where there is room beside the line, as one self-contained SVG file.
//!
//! The markup is written here by hand: it is a handful of shapes, the order and the digits of every attribute stay
//! ours (the same run gives the same bytes), and a crate would bring nothing but a second vocabulary.

mod above;
mod axis;
mod canvas;
mod events;
mod hops;
mod labels;
mod legend;
mod nodes;
mod sources;

use axis::{Frame, Scale};
use uav_relay::Mission;

use canvas::Canvas;
use labels::Labels;

/// Size of the picture in its own units; at half a page wide the smallest text is still about 5 pt.
const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 330.0;

/// The plot inside it, edge by edge: room for the title, the vertical axis, and the legend.
const LEFT: f64 = 54.0;
const RIGHT: f64 = WIDTH - 14.0;
const TOP: f64 = 46.0;
const BOTTOM: f64 = HEIGHT - 80.0;

/// What [`draw`] shows of a chain of N relays.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// How the places were found, for the title; any text.
    pub title_method: String,
    /// Distance from Tx to Rx, in metres, above 0.
    pub distance_m: f64,
    /// Every interferer: transmit power in watts, place along x and offset y on the ground, both in metres.
    pub interferers: Vec<(f64, f64, f64)>,
    /// Those of the mission that was flown before, if there was another one: drawn faint, where the plot holds them.
    pub replaced: Vec<(f64, f64, f64)>,
    /// The relays from Tx to Rx: place along x and altitude, both in metres. One that is not finite is left out.
    pub nodes: Vec<(f64, f64)>,
    /// Where relays may stand beside the line: the chain is drawn from above, too.
    pub room: Option<Room>,
    /// Linear SIR of every hop, one more than there are relays in the chain, above 0; any other value is drawn grey and without a number.
    pub hop_sir: Vec<f64>,
    /// The relays that went silent, each 1 to N: they are crossed out, and their hops are dashed.
    pub lost: Vec<usize>,
    /// The relays that are not in the chain any more, each 1 to N: they are crossed out, and the hops pass them by.
    pub left_out: Vec<usize>,
    /// What happened to the chain: when, s, and in a few words. In order.
    pub events: Vec<(f64, String)>,
}

/// The room beside the line, and who stands where in it; y is to the right of x as seen from above, in metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Room {
    /// Its left edge, 0 or less.
    pub least_m: f64,
    /// Its right edge, 0 or more.
    pub most_m: f64,
    /// y of each relay, from Tx to Rx.
    pub y_m: Vec<f64>,
}

/// Draws the chain as an SVG document.
///
/// Numbers beside hops (their SIR in dB) and relays are thinned out until none covers another; every hop and relay
/// carries its own as a tooltip. The work grows with the square of N at most.
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
    sources::replaced(&mut canvas, &mut labels, &frame, picture);
    sources::draw(&mut canvas, &mut labels, &frame, picture);
    nodes::ends(&mut canvas, &mut labels, &frame, length(picture));
    sources::label(&mut canvas, &mut labels, &frame, picture);
    sources::label_replaced(&mut canvas, &mut labels, &frame, picture);
    hops::label(&mut canvas, &mut labels, &hops);
    nodes::label(&mut canvas, &mut labels, &frame, picture);
    if let Some(room) = &picture.room {
        above::draw(&mut canvas, &frame, picture, room);
    }
    legend::draw(&mut canvas, picture);
    events::draw(&mut canvas, picture);
    canvas.finish()
}

/// The room beside the line in `mission`, if there is any, with relays at these y, m.
pub fn room(mission: &Mission, y_m: impl IntoIterator<Item = f64>) -> Option<Room> {
    let lateral = mission.config().lateral;
    (!lateral.is_single()).then(|| Room {
        least_m: f64::from(lateral.least_m),
        most_m: f64::from(lateral.most_m),
        y_m: y_m.into_iter().collect(),
    })
}

/// Where the legend ends.
fn bottom(picture: &Picture) -> f64 {
    if picture.room.is_some() {
        HEIGHT + above::HEIGHT
    } else {
        HEIGHT
    }
}

/// The distance from Tx to Rx, or 1 m where it makes no sense: a picture has to have a width.
fn length(picture: &Picture) -> f64 {
    let distance = picture.distance_m;
    if distance.is_finite() && distance > 0.0 {
        distance
    } else {
        1.0
    }
}

/// The relays that have a place, each with its number.
fn placed(picture: &Picture) -> impl Iterator<Item = (usize, (f64, f64))> {
    let nodes = picture.nodes.iter().copied();
    (1..)
        .zip(nodes)
        .filter(|(_, (x, h))| x.is_finite() && h.is_finite())
}

/// An SIR in dB, if it is one that has a logarithm.
fn decibels(sir: f64) -> Option<f64> {
    (sir.is_finite() && sir > 0.0).then(|| 10.0 * sir.log10())
}

/// The SIR of the chain's worst hop, linear.
fn worst(picture: &Picture) -> Option<f64> {
    let sirs = picture
        .hop_sir
        .iter()
        .copied()
        .filter(|sir| decibels(*sir).is_some());
    sirs.reduce(f64::min)
}

/// The scales: x holds the chain and every interferer near enough, h starts at the ground and leaves room for numbers.
fn frame(picture: &Picture) -> Frame {
    let distance = length(picture);
    let (mut low, mut high, mut top) = (0.0_f64, distance, 0.0_f64);
    for (_, (x, h)) in placed(picture) {
        // A relay far off the line is a bug elsewhere, and must not squeeze the rest into a dot.
        let x = x.clamp(-distance, 2.0 * distance);
        (low, high, top) = (low.min(x), high.max(x), top.max(h));
    }
    for (_, x, _) in picture.interferers.iter().chain(&picture.replaced) {
        if sources::near(*x, distance) {
            (low, high) = (low.min(*x), high.max(*x));
        }
    }
    let margin = 0.07 * (high - low);
    // Above the highest relay: its numbers, and what is said of far interferers.
    let share = 1.0 - (46.0 + sources::headroom(picture)) / (BOTTOM - TOP);
    let top = if top > 0.0 { top / share } else { 1.0 };
    Frame {
        x: Scale::new((low - margin, high + margin), (LEFT, RIGHT)),
        h: Scale::new((0.0, top), (BOTTOM, TOP)),
    }
}

/// The title's words, also those that a screen reader says.
fn summary(picture: &Picture) -> String {
    let sir = worst(picture).map_or_else(|| "unknown".to_owned(), both_units);
    format!(
        "{}, {}, chain SIR {sir}",
        picture.title_method,
        count(picture)
    )
}

/// How many relays there are, and of how many.
fn count(picture: &Picture) -> String {
    let all = picture.nodes.len();
    if picture.left_out.is_empty() {
        format!("N = {all}")
    } else {
        let left = (1..=all).filter(|number| !picture.left_out.contains(number));
        format!("{} of {all}", left.count())
    }
}

/// Whether a relay is crossed out.
fn is_gone(picture: &Picture, number: usize) -> bool {
    picture.lost.contains(&number) || picture.left_out.contains(&number)
}

/// An SIR both linear and in dB.
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
