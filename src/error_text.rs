//! Texts of errors, each written once for `Display` and for `defmt`.
//!
//! An image stores only the numbers of the texts that `defmt` prints, so that they take no flash. An error that prints the name of its
//! variant instead would name neither the range of a parameter nor the remedy.

/// Implements `Display`, `Error` and `defmt::Format` for an error enum, from one text for each variant.
///
/// The texts are string literals, because `defmt` takes nothing else. A `const fn text` returns them, also to a `const fn` that
/// panics.
macro_rules! error_texts {
    ($type:ty { $($variant:ident => $text:literal),* $(,)? }) => {
        impl $type {
            /// Returns the error's text: what is wrong, and the allowed range.
            pub(crate) const fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }
        }

        impl core::fmt::Display for $type {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(self.text())
            }
        }

        impl core::error::Error for $type {}

        #[cfg(feature = "defmt")]
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                let text = match *self {
                    $(Self::$variant => defmt::intern!($text),)*
                };
                defmt::write!(f, "{=istr}", text);
            }
        }
    };
}
