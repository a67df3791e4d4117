//! Bundles of `cargo provision --bundle`: checks before flight, planted faults, a flight.

use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use host_tests::python;
use uav_relay_scenario::Scenario;

use crate::bench::with_socat;
use crate::binary::{companion, ground, plan, provision};
use crate::chain::{Chain, QUICK, simulated};
use crate::files::Files;
use crate::medium::{Medium, Noise, QUIET};
use crate::peer::{Peer, RX, ReceivedMessage, apart_m, distance_to_m, on_earth};
use crate::process::{Relay, bits};

/// Text in the udev rules of a new bundle.
const FILL_IN: &str = "FILL-IN-SERIAL-NUMBER";

/// Planned positions of three relays, m along the line.
const PLACES: [f64; 3] = [343.5, 380.9, 417.4];

/// Returns the scenario of `examples/drone.toml` without ports and files, and with short timeouts.
fn scenario() -> String {
    let example = include_str!("../../../examples/drone.toml");
    let text = example.split("[companion]").next().unwrap();
    text.replace("key_file = \"network7.key\"", "")
        .replace("probe_after_ms = 30000", "probe_after_ms = 1000")
        .replace("dead_after_ms = 90000", "dead_after_ms = 3000")
}

/// Runs `cargo provision` with the scenario `text` and `more` options. It writes a bundle (a folder for each computer) to the folder `out`.
fn bundle(files: &Files, text: &str, more: &str) -> Output {
    let scenario = files.write("scenario.toml", text);
    let mut command = Command::new(provision());
    command.args(["--scenario", &scenario, "--bundle", &files.text("out")]);
    command.args(more.split_whitespace()).output().unwrap()
}

/// Test setup: three relays and a ground station on one channel.
///
/// Each of them has its own folder of the bundle.
struct Bench {
    files: Files,
    channel: Medium,
    drones: Vec<Peer>,
}

impl Bench {
    /// Creates the bundle. Then fills in serial numbers and loads the autopilot parameters.
    fn new() -> Self {
        let files = Files::new();
        let made = bundle(&files, &scenario(), "");
        assert!(made.status.success(), "{made:?}");
        let channel = Medium::new(6, QUIET);
        let mut bench = Self {
            files,
            channel,
            drones: Vec::new(),
        };
        for index in 1..=3 {
            let port = bench.channel.tty(index - 1).to_owned();
            bench.installs(&format!("relay{index}/drone.toml"), &port);
            let kind = ["px4", "arducopter"][(index + 1) % 2];
            let link = bench.files.text(&format!("autopilot{index}"));
            let mut drone = Peer::autopilot(kind, &link, PLACES[index - 1] - 20.0, None);
            let file = if kind == "px4" {
                "px4.params"
            } else {
                "ardupilot.parm"
            };
            drone.order(&format!(
                "params {}",
                bench.path(&format!("relay{index}/{file}")).display()
            ));
            bench.drones.push(drone);
        }
        let port = bench.channel.tty(3).to_owned();
        bench.installs("ground/ground.toml", &port);
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.files.path("out").join(name)
    }

