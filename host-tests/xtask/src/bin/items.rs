//! Counts the items of the library's public interface, and fails above [`MOST`].
//!
//! It reads the `all.html` of `cargo doc`.

use std::path::Path;
use std::process::ExitCode;

/// Maximum number of items in the library's public interface.
const MOST: usize = 110;

fn main() -> ExitCode {
    let target = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let page = Path::new(&target).join("doc/uav_relay/all.html");
    let items = match std::fs::read_to_string(&page) {
        // Links with `#` lead to sections of the same page.
        Ok(text) => {
            text.matches("<li><a href=\"").count() - text.matches("<li><a href=\"#").count()
        }
        Err(error) => {
            eprintln!("{}: {error}; run `cargo doc` first", page.display());
            return ExitCode::FAILURE;
        }
    };
    println!("{items} public items, at most {MOST}");
    if items == 0 || items > MOST {
        eprintln!("hide what only tests of the workspace use behind the feature `internals`");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
