//! Builds the page, for `cargo page`, as one file, `page/index.html` in the target folder. The page needs no server and no external
//! resources.

use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use wasm_bindgen_cli_support::Bindgen;

const TARGET: &str = "wasm32-unknown-unknown";

/// Scripts of the page in loading order: each script comes after the scripts that it uses.
const SCRIPTS: [&str; 7] = [
    "drawing.js",
    "wish.js",
    "engine.js",
    "playback.js",
    "words.js",
    "hand.js",
    "page.js",
];

/// Options of the run that the page shows first.
///
/// They must be the same as those that the page's script `wish.js` begins with. The result of the run is embedded in
/// the page, so that the result is visible before the WebAssembly code is loaded.
const FIRST_OPTIONS: &str = "--uavs 8 --method align";
const FIRST_SCENARIO: &str = "[geometry]
distance_m = 1000.0
altitude_m = 20.0
min_separation_m = 4.0
[power]
tx_w = 80.0
uav_w = 1.0
[[interferer]]
power_w = 80.0
x_m = 500.0
y_m = 400.0
";

const HELP: &str = "\
Builds the interactive page of the simulator (WebAssembly, in one HTML file) and prints its path

Usage: cargo page

It has no options but -h, --help; the target folder is that of CARGO_TARGET_DIR, else `target`
";

/// Returns the text to print for the command line arguments, and true if they are valid.
///
/// `None` without arguments: the program then builds the page.
fn answer(arguments: &[String]) -> Option<(String, bool)> {
    match arguments {
        [] => None,
        [one] if matches!(one.as_str(), "-h" | "--help") => Some((HELP.to_owned(), true)),
        [one, ..] => Some((
            format!("page: unexpected argument '{one}': only --help is allowed\n"),
            false,
        )),
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match answer(&arguments) {
        Some((text, true)) => {
            print!("{text}");
            return ExitCode::SUCCESS;
        }
        Some((text, false)) => {
            eprint!("{text}");
            return ExitCode::from(2);
        }
        None => {}
    }
    match build() {
        Ok(page) => {
            println!("{}", page.display());
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("page: {error}");
            ExitCode::FAILURE
        }
    }
}

fn build() -> Result<PathBuf, Box<dyn Error>> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = own.ancestors().nth(3).ok_or("no folder above")?;
    let target = target_directory(&mut Command::new("cargo"), root)?;
    add_target()?;
    let built = Command::new("cargo")
        .current_dir(root)
        .args(["build", "--locked", "--package", "uav-relay-page"])
        .args(["--lib", "--target", TARGET, "--profile", "browser"])
        .status()?;
    if !built.success() {
        return Err(format!("cargo build --target {TARGET} failed").into());
    }
    let wasm = target.join(TARGET).join("browser/uav_relay_page.wasm");
    let folder = target.join("page");
    std::fs::create_dir_all(&folder)?;
    // A plain script, because a page opened as a file may not load modules.
    Bindgen::new()
        .input_path(wasm)
        .no_modules(true)?
        .typescript(false)
        .generate(&folder)
        .map_err(|error| format!("wasm-bindgen: {error}"))?;
    let code = std::fs::read(folder.join("uav_relay_page_bg.wasm"))?;
    let glue = std::fs::read_to_string(folder.join("uav_relay_page.js"))?;
    let web = own.join("../web");
    let part = |name: &str| std::fs::read_to_string(web.join(name));
    let mut scripts = String::new();
    for name in SCRIPTS {
        scripts += &part(name)?;
    }
    let first = uav_relay_page::chain(FIRST_OPTIONS, FIRST_SCENARIO, true);
    let page = part("index.html")?
        .replace("/*style*/", &part("page.css")?)
        .replace("/*first*/", &first)
        .replace("/*scripts*/", &scripts)
        .replace("/*glue*/", &glue)
        .replace("/*code*/", &BASE64_STANDARD.encode(packed(&code)?));
    let file = folder.join("index.html");
    std::fs::write(&file, page)?;
    Ok(file)
}

/// Returns cargo's target folder. It is `target`, unless `CARGO_TARGET_DIR` or cargo's configuration names another
/// folder.
fn target_directory(cargo: &mut Command, root: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let output = cargo
        .current_dir(root)
        .args(["metadata", "--format-version", "1", "--no-deps", "--locked"])
        .output()?;
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let folder = metadata.get("target_directory").and_then(|it| it.as_str());
    Ok(folder.ok_or("cargo metadata: no target_directory")?.into())
}

fn packed(code: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(code)?;
    encoder.finish()
}

fn add_target() -> Result<(), Box<dyn Error>> {
    let libraries = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", TARGET])
        .output()?;
    let folder = String::from_utf8(libraries.stdout)?;
    if Path::new(folder.trim()).is_dir() {
        return Ok(());
    }
    let added = Command::new("rustup")
        .args(["target", "add", TARGET])
        .status();
    if added.is_ok_and(|status| status.success()) {
        Ok(())
    } else {
        Err(format!("the target is missing; type: rustup target add {TARGET}").into())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by it")]

    use super::*;

    #[test]
    fn help_and_wrong_arguments_build_nothing() {
        let answers = |words: &[&str]| {
            let words: Vec<String> = words.iter().map(|&word| word.to_owned()).collect();
            answer(&words)
        };
        assert_eq!(answers(&[]), None);
        let (help, is_valid) = answers(&["--help"]).unwrap();
        assert!(is_valid && help.contains("Usage: cargo page"), "{help}");
        for wrong in [&["--open"][..], &["a", "--help"]] {
            let (line, is_valid) = answers(wrong).unwrap();
            assert!(!is_valid && line.contains(wrong[0]), "{line}");
        }
    }

    #[test]
    fn the_page_follows_the_target_folder_of_cargo() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"))
            .ancestors()
            .nth(3)
            .unwrap();
        let mut elsewhere = Command::new("cargo");
        elsewhere.env("CARGO_TARGET_DIR", "/nowhere/built");
        let folder = target_directory(&mut elsewhere, root).unwrap();
        assert_eq!(folder, Path::new("/nowhere/built"));
        let mut usual = Command::new("cargo");
        usual.env_remove("CARGO_TARGET_DIR");
        assert_eq!(
            target_directory(&mut usual, root).unwrap(),
            root.join("target")
        );
    }
}