    /// Replaces the paths in the file `config` by those of this test. Fills in the radio's serial number.
    fn installs(&self, config: &str, port: &str) {
        let (path, folder) = (self.path(config), self.path(config));
        let folder = folder.parent().unwrap();
        let own = folder.file_name().unwrap().to_str().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains("/dev/uav-relay-shared") && text.contains("/var/lib/uav-relay/"));
        let text = text
            .replace("/dev/uav-relay-shared", port)
            .replace(
                "/dev/ttyAMA0",
                &self.files.text(&own.replace("relay", "autopilot")),
            )
            .replace("/var/lib/uav-relay", folder.to_str().unwrap());
        std::fs::write(&path, text).unwrap();
        self.rules(own, FILL_IN, "A50285BI");
    }

    fn rules(&self, folder: &str, before: &str, after: &str) {
        let path = self.path(&format!("{folder}/70-uav-relay.rules"));
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(&format!(
            "ENV{{ID_SERIAL_SHORT}}==\"{before}\", SYMLINK+=\"uav-relay-shared\""
        )));
        let text = text.replace(&format!("\"{before}\""), &format!("\"{after}\""));
        std::fs::write(path, text).unwrap();
    }

    /// Starts the companion of relay `index` with the configuration file in its folder and `more` options.
    fn companion(&self, index: usize, more: &str) -> Relay {
        let config = self.path(&format!("relay{index}/drone.toml"));
        Relay::start(&format!("--config {} {more}", config.display()))
    }

    /// Starts relays 1 and 3, which run while the test checks relay 2.
    fn neighbours(&self) -> [Relay; 2] {
        let mut relays = [1, 3].map(|index| self.companion(index, ""));
        for relay in &mut relays {
            relay.line("started: ");
        }
        relays
    }

    /// Runs `--check` for relay 2 and returns the lines of failed checks, which begin with `red`.
    ///
    /// Panics if the exit status contradicts these lines.
    fn reds(&self, more: &str, seconds: u64) -> Vec<String> {
        let ended = self
            .companion(2, &format!("--check={seconds} {more}"))
            .end();
        let mut lines = ended.stdout;
        lines.retain(|line| line.starts_with("red "));
        assert!(
            ended.stderr.is_empty() || lines.is_empty(),
            "{:?}",
            ended.stderr
        );
        assert_eq!(
            ended.status,
            Some(i32::from(!lines.is_empty())),
            "{:?} {lines:?}",
            ended.stderr
        );
        lines
    }

    /// Checks that the check of relay 2 reports exactly the failures that contain `parts`, in this order.
    fn finds(&self, more: &str, parts: &[&str]) {
        let reds = self.reds(more, 4);
        println!("{more}: {reds:#?}");
        assert_eq!(reds.len(), parts.len(), "{more}: {reds:#?}");
        for (red, part) in reds.iter().zip(parts) {
            assert!(red.contains(part), "{more}: {part} not in {red}");
        }
    }
}

#[test]
fn a_bundle_is_green_and_its_relays_agree() {
    let mut bench = Bench::new();
    let checks = [1, 2, 3].map(|index| bench.companion(index, "--check=30"));
    for check in checks {
        let lines = check.succeeds();
        println!("{}", lines.join("\n"));
        assert!(lines.last().unwrap().ends_with("lines are green"));
        assert!(
            lines.iter().any(|line| line.contains("as in ")),
            "{lines:#?}"
        );
    }
    for drone in &mut bench.drones {
        let asked = drone.so_far();
        assert!(asked.iter().any(|it| it.is("PARAM_REQUEST_READ")));
        let moves = [
            "SET_POSITION_TARGET_GLOBAL_INT",
            "SET_POSITION_TARGET_LOCAL_NED",
            "SET_MODE",
        ];
        assert!(!asked.iter().any(|it| moves.iter().any(|name| it.is(name))));
        assert!(
            asked
                .iter()
                .all(|it| !it.is("COMMAND_LONG") || it.requested_interval().is_some())
        );
    }
    for index in 1..=3 {
        assert!(
            !bench.path(&format!("relay{index}/views")).exists(),
            "it has not voted"
        );
    }

    let mut relays = [1, 2, 3].map(|index| bench.companion(index, ""));
    let scenario = Scenario {
        distance_m: distance_to_m(RX),
        ..Scenario::default()
    };
    // A guarded relay has no setpoint before its drone is engaged.
    for (relay, place) in relays.iter_mut().zip(simulated(&scenario, 3)) {
        assert_eq!(bits(&relay.line("converged: "))[0], place[3]);
    }

    let ground = bench.path("ground/ground.toml");
    let check = |limit| Relay::ground(&format!("--config {} --check={limit}", ground.display()));
    let rows = check(60).succeeds();
    println!("{}", rows.join("\n"));
    for (row, neighbours) in rows
        .iter()
        .skip(rows.len() - 3)
        .zip(["-, 2", "1, 3", "2, -"])
    {
        assert!(
            row.contains("green") && row.contains("Grounded") && row.contains(neighbours),
            "{row}"
        );
    }
    bench.drones[1].order("lose");
    bench.drones[2].order("mute");
    let (rows, line) = check(15).fails(1);
    println!("{}", rows.join("\n"));
    assert_eq!(line, "2 of 3 relays are red: do not fly");
    for (row, fault) in
        rows.iter()
            .skip(rows.len() - 3)
            .zip(["green", "no position", "autopilot silent"])
    {
        assert!(row.contains(fault), "{row}");
    }

    let upload = "--version 1 --new-interferer 80,520,400 --yes";
    Relay::ground(&format!("--config {} {upload}", ground.display())).succeeds();

    // A relay that is gone does not report.
    drop(relays);
    let (rows, _) = check(5).fails(1);
    assert_eq!(
        rows.iter().filter(|row| row.contains("no report")).count(),
        3,
        "{rows:#?}"
    );
    let reds = bench.reds("", 1);
    for part in [
        "has votes of an earlier flight; remove it",
        "has version 1 of an earlier flight",
    ] {
        assert!(reds.iter().any(|it| it.contains(part)), "{part}: {reds:#?}");
    }
}

