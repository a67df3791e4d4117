//! `cargo template`: writes a minimal firmware with one main loop into an empty folder.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::Parser;
use uav_relay_xtask::template::{TEMPLATES, checkout, generate};

/// Write a firmware for an STM32F405 into an empty folder.
#[derive(Parser)]
#[command(name = "cargo template", bin_name = "cargo template")]
struct Arguments {
    /// Kind of main loop
    #[arg(value_parser = TEMPLATES, required_unless_present = "check")]
    name: Option<String>,
    /// Folder to write to; it must be empty or missing
    #[arg(required_unless_present = "check")]
    folder: Option<PathBuf>,
    /// Write every template into an empty folder of its own, check its formatting, lint it and build it. `cargo ci`
    /// does so
    #[arg(long, conflicts_with_all = ["name", "folder"])]
    check: bool,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done = match (&arguments.name, &arguments.folder) {
        (Some(name), Some(folder)) => write(name, folder),
        _ => TEMPLATES.into_iter().try_for_each(check),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("template: {error}");
            ExitCode::FAILURE
        }
    }
}

fn write(name: &str, folder: &Path) -> Result<(), Box<dyn Error>> {
    generate(name, folder)?;
    println!(
        "written: {0}; next: cd {0} && cargo build --release",
        folder.display()
    );
    Ok(())
}

/// Writes a firmware template to a folder, checks its formatting, lints it and builds it.
///
/// The folder is outside this checkout, whose cargo settings would hide missing linker arguments.
fn check(name: &str) -> Result<(), Box<dyn Error>> {
    let above = std::env::temp_dir().join(format!("uav-relay-template-{}", std::process::id()));
    let folder = above.join(name);
    generate(name, &folder)?;
    let target = checkout().join("target/template");
    let commands: [&[&str]; 3] = [
        &["fmt", "--check"],
        &["clippy", "--locked", "--release", "--", "-D", "warnings"],
        &["build", "--locked", "--release"],
    ];
    let mut done: Result<(), Box<dyn Error>> = Ok(());
    for arguments in commands {
        println!("template {name}: cargo {}", arguments.join(" "));
        let status = Command::new("cargo")
            .current_dir(&folder)
            .args(arguments)
            .env("CARGO_TARGET_DIR", &target)
            .env_remove("RUSTFLAGS")
            .status()?;
        if !status.success() {
            done = Err(format!("{name}: cargo {} failed", arguments.join(" ")).into());
            break;
        }
    }
    std::fs::remove_dir_all(above)?;
    done?;
    let image = target.join("thumbv7em-none-eabihf/release/my-relay");
    is_placed(&std::fs::read(image)?).map_err(|why| format!("{name}: {why}").into())
}

/// Checks that the firmware image has its vector table at the start of the flash.
///
/// Without the linker script the link succeeds, but the image is empty.
fn is_placed(image: &[u8]) -> Result<(), String> {
    use object::{Object as _, ObjectSection as _};
    let file = object::File::parse(image).map_err(|error| error.to_string())?;
    let section = file.section_by_name(".vector_table");
    let section = section.ok_or("the image has no vector table: the linker script was not used")?;
    let code = file.section_by_name(".text").map_or(0, |text| text.size());
    match (section.address(), code) {
        (0x0800_0000, 10_000..) => Ok(()),
        (address, code) => Err(format!(
            "the vector table is at {address:#x} and the code takes {code} bytes"
        )),
    }
}
