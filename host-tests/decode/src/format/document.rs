//! Parser of the document `FORMAT.md`: fields of every message.

use super::rows::{Row, Table, last_number, rows, tables};
use super::{Field, Format, Kind, Layout};

/// Returns the text below the heading that begins with `from`, up to the next heading of level 2 or 3.
fn section<'a>(document: &'a str, from: &str) -> Option<&'a str> {
    let (_, rest) = document.split_once(from)?;
    let end = ["\n## ", "\n### "].iter().filter_map(|to| rest.find(to));
    rest.get(..end.min().unwrap_or(rest.len()))
}

pub(super) fn read(document: &str) -> Result<Format, String> {
    let mut messages: Vec<Layout> = Vec::new();
    let mut known: Vec<(String, Vec<Row>)> = Vec::new();
    while let Some(text) = section(document, &format!("\n### Tag {:02x}: ", messages.len())) {
        let (name, text) = text.split_once('\n').unwrap_or((text, ""));
        let tables = tables(text);
        let Some(table) = tables
            .iter()
            .find(|table| table.head.first() == Some(&"offset"))
        else {
            // A message without a table has the layout of the previous one.
            let before = messages
                .last()
                .ok_or("FORMAT.md: the first message has no table")?;
            let fields = before.fields.clone();
            messages.push(Layout {
                name: name.to_owned(),
                fields,
            });
            continue;
        };
        let rows = expanded(rows(table)?, &known)?;
        let fields = fields(&rows, &tables).map_err(|error| format!("{name}: {error}"))?;
        known.push((name.to_owned(), rows));
        messages.push(Layout {
            name: name.to_owned(),
            fields,
        });
    }
    let text =
        section(document, "\n### Handshake\n").ok_or("FORMAT.md: there is no section Handshake")?;
    let tables = tables(text);
    let table = tables
        .first()
        .ok_or("FORMAT.md: the section Handshake has no table")?;
    let handshake = Layout {
        name: "Handshake".to_owned(),
        fields: fields(&rows(table)?, &[]).map_err(|error| format!("handshake: {error}"))?,
    };
    Ok(Format {
        messages,
        handshake,
    })
}

/// Replaces each row such as `as bytes 1 to 18 of a Sweep` with the rows of that message's table.
///
/// `known` has the tables of the messages that come before the message of `rows`.
fn expanded(rows: Vec<Row>, known: &[(String, Vec<Row>)]) -> Result<Vec<Row>, String> {
    let mut all = Vec::new();
    for row in rows {
        let Some(text) = row.field.strip_prefix("as bytes ") else {
            all.push(row);
            continue;
        };
        let parts = || {
            let (from, rest) = text.split_once(" to ")?;
            let (to, rest) = rest.split_once(" of a ")?;
            let name = rest.split(|letter: char| !letter.is_alphabetic()).next()?;
            let (_, rows) = known.iter().find(|(of, _)| of == name)?;
            let range = from.parse::<usize>().ok()?..=to.parse().ok()?;
            Some((range, rows))
        };
        let (range, rows) =
            parts().ok_or_else(|| format!("a reference to rows that are unknown: {text}"))?;
        let within = |row: &&Row| row.offset.parse().is_ok_and(|at| range.contains(&at));
        all.extend(rows.iter().filter(within).cloned());
    }
    Ok(all)
}

fn fields(rows: &[Row], tables: &[Table<'_>]) -> Result<Vec<Field>, String> {
    let mut all = Vec::new();
    let mut rest = rows.iter();
    while let Some(row) = rest.next() {
        let (row, kind) = match row.kind.as_str() {
            "count" => {
                let list = rest
                    .next()
                    .ok_or("a row `count` without a following row for its elements")?;
                let most = last_number(&row.range).ok_or("a row `count` without a range")?;
                (list, Kind::List(most as u64, Box::new(item(list, tables)?)))
            }
            "Option" => {
                let bytes = last_number(&row.size).ok_or("a row of type Option without a size")?;
                let (mut inner, mut taken) = (Vec::new(), 1);
                while taken < bytes {
                    let row = rest
                        .next()
                        .ok_or("a row of type Option whose size is larger than the sum of the rows after it")?;
                    taken += last_number(&row.size).ok_or("a row without a size")?;
                    inner.push(row.clone());
                }
                let group = Kind::Group(fields(&inner, tables)?);
                (row, Kind::Option(Box::new(group)))
            }
            _ => (row, kind(row, tables)?),
        };
        all.push(Field {
            name: row.name.clone(),
            kind,
            meaning: row.field.clone(),
            unit: row.unit.clone(),
            range: row.range.clone(),
        });
    }
    Ok(all)
}

fn item(row: &Row, all: &[Table<'_>]) -> Result<Kind, String> {
    let head = match row.kind.as_str() {
        "seats" => "offset in the seat",
        "entries" => "offset in the entry",
        "requests" => "offset in the request",
        other => return plain(other),
    };
    let table = all.iter().find(|table| table.head.first() == Some(&head));
    let rows = rows(table.ok_or("a list without a table of its elements")?)?;
    Ok(Kind::Group(fields(&rows, &[])?))
}

fn kind(row: &Row, tables: &[Table<'_>]) -> Result<Kind, String> {
    if let Some(of) = row.kind.strip_prefix("Option of ") {
        return Ok(Kind::Option(Box::new(plain(of)?)));
    }
    if row.field == "flags" {
        let table = tables
            .iter()
            .find(|table| table.head.first() == Some(&"bit"));
        let rows = &table
            .ok_or("a row `flags` without a table of its bits")?
            .rows;
        let names = rows.iter().filter_map(|row| row.get(1));
        return Ok(Kind::Flags(names.map(|name| (*name).to_owned()).collect()));
    }
    if let ("u8", Some(words)) = (row.kind.as_str(), words(&row.field)) {
        return Ok(Kind::Words(words));
    }
    // The type is, for example, `ten f32`.
    if let Some((_, of)) = row.kind.split_once(' ') {
        let of = plain(of)?;
        let bytes = last_number(&row.size).ok_or("an array without a size")?;
        return Ok(Kind::Array(bytes / of.size().max(1), Box::new(of)));
    }
    plain(&row.kind)
}

/// Returns the names of a field's values, such as `turn: 0 look, 1 stop, 2 move`, if any.
fn words(field: &str) -> Option<Vec<String>> {
    let (_, list) = field.split_once(": ")?;
    let between = if list.contains("; ") { "; " } else { ", " };
    let words = (0..).zip(list.split(between)).map(|(value, word)| {
        let word = word.strip_prefix(&format!("{value} "))?;
        Some(word.to_owned())
    });
    words.collect()
}

fn plain(kind: &str) -> Result<Kind, String> {
    Ok(match kind {
        "u8" => Kind::U8,
        "u16" => Kind::U16,
        "u32" => Kind::U32,
        "u64" => Kind::U64,
        "i24" => Kind::I24,
        "i32" => Kind::I32,
        "f32" => Kind::F32,
        "f64" => Kind::F64,
        "bool" => Kind::Bool,
        "digest" => Kind::Digest,
        "view" => Kind::View,
        other => return Err(format!("no such type: {other}")),
    })
}
