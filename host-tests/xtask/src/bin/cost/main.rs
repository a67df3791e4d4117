//! Compares the firmware's costs with budgets and documents, and proves that it cannot panic. Run by `cargo cost`.
//!
//! Builds the relay image and the counting image with the firmware profile, reads sizes and the largest stack from the relay's
//! ELF, runs the counting image in QEMU, and links the relay image with a panic handler that cannot be linked.
//! `cargo cost --write` writes the measured costs to the documents.

mod counted;
mod document;
mod image;
mod row;

use std::path::Path;
use std::process::{Command, ExitCode};

use row::Row;

const USAGE: &str = "cargo cost [--write]: what the firmware costs\n\n  --write  README.md and host-tests/RESULTS.md say from now on what was measured";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let write = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => false,
        ["--write"] => true,
        ["--help" | "-h"] => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprintln!("cost: {}: not an option\n\n{USAGE}", arguments.join(" "));
            return ExitCode::from(2);
        }
    };
    match measure().and_then(|rows| report(&rows, write)) {
        Ok(()) => {
            println!("cost: all within budget");
            ExitCode::SUCCESS
        }
        Err(error) => {
            println!("cost: {error}");
            ExitCode::FAILURE
        }
    }
}

fn report(rows: &[Row], write: bool) -> Result<(), String> {
    print!("{}", document::table(rows));
    println!(
        "No panic is reachable in any of these images, and one put there on purpose does not link."
    );
    let over: Vec<&str> = rows
        .iter()
        .filter(|row| row.budget.is_some_and(|budget| row.value > budget))
        .map(|row| row.what)
        .collect();
    if !over.is_empty() {
        return Err(format!("over budget: {}", over.join("; ")));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let (rustc, qemu) = (version("rustc")?, version("qemu-system-arm")?);
    if !document::are_of(&root, &rustc, &qemu) {
        println!(
            "The documents are of another compiler or emulator than rustc {rustc} and QEMU {qemu}."
        );
        return Ok(());
    }
    for document in document::all(&root, rows)? {
        if write {
            document.write()?;
        } else if !document.is_right() {
            return Err(format!(
                "{} says something else: `cargo cost --write`",
                document.name()
            ));
        }
    }
    Ok(())
}

fn version(program: &str) -> Result<String, String> {
    let output = Command::new(program).arg("--version").output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers = text
        .split_whitespace()
        .find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
    let mut parts = numbers.unwrap_or_default().split('.');
    match (parts.next(), parts.next()) {
        (Some(major), Some(minor)) => Ok(format!("{major}.{minor}")),
        _ => Err(format!("{program} says no version: {text}")),
    }
}

fn measure() -> Result<Vec<Row>, String> {
    image::no_panic()?;
    let mut rows = image::of_the_relay_image()?;
    rows.extend(counted::of_the_counting_image()?);
    Ok(rows)
}
