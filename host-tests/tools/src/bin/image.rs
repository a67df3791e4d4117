//! `cargo image`: flash images of a board as `.bin`, `.hex` and `.uf2`.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use clap::Parser;
use uav_relay_sim::command::{self, Failure};
use uav_relay_tools::image::{BOARDS, Board, Piece, flat, hex, pieces, uf2};
use uav_relay_tools::provision::config::LEN;

/// Builds a board's image, or converts a configuration block. Writes .bin and .hex, and .uf2 for the Pico 2.
#[derive(Parser, Debug)]
#[command(name = "image", bin_name = "cargo image", disable_version_flag = true)]
struct Options {
    /// Board: stm32f405, stm32f405-embassy, nucleo-f446re or pico2
    #[arg(long, value_name = "B", value_parser = board)]
    board: Board,
    /// Build the image for one UART to a radio that all relays share; otherwise one UART to each neighbour
    #[arg(long)]
    radio: bool,
    /// Convert this block of `cargo provision`, for the board's block address, and build nothing
    #[arg(long, value_name = "FILE", conflicts_with = "radio")]
    block: Option<PathBuf>,
    /// Output folder
    #[arg(long, value_name = "DIR", default_value = "target/images")]
    out: PathBuf,
}

fn board(name: &str) -> Result<Board, String> {
    Board::named(name).ok_or_else(|| {
        let names = BOARDS.map(|board| board.name);
        format!("must be one of {}", names.join(", "))
    })
}

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => command::ended(write(&options)),
        Err(error) => command::usage(&error),
    }
}

fn write(options: &Options) -> Result<(), Failure> {
    let board = &options.board;
    let (stem, pieces) = match &options.block {
        Some(block) => of_block(board, block)?,
        None => of_image(board, options.radio).map_err(Failure::unmet)?,
    };
    let whole = flat(&pieces).map_err(Failure::unmet)?;
    let mut files = vec![
        ("bin", whole.bytes.clone()),
        ("hex", hex(&pieces).map_err(Failure::unmet)?.into()),
    ];
    if let Some(family) = board.uf2 {
        files.push(("uf2", uf2(&pieces, family).map_err(Failure::unmet)?));
    }
    let out = &options.out;
    std::fs::create_dir_all(out)
        .map_err(|error| Failure::input(format!("--out {}: {error}", out.display())))?;
    for (extension, bytes) in files {
        let path = out.join(format!("{stem}.{extension}"));
        std::fs::write(&path, &bytes)
            .map_err(|error| Failure::input(format!("{}: {error}", path.display())))?;
        println!("{}: {} bytes", path.display(), bytes.len());
    }
    println!(
        "{} bytes of flash from {:#010x}",
        whole.bytes.len(),
        whole.address
    );
    Ok(())
}

fn of_image(board: &Board, radio: bool) -> Result<(String, Vec<Piece>), String> {
    let (arguments, elf) = board.build(radio);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let built = Command::new("cargo")
        .args(&arguments)
        .current_dir(&root)
        .status();
    if !built.is_ok_and(|status| status.success()) {
        return Err(format!(
            "cargo {} failed (for a missing target, type: rustup target add {})",
            arguments.join(" "),
            board.target
        ));
    }
    let bytes =
        std::fs::read(root.join(&elf)).map_err(|error| format!("{}: {error}", elf.display()))?;
    Ok((board.stem(radio), pieces(&bytes)?))
}

fn of_block(board: &Board, block: &Path) -> Result<(String, Vec<Piece>), Failure> {
    let named = |what: String| Failure::input(format!("--block {}: {what}", block.display()));
    let bytes = std::fs::read(block).map_err(|error| named(format!("cannot be read: {error}")))?;
    if bytes.len() != LEN {
        return Err(named(format!(
            "has {} bytes, but a block has {LEN} bytes",
            bytes.len()
        )));
    }
    let stem = block.file_stem().unwrap_or_default().to_string_lossy();
    let pieces = vec![Piece {
        address: board.block,
        bytes,
    }];
    Ok((stem.into_owned(), pieces))
}
