//! Values that the page cannot show: they are removed from a snapshot before it is sent.
//!
//! | value | sent instead |
//! | --- | --- |
//! | position with a part that is not finite or beyond [`FARTHEST_M`] | unknown; the interferer or the area is left out |
//! | ground with a value that is not finite or beyond [`FARTHEST_M`] | unknown |
//! | SIR that is not a number | unknown |
//! | SIR beyond [`LIMIT_DB`], also an infinite one | the limit |
//! | text | without control characters and direction marks, at most [`LONGEST_TEXT`] characters |

use serde_json::Value;

use crate::snapshot::{LogLine, Position, Snapshot};

/// Largest coordinate, m.
const FARTHEST_M: f64 = 1e7;

/// Largest absolute value of a shown SIR, dB.
const LIMIT_DB: f64 = 99.9;

/// Largest number of characters of a text.
const LONGEST_TEXT: usize = 300;

/// Removes or limits all values of a snapshot that the page cannot show. The log lines stay as they are.
pub fn clean(snapshot: &mut Snapshot) {
    for place in [&mut snapshot.tx, &mut snapshot.rx] {
        known(place);
    }
    snapshot.name.as_mut().map(text);
    for relay in &mut snapshot.relays {
        for place in [&mut relay.position, &mut relay.setpoint, &mut relay.agreed] {
            known(place);
        }
        let texts = [&mut relay.phase, &mut relay.control, &mut relay.hold_reason];
        texts.into_iter().flatten().for_each(text);
    }
    for hop in &mut snapshot.hops {
        for sir in [
            &mut hop.sir_db,
            &mut hop.sir_back_db,
            &mut hop.measured_db,
            &mut hop.measured_back_db,
        ] {
            let valid = sir.filter(|sir| !sir.is_nan());
            *sir = valid.map(|sir| sir.clamp(-LIMIT_DB, LIMIT_DB));
        }
    }
    snapshot.interferers.retain(|it| is_shown(&it.position));
    for interferer in &mut snapshot.interferers {
        interferer.uncertainty_m = interferer.uncertainty_m.filter(|it| is_near(*it));
    }
    let fence = snapshot.geofence;
    snapshot.geofence = fence.filter(|it| it.x_m.into_iter().chain(it.y_m).all(is_near));
    snapshot
        .no_fly
        .retain(|area| area.iter().flatten().copied().all(is_near));
    snapshot.ground = snapshot.ground.take().filter(|it| {
        let values = it.heights_m.iter().chain([&it.length_m, &it.mast_m]);
        it.heights_m.len() > 1 && it.length_m > 0.0 && values.copied().all(is_near)
    });
    for alarm in &mut snapshot.alarms {
        text(&mut alarm.text);
    }
    snapshot.desk.as_mut().map(clean_value);
}

/// Removes invisible characters from all texts of a JSON value, and shortens long texts.
fn clean_value(value: &mut Value) {
    match value {
        Value::String(it) => text(it),
        Value::Array(all) => all.iter_mut().for_each(clean_value),
        Value::Object(all) => all.values_mut().for_each(clean_value),
        _ => {}
    }
}

/// Removes invisible characters from a log line, and shortens a long line.
pub(crate) fn clean_line(line: &mut LogLine) {
    text(&mut line.text);
}

fn is_near(coordinate_m: f64) -> bool {
    coordinate_m.abs() <= FARTHEST_M
}

fn is_shown(place: &Position) -> bool {
    let altitude_m = place.altitude_m.unwrap_or_default();
    [place.x_m, place.y_m, altitude_m].into_iter().all(is_near)
}

/// Replaces a position that is too far away for the page by `None`.
fn known(place: &mut Option<Position>) {
    *place = place.filter(is_shown);
}

