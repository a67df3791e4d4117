//! Figures of the relay image: sizes and largest stack; and the proof that it cannot panic.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use object::{Object as _, ObjectSection as _, SectionFlags};
use uav_relay_xtask::stack::Calls;
use uav_relay_xtask::toolchain::llvm_tool;

use super::{Row, row};

const TARGET: &str = "thumbv7em-none-eabihf";

const RELAY: &str = "stm32f405";

/// Firmware image with one port, to a shared radio.
const RADIO: &str = "stm32f405_radio";

/// Firmware image with asynchronous ports.
const ASYNC: &str = "stm32f405_async";

const ASYNC_FEATURES: &[&str] = &["--no-default-features", "--features", "async"];

pub(crate) fn of_the_relay_image() -> Result<Vec<Row>, String> {
    let (flash_with_log, ram_with_log) = sizes(&build(RELAY, &["--features", "defmt"])?)?;
    let mut rows = Vec::new();
    for image in IMAGES {
        rows.extend(of(&proven(image)?, image)?);
    }
    // The last image has the features of a usual build.
    let usual = sizes(&build(RELAY, &[])?)?;
    if let [.., flash, ram, _] = &rows[..]
        && (flash.value, ram.value) != usual
    {
        return Err(format!(
            "the image that cannot panic has other sizes than the flashed one, {usual:?}"
        ));
    }
    let what = "flash of the relay image on asynchronous ports, Algorithm 1 alone";
    let costs = [69 * 1024 + 448, 5_184, 4_608];
    let image = (what, ASYNC, ASYNC_FEATURES, costs);
    rows.extend(of(&build(ASYNC, ASYNC_FEATURES)?, &image)?);
    rows.extend([
        row("its flash with defmt", "bytes", flash_with_log, None),
        row("its static RAM with defmt", "bytes", ram_with_log, None),
    ]);
    Ok(rows)
}

/// Measured image: description, example, cargo options, and budgets in bytes.
///
/// The budgets are those for flash, static RAM and stack.
type Image = (
    &'static str,
    &'static str,
    &'static [&'static str],
    [u64; 3],
);

/// Measured firmware images, with the maximum of flash, static RAM and stack.
///
/// The code that relay and ground station share costs an image with `auth` 0.4 KB of flash, and saves it 0.8 KB of
/// stack.
const IMAGES: &[Image] = &[
    (
        "flash of the relay image, Algorithm 1 alone",
        RELAY,
        &["--no-default-features"],
        [66 * 1024 + 768, 5_856, 3_328],
    ),
    (
        "flash of the relay image with `guard`",
        RELAY,
        &["--no-default-features", "--features", "guard"],
        [78 * 1024 + 640, 5_856, 4_224],
    ),
    (
        "flash of the radio image with `guard`",
        RADIO,
        &["--no-default-features", "--features", "guard"],
        [78 * 1024, 5_824, 4_224],
    ),
    (
        "flash of the relay image with `auth`",
        RELAY,
        &["--no-default-features", "--features", "auth"],
        [73 * 1024, 6_600, 3_712],
    ),
    (
        "flash of the relay image with `guard` and `upload`",
        RELAY,
        &["--no-default-features", "--features", "guard,upload"],
        [94 * 1024 + 896, 7_168, 5_120],
    ),
    (
        "flash of the relay image with `guard` and `flight`",
        RELAY,
        &["--no-default-features", "--features", "guard,flight"],
        [116 * 1024 + 768, 9_280, 4_608],
    ),
    (
        "flash of the relay image with `mavlink-signing`",
        RELAY,
        &[
            "--no-default-features",
            "--features",
            "guard,mavlink-signing",
        ],
        [119 * 1024 + 640, 9_472, 4_608],
    ),
    (
        "flash of the relay image, everything",
        RELAY,
        &[],
        // Shares of this image, and of others where stated:
        // - autopilot (f64 geodesy in software, MAVLink, a port, the guard): 26 KiB flash, 2.3 KiB RAM; signed MAVLink:
        //   3 KiB
        // - noise in every method: 3 to 4 KiB of each image
        // - sensing, which solves in f64: 20 KiB and the largest stack; of these 1.4 KiB are settings and measurements
        // - uploads that move Tx and Rx: 3.5 KiB
        // - no undone failsafes, distrust of late bytes, reports of reasons to wait: 10 KiB
        // - halt of a chain in the wrong order: 2 KiB; claims to a duplicate index: 1 to 2 KiB
        // - clock tree and watchdog: 1 to 2 KiB of every image; cells of the best start: 600 bytes RAM
        // - recovery of stuck parts of a chain, reports of faulty sensors, tolerated clock steps: 3 KiB of each image,
        //   7 KiB of this one
        // - losses of four links per side, unflown drones as obstacles, copies of a relay with a key: 1 KiB flash, 300
        //   bytes RAM, up to 900 bytes stack of each image with a guard; the operator's command to clear a lost relay:
        //   1 KiB of those with an autopilot
        // - both directions by Algorithms 1, 2 and 4, in sensing and uploads, and longer texts: 7 KiB
        // - both directions by the joint method: 11 KiB flash, 1.6 KiB RAM, 0.5 KiB stack
        // - exact hops of both directions with interference along x: 1.5 KiB
        // - fitted slots: 5 KiB flash, 104 bytes RAM
        // - departures, spares, and motions that begin and end together: 6.75 KiB flash, 280 bytes RAM
        // - up to four departures and spares at the same time: 1 to 2 KiB flash of each image, 32 bytes RAM
        // - endurance: 4 KiB flash of this image, 1 KiB of the others with an autopilot; 180 bytes RAM
        // - a configuration block that marks spares: 250 bytes flash
        // - states of refused setpoints and of nodes with another mission or key in reports: 1 KiB
        [246 * 1024, 16_664, 7_168],
    ),
];

