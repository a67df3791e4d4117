//! Captures of all transmitted frames with virtual times (`--capture`).

use std::path::Path;
use std::time::Duration;

use pcap_file::pcapng::blocks::enhanced_packet::EnhancedPacketOption;
use pcap_file::pcapng::blocks::interface_description::InterfaceDescriptionOption;
use pcap_file::pcapng::{Block, PcapNgReader};

use super::{chain, json, refusal};

struct Frame {
    interface: String,
    at: Duration,
    bytes: Vec<u8>,
    comment: String,
}

fn read(file: &Path) -> Vec<Frame> {
    let mut reader = PcapNgReader::new(std::fs::File::open(file).unwrap()).unwrap();
    let (mut names, mut frames) = (Vec::new(), Vec::new());
    while let Some(block) = reader.next_block() {
        match block.unwrap() {
            Block::InterfaceDescription(interface) => {
                assert_eq!(u32::from(interface.linktype), 147);
                names.extend(interface.options.iter().find_map(|option| match option {
                    InterfaceDescriptionOption::IfName(name) => Some(name.to_string()),
                    _ => None,
                }));
            }
            Block::EnhancedPacket(packet) => {
                assert_eq!(packet.original_len as usize, packet.data.len());
                let comment = packet.options.iter().find_map(|option| match option {
                    EnhancedPacketOption::Comment(comment) => Some(comment.to_string()),
                    _ => None,
                });
                frames.push(Frame {
                    interface: names[packet.interface_id as usize].clone(),
                    at: packet.timestamp,
                    bytes: packet.data.to_vec(),
                    comment: comment.unwrap_or_default(),
                });
            }
            _ => {}
        }
    }
    frames
}

/// Runs `cargo chain` with `arguments` and a capture file. Returns its report and the captured frames.
fn captured(arguments: &str) -> (serde_json::Value, Vec<Frame>) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("air.pcapng");
    let name = file.to_str().unwrap();
    let report = json(&format!("{arguments} --capture {name}"));
    let frames = read(&file);
    assert!(frames.is_sorted_by_key(|frame| frame.at), "{arguments:?}");
    (report, frames)
}

#[test]
fn a_capture_of_links_has_every_message_and_every_byte() {
    for faults in ["", "--loss 0.2 --corrupt 0.1 --reorder 0.1"] {
        let arguments = format!("--uavs 5 {faults}");
        let (report, frames) = captured(&arguments);
        assert_eq!(report, json(&arguments), "nothing else changes");
        assert_eq!(report["messages"], frames.len());
        let bytes: usize = frames.iter().map(|frame| frame.bytes.len()).sum();
        assert_eq!(report["bytes"], bytes);
        let virtual_s = report["virtual_s"].as_f64().unwrap();
        assert!(frames[0].at < Duration::from_secs_f64(virtual_s));
        for name in ["1-2", "2-3", "3-4", "4-5"] {
            assert!(frames.iter().any(|frame| frame.interface == name), "{name}");
        }
        for frame in &frames {
            assert_eq!(
                frame.bytes.iter().position(|byte| *byte == 0),
                Some(frame.bytes.len() - 1)
            );
        }
        let with = |word: &str| {
            frames
                .iter()
                .filter(|frame| frame.comment.contains(word))
                .count()
        };
        assert_eq!(report["faults"]["lost"], with("lost"));
        assert_eq!(report["faults"]["corrupted"], with("changed"));
        assert_eq!(with("lost") > 0, !faults.is_empty());
    }
}

#[test]
fn a_capture_of_the_channel_has_the_attackers_frames_too() {
    let (report, frames) = captured("--uavs 4 --shared --forge 20 --replay 10");
    assert!(frames.iter().all(|frame| frame.interface == "channel"));
    let with = |word: &str| frames.iter().filter(|frame| frame.comment == word).count();
    assert_eq!(with("forged by the attacker"), 20);
    assert_eq!(with("replayed by the attacker"), 10);
    let sent = usize::try_from(report["air"]["sent"].as_u64().unwrap()).unwrap();
    // Transmissions that are unfinished at the end are not captured.
    assert!((sent - 4..=sent).contains(&(frames.len() - 30)), "{sent}");
    let missed = |frame: &Frame| frame.comment.contains("did not receive the frame");
    assert!(frames.iter().any(missed));
}

#[test]
fn the_capture_has_uploads_from_both_ends() {
    for (end, wire, name) in [
        ("tx", "--wires", "Tx-1"),
        ("rx", "--wires", "3-Rx"),
        ("rx", "", "channel"),
    ] {
        let arguments = format!("--uavs 3 --upload 2:uav_w=2 --upload-from {end}");
        let (_, frames) = captured(&format!("{arguments} {wire}"));
        let offers = frames
            .iter()
            .filter(|frame| frame.interface == name && frame.bytes.len() == 149);
        assert!(offers.count() > 0, "{end} {wire:?}");
    }
}

#[test]
fn a_capture_that_cannot_be_written_is_refused_before_the_run() {
    let (status, line) = refusal("--capture /nowhere/air.pcapng --uavs 100");
    assert_eq!(status, 2);
    assert!(
        line.starts_with("/nowhere/air.pcapng: --capture cannot be written: "),
        "{line}"
    );
    if Path::new("/dev/full").exists() {
        let output = chain("--capture /dev/full --loss 0.3");
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(
            (output.status.code(), line.lines().count()),
            (Some(2), 1),
            "{line}"
        );
        assert!(
            line.starts_with("/dev/full: --capture cannot be written: "),
            "{line}"
        );
    }
}

/// Checks that Wireshark decodes a capture with the repository's dissector.
///
/// Without `tshark` the test fails and prints how to install it.
#[test]
fn tshark_names_every_frame_of_a_capture() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("air.pcapng");
    let dissector = super::example("wireshark/uav_relay.lua");
    for (arguments, names) in [
        (
            "--method joint --auth",
            &["Handshake", "Sweep", "Verdict"][..],
        ),
        (
            "--kill 3@20 --upload 30:uav_w=2",
            &["Hello", "Proposal", "Decision", "Offer", "Pulse", "Pulsed"],
        ),
        ("--method adjust --rounds 2", &["Token", "Moved"]),
    ] {
        let report = json(&format!("{arguments} --capture {}", file.display()));
        let output = std::process::Command::new("tshark")
            .args(["-X", &format!("lua_script:{dissector}"), "-r"])
            .arg(&file)
            .args([
                "-T",
                "fields",
                "-e",
                "uav_relay.message",
                "-e",
                "uav_relay.refused",
            ])
            .output()
            .unwrap_or_else(|error| {
                panic!("tshark: {error}; type: sudo apt-get install --yes tshark")
            });
        assert!(output.status.success());
        let shown = String::from_utf8(output.stdout).unwrap();
        let shown: Vec<&str> = shown.lines().map(str::trim).collect();
        assert!(shown.len() > 10 && shown.len() as u64 <= report["messages"].as_u64().unwrap());
        for line in &shown {
            // A message name without a rejection.
            assert!(
                line.chars().all(char::is_alphabetic) && !line.is_empty(),
                "{line}"
            );
        }
        for name in names {
            assert!(shown.contains(name), "{name} of {arguments:?}");
        }
    }
}
