//! Output and error messages of `cargo provision`.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Output};

use uav_relay::{Adjust, Measure, Method};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::number::narrow;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::{Block, secret};

use super::{example, of_paper, paper, provision, reads, refusal, write_key};

#[test]
fn the_command_writes_the_block() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("relay3.bin");
    let output = provision(&of_paper(&out));
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read(&out).unwrap(), paper());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("relay 3 of 5, network 7") && text.contains("0x080e0000"),
        "{text}"
    );
}

#[test]
fn the_command_writes_the_relays_task() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("relay.bin");
    let file = folder.path().join("field.toml");
    let written = |more: &str| {
        let output = provision(&format!("{} {more}", of_paper(&out)));
        assert!(output.status.success(), "{output:?}");
        let block: Block = std::fs::read(&out).unwrap().try_into().unwrap();
        reads(&block).unwrap()
    };
    assert_eq!(written("--method align"), reads(&paper()).unwrap());
    assert_eq!(written("--method joint").method, Method::Joint);
    let adjust = Adjust::default();
    assert_eq!(written("--method adjust").method, Method::Adjust(adjust));
    let adjust = Adjust {
        rounds: 7,
        explore_m: 2.5,
        ..adjust
    };
    assert_eq!(
        written("--method adjust --rounds 7 --explore 2.5").method,
        Method::Adjust(adjust)
    );
    std::fs::write(&file, toml(3)).unwrap();
    let file = file.to_str().unwrap();
    let config = written(&format!("--scenario {file} --samples 2000"));
    let flight = Flight::new(&Scenario::load(Path::new(file)).unwrap(), 5, 1e-4, 7).unwrap();
    assert_eq!(config.mission, *flight.mission());
    assert_eq!(
        config.measure,
        Some(Measure {
            i_max_w: 2e-10,
            samples: 2_000
        })
    );
}

fn toml(points: usize) -> String {
    let mut text = "[geometry]\ndistance_m = 1000.0\naltitude_m = 20.0\n\
                    [power]\ntx_w = 80.0\nuav_w = 1.0\n\
                    [field]\ni_max_w = 2e-10\n"
        .to_owned();
    for k in 0..points {
        writeln!(text, "[[field.beta]]\nx_m = {k}.0\nalpha = 2.0\nbeta = 1.5").unwrap();
    }
    text
}

#[test]
fn errors_are_reported_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().to_str().unwrap();
    for points in [3, 17] {
        std::fs::write(folder.path().join(format!("{points}.toml")), toml(points)).unwrap();
    }
    let relay_1 = "--uavs 5 --index 1 --out FOLDER/block.bin";
    let mut all = String::new();
    for case in [
        format!("{relay_1} --method stochastic"),
        format!("{relay_1} --rounds 0"),
        format!("{relay_1} --explore=-1"),
        format!("{relay_1} --explore NaN"),
        format!("{relay_1} --explore 100001"),
        format!("{relay_1} --samples 99"),
        format!("{relay_1} --samples 100"),
        format!("{relay_1} --scenario FOLDER/3.toml --method altitude"),
        format!("{relay_1} --scenario FOLDER/17.toml"),
        format!("{relay_1} --network 65536"),
        format!("{relay_1} --tolerance 2"),
        format!("{relay_1} --scenario /nowhere.toml"),
        "--uavs 5 --index 6 --out FOLDER/block.bin".to_owned(),
        "--uavs 5 --index 0 --out FOLDER/block.bin".to_owned(),
        "--uavs 5 --out FOLDER/block.bin".to_owned(),
        "--uavs 600 --index 1 --out FOLDER/block.bin".to_owned(),
        "--uavs 5 --index 1 --out /nowhere/block.bin".to_owned(),
    ] {
        let options = case.replace("FOLDER", name);
        let line = refusal(&options);
        write!(all, "{case}\n    {}", line.replace(name, "FOLDER")).unwrap();
    }
    insta::assert_snapshot!(all);
    assert!(!folder.path().join("block.bin").exists());
}

