//! One file for all tools: what `cargo plan` reads, the companion and the ground read too, and their own sections of it.

use std::path::{Path, PathBuf};

use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::{Scenario, mission};

use crate::medium::{Medium, QUIET};
use crate::process::{Ended, Relay};
use crate::simulated;

/// A scenario with nothing as the paper has it.
const SCENARIO: &str = "
[geometry]
distance_m = 2345.6
altitude_m = 33.3
altitude_min_m = 22.2
altitude_max_m = 44.4
min_separation_m = 7.5

[power]
tx_w = 12.25
uav_w = 0.7

[channel]
carrier_hz = 2.4e9
excess_loss_los_db = 0.3
air_ground = 0.9

[noise]
bandwidth_hz = 1e6

[[interferer]]
power_w = 55.5
x_m = 987.6
y_m = -321.0
";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let file = self.0.path().join(name);
        std::fs::write(&file, text).unwrap();
        file
    }
}

fn start(file: &Path, more: &[&str]) -> Relay {
    Relay::start(&[&["--config", file.to_str().unwrap()], more].concat())
}

#[test]
fn three_with_one_file_settle_where_the_simulated_chain_does() {
    let folder = Folder::new();
    let channel = Medium::new(3, QUIET);
    let text = format!(
        "{SCENARIO}\n[network]\nid = 4711\nrelays = 3\nbaud = 57600\n[companion]\nshared = \"{}\"\n",
        channel.tty(0)
    );
    let file = folder.write("drone.toml", &text);
    let scenario = Scenario::load(&file).unwrap();
    assert_eq!(Deployment::load(&file).unwrap().1.network.id, Some(4711));
    let mut relays: Vec<Relay> = ["1", "2", "3"]
        .into_iter()
        .zip(0..)
        .map(|(index, tty)| start(&file, &["--index", index, "--shared", channel.tty(tty)]))
        .collect();
    for relay in &mut relays {
        let line = relay.line("started: ");
        assert!(
            line.contains(", network 4711, ") && line.contains(", 57600 baud"),
            "{line}"
        );
    }
    let settled: Vec<_> = relays.iter_mut().map(Relay::settled).collect();
    assert_eq!(settled, simulated(&scenario, 3));
    assert_ne!(settled, simulated(&Scenario::default(), 3));
}

/// The digest covers every number of a mission, so it is the same one if they all reached it.
#[test]
fn each_kind_of_scenario_is_the_mission_of_the_other_tools() {
    let folder = Folder::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for name in ["scenario", "altitudes", "side", "field", "several", "site"] {
        let file = root.join(format!("examples/{name}.toml"));
        let scenario = Scenario::load(&file).unwrap();
        let (mission, _) = mission::mission(&scenario, 1, 1e-4).unwrap();
        let digest = uav_relay::wire::digest::digest(&mission);
        let mut relay = start(&file, &["--index", "1", "--of", "1"]);
        let line = relay.line("started: ");
        let expected = format!("relay 1 of 1, network {NETWORK}, mission 0x{digest:04x}, ");
        assert!(line.contains(&expected), "{name}: {expected} not in {line}");
    }
    let other = folder.write("other.toml", SCENARIO);
    let line = start(&other, &["--index", "1", "--of", "1", "--altitude", "23"]).line("started: ");
    let alone = start(&other, &["--index", "1", "--of", "1"]).line("started: ");
    let digest = |line: &str| line.split("mission ").nth(1).unwrap()[..6].to_owned();
    assert_ne!(digest(&line), digest(&alone), "the command line counts");
}

#[test]
fn what_is_wrong_with_the_file_is_named() {
    let folder = Folder::new();
    for (sections, parts) in [
        (
            "[network]\nid = 65536",
            &["network.id = 65536", "0 to 65535"][..],
        ),
        (
            "[network]\nname = 1",
            &["network.name", "id, relays, key_file"],
        ),
        (
            "[network]\nmethod = \"best\"",
            &["network.method", "\"align\" or \"joint\" or \"adjust\""],
        ),
        (
            "[companion]\nbaud = 9600",
            &["companion.baud", "not a known key"],
        ),
        (
            "[companion]\nupstream = 5",
            &["companion.upstream = 5", "a text"],
        ),
        (
            "[companion]\nspeed_m_s = 21.0",
            &["companion.speed_m_s = 21", "0.1 to 20 m/s"],
        ),
        (
            "[ground]\nend = \"top\"",
            &["ground.end", "\"tx\" or \"rx\""],
        ),
        (
            "[companion]\nspeed_m_s = 5.0",
            &["--autopilot", "not provided"],
        ),
        (
            "[companion]\nkey = 5",
            &["companion.key", "not a known key"],
        ),
    ] {
        let file = folder.write("drone.toml", &format!("{SCENARIO}\n{sections}\n"));
        let Ended { status, stderr, .. } = start(&file, &["--index", "1", "--of", "1"]).end();
        assert_eq!(
            (status, stderr.len()),
            (Some(2), 1),
            "{sections}: {stderr:?}"
        );
        for part in parts {
            assert!(
                stderr[0].contains(part),
                "{sections}: {part} not in {stderr:?}"
            );
        }
        // Tools that do not use the sections check them as well.
        let checked = Scenario::load(&file).is_err();
        assert_eq!(checked, !parts[0].starts_with("--"), "{sections}");
    }
    let missing = folder.0.path().join("nowhere.toml");
    let folder = folder.0.path().to_owned();
    for (file, why) in [(missing, "no such file"), (folder, "is a directory")] {
        let Ended { status, stderr, .. } = start(&file, &["--index", "1", "--of", "1"]).end();
        assert_eq!(status, Some(2));
        assert!(
            stderr[0].starts_with("--config ") && stderr[0].contains(why),
            "{stderr:?}"
        );
    }
}
