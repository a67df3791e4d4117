//! Tests the commands in the user documentation.
//!
//! They run in a folder like a clean clone; their output is compared with the page.
//!
//! A block of commands is a fence `sh`, `bash` or `console`. In a `console` only lines that begin with `$ ` are
//! commands. A following block `text` under the same heading is the expected output, and so are the other lines of a
//! `console`.
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
//! A block that needs hardware is not run. But the options of this project's commands in it are checked: a program
//! must not reject them (status 2).
//!
//! A command must succeed, unless its comment begins with `exit status N`: then it must exit with that status.
//!
//! Every line of the page must occur in the output, in order, with other lines in between. Trailing spaces are
//! ignored. A line `...` matches any lines. In a block `text noisy` each number matches any number.
//!
//! `--write` replaces each line that is not printed with the most similar line of the output.
//!
//! The commands of `.cargo/config.toml` are built beforehand, so no block waits for the compiler.

mod page;

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;

use page::{Block, Kind};

/// Pages whose commands are run, in the order for a new user.
const PAGES: [&str; 15] = [
    "README.md",
    "examples/LINUX.md",
    "examples/FIRST_FLIGHT.md",
    "examples/BOARDS.md",
    "examples/SCENARIOS.md",
    "examples/PAGE.md",
    "examples/SCREEN.md",
    "examples/CAPTURES.md",
    "src/docs/firmware.md",
    "src/docs/flight.md",
    "src/docs/link.md",
    "src/docs/lost_relays.md",
    "src/docs/planning.md",
    "src/docs/sensing.md",
    "src/docs/uploads.md",
];

/// Runs the commands printed in the documentation pages, and compares the outputs.
#[derive(Parser)]
#[command(name = "pages")]
struct Options {
    /// Run only the pages whose names contain this
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Run only the slow commands of the pages
    #[arg(long)]
    slow: bool,
    /// Replace each line that is not printed with the most similar line of the output
    #[arg(long)]
    write: bool,
}

