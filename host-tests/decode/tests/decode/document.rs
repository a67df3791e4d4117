//! Tests with the vectors of the wire format, and with signed frames.

use uav_relay_decode::vectors::Vectors;

use super::{lines, name, secret};

#[test]
fn the_first_example_is_decoded_with_field_names() {
    let text = lines(&[], &super::HEARTBEAT).join("\n");
    let wanted = "\
frame 1  Heartbeat  1 -> 2  network 7  counter 0  23 bytes
    mission            0x5a3c                    digest of the sender's mission as loaded before flight
    request            5                         number of the sender's request; 0 for none
    reply              0                         number of the answered request; 0 for none";
    assert_eq!(text, wanted);
}

#[test]
fn all_test_vectors_are_decoded() {
    let vectors = Vectors::load().unwrap().frames;
    let stream: Vec<u8> = vectors
        .iter()
        .flat_map(|vector| vector.wire.clone())
        .collect();
    let lines = lines(&["--json"], &stream);
    assert_eq!(lines.len(), vectors.len());
    for (line, vector) in lines.iter().zip(vectors) {
        let line: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(line["refused"].is_null(), "{line}");
        assert_eq!(line["message"], vector.message, "{}", vector.name);
    }
}

#[test]
fn the_reason_of_every_rejected_stream_is_shown() {
    let (mut stream, mut counted) = (Vec::new(), Vec::new());
    for vector in Vectors::load().unwrap().rejected {
        stream.extend(vector.wire);
        // The counters are for frames that are intact but not accepted.
        let on_top = [
            "mission",
            "view",
            "stale",
            "misdirected",
            "repeated",
            "unsigned",
        ];
        let of_frames = vector.counted.into_iter();
        counted.extend(of_frames.filter(|name| !on_top.contains(&name.as_str())));
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
            // The decoder accepts signed frames with any network number.
            "version" => why == "version" || line["tag"].is_object(),
            "malformed" => ["malformed", "range", "unknown_tag"].contains(&why),
            // The remaining reasons can be detected only by a receiver.
            _ => why == "none",
        };
        assert!(fits, "{counted}: {line}");
        seen += usize::from(why != "none");
    }
    assert!(seen > 100, "{seen}");
}

#[test]
fn tags_are_checked_with_the_key_once_the_handshake_was_seen() {
    let signed = Vectors::load().unwrap().signed;
    let [handshake, answer, heartbeat] = [0, 1, 2].map(|at: usize| signed[at].wire.clone());
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
