//! Tx, Rx and the relays.

use super::axis::{Frame, round_step};
use super::canvas::{Canvas, Point};
use super::labels::{Area, Labels, width};
use super::picture::{Picture, is_gone, length, placed};

const SIZE: f64 = 9.0;

/// Draws Tx and Rx on the ground with their names outside the chain.
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

/// Returns the radius of a relay's circle, small enough to leave the hops visible.
pub(super) fn radius(picture: &Picture, frame: &Frame) -> f64 {
    let hops = picture.nodes.len() as f64 + 1.0;
    let spacing = (frame.x.at(length(picture)) - frame.x.at(0.0)) / hops;
    (0.22 * spacing).clamp(0.5, 4.0)
}

/// Draws the relays; `upright` is the name of the vertical axis.
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

/// Numbers the relays. In a short chain all have a number, in a long one every fifth, tenth and so on, and the lost ones.
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
