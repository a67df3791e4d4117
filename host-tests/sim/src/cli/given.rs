//! Options as given by the user, for error messages.

pub(super) fn given(option: &str, value: Option<impl std::fmt::Display>) -> Option<String> {
    value.map(|value| format!("{option} {value}"))
}
