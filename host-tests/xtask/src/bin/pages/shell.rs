//! Folder like a clean clone, and a shell in it. It maps `cargo chain` and other aliases to built binaries.

use std::fmt::Write as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// Packages with the programs of the pages.
const PACKAGES: [&str; 4] = [
    "uav-relay-sim",
    "uav-relay-tools",
    "uav-relay-decode",
    "uav-relay-linux",
];

/// Time limits of a block and of a slow one, s.
const LIMIT_S: u32 = 60;
const SLOW_S: u32 = 1_800;

/// Time limit of a command without its hardware, s.
const BEGUN_S: u32 = 2;

/// Key files that commands of the pages name, which a user makes first.
const KEYS: [&str; 2] = ["network.key", "network7.key"];

const NOT_CLONED: [&str; 2] = ["target", ".git"];

/// Folder, and script that is run before each block.
#[derive(Debug)]
pub(crate) struct Shell {
    folder: PathBuf,
    root: PathBuf,
    before: String,
}

impl Shell {
    pub(crate) fn build(root: &Path) -> Result<Self, String> {
        let failed = |what: &str, error: &dyn std::fmt::Display| format!("{what}: {error}");
        let mut build = Command::new("cargo");
        build.args(["build", "--quiet", "--locked", "--bins"]);
        for package in PACKAGES {
            build.args(["--package", package]);
        }
        let status = build.current_dir(root).status();
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

    /// Recreates the folder, so that each page starts in a clean clone.
    pub(crate) fn clean(&self) -> Result<(), String> {
        let failed = |error: std::io::Error| format!("{}: {error}", self.folder.display());
        // The folder may not exist.
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

    /// Runs a script like a user, until its first command that fails; returns its output.
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

    /// Starts a command without its hardware. Returns its exit status, `None` after a signal, and its output.
    pub(crate) fn begin(&self, command: &str) -> Result<(Option<i32>, String), String> {
        let (status, said) = self.ended(command, BEGUN_S)?;
        Ok((status.code(), said))
    }

    /// Runs a script with a time limit, s; returns its exit status and output.
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

/// Returns a shell function `cargo` that runs the built binaries in `bin` for aliases of `config`. It runs everything else in
/// `root`, so that nothing is built again for other paths.
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

#[cfg(test)]
mod tests {
    use super::functions;

    #[test]
    fn an_alias_whose_program_is_there_is_a_case_of_the_function() {
        let config = "[alias]\nsh = \"run --package p --bin sh --\"\nother = \"run --package p --bin not-there --\"\n";
        let all = functions(config, "/bin".as_ref(), "/root".as_ref());
        assert!(all.contains("sh) shift; '/bin/sh' \"$@\";;"), "{all}");
        assert!(!all.contains("other"), "{all}");
        assert!(all.contains("(cd '/root' && command cargo"), "{all}");
    }
}
