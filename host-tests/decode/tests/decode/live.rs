//! Tests of live input: each frame is printed at once, also amid noise, and when the pipe closes.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::Stdio;

use super::{HEARTBEAT, decode, lines};

/// Checks that each frame is printed at once. If the output were buffered, the test would time out.
#[test]
fn each_frame_is_printed_at_once() {
    let mut child = decode().arg("--json").spawn().unwrap();
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    for number in 1..=5 {
        let (first, second) = HEARTBEAT.split_at(4 * number);
        input.write_all(first).unwrap();
        input.flush().unwrap();
        input.write_all(second).unwrap();
        input.flush().unwrap();
        let mut line = String::new();
        output.read_line(&mut line).unwrap();
        assert!(
            line.starts_with(&format!("{{\"frame\":{number},")),
            "{line}"
        );
    }
    drop(input);
    assert!(child.wait().unwrap().success());
}

#[test]
fn the_next_frame_after_noise_is_decoded() {
    let long = [&[9; 5_000][..], &[0]].concat();
    let cut = [&HEARTBEAT[..13], &[0]].concat();
    let mut changed = HEARTBEAT;
    changed[12] ^= 0x40;
    let without_end = &HEARTBEAT[..22];
    let pieces = [
        &[0, 0, 0][..],
        &HEARTBEAT,
        &long,
        &HEARTBEAT,
        &cut,
        &changed,
        &HEARTBEAT,
        without_end,
    ];
    let lines = lines(&["--json"], &pieces.concat());
    let why: Vec<String> = lines
        .iter()
        .map(|line| {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            let why = line["refused"]["why"].as_str();
            why.or(line["message"].as_str()).unwrap().to_owned()
        })
        .collect();
    let wanted = [
        "Heartbeat",
        "oversized",
        "Heartbeat",
        "truncated",
        "crc",
        "Heartbeat",
        "unended",
    ];
    assert_eq!(why, wanted);
}

#[test]
fn a_closed_standard_output_ends_it_without_an_error() {
    for arguments in [&[][..], &["--json"], &["--help"], &["--dissector", "-"]] {
        let mut child = decode().args(arguments).spawn().unwrap();
        drop(child.stdout.take());
        let mut input = child.stdin.take().unwrap();
        // The reader may close the pipe before everything is written.
        let frames = HEARTBEAT.repeat(10_000);
        _ = input.write_all(&frames);
        drop(input);
        let output = child.wait_with_output().unwrap();
        assert_eq!(
            (output.status.code(), &*output.stderr),
            (Some(0), &b""[..]),
            "{arguments:?}"
        );
    }
}

#[test]
fn a_closed_standard_error_causes_no_panic() {
    let mut child = decode().arg("/nowhere").spawn().unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(2));
    let mut child = decode()
        .arg("--nonsense")
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(2));
    let mut child = decode()
        .arg("--help")
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut help = String::new();
    child
        .stdout
        .take()
        .unwrap()
        .read_to_string(&mut help)
        .unwrap();
    assert!(help.contains("--dissector") && child.wait().unwrap().success());
}
