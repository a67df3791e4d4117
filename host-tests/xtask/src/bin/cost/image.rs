//! What is read from the relay image: its sizes, its deepest stack, and that no panic can be reached in it.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use object::{Object as _, ObjectSection as _, SectionFlags};
use uav_relay_xtask::stack::Calls;
use uav_relay_xtask::toolchain::llvm_tool;

use super::row::{Row, row};

const TARGET: &str = "thumbv7em-none-eabihf";

/// The image a person flashes.
const RELAY: &str = "stm32f405";

/// The same on asynchronous ports, to be held against [`RELAY`] with Algorithm 1 alone.
const ASYNC: &str = "stm32f405_async";

/// Its features.
const ASYNC_FEATURES: &[&str] = &["--no-default-features", "--features", "async"];

pub(crate) fn of_the_relay_image() -> Result<Vec<Row>, String> {
    let (flash_with_log, ram_with_log) = sizes(&build(RELAY, &["--features", "defmt"])?)?;
    let mut rows = Vec::new();
    for &(what, features, [flash, ram, stack]) in IMAGES {
        rows.extend(of(what, RELAY, features, flash, ram, stack)?);
    }
    let what = "flash of the relay image on asynchronous ports, Algorithm 1 alone";
    let (flash, ram, stack) = (73 * 1024, 5_120, 4_608);
    rows.extend(of(what, ASYNC, ASYNC_FEATURES, flash, ram, stack)?);
    rows.extend([
        row("its flash with defmt", "bytes", flash_with_log, None),
        row("its static RAM with defmt", "bytes", ram_with_log, None),
    ]);
    Ok(rows)
}

