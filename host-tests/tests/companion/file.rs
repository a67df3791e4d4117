//! Shared scenario file of `cargo plan`, the companion and the ground station, with their own sections.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::{Scenario, mission};

use crate::medium::{Medium, QUIET};
use crate::process::{Ended, Relay};
use crate::simulated;

/// Scenario in which every value differs from the paper's.
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

/// Checks by the digest, which covers all numbers of a mission, that all programs read the same one.
#[test]
fn each_kind_of_scenario_is_the_mission_of_the_other_tools() {
    let folder = Folder::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for name in [
        "scenario",
        "altitudes",
        "side",
        "field",
        "multi_interferer",
        "site",
    ] {
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
    let mut all = String::new();
    for sections in [
        "[network]\nid = 65536",
        "[network]\nname = 1",
        "[network]\nmethod = \"best\"",
        "[companion]\nbaud = 9600",
        "[companion]\nupstream = 5",
        "[companion]\nspeed_m_s = 21.0",
        "[companion]\nautopilot = \"udp:localhost:64536\"",
        "[ground]\nend = \"top\"",
        "[companion]\nspeed_m_s = 5.0",
        "[companion]\nautopilot_baud = 57600",
        "[companion]\nautopilot_key_file = \"key\"",
        "[companion]\nkey = 5",
    ] {
        let file = folder.write("drone.toml", &format!("{SCENARIO}\n{sections}\n"));
        let Ended { status, stderr, .. } = start(&file, &["--index", "1", "--of", "1"]).end();
        assert_eq!(
            (status, stderr.len()),
            (Some(2), 1),
            "{sections}: {stderr:?}"
        );
        // Programs that do not use the sections check them as well, except for options that need another one.
        let checked = Scenario::load(&file).is_err();
        let needs = stderr[0].contains(": needs companion.autopilot");
        assert_eq!(checked, !needs, "{sections}");
        let line = stderr[0].replace(folder.0.path().to_str().unwrap(), "FOLDER");
        writeln!(all, "{sections}\n    {line}").unwrap();
    }
    insta::assert_snapshot!(all);
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

/// Checks that the command line overrides the file, and that each difference is reported once.
#[test]
fn what_the_command_line_says_otherwise_is_said_once_and_nothing_else() {
    let folder = Folder::new();
    let sections =
        "[network]\nid = 4711\nrelays = 1\nbaud = 57600\n[companion]\nupstream = \"away\"\n";
    let file = folder.write("drone.toml", &format!("{SCENARIO}\n{sections}"));
    let name = file.display();
    let channel = Medium::new(1, QUIET);
    let said = |file: &Path, more: &[&str]| -> Vec<String> {
        let all = [&["--index", "1", "--shared", channel.tty(0)], more].concat();
        let relay = start(file, &all);
        let mut said = overrides(relay);
        let shared = format!("--shared {} replaces --upstream ", channel.tty(0));
        let last = said.pop().unwrap();
        assert!(last.starts_with(&shared), "{last}");
        said
    };
    let mut others = said(
        &file,
        &["--altitude", "23", "--network=12", "--interferer", "80,1,2"],
    );
    others.sort();
    assert_eq!(
        others,
        [
            format!("--altitude 23 replaces 33.3 of {name}"),
            format!("--interferer 80,1,2 replaces 55.5,987.6,-321 of {name}"),
            format!("--network 12 replaces 4711 of {name}"),
        ]
    );
    // The same number in another notation is no difference, and neither is a value that the file lacks.
    let same = ["--altitude", "33.30", "--network", "4711", "--baud=57600"];
    let same = [
        &same[..],
        &[
            "--interferer",
            "55.50,987.6,-321.0",
            "--dead-after-ms",
            "20000",
        ],
    ];
    assert_eq!(said(&file, &same.concat()), [""; 0]);

    let field = "[geometry]\ndistance_m = 1000.0\naltitude_m = 20.0\n[power]\ntx_w = 80.0\nuav_w = 1.0\n\
        [field]\ni_max_w = 2e-10\n[[field.beta]]\nx_m = 0.0\nalpha = 2.0\nbeta = 1.5\n\
        [network]\nrelays = 1\n";
    let field = folder.write("field.toml", field);
    let alone = [
        "--index",
        "1",
        "--interferer",
        "80,500,400",
        "--altitude",
        "25",
    ];
    let mut said = overrides(start(&field, &alone));
    said.sort();
    let name = field.display();
    assert_eq!(
        said,
        [
            format!("--altitude 25 replaces 20 of {name}"),
            format!("--interferer 80,500,400 replaces [field] of {name}"),
        ]
    );

    // An option for all relays cannot override a value that the file has for one relay.
    let own = format!("{SCENARIO}\n[[relay]]\nindex = 1\npower_w = 0.5\n");
    let own = folder.write("own.toml", &own);
    for (index, status) in [("1", 2), ("2", 1)] {
        let more = [
            "--index",
            index,
            "--of",
            "2",
            "--shared",
            "/nowhere",
            "--altitude",
            "23",
        ];
        let Ended {
            status: ended,
            stderr,
            ..
        } = start(&own, &more).end();
        assert_eq!((ended, stderr.len()), (Some(status), 1), "{stderr:?}");
        let line = "--altitude 23: relay 1 has values of its own in a [[relay]] of --config";
        assert_eq!(stderr[0].starts_with(line), status == 2, "{stderr:?}");
    }
}

/// Returns the reported overrides of a started relay.
fn overrides(mut relay: Relay) -> Vec<String> {
    relay.line("unguarded: ");
    relay.signal(rustix::process::Signal::TERM);
    let ended = relay.end();
    assert_eq!(ended.status, Some(0), "{ended:?}");
    let lines = ended.stdout.iter();
    lines
        .filter_map(|line| Some(line.split_once("  override: ")?.1.to_owned()))
        .collect()
}
