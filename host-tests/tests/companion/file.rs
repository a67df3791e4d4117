//! Shared scenario file of `cargo plan`, the companion and the ground station, with their own sections.

use std::fmt::Write as _;
use std::path::Path;

use uav_relay::Method;
use uav_relay_scenario::deployment::{Deployment, NETWORK};
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::setup::Setup;

use crate::chain::{simulated, simulated_by, simulated_with};
use crate::files::{Files, status_of};
use crate::medium::{Medium, QUIET};
use crate::process::Relay;

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

fn start(file: impl AsRef<Path>, more: &str) -> Relay {
    Relay::start(&format!("--config {} {more}", file.as_ref().display()))
}

#[test]
fn three_relays_with_one_file_settle_like_the_simulation() {
    let folder = Files::new();
    let channel = Medium::new(3, QUIET);
    let text = format!(
        "{SCENARIO}\n[network]\nid = 4711\nrelays = 3\nbaud = 57600\n[companion]\nshared = \"{}\"\n",
        channel.tty(0)
    );
    let file = folder.write("drone.toml", text);
    let scenario = Scenario::load(Path::new(&file)).unwrap();
    assert_eq!(
        Deployment::load(Path::new(&file)).unwrap().1.network.id,
        Some(4711)
    );
    let place = |tty| format!("--index {} --shared {}", tty + 1, channel.tty(tty));
    let mut relays = [0, 1, 2].map(|tty| start(&file, &place(tty)));
    for relay in &mut relays {
        let line = relay.line("started: ");
        assert!(
            line.contains(", network 4711, ") && line.contains(", 57600 bit/s"),
            "{line}"
        );
    }
    let settled = relays.each_mut().map(Relay::settled);
    assert_eq!(settled[..], simulated(&scenario, 3));
    assert_ne!(settled[..], simulated(&Scenario::default(), 3));
}

/// Checks that relays use the fitted slots and the fixed altitudes that a scenario file demands.
///
/// Fitted slots are time slots as long as each hop needs. The joint method has the two names `joint` and `altitude`;
/// the test uses both.
#[test]
fn fitted_slots_and_fixed_altitudes_of_a_file_are_flown() {
    let folder = Files::new();
    let own = "[[relay]]\nindex = 2\naltitude_m = 30.0\n";
    let text = format!("{SCENARIO}\n[link]\naccess = \"fitted\"\n{own}");
    let file = folder.write("fitted.toml", text);
    let scenario = Scenario::load(Path::new(&file)).unwrap();
    let (mission, profiles) = mission::mission(&scenario, 2, 1e-4).unwrap();
    let mut setup = Setup {
        profiles,
        held: mission::fixed_altitude_relays(&scenario, 2),
        ..Setup::new(mission::with_access(&scenario, &mission).unwrap())
    };
    setup.settings.method = Method::Joint;
    let agreed = run(setup.clone()).unwrap();
    let expected = simulated_with(setup);
    assert_eq!(f32::from_bits(expected[1][2]), 30.0);
    assert_ne!(expected, simulated_by(Method::Joint, &scenario, 2));
    for name in ["joint", "altitude"] {
        let channel = Medium::new(2, QUIET);
        let mut relays = [0, 1].map(|tty| {
            let place = format!("--index {} --of 2 --shared {}", tty + 1, channel.tty(tty));
            let socket = folder.text(&format!("status{tty}"));
            start(
                &file,
                &format!("{place} --method {name} --status-socket {socket}"),
            )
        });
        for (tty, (relay, place)) in relays.iter_mut().zip(&expected).enumerate() {
            relay.settles_at(*place);
            let slots = agreed.relays[tty].slot_shares.unwrap();
            let line = relay.line("slots: ");
            for bound in [slots.from_tx, slots.to_rx].as_flattened() {
                let exact = format!("{bound:.6} (0x{:08x})", bound.to_bits());
                assert!(line.contains(&exact), "{exact} {line}");
            }
            assert!(!line.contains("from Rx"), "one direction: {line}");
            let status = status_of(folder.path(&format!("status{tty}")));
            for (key, slot) in [
                ("from_tx", slots.from_tx),
                ("to_rx", slots.to_rx),
                ("to_tx", [1.0; 2]),
            ] {
                let shown = status["relay"]["slots"][key].clone();
                let shown: [f32; 2] = serde_json::from_value(shown).unwrap();
                assert_eq!(shown, slot, "{status}");
            }
        }
    }
}