/// Checks that each drone flies to the position that is stated on the page in its folder of the bundle.
#[test]
fn every_folder_of_a_bundle_flies() {
    let mut bench = Bench::new();
    let mut relays = [1, 2, 3].map(|index| bench.companion(index, ""));
    for (relay, drone) in relays.iter_mut().zip(&mut bench.drones) {
        relay.wait_for("autopilot: on the ground, or not armed");
        relay.wait_for("converged: ");
        drone.takes_off();
    }
    for (index, (relay, drone)) in (1..).zip(relays.iter_mut().zip(&mut bench.drones)) {
        relay.line("autopilot: ready");
        // A PX4 accepts the mode only while targets are streamed.
        if index != 2 {
            drone.receive(ReceivedMessage::is_target);
        }
        drone.order("mode companion");
        relay.line("autopilot: setpoint control engaged");
    }
    for (index, (relay, drone)) in (1..).zip(relays.iter_mut().zip(&bench.drones)) {
        relay.line("arrived: ");
        let config = bench.path(&format!("relay{index}/drone.toml"));
        let plan = Scenario::load(&config).unwrap().plan.unwrap();
        let place = &plan.places[index - 1];
        let page = bench.path(&format!("relay{index}/page.txt"));
        let page = std::fs::read_to_string(page).unwrap();
        let line = format!("place: x {:.1} m, y 0.0 m, altitude 20.0 m", place.x_m);
        assert!(page.contains(&line), "{line}: {page}");
        let goal = on_earth(place.x_m, place.altitude_m);
        let is_there = |heard: &ReceivedMessage| heard.is_any() && apart_m(heard.own(), goal) < 1.0;
        assert_eq!(drone.receive(is_there).mode(), "companion");
    }
}

/// Checks that `--check` fails while other relays of the chain fly, and does not disturb these relays.
#[test]
fn a_check_does_not_disturb_a_chain_that_flies() {
    let mut bench = Bench::new();
    let mut relays = bench.neighbours();
    for (relay, at) in relays.iter_mut().zip([0, 2]) {
        let drone = &mut bench.drones[at];
        relay.line("autopilot: on the ground, or not armed");
        relay.line("converged: ");
        drone.takes_off();
        relay.line("autopilot: ready");
        drone.receive(ReceivedMessage::is_target);
    }
    for (relay, at) in relays.iter_mut().zip([0, 2]) {
        bench.drones[at].order("mode companion");
        relay.line("autopilot: setpoint control engaged");
    }
    let refuses = |relays: &mut [Relay; 2]| {
        let reds = bench.reds("", 8);
        let part = "red    chain       the chain is possibly in flight: these relays were received, and did not report that their drones are on the ground: 1, 3";
        assert!(reds.iter().any(|it| it.starts_with(part)), "{reds:#?}");
        for relay in relays {
            let lines = relay.lines_with("");
            let is_change = |line: &&String| {
                ["view", "relay 2", "chain has", "converged"]
                    .iter()
                    .any(|part| line.contains(part))
            };
            // A neighbour may tell the checking relay once that it is free: it is outside of the chain.
            let (told, others): (Vec<_>, Vec<_>) =
                lines.iter().partition(|line| line.contains("  told: "));
            assert!(
                told.len() <= 1 && !others.iter().any(is_change),
                "{lines:#?}"
            );
        }
    };
    // Their first positions under setpoint control count after some seconds. Then they are on their way, and later at their places.
    for seconds in [6, 15] {
        std::thread::sleep(Duration::from_secs(seconds));
        for relay in &mut relays {
            relay.lines_with("");
        }
        refuses(&mut relays);
    }
}

