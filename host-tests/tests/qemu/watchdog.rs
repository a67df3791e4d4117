//! Watchdog registers written by the image, from QEMU's trace; QEMU has no watchdog to reset the chip.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use uav_relay_tools::provision::config;

use crate::chain::paper;
use crate::fleet::{Image, PATIENCE, image};

/// First words of QEMU's trace line for a write to the watchdog.
///
/// QEMU has no watchdog: its device `I2S2ext` covers the address of the watchdog.
const DEVICE: &str = "I2S2ext: unimplemented device write (size 4, ";

/// Register writes that start the watchdog, unlock it, set it to 6 s and feed it, in this order.
const BEGINS: [&str; 5] = [
    "offset 0x000, value 0x0000cccc)",
    "offset 0x000, value 0x00005555)",
    "offset 0x004, value 0x00000004)",
    "offset 0x008, value 0x00000bb7)",
    FED,
];
const FED: &str = "offset 0x000, value 0x0000aaaa)";

#[test]
fn the_watchdog_is_fed_for_as_long_as_the_relay_runs() {
    let folder = tempfile::tempdir().unwrap();
    let [block, trace] = ["block.bin", "trace"].map(|name| folder.path().join(name));
    std::fs::write(&block, paper(1).block(1).unwrap()).unwrap();
    let mut emulator = Command::new("qemu-system-arm")
        .args(["-machine", "netduinoplus2", "-display", "none"])
        .args(["-monitor", "none", "-serial", "null", "-d", "unimp", "-D"])
        .arg(&trace)
        .arg("-kernel")
        .arg(image(Image::Wires.name()))
        .arg("-device")
        .arg(format!(
            "loader,file={},addr={:#x},force-raw=on",
            block.display(),
            config::ADDRESS
        ))
        .stdin(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let mut written = Vec::new();
    while begun.elapsed() < PATIENCE && written.len() < 40 {
        std::thread::sleep(Duration::from_millis(200));
        let text = std::fs::read_to_string(&trace).unwrap_or_default();
        // The last line may be incomplete.
        let whole = text.rsplit_once('\n').map_or("", |(whole, _)| whole);
        let lines = whole.lines().filter_map(|line| line.strip_prefix(DEVICE));
        written = lines.map(str::to_owned).collect();
    }
    emulator.kill().unwrap();
    emulator.wait().unwrap();
    assert!(written.len() >= 40, "{} writes", written.len());
    let (begins, fed) = written.split_at(BEGINS.len());
    assert_eq!(begins, BEGINS);
    assert!(fed.iter().all(|line| line == FED));
}
