//! Companion as a systemd service: its unit, and its notifications.

use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::Signal;

use crate::binary::companion;
use crate::process::{LIMIT, Relay};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

#[test]
fn systemd_accepts_the_unit() {
    let unit = root().join("examples/linux_companion/uav-relay@.service");
    let text = std::fs::read_to_string(unit).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("uav-relay@.service");
    // The unit's program is not installed here.
    let installed = "/usr/local/bin/linux_companion";
    assert!(text.contains(installed));
    let text = text.replace(installed, companion().to_str().unwrap());
    let verified = |text: &str| {
        std::fs::write(&file, text).unwrap();
        let mut analyze = Command::new("systemd-analyze");
        analyze.arg("verify").arg("--man=no").arg(&file);
        analyze.output()
    };
    let Ok(output) = verified(&text) else {
        println!("skipped: systemd-analyze is not installed");
        return;
    };
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && !said.contains("uav-relay@"),
        "{said}"
    );
    let wrong = text.replace("WatchdogSec=10", "WatchdogSec=soon");
    let output = verified(&wrong).unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("uav-relay@"), "it verifies anything: {said}");
}

/// Checks that the companion accepts the example configuration `examples/drone.toml`.
///
/// The only error is the missing key file.
#[test]
fn the_example_file_is_complete() {
    let file = root().join("examples/drone.toml");
    // The only mistake is the missing key.
    let line = Relay::start(&format!("--config {} --index 2", file.display())).refused(2);
    let key = root().join("examples/network7.key");
    let said = format!("--key-file {}: cannot be read: ", key.display());
    assert!(line.starts_with(&said), "{line}");
}

#[test]
fn readiness_and_watchdog_are_notified() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("notify");
    let socket = UnixDatagram::bind(&name).unwrap();
    socket.set_read_timeout(Some(LIMIT)).unwrap();
    let mut command = Command::new(companion());
    command
        .args(["--index", "1", "--of", "1"])
        .env("NOTIFY_SOCKET", &name)
        .env("WATCHDOG_USEC", "400000")
        .env_remove("WATCHDOG_PID")
        .stdout(Stdio::null());
    let relay = Relay::of(&mut command);
    let heard = || {
        let mut buffer = [0; 64];
        let count = socket.recv(&mut buffer).unwrap();
        String::from_utf8(buffer[..count].to_vec()).unwrap()
    };
    assert_eq!(heard(), "READY=1");
    assert_eq!(heard(), "WATCHDOG=1");
    let begun = Instant::now();
    for _ in 0..10 {
        assert_eq!(heard(), "WATCHDOG=1");
    }
    let took = begun.elapsed();
    println!("10 signs of life in {} ms", took.as_millis());
    assert!(
        took > Duration::from_millis(1_800),
        "every 200 ms: {took:?}"
    );
    relay.signal(Signal::TERM);
    while heard() != "STOPPING=1" {}
    relay.succeeds();
}
