//! Every package that the workspace builds with has a licence that its own licence goes with; run by `cargo ci`.

use std::collections::BTreeSet;
use std::process::{Command, ExitCode};

/// Those that ask for no more than to be named.
const ALLOWED: [&str; 10] = [
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Packages of the tests alone, under a licence that binds who hands them on.
const TESTS_ALONE: [&str; 2] = ["alterable_logger", "colored"];

/// Whether each part of a licence expression that stands between `AND`s offers one of [`ALLOWED`]. An older `/` is an `OR`.
fn is_allowed(expression: &str) -> bool {
    let plain = expression.replace(['(', ')'], " ").replace('/', " OR ");
    let one = |licence: &str| {
        let name = licence.split(" WITH ").next().unwrap_or_default();
        ALLOWED.contains(&name.trim())
    };
    plain.split(" AND ").all(|part| part.split(" OR ").any(one))
}

fn refused() -> Result<BTreeSet<String>, String> {
    let arguments = [
        "tree",
        "--workspace",
        "--locked",
        "--target=all",
        "--edges=all",
        "--prefix=none",
        "--no-dedupe",
        "--format={l}|{p}",
    ];
    let output = Command::new("cargo")
        .args(arguments)
        .output()
        .map_err(|error| format!("cargo: {error}"))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let packages: BTreeSet<&str> = text.lines().filter(|line| line.contains('|')).collect();
    println!("licences: {} packages", packages.len());
    let refused = packages.into_iter().filter(|line| {
        let (licence, package) = line.split_once('|').unwrap_or_default();
        let name = package.split(' ').next().unwrap_or_default();
        !is_allowed(licence) && !TESTS_ALONE.contains(&name)
    });
    Ok(refused.map(str::to_owned).collect())
}

fn main() -> ExitCode {
    match refused() {
        Ok(refused) if refused.is_empty() => {
            println!("licences: all allowed");
            ExitCode::SUCCESS
        }
        Ok(refused) => {
            for line in &refused {
                println!("licences: not allowed: {line}");
            }
            ExitCode::FAILURE
        }
        Err(error) => {
            println!("licences: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::is_allowed;

    #[test]
    fn every_part_of_an_expression_has_to_be_allowed() {
        for licence in [
            "MIT",
            "MIT/Apache-2.0",
            "Apache-2.0 WITH LLVM-exception OR Apache-2.0 OR MIT",
            "(MIT OR Apache-2.0) AND Unicode-3.0",
            "MIT OR Apache-2.0 OR LGPL-2.1-or-later",
        ] {
            assert!(is_allowed(licence), "{licence}");
        }
        for licence in ["", "GPL-3.0-only", "MPL-2.0", "MIT AND GPL-3.0-only"] {
            assert!(!is_allowed(licence), "{licence}");
        }
    }
}
