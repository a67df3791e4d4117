//! Encodes a body from its field values, by the tables alone.

use serde_json::Value as Json;

use crate::format::{Field, Format, Kind};
use crate::value::{Fields, Value};

/// Encodes the body of the message `name`. `fields` has the values as `cargo decode --json` prints them.
///
/// The values of digests and flags may also be given as numbers.
///
/// # Errors
/// Names the field whose value is missing or does not fit its type.
pub fn write(format: &Format, name: &str, fields: &Json) -> Result<Vec<u8>, String> {
    let mut messages = (0_u8..).zip(&format.messages);
    let (tag, layout) = messages
        .find(|(_, layout)| layout.name == name)
        .ok_or_else(|| format!("no such message: {name}"))?;
    let mut body = vec![tag];
    write_fields(&read(&layout.fields, fields)?, &mut body);
    Ok(body)
}

/// Appends the encoding of all fields to `body`, even of fields that are out of range.
pub fn write_fields(fields: &Fields<'_>, body: &mut Vec<u8>) {
    for (field, value) in &fields.0 {
        one(&field.kind, value, body);
    }
}

fn one(kind: &Kind, value: &Value<'_>, body: &mut Vec<u8>) {
    match (kind, value) {
        (Kind::Option(_), Value::None) => body.push(0),
        (Kind::Option(of), value) => {
            body.push(1);
            one(of, value, body);
        }
        (Kind::List(_, of) | Kind::Array(_, of), Value::List(values)) => {
            if matches!(kind, Kind::List(..)) {
                // A varint up to 127 is one byte.
                body.push(u8::try_from(values.len()).unwrap_or(u8::MAX));
            }
            for value in values {
                one(of, value, body);
            }
        }
        (_, Value::Group(fields)) => write_fields(fields, body),
        (kind, Value::Unsigned(number)) => {
            let bytes = number.to_le_bytes();
            body.extend(bytes.iter().take(kind.size()));
        }
        (kind, Value::Signed(number)) => {
            let bytes = number.to_le_bytes();
            body.extend(bytes.iter().take(kind.size()));
        }
        (_, Value::Digest(digest)) => body.extend(digest.to_le_bytes()),
        (_, Value::View(view)) => body.extend(view.to_le_bytes()),
        (_, Value::Single(number)) => body.extend(number.to_le_bytes()),
        (_, Value::Double(number)) => body.extend(number.to_le_bytes()),
        (_, Value::Bool(said)) => body.push((*said).into()),
        (_, Value::Flags(bits, _)) => body.push(*bits),
        (_, Value::Word(word, _)) => body.push(*word),
        // Only an Option can have no value, and only the two kinds above can have several values.
        (_, Value::None | Value::List(_)) => {}
    }
}

fn read<'f>(fields: &'f [Field], values: &Json) -> Result<Fields<'f>, String> {
    let mut all = Fields::default();
    for field in fields {
        let value = values.get(&field.name).unwrap_or(&Json::Null);
        let read = from_json(&field.kind, value);
        all.0.push((
            field,
            read.ok_or_else(|| format!("{}: {value}", field.name))?,
        ));
    }
    let names = values.as_object().map_or(0, serde_json::Map::len);
    if names == fields.len() {
        Ok(all)
    } else {
        Err(format!("unknown fields in {values}"))
    }
}

/// Converts a JSON value to a field value, if it fits the type `kind`.
fn from_json<'f>(kind: &'f Kind, value: &Json) -> Option<Value<'f>> {
    let byte = || u8::try_from(value.as_u64()?).ok();
    Some(match kind {
        Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => {
            let fits = |number: &u64| kind.size() == 8 || number >> (8 * kind.size()) == 0;
            Value::Unsigned(value.as_u64().filter(fits)?)
        }
        Kind::View => Value::View(u32::try_from(value.as_u64()?).ok()?),
        Kind::Words(_) => Value::Word(byte()?, None),
        Kind::I24 => {
            let fits = |number: &i64| (-(1 << 23)..1 << 23).contains(number);
            Value::Signed(value.as_i64().filter(fits)?)
        }
        Kind::I32 => Value::Signed(i32::try_from(value.as_i64()?).ok()?.into()),
        #[expect(clippy::cast_possible_truncation, reason = "to the nearest")]
        Kind::F32 => Value::Single(value.as_f64()? as f32),
        Kind::F64 => Value::Double(value.as_f64()?),
        Kind::Bool => Value::Bool(value.as_bool()?),
        Kind::Digest => Value::Digest(match value.as_str() {
            Some(digits) => u16::from_str_radix(digits, 16).ok()?,
            None => u16::try_from(value.as_u64()?).ok()?,
        }),
        Kind::Flags(names) => {
            let bit = |bits, name: &Json| {
                let bit = names.iter().position(|known| name == known)?;
                Some(bits | 1 << bit)
            };
            let bits = match value.as_array() {
                None => byte()?,
                Some(set) => set.iter().try_fold(0, bit)?,
            };
            Value::Flags(bits, names)
        }
        Kind::Option(_) if value.is_null() => Value::None,
        Kind::Option(of) => from_json(of, value)?,
        Kind::Array(..) | Kind::List(..) => {
            let values = value.as_array()?;
            let (of, fits) = match kind {
                Kind::Array(count, of) => (of, values.len() == *count),
                Kind::List(most, of) => (of, values.len() as u64 <= *most && *most < 0x80),
                _ => return None,
            };
            let values = values.iter().map(|value| from_json(of, value));
            Value::List(values.collect::<Option<_>>().filter(|_| fits)?)
        }
        Kind::Group(fields) => Value::Group(read(fields, value).ok()?),
    })
}
