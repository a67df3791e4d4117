//! Checks the doc comments of `src`, `examples` and `host-tests`; run by `cargo ci --quick`.
//!
//! The first sentence of a doc comment is its summary, which rustdoc shows in every list. It has at most [`LONGEST`]
//! characters, and begins with a noun, an article, an adjective or a verb. Without a dictionary the check has a list
//! of wrong words.
//!
//! No tracked file contains a name of `host-tests/xtask/data/old_names.txt`, except that list and CHANGELOG.md: code,
//! documents and tools use the new names.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Maximum length of a doc comment's first sentence, characters.
const LONGEST: usize = 100;

/// Folders whose Rust files are checked, including all subfolders.
const FOLDERS: [&str; 3] = ["src", "examples", "host-tests"];

/// Words that must not begin a doc comment, several to a line.
///
/// Pronouns, prepositions, conjunctions, question words, adverbs and auxiliary verbs.
const WRONG: [&str; 8] = [
    "i he she it they we you me him her them us his its ours your yours mine itself themselves this that these those such",
    "who whom whose which what whether why how when where while until till since unless because although though as so if than",
    "then but and or nor yet of by for from in into on onto at to with without within after before during between among through",
    "throughout over under upon about against along across around behind beneath beside besides beyond above below despite except",
    "inside outside near off per toward towards via like unlike back one all nobody somebody everybody anybody none nothing",
    "something anything everything someone anyone everyone here there not also only even just too more most less never always ever",
    "already again still now once otherwise however therefore thus hence else is are was were be been being has have had do does",
    "did can could may might must shall should will would whoever whatever whichever wherever whenever our ones maybe perhaps",
];

/// Exempt doc comments: path, colon and first sentence. The list stays empty.
const EXEMPT: [&str; 0] = [];

/// Old names of renamed items, one a line: words that no other name uses.
const OLD_NAMES: &str = include_str!("../../data/old_names.txt");

/// Files that may contain old names: their list, and the table of old and new names.
const WITH_OLD_NAMES: [&str; 2] = ["host-tests/xtask/data/old_names.txt", "CHANGELOG.md"];

/// Doc comment: number of its first line, from 1, and its first paragraph.
struct Comment {
    line: usize,
    paragraph: String,
}

/// Returns the marker `///` or `//!` of a doc comment line, and the text after it.
fn text(line: &str) -> Option<(&str, &str)> {
    let line = line.trim();
    let marker = ["///", "//!"].into_iter().find(|m| line.starts_with(m))?;
    let rest = line.get(marker.len()..)?;
    (!rest.starts_with('/')).then(|| (marker, rest.trim()))
}

/// Returns all doc comments in the text of a source file.
fn comments(source: &str) -> Vec<Comment> {
    let mut found: Vec<Comment> = Vec::new();
    let mut marker = "";
    let mut is_open = false;
    for (index, line) in source.lines().enumerate() {
        let Some((kind, words)) = text(line) else {
            marker = "";
            continue;
        };
        if kind != marker {
            marker = kind;
            is_open = true;
            let (line, paragraph) = (index + 1, String::new());
            found.push(Comment { line, paragraph });
        }
        let Some(comment) = found.last_mut() else {
            continue;
        };
        let is_begun = !comment.paragraph.is_empty();
        let is_other = words.is_empty()
            || ["|", "- ", "#", "```", "* "]
                .iter()
                .any(|start| words.starts_with(start));
        is_open &= !(is_begun && is_other);
        if is_open && !words.is_empty() {
            if is_begun {
                comment.paragraph.push(' ');
            }
            comment.paragraph.push_str(words);
        }
    }
    found
}

/// Returns the first sentence of a paragraph.
fn summary(paragraph: &str) -> &str {
    let is_abbreviation = |end: usize| {
        let before = paragraph.get(..end).unwrap_or_default();
        before.ends_with("e.g") || before.ends_with("i.e")
    };
    let ends = paragraph.match_indices(['.', '?', '!']);
    let end = ends.map(|(at, _)| at).find(|at| {
        let rest = paragraph.get(at + 1..).unwrap_or_default();
        (rest.is_empty() || rest.starts_with(' ')) && !is_abbreviation(*at)
    });
    end.and_then(|at| paragraph.get(..=at)).unwrap_or(paragraph)
}

/// Returns an error message if a first sentence breaks a rule.
fn fault(summary: &str) -> Option<String> {
    let length = summary.chars().count();
    if length > LONGEST {
        return Some(format!("{length} characters, at most {LONGEST}"));
    }
    let is_letter = |c: char| c.is_alphabetic() || c == '-' || c == '\'';
    let word = summary.split(|c| !is_letter(c)).next()?;
    let lower = word.to_lowercase();
    let is_wrong = WRONG.iter().any(|line| line.split(' ').any(|w| w == lower));
    is_wrong.then(|| format!("begins with \"{word}\""))
}

