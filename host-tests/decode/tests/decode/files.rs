//! Tests with captures and other files, complete and damaged.

use std::time::Duration;

use uav_relay_capture::{Capture, Direction, Frame};

use super::{HEARTBEAT, decode, lines, name, piped, refusal, secret};

fn capture(comment: &str) -> Vec<u8> {
    let mut capture = Capture::new(Vec::new(), "a test", comment).unwrap();
    let port = capture.interface("ttyUSB0", "").unwrap();
    let mut frame = Frame {
        at: Duration::from_micros(1_250_001),
        bytes: &HEARTBEAT,
        len: HEARTBEAT.len(),
        direction: Direction::In,
        comment: "",
    };
    capture.frame(port, &frame).unwrap();
    frame.direction = Direction::Out;
    frame.comment = "said back";
    capture.frame(port, &frame).unwrap();
    capture.finish().unwrap()
}

#[test]
fn a_capture_is_read_from_a_file_and_from_a_pipe() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.pcapng");
    std::fs::write(&file, capture("two frames")).unwrap();
    let from_file = lines(&[name(&file)], &[]);
    assert_eq!(from_file, lines(&["-"], &capture("two frames")));
    assert_eq!(from_file[0], "two frames");
    assert!(
        from_file[1].starts_with("frame 1  1.250001 s  ttyUSB0 in  Heartbeat  1 -> 2"),
        "{from_file:?}"
    );
    assert!(
        from_file[5].contains("ttyUSB0 out") && from_file[5].ends_with("(said back)"),
        "{from_file:?}"
    );
    let json: serde_json::Value =
        serde_json::from_str(&lines(&["--json"], &capture("two frames"))[1]).unwrap();
    assert_eq!(json["time_s"], 1.250_001);
    assert_eq!(
        (&json["direction"], &json["comment"]),
        (&"out".into(), &"said back".into())
    );
    assert_eq!(json["fields"]["mission"], "5a3c");
}

#[test]
fn a_truncated_capture_is_shown_up_to_its_end() {
    let whole = capture("");
    let output = piped(&["--json"], &whole[..whole.len() - 10]);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(
        line,
        "standard input: is not a valid capture: the file ends inside a pcapng block\n"
    );
    assert_eq!(String::from_utf8(output.stdout).unwrap().lines().count(), 1);
}

#[test]
fn wrong_input_is_one_line_that_names_it() {
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("key");
    secret(&key, "0011");
    let file = name(&key);
    assert!(refusal(&["/nowhere/air"], &[]).starts_with("/nowhere/air: cannot be read: "));
    assert!(refusal(&[name(folder.path())], &[]).contains(": cannot be read: "));
    assert!(
        refusal(&["--key", "/nowhere/key"], &[])
            .starts_with("--key /nowhere/key: cannot be read: ")
    );
    assert_eq!(
        refusal(&["--key", file], &[]),
        format!(
            "--key {file}: must be 64 hexadecimal digits, as printed by `openssl rand -hex 32`\n"
        )
    );
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        let mode = std::fs::Permissions::from_mode(0o644);
        std::fs::set_permissions(&key, mode).unwrap();
        let said = refusal(&["--key", file], &[]);
        let line =
            format!("--key {file}: has the mode 0644, so other users of this computer can read");
        assert!(said.starts_with(&line), "{said}");
    }
    assert!(
        refusal(&["--dissector", "/nowhere/x.lua"], &[])
            .starts_with("/nowhere/x.lua: --dissector cannot be written: ")
    );
    assert!(refusal(&["--dissector", "x.lua", "--json"], &[]).contains("--dissector"));
    if std::path::Path::new("/dev/full").exists() {
        let full = std::fs::File::create("/dev/full").unwrap();
        std::fs::write(&key, HEARTBEAT).unwrap();
        let output = decode().arg(file).stdout(full).output().unwrap();
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2));
        assert!(
            line.starts_with("standard output: cannot be written: "),
            "{line}"
        );
    }
}
