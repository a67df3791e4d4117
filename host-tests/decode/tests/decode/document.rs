//! Examples of FORMAT.md, and its frames with tags.

use super::{lines, name, secret};

const DOCUMENT: &str = include_str!("../../../../src/wire/FORMAT.md");

fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex
        .chars()
        .filter_map(|digit| digit.to_digit(16))
        .map(|digit| u8::try_from(digit).unwrap())
        .collect();
    digits
        .chunks(2)
        .map(|pair| pair[0] << 4 | pair[1])
        .collect()
}

fn wires(heading: &str) -> Vec<Vec<u8>> {
    let sections = DOCUMENT.split(heading).skip(1);
    let block = |section: &str| {
        bytes(
            section
                .split("```text")
                .nth(1)
                .unwrap()
                .split("```")
                .next()
                .unwrap(),
        )
    };
    sections.map(block).collect()
}

#[test]
fn the_fields_of_the_first_example_stand_with_their_names() {
    let text = lines(&[], &super::HEARTBEAT).join("\n");
    let wanted = "\
frame 1  Heartbeat  1 -> 2  network 7  counter 0  23 bytes
    mission            5a3c                      digest of the mission that the sender was loaded with
    asks               5                         number of the sender's question; 0 for none
    answers            0                         number of the question that it answers; 0 for none";
    assert_eq!(text, wanted);
}

#[test]
fn all_examples_are_read_and_none_is_refused() {
    let stream = wires("### Example: ").concat();
    let lines = lines(&["--json"], &stream);
    assert!(lines.len() > 25, "{}", lines.len());
    let mut names = std::collections::BTreeSet::new();
    for line in lines {
        let line: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert!(line["refused"].is_null(), "{line}");
        names.insert(line["message"].as_str().unwrap().to_owned());
    }
    assert_eq!(names.len(), 21);
}

#[test]
fn of_every_row_of_the_rejection_table_it_is_said_why() {
    let section = DOCUMENT.split("\n## Rejected").nth(1).unwrap();
    let mut stream = Vec::new();
    let mut counted = Vec::new();
    for row in section.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        for word in cells[0].trim_matches('`').split(' ') {
            let (byte, times) = word.split_once('*').unwrap_or((word, "1"));
            stream.extend(bytes(byte).repeat(times.parse().unwrap()));
        }
        stream.push(0);
        // Counters for frames that are intact but not accepted.
        let on_top = [
            "mission",
            "view",
            "stale",
            "misdirected",
            "repeated",
            "unsigned",
        ];
        let of_frames = cells[2].split(", ").filter(|name| !on_top.contains(name));
        counted.extend(of_frames.map(str::to_owned));
    }
    let lines = lines(&["--json"], &stream);
    assert_eq!(lines.len(), counted.len());
    let mut seen = 0;
    for (line, counted) in lines.iter().zip(counted) {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        let why = line["refused"]["why"].as_str().unwrap_or("none");
        let fits = match counted.as_str() {
            "oversized" => why == "oversized",
            "truncated" => why == "truncated" || why == "short",
            "crc" => why == "crc",
            // The decoder accepts tags in every network.
            "version" => why == "version" || line["tag"].is_object(),
            "malformed" => ["malformed", "range", "unknown_tag"].contains(&why),
            // Only the receiver can detect the others.
            _ => why == "none",
        };
        assert!(fits, "{counted}: {line}");
        seen += usize::from(why != "none");
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn tags_are_checked_with_the_key_once_the_handshake_was_seen() {
    let worked = wires("### Worked: ");
    assert_eq!(worked.len(), 3);
    let [handshake, answer, heartbeat] = [0, 1, 2].map(|at: usize| worked[at].clone());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("key");
    let key = (0..32).fold(String::new(), |text, byte| text + &format!("{byte:02x}"));
    secret(&file, &format!("{key}\n"));
    let checks = |arguments: &[&str], frames: &[&[u8]]| -> Vec<String> {
        let all = [&["--json"], arguments].concat();
        let said = lines(&all, &frames.concat());
        let check = |line: &String| {
            let line: serde_json::Value = serde_json::from_str(line).unwrap();
            line["tag"]["check"].as_str().unwrap().to_owned()
        };
        said.iter().map(check).collect()
    };
    let with = ["--key", name(&file)];
    assert_eq!(
        checks(&with, &[&handshake, &answer, &heartbeat]),
        ["right"; 3]
    );
    assert_eq!(checks(&with, &[&heartbeat]), ["no_handshake"]);
    assert_eq!(
        checks(&[], &[&handshake, &answer, &heartbeat]),
        ["no_key"; 3]
    );
    std::fs::write(&file, key.replace("1f", "2f")).unwrap();
    assert_eq!(
        checks(&with, &[&handshake, &heartbeat]),
        ["wrong", "no_handshake"]
    );
}
