//! A frame as text: a header line, and one line per field.

use std::fmt::Write as _;

use uav_relay_capture::Direction;

use super::{Shown, hex};
use crate::format::Field;
use crate::refusal::Refusal;
use crate::value::{Fields, Value, set};

const NAME: usize = 18;
const VALUE: usize = 14;

/// Returns the frame as text: a header line, and one line per field.
pub fn text(shown: &Shown<'_>) -> String {
    let Shown {
        number,
        packet,
        frame,
        tag,
    } = shown;
    let mut out = format!("frame {number}");
    if let Some(at) = packet.at {
        _ = write!(out, "  {:.6} s", at.as_secs_f64());
    }
    if !packet.interface.is_empty() {
        _ = write!(out, "  {}", packet.interface);
    }
    match packet.direction {
        Direction::Unknown => {}
        Direction::In => out.push_str(" in"),
        Direction::Out => out.push_str(" out"),
    }
    if let Some(name) = frame.name {
        _ = write!(out, "  {name}");
    }
    if let Some(header) = frame.header {
        _ = write!(
            out,
            "  {} -> {}  network {}  counter {}",
            header.sender, header.destination, header.network, header.counter
        );
    }
    _ = write!(out, "  {} bytes", frame.len);
    if let Some(tag) = tag {
        _ = write!(out, "  {}", tag.words());
    }
    if let Some(refusal) = &frame.refusal {
        _ = write!(out, "  REFUSED: {refusal}");
    }
    if !packet.comment.is_empty() {
        _ = write!(out, "  ({})", packet.comment);
    }
    out.push('\n');
    // The ranges of all fields are printed if any number is out of range.
    let ranges = frame.refusal == Some(Refusal::Range);
    lines(&frame.fields, 4, ranges, &mut out);
    if frame.refusal.is_some() {
        _ = writeln!(out, "    on the wire: {}", hex(packet.wire));
    }
    out
}

fn lines(fields: &Fields<'_>, indent: usize, ranges: bool, out: &mut String) {
    for (field, value) in &fields.0 {
        let name = &field.name;
        _ = write!(out, "{:indent$}{name:<NAME$} ", "");
        match value {
            Value::Group(inner) => {
                out.push('\n');
                lines(inner, indent + 4, ranges, out);
                continue;
            }
            Value::List(values) if matches!(values.first(), Some(Value::Group(_))) => {
                out.push('\n');
                for (number, value) in (1..).zip(values) {
                    if let Value::Group(inner) = value {
                        _ = writeln!(out, "{:indent$}  {number}", "");
                        lines(inner, indent + 4, ranges, out);
                    }
                }
                continue;
            }
            plain => _ = write!(out, "{:<VALUE$}", value_text(field, plain)),
        }
        if *value != Value::None {
            let unit = field.scale().map_or(field.unit.as_str(), |_| "");
            _ = write!(out, " {unit:<10}");
        }
        _ = write!(out, " {}", field.meaning);
        if ranges && !field.range.is_empty() {
            _ = write!(out, " [{}]", field.range);
        }
        out.truncate(out.trim_end().len());
        out.push('\n');
    }
}

fn value_text(field: &Field, value: &Value<'_>) -> String {
    match value {
        Value::Unsigned(number) => scaled(field, number.to_string(), *number as f64),
        Value::Signed(number) => scaled(field, number.to_string(), *number as f64),
        Value::Digest(digest) => format!("0x{digest:04x}"),
        Value::View(0) => "0".to_owned(),
        Value::View(view) => format!("{} by node {}", view >> 10, view & 0x3FF),
        Value::Single(number) => format!("{number:?}"),
        Value::Double(number) => format!("{number:?}"),
        Value::Bool(said) => if *said { "yes" } else { "no" }.to_owned(),
        Value::Flags(bits, names) => match set(*bits, names) {
            names if names.is_empty() => "none".to_owned(),
            names => names.join(", "),
        },
        Value::Word(value, word) => word.map_or_else(|| value.to_string(), str::to_owned),
        Value::None => "none".to_owned(),
        Value::List(values) => {
            let values: Vec<String> = values
                .iter()
                .map(|value| value_text(field, value))
                .collect();
            format!("[{}]", values.join(", "))
        }
        // The fields of a group are on lines of their own.
        Value::Group(_) => String::new(),
    }
}

/// Returns the number as text. If the unit has a factor, such as 0.1 s, the value in base units follows: `50 (5 s)`.
fn scaled(field: &Field, text: String, number: f64) -> String {
    match field.scale() {
        Some((per, base)) => format!("{text} ({} {base})", number / per),
        None => text,
    }
}
