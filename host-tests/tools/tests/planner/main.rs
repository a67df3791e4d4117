//! Output and error messages of `cargo plan`.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs
)]

mod closed;
mod noise;
mod refusals;
mod units;

use std::path::PathBuf;
use std::process::{Command, Output};

fn plan(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn said(arguments: &str) -> String {
    let output = plan(arguments);
    assert!(output.status.success(), "{arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn refusal(arguments: &str) -> (i32, String) {
    let output = plan(arguments);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(line.trim_end().lines().count(), 1, "{arguments:?}: {line}");
    (output.status.code().unwrap(), line)
}

fn example(name: &str) -> String {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    file.join(name).to_str().unwrap().to_owned()
}
