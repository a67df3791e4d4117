//! Tx, Rx and the relays.

use super::canvas::{Area, Canvas, Frame, Labels, Point, round_step, width};
use super::picture::{Picture, counted, decibels, is_gone, length, placed, worst};

const SIZE: f64 = 9.0;

/// Draws Tx and Rx on the ground, with their names to the left of Tx and to the right of Rx.
pub(super) fn ends(canvas: &mut Canvas, labels: &mut Labels, frame: &Frame, distance: f64) {
    for (name, x, side) in [("Tx", 0.0, -1.0), ("Rx", distance, 1.0)] {
        let (x, y) = frame.at((x, 0.0));
        canvas.shape(&[(x - 5.0, y), (x, y - 10.0), (x + 5.0, y)], "ground");
        labels.take(Area::around((x, y - 5.0), (10.0, 10.0)));
        let at = (x + side * 13.0, y - 6.0);
        labels.take(Area::around(at, (16.0, 10.0)));
        canvas.text((at.0, at.1 + 3.6), "bold halo", name);
    }
}

/// Returns the radius of the circles for relays, in picture units. It leaves the hops between them visible.
pub(super) fn radius(picture: &Picture, frame: &Frame) -> f64 {
    let hops = picture.nodes.len() as f64 + 1.0;
    let spacing = (frame.x.at(length(picture)) - frame.x.at(0.0)) / hops;
    (0.22 * spacing).clamp(0.5, 4.0)
}

/// Draws the relays as circles, crossed out if they are lost.
///
/// `upright` is the name of the vertical axis, for the tooltips.
pub(super) fn relays(
    canvas: &mut Canvas,
    labels: &mut Labels,
    frame: &Frame,
    picture: &Picture,
    upright: &str,
) {
    let radius = radius(picture, frame);
    let rim = (0.3 * radius).min(1.1);
    for (number, (x, h)) in placed(picture) {
        let at = frame.at((x, h));
        let lost = is_gone(picture, number);
        let (class, note) = if picture.lost.contains(&number) {
            ("relay lost", ", silent")
        } else if lost {
            ("relay lost", ", no longer in the chain")
        } else {
            ("relay", "")
        };
        canvas.relay(
            at,
            (radius, rim),
            class,
            &format!("relay {number}: x = {x:.2} m, {upright} = {h:.2} m{note}"),
        );
        let mut half = radius;
        if lost {
            half = (1.5 * radius).max(3.5);
            cross(canvas, at, half);
        }
        labels.take(Area::around(at, (2.0 * half, 2.0 * half)));
    }
}

pub(super) fn cross(canvas: &mut Canvas, (x, y): Point, arm: f64) {
    canvas.line((x - arm, y - arm), (x + arm, y + arm), "cross");
    canvas.line((x - arm, y + arm), (x + arm, y - arm), "cross");
}

/// Writes the numbers of the relays where there is free space.
///
/// In a chain of at most twelve relays every relay gets a number. In a longer chain only every second relay gets a
/// number, in a still longer chain every fifth, and so on. Lost relays always get a number.
pub(super) fn label(canvas: &mut Canvas, labels: &mut Labels, frame: &Frame, picture: &Picture) {
    let radius = radius(picture, frame);
    let step = round_step((picture.nodes.len() as f64 / 12.0).max(1.0));
    let mut shown: Vec<_> = placed(picture)
        .filter(|(number, _)| (*number as f64) % step < 0.5 || is_gone(picture, *number))
        .collect();
    shown.sort_by_key(|(number, _)| !is_gone(picture, *number));
    for (number, place) in shown {
        let (x, y) = frame.at(place);
        let words = number.to_string();
        let size = (width(&words, SIZE) + 2.0, SIZE);
        let down = radius.max(2.0) + 0.5 * SIZE + if is_gone(picture, number) { 4.5 } else { 2.5 };
        let sideways = radius + 0.5 * size.0 + 2.5;
        let places = [
            (x, y + down),
            (x, y - down),
            (x + sideways, y + 8.0),
            (x - sideways, y - 8.0),
        ];
        if let Some((x, y)) = places
            .into_iter()
            .find(|at| labels.try_take(Area::around(*at, size)))
        {
            canvas.text((x, y + 0.36 * SIZE), "node", &words);
        }
    }
}

