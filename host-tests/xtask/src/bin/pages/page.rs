//! Parses the code blocks of a page.

/// Words that mark a block of commands as not run.
const WHY_NOT: [&str; 6] = ["hardware", "itself", "root", "slow", "tested", "window"];

/// Content of a block.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Commands, and the word that marks them as not run.
    Commands(Option<String>),
    /// Output of a command, or any other text.
    Text,
    Other,
}

/// A fenced block.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Line number of its first fence.
    pub(crate) line: usize,
    /// Number of its heading, from 1.
    heading: usize,
    pub(crate) kind: Kind,
    /// True for a `console`, where commands begin with `$ `.
    is_console: bool,
    /// True if numbers are not compared.
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

    /// Returns the expected output.
    pub(crate) fn printed(&self) -> Vec<&str> {
        let lines = self.lines.iter().map(String::as_str);
        match self.kind {
            Kind::Commands(_) if !self.is_console => Vec::new(),
            _ => lines.filter(|line| !line.starts_with("$ ")).collect(),
        }
    }

    /// Returns true if this block is the output of `commands`, the previous block.
    pub(crate) fn prints(&self, commands: &Self) -> bool {
        self.kind == Kind::Text && self.heading == commands.heading
    }
}

/// Returns the command and its exit status, if its comment begins with one.
fn status(line: &str) -> Option<(&str, u8)> {
    let (command, comment) = line.split_once(" # exit status ")?;
    let digits = comment.split(|sign: char| !sign.is_ascii_digit()).next()?;
    Some((command.trim_end(), digits.parse().ok()?))
}

/// Returns the blocks of a page.
///
/// # Errors
/// The line of a fence with an unknown word, or without an end.
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

#[cfg(test)]
mod tests {
    use super::{Kind, blocks};

    const PAGE: &str = "# One\n\n```sh\na \\\n  b\n```\n\nprints\n\n```text\n1 s\n```\n\n## Two\n\n```text\nx\n```\n\n```console root\n$ c\nd\n```\n";

    #[test]
    fn commands_and_what_they_print_are_told_apart() {
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
    fn a_command_has_to_end_with_the_status_that_its_comment_begins_with() {
        let all = blocks("```sh\na   # exit status 2: no\nb   # 2\n```\n").unwrap_or_default();
        let commands = all.first().map(super::Block::commands);
        let expected = "s=0; { a; } || s=$?; [ $s = 2 ]\nb   # 2";
        assert_eq!(commands.as_deref(), Some(expected));
    }

    #[test]
    fn a_word_that_is_not_known_and_a_block_without_an_end_are_named() {
        for (page, line) in [("```sh later\n```\n", "1: "), ("\n```sh\n", "2: ")] {
            let error = blocks(page).err().unwrap_or_default();
            assert!(error.starts_with(line), "{error}");
        }
    }
}