/// Checks that too many relays for their radio channel are refused, with the numbers in the error.
///
/// At the firmware's data rate a channel carries 25 relays.
#[test]
fn a_channel_that_cannot_carry_the_chain_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("block.bin");
    let out = out.to_str().unwrap();
    let plain = format!("--index 1 --out {out} --uavs");
    for (arguments, least, in_range, ms, most) in [
        ("26", 117_334, 26, 5_093, 25),
        ("9 --baud 37546", 37_547, 9, 5_001, 8),
        ("100 --in-range 40", 183_040, 40, 7_945, 25),
        ("5 --in-range 9 --baud 9600", 18_774, 5, 9_778, 3),
        ("50 --baud 57600", 229_974, 50, 19_963, 13),
    ] {
        let baud = arguments.split_once("--baud ").map_or("115200", |it| it.1);
        let line = format!(
            "--baud {baud}: too slow for {in_range} relays in range of each other: use at least {least} bit/s, or --probe-after-ms {ms}, or at most {most} relays in range of each other; this assumes that all relays receive each other: if not, give --in-range, or --wires for separate links\n"
        );
        assert_eq!(refusal(&format!("{plain} {arguments}")), line);
    }
    assert!(!Path::new(out).exists());
    for arguments in [
        "25",
        "26 --wires",
        "26 --in-range 9",
        "26 --baud 117334",
        "9 --baud 37547",
        "50 --baud 57600 --probe-after-ms 19963",
    ] {
        let output = provision(&format!("{plain} {arguments}"));
        assert!(output.status.success(), "{output:?}");
    }
    let slow: Block = std::fs::read(out).unwrap().try_into().unwrap();
    assert_eq!(reads(&slow).unwrap().probe_after_ms, 19_963);
    let too_fast = "50 --baud 57600 --probe-after-ms 19962";
    refusal(&format!("{plain} {too_fast}"));
    let both = format!("{plain} 9 --wires --baud 9600");
    assert!(refusal(&both).contains("--wires"));
}

#[test]
fn the_block_has_the_networks_method_and_baud() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("relay.bin");
    let file = folder.path().join("chain.toml");
    let scenario = std::fs::read_to_string(example()).unwrap();
    let run = |sections: &str, more: &str| {
        std::fs::write(&file, format!("{scenario}\n{sections}\n")).unwrap();
        let (file, out) = (file.display(), out.display());
        provision(&format!(
            "--scenario {file} --uavs 5 --index 3 --out {out} {more}"
        ))
    };
    let written = |sections: &str, more: &str| {
        let output = run(sections, more);
        assert!(output.status.success(), "{output:?}");
        let block: Block = std::fs::read(&out).unwrap().try_into().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        (reads(&block).unwrap().method, said)
    };
    let network = |keys: &str| format!("[network]\n{keys}");
    let joint = network("method = \"joint\"");
    assert_eq!(written("", "").0, Method::Align);
    assert_eq!(written(&network("baud = 115200"), "").0, Method::Align);
    let adjust = network("method = \"adjust\"");
    assert_eq!(written(&adjust, "").0, Method::Adjust(Adjust::default()));
    let rounds = Adjust {
        rounds: 7,
        ..Adjust::default()
    };
    assert_eq!(written(&adjust, "--rounds 7").0, Method::Adjust(rounds));
    let (method, said) = written(&joint, "");
    assert_eq!(method, Method::Joint);
    assert!(!said.contains("--method"), "{said}");
    let (method, said) = written(&joint, "--method align");
    assert_eq!(method, Method::Align);
    let line = "--method align is used instead of network.method = \"joint\" in ";
    assert!(said.starts_with(line), "{said}");
    let others = network("id = 9\nrelays = 7\nprobe_after_ms = 5000\ndead_after_ms = 15000");
    let (_, said) = written(&others, "--network 3");
    let lines: Vec<&str> = said.lines().collect();
    assert!(
        lines[0].starts_with("--network 3 is used instead of network.id = 9 in "),
        "{said}"
    );
    assert!(
        lines[1].starts_with("--uavs 5 is used instead of network.relays = 7 in "),
        "{said}"
    );
    let (_, said) = written(&network("id = 9\nrelays = 5"), "--network 9");
    assert!(!said.contains("counts"), "{said}");
    let mut planned =
        "\n[plan]\nuavs = 5\ntolerance = 1e-4\nmethod = \"align\"\nsir_db = 3.0\n".to_owned();
    for k in 1..=5 {
        writeln!(
            planned,
            "[[plan.places]]\nx_m = {k}00.0\ny_m = 0.0\naltitude_m = 40.0"
        )
        .unwrap();
    }
    let refused = [
        "baud = 57600 | network.baud = 57600: must be 115200, or left out: the firmware's ports have only this data rate",
        "probe_after_ms = 1200001 | network.probe_after_ms = 1200001: must be within 1 to 1200000",
        "probe_after_ms = 20000\ndead_after_ms = 15000 | network.dead_after_ms = 15000: must be 60000, or left out: ",
        "dead_after_ms = 90000 | network.dead_after_ms = 90000: must be 15000, or left out: ",
    ]
    .map(|row| row.split_once(" | ").unwrap());
    let refused = refused.map(|(lines, words)| (network(lines), words));
    let method = "network.method = \"joint\": must be \"align\", the method of its [plan]";
    for (sections, words) in refused.into_iter().chain([(joint + &planned, method)]) {
        let output = run(&sections, "");
        assert_eq!(output.status.code(), Some(2), "{sections}: {output:?}");
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(line.trim_end().lines().count(), 1, "{line}");
        assert!(line.contains(words), "{words} not in {line}");
    }
}

