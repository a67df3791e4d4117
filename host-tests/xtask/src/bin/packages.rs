//! Checks the workspace's dependencies and the packaged crate; run by `cargo ci`.
//!
//! It checks licences, a single registry, that the library needs no package in two versions, and that the README
//! links to no file that is not packaged.
//!
//! Security advisories are not checked: they change without a commit, and must be downloaded.

use std::collections::{BTreeMap, BTreeSet};
use std::process::{Command, ExitCode};

/// Permitted licences, which require only attribution.
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

/// Packages for tests only, with a licence that is not in [`ALLOWED`].
const TESTS_ALONE: [&str; 2] = ["alterable_logger", "colored"];

/// Returns true if a licence expression permits the use under [`ALLOWED`] licences.
///
/// Each operand of `AND` must offer a licence in [`ALLOWED`]. An older `/` counts as `OR`.
fn is_allowed(expression: &str) -> bool {
    let plain = expression.replace(['(', ')'], " ").replace('/', " OR ");
    let one = |licence: &str| {
        let name = licence.split(" WITH ").next().unwrap_or_default();
        ALLOWED.contains(&name.trim())
    };
    plain.split(" AND ").all(|part| part.split(" OR ").any(one))
}

/// Packages that the library may need in two versions.
///
/// embedded-hal 1.0 needs the older defmt, which re-exports the newer defmt.
const TWICE: [&str; 1] = ["defmt"];

/// Runs `cargo` with `arguments` and returns its output.
///
/// # Errors
/// The error output of cargo.
fn cargo(arguments: &[&str]) -> Result<String, String> {
    let output = Command::new("cargo")
        .args(arguments)
        .output()
        .map_err(|error| format!("cargo: {error}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}

/// Returns the output of `cargo tree` for the locked packages, all targets and all features.
///
/// `arguments` are further options of `cargo tree`.
fn tree(arguments: &[&str]) -> Result<String, String> {
    let common = [
        "tree",
        "--locked",
        "--target=all",
        "--all-features",
        "--prefix=none",
    ];
    cargo(&[&common, arguments].concat())
}

fn licences() -> Result<Vec<String>, String> {
    let text = tree(&["--workspace", "--edges=all", "--format={l}|{p}"])?;
    let lines = text.lines().filter(|line| line.contains('|'));
    let packages: BTreeSet<&str> = lines.map(|line| line.trim_end_matches(" (*)")).collect();
    println!("packages: {}", packages.len());
    let refused = packages.into_iter().filter(|line| {
        let (licence, package) = line.split_once('|').unwrap_or_default();
        let name = package.split(' ').next().unwrap_or_default();
        !is_allowed(licence) && !TESTS_ALONE.contains(&name)
    });
    Ok(refused.map(|line| format!("licence: {line}")).collect())
}

/// Returns an error message for each package that the library needs in several versions.
///
/// Not counted are packages in [`TWICE`], and packages needed only for tests or the build.
fn twice() -> Result<Vec<String>, String> {
    let text = tree(&[
        "--package=uav-relay",
        "--edges=normal,no-proc-macro",
        "--format={p}",
    ])?;
    let mut versions: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for line in text.lines() {
        if let Some((name, rest)) = line.split_once(' ') {
            let version = rest.split(' ').next().unwrap_or_default();
            versions.entry(name).or_default().insert(version);
        }
    }
    versions.retain(|name, versions| versions.len() > 1 && !TWICE.contains(name));
    let told = |(name, versions)| {
        format!("several versions of a dependency of the firmware: {name} {versions:?}")
    };
    Ok(versions.into_iter().map(told).collect())
}

fn elsewhere(lock: &str) -> Vec<String> {
    let sources = lock.lines().filter(|line| line.starts_with("source = "));
    let other = sources.filter(|line| !line.starts_with("source = \"registry+"));
    other
        .map(|line| format!("a dependency that is not from crates.io: {line}"))
        .collect()
}

/// Returns the files of this repository that the Markdown text `page` links to, without anchors.
fn links(page: &str) -> impl Iterator<Item = &str> {
    let targets = page.split("](").skip(1);
    let targets = targets.filter_map(|rest| rest.split([')', '#']).next());
    targets.filter(|target| !target.is_empty() && !target.contains("://"))
}

/// Returns an error message for each link of the README to a file that is not packaged.
fn broken_links() -> Result<Vec<String>, String> {
    let list = cargo(&[
        "package",
        "--list",
        "--locked",
        "--allow-dirty",
        "--package=uav-relay",
    ])?;
    let files: BTreeSet<&str> = list.lines().collect();
    let readme =
        std::fs::read_to_string("README.md").map_err(|error| format!("README.md: {error}"))?;
    let broken = links(&readme).filter(|target| !files.contains(target));
    Ok(broken
        .map(|target| format!("README.md links to {target}, which the packaged crate lacks"))
        .collect())
}

fn refused() -> Result<Vec<String>, String> {
    let lock =
        std::fs::read_to_string("Cargo.lock").map_err(|error| format!("Cargo.lock: {error}"))?;
    Ok([licences()?, twice()?, elsewhere(&lock), broken_links()?].concat())
}

fn main() -> ExitCode {
    match refused() {
        Ok(refused) if refused.is_empty() => {
            println!("packages: all allowed");
            ExitCode::SUCCESS
        }
        Ok(refused) => {
            for line in &refused {
                println!("packages: {line}");
            }
            ExitCode::FAILURE
        }
        Err(error) => {
            println!("packages: {error}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{elsewhere, is_allowed, links};

    #[test]
    fn links_are_those_to_files() {
        let page = "[a](A.md#b) ![p](x/p.svg) [web](https://a.org) [own](#part) (no link)";
        assert!(links(page).eq(["A.md", "x/p.svg"]));
    }

    #[test]
    fn packages_outside_the_registry_are_named() {
        let lock = "source = \"registry+one\"\nsource = \"git+two\"\n";
        assert_eq!(elsewhere(lock).len(), 1);
    }

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