/// Checks that `--check` reports a failure if a neighbour falls silent during the check.
#[test]
fn a_neighbour_that_falls_silent_is_red() {
    let mut bench = Bench::new();
    bench.drones[1].order("lose");
    let [first, _third] = bench.neighbours();
    let check = bench.companion(2, "--check=20");
    // Both are heard by then.
    std::thread::sleep(Duration::from_secs(9));
    drop(first);
    let lines = check.end().stdout;
    println!("{}", lines.join("\n"));
    let is = |part: &str| lines.iter().any(|it| it.contains(part));
    assert!(
        is("relay 1: no frame received for 10 s") && is("relay 3: both relays receive each other")
    );
}

#[test]
fn a_check_names_planted_faults_of_the_computer() {
    let bench = Bench::new();
    let statics = |more: &str, parts: &[&str]| {
        let mut reds = bench.reds(more, 1);
        reds.retain(|line| {
            !["neighbour ", "autopilot", "position"]
                .iter()
                .any(|it| line.contains(&format!("red    {it}")))
                && !line.contains("parameters")
        });
        println!("{more}: {reds:#?}");
        assert_eq!(reds.len(), parts.len(), "{more}: {reds:#?}");
        for (red, part) in reds.iter().zip(parts) {
            assert!(red.contains(part), "{more}: {part} not in {red}");
        }
    };
    statics(
        "--shared /dev/nowhere",
        &[
            "port        --shared /dev/nowhere: there is no such device",
            "neighbours  not checked: a port",
        ],
    );
    let missing = bench.files.text("missing/epoch");
    statics(
        &format!("--epoch-file {missing}"),
        &[
            "disk        --epoch-file",
            "epoch       --epoch-file",
            "neighbours  not checked: without an epoch",
        ],
    );
    statics(
        "--log-file /dev/full",
        &["disk        --log-file /dev/full: cannot be written: No space left"],
    );
    statics(
        "--capture /proc/frames",
        &["disk        --capture /proc/frames: cannot be written"],
    );
    let folder = bench.files.text("folder");
    std::fs::create_dir(&folder).unwrap();
    statics(&format!("--log-file {folder}"), &["disk        --log-file"]);
    if rustix::process::geteuid().is_root() {
        std::os::unix::fs::chown(&folder, Some(4_321), None).unwrap();
        statics(
            &format!("--log-file {folder}/log"),
            &["belongs to user 4321: run the check as that user"],
        );
    }
    let views = bench.files.text("views-of-another-mission");
    let mut other = bench.companion(
        2,
        &format!("--altitude 21 --view-file {views} --upload-file {views}-m"),
    );
    other.line("started: ");
    other.stopped();
    statics(
        &format!("--view-file {views}"),
        &["votes       --view-file"],
    );
    let upload = bench.files.write("upload", "damaged");
    statics(
        &format!("--upload-file {upload}"),
        &["the file is damaged, or not an uploaded mission"],
    );
    bench.rules("relay2", "A50285BI", FILL_IN);
    statics(
        "",
        &["70-uav-relay.rules:4: FILL-IN-SERIAL-NUMBER is not replaced"],
    );
    bench.rules("relay2", FILL_IN, "A50285BI");
    statics("", &[]);
    let other_port = Relay::start(&format!(
        "--index 1 --of 1 --upstream {}",
        bench.channel.tty(4)
    ));
    std::thread::sleep(Duration::from_millis(300));
    statics(
        &format!("--shared {}", bench.channel.tty(4)),
        &["is already in use", "neighbours  not checked"],
    );
    drop(other_port);
    let key = bench.path("relay2/network.key");
    std::fs::set_permissions(key, std::fs::Permissions::from_mode(0o644)).unwrap();
    let line = bench.companion(2, "--check=1").refused(2);
    assert!(line.contains("has the mode 0644"), "{line}");
}

