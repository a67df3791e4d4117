//! Pages for users: valid tables, existing pictures, and figures equal to the commands' output.
#![cfg(test)]

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.ancestors().nth(2).unwrap()
}

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap()
}

/// Returns the paths of all Markdown pages of the repository and of the crate's documentation.
fn pages() -> Vec<PathBuf> {
    let mut all = vec![];
    for folder in ["", "examples", "host-tests", "src/docs", "src/wire"] {
        for entry in std::fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|extension| extension == "md") {
                all.push(path);
            }
        }
    }
    assert!(all.len() >= 15, "{all:?}");
    all
}

/// Returns the lines of a Markdown page that are outside code blocks, with their numbers from 1.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut code = false;
    let outside = |(_, line): &(usize, &str)| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    };
    (1..).zip(text.lines()).filter(outside).collect()
}

/// Checks that no blank line cuts a table. Rows after it have no header and would be shown as text.
#[test]
fn every_row_of_a_table_is_displayed_in_a_table() {
    let mut cut = vec![];
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let lines = prose(&text);
        let is_row = |at: usize| lines.get(at).is_some_and(|(_, line)| line.starts_with('|'));
        for at in 0..lines.len() {
            let begins = is_row(at) && (at == 0 || !is_row(at - 1));
            let is_headed = || {
                lines
                    .get(at + 1)
                    .is_some_and(|(_, line)| line.starts_with("|-") || line.starts_with("| -"))
            };
            if begins && !is_headed() {
                cut.push(format!("{}:{}", page.display(), lines[at].0));
            }
        }
    }
    assert_eq!(cut, Vec::<String>::new());
}

#[test]
fn the_readme_spells_sir_out_first_and_stays_short() {
    let text = read("README.md");
    let first = text.find("SIR").unwrap();
    let before = text[..first].trim_end_matches('(').trim_end();
    assert!(
        before.ends_with("signal-to-interference ratio"),
        "SIR comes first in: ...{}",
        &text[first.saturating_sub(60)..first + 40]
    );
    assert!(text.len() < 12_288, "{} bytes", text.len());
}

#[test]
fn the_pictures_of_the_readme_are_there_and_one_is_of_the_page() {
    let text = read("README.md");
    let pictures: Vec<&str> = (text.split("![").skip(1))
        .map(|rest| rest.split_once("](").unwrap().1.split(')').next().unwrap())
        .collect();
    for picture in &pictures {
        let bytes = std::fs::read(root().join(picture)).unwrap();
        assert!(bytes.len() > 1_000, "{picture}");
        assert!(bytes.len() < 100_000, "{picture}: {} bytes", bytes.len());
    }
    assert!(
        pictures.iter().any(|name| name.contains("page")),
        "{pictures:?}"
    );
}

/// Checks that the README's row about a lost relay has the times that the command in that row prints.
#[test]
fn the_readme_has_the_commands_figures_of_a_lost_relay() {
    let text = read("README.md");
    let row = (text.lines())
        .find(|line| line.starts_with("| relay 4 of 8 falls silent"))
        .unwrap();
    let cells: Vec<&str> = row.split('|').map(str::trim).collect();
    let command = cells[3].trim_matches('`');
    let options = command.strip_prefix("cargo chain ");
    let options = options.unwrap_or_else(|| panic!("not a run that prints it: {command}"));
    let output = Command::new(env!("CARGO_BIN_EXE_chain"))
        .args(options.split_whitespace())
        .output()
        .unwrap();
    let printed = String::from_utf8(output.stdout).unwrap();
    let line = (printed.lines())
        .find(|line| line.contains("noticed after"))
        .unwrap();
    let seconds: Vec<f64> = (line.split_whitespace().zip(line.split_whitespace().skip(1)))
        .filter(|(_, unit)| unit.trim_end_matches([',', ';']) == "s")
        .map(|(number, _)| number.parse().unwrap())
        .collect();
    let [noticed, formed, converged] = seconds[..] else {
        panic!("{line}")
    };
    let expected = format!(
        "noticed after {noticed:.1} s, the others at their new positions after {:.1} s",
        noticed + formed + converged
    );
    assert_eq!(cells[2], expected, "{command} prints: {line}");
}

/// Checks that RESULTS.md does not list the measurement of interference as missing.
///
/// Relays can measure it: FIRMWARE.md and LINUX.md describe how.
#[test]
fn stated_limits_do_not_contradict_the_guides() {
    let limits = read("examples/RESULTS.md");
    assert!(read("examples/FIRMWARE.md").contains("**Estimate the interferer.**"));
    assert!(read("examples/LINUX.md").contains("interference measured at its end"));
    for untrue in ["do not listen yet", "no message brings it from the ground"] {
        assert!(!limits.contains(untrue), "{untrue}");
    }
}