/// Appends the paths of the Rust files in `folder` to `into`. Folders named `target` are skipped.
fn sources(folder: &Path, into: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            if path.file_name().is_some_and(|name| name != "target") {
                sources(&path, into)?;
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            into.push(path);
        }
    }
    Ok(())
}

/// Returns the old names in a text, each with its line number, from 1.
fn old_names(text: &str) -> Vec<(usize, &'static str)> {
    let is_letter = |c: char| c.is_alphanumeric() || c == '_';
    let mut found = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split(|c| !is_letter(c)).collect();
        let old = OLD_NAMES.lines().filter(|name| words.contains(name));
        found.extend(old.map(|name| (index + 1, name)));
    }
    found
}

/// Returns the paths of all files tracked by git.
fn tracked() -> std::io::Result<Vec<String>> {
    let output = Command::new("git").arg("ls-files").output()?;
    let names = String::from_utf8_lossy(&output.stdout);
    Ok(names.lines().map(str::to_owned).collect())
}

/// Returns an error message for each old name in a tracked text file.
fn check_names() -> std::io::Result<Vec<String>> {
    let mut faults = Vec::new();
    for file in tracked()? {
        // A file that is missing or not UTF-8 contains no names.
        let text = std::fs::read_to_string(&file).unwrap_or_default();
        if !WITH_OLD_NAMES.contains(&file.as_str()) {
            let found = old_names(&text).into_iter();
            faults.extend(found.map(|(line, name)| format!("{file}:{line}: old name {name}")));
        }
    }
    Ok(faults)
}

fn check() -> std::io::Result<(usize, Vec<String>)> {
    let mut files = Vec::new();
    for folder in FOLDERS {
        sources(Path::new(folder), &mut files)?;
    }
    files.sort();
    let (mut count, mut faults) = (0, Vec::new());
    for file in files {
        for Comment { line, paragraph } in comments(&std::fs::read_to_string(&file)?) {
            count += 1;
            let summary = summary(&paragraph);
            let name = file.display();
            let is_exempt = EXEMPT.contains(&format!("{name}: {summary}").as_str());
            if let Some(fault) = fault(summary).filter(|_| !is_exempt) {
                faults.push(format!("{name}:{line}: {fault}: {summary}"));
            }
        }
    }
    Ok((count, faults))
}

fn main() -> ExitCode {
    match check_names() {
        Ok(faults) if faults.is_empty() => {}
        Ok(faults) => {
            eprintln!("{}\nCHANGELOG.md has the new names", faults.join("\n"));
            return ExitCode::FAILURE;
        }
        Err(error) => {
            eprintln!("git ls-files: {error}");
            return ExitCode::FAILURE;
        }
    }
    match check() {
        Ok((count, faults)) if faults.is_empty() && count > 0 => {
            println!("{count} doc comments");
            ExitCode::SUCCESS
        }
        Ok((count, faults)) => {
            println!("{}", faults.join("\n"));
            println!(
                "{} of {count} doc comments do not follow the rule: begin the summary with a noun, an article or a verb; at most {LONGEST} characters",
                faults.len()
            );
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}; run this command in the project's root");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{OLD_NAMES, comments, fault, old_names, summary};

    #[test]
    fn old_names_are_whole_words() {
        let name = OLD_NAMES.lines().next().unwrap();
        let text = format!("a{name}\n{name}_b\n({name})");
        assert_eq!(old_names(&text), [(3, name)]);
        assert!(OLD_NAMES.lines().is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn a_summary_ends_with_its_first_sentence() {
        assert_eq!(summary("Returns 0.5 m. Constant work."), "Returns 0.5 m.");
        assert_eq!(summary("Ports, e.g. a UART. More."), "Ports, e.g. a UART.");
        assert_eq!(summary("No full stop"), "No full stop");
    }

    #[test]
    fn first_words_and_lengths_are_checked() {
        let right = [
            "Returns x.",
            "The lease.",
            "`serial` ports.",
            "1 to 3.",
            "Whetherman.",
        ];
        assert!(right.into_iter().all(|text| fault(text).is_none()));
        let wrong = ["Whether x.", "Of x.", "it is.", "Who", "What?"];
        assert!(wrong.into_iter().all(|text| fault(text).is_some()));
        assert!(fault(&"x".repeat(100)).is_none());
        assert!(fault(&"µ".repeat(101)).is_some());
    }

    #[test]
    fn comments_are_blocks_with_a_first_paragraph() {
        let source = "//! Module.\n\n/// One\n/// two.\n///\n/// Three.\nfn f() {}\n//// No doc.\n// None.\n  /// Table:\n  /// | a |\n";
        let found: Vec<(usize, String)> = comments(source)
            .into_iter()
            .map(|comment| (comment.line, comment.paragraph))
            .collect();
        let expected = [(1, "Module."), (3, "One two."), (10, "Table:")];
        assert_eq!(found, expected.map(|(at, text)| (at, text.into())));
    }
}