#[test]
fn a_check_names_planted_faults_of_the_autopilot() {
    let mut bench = Bench::new();
    let _relays = bench.neighbours();
    bench.finds("", &[]);
    let parameters = bench.path("relay2/ardupilot.parm");
    let mut with = |orders: &[&str], parts: &[&str], back: &[&str], more: &str| {
        for order in orders {
            bench.drones[1].order(order);
        }
        bench.finds(more, parts);
        for order in back {
            bench.drones[1].order(order);
        }
    };
    // Nothing is sent to the neighbours before the autopilot says that the drone is disarmed.
    let [upstream, downstream] =
        [1, 3].map(|node| format!("relay {node} is received, but sends nothing"));
    let (upstream, downstream) = (upstream.as_str(), downstream.as_str());
    with(
        &["mute"],
        &["autopilot   --autopilot", upstream, downstream],
        &["speak"],
        "",
    );
    with(
        &["stranger"],
        &[
            "no frame is from a PX4 or an ArduCopter",
            upstream,
            downstream,
        ],
        &["vehicle"],
        "",
    );
    with(
        &[
            "mode companion",
            "lose",
            "param FENCE_ACTION 1",
            "param FENCE_TYPE",
            "param SYSID_THISMAV 9",
        ],
        &[
            "MAVLink system 9, but the parameter file of this relay has system 2: is this the right drone?",
            "mode        the mode is OFFBOARD or GUIDED",
            "position    the autopilot reports no position",
            "parameters  FENCE_ACTION is 1 instead of 4, SYSID_THISMAV is 9 instead of 2, FENCE_TYPE is not reported by the autopilot; see ",
        ],
        &[
            "find",
            "param FENCE_ACTION 4",
            "param FENCE_TYPE 3",
            "param SYSID_THISMAV 2",
            "mode rtl",
        ],
        "",
    );
    with(
        &["mode pilot", "system 9"],
        &["MAVLink system 9, but its parameter SYSID_THISMAV is 2: restart the autopilot"],
        &["system 2"],
        "",
    );
    let file = parameters.display();
    with(&[&format!("params {file} 4.7")], &[], &["mode rtl"], "");
    let far = "20 m from its planned place, more than 10 m";
    with(
        &[],
        &[
            "mode        in flight mode 6 the drone returns or lands",
            far,
        ],
        &["mode pilot"],
        "--start-within 10",
    );
    bench.drones[1].order("arm");
    let reds = bench.reds("", 3);
    assert!(
        reds.iter().any(|it| it.contains("armed or in the air")),
        "{reds:#?}"
    );
}

