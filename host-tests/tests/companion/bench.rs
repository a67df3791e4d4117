//! Scripts of examples/LINUX.md that are marked as tested, run as printed on the page.

use std::io::{BufRead as _, BufReader};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Stdio};

use host_tests::python;

use crate::binary::{companion, ground};

const PAGE: &str = include_str!("../../../examples/LINUX.md");

/// Python replacement for `socat pty,..,link=A pty,..,link=B`, for computers without socat.
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

/// Replaces `socat` by a Python program in a script of `examples/LINUX.md` if `socat` is not installed.
pub(crate) fn with_socat(script: &str, folder: &Path) -> String {
    if Command::new("socat").arg("-V").output().is_ok() {
        return script.to_owned();
    }
    let file = folder.join("socat.py");
    std::fs::write(&file, SOCAT).unwrap();
    script.replace("socat ", &format!("python3 {} ", file.display()))
}

/// Returns the first block ```` ```LANGUAGE tested ```` below a heading of `examples/LINUX.md`.
fn block(heading: &str, language: &str) -> String {
    let section = PAGE.split(heading).nth(1).unwrap();
    let script = section.split(&format!("```{language} tested\n")).nth(1);
    script.unwrap().split("```").next().unwrap().to_owned()
}

/// Checks that the two relays of the first example in `examples/LINUX.md` agree.
///
/// The test terminates the script of the example after both relays have logged their agreement. A user would end the
/// script by Ctrl-C.
#[test]
fn two_relays_on_one_computer_agree() {
    let script = block("## The companion of a drone", "sh");
    assert!(script.contains("cargo companion --index 1") && script.contains("--upstream b"));
    let script = script.replace("cargo companion", companion().to_str().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let script = with_socat(&script, folder.path());
    let mut running = Command::new("timeout")
        .args(["--kill-after=5", "60", "sh", "-c", &script])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(running.stdout.take().unwrap()).lines();
    let mut agreed = [false; 2];
    for line in lines.map_while(Result::ok) {
        println!("{line}");
        for (relay, agreed) in ["relay 1", "relay 2"].iter().zip(&mut agreed) {
            *agreed |= line.contains(&format!(
                "{relay}  converged: positions agreed, target SIR 1.616563 "
            ));
        }
        if agreed == [true; 2] {
            break;
        }
    }
    // `timeout` passes the signal on to all processes of the script.
    let process = rustix::process::Pid::from_child(&running);
    rustix::process::kill_process(process, rustix::process::Signal::TERM).unwrap();
    running.wait().unwrap();
    assert_eq!(agreed, [true; 2]);
}

/// Checks that the script for two computers on a bench in `examples/LINUX.md` runs twice in one folder.
///
/// Files that the first run leaves behind must not disturb the second one.
#[test]
fn the_bench_of_the_page_runs_twice() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut script = block("### Two boxes on a bench", "bash");
    assert!(!script.contains("sleep 2"), "it waits for what it needs");
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
    let script = with_socat(&script, folder.path());
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
            "relay 1  adopted: the chain flies version 1 of the mission, between 47.4000000,8.5400000,420.000 and 47.4120000,",
            "transmitter  flown: 2 of 2 relays fly version 1",
        ] {
            assert!(said.contains(part), "run {run}: no `{part}` in\n{said}");
        }
    }
}