/// Classes of hops by SIR: limit in dB above the worst hop, colour, line width, text in the legend.
///
/// The colours are from the palette of Okabe and Ito. The worst class is wider, for prints without colour.
pub(super) const CLASSES: [(f64, &str, f64, &str); 4] = [
    (0.1, "#d55e00", 3.2, "< 0.1 dB"),
    (1.0, "#e69f00", 2.4, "< 1 dB"),
    (6.0, "#56b4e9", 2.4, "< 6 dB"),
    (f64::INFINITY, "#0072b2", 2.4, "≥ 6 dB"),
];

const UNKNOWN: (&str, f64) = ("#999999", 2.4);

const SIR_SIZE: f64 = 10.0;

/// Distance of the text with a hop's SIR from the line of the hop, in picture units.
///
/// It is larger than the largest radius of a relay's circle, so that the text touches neither relay of the hop.
const GAP: f64 = 4.6;

/// Points of a hop beside which the text with its SIR may be drawn. Each is a fraction of the hop's length, and the
/// first point where the text has enough space is used.
const SHARES: [f64; 3] = [0.5, 0.35, 0.65];
/// Distances that the text with a hop's SIR may be moved away from the hop, in picture units.
///
/// Positive is above the hop, negative (also -0.0) below.
const SIDES: [f64; 3] = [0.0, 11.0, -0.0];

/// Largest number of hops for which the SIRs are beside the hops. For more hops, the SIRs are in one row.
const FEW: usize = 21;