/// Checks that a wrong UDP address of the autopilot is reported, although the firmware has no UDP.
///
/// Companion computers may use the same scenario file.
#[test]
fn an_autopilot_at_no_udp_port_is_named_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("relay.bin");
    let file = folder.path().join("drone.toml");
    let text = format!(
        "{}[companion]\nautopilot = \"udp:localhost:0\"\n",
        uav_relay_scenario::DEFAULT
    );
    std::fs::write(&file, text).unwrap();
    let scenario = format!("--scenario {}", file.display());
    let line = refusal(&format!("{} {scenario}", of_paper(&out)));
    let named = "companion.autopilot = \"udp:localhost:0\" has no valid PORT; allowed: a string: a tty, or udp:HOST:PORT";
    assert!(line.contains(named), "{line}");
    assert!(!out.exists(), "nothing is written");
}

fn plan(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_plan"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn planned(arguments: &str) -> String {
    let output = plan(arguments);
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

fn text(path: &Path) -> String {
    path.to_str().unwrap().to_owned()
}

fn names(dir: &Path) -> BTreeSet<String> {
    let entries = std::fs::read_dir(dir).unwrap();
    entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect()
}

/// Checks that relay `index`'s block in `dir` matches the plan, and that the summary has the relay.
fn is_provisioned(scenario: &Scenario, dir: &Path, index: u16, summary: &str) {
    let plan = scenario.plan.as_ref().unwrap();
    let block: Block = std::fs::read(dir.join(format!("relay{index}.bin")))
        .unwrap()
        .try_into()
        .unwrap();
    let config = reads(&block).unwrap();
    assert_eq!((config.identity.network, config.identity.index), (9, index));
    assert_eq!(config.mission.relays(), plan.uavs);
    assert_eq!(config.method, Method::Align);
    assert!(config.sites.is_some());
    assert_eq!(secret(&block).unwrap().map(|secret| secret.epoch), Some(77));
    // The summary has the relay's x, y, latitude and longitude, and the command for its file.
    let place = plan.places[usize::from(index) - 1];
    let row = summary
        .lines()
        .find(|line| line.trim_start().starts_with(&format!("relay{index}.bin ")))
        .unwrap();
    let numbers: Vec<f64> = row
        .split_whitespace()
        .skip(1)
        .map(|word| word.parse().unwrap())
        .collect();
    assert!(
        (numbers[0] - place.x_m).abs() < 1e-3 && (numbers[2] - place.altitude_m).abs() < 1e-2,
        "{row}"
    );
    let at = scenario.line.unwrap().axis.point(uav_relay::Placement {
        x_m: narrow(place.x_m),
        y_m: narrow(place.y_m),
        altitude_m: narrow(place.altitude_m),
    });
    let at = at.unwrap();
    assert!(
        (numbers[3] * 1e7 - f64::from(at.lat_e7)).abs() < 1.5,
        "{row}"
    );
    assert!(
        (numbers[4] * 1e7 - f64::from(at.lon_e7)).abs() < 1.5,
        "{row}"
    );
    assert!(
        summary.contains(&format!("--base-address 0x080E0000 relay{index}.bin\n")),
        "{summary}"
    );
}

#[test]
fn a_plan_is_written_to_every_block() {
    let folder = tempfile::tempdir().unwrap();
    let [file, key, dir] = ["plan.toml", "key.txt", "blocks"].map(|name| folder.path().join(name));
    let decibels = text(&example().with_file_name("decibels.toml"));
    let said = planned(&format!(
        "--scenario {decibels} --target-sir-db 8 --out {}",
        text(&file)
    ));
    let scenario = Scenario::load(&file).unwrap();
    let plan = scenario.plan.clone().unwrap();
    assert!(
        said.contains(&format!(
            "{} relays that agree on positions with",
            plan.uavs
        )),
        "{said}"
    );
    assert!(plan.sir_db >= 8.0, "{}", plan.sir_db);
    // The rest of the scenario is unchanged.
    let before = std::fs::read_to_string(&decibels).unwrap();
    assert!(std::fs::read_to_string(&file).unwrap().starts_with(&before));

    write_key(&key, &"0123456789abcdef".repeat(4));
    let command = said
        .lines()
        .last()
        .unwrap()
        .trim()
        .replace("DIR", &text(&dir));
    let words = command.strip_prefix("cargo provision ").unwrap();
    let more = format!("--network 9 --key-file {} --epoch 77", key.display());
    let output = provision(&format!("{words} {more}"));
    assert!(
        output.status.success() && output.stderr.is_empty(),
        "{output:?}"
    );
    let mut expected: BTreeSet<String> = (1..=plan.uavs)
        .map(|index| format!("relay{index}.bin"))
        .collect();
    expected.insert("summary.txt".to_owned());
    assert_eq!(names(&dir), expected);
    let summary = std::fs::read_to_string(dir.join("summary.txt")).unwrap();
    for index in 1..=plan.uavs {
        is_provisioned(&scenario, &dir, index, &summary);
    }
    assert!(!summary.contains("0123456789abcdef"));

    // Without --force existing blocks stay. With it all blocks of a larger flight are removed.
    let again = refusal(words);
    assert!(
        again.contains("relay1.bin exists already; --force"),
        "{again}"
    );
    let small = folder.path().join("small.toml");
    planned(&format!("--uavs 2 --out {}", small.display()));
    std::fs::write(dir.join("notes.txt"), "mine").unwrap();
    let output = provision(&format!(
        "--scenario {} --all --out-dir {} --force",
        small.display(),
        dir.display()
    ));
    assert!(output.status.success(), "{output:?}");
    let left = ["notes.txt", "relay1.bin", "relay2.bin", "summary.txt"].map(str::to_owned);
    assert_eq!(names(&dir), left.into());
}

#[test]
fn a_joint_plan_sets_the_joint_method() {
    let folder = tempfile::tempdir().unwrap();
    let [file, dir] = ["plan.toml", "blocks"].map(|name| text(&folder.path().join(name)));
    let altitudes = text(&example().with_file_name("altitudes.toml"));
    planned(&format!("--scenario {altitudes} --uavs 3 --out {file}"));
    let line = plan(&format!("--scenario {file} --uavs 4 --out {file}"));
    let line = String::from_utf8(line.stderr).unwrap();
    assert!(
        line.contains("exists already; --force overwrites it"),
        "{line}"
    );
    planned(&format!(
        "--scenario {file} --uavs 4 --altitude free --out {file} --force"
    ));
    let written = std::fs::read_to_string(&file).unwrap();
    assert_eq!(written.matches("[plan]").count(), 1, "{written}");
    let output = provision(&format!("--scenario {file} --all --out-dir {dir}"));
    assert!(output.status.success(), "{output:?}");
    let block: Block = std::fs::read(Path::new(&dir).join("relay4.bin"))
        .unwrap()
        .try_into()
        .unwrap();
    assert_eq!(reads(&block).unwrap().method, Method::Joint);
}

#[test]
fn all_or_none_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let dir = folder.path().join("blocks");
    // This block is refused: the field has more points than a block can hold.
    let points = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17]
        .map(|x| format!("{{ x_m = {x}, alpha = 3, beta = 2 }}"))
        .join(", ");
    let field = format!(
        "[geometry]\ndistance_m = 1000\naltitude_m = 20\n[power]\ntx_w = 80\nuav_w = 1\n[field]\ni_max_w = 1e-9\nbeta = [{points}]\n"
    );
    let file = folder.path().join("field.toml");
    std::fs::write(&file, field).unwrap();
    let wide = format!(
        "--scenario {} --uavs 3 --all --out-dir {}",
        file.display(),
        dir.display()
    );
    let line = refusal(&wide);
    assert!(
        line.contains("a drone's configuration block holds at most 16"),
        "{line}"
    );
    assert!(!dir.exists());
    // A folder named like a block cannot be replaced. Files that were renamed before are removed again.
    std::fs::create_dir_all(dir.join("relay2.bin/inside")).unwrap();
    let line = refusal(&format!(
        "--uavs 3 --all --out-dir {} --force",
        dir.display()
    ));
    assert!(
        line.starts_with("--out-dir ") && line.contains("relay2.bin"),
        "{line}"
    );
    assert_eq!(names(&dir), BTreeSet::from(["relay2.bin".to_owned()]));
}

