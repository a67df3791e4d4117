//! Output and error messages of `cargo provision`.

use std::fmt::Write as _;
use std::path::Path;

use uav_relay::{Adjust, Measure, Method};
use uav_relay_scenario::Scenario;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::Block;

use super::{of_paper, paper, provision, reads, refusal};

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
fn the_command_writes_what_the_relay_is_to_do() {
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
fn what_is_wrong_is_said_in_one_line() {
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

/// A channel at the firmware's data rate carries 25 relays; more are refused with the numbers.
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
            "--baud {baud}: must be within {least} to 10000000: {in_range} relays share the channel at one place: it needs {least} bit/s, or --probe-after-ms {ms} with three times that for --dead-after-ms, or at most {most} relays in range; fewer with --in-range, none with --wires\n"
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
fn the_method_of_the_network_is_in_the_block_and_another_baud_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("relay.bin");
    let file = folder.path().join("chain.toml");
    let scenario = std::fs::read_to_string(super::example()).unwrap();
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
    let line = "--method align replaces network.method = \"joint\" of ";
    assert!(said.starts_with(line), "{said}");
    let others = network("id = 9\nrelays = 7\nprobe_after_ms = 5000\ndead_after_ms = 15000");
    let (_, said) = written(&others, "--network 3");
    let lines: Vec<&str> = said.lines().collect();
    assert!(
        lines[0].starts_with("--network 3 replaces network.id = 9 of "),
        "{said}"
    );
    assert!(
        lines[1].starts_with("--uavs 5 replaces network.relays = 7 of "),
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
    for (sections, words) in [
        (
            network("baud = 57600"),
            "network.baud = 57600: must be 115200, or left out: the firmware's ports run at that",
        ),
        (
            network("probe_after_ms = 1200001"),
            "network.probe_after_ms = 1200001: must be within 1 to 1200000",
        ),
        (
            network("probe_after_ms = 20000\ndead_after_ms = 15000"),
            "network.dead_after_ms = 15000: must be 60000, or left out: ",
        ),
        (
            network("dead_after_ms = 90000"),
            "network.dead_after_ms = 90000: must be 15000, or left out: ",
        ),
        (
            joint + &planned,
            "network.method = \"joint\": must be \"align\", as its [plan] has it",
        ),
    ] {
        let output = run(&sections, "");
        assert_eq!(output.status.code(), Some(2), "{sections}: {output:?}");
        let line = String::from_utf8(output.stderr).unwrap();
        assert_eq!(line.trim_end().lines().count(), 1, "{line}");
        assert!(line.contains(words), "{words} not in {line}");
    }
}

/// The firmware has no UDP, but a wrong address in a shared file is reported.
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
    let named = "companion.autopilot = \"udp:localhost:0\" has no PORT within 1 to 65535; allowed: a tty, or udp:HOST:PORT";
    assert!(line.contains(named), "{line}");
    assert!(!out.exists(), "nothing is written");
}
