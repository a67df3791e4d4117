//! Encodes a body from the values of its fields, by the tables alone.

use serde_json::Value as Json;

use crate::format::{Field, Format, Kind};

/// Encodes the message `name`. `fields` are as `cargo decode --json` prints them; digests and flags may also be numbers.
///
/// # Errors
/// Names the field whose value is missing or does not fit its type.
pub fn write(format: &Format, name: &str, fields: &Json) -> Result<Vec<u8>, String> {
    let mut messages = (0_u8..).zip(&format.messages);
    let (tag, layout) = messages
        .find(|(_, layout)| layout.name == name)
        .ok_or_else(|| format!("no such message: {name}"))?;
    let mut body = vec![tag];
    each(&layout.fields, fields, &mut body)?;
    Ok(body)
}

fn each(fields: &[Field], values: &Json, body: &mut Vec<u8>) -> Result<(), String> {
    for field in fields {
        let value = values.get(&field.name).unwrap_or(&Json::Null);
        one(&field.kind, value, body).ok_or_else(|| format!("{}: {value}", field.name))?;
    }
    let names = values.as_object().map_or(0, serde_json::Map::len);
    if names == fields.len() {
        Ok(())
    } else {
        Err(format!("unknown fields in {values}"))
    }
}

/// Encodes one value; `None` if it does not fit.
fn one(kind: &Kind, value: &Json, body: &mut Vec<u8>) -> Option<()> {
    let unsigned = || value.as_u64();
    match kind {
        Kind::U8 | Kind::Words(_) => body.push(u8::try_from(unsigned()?).ok()?),
        Kind::U16 => body.extend(u16::try_from(unsigned()?).ok()?.to_le_bytes()),
        Kind::U32 | Kind::View => body.extend(u32::try_from(unsigned()?).ok()?.to_le_bytes()),
        Kind::U64 => body.extend(unsigned()?.to_le_bytes()),
        Kind::I32 => body.extend(i32::try_from(value.as_i64()?).ok()?.to_le_bytes()),
        #[expect(clippy::cast_possible_truncation, reason = "to the nearest")]
        Kind::F32 => body.extend((value.as_f64()? as f32).to_le_bytes()),
        Kind::F64 => body.extend(value.as_f64()?.to_le_bytes()),
        Kind::Bool => body.push(value.as_bool()?.into()),
        Kind::Digest => {
            let digits = value
                .as_str()
                .map(|digits| u16::from_str_radix(digits, 16).ok());
            let digest = digits.unwrap_or_else(|| u16::try_from(unsigned()?).ok())?;
            body.extend(digest.to_le_bytes());
        }
        Kind::Flags(names) => body.push(match value.as_array() {
            None => u8::try_from(unsigned()?).ok()?,
            Some(set) => set.iter().try_fold(0, |bits, name| {
                let bit = names.iter().position(|known| name == known)?;
                Some(bits | 1 << bit)
            })?,
        }),
        Kind::Array(count, of) => {
            let values = value.as_array().filter(|values| values.len() == *count)?;
            values.iter().try_for_each(|value| one(of, value, body))?;
        }
        Kind::Option(of) => {
            body.push((!value.is_null()).into());
            if !value.is_null() {
                one(of, value, body)?;
            }
        }
        Kind::List(most, of) => {
            let values = value.as_array()?;
            // A count up to 127 is its own varint.
            let fits = values.len() as u64 <= *most && *most < 0x80;
            body.push(u8::try_from(values.len()).ok().filter(|_| fits)?);
            values.iter().try_for_each(|value| one(of, value, body))?;
        }
        Kind::Group(fields) => each(fields, value, body).ok()?,
    }
    Some(())
}