/// Checks that all programs read the same mission from a scenario file.
///
/// The digests of the missions are compared.
#[test]
fn each_kind_of_scenario_is_the_mission_of_the_other_tools() {
    let folder = Files::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for name in "scenario altitudes side field multi_interferer site".split(' ') {
        let file = root.join(format!("examples/{name}.toml"));
        let scenario = Scenario::load(Path::new(&file)).unwrap();
        let (mission, _) = mission::mission(&scenario, 1, 1e-4).unwrap();
        let digest = uav_relay::wire::digest::digest(&mission);
        let mut relay = start(&file, "--index 1 --of 1");
        let line = relay.line("started: ");
        let expected = format!("relay 1 of 1, network {NETWORK}, mission digest 0x{digest:04x}, ");
        assert!(line.contains(&expected), "{name}: {expected} not in {line}");
    }
    let other = folder.write("other.toml", SCENARIO);
    let line = start(&other, "--index 1 --of 1 --altitude 23").line("started: ");
    let alone = start(&other, "--index 1 --of 1").line("started: ");
    let digest = |line: &str| line.split("mission digest ").nth(1).unwrap()[..6].to_owned();
    assert_ne!(digest(&line), digest(&alone), "the command line counts");
}

#[test]
fn errors_of_the_file_are_named() {
    let folder = Files::new();
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
        "[fleet]\nflying = 2",
        "[network]\nrelays = 4\n[fleet]\nflying = 2",
        "[network]\nrelays = 3\n[fleet]\nflying = 2\n[companion]\nupstream = \"a\"",
    ] {
        let file = folder.write("drone.toml", format!("{SCENARIO}\n{sections}\n"));
        let line = start(&file, "--index 1 --of 1").refused(2);
        // Programs that do not use the sections check them as well, except for options that need another one.
        let checked = Scenario::load(Path::new(&file)).is_err();
        let needs = line.contains(": needs companion.autopilot");
        assert_eq!(checked, !needs, "{sections}");
        let line = line.replace(folder.text("").trim_end_matches('/'), "FOLDER");
        writeln!(all, "{sections}\n    {line}").unwrap();
    }
    insta::assert_snapshot!(all);
    for (file, why) in [("nowhere.toml", "no such file"), ("", "is a directory")] {
        let line = start(folder.path(file), "--index 1 --of 1").refused(2);
        assert!(
            line.starts_with("--config ") && line.contains(why),
            "{line}"
        );
    }
}

/// Checks that options override the file, and that the log reports each overridden value once.
#[test]
fn overrides_by_the_command_line_are_logged_once() {
    let folder = Files::new();
    let sections =
        "[network]\nid = 4711\nrelays = 1\nbaud = 57600\n[companion]\nupstream = \"away\"\n";
    let file = folder.write("drone.toml", format!("{SCENARIO}\n{sections}"));
    let channel = Medium::new(1, QUIET);
    let said = |more: &str| -> Vec<String> {
        let shared = format!("--shared {}", channel.tty(0));
        let mut said = overrides(start(&file, &format!("--index 1 {shared} {more}")));
        let last = said.pop().unwrap();
        assert!(
            last.starts_with(&format!("{shared} is used instead of --upstream ")),
            "{last}"
        );
        said.sort();
        said
    };
    assert_eq!(
        said("--altitude 23 --network=12 --interferer 80,1,2"),
        [
            format!("--altitude 23 is used instead of the value 33.3 in {file}"),
            format!("--interferer 80,1,2 is used instead of the value 55.5,987.6,-321 in {file}"),
            format!("--network 12 is used instead of the value 4711 in {file}"),
        ]
    );
    // The same number in another notation is no difference, and neither is a value that the file lacks.
    let same = "--altitude 33.30 --network 4711 --baud=57600 --interferer 55.50,987.6,-321.0";
    assert_eq!(said(&format!("{same} --dead-after-ms 20000")), [""; 0]);

    let field = "[geometry]\ndistance_m = 1000.0\naltitude_m = 20.0\n[power]\ntx_w = 80.0\nuav_w = 1.0\n\
        [field]\ni_max_w = 2e-10\n[[field.beta]]\nx_m = 0.0\nalpha = 2.0\nbeta = 1.5\n\
        [network]\nrelays = 1\n";
    let field = folder.write("field.toml", field);
    let alone = "--index 1 --interferer 80,500,400 --altitude 25";
    let mut said = overrides(start(&field, alone));
    said.sort();
    assert_eq!(
        said,
        [
            format!("--altitude 25 is used instead of the value 20 in {field}"),
            format!("--interferer 80,500,400 is used instead of the section [field] in {field}"),
        ]
    );

    // An option for all relays cannot override a value that the file has for one relay.
    let own = format!("{SCENARIO}\n[[relay]]\nindex = 1\npower_w = 0.5\n");
    let own = folder.write("own.toml", own);
    for (index, status) in [(1, 2), (2, 1)] {
        let more = format!("--index {index} --of 2 --shared /nowhere --altitude 23");
        let refused = start(&own, &more).refused(status);
        let line =
            "--altitude 23: has no effect, because the --config file has a [[relay]] for relay 1";
        assert_eq!(refused.starts_with(line), status == 2, "{refused}");
    }
}

/// Stops a relay. Returns the values of the scenario file that options have replaced, from the relay's log.
fn overrides(mut relay: Relay) -> Vec<String> {
    relay.line("unguarded: ");
    let lines = relay.stopped().into_iter();
    lines
        .filter_map(|line| Some(line.split_once("  override: ")?.1.to_owned()))
        .collect()
}