fn main() -> ExitCode {
    let options = Options::parse();
    match walk(Path::new("."), &options) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(faults) => {
            println!("pages: the output of {faults} blocks differs from the page");
            ExitCode::FAILURE
        }
        Err(line) => {
            println!("pages: {line}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the commands of all pages whose name contains `only`; returns the number of faulty blocks.
///
/// A block is faulty if a command fails or its output differs from the page. If `slow` is true, only blocks marked as
/// slow are run; otherwise only those not marked. If `write` is true, the pages are corrected.
fn walk(root: &Path, options: &Options) -> Result<usize, String> {
    let &Options {
        ref only,
        slow,
        write,
    } = options;
    let shell = page::Shell::build(root)?;
    let (mut faults, mut run, mut left_out, mut checked) = (0, 0, 0, 0);
    for name in PAGES
        .into_iter()
        .filter(|name| name.contains(only.as_str()))
    {
        let text =
            std::fs::read_to_string(root.join(name)).map_err(|error| format!("{name}: {error}"))?;
        let blocks = page::blocks(&text).map_err(|error| format!("{name}:{error}"))?;
        shell.clean()?;
        let mut corrected = text.clone();
        for (at, block) in blocks.iter().enumerate() {
            let Kind::Commands(why_not) = &block.kind else {
                continue;
            };
            match (why_not.as_deref(), slow) {
                (None, false) | (Some("slow"), true) => {}
                (Some("hardware"), false) => {
                    left_out += 1;
                    for command in own_commands(&block.commands()) {
                        checked += 1;
                        let (status, output) = shell.begin(&command)?;
                        if let Err(fault) = accepted(&command, status, &output) {
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
            let found = output.map(|output| {
                let quoted = blocks.get(at + 1).filter(|next| next.prints(block));
                let said =
                    |block: &Block| page::differences(&block.printed(), &output, block.noisy);
                let mut found = said(block);
                found.extend(quoted.map(said).unwrap_or_default());
                found
            });
            match found {
                Ok(found) if found.is_empty() => {}
                Ok(found) => {
                    faults += 1;
                    for difference in &found {
                        println!("{name}:{}: {difference}", block.line);
                        corrected = page::corrected(&corrected, block.line, difference);
                    }
                }
                Err(fault) => {
                    faults += 1;
                    println!("{name}:{}: {fault}", block.line);
                }
            }
        }
        if write && corrected != text {
            std::fs::write(root.join(name), corrected)
                .map_err(|error| format!("{name}: {error}"))?;
        }
    }
    println!(
        "pages: {run} blocks were run, {left_out} were not; of those the options of {checked} commands were checked"
    );
    Ok(faults)
}

/// Programs for Linux, each with its cargo alias in `.cargo/config.toml`.
const PROGRAMS: [(&str, &str); 2] = [("linux_companion", "companion"), ("linux_ground", "ground")];

/// Cargo aliases of programs that are built beforehand.
const ALIASES: [&str; 7] = [
    "chain",
    "companion",
    "decode",
    "ground",
    "plan",
    "provision",
    "replay",
];

/// Exit statuses of a program that has accepted its options: success, no hardware, or the time limit.
const ACCEPTED: [i32; 3] = [0, 1, TIMEOUT];

/// Exit status of the command `timeout` after its time limit.
const TIMEOUT: i32 = 124;

/// Returns the commands of this project in a shell script, each as `cargo ALIAS OPTIONS`.
pub(crate) fn own_commands(script: &str) -> Vec<String> {
    let joined = script.replace("\\\n", " ");
    let own = joined.lines().filter_map(own_command);
    own.map(confirmed).collect()
}

fn own_command(line: &str) -> Option<String> {
    // The last program of a pipe gets no input.
    let command = line.rsplit(" | ").next()?.trim().trim_end_matches('&');
    let (first, rest) = command.split_once(' ')?;
    if first == "cargo" {
        let (alias, _) = rest.split_once(' ')?;
        if ALIASES.contains(&alias) {
            return Some(command.to_owned());
        }
        let (build, options) = rest.split_once(" -- ")?;
        let program = build.split_whitespace().last()?;
        return with_alias(program, options);
    }
    with_alias(first.rsplit('/').next()?, rest)
}

/// Adds `--dry-run` to a command that would ask for a confirmation, because there is no terminal.
fn confirmed(command: String) -> String {
    let asks = command.starts_with("cargo ground ") && command.contains(" --version ");
    if asks && !command.contains(" --yes") {
        command + " --dry-run"
    } else {
        command
    }
}

fn with_alias(program: &str, options: &str) -> Option<String> {
    let (_, alias) = PROGRAMS.iter().find(|(name, _)| *name == program)?;
    Some(format!("cargo {alias} {options}"))
}

/// Checks by its exit status that a program has accepted its options. A status of `None` means that a signal ended the
/// program.
///
/// # Errors
/// The command, its status, and the last line of its output.
pub(crate) fn accepted(command: &str, status: Option<i32>, output: &str) -> Result<(), String> {
    if status.is_some_and(|status| ACCEPTED.contains(&status)) {
        return Ok(());
    }
    let status = status.map_or("a signal".to_owned(), |status| format!("status {status}"));
    let last = output.lines().last().unwrap_or_default();
    Err(format!("`{command}` ends with {status}: {last}"))
}

#[cfg(test)]
mod tests {
    use super::{accepted, own_commands};

    #[test]
    fn commands_of_this_project_are_found_by_each_of_their_names() {
        let script = "cargo run --release -p uav-relay-linux --bin linux_ground -- --tty /dev/a \\\n  --of 3\n\
                      # linux_companion in a comment\nmkfifo /run/a\ntarget/release/linux_companion --index 1 &\n\
                      linux_ground --config a --version 1\ncat /dev/a | cargo decode --key k\ncargo image --board b\n\
                      cargo provision --index 3 --out r.bin\ncargo run -p relay --bin wires --profile firmware\n";
        assert_eq!(
            own_commands(script),
            [
                "cargo ground --tty /dev/a    --of 3",
                "cargo companion --index 1 ",
                "cargo ground --config a --version 1 --dry-run",
                "cargo decode --key k",
                "cargo provision --index 3 --out r.bin",
            ]
        );
    }

    #[test]
    fn a_refused_option_and_a_missing_program_are_faults() {
        for status in [0, 1, 124] {
            assert_eq!(accepted("a", Some(status), ""), Ok(()));
        }
        for status in [2, 101, 127] {
            let line = accepted("a --b", Some(status), "x\n--b: no such option\n");
            let expected = format!("`a --b` ends with status {status}: --b: no such option");
            assert_eq!(line, Err(expected));
        }
        assert!(accepted("a", None, "").is_err());
    }
}
