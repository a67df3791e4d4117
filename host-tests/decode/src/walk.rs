//! Decodes a body field by field.

use crate::format::{Field, Format, Kind, Layout};
use crate::range;
use crate::refusal::Refusal;
use crate::value::{Fields, Value};

struct Rest<'b>(&'b [u8]);

impl Rest<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (taken, rest) = self
            .0
            .split_first_chunk::<N>()
            .ok_or("the message ends too early")?;
        self.0 = rest;
        Ok(*taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        self.take::<1>().map(|[byte]| byte)
    }

    /// Reads a varint of the postcard format. Returns an error if the varint is not in its shortest form.
    fn varint(&mut self) -> Result<u64, String> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            if byte == 0 && shift > 0 {
                return Err("a varint in the message is not in the shortest form".to_owned());
            }
            number |= u64::from(byte & 0x7F) << shift;
            if byte < 0x80 {
                return Ok(number);
            }
        }
        Err("a varint in the message is too long".to_owned())
    }

    fn flag(&mut self, what: &str) -> Result<bool, String> {
        match self.byte()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(format!(
                "a value of type {what} begins with {other:02x}: must be 00 or 01"
            )),
        }
    }
}

/// Decodes the body of a message by the tables of `FORMAT.md`, without the crate's code.
///
/// Returns the layout of the message and its fields. The body begins with the message tag.
///
/// # Errors
/// Reason why a receiver has to reject the body.
pub fn message<'f>(format: &'f Format, body: &[u8]) -> Result<(&'f Layout, Fields<'f>), Refusal> {
    let (&tag, body) = body
        .split_first()
        .ok_or_else(|| Refusal::Malformed("the body of the message is empty".to_owned()))?;
    let layout = format.message(tag).ok_or(Refusal::UnknownTag(tag))?;
    let (fields, error) = walk(&layout.fields, body);
    match error {
        Some(error) => Err(Refusal::Malformed(error)),
        None if range::outside(layout, &fields).is_some() => Err(Refusal::Range),
        None => Ok((layout, fields)),
    }
}

/// Decodes the fields `fields` from `body`.
///
/// The second result is an error text if bytes are missing, or are left over after the last field.
pub fn walk<'f>(fields: &'f [Field], body: &[u8]) -> (Fields<'f>, Option<String>) {
    let mut rest = Rest(body);
    let mut read = Fields::default();
    if let Err(error) = each(fields, &mut rest, &mut read) {
        return (read, Some(error));
    }
    let over = rest.0.len();
    let error = (over > 0).then(|| format!("{over} bytes are left over after the last field"));
    (read, error)
}

fn each<'f>(fields: &'f [Field], rest: &mut Rest<'_>, read: &mut Fields<'f>) -> Result<(), String> {
    for field in fields {
        let value = one(&field.kind, rest).map_err(|error| format!("{}: {error}", field.name))?;
        read.0.push((field, value));
    }
    Ok(())
}

fn one<'f>(kind: &'f Kind, rest: &mut Rest<'_>) -> Result<Value<'f>, String> {
    Ok(match kind {
        Kind::U8 => Value::Unsigned(rest.byte()?.into()),
        Kind::U16 => Value::Unsigned(u16::from_le_bytes(rest.take()?).into()),
        Kind::U32 => Value::Unsigned(u32::from_le_bytes(rest.take()?).into()),
        Kind::U64 => Value::Unsigned(u64::from_le_bytes(rest.take()?)),
        Kind::I24 => {
            let [a, b, c] = rest.take()?;
            Value::Signed((i32::from_le_bytes([0, a, b, c]) >> 8).into())
        }
        Kind::I32 => Value::Signed(i32::from_le_bytes(rest.take()?).into()),
        Kind::F32 => Value::Single(f32::from_le_bytes(rest.take()?)),
        Kind::F64 => Value::Double(f64::from_le_bytes(rest.take()?)),
        Kind::Bool => Value::Bool(rest.flag("bool")?),
        Kind::Digest => Value::Digest(u16::from_le_bytes(rest.take()?)),
        Kind::View => Value::View(u32::from_le_bytes(rest.take()?)),
        Kind::Flags(names) => Value::Flags(rest.byte()?, names),
        Kind::Words(words) => {
            let value = rest.byte()?;
            let word = words.get(usize::from(value));
            Value::Word(value, word.map(String::as_str))
        }
        Kind::Array(count, of) => several(*count as u64, of, rest)?,
        Kind::Option(of) => {
            if rest.flag("Option")? {
                one(of, rest)?
            } else {
                Value::None
            }
        }
        Kind::List(most, of) => {
            let count = rest.varint()?;
            if count > *most {
                return Err(format!("a list has the count {count}: must be 0 to {most}"));
            }
            several(count, of, rest)?
        }
        Kind::Group(fields) => {
            let mut read = Fields::default();
            each(fields, rest, &mut read)?;
            Value::Group(read)
        }
    })
}

fn several<'f>(count: u64, of: &'f Kind, rest: &mut Rest<'_>) -> Result<Value<'f>, String> {
    let values = (0..count).map(|_| one(of, rest));
    values.collect::<Result<_, _>>().map(Value::List)
}
