//! Commands of this project in blocks that need hardware. Without it they start far enough to accept or refuse their options.

/// Programs for Linux, and the aliases of `.cargo/config.toml` for them.
const PROGRAMS: [(&str, &str); 2] = [("linux_companion", "companion"), ("linux_ground", "ground")];

/// Aliases whose programs need no compiler.
const ALIASES: [&str; 6] = [
    "chain",
    "companion",
    "decode",
    "ground",
    "plan",
    "provision",
];

/// Exit statuses of a program that has accepted its options. It succeeded, it found no hardware, or it was still running at the
/// time limit.
const ACCEPTED: [i32; 3] = [0, 1, TIMEOUT];

/// Exit status of `timeout` at its limit.
const TIMEOUT: i32 = 124;

/// Returns this project's commands in a script, each as `cargo ALIAS OPTIONS`.
pub(crate) fn own_commands(script: &str) -> Vec<String> {
    let joined = script.replace("\\\n", " ");
    let own = joined.lines().filter_map(own_command);
    own.map(confirmed).collect()
}

fn own_command(line: &str) -> Option<String> {
    // The last program of a pipe reads nothing instead.
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

/// Replaces the operator's confirmation of an upload, because there is no terminal.
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

/// Checks the exit status of a command.
///
/// # Errors
/// The command, its status and its last line.
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
