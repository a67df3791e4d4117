//! Strip of events below the picture: evenly spaced, not to scale in time.

use super::canvas::Canvas;
use super::picture::{Picture, WIDTH, bottom};

const STRIP: f64 = 84.0;

/// Distance from the picture's bottom to the event line.
const LINE: f64 = 48.0;

/// Distance of the first and the last event from the edges.
const MARGIN: f64 = 52.0;

/// Largest number of events shown.
const MOST: usize = 8;

/// Largest number of characters per event.
const LONGEST: usize = 18;

/// Returns the strip's height; 0 without events.
pub(super) fn height(picture: &Picture) -> f64 {
    if picture.events.is_empty() {
        0.0
    } else {
        STRIP
    }
}

pub(super) fn draw(canvas: &mut Canvas, picture: &Picture) {
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

/// Returns times and texts of the events; the middle ones are merged if there are too many.
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
