//! Code blocks of a page: parsing, running and comparison.

use std::cmp::Reverse;
use std::fmt::{self, Write as _};
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// Words after a code block's opening fence that mark the commands of the block as not run.
const WHY_NOT: [&str; 6] = ["hardware", "itself", "root", "slow", "tested", "window"];

/// Kind of a code block on a page.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Block of shell commands, with the word that marks them as not run, if any.
    Commands(Option<String>),
    /// Block `text`: output of the preceding commands, or any other text.
    Text,
    Other,
}

/// Fenced code block of a Markdown page.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Line number of the opening fence, from 1.
    pub(crate) line: usize,
    /// Number of headings before this block.
    heading: usize,
    pub(crate) kind: Kind,
    /// True for a block `console`: lines with `$ ` are commands, all other lines are output.
    is_console: bool,
    /// True if numbers in the output may differ from the page.
    pub(crate) noisy: bool,
    lines: Vec<String>,
}

impl Block {
    pub(crate) fn commands(&self) -> String {
        let lines = self.lines.iter().map(String::as_str);
        let commands: Vec<&str> = if self.is_console {
            lines.filter_map(|line| line.strip_prefix("$ ")).collect()
        } else {
            lines.collect()
        };
        let may_fail = |line: &str| match status(line) {
            Some((command, status)) => format!("s=0; {{ {command}; }} || s=$?; [ $s = {status} ]"),
            None => line.to_owned(),
        };
        let commands: Vec<String> = commands.into_iter().map(may_fail).collect();
        commands.join("\n")
    }

    /// Returns the expected output lines of a block, without commands.
    pub(crate) fn printed(&self) -> Vec<&str> {
        let lines = self.lines.iter().map(String::as_str);
        match self.kind {
            Kind::Commands(_) if !self.is_console => Vec::new(),
            _ => lines.filter(|line| !line.starts_with("$ ")).collect(),
        }
    }

    /// Returns true if this block is the expected output of the preceding block `commands`.
    pub(crate) fn prints(&self, commands: &Self) -> bool {
        self.kind == Kind::Text && self.heading == commands.heading
    }
}

/// Returns a command and its expected exit status, if a comment `# exit status N` states one.
fn status(line: &str) -> Option<(&str, u8)> {
    let (command, comment) = line.split_once(" # exit status ")?;
    let digits = comment.split(|sign: char| !sign.is_ascii_digit()).next()?;
    Some((command.trim_end(), digits.parse().ok()?))
}

/// Returns the code blocks of a Markdown page.
///
/// # Errors
/// The line of a fence with an unknown word, or of a fence that is not closed.
pub(crate) fn blocks(text: &str) -> Result<Vec<Block>, String> {
    let mut all: Vec<Block> = Vec::new();
    let (mut open, mut heading) = (None::<Block>, 0);
    for (number, line) in (1..).zip(text.lines()) {
        let fence = line.trim_start().strip_prefix("```");
        match (&mut open, fence) {
            (None, Some(info)) => open = Some(block(number, heading, info)?),
            (Some(_), Some(_)) => all.extend(open.take()),
            (Some(block), None) => block.lines.push(line.to_owned()),
            (None, None) => heading += usize::from(line.starts_with('#')),
        }
    }
    match open {
        Some(block) => Err(format!("{}: the block has no end", block.line)),
        None => Ok(all),
    }
}

fn block(line: usize, heading: usize, info: &str) -> Result<Block, String> {
    let mut words = info.split_whitespace();
    let language = words.next().unwrap_or_default();
    let rest: Vec<&str> = words.collect();
    let unknown = || {
        format!(
            "{line}: ```{info}: must be one word of {}",
            WHY_NOT.join(", ")
        )
    };
    let (kind, noisy) = match (language, &rest[..]) {
        ("sh" | "bash" | "console", []) => (Kind::Commands(None), false),
        ("sh" | "bash" | "console", [why]) if WHY_NOT.contains(why) => {
            (Kind::Commands(Some((*why).to_owned())), false)
        }
        ("sh" | "bash" | "console", _) => return Err(unknown()),
        ("text", []) => (Kind::Text, false),
        ("text", ["noisy"]) => (Kind::Text, true),
        _ => (Kind::Other, false),
    };
    Ok(Block {
        line,
        heading,
        kind,
        is_console: language == "console",
        noisy,
        lines: Vec::new(),
    })
}

