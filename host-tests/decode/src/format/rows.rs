//! Rows of the document's tables.

#[derive(Clone, Debug)]
pub(super) struct Row {
    pub(super) offset: String,
    pub(super) size: String,
    pub(super) kind: String,
    pub(super) name: String,
    pub(super) field: String,
    pub(super) unit: String,
    pub(super) range: String,
}

pub(super) struct Table<'a> {
    pub(super) head: Vec<&'a str>,
    pub(super) rows: Vec<Vec<&'a str>>,
}

fn cells(line: &str) -> Vec<&str> {
    let inner = line.trim().trim_matches('|');
    inner.split('|').map(str::trim).collect()
}

pub(super) fn tables(text: &str) -> Vec<Table<'_>> {
    let mut all: Vec<Table<'_>> = Vec::new();
    let mut inside = false;
    for line in text.lines() {
        if !line.starts_with('|') {
            inside = false;
        } else if let (true, Some(table)) = (inside, all.last_mut()) {
            if !line.starts_with("|-") {
                table.rows.push(cells(line));
            }
        } else {
            inside = true;
            all.push(Table {
                head: cells(line),
                rows: Vec::new(),
            });
        }
    }
    all
}

pub(super) fn rows(table: &Table<'_>) -> Result<Vec<Row>, String> {
    let mut all = Vec::new();
    for row in &table.rows {
        let [offset, size, kind, name, field, unit, range] = row.as_slice() else {
            return Err(format!("a row of {} cells: {row:?}", row.len()));
        };
        if *kind != "tag" {
            all.push(Row {
                offset: (*offset).to_owned(),
                size: (*size).to_owned(),
                kind: (*kind).to_owned(),
                name: name.trim_matches('`').to_owned(),
                field: (*field).to_owned(),
                unit: (*unit).to_owned(),
                range: (*range).to_owned(),
            });
        }
    }
    Ok(all)
}

pub(super) fn last_number(cell: &str) -> Option<usize> {
    let mut numbers = cell.split(|digit: char| !digit.is_ascii_digit());
    numbers.rfind(|digits| !digits.is_empty())?.parse().ok()
}