#[test]
fn conflicting_options_are_reported_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let [file, old, dir] =
        ["plan.toml", "old.toml", "blocks"].map(|name| text(&folder.path().join(name)));
    planned(&format!("--uavs 3 --out {file}"));
    let written = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&old, written.replace("uav_w = 1.0 ", "uav_w = 2.0 ")).unwrap();
    let places = [
        (text(folder.path()), "FOLDER"),
        (text(example().parent().unwrap()), "EXAMPLES"),
    ];
    let mut lines = String::new();
    for case in [
        "--scenario FOLDER/plan.toml --uavs 4",
        "--scenario FOLDER/plan.toml --method joint",
        "--scenario FOLDER/plan.toml --tolerance 0.01",
        "--scenario FOLDER/old.toml",
        "",
        "--uavs 3 --index 1",
        "--uavs 3 --rounds 4",
        "--uavs 3 --explore 4",
        "--uavs 3 --stand-in",
        "--scenario EXAMPLES/scenario.toml --uavs 3",
        "--scenario EXAMPLES/multi_interferer.toml --uavs 8",
        "--uavs 3.5",
        "--uavs 3 --network x",
        "--uavs 3 --method algn",
        "--uavs 3 --epoch 4",
    ] {
        let mut options = format!("{case} --all --out-dir {dir}");
        for (place, name) in &places {
            options = options.replace(name, place);
        }
        let mut line = refusal(&options);
        for (place, name) in &places {
            line = line.replace(place, name);
        }
        write!(lines, "{case}\n    {line}").unwrap();
        assert!(!Path::new(&dir).exists(), "{case}");
    }
    insta::assert_snapshot!(lines);
    let line = refusal(&format!("--uavs 3 --index 1 --out {file} --force"));
    assert!(line.contains("--all"), "{line}");
}

