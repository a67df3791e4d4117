//! `cargo cost`: what the firmware costs, held against its budgets; and the proof that it cannot panic.
//!
//! Builds the relay image and the counting image with the firmware profile, reads sizes and the deepest stack from the
//! relay's ELF, runs the counting image in QEMU, and links the relay image with a panic handler that cannot be linked.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Output};

use host_tests::stack::Calls;
use host_tests::toolchain::llvm_tool;
use object::{Object as _, ObjectSection as _, SectionFlags};

const TARGET: &str = "thumbv7em-none-eabihf";

/// The image a person flashes.
const RELAY: &str = "stm32f405";

/// One row of the table.
struct Row {
    what: &'static str,
    unit: &'static str,
    value: u64,
    budget: Option<u64>,
}

fn main() -> ExitCode {
    match measure() {
        Ok(rows) => report(&rows),
        Err(error) => {
            println!("cost: {error}");
            ExitCode::FAILURE
        }
    }
}

fn report(rows: &[Row]) -> ExitCode {
    println!("| | measured | budget |\n| --- | --- | --- |");
    let mut over = Vec::new();
    for row in rows {
        let budget = row
            .budget
            .map_or_else(String::new, |budget| format!("{budget} {}", row.unit));
        println!("| {} | {} {} | {budget} |", row.what, row.value, row.unit);
        if row.budget.is_some_and(|budget| row.value > budget) {
            over.push(row.what);
        }
    }
    println!(
        "No panic is reachable in the relay image, and one put there on purpose does not link."
    );
    if over.is_empty() {
        println!("cost: all within budget");
        ExitCode::SUCCESS
    } else {
        println!("cost: over budget: {}", over.join("; "));
        ExitCode::FAILURE
    }
}

const fn row(what: &'static str, unit: &'static str, value: u64, budget: Option<u64>) -> Row {
    Row {
        what,
        unit,
        value,
        budget,
    }
}

fn measure() -> Result<Vec<Row>, String> {
    no_panic()?;
    let mut rows = of_the_relay_image()?;
    rows.extend(of_the_counting_image()?);
    Ok(rows)
}

fn of_the_relay_image() -> Result<Vec<Row>, String> {
    let (flash_with_log, ram_with_log) = sizes(&build(RELAY, &["--features", "defmt"])?)?;
    let alone = build(RELAY, &["--no-default-features"])?;
    let (flash_alone, ram_alone) = sizes(&alone)?;
    let (thread_alone, handler_alone) = stack(&alone)?;
    let relay = build(RELAY, &[])?;
    let (flash, ram) = sizes(&relay)?;
    let (thread, handler) = stack(&relay)?;
    Ok(vec![
        row(
            "flash of the relay image, Algorithm 1 alone",
            "bytes",
            flash_alone,
            Some(32 * 1024),
        ),
        row("its static RAM", "bytes", ram_alone, Some(4 * 1024)),
        row(
            "its stack, bound: thread and one interrupt",
            "bytes",
            thread_alone + handler_alone,
            Some(2 * 1024),
        ),
        row(
            "flash of the relay image, all methods",
            "bytes",
            flash,
            Some(46 * 1024),
        ),
        row("its static RAM", "bytes", ram, Some(4_608)),
        row(
            "its stack, bound: thread and one interrupt",
            "bytes",
            thread + handler,
            Some(2_560),
        ),
        row("its flash with defmt", "bytes", flash_with_log, None),
        row("its static RAM with defmt", "bytes", ram_with_log, None),
    ])
}

fn of_the_counting_image() -> Result<Vec<Row>, String> {
    let counted = count(&build("cost", &[])?)?;
    let figure = |name: &str| {
        counted
            .get(name)
            .copied()
            .ok_or_else(|| format!("the image did not report {name}"))
    };
    let settled = [
        "settled",
        "agreed",
        "altitude_settled",
        "survey_settled",
        "adjust_settled",
        "field_settled",
    ];
    for chain in settled {
        if figure(chain)? != 1 {
            return Err(format!("a chain in the counting image: not {chain}"));
        }
    }
    let mut rows = Vec::new();
    for &(what, unit, names, budget) in COUNTED {
        let mut most = 0;
        for name in names {
            most = figure(name)?.max(most);
        }
        rows.push(row(what, unit, most, budget));
    }
    let mut worst = 0;
    for call in CALLS {
        worst = figure(call)?.max(worst);
    }
    rows.push(row(
        "the costliest call",
        "instructions",
        worst,
        Some(50_000),
    ));
    Ok(rows)
}

/// A row of what the counting image reports: the largest of the figures with these names.
type Counted = (
    &'static str,
    &'static str,
    &'static [&'static str],
    Option<u64>,
);

