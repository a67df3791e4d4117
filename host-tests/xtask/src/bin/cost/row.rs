//! A row of the table of costs.

pub(crate) struct Row {
    pub(crate) what: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) value: u64,
    pub(crate) budget: Option<u64>,
}

pub(crate) const fn row(
    what: &'static str,
    unit: &'static str,
    value: u64,
    budget: Option<u64>,
) -> Row {
    Row {
        what,
        unit,
        value,
        budget,
    }
}