/// Checks that a hypothetical interferer that costs too much SIR is refused.
///
/// The error states the loss compared with the planner's best positions.
#[test]
fn a_poor_hypothetical_interferer_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [out, dir] = ["block.bin", "blocks"].map(|name| text(&folder.path().join(name)));
    let several = text(&example().with_file_name("multi_interferer.toml"));
    let report = planned(&format!("--scenario {several} --uavs 8 --json"));
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let loss = report["hypothetical"]["loss"].as_f64().unwrap();
    assert!(loss > 0.15, "{report}");
    let words = format!("{:.1} % less, because", 100.0 * loss);
    let one = format!("--scenario {several} --uavs 8 --index 2 --out {out}");
    let line = refusal(&one);
    assert!(
        line.contains(&words) && line.contains("cargo chain --listen"),
        "{line}"
    );
    assert!(!Path::new(&out).exists());
    let planned = plan(&format!("--scenario {several} --uavs 8 --out {out}"));
    let line = String::from_utf8(planned.stderr).unwrap();
    assert!(
        planned.status.code() == Some(1) && line.contains(&words),
        "{line}"
    );
    assert!(!Path::new(&out).exists());
    for arguments in [
        &one[..],
        &format!("--scenario {several} --uavs 8 --all --out-dir {dir}"),
    ] {
        let output = provision(&format!("{arguments} --stand-in"));
        let line = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success() && line.contains(&words), "{line}");
    }
    // Two interferers close together cost nothing.
    let near = std::fs::read_to_string(&several).unwrap();
    let near = near
        .replace("x_m = 200.0", "x_m = 790.0")
        .replace("y_m = 300.0", "y_m = 150.0");
    let file = folder.path().join("near.toml");
    std::fs::write(&file, near).unwrap();
    let output = provision(&format!(
        "--scenario {} --uavs 8 --index 2 --out {out}",
        file.display()
    ));
    assert!(output.status.success(), "{output:?}");
}