/// Time limit for the commands of one code block, s. Blocks marked as slow have a longer limit.
const LIMIT_S: u32 = 60;
const SLOW_S: u32 = 1_800;

/// Time limit of a command that needs absent hardware, s: enough to check its options.
const BEGUN_S: u32 = 2;

/// Key files that the pages use; the pages assume that the user has made them.
const KEYS: [&str; 2] = ["network.key", "network7.key"];

const NOT_CLONED: [&str; 2] = ["target", ".git"];

/// Shell for the blocks of a page: folder, and script before each block.
#[derive(Debug)]
pub(crate) struct Shell {
    folder: PathBuf,
    root: PathBuf,
    before: String,
}

impl Shell {
    pub(crate) fn build(root: &Path) -> Result<Self, String> {
        let failed = |what: &str, error: &dyn fmt::Display| format!("{what}: {error}");
        // With all targets, so that the features of the dependencies, and so the builds, are those of the tests.
        let status = Command::new("cargo")
            .args(["build", "--quiet", "--locked", "--workspace"])
            .arg("--all-targets")
            .current_dir(root)
            .status();
        if !status.is_ok_and(|status| status.success()) {
            return Err("the programs do not build".to_owned());
        }
        let target =
            std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
        let target = target
            .canonicalize()
            .map_err(|error| failed("target", &error))?;
        let root = root
            .canonicalize()
            .map_err(|error| failed("root", &error))?;
        let aliases = std::fs::read_to_string(root.join(".cargo/config.toml"))
            .map_err(|error| failed(".cargo/config.toml", &error))?;
        Ok(Self {
            folder: target.join("pages"),
            before: functions(&aliases, &target.join("debug"), &root),
            root,
        })
    }

    /// Fills the shell's folder like a new clone of the project, for the next page.
    pub(crate) fn clean(&self) -> Result<(), String> {
        let failed = |error: std::io::Error| format!("{}: {error}", self.folder.display());
        // The folder possibly does not exist.
        let _ = std::fs::remove_dir_all(&self.folder);
        std::fs::create_dir_all(&self.folder).map_err(failed)?;
        for entry in std::fs::read_dir(&self.root).map_err(failed)?.flatten() {
            let name = entry.file_name();
            if !NOT_CLONED.iter().any(|other| name == *other) {
                let link = self.folder.join(&name);
                std::os::unix::fs::symlink(entry.path(), link).map_err(failed)?;
            }
        }
        for key in KEYS {
            let file = self.folder.join(key);
            std::fs::write(&file, "5e".repeat(32)).map_err(failed)?;
            let owner = std::fs::Permissions::from_mode(0o600);
            std::fs::set_permissions(&file, owner).map_err(failed)?;
        }
        std::os::unix::fs::symlink("examples/drone.toml", self.folder.join("drone.toml"))
            .map_err(failed)
    }

    /// Runs a script until its first failing command; returns its output.
    ///
    /// If `slow` is true, the time limit is longer.
    ///
    /// # Errors
    /// The exit status and the last lines of the output, if a command fails.
    pub(crate) fn run(&self, script: &str, slow: bool) -> Result<String, String> {
        let limit_s = if slow { SLOW_S } else { LIMIT_S };
        let (status, said) = self.ended(script, limit_s)?;
        if status.success() {
            return Ok(said);
        }
        let lines: Vec<&str> = said.lines().collect();
        let last = lines
            .get(lines.len().saturating_sub(5)..)
            .unwrap_or_default();
        Err(format!("ends with {status} after\n  {}", last.join("\n  ")))
    }

    /// Starts a command without its hardware; returns its exit status (`None` after a signal) and output.
    pub(crate) fn begin(&self, command: &str) -> Result<(Option<i32>, String), String> {
        let (status, said) = self.ended(command, BEGUN_S)?;
        Ok((status.code(), said))
    }

