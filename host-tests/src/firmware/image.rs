//! Firmware images, built by cargo for the tests.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Target triple of the firmware: Arm Cortex-M4F.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// Cargo profile of the firmware images.
pub const PROFILE: &str = "firmware";

/// Builds the firmware `examples` and returns the folder with copies of their images.
///
/// If `smallest` is true, the only feature is the log, and the names of the copies begin with `smallest_`; otherwise
/// the images have all features. Cargo's target folder is the usual one, so that dependencies are built only once.
///
/// # Errors
/// The output of cargo, if it fails; or a copy that cannot be written.
pub fn build(examples: &[&str], smallest: bool) -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .ok_or("the workspace has moved since this program was built")?;
    let folder =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .current_dir(root)
        .args(["build", "--locked", "--package", "uav-relay"])
        .args(["--profile", PROFILE, "--target", TARGET])
        .arg("--target-dir")
        .arg(&folder);
    if smallest {
        command.args(["--no-default-features", "--features", "defmt"]);
    } else {
        command.args(["--features", "defmt,async,internals"]);
    }
    for example in examples {
        command.args(["--example", example]);
    }
    // The host compiler's flags are not for the target. The tests read the log at the level of `.cargo/config.toml`.
    for variable in ["RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "DEFMT_LOG"] {
        command.env_remove(variable);
    }
    let output = command
        .output()
        .map_err(|error| format!("cargo cannot be run: {error}"))?;
    if !output.status.success() {
        return Err(format!(
            "the firmware cannot be built (for a missing target, type: rustup target add {TARGET})\n{}",
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    let copies = folder.join("emulated");
    let copy = |example: &&str| {
        let name = if smallest {
            format!("smallest_{example}")
        } else {
            (*example).to_owned()
        };
        let image = folder
            .join(TARGET)
            .join(PROFILE)
            .join("examples")
            .join(example);
        std::fs::copy(image, copies.join(name)).map(drop)
    };
    std::fs::create_dir_all(&copies)
        .and_then(|()| examples.iter().try_for_each(copy))
        .map_err(|error| format!("{}: {error}", copies.display()))?;
    Ok(copies)
}