/// Returns the text of `drone.toml` without the settings that the firmware does not support.
fn for_the_firmware(text: &str) -> String {
    let own = ["baud = 57600", "probe_after_ms", "dead_after_ms"];
    let kept = text
        .lines()
        .filter(|line| !own.iter().any(|key| line.starts_with(key)));
    kept.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_printed_next_command_accepts_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let [scenario, file, dir, key] =
        ["mine.toml", "plan.toml", "blocks", "network7.key"].map(|name| folder.path().join(name));
    let drone = std::fs::read_to_string(example().with_file_name("drone.toml")).unwrap();
    let [mine, planned_file] = [text(&scenario), text(&file)];
    std::fs::write(&scenario, &drone).unwrap();
    write_key(&key, &"0123456789abcdef".repeat(4));
    let arguments = format!("--scenario {mine} --uavs 3 --out {planned_file}");
    // The example in the repository is for Linux computers.
    let said = planned(&arguments);
    assert!(
        said.contains("network.baud = 57600: must be 115200"),
        "{said}"
    );
    assert!(
        said.ends_with(&format!(
            "  cargo companion --config {planned_file} --index INDEX\n"
        )),
        "{said}"
    );
    let line = refusal(&format!(
        "--scenario {planned_file} --all --out-dir {}",
        text(&dir)
    ));
    assert!(line.contains("network.baud = 57600"), "{line}");
    // For the firmware the last line is a command. It must succeed.
    std::fs::write(&scenario, for_the_firmware(&drone)).unwrap();
    let said = planned(&format!("{arguments} --force"));
    let command = said.lines().last().unwrap().trim();
    let command = command.replace("DIR", &text(&dir));
    let words = command.strip_prefix("cargo provision ").unwrap();
    let output = provision(words);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(names(&dir).len(), 4);
}

#[test]
fn a_plan_and_a_network_of_different_sizes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [scenario, file, dir] =
        ["mine.toml", "plan.toml", "blocks"].map(|name| text(&folder.path().join(name)));
    let drone = std::fs::read_to_string(example().with_file_name("drone.toml")).unwrap();
    let drone = for_the_firmware(&drone).replace("key_file", "# key_file");
    std::fs::write(&scenario, drone.replace("relays = 3", "relays = 4")).unwrap();
    let words =
        "network.relays = 4 contradicts plan.uavs; allowed: 6, the number of relays in [plan]";
    for wanted in ["--uavs 6", "--target-sir-db 3"] {
        let arguments = format!("--scenario {scenario} --out {file} {wanted}");
        let output = plan(&arguments);
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{line}");
        assert!(
            line.contains("network.relays = 4 contradicts plan.uavs; allowed: "),
            "{line}"
        );
        assert!(!Path::new(&file).exists());
    }
    // This file was edited by hand.
    planned(&format!("--scenario {scenario} --uavs 4 --out {file}"));
    let four = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&scenario, four.replace("relays = 4", "relays = 6")).unwrap();
    planned(&format!(
        "--scenario {scenario} --uavs 6 --out {file} --force"
    ));
    let six = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, six.replace("relays = 6", "relays = 4")).unwrap();
    for more in ["", "--uavs 6", "--uavs 4"] {
        let all = format!("--scenario {file} --all --out-dir {dir}");
        let line = refusal(&format!("{all} {more}"));
        assert!(line.contains(words), "{line}");
        assert!(!Path::new(&dir).exists());
    }
}