#[test]
fn a_check_names_planted_faults_of_the_radio() {
    let bench = Bench::new();
    let relays = bench.neighbours();
    bench.finds("", &[]);
    bench.finds(
        "--network 8",
        &[
            "relay 1 is in network 7, this relay in 8",
            "relay 3 is in network 7, this",
        ],
    );
    bench.finds(
        "--altitude 21",
        &[
            "relay 1 has another mission, digest 0x",
            "relay 3 has another mission, digest 0x",
        ],
    );
    let other = format!("--key-file {}", bench.files.text("other"));
    // Its neighbours may send nothing to it, so that the key is one of two causes.
    bench.finds(&other, &["another key"; 2]);
    drop(relays);
    // A neighbour that is checked, too.
    let third = || bench.companion(3, "--check=6 --altitude 21");
    let checked = [bench.companion(1, "--check=6"), third()];
    bench.finds("", &["relay 3 has another mission, digest 0x"]);
    drop(checked);
    let checked = [bench.companion(1, "--check=6"), third()];
    bench.channel.cut(0b010);
    bench.finds(
        "",
        &[
            "relay 1 is received, but does not receive this relay",
            "relay 3 ",
        ],
    );
    drop(checked);
    bench.channel.cut(0);
    let mut relays = bench.neighbours();
    bench.finds("", &[]);
    bench.channel.cut(0b001);
    bench.finds("", &["relay 1: no frame received"]);
    bench.channel.cut(0);
    for relay in &mut relays {
        assert!(
            !relay.has_printed("the chain has 3 relays"),
            "a view with a relay that is only checked"
        );
    }
    let twin = bench.companion(
        2,
        &format!(
            "--shared {} --epoch-file {} --view-file {}",
            bench.channel.tty(5),
            bench.files.text("twin"),
            bench.files.text("twin-views")
        ),
    );
    std::thread::sleep(Duration::from_secs(2));
    let reds = bench.reds("", 5);
    assert!(
        reds.iter()
            .any(|it| it.contains("another relay with number 2 was received")),
        "{reds:#?}"
    );
    drop((twin, relays));
    // At another data rate no frame is whole.
    let (loss, corrupt, seed) = (0.0, 0.3, 1);
    let noisy = Medium::new(
        3,
        Noise {
            loss,
            corrupt,
            seed,
        },
    );
    let port = |index: usize| format!("--shared {}", noisy.tty(index - 1));
    let _relays = [1, 3].map(|index| bench.companion(index, &port(index)));
    let damaged = "check that both ends have the data rate 57600 bit/s";
    bench.finds(&port(2), &[damaged; 2]);
}

/// Checks that `--check` of a relay on two wires succeeds.
///
/// The relay's running neighbours must not form a membership view with it.
#[test]
fn a_relay_on_wires_is_checked() {
    let chain = Chain::on_wires(3, QUIET).with(QUICK);
    let start = |index: usize, more: &str| {
        let signed = chain.files.signed("key", &format!("epoch{index}"));
        chain.relay(index, &format!("{signed} {more}"))
    };
    let mut relays = [start(1, ""), start(3, "")];
    let reds = start(2, "--check=1").end().stdout;
    let part = "autopilot   no autopilot is configured: give --autopilot, or --no-autopilot";
    assert!(reds.iter().any(|it| it.contains(part)), "{reds:#?}");
    let lines = start(2, "--check=20 --no-autopilot").succeeds();
    println!("{}", lines.join("\n"));
    assert_eq!(
        lines
            .iter()
            .filter(|it| it.contains("both relays receive each other"))
            .count(),
        2
    );
    for relay in &mut relays {
        assert!(!relay.has_printed("converged: "));
    }
}

/// Checks that `cargo provision --bundle` refuses any other tolerance than that of the companions.
///
/// With another tolerance the positions in the bundle would differ from those to which the companions fly.
#[test]
fn a_bundle_has_the_tolerance_of_the_companions() {
    let files = Files::new();
    let refused = |text: &str, more: &str, part: &str| {
        let output = bundle(&files, text, more);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success() && said.contains(part), "{said}");
        assert!(!files.path("out").exists());
    };
    let part = "--tolerance = 0.05: must be 0.0001 with --bundle";
    refused(&scenario(), "--tolerance 0.05", part);
    let scenario = files.write("coarse.toml", scenario());
    let out = files.text("plan.toml");
    let mut planned = Command::new(plan());
    planned.args(["--uavs", "3", "--tolerance", "0.05", "--scenario"]);
    let made = planned.args([&scenario, "--out", &out]).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    let planned = std::fs::read_to_string(out).unwrap();
    let part = "scenario.toml: plan.tolerance = 0.05: must be 0.0001 with --bundle";
    refused(&planned, "", part);
}

