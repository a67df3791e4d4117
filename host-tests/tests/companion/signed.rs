//! Relay processes with signed frames.

use std::path::{Path, PathBuf};

use rustix::process::Signal;
use uav_relay_scenario::Scenario;

use crate::medium::{Noise, QUIET};
use crate::process::{Ended, Relay};
use crate::{Chain, simulated};

/// Writes a key file that only its owner can read.
pub(crate) fn write_key(file: impl AsRef<Path>, key: &str) {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::write(&file, key).unwrap();
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o600)).unwrap();
}

/// Folder with a key file and the epoch files of relays.
pub(crate) struct Files(tempfile::TempDir);

impl Files {
    pub(crate) fn new() -> Self {
        let files = Self(tempfile::tempdir().unwrap());
        files.write("key", &"5eC2e7".repeat(11)[..64]);
        files.write("other", &"00000001".repeat(8));
        files
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        write_key(self.path(name), text);
    }

    pub(crate) fn options(&self, key: &str, epoch: &str) -> Vec<String> {
        let text = |path: &Path| path.to_str().unwrap().to_owned();
        vec![
            "--key-file".to_owned(),
            text(&self.path(key)),
            "--epoch-file".to_owned(),
            text(&self.path(epoch)),
        ]
    }

    fn epoch(&self, name: &str) -> u32 {
        let text = std::fs::read_to_string(self.path(name)).unwrap();
        text.trim().parse().unwrap()
    }
}

fn start(chain: &mut Chain, files: &Files, index: usize) -> Relay {
    chain.options = files.options("key", &format!("epoch{index}"));
    chain
        .options
        .extend(["--probe-after-ms", "500", "--dead-after-ms", "1500"].map(str::to_owned));
    chain.relay(index)
}

/// Checks quiet and noisy wires, and a reboot.
#[test]
fn three_that_sign_settle_where_the_simulated_chain_does() {
    for noise in [QUIET, Noise::bad(3)] {
        let files = Files::new();
        files.write("epoch2", "41\n");
        let mut chain = Chain::of_wires(3, noise);
        chain.relays = (1..=3)
            .map(|index| start(&mut chain, &files, index))
            .collect();
        assert!(chain.relays[1].line("signed: ").ends_with("epoch 42"));
        assert_eq!(files.epoch("epoch2"), 42);
        // The relay writes the file before the log line.
        chain.relays[0].line("signed: ");
        assert!(files.epoch("epoch1") > 1_700_000_000, "of the clock");
        let expected = simulated(&Scenario::default(), 3);
        assert_eq!(chain.settled(), expected);

        // Relay 2 and then the leader restart; both are accepted and agree again.
        for index in [2, 1] {
            let old = chain.relays.remove(index - 1);
            old.signal(Signal::TERM);
            assert_eq!(old.end().status, Some(0));
            let fresh = start(&mut chain, &files, index);
            chain.relays.insert(index - 1, fresh);
        }
        assert!(chain.relays[1].line("signed: ").ends_with("epoch 43"));
        assert_eq!(chain.relays[0].settled(), expected[0]);
        assert_eq!(chain.relays[1].settled(), expected[1]);
    }
}

#[test]
fn one_with_another_key_is_not_heard() {
    let files = Files::new();
    let mut chain = Chain::of_wires(2, QUIET);
    let one = start(&mut chain, &files, 1);
    chain.options = files.options("other", "epoch2");
    chain.relays = vec![one, chain.relay(2)];
    chain.relays[0].line("lost: relay 2 downstream does not reply");
    assert!(!chain.relays[0].has_said("setpoint: "));
    chain.relays[0].signal(Signal::TERM);
    let said = chain.relays.swap_remove(0).end().stdout;
    let last = said.last().unwrap();
    assert!(
        last.contains(" 0 received, ") && !last.contains(" 0 rejected"),
        "{last}"
    );
}

#[test]
fn a_bad_key_or_epoch_is_named() {
    let files = Files::new();
    files.write("short", "5ec2e7");
    files.write("text", "yesterday");
    files.write("last", "4294967295");
    for (key, epoch, status, words) in [
        ("short", "epoch", 2, "short: must be 64 hexadecimal digits"),
        ("nowhere", "epoch", 2, "nowhere: cannot be read"),
        (
            "key",
            "text",
            1,
            "text: must hold a number within 0 to 4294967294",
        ),
        (
            "key",
            "last",
            1,
            "last: is the largest epoch, and a start needs a larger one",
        ),
        ("key", "no/folder", 1, "folder: cannot be written"),
    ] {
        let options = files.options(key, epoch);
        let mut arguments = vec!["--index", "1", "--of", "1"];
        arguments.extend(options.iter().map(String::as_str));
        let ended: Ended = Relay::start(&arguments).end();
        assert_eq!(ended.status, Some(status), "{ended:?}");
        assert_eq!(ended.stderr.len(), 1, "{ended:?}");
        assert!(ended.stderr[0].contains(words), "{ended:?}");
        assert!(!ended.stderr[0].contains("5ec2"), "{ended:?}");
    }
    assert_eq!(
        std::fs::read_to_string(files.path("text")).unwrap(),
        "yesterday"
    );
    // Either option requires the other.
    for given in ["--key-file", "--epoch-file"] {
        let ended = Relay::start(&["--index", "1", "--of", "1", given, "x"]).end();
        assert_eq!(ended.status, Some(2));
        assert!(ended.stderr[0].contains("-file"), "{ended:?}");
    }
}

#[test]
fn without_a_key_it_says_so() {
    let mut relay = Relay::start(&["--index", "1", "--of", "1"]);
    assert!(
        relay
            .line("unsigned: ")
            .contains("anybody in range can send frames")
    );
}
