//! Virtual environment of Python with the packages of the other solvers: SciPy and NLopt.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Default folder of the virtual environment, inside the target folder.
pub(crate) const USUAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/compare");

const REQUIREMENTS: &str = include_str!("../rivals/requirements.txt");
const REQUIREMENTS_FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/rivals/requirements.txt");

pub(crate) fn python(venv: &Path) -> Result<PathBuf, String> {
    let python = venv.join("bin").join("python");
    // Written last: without this file the environment is incomplete or outdated.
    let finished = venv.join("requirements.txt");
    if python.exists() && std::fs::read_to_string(&finished).is_ok_and(|text| text == REQUIREMENTS)
    {
        return Ok(python);
    }
    let mut make = Command::new("python3");
    succeed(make.args(["-m", "venv"]).arg(venv)).map_err(|why| match why {
        PythonError::Missing => {
            "python3 is not on PATH: the other solvers need Python 3.11 or later with venv and pip"
                .to_owned()
        }
        PythonError::Failed(said) => format!(
            "python3 cannot make {}; are venv and pip there? {said}",
            venv.display()
        ),
    })?;
    let install = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "--no-input",
        "--retries",
        "1",
        "--requirement",
    ];
    let mut pip = Command::new(&python);
    succeed(pip.args(install).arg(REQUIREMENTS_FILE)).map_err(|why| match why {
        PythonError::Missing => format!("{} is missing", python.display()),
        PythonError::Failed(said) => {
            let names: Vec<&str> = REQUIREMENTS.lines().collect();
            format!(
                "pip cannot install {}; is there a network, and is this Python 3.11 or later? {said}",
                names.join(", ")
            )
        }
    })?;
    std::fs::write(&finished, REQUIREMENTS)
        .map_err(|error| format!("{}: {error}", finished.display()))?;
    Ok(python)
}

enum PythonError {
    Missing,
    Failed(String),
}

fn succeed(command: &mut Command) -> Result<(), PythonError> {
    let output = command.output().map_err(|error| match error.kind() {
        ErrorKind::NotFound => PythonError::Missing,
        _ => PythonError::Failed(error.to_string()),
    })?;
    if output.status.success() {
        return Ok(());
    }
    // venv reports errors on standard output.
    let mut said = output.stderr;
    said.extend(output.stdout);
    let text = String::from_utf8_lossy(&said);
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    // The first error of pip, or the last line of another program.
    let first = lines.clone().find(|line| line.starts_with("ERROR"));
    let line = first.or_else(|| lines.next_back()).unwrap_or_default();
    Err(PythonError::Failed(line.trim().to_owned()))
}