/// Removes control characters and direction marks, and cuts a text at [`LONGEST_TEXT`] characters.
pub(crate) fn text(text: &mut String) {
    let is_unseen = |it: char| {
        it.is_control()
            || matches!(it, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
    };
    text.retain(|it| !is_unseen(it));
    if let Some((end, _)) = text.char_indices().nth(LONGEST_TEXT) {
        text.truncate(end);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a test fails by it")]

    use serde_json::json;

    use super::{clean, clean_line};
    use crate::snapshot::{
        Fence, Hop, InterfererSnapshot, LogLine, Node, Position, RelaySnapshot, Snapshot,
    };

    fn at(x_m: f64, y_m: f64, altitude_m: Option<f64>) -> Position {
        Position {
            x_m,
            y_m,
            altitude_m,
        }
    }

    #[test]
    fn all_texts_of_the_desk_are_cleaned() {
        let mut snapshot = Snapshot {
            desk: Some(
                json!({ "fault": "a\u{202e}b\n", "changes": [{ "old": "x".repeat(400) }], "number": 1 }),
            ),
            ..Snapshot::default()
        };
        clean(&mut snapshot);
        let expected =
            json!({ "fault": "ab", "changes": [{ "old": "x".repeat(300) }], "number": 1 });
        assert_eq!(snapshot.desk, Some(expected));
    }

    #[test]
    fn positions_that_no_map_can_show_are_unknown() {
        let far = at(1e22, 0.0, None);
        let near = at(-1e7, 1e7, Some(20.0));
        let interferer = |position| InterfererSnapshot {
            position,
            power_w: None,
            uncertainty_m: Some(f64::INFINITY),
            is_estimated: true,
        };
        let mut snapshot = Snapshot {
            tx: Some(at(f64::NAN, 0.0, None)),
            rx: Some(near),
            relays: vec![RelaySnapshot {
                position: Some(at(0.0, f64::INFINITY, None)),
                setpoint: Some(at(0.0, 0.0, Some(f64::NAN))),
                agreed: Some(near),
                ..RelaySnapshot::new(1)
            }],
            interferers: vec![interferer(far), interferer(near)],
            geofence: Some(Fence {
                x_m: [0.0, 1.0],
                y_m: [f64::NEG_INFINITY, 1.0],
                altitude_m: None,
            }),
            no_fly: vec![vec![[0.0, 0.0], [0.0, 1e8]], vec![[0.0, 0.0], [1.0, 1.0]]],
            ..Snapshot::default()
        };
        clean(&mut snapshot);
        assert_eq!((snapshot.tx, snapshot.rx), (None, Some(near)));
        let relay = &snapshot.relays[0];
        assert_eq!((relay.position, relay.setpoint), (None, None));
        assert_eq!(relay.agreed, Some(near));
        assert_eq!(snapshot.interferers.len(), 1);
        assert_eq!(snapshot.interferers[0].position, near);
        assert_eq!(snapshot.interferers[0].uncertainty_m, None);
        assert_eq!(snapshot.geofence, None);
        assert_eq!(snapshot.no_fly, [[[0.0, 0.0], [1.0, 1.0]]]);
    }

    #[test]
    fn an_infinitely_bad_hop_is_the_worst_one_and_not_an_unknown_one() {
        let mut snapshot = Snapshot {
            hops: vec![Hop {
                sir_db: Some(f64::NEG_INFINITY),
                sir_back_db: Some(f64::NAN),
                measured_db: Some(f64::INFINITY),
                measured_back_db: Some(-3.5),
                ..Hop::new(Node::Tx, Node::Rx)
            }],
            ..Snapshot::default()
        };
        clean(&mut snapshot);
        let hop = &snapshot.hops[0];
        assert_eq!((hop.sir_db, hop.sir_back_db), (Some(-99.9), None));
        assert_eq!(
            (hop.measured_db, hop.measured_back_db),
            (Some(99.9), Some(-3.5))
        );
    }

    #[test]
    fn texts_have_no_hidden_characters_and_a_limit() {
        let mut line = LogLine {
            time_s: 0.0,
            text: "relay\u{202e} 3\n\u{7}\u{2066} lost\u{200f}".to_owned(),
        };
        clean_line(&mut line);
        assert_eq!(line.text, "relay 3 lost");
        let mut snapshot = Snapshot {
            name: Some("ä".repeat(301)),
            relays: vec![RelaySnapshot {
                hold_reason: Some("\u{1b}[2J".to_owned()),
                ..RelaySnapshot::new(1)
            }],
            ..Snapshot::default()
        };
        clean(&mut snapshot);
        assert_eq!(snapshot.name, Some("ä".repeat(300)));
        assert_eq!(snapshot.relays[0].hold_reason.as_deref(), Some("[2J"));
    }
}