    /// Runs `script` for at most `limit_s` seconds; returns its exit status and output.
    fn ended(&self, script: &str, limit_s: u32) -> Result<(ExitStatus, String), String> {
        let limit = format!("{limit_s}");
        let script = format!("exec 2>&1\n{}\n{script}\n", self.before);
        let output = Command::new("timeout")
            .args(["--kill-after=5", &limit, "bash", "-e", "-c", &script])
            .current_dir(&self.folder)
            .stdin(Stdio::null())
            .output()
            .map_err(|error| format!("timeout: {error}"))?;
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        Ok((output.status, said))
    }
}

/// Returns the definition of a shell function `cargo` for the commands of a page.
///
/// For an alias in `config` it runs the program already built in `bin`, otherwise the real cargo in the folder `root`.
/// From a different folder, cargo would build everything again, because the paths differ.
fn functions(config: &str, bin: &Path, root: &Path) -> String {
    let mut cases = String::new();
    for line in config.lines() {
        let Some((name, command)) = line.split_once(" = \"run ") else {
            continue;
        };
        let mut words = command.split_whitespace();
        let program = words.by_ref().skip_while(|word| *word != "--bin").nth(1);
        let path = bin.join(program.unwrap_or_default());
        if path.is_file() {
            let _ = writeln!(cases, "{name}) shift; '{}' \"$@\";;", path.display());
        }
    }
    let root = root.display();
    format!(
        "cargo() {{ case \"$1\" in\n{cases}*) (cd '{root}' && command cargo \"$@\");;\nesac; }}"
    )
}

/// Line of a page that is not in the output.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Difference {
    /// Line of the page.
    pub line: String,
    /// The most similar line of the output after the lines found before; empty if there is none.
    pub like: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, like } = self;
        write!(f, "is not printed: {line}\n  most like it is: {like}")
    }
}

/// Returns the lines of the page that do not occur in the output in this order.
///
/// Other lines may stand in between. If `noisy` is true, each number matches any number. After a line that does not occur, the search goes on after the
/// most similar line.
pub(crate) fn differences(page: &[&str], output: &str, noisy: bool) -> Vec<Difference> {
    let read = |line: &str| {
        if noisy {
            unnumbered(line)
        } else {
            line.trim_end().to_owned()
        }
    };
    let mut found = Vec::new();
    let mut left = output.lines();
    for line in page.iter().filter(|line| line.trim() != "...") {
        let wanted = read(line);
        if wanted.is_empty() {
            continue;
        }
        let rest = left.clone();
        if left.any(|printed| read(printed) == wanted) {
            continue;
        }
        // The first of the most similar lines.
        let similar = rest.clone().enumerate();
        let like =
            similar.max_by_key(|(at, printed)| (alike(&read(printed), &wanted), Reverse(*at)));
        left = rest;
        if let Some((at, _)) = like {
            left.nth(at);
        }
        found.push(Difference {
            line: (*line).to_owned(),
            like: like.map_or(String::new(), |(_, line)| line.trim_end().to_owned()),
        });
    }
    found
}

/// Returns the page `text` with the different line, sought after line `from`, replaced by the output's.
pub(crate) fn corrected(text: &str, from: usize, difference: &Difference) -> String {
    let mut lines: Vec<&str> = text.split('\n').collect();
    let after = lines.iter_mut().skip(from);
    let mut equal = after.filter(|line| **line == difference.line);
    if let Some(line) = equal.next()
        && !difference.like.is_empty()
    {
        *line = &difference.like;
    }
    lines.join("\n")
}

/// Replaces each number in a line with `#`, and each run of spaces with one space.
fn unnumbered(line: &str) -> String {
    let (mut out, mut in_number) = (String::new(), false);
    for sign in line.trim_end().chars() {
        let is_part = sign.is_ascii_digit() || in_number && sign == '.';
        if is_part && !in_number {
            out.push('#');
        }
        let is_repeated = sign == ' ' && out.ends_with(' ');
        if !is_part && !is_repeated {
            out.push(sign);
        }
        in_number = is_part;
    }
    out
}

