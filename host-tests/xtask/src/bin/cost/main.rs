//! `cargo cost`: what the firmware costs, held against its budgets; and the proof that it cannot panic.
//!
//! Builds the relay image and the counting image with the firmware profile, reads sizes and the deepest stack from the
//! relay's ELF, runs the counting image in QEMU, and links the relay image with a panic handler that cannot be linked.

mod counted;
mod image;
mod row;

use std::process::ExitCode;

use row::Row;

fn main() -> ExitCode {
    match measure() {
        Ok(rows) => report(&rows),
        Err(error) => {
            println!("cost: {error}");
            ExitCode::FAILURE
        }
    }
}

fn report(rows: &[Row]) -> ExitCode {
    println!("| | measured | budget |\n| --- | --- | --- |");
    let mut over = Vec::new();
    for row in rows {
        let budget = row
            .budget
            .map_or_else(String::new, |budget| format!("{budget} {}", row.unit));
        println!("| {} | {} {} | {budget} |", row.what, row.value, row.unit);
        if row.budget.is_some_and(|budget| row.value > budget) {
            over.push(row.what);
        }
    }
    println!(
        "No panic is reachable in any of these images, and one put there on purpose does not link."
    );
    if over.is_empty() {
        println!("cost: all within budget");
        ExitCode::SUCCESS
    } else {
        println!("cost: over budget: {}", over.join("; "));
        ExitCode::FAILURE
    }
}

fn measure() -> Result<Vec<Row>, String> {
    image::no_panic()?;
    let mut rows = image::of_the_relay_image()?;
    rows.extend(counted::of_the_counting_image()?);
    Ok(rows)
}