#[test]
fn a_bundle_is_written_whole_or_not_at_all() {
    let files = Files::new();
    let made = bundle(&files, &scenario(), "--index 2");
    let said = format!("{made:?}");
    let key = std::fs::read_to_string(files.path("out/relay2/network.key")).unwrap();
    assert!(
        made.status.success() && key.len() == 64 && !said.contains(&key),
        "{said}"
    );
    for (file, mode) in [
        ("network.key", 0o600),
        ("install.sh", 0o755),
        ("drone.toml", 0o644),
    ] {
        let about = files.path("out/relay2").join(file).metadata().unwrap();
        assert_eq!(about.permissions().mode() & 0o777, mode, "{file}");
    }
    assert!(!files.path("out/relay1").exists() && files.path("out/ground/page.txt").exists());
    // Nothing is installed before the serial numbers are filled in.
    let mut install = Command::new("sh");
    let installed = install
        .arg(files.path("out/relay2/install.sh"))
        .output()
        .unwrap();
    let said = String::from_utf8(installed.stdout).unwrap();
    assert!(
        !installed.status.success()
            && said.contains(":4:SUBSYSTEM")
            && said.contains("replace FILL-IN"),
        "{said}"
    );
    let refused = |text: &str, more: &str, part: &str| {
        let output = bundle(&files, text, more);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(
            !output.status.success() && said.contains(part),
            "{part} not in {said}"
        );
        assert!(output.stdout.is_empty(), "{:?}", output.stdout);
    };
    refused(
        &scenario(),
        "",
        "exists already, and a bundle is never overwritten",
    );
    assert_eq!(
        std::fs::read_to_string(files.path("out/relay2/network.key")).unwrap(),
        key
    );
    std::fs::remove_dir_all(files.path("out")).unwrap();
    refused(
        &scenario(),
        "--key-file nowhere.key",
        "--key-file nowhere.key: cannot be read",
    );
    let nowhere = files.text("nowhere/out");
    let output = Command::new(provision())
        .args([
            "--scenario",
            &files.text("scenario.toml"),
            "--bundle",
            &nowhere,
        ])
        .output()
        .unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("nowhere: No such file"), "{said}");
    for (section, line) in [
        ("companion", "log_file = \"/var/log/relay\""),
        ("companion", "positions = \"fifo\""),
        ("ground", "capture = \"/tmp/frames\""),
        ("ground", "measurements = \"noise\""),
    ] {
        let text = format!("{}\n[{section}]\n{line}\n", scenario());
        refused(&text, "", &format!("{section}.{line}: "));
    }
    let high = scenario().replace("altitude_m = 20.0", "altitude_m = 980.0");
    refused(&high, "", "FENCE_ALT_MAX would be");
    let unsited = scenario().replace("[site]", "[geometry.site]");
    refused(&unsited, "", "site");
    let left: Vec<_> = std::fs::read_dir(files.path(""))
        .unwrap()
        .flatten()
        .map(|it| it.file_name())
        .collect();
    assert!(
        !left
            .iter()
            .any(|name| name.to_string_lossy().contains("bundle")),
        "{left:?}"
    );
}

/// Checks that the commands of `examples/FIRST_FLIGHT.md` lead to six relays that agree.
#[test]
fn first_flight() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let page = include_str!("../../../examples/FIRST_FLIGHT.md");
    let blocks = page.split("```bash tested\n").skip(1);
    let mut script: String = blocks
        .map(|block| block.split("```").next().unwrap())
        .collect();
    for (name, is) in [
        ("bench/bin/python", python::interpreter().as_path()),
        ("cargo companion", companion()),
        ("cargo ground", ground()),
        ("cargo plan", plan()),
        ("cargo provision", provision()),
        ("host-tests/tests", &root.join("host-tests/tests")),
        ("examples/hills.tif", &root.join("examples/hills.tif")),
    ] {
        assert!(script.contains(name), "{name}");
        script = script.replace(name, is.to_str().unwrap());
    }
    let folder = tempfile::tempdir().unwrap();
    let script = with_socat(&script, folder.path());
    // A process that is left would keep the output open.
    let script = format!("trap 'kill $(jobs -p)' EXIT\n{script}");
    let mut command = Command::new("timeout");
    command.args(["--kill-after=5", "180", "bash", "-e", "-c", &script]);
    let output = command.current_dir(folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    println!("{said}");
    assert!(output.status.success(), "{output:?}");
    for part in [
        "RELAY 2, chain of 6 relays",
        "lines are green",
        "6      green",
    ] {
        assert!(said.contains(part), "no `{part}` in\n{said}");
    }
    assert_eq!(
        said.matches("converged: positions agreed").count(),
        6,
        "{said}"
    );
}