/// Returns how many words of the line `one` also occur in `other`.
fn alike(one: &str, other: &str) -> usize {
    let words: Vec<&str> = other.split_whitespace().collect();
    let common = one.split_whitespace().filter(|word| words.contains(word));
    common.count()
}

#[cfg(test)]
mod tests {
    use super::{Difference, Kind, blocks, corrected, differences, functions};

    const PAGE: &str = "# One\n\n```sh\na \\\n  b\n```\n\nprints\n\n```text\n1 s\n```\n\n## Two\n\n```text\nx\n```\n\n```console root\n$ c\nd\n```\n";

    #[test]
    fn commands_and_their_output_are_distinguished() {
        let all = blocks(PAGE).unwrap_or_default();
        let [one, said, other, console] = &all[..] else {
            unreachable!("{all:?}")
        };
        assert_eq!(one.commands(), "a \\\n  b");
        assert_eq!((one.line, one.printed().len()), (3, 0));
        assert!(said.prints(one) && !other.prints(one), "under one heading");
        assert_eq!(said.printed(), ["1 s"]);
        assert_eq!(console.kind, Kind::Commands(Some("root".to_owned())));
        assert_eq!(
            (console.commands(), console.printed()),
            ("c".to_owned(), vec!["d"])
        );
    }

    #[test]
    fn a_command_must_end_with_its_comments_status() {
        let all = blocks("```sh\na   # exit status 2: no\nb   # 2\n```\n").unwrap_or_default();
        let commands = all.first().map(super::Block::commands);
        let expected = "s=0; { a; } || s=$?; [ $s = 2 ]\nb   # 2";
        assert_eq!(commands.as_deref(), Some(expected));
    }

    #[test]
    fn unknown_words_and_unclosed_blocks_are_named() {
        for (page, line) in [("```sh later\n```\n", "1: "), ("\n```sh\n", "2: ")] {
            let error = blocks(page).err().unwrap_or_default();
            assert!(error.starts_with(line), "{error}");
        }
    }

    #[test]
    fn an_alias_with_its_program_is_a_case_of_the_function() {
        let config = "[alias]\nsh = \"run --package p --bin sh --\"\nother = \"run --package p --bin not-there --\"\n";
        let all = functions(config, "/bin".as_ref(), "/root".as_ref());
        assert!(all.contains("sh) shift; '/bin/sh' \"$@\";;"), "{all}");
        assert!(!all.contains("other"), "{all}");
        assert!(all.contains("(cd '/root' && command cargo"), "{all}");
    }

    const OUTPUT: &str = "  0.10 s  one\nother \n 12.5 s  two\n";

    #[test]
    fn lines_keep_their_order_and_only_noisy_numbers_vary() {
        let good: [&[&str]; 3] = [&["other"], &["  0.10 s  one", "...", " 12.5 s  two"], &[]];
        for page in good {
            assert_eq!(differences(page, OUTPUT, false), []);
        }
        let bad: [&[&str]; 3] = [
            &["  0.11 s  one"],
            &[" 12.5 s  two", "other"],
            &["other", "other"],
        ];
        for page in bad {
            assert_eq!(differences(page, OUTPUT, false).len(), 1, "{page:?}");
        }
        let noisy = |page: &[&str]| differences(page, OUTPUT, true).len();
        assert_eq!(noisy(&[" 9.99 s  one", " 3 s  three"]), 1);
        assert_eq!(noisy(&[" 9.99 s  one", " 3 s  two"]), 0);
    }

    #[test]
    fn each_difference_has_the_most_similar_line() {
        let page = ["  0.11 s  one", "other", "13 s  two"];
        let like = |line: &str, like: &str| Difference {
            line: line.to_owned(),
            like: like.to_owned(),
        };
        assert_eq!(
            differences(&page, OUTPUT, false),
            [
                like(page[0], "  0.10 s  one"),
                like(page[2], " 12.5 s  two")
            ]
        );
        assert_eq!(differences(&["a"], "", false), [like("a", "")]);
        assert_eq!(corrected("a\nb\na\n", 1, &like("a", "c")), "a\nb\nc\n");
        assert_eq!(corrected("a\n", 0, &like("a", "")), "a\n");
    }
}