fn of(
    elf: &Path,
    &(what, example, features, [flash, ram, stack]): &Image,
) -> Result<[Row; 3], String> {
    let (flash_taken, ram_taken) = sizes(elf)?;
    let flies = features.is_empty()
        || features
            .iter()
            .any(|of| of.contains("flight") || of.contains("mavlink"));
    let (thread, handler) = deepest_stack(elf, example != RADIO, flies)?;
    Ok([
        row(what, "bytes", flash_taken, Some(flash)),
        row("its static RAM", "bytes", ram_taken, Some(ram)),
        row(
            "its stack, upper bound with one interrupt",
            "bytes",
            thread + handler,
            Some(stack),
        ),
    ])
}

pub(crate) fn run(command: &mut Command) -> Result<Output, String> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command
        .output()
        .map_err(|error| format!("{name}: {error}"))?;
    if output.status.success() {
        Ok(output)
    } else {
        Err(format!(
            "{name} failed:\n{}",
            String::from_utf8_lossy(&output.stderr)
        ))
    }
}

fn cargo(command: &str, example: &str) -> Command {
    let mut cargo = Command::new("cargo");
    cargo
        .args([command, "--package", "uav-relay"])
        .args(["--profile", "firmware", "--target", TARGET])
        .args(["--example", example]);
    cargo
}

/// Returns the path of the disassembler.
///
/// # Errors
/// The command to type, if the disassembler is missing.
pub(crate) fn objdump() -> Result<PathBuf, String> {
    let missing = "llvm-objdump is missing; type: rustup component add llvm-tools";
    llvm_tool("llvm-objdump").ok_or_else(|| missing.to_owned())
}

/// Builds a firmware example with the cargo options `more`; returns the path of its ELF file.
pub(crate) fn build(example: &str, more: &[&str]) -> Result<PathBuf, String> {
    run(cargo("build", example).args(more))?;
    Ok(elf(example))
}

fn elf(example: &str) -> PathBuf {
    let folder = Path::new("target").join(TARGET);
    folder.join("firmware/examples").join(example)
}

/// Links a firmware image with a panic handler that cannot be linked: a proof that it cannot panic.
///
/// Without a reachable panic, the handler is not part of the image, so that the image is the flashed one to the byte.
fn proven(&(what, example, features, _): &Image) -> Result<PathBuf, String> {
    let mut link = cargo("rustc", example);
    link.args(features).args(["--", "--cfg", "prove_no_panic"]);
    run(&mut link).map_err(|error| format!("a panic is reachable, {what}: {error}"))?;
    Ok(elf(example))
}

