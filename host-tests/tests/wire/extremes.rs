//! Coverage of the golden vectors: bounds of every field, every flag, longest and shortest messages.

use std::collections::{BTreeMap, BTreeSet};

use uav_relay_decode::format::{Field, Kind};
use uav_relay_decode::value::{Fields, Value};
use uav_relay_decode::{range, walk};

use super::golden::vectors;
use super::message::FORMAT;

/// Values of each message field that occur in the test vectors, as text. The key has the name of the message and the
/// name of the field.
type BoundsSeen = BTreeMap<String, BTreeSet<String>>;

/// Returns the name under which a message's fields are collected. Messages with the same fields share a name.
fn layout_of(message: &str) -> &str {
    match message {
        "Measured" | "Aside" => "Sweep",
        "Gathered" => "Gather",
        "Sensed" => "Sense",
        other => other,
    }
}

fn note(path: &str, fields: &Fields<'_>, seen: &mut BoundsSeen) {
    for (field, value) in &fields.0 {
        note_one(&format!("{path}.{}", field.name), value, seen);
    }
}

fn note_one(path: &str, value: &Value<'_>, seen: &mut BoundsSeen) {
    let text = match value {
        Value::None => "none".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Group(fields) => {
            note(path, fields, seen);
            "some".to_owned()
        }
        Value::List(values) => {
            for value in values {
                note_one(path, value, seen);
            }
            format!("{} of it", values.len())
        }
        Value::Flags(bits, names) => {
            let set = (0..names.len()).filter(|bit| bits >> bit & 1 == 1);
            let set: Vec<String> = set.map(|bit| format!("flag {bit}")).collect();
            seen.entry(path.to_owned()).or_default().extend(set);
            return;
        }
        Value::Single(number) => format!("{:e}", f64::from(*number) + 0.0),
        Value::Double(number) => format!("{number:e}"),
        Value::Unsigned(number) => format!("{:e}", *number as f64),
        Value::Signed(number) => format!("{:e}", *number as f64),
        Value::Word(word, _) => format!("{:e}", f64::from(*word)),
        Value::View(view) => format!("{:e}", f64::from(*view)),
        Value::Digest(digest) => format!("{:e}", f64::from(*digest)),
    };
    seen.entry(path.to_owned()).or_default().insert(text);
}

/// Adds to `all` the values of the field `path` that at least one test vector must have.
fn wanted(path: &str, field: &Field, kind: &Kind, all: &mut BoundsSeen) {
    let mut want = |text: String| {
        all.entry(path.to_owned()).or_default().insert(text);
    };
    let bounds = || {
        let (zero, least, most) = range::bounds(&field.range);
        (zero.then_some(0.0), [least, most])
    };
    match kind {
        Kind::Bool => {
            for value in ["false", "true"] {
                want(value.to_owned());
            }
        }
        Kind::Option(of) => {
            want("none".to_owned());
            wanted(path, field, of, all);
        }
        Kind::List(most, of) => {
            for count in [0, 1, *most] {
                want(format!("{count} of it"));
            }
            wanted(path, field, of, all);
        }
        Kind::Array(_, of) => wanted(path, field, of, all),
        Kind::Group(fields) => fields
            .iter()
            .for_each(|field| wanted(&format!("{path}.{}", field.name), field, &field.kind, all)),
        Kind::Flags(names) => (0..names.len()).for_each(|bit| want(format!("flag {bit}"))),
        Kind::Words(words) => (0..words.len()).for_each(|word| want(format!("{:e}", word as f64))),
        // Ranges with a bound: numbers of one, two or four bytes without one are covered by the rest.
        Kind::F32 | Kind::F64 | Kind::U8 | Kind::U16 | Kind::I24 | Kind::I32
            if field.range.contains(" to ") =>
        {
            let (zero, bounds) = bounds();
            for bound in zero.into_iter().chain(bounds) {
                let single = f64::from(bound as f32);
                let bound = if *kind == Kind::F32 { single } else { bound };
                want(format!("{bound:e}"));
            }
        }
        Kind::F32 if field.range.starts_with("0 or more") => {
            for bound in [0.0, f64::from(f32::MAX)] {
                want(format!("{bound:e}"));
            }
        }
        _ => {}
    }
}

#[test]
fn the_vectors_contain_both_bounds_of_every_field() {
    let (mut seen, mut all) = (BoundsSeen::new(), BoundsSeen::new());
    for layout in &FORMAT.messages {
        for field in &layout.fields {
            let path = format!("{}.{}", layout_of(&layout.name), field.name);
            wanted(&path, field, &field.kind, &mut all);
        }
    }
    let mut lengths: BTreeMap<String, usize> = BTreeMap::new();
    for vector in vectors().frames {
        let layout = FORMAT.message(vector.body[0]).unwrap();
        let (fields, _) = walk::walk(&layout.fields, &vector.body[1..]);
        note(layout_of(&layout.name), &fields, &mut seen);
        let longest = lengths.entry(vector.message).or_default();
        *longest = vector.wire.len().max(*longest);
    }
    let mut count = 0;
    for (path, wanted) in &all {
        let seen = seen.get(path).cloned().unwrap_or_default();
        count += wanted.len();
        let missing: Vec<&String> = wanted.difference(&seen).collect();
        assert!(missing.is_empty(), "{path}: {missing:?}");
    }
    assert!(count > 150, "{count}");
    assert_eq!(lengths.len(), FORMAT.messages.len(), "a vector of each tag");
    let longest = ["Sweep", "Measured", "Aside", "Offer"].map(|name| lengths[name]);
    assert_eq!(longest, [100, 104, 104, 141]);
}
