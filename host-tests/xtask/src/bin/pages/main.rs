//! Tests the commands in the user documentation. Runs them in a folder like a clean clone and compares their output with the page.
//!
//! A block of commands is a fence `sh`, `bash` or `console`; in a `console` only lines that begin with `$ ` are commands. A
//! following block `text` under the same heading is the expected output, and so are the other lines of a `console`.
//!
//! | word after `sh`, `bash` or `console` | the block |
//! | --- | --- |
//! | none | is run |
//! | `hardware` | needs a board, a drone, a radio or a simulator of one |
//! | `root` | needs root |
//! | `slow` | takes minutes, and is run with `--slow` |
//! | `itself` | runs this program, among others |
//! | `tested` | is run by a test of its own |
//! | `window` | opens a window |
//!
//! A block that needs hardware is not run. The options of this project's commands in it are checked: a program must not refuse
//! them (status 2).
//!
//! A command must succeed, unless its comment begins with `exit status N`: then it must end with that status.
//!
//! Output is compared line by line: every line of the page must occur, in order, with others in between. Trailing spaces are
//! ignored. A line `...` matches any lines. In a block `text noisy` each number matches any number.
//!
//! The commands of `.cargo/config.toml` are binaries built beforehand, so no block waits for the compiler.

mod compare;
mod options;
mod page;
mod shell;

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;

use page::{Block, Kind};

/// Pages in the order in which a new user reads them.
const PAGES: [&str; 12] = [
    "README.md",
    "examples/LINUX.md",
    "examples/BOARDS.md",
    "examples/SCENARIOS.md",
    "examples/PAGE.md",
    "examples/CAPTURES.md",
    "src/docs/firmware.md",
    "src/docs/flight.md",
    "src/docs/lost_relays.md",
    "src/docs/planning.md",
    "src/docs/sensing.md",
    "src/docs/uploads.md",
];

/// Runs the commands of the pages, and compares their output with the pages.
#[derive(Parser)]
#[command(name = "pages")]
struct Options {
    /// Run for pages whose names contain this only
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// The slow blocks, and no others
    #[arg(long)]
    slow: bool,
}

fn main() -> ExitCode {
    let Options { only, slow } = Options::parse();
    let root = Path::new(".");
    match walk(root, &only, slow) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(faults) => {
            println!("pages: {faults} blocks do not print what the page says");
            ExitCode::FAILURE
        }
        Err(line) => {
            println!("pages: {line}");
            ExitCode::FAILURE
        }
    }
}

/// Runs every runnable block; returns the number of blocks with different output.
fn walk(root: &Path, only: &str, slow: bool) -> Result<usize, String> {
    let shell = shell::Shell::build(root)?;
    let (mut faults, mut run, mut left_out, mut checked) = (0, 0, 0, 0);
    for name in PAGES.into_iter().filter(|name| name.contains(only)) {
        let text =
            std::fs::read_to_string(root.join(name)).map_err(|error| format!("{name}: {error}"))?;
        let blocks = page::blocks(&text).map_err(|error| format!("{name}:{error}"))?;
        shell.clean()?;
        for (at, block) in blocks.iter().enumerate() {
            let Kind::Commands(why_not) = &block.kind else {
                continue;
            };
            match (why_not.as_deref(), slow) {
                (None, false) | (Some("slow"), true) => {}
                (Some("hardware"), false) => {
                    left_out += 1;
                    for command in options::own_commands(&block.commands()) {
                        checked += 1;
                        let (status, output) = shell.begin(&command)?;
                        if let Err(fault) = options::accepted(&command, status, &output) {
                            faults += 1;
                            println!("{name}:{}: {fault}", block.line);
                        }
                    }
                    continue;
                }
                _ => {
                    left_out += 1;
                    continue;
                }
            }
            run += 1;
            let begun = Instant::now();
            let output = shell.run(&block.commands(), slow);
            let seconds = begun.elapsed().as_secs_f64();
            println!("{name}:{}: {seconds:.1} s", block.line);
            let fault = output.and_then(|output| {
                let quoted = blocks.get(at + 1).filter(|next| next.prints(block));
                let said = |block: &Block| compare::compare(&block.printed(), &output, block.noisy);
                said(block)?;
                quoted.map_or(Ok(()), said)
            });
            if let Err(fault) = fault {
                faults += 1;
                println!("{name}:{}: {fault}", block.line);
            }
        }
    }
    println!(
        "pages: {run} blocks were run, {left_out} were not; of those the options of {checked} commands were checked"
    );
    Ok(faults)
}
