//! Fleet with spares, from the scenario to the plan, the blocks and the bundles.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use uav_relay_scenario::deployment::Deployment;
use uav_relay_tools::provision::config::Block;

use super::{provision, reads, refusal};

const FLEET: &str = "[network]\nrelays = 6\n[fleet]\nflying = 4\n";
const SITE: &str = "[site]\ntx = { lat_deg = 47.4, lon_deg = 8.54, amsl_m = 420 }\nrx = { lat_deg = 47.41, lon_deg = 8.55, amsl_m = 431 }\n";

/// Writes the file `name` in `folder`: a scenario with the sections `more`. Returns its path.
fn write(folder: &Path, name: &str, more: &str) -> String {
    let base = "[geometry]\naltitude_m = 20\n[power]\ntx_w = 80\nuav_w = 1\n[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";
    let file = folder.join(name);
    std::fs::write(&file, format!("{base}{SITE}{more}")).unwrap();
    file.to_str().unwrap().to_owned()
}

fn plan(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn printed(output: &Output) -> String {
    let [out, error] = [&output.stdout, &output.stderr].map(|it| String::from_utf8_lossy(it));
    assert!(output.status.success(), "{error}");
    out.into_owned()
}

/// Runs `cargo plan`, checks that it exits with status 2, and returns its error line.
fn refused(arguments: &str) -> String {
    let output = plan(arguments);
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{arguments}: {line}");
    line
}

#[test]
fn a_fleet_is_planned_with_the_relays_that_fly() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = write(folder.path(), "fleet.toml", FLEET);
    let alone = write(folder.path(), "alone.toml", "");
    let file = folder.path().join("plan.toml");
    let told = printed(&plan(&format!(
        "--scenario {fleet} --out {}",
        file.display()
    )));
    let line = "fleet: 6 relays, 4 are meant to fly, 2 in reserve; spares at the start: 3, 6\n";
    assert!(told.contains(line), "{told}");
    let json = |arguments: &str| -> Value {
        serde_json::from_str(&printed(&plan(&format!("--json {arguments}")))).unwrap()
    };
    let mut of_fleet = json(&format!("--scenario {fleet}"));
    let told = of_fleet.as_object_mut().unwrap().remove("fleet");
    let expected = serde_json::json!({ "relays": 6, "flying": 4, "spares": [3, 6] });
    assert_eq!(told, Some(expected));
    assert_eq!(of_fleet, json(&format!("--scenario {alone} --uavs 4")));
    // A plan of another number of relays is not the fleet's.
    assert_eq!(
        json(&format!("--scenario {fleet} --uavs 5"))["fleet"],
        Value::Null
    );
    let (scenario, sections) = Deployment::load(&file).unwrap();
    assert_eq!(scenario.plan.unwrap().places.len(), 4);
    let size = sections.fleet_size().unwrap();
    assert_eq!((size.relays, size.flying), (6, 4));
}

#[test]
fn a_fleet_that_cannot_be_planned_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("plan.toml");
    let out = out.display();
    let fleet = write(folder.path(), "fleet.toml", FLEET);
    let alone = write(folder.path(), "alone.toml", "");
    let relay = "[[relay]]\nindex = 2\npower_w = 2\n";
    let differ = write(folder.path(), "differ.toml", &format!("{FLEET}{relay}"));
    for (arguments, part) in [
        (
            format!("--scenario {alone}"),
            "one of --uavs, --target-sir, --target-sir-db and --target-rate-bps is required, unless the scenario has fleet.flying",
        ),
        (
            format!("--scenario {fleet} --uavs 6 --out {out}"),
            "fleet.flying = 4 contradicts plan.uavs; allowed: 6, the number of relays in [plan]",
        ),
        (
            format!("--scenario {differ}"),
            "differ.toml: fleet.flying = 4 contradicts [[relay]]; allowed: identical relays",
        ),
    ] {
        let line = refused(&arguments);
        assert!(line.contains(part), "{arguments}: {line}");
    }
    let line = refusal(&format!("--scenario {differ} --all --out-dir {out}"));
    assert!(
        line.contains("fleet.flying = 4 contradicts [[relay]]"),
        "{line}"
    );
    for (option, part) in [
        (
            "--wires",
            "--wires: spares join only on a channel that all relays share",
        ),
        ("--uavs 4", "--uavs 4: "),
    ] {
        let line = refusal(&format!(
            "--scenario {fleet} --all --out-dir {out} {option}"
        ));
        assert!(line.contains(part), "{line}");
    }
    assert!(!folder.path().join("plan.toml").exists());
}