pub(crate) fn sizes(elf: &Path) -> Result<(u64, u64), String> {
    let bytes = std::fs::read(elf).map_err(|error| format!("{}: {error}", elf.display()))?;
    let file = object::File::parse(&*bytes).map_err(|error| error.to_string())?;
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags } = section.flags() else {
            continue;
        };
        let taken = sh_flags & u64::from(object::elf::SHF_ALLOC) != 0;
        let in_ram = section.address() >= 0x2000_0000;
        let stored = section.kind() != object::SectionKind::UninitializedData;
        flash += if taken && stored { section.size() } else { 0 };
        ram += if taken && in_ram { section.size() } else { 0 };
    }
    Ok((flash, ram))
}

/// Returns the largest stacks of the main thread and of one interrupt, bytes.
///
/// The thread begins with the function that `Reset` calls. The interrupt's stack includes the registers that the
/// processor saves, also those of its floating-point unit. `pair` is true for ports to two neighbours, `flies` for a
/// port to an autopilot.
pub(crate) fn deepest_stack(elf: &Path, pair: bool, flies: bool) -> Result<(u64, u64), String> {
    const EXCEPTION_FRAME: u64 = 104;
    let output = run(Command::new(objdump()?)
        .args(["-d", "--no-show-raw-insn"])
        .arg(elf))?;
    let bytes = std::fs::read(elf).map_err(|error| error.to_string())?;
    let file = object::File::parse(&*bytes).map_err(|error| error.to_string())?;
    let constants = file
        .sections()
        .filter(|section| matches!(section.name(), Ok(".rodata" | ".data")));
    let constants: Vec<u32> = constants
        .filter_map(|section| section.data().ok())
        .flat_map(|data| {
            data.as_chunks::<4>()
                .0
                .iter()
                .map(|word| u32::from_le_bytes(*word))
        })
        .collect();
    let calls = Calls::read(
        &String::from_utf8_lossy(&output.stdout),
        constants.into_iter(),
    )
    .map_err(|error| error.to_string())?;
    let deepest = |name: &str| calls.deepest(name).map_err(|error| error.to_string());
    let (thread, path) = deepest("main")?;
    println!("deepest stack: {thread} bytes by {}", path.join(" > "));
    let mut handler = 0;
    // A radio needs only one port. Without the feature `flight` the autopilot's port is not used.
    let others = [pair.then_some("USART3"), flies.then_some("USART1")];
    for name in ["USART2", "SysTick"]
        .into_iter()
        .chain(others.into_iter().flatten())
    {
        handler = deepest(name)?.0.max(handler);
    }
    Ok((thread, EXCEPTION_FRAME + handler))
}

/// Checks that an image with a deliberate panic does not link. [`proven`] links the images without it.
pub(crate) fn a_panic_is_found() -> Result<(), String> {
    only_finished_futures_panic()?;
    let mut link = cargo("rustc", RELAY);
    link.args(["--", "--cfg", "prove_no_panic", "--cfg", "panic_on_purpose"]);
    match run(&mut link) {
        Ok(_) => Err("the deliberate panic was linked, so the check cannot detect panics".into()),
        Err(error) if error.contains("a_panic_is_reachable") => Ok(()),
        Err(error) => Err(format!(
            "the image with a deliberate panic failed to link for another reason: {error}"
        )),
    }
}

/// Checks that the asynchronous image can panic only if a completed future is polled.
///
/// The compiler adds this panic to each `async fn`, so the image cannot link without a panic handler. An `await`
/// never reaches it.
fn only_finished_futures_panic() -> Result<(), String> {
    const FINISHED: &str = "panic_const_async_fn_resumed";
    let image = build(ASYNC, ASYNC_FEATURES)?;
    let output = run(Command::new(objdump()?)
        .args(["-d", "-C", "--no-show-raw-insn"])
        .arg(&image))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let (mut inside, mut finished) = ("", 0);
    for line in text.lines() {
        if line.ends_with(">:") {
            inside = line;
        } else if line.contains("<core::panicking::") && !inside.contains("<core::panicking::") {
            if !line.contains(FINISHED) {
                return Err(format!(
                    "a panic is reachable, asynchronous: {inside} {line}"
                ));
            }
            finished += 1;
        }
    }
    // If there were no such panic at all, the search pattern would be wrong.
    if finished == 0 {
        return Err("the asynchronous image has no panic at all: link it with the others".into());
    }
    Ok(())
}
