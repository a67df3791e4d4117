//! Key and epoch in a block, and their source.

use std::path::Path;

use uav_relay_scenario::Scenario;
use uav_relay_scenario::key;
use uav_relay_tools::provision::block::{BlockError, Flight};
use uav_relay_tools::provision::config::{Block, ConfigError, Secret, secret};

use super::{of_paper, paper, provision, reads, refusal, with};

const SECRET: Secret = Secret {
    key: *b"32 random bytes, known to nobody",
    epoch: 0x0102_0304,
};

fn flight() -> Flight {
    Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap()
}

#[test]
fn key_and_epoch_stand_where_the_table_says() {
    let block = flight().signed(Some(SECRET)).block(3).unwrap();
    let mut bytes = [4, 3, 2, 1].to_vec();
    bytes.extend(SECRET.key);
    assert_eq!(block, with(252, &bytes));
    assert_eq!(secret(&block), Ok(Some(SECRET)));
    assert_eq!(reads(&block), reads(&paper()), "nothing else changes");
    assert_eq!(secret(&paper()), Ok(None));
    assert_eq!(format!("{SECRET:?}"), "Secret(..)", "keys are not for logs");
}

#[test]
fn a_key_without_an_epoch_is_refused_and_the_other_way_round() {
    let key = SECRET.key;
    for (key, epoch) in [([0; 32], 1), (key, 0), (key, u32::MAX), ([0; 32], u32::MAX)] {
        let block = flight().signed(Some(Secret { key, epoch })).block(3);
        assert_eq!(block, Err(BlockError::Config(ConfigError::Secret)));
        let mut bytes = epoch.to_le_bytes().to_vec();
        bytes.extend(key);
        assert_eq!(secret(&with(252, &bytes)), Err(ConfigError::Secret));
    }
    let epoch = 0xFFFF_FFFE;
    let most = Some(Secret { key, epoch });
    assert!(flight().signed(most).block(3).is_ok());
}

#[test]
fn brief_takes_the_key_from_a_file_and_the_epoch_from_the_clock() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file) = (path("block.bin"), path("key"));
    super::write_key(&file, &format!("\n  {}\r\n", "0aF1".repeat(16)));
    let plain = of_paper(&out);
    let block = || <Block>::try_from(&std::fs::read(&out).unwrap()[..]).unwrap();
    let clock = || {
        let since = std::time::UNIX_EPOCH.elapsed().unwrap();
        u32::try_from(since.as_secs()).unwrap()
    };

    let output = provision(&plain);
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        said,
        "no --key-file: frames are not signed, and anybody in range can send frames\n"
    );
    assert_eq!(block(), paper());

    let signed = format!("{plain} --key-file {file}");
    let before = clock();
    let output = provision(&signed);
    assert!(output.status.success() && output.stderr.is_empty());
    let Secret { key, epoch } = secret(&block()).unwrap().unwrap();
    assert_eq!(key, [[0x0A, 0xF1]; 16].concat()[..]);
    assert!((before..=clock()).contains(&epoch), "{epoch}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!said.to_lowercase().contains("0af1"), "{said}");

    let output = provision(&format!("{signed} --epoch 9"));
    assert!(output.status.success());
    assert_eq!(secret(&block()).unwrap().unwrap().epoch, 9);
}

#[test]
fn a_bad_key_is_named_and_not_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file) = (path("block.bin"), path("key"));
    let plain = format!("--uavs 5 --index 3 --out {out}");
    let keyed = format!("{plain} --key-file {file}");
    let text = refusal(&keyed);
    assert!(text.contains("--key-file"), "{text}");
    assert!(text.contains("cannot be read"), "{text}");
    let good = "0123456789abcdef".repeat(4);
    assert!(key::parse(&good).is_ok());
    let length = "64 hexadecimal digits";
    let digits = "hexadecimal digits and nothing else";
    for (content, words) in [
        ("", length),
        (&good[1..], length),
        (&format!("{good}0"), length),
        (&format!("0x{}", &good[2..]), digits),
        (&format!("{} {}", &good[..32], &good[33..]), digits),
        (&good.replace('9', "é"), digits),
        (&"0".repeat(64), "must not be all 0"),
    ] {
        super::write_key(&file, content);
        let text = refusal(&keyed);
        assert!(text.contains("--key-file"), "{text}");
        assert!(text.contains(words), "{content}: {text}");
        assert!(!text.contains("cdef"), "{text}");
    }
    super::write_key(&file, &good);
    for epoch in ["--epoch=0", "--epoch=4294967295", "--epoch=-1"] {
        let text = refusal(&format!("{keyed} {epoch}"));
        assert!(text.contains("--epoch"), "{text}");
    }
    let text = refusal(&format!("{plain} --epoch 9"));
    assert!(text.contains("--key-file"), "{text}");
    assert!(!Path::new(&out).exists());
}

#[test]
fn a_key_file_that_others_can_read_is_refused() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file) = (path("block.bin"), path("key"));
    std::fs::write(&file, "0123456789abcdef".repeat(4)).unwrap();
    let plain = format!("--uavs 5 --index 3 --out {out}");
    let keyed = format!("{plain} --key-file {file}");
    for (mode, is_taken) in [
        (0o644, false),
        (0o604, false),
        (0o602, false),
        (0o666, false),
        (0o600, true),
        (0o400, true),
        // A service reads it through its group.
        (0o640, true),
    ] {
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(mode)).unwrap();
        if is_taken {
            assert!(provision(&keyed).status.success(), "{mode:o}");
            continue;
        }
        let text = refusal(&keyed);
        let words = format!("--key-file {file}: mode {mode:04o}: other users of this computer");
        assert!(text.contains(&words), "{text}");
        assert!(text.contains(&format!("type: chmod 600 {file}")), "{text}");
    }
}