const COUNTED: &[Counted] = &[
    (
        "stack, measured: the calls of a relay",
        "bytes",
        &["stack"],
        None,
    ),
    ("`size_of::<Relay>()`", "bytes", &["size_of_relay"], None),
    ("one reach", "instructions", &["reach"], Some(150)),
    (
        "a full sweep, message in to message out",
        "instructions",
        &["sweep"],
        Some(12_000),
    ),
    ("its frame", "bytes", &["sweep_bytes"], Some(100)),
    (
        "a full sweep at the tail, message in to verdict out",
        "instructions",
        &["sweep_at_tail"],
        None,
    ),
    (
        "a full verdict, message in to message out",
        "instructions",
        &["verdict"],
        None,
    ),
    (
        "a full verdict at the head",
        "instructions",
        &["verdict_at_head"],
        None,
    ),
    (
        "a full frame, deframed and checked",
        "instructions",
        &["frame"],
        None,
    ),
    (
        "a portion of the head's prediction",
        "instructions",
        &["predict"],
        None,
    ),
    (
        "portions for a chain of 100",
        "",
        &["predict_portions"],
        None,
    ),
    (
        "a wave of 16 levels and 4 targets, a relay's share",
        "instructions",
        &["wave_16"],
        None,
    ),
    (
        "a tube of 9 levels and 7 targets",
        "instructions",
        &["tube"],
        None,
    ),
    (
        "a wave of 64 levels and 1 target",
        "instructions",
        &["wave_64"],
        None,
    ),
    (
        "the longest wave's frame here",
        "bytes",
        &["wave_bytes"],
        Some(237),
    ),
    ("RAM of a wave", "bytes", &["size_of_wave"], None),
    (
        "one evaluation of both hops in Algorithm 2",
        "instructions",
        &["evaluation"],
        None,
    ),
    (
        "a local search, at most 1080 evaluations",
        "instructions",
        &["search"],
        None,
    ),
    ("its RAM", "bytes", &["size_of_search"], None),
    (
        "a sample of the interference",
        "instructions",
        &["sample"],
        None,
    ),
    (
        "an estimate from the samples",
        "instructions",
        &["estimate"],
        None,
    ),
    (
        "the costliest call while altitudes are chosen",
        "instructions",
        &["altitude", "survey"],
        None,
    ),
    (
        "the costliest call of Algorithm 2",
        "instructions",
        &["adjust"],
        None,
    ),
    (
        "the costliest call in a field",
        "instructions",
        &["field"],
        None,
    ),
];

/// The figures that are calls of a relay.
const CALLS: &[&str] = &[
    "begin_sweep",
    "sweep",
    "sweep_at_tail",
    "verdict",
    "verdict_at_head",
    "predict",
    "altitude",
    "survey",
    "adjust",
    "field",
    "sample",
    "estimate",
];

/// Runs a command and gives its output if it succeeded.
fn run(command: &mut Command) -> Result<Output, String> {
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

/// Builds one example with the firmware profile; where its ELF is.
fn build(example: &str, more: &[&str]) -> Result<PathBuf, String> {
    let arguments = [
        "build",
        "-p",
        "uav-relay",
        "--profile",
        "firmware",
        "--target",
        TARGET,
        "--example",
        example,
    ];
    run(Command::new("cargo").args(arguments).args(more))?;
    Ok(PathBuf::from("target")
        .join(TARGET)
        .join("firmware/examples")
        .join(example))
}

/// Bytes of flash and of static RAM that an image takes.
fn sizes(elf: &Path) -> Result<(u64, u64), String> {
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
fn stack(elf: &Path) -> Result<(u64, u64), String> {
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
    for name in ["USART2", "USART3", "SysTick"] {
        handler = deepest(name)?.0.max(handler);
    }
    Ok((thread, EXCEPTION_FRAME + handler))
}

/// Links the relay image with a panic handler that cannot be linked; and, as a control, one that does panic.
fn no_panic() -> Result<(), String> {
    let link = |flags: &[&str]| {
        let arguments = [
            "rustc",
            "-p",
            "uav-relay",
            "--profile",
            "firmware",
            "--target",
            TARGET,
            "--example",
            RELAY,
            "--",
        ];
        run(Command::new("cargo").args(arguments).args(flags))
    };
    link(&["--cfg", "prove_no_panic"])
        .map_err(|error| format!("a panic is reachable in the relay image: {error}"))?;
    match link(&["--cfg", "prove_no_panic", "--cfg", "panic_on_purpose"]) {
        Ok(_) => Err("a panic put there on purpose was linked: the proof proves nothing".into()),
        Err(error) if error.contains("a_panic_is_reachable") => Ok(()),
        Err(error) => Err(format!("the control failed for another reason: {error}")),
    }
}

/// Runs the counting image in QEMU; the figures it reports by name.
fn count(elf: &Path) -> Result<BTreeMap<String, u64>, String> {
    let arguments = [
        "60",
        "qemu-system-arm",
        "-machine",
        "netduinoplus2",
        "-nographic",
        "-monitor",
        "none",
        "-serial",
        "null",
        "-icount",
        "shift=10",
        "-semihosting-config",
        "enable=on,target=native",
        "-kernel",
    ];
    let output = run(Command::new("timeout").args(arguments).arg(elf))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let figures: BTreeMap<String, u64> = text
        .lines()
        .filter_map(|line| {
            let (name, value) = line.trim().split_once(' ')?;
            Some((name.to_owned(), value.parse().ok()?))
        })
        .collect();
    if figures.contains_key("done") {
        Ok(figures)
    } else {
        Err(format!("the counting image did not finish:\n{text}"))
    }
}