pub(super) struct Hop {
    number: usize,
    line: [Point; 2],
    /// SIR of the hop in its worse direction of data, dB; `None` if it is unknown.
    decibels: Option<f64>,
    /// SIRs of the hop for data toward Rx and for data toward Tx, dB; `None` if unknown.
    ways: [Option<f64>; 2],
    /// True if the picture shows the SIRs for data toward Rx and for data toward Tx.
    has_back: bool,
    colour: (&'static str, f64),
    silent: bool,
}

/// Returns the hops of the chain with their lines and colours. Hops at relays without a position are left out.
pub(super) fn hops(picture: &Picture, frame: &Frame) -> Vec<Hop> {
    let worst = worst(picture).and_then(decibels);
    let last = picture.nodes.len() + 1;
    if last > 1 && (1..last).all(|node| picture.left_out.contains(&node)) {
        return Vec::new();
    }
    let ends = placed(picture).chain([(last, (length(picture), 0.0))]);
    let mut hops = Vec::new();
    let mut before = (0, (0.0, 0.0), 0);
    // Relays outside the chain are skipped.
    let out = &picture.left_out;
    for (node, place) in ends.filter(|(node, _)| !out.contains(node)) {
        let passed = out.iter().filter(|other| (1..node).contains(other));
        let number = node.saturating_sub(passed.count());
        // The hops beside a relay without a position are unknown.
        if number == before.0 + 1 {
            let of = |sirs: &[f64]| sirs.get(number - 1).copied();
            let there = of(&picture.hop_sir).and_then(decibels);
            let back = of(&picture.hop_sir_back).and_then(decibels);
            let decibels = counted(picture, number).and_then(decibels);
            let colour = decibels.zip(worst).map_or(UNKNOWN, |(here, worst)| {
                let class = CLASSES
                    .into_iter()
                    .find(|(below, ..)| here - worst < *below);
                class.map_or(UNKNOWN, |(_, colour, width, _)| (colour, width))
            });
            hops.push(Hop {
                number,
                line: [frame.at(before.1), frame.at(place)],
                decibels,
                ways: [there, back],
                has_back: !picture.hop_sir_back.is_empty(),
                colour,
                silent: picture.lost.contains(&node) || picture.lost.contains(&before.2),
            });
        }
        before = (number, place, node);
    }
    hops
}

/// Draws the lines of the hops, the worst hops last, so that they are on top.
pub(super) fn draw_hops(canvas: &mut Canvas, labels: &mut Labels, hops: &[Hop]) {
    let mut order: Vec<&Hop> = hops.iter().collect();
    order.sort_by(|a, b| a.colour.1.total_cmp(&b.colour.1));
    for hop in order {
        let words = |sir: Option<f64>| {
            sir.map_or_else(|| "unknown".to_owned(), |value| format!("{value:.2} dB"))
        };
        let [there, back] = hop.ways.map(words);
        let tip = if hop.has_back {
            format!("hop {}: SIR {there}, back {back}", hop.number)
        } else {
            format!("hop {}: SIR {there}", hop.number)
        };
        canvas.hop(hop.line, hop.colour, hop.silent, &tip);
        labels.take_line(hop.line);
    }
}

/// Writes the SIRs of the hops where there is free space.
///
/// The worst hop has priority, then the first and the last hop, then all others.
pub(super) fn label_hops(canvas: &mut Canvas, labels: &mut Labels, hops: &[Hop]) {
    let last = hops.last().map_or(0, |hop| hop.number);
    let lowest = hops.iter().filter_map(|hop| hop.decibels).reduce(f64::min);
    let dense = hops.len() > FEW;
    let mut worst_seen = false;
    let mut order: Vec<(u8, &Hop)> = Vec::new();
    for hop in hops {
        // Of several equally bad hops, only the first has priority.
        let worst = !worst_seen
            && hop
                .decibels
                .zip(lowest)
                .is_some_and(|(here, lowest)| here <= lowest);
        worst_seen |= worst;
        let end = hop.number == 1 || hop.number == last;
        order.push((if worst { 0 } else { 2 - u8::from(end) }, hop));
    }
    order.sort_by_key(|(rank, hop)| (*rank, hop.number));
    for (_, hop) in order {
        // The addition turns -0 into 0.
        let short = |value: f64| format!("{:.1}", (10.0 * value).round() / 10.0 + 0.0);
        let words = match hop.ways {
            [Some(there), Some(back)] => format!("{} / {}", short(there), short(back)),
            [Some(there), None] if !hop.has_back => short(there),
            _ => continue,
        };
        let size = (width(&words, SIR_SIZE) + 3.0, SIR_SIZE);
        // In a dense chain the numbers are in one row, each with a line to its hop.
        let in_row = dense && hop.number != 1 && hop.number != last;
        let places = if in_row {
            places(hop, size, &[0.5], &[4.0])
        } else {
            places(hop, size, &SHARES, &SIDES)
        };
        let room = if in_row { (size.0 + 9.0, size.1) } else { size };
        let free = places
            .into_iter()
            .find(|(_, place)| labels.try_take(Area::around(*place, room)));
        if let Some((from, (x, y))) = free {
            leader(canvas, hop, from, (x, y), size);
            canvas.text((x, y + 0.36 * SIR_SIZE), "halo sir", &words);
        }
    }
}

/// Returns possible positions for the text with a hop's SIR, the best first.
///
/// Each entry has a point on the hop, to which a line can lead, and the text's position. The text has the size `width`
/// by `height`. `shares` are the points as fractions of the hop's length; `sides` are additional distances from the
/// hop, whose sign selects the side.
fn places(hop: &Hop, (width, height): Point, shares: &[f64], sides: &[f64]) -> Vec<(Point, Point)> {
    let [(x1, y1), (x2, y2)] = hop.line;
    let (run, rise) = (x2 - x1, y2 - y1);
    let span = run.hypot(rise).max(1e-9);
    // Normal of the line, pointing upward; to the right for a vertical line.
    let across = (rise / span, -run / span);
    let clear = f64::midpoint(across.0.abs() * width, across.1.abs() * height) + GAP;
    let mut places = Vec::new();
    for share in shares {
        let (x, y) = (x1 + share * run, y1 + share * rise);
        for side in sides {
            let off = side + clear.copysign(*side);
            places.push(((x, y), (x + off * across.0, y + off * across.1)));
        }
    }
    places
}

/// Draws a line from the text with a hop's SIR to the hop, if the hop is shorter than that text.
///
/// Without the line, the reader could not tell to which hop the text belongs.
fn leader(canvas: &mut Canvas, hop: &Hop, from: Point, to: Point, (width, height): Point) {
    let [(x1, y1), (x2, y2)] = hop.line;
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    if (x2 - x1).hypot(y2 - y1) > width || dx.hypot(dy) < 1e-9 {
        return;
    }
    // The line ends at the edge of the number.
    let share = 1.0
        - f64::min(
            width / 2.0 / dx.abs().max(1e-9),
            height / 2.0 / dy.abs().max(1e-9),
        )
        .min(1.0);
    canvas.line(from, (from.0 + share * dx, from.1 + share * dy), "leader");
}