#[test]
fn every_drone_of_a_fleet_has_a_block_and_spares_are_marked() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = write(folder.path(), "fleet.toml", FLEET);
    let [file, dir] = ["plan.toml", "blocks"].map(|name| folder.path().join(name));
    printed(&plan(&format!(
        "--scenario {fleet} --out {}",
        file.display()
    )));
    for scenario in [&fleet, file.to_str().unwrap()] {
        printed(&provision(&format!(
            "--scenario {scenario} --all --force --out-dir {}",
            dir.display()
        )));
        for index in 1..=6 {
            let block = std::fs::read(dir.join(format!("relay{index}.bin"))).unwrap();
            let config = reads(&Block::try_from(block).unwrap()).unwrap();
            assert_eq!(config.mission.relays(), 6);
            assert_eq!(
                (config.flying, config.spare),
                (4, [3, 6].contains(&index)),
                "{index}"
            );
        }
        let summary = std::fs::read_to_string(dir.join("summary.txt")).unwrap();
        assert!(summary.contains("4 relays fly; spares at the start, which wait outside of the chain: relay3.bin, relay6.bin\n"), "{summary}");
        // The positions are those of the relays that are no spares.
        let rows: Vec<&str> = summary
            .lines()
            .filter_map(|row| row.trim_start().split_once(".bin  "))
            .map(|it| it.0)
            .collect();
        assert_eq!(rows, ["relay1", "relay2", "relay4", "relay5"], "{summary}");
    }
}

#[test]
fn a_bundle_of_a_fleet_marks_its_spares() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = write(folder.path(), "fleet.toml", FLEET);
    let dir = folder.path().join("flight");
    printed(&provision(&format!(
        "--scenario {fleet} --bundle {}",
        dir.display()
    )));
    for index in 1..=6 {
        let own = dir.join(format!("relay{index}"));
        let (scenario, sections) = Deployment::load(&own.join("drone.toml")).unwrap();
        assert_eq!(scenario.plan.unwrap().uavs, 4);
        assert_eq!(sections.fleet.flying, Some(4));
        assert_eq!(sections.network.relays, Some(6));
        assert_eq!(sections.companion.spare, Some([3, 6].contains(&index)));
        let page = std::fs::read_to_string(own.join("page.txt")).unwrap();
        let is_spare = page.contains("place: spare, which waits beside the line");
        assert_eq!(is_spare, [3, 6].contains(&index), "{page}");
        let beside = [
            "the transmitter and relay 2",
            "relay 1 and relay 4",
            "relay 2 and relay 4",
            "relay 2 and relay 5",
            "relay 4 and the receiver",
            "relay 5 and the receiver",
        ];
        let between = if is_spare {
            "joins between"
        } else {
            "neighbours"
        };
        let line = format!("{between}: {}\n", beside[index - 1]);
        assert_eq!(page.contains("a place beside the line"), is_spare, "{page}");
        assert!(
            page.contains(&line) && page.contains("chain of 4 of 6 relays"),
            "{page}"
        );
    }
}

/// Checks that a file without a number of flying relays cannot make all drones spares.
#[test]
fn a_file_that_makes_all_drones_spares_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = write(folder.path(), "spares.toml", "[companion]\nspare = true\n");
    let line = refusal(&format!("--scenario {file} --uavs 4 --all"));
    assert!(
        line.contains("companion.spare = true: would make every relay"),
        "{line}"
    );
}
