//! Options as given by the user, for error messages.

/// Formats an option with its value, if given.
pub(super) fn said(option: &str, value: Option<impl std::fmt::Display>) -> Option<String> {
    value.map(|value| format!("{option} {value}"))
}