/// What an image is called, its features, and its budgets: flash, static RAM, stack.
type Image = (&'static str, &'static [&'static str], [u64; 3]);

/// From the smallest to the largest.
const IMAGES: &[Image] = &[
    (
        "flash of the relay image, Algorithm 1 alone",
        &["--no-default-features"],
        [70 * 1024, 5_824, 3_328],
    ),
    (
        "flash of that with `guard`",
        &["--no-default-features", "--features", "guard"],
        [81 * 1024, 5_824, 4_224],
    ),
    (
        "flash of that with `auth`",
        &["--no-default-features", "--features", "auth"],
        [75 * 1024, 6_400, 4_480],
    ),
    (
        "flash of that with `guard` and `upload`",
        &["--no-default-features", "--features", "guard,upload"],
        [96 * 1024, 6_912, 5_760],
    ),
    (
        "flash of that with `guard` and `flight`",
        &["--no-default-features", "--features", "guard,flight"],
        [118 * 1024, 9_216, 4_608],
    ),
    (
        "flash of that with `mavlink-signing`",
        &[
            "--no-default-features",
            "--features",
            "guard,mavlink-signing",
        ],
        [121 * 1024, 9_408, 4_608],
    ),
    (
        "flash of the relay image, everything",
        &[],
        // Of these flash 26 KiB and RAM 2.3 KiB are the autopilot's: geodesy in f64 without a unit for it, MAVLink, a port, and the guard,
        // which is on since the drone knows where it is, and 3 KiB that what is said there can be signed.
        // Noise in every method takes 3 to 4 KiB of each image, and sensing, which solves in f64, 20 KiB of this one and the deepest stack. Of these
        // 1.4 KiB are a firmware that listens: how, from its block, and what the radio hears, to the relay.
        // That uploads may move the sites takes 3.5 KiB of it.
        // That no failsafe is undone, no lag or late byte trusted and every reason to wait told takes 10 KiB, the halt of a chain out of order 2 KiB,
        // the claims to a number that two drones use 1 to 2 KiB. The clock tree and the watchdog take 1 to 2 KiB of every image, and the cells of the
        // best start 600 bytes of this one's RAM. That no part of a chain is stuck, no sensor wrong without being named and no clock that
        // steps stops anything takes 3 KiB of each image and 7 KiB of this one. A memory of losses for each of four links a side, drones that are
        // not flown as obstacles and copies of a relay with a key take 1 KiB of flash, 300 bytes of RAM and up to 900 bytes of stack
        // of each image, in which a guard is built; the operator's command to clear a lost relay 1 KiB of those with an autopilot.
        [201 * 1024, 13_504, 7_232],
    ),
];

fn of(
    what: &'static str,
    example: &str,
    features: &[&str],
    flash: u64,
    ram: u64,
    stack: u64,
) -> Result<[Row; 3], String> {
    let image = build(example, features)?;
    let (flash_taken, ram_taken) = sizes(&image)?;
    let flies = features.is_empty()
        || features
            .iter()
            .any(|of| of.contains("flight") || of.contains("mavlink"));
    let (thread, handler) = deepest_stack(&image, flies)?;
    Ok([
        row(what, "bytes", flash_taken, Some(flash)),
        row("its static RAM", "bytes", ram_taken, Some(ram)),
        row(
            "its stack, bound: thread and one interrupt",
            "bytes",
            thread + handler,
            Some(stack),
        ),
    ])
}

/// Runs a command and gives its output if it succeeded.
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

/// A command of cargo about one example with the firmware profile.
fn cargo(command: &str, example: &str) -> Command {
    let mut cargo = Command::new("cargo");
    cargo
        .args([command, "--package", "uav-relay"])
        .args(["--profile", "firmware", "--target", TARGET])
        .args(["--example", example]);
    cargo
}

/// Builds one example with the firmware profile; where its ELF is.
pub(crate) fn build(example: &str, more: &[&str]) -> Result<PathBuf, String> {
    run(cargo("build", example).args(more))?;
    Ok(PathBuf::from("target")
        .join(TARGET)
        .join("firmware/examples")
        .join(example))
}

/// Bytes of flash and of static RAM that an image takes.
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

/// The deepest stack of the thread, from the entry that `Reset` calls, and of an interrupt on top of it: its frame with the FPU's registers is 104 bytes.
pub(crate) fn deepest_stack(elf: &Path, flies: bool) -> Result<(u64, u64), String> {
    const EXCEPTION_FRAME: u64 = 104;
    let missing = "llvm-objdump is missing; type: rustup component add llvm-tools";
    let objdump = llvm_tool("llvm-objdump").ok_or(missing)?;
    let output = run(Command::new(objdump)
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
    // Without the feature `flight` nobody serves the autopilot's port.
    let autopilot = flies.then_some("USART1");
    for name in ["USART2", "USART3", "SysTick"].into_iter().chain(autopilot) {
        handler = deepest(name)?.0.max(handler);
    }
    Ok((thread, EXCEPTION_FRAME + handler))
}

/// Links every relay image with a panic handler that cannot be linked; and, as a control, one that does panic.
pub(crate) fn no_panic() -> Result<(), String> {
    only_finished_futures_panic()?;
    let link = |features: &[&str], flags: &[&str]| {
        run(cargo("rustc", RELAY).args(features).arg("--").args(flags))
    };
    for (what, features, _) in IMAGES {
        link(features, &["--cfg", "prove_no_panic"])
            .map_err(|error| format!("a panic is reachable, {what}: {error}"))?;
    }
    match link(
        &[],
        &["--cfg", "prove_no_panic", "--cfg", "panic_on_purpose"],
    ) {
        Ok(_) => Err("a panic put there on purpose was linked: the proof proves nothing".into()),
        Err(error) if error.contains("a_panic_is_reachable") => Ok(()),
        Err(error) => Err(format!("the control failed for another reason: {error}")),
    }
}

/// On asynchronous ports that cannot be had: behind each `async fn` the compiler puts a panic for whoever polls it once more after it has
/// completed, which an `await` never does. So that one may be called, and no other.
fn only_finished_futures_panic() -> Result<(), String> {
    const FINISHED: &str = "panic_const_async_fn_resumed";
    let image = build(ASYNC, ASYNC_FEATURES)?;
    let missing = "llvm-objdump is missing; type: rustup component add llvm-tools";
    let objdump = llvm_tool("llvm-objdump").ok_or(missing)?;
    let output = run(Command::new(objdump)
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
    // Were there none, the search would have found nothing because it looks for the wrong thing.
    if finished == 0 {
        return Err("the asynchronous image has no panic at all: link it with the others".into());
    }
    Ok(())
}
