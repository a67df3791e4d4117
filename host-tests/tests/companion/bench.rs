//! Bench of examples/LINUX.md, run as printed on the page.

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;

use host_tests::python;

use crate::binary::{companion, ground};

const PAGE: &str = include_str!("../../../examples/LINUX.md");

/// Replacement for `socat pty,..,link=A pty,..,link=B` where socat is not installed.
const SOCAT: &str = r#"
import os, pty, select, sys, tty
ends = {}
for word in sys.argv[1:]:
    link = word.split("link=")[1]
    master, side = pty.openpty()
    tty.setraw(side)
    os.symlink(os.ttyname(side), link)
    ends[master] = side
masters = list(ends)
while True:
    for ready in select.select(masters, [], [])[0]:
        os.write(masters[1 - masters.index(ready)], os.read(ready, 4096))
"#;

/// Runs the bench twice in one folder: files of the first run must not disturb the second.
#[test]
fn the_bench_of_the_page_runs_twice() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let bench = PAGE.split("### Two boxes on a bench").nth(1).unwrap();
    let script = bench.split("```bash tested\n").nth(1).unwrap();
    let script = script.split("```").next().unwrap();
    assert!(!script.contains("sleep 2"), "it waits for what it needs");
    let mut script = script.to_owned();
    for (name, is) in [
        ("bench/bin/python", python::interpreter().as_path()),
        ("target/release/linux_companion", companion()),
        ("target/release/linux_ground", ground()),
        ("host-tests/tests", &root.join("host-tests/tests")),
    ] {
        assert!(script.contains(name), "{name}");
        script = script.replace(name, is.to_str().unwrap());
    }
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("network7.key");
    std::fs::write(&key, "5e".repeat(32)).unwrap();
    // Programs refuse a key that other users can read; the page sets the permissions before.
    std::fs::set_permissions(&key, std::fs::Permissions::from_mode(0o600)).unwrap();
    if Command::new("socat").arg("-V").output().is_err() {
        let file = folder.path().join("socat.py");
        std::fs::write(&file, SOCAT).unwrap();
        script = script.replace("socat ", &format!("python3 {} ", file.display()));
    }
    for run in 1..=2 {
        let output = Command::new("timeout")
            .args(["--kill-after=5", "180", "bash", "-e", "-c", &script])
            .current_dir(folder.path())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "run {run}: {output:?}");
        print!("{said}");
        for part in [
            "relay 1  autopilot: found a PX4",
            "relay 2  autopilot: found an ArduCopter",
            "relay 1  arrived: ",
            "relay 2  arrived: ",
            "relay 1  adopted: flies version 1 of the mission, between 47.4000000,8.5400000,420.000 and 47.4120000,",
            "transmitter  flown: 2 of 2 relays fly version 1",
        ] {
            assert!(said.contains(part), "run {run}: no `{part}` in\n{said}");
        }
    }
}
