//! Evidence of a failed step. The relevant output, repeated at the end of a run, so that a log's last lines contain it.

use std::collections::VecDeque;
use std::fmt::{Display, Formatter, Result as FormatResult};
use std::io::{BufRead, Result, Write, stdout};

/// Number of last lines kept of a step that runs no tests.
const LAST_LINES: usize = 20;

/// Number of lines kept of one test binary's panics, and of the names of its failed tests.
const LINES_OF_FAILURES: usize = 100;

/// Relevant output of a failed step: each test binary's `failures:`, or else the last lines.
#[derive(Default)]
pub(crate) struct Evidence {
    failures: Vec<String>,
    last: VecDeque<String>,
    /// Remaining lines of the current list of failures; `None` outside a list.
    remaining: Option<usize>,
}

impl Evidence {
    /// Copies `output` to the standard output, line by line, and keeps the lines about failures.
    pub(crate) fn read(&mut self, mut output: impl BufRead) -> Result<()> {
        let mut line = Vec::new();
        while output.read_until(b'\n', &mut line)? > 0 {
            stdout().write_all(&line)?;
            self.add(String::from_utf8_lossy(&line).trim_end());
            line.clear();
        }
        Ok(())
    }

    pub(crate) fn add(&mut self, line: &str) {
        // The heading appears twice: before the panics, and before the names.
        if line == "failures:" {
            self.remaining = Some(LINES_OF_FAILURES);
        }
        if line.starts_with("test result:") && self.remaining.take().is_some() {
            self.failures.push(line.to_owned());
        }
        if let Some(remaining @ 1..) = &mut self.remaining {
            *remaining -= 1;
            self.failures.push(line.to_owned());
        }
        if self.last.len() == LAST_LINES {
            self.last.pop_front();
        }
        self.last.push_back(line.to_owned());
    }
}

impl Display for Evidence {
    fn fmt(&self, f: &mut Formatter<'_>) -> FormatResult {
        if self.failures.is_empty() {
            self.last.iter().try_for_each(|line| writeln!(f, "{line}"))
        } else {
            self.failures
                .iter()
                .try_for_each(|line| writeln!(f, "{line}"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Evidence;

    #[test]
    fn failures_of_each_test_binary_are_kept_with_their_panics() {
        let output = "running 2 tests\ntest a ... ok\ntest b ... FAILED\n\nfailures:\n\n---- b stdout ----\npanicked at 3\n\n\
                      failures:\n    b\n\ntest result: FAILED. 1 passed\nrunning 1 test\ntest c ... ok\ntest result: ok. 1 passed\n";
        let mut evidence = Evidence::default();
        output.lines().for_each(|line| evidence.add(line));
        let kept = evidence.to_string();
        assert!(
            kept.starts_with("failures:\n\n---- b stdout ----\npanicked at 3\n"),
            "{kept}"
        );
        assert!(
            kept.ends_with("    b\n\ntest result: FAILED. 1 passed\n"),
            "{kept}"
        );
    }

    #[test]
    fn a_step_without_tests_is_told_by_its_last_lines() {
        let mut evidence = Evidence::default();
        (0..50).for_each(|number| evidence.add(&format!("line {number}")));
        let kept = evidence.to_string();
        assert!(
            kept.starts_with("line 30\n") && kept.ends_with("line 49\n"),
            "{kept}"
        );
    }
}
