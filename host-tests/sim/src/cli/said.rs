//! An option as it was given, for a line that refuses it.

/// An option with its value, where it was given.
pub(super) fn said(option: &str, value: Option<impl std::fmt::Display>) -> Option<String> {
    value.map(|value| format!("{option} {value}"))
}
