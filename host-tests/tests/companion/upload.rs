//! Upload of a mission from a ground station to relays that store it, and fly it after a restart.

use std::fmt::Write as _;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use uav_relay::Upload;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame;
use uav_relay::wire::message::Message;
use uav_relay_scenario::{Scenario, mission};

use crate::chain::{Chain, QUICK, simulated};
use crate::files::{Files, write};
use crate::medium::{Medium, Noise, QUIET};
use crate::process::{Relay, wait_until};
use crate::pty::{Pty, make_raw};
use crate::with_source;

/// Change of the mission that the tests upload, as an option of the ground station.
const NEW: &str = "--new-interferer 80,700,-300";

fn new() -> Scenario {
    with_source(80.0, 700.0, -300.0)
}

/// Starts relay `index` with a file in which it stores uploads.
fn relay(chain: &Chain, index: usize, own: &str) -> Relay {
    let signed = chain.files.signed("key", &format!("epoch{index}"));
    let file = chain.files.text(&format!("upload{index}"));
    chain.relay(
        index,
        &format!("{QUICK} {signed} --upload-file {file} {own}"),
    )
}

/// Starts the ground station of two relays, which uploads the change [`NEW`] as mission `version`.
fn ground(files: &Files, version: &str, more: &str) -> Relay {
    let signed = files.signed("key", "ground");
    let upload = format!("--of 2 --yes --version {version} {NEW} {signed}");
    Relay::ground(&format!("{upload} {more}"))
}

/// Checks that an upload by a ground station at Tx reaches two relays and survives their restarts.
///
/// This must hold on wires with and without noise.
#[test]
fn an_upload_reaches_two_relays_and_outlives_their_processes() {
    let (loaded, uploaded) = (simulated(&Scenario::default(), 2), simulated(&new(), 2));
    assert_ne!(loaded, uploaded);
    for noise in [QUIET, Noise::bad(11)] {
        let mut chain = Chain::with_ground(2, noise);
        chain.relays = (1..=2).map(|index| relay(&chain, index, "")).collect();
        chain.settles_at(&loaded);
        assert!(!chain.files.path("upload1").exists());
        let ends = format!("--end tx --tty {}", chain.tx.as_ref().unwrap().tty(0));
        let last = ground(&chain.files, "3", &ends).succeeds().pop().unwrap();
        let flown = "flown: 2 of 2 relays fly version 3 of the mission, as relay ";
        assert!(last.contains(flown), "{last}");
        // Both log lines come before the ground station's.
        chain.lines("uploaded: version 3 of the mission was received and stored");
        chain.lines("adopted: the chain flies version 3");
        chain.settles_at(&uploaded);
        // Both are killed at a random moment.
        chain.relays.clear();
        chain.relays = (1..=2).map(|index| relay(&chain, index, "")).collect();
        chain.lines("resumed: this relay flies version 3");
        chain.settles_at(&uploaded);
        for relay in &mut chain.relays {
            assert!(!relay.has_printed("uploaded: ") && !relay.has_printed("adopted: "));
        }
        let line = ground(&chain.files, "2", &ends).refused(1);
        let held = "--version 2: must be within 4 to 65535, because the relays have version 3 of the mission";
        assert_eq!(line, held);
    }
}

/// Checks that a relay that restarts without its upload file receives the uploaded mission again.
///
/// The first upload comes from a ground station at the receiver, on the shared channel.
#[test]
fn a_relay_without_its_upload_is_offered_it_again() {
    let uploaded = simulated(&new(), 2);
    let mut chain = Chain::on_channel(2, Medium::new(3, QUIET));
    let station = chain.media[0].tty(2).to_owned();
    make_raw(&station);
    chain.relays = (1..=2).map(|index| relay(&chain, index, "")).collect();
    chain.lines("converged: ");
    let ends = format!("--shared --end rx --tty {station}");
    let last = ground(&chain.files, "1", &ends).succeeds().pop().unwrap();
    let flown = "flown: 2 of 2 relays fly version 1 of the mission, as relay ";
    assert!(last.contains(flown), "{last}");
    chain.settles_at(&uploaded);
    let kept = chain.files.path("upload2");
    std::fs::remove_file(&kept).unwrap();
    chain.relays.clear();
    chain.relays = (1..=2).map(|index| relay(&chain, index, "")).collect();
    chain.relays[0].line("resumed: this relay flies version 1");
    chain.relays[1].line("uploaded: version 1 of the mission was received and stored");
    chain.relays[1].line("adopted: the chain flies version 1");
    chain.settles_at(&uploaded);
    // A separate thread writes the file.
    let begun = std::time::Instant::now();
    wait_until(|| kept.exists());
    assert!(begun.elapsed().as_secs() < 20, "{:?}", begun.elapsed());
}

/// State of a wire that a test cuts when a relay sends its decision on a new membership view.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Wire {
    Open,
    /// Armed: intact until the next decision on a membership view is sent.
    ///
    /// That decision is lost, and the wire is cut from then on.
    Armed,
    Cut,
}

/// Creates a wire that is cut when tty 1 sends a decision on a membership view.
///
/// A decision cuts the wire only while `state` is [`Wire::Armed`].
fn cut_by_a_decision(state: &Arc<Mutex<Wire>>) -> Medium {
    let state = Arc::clone(state);
    let mut deframer = Deframer::new();
    Medium::gated(move |from, bytes| {
        let mut state = state.lock().unwrap();
        for &byte in bytes.iter().filter(|_| from == 1) {
            let decides = deframer.push(byte).is_some_and(|plain| {
                let message = plain.ok().and_then(|plain| frame::decode(plain).ok());
                matches!(message, Some((_, Message::Decision(_))))
            });
            if decides && *state == Wire::Armed {
                *state = Wire::Cut;
            }
        }
        *state != Wire::Cut
    })
}

/// Checks that the ground station reports when the first relay flies the new mission, and when all do.
///
/// The wire between relays 2 and 3 is cut as soon as relay 3 has decided on the membership view with the mission.
#[test]
fn the_ground_reports_progress_until_all_relays_fly() {
    let state = Arc::new(Mutex::new(Wire::Open));
    let mut chain = Chain::on_wires(3, QUIET);
    chain.media[1] = cut_by_a_decision(&state);
    let rx = Medium::new(2, QUIET);
    let ends = [
        String::new(),
        String::new(),
        format!("--downstream {}", rx.tty(0)),
    ];
    chain.relays = (1..)
        .zip(&ends)
        .map(|(index, end)| {
            let signed = chain.files.signed("key", &format!("epoch{index}"));
            chain.relay(index, &format!("{signed} {end}"))
        })
        .collect();
    chain.settles_at(&simulated(&Scenario::default(), 3));
    *state.lock().unwrap() = Wire::Armed;
    let signed = chain.files.signed("key", "ground");
    let mut station = Relay::ground(&format!(
        "--of 3 --yes --version 5 {NEW} {signed} --end rx --tty {}",
        rx.tty(1)
    ));
    let line = station.line("adopted: ");
    let first = "adopted: relay 3 is the first of 3 relays to report that it flies version 5 of the mission; the station asks relay 3 again until all relays fly this version";
    assert!(line.ends_with(first), "{line}");
    assert_eq!(*state.lock().unwrap(), Wire::Cut);
    // Several polls later the others still do not fly it.
    std::thread::sleep(Duration::from_secs(4));
    assert!(!station.has_printed("flown: "), "the chain is cut");
    chain.relays[2].wait_for("adopted: the chain flies version 5");
    for relay in &mut chain.relays[..2] {
        assert!(!relay.has_printed("adopted: "));
    }
    *state.lock().unwrap() = Wire::Open;
    let line = station.line("flown: ");
    assert!(
        line.contains("flown: 3 of 3 relays fly version 5 of the mission, as relay "),
        "{line}"
    );
    station.succeeds();
    for relay in &mut chain.relays {
        relay.wait_for("adopted: the chain flies version 5");
    }
}

/// Returns the contents of an upload file with `config` as version 5.
///
/// The relays' mission before flight is `base`.
fn stored(base: &Scenario, config: &Scenario) -> Vec<u8> {
    let [base, new] = [base, config].map(|scenario| mission::mission(scenario, 1, 1e-4).unwrap().0);
    let upload = Upload::new(&base, 5, *new.config()).unwrap();
    let mut bytes = vec![0; Upload::LENGTH];
    assert_eq!(upload.encode(&mut bytes), Some(Upload::LENGTH));
    let check = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&bytes);
    bytes.extend(check.to_le_bytes());
    bytes
}

#[test]
fn a_useless_upload_file_is_named_and_ignored() {
    let files = Files::new();
    let (file, signed) = (files.text("upload"), files.signed("key", "epoch"));
    let (loaded, uploaded) = (simulated(&Scenario::default(), 1), simulated(&new(), 1));
    let good = stored(&Scenario::default(), &new());
    let mut damaged = good.clone();
    damaged[40] ^= 1;
    let high = Scenario {
        altitude_m: 21.0,
        altitude_min_m: 21.0,
        altitude_max_m: 21.0,
        ..Scenario::default()
    };
    let useless = "the file is damaged, or not an uploaded mission; the relay ignores the file and starts with the mission of its options";
    let of_others =
        "the uploaded mission in this file is for relays with a loaded mission of digest 0x";
    for (bytes, words) in [
        (good.clone(), None),
        (damaged, Some(useless)),
        (good[..Upload::LENGTH].to_vec(), Some(useless)),
        (Vec::new(), Some(useless)),
        (stored(&high, &new()), Some(of_others)),
    ] {
        std::fs::write(&file, &bytes).unwrap();
        let options = format!("--index 1 --of 1 {signed} --upload-file {file}");
        let mut relay = Relay::start(&options);
        let place = if words.is_none() { &uploaded } else { &loaded };
        relay.settles_at(place[0]);
        assert_eq!(
            relay.has_printed("resumed: this relay flies version 5"),
            words.is_none()
        );
        let stdout = relay.stopped();
        let said: Vec<&String> = stdout.iter().filter(|it| it.contains("  file: ")).collect();
        assert_eq!(said.len(), words.iter().count(), "{said:?}");
        for (line, words) in said.iter().zip(words) {
            assert!(line.contains(&format!("{file}: {words}")), "{line}");
        }
        assert_eq!(std::fs::read(&file).unwrap(), bytes);
    }
}

#[test]
fn the_ground_gives_up_after_its_time_limit() {
    let (files, wire) = (Files::new(), Medium::new(1, QUIET));
    let more = format!("--end tx --tty {} --timeout 2", wire.tty(0));
    let line = ground(&files, "7", &more).refused(1);
    let reports = "upload not finished within --timeout 2 s: no relay has reported the mission that it flies: ";
    assert!(line.starts_with(reports), "{line}");
    assert!(
        line.ends_with("; 0 received frames were rejected"),
        "{line}"
    );
}

/// Checks that relays with a geofence refuse an altitude outside it, and name the permitted range.
#[test]
fn an_altitude_outside_the_geofence_is_refused_with_its_range() {
    for (band, altitude, range) in [
        ("", "30", Some("20 to 20 m")),
        ("--band 15,60", "5000", Some("15 to 60 m")),
        ("--band 15,60", "30", None),
    ] {
        let mut chain = Chain::with_ground(2, QUIET);
        let places = ["1", "2"].map(|name| chain.files.fifo(name));
        for (index, place) in (1..).zip(&places) {
            let relay = relay(&chain, index, &format!("--positions {place} {band}"));
            chain.relays.push(relay);
        }
        write(&places[0], "300 0 20\n");
        write(&places[1], "700 0 20\n");
        chain.lines("converged: ");
        let tty = chain.tx.as_ref().unwrap().tty(0);
        let more = format!("--end tx --tty {tty} --new-altitude {altitude} {band}");
        let Some(range) = range else {
            ground(&chain.files, "5", &more).succeeds();
            chain.lines("adopted: the chain flies version 5");
            continue;
        };
        let more = format!("{more} --new-band {altitude},{altitude}");
        let why = format!(
            "altitude {altitude} m: must be within {range} (the relays' geofence, set before flight by --altitude and --band)"
        );
        let far = format!(
            "every relay that controls a drone refuses this mission: relay 1 would be farthest outside, at altitude {altitude}.0 m"
        );
        let line = ground(&chain.files, "5", &more).refused(1);
        assert_eq!(
            line,
            format!(
                "upload of version 5 refused: {why}; {far}; --no-fence uploads the mission nevertheless"
            )
        );
        let relays = &mut chain.relays;
        assert!(
            !relays[0].has_printed("upload refused: "),
            "nothing was sent"
        );
        let line = ground(&chain.files, "5", &format!("{more} --no-fence")).refused(1);
        let by = "refused by relay 1, or by a relay beyond it";
        assert_eq!(line, format!("upload of version 5 {by}: {why}"));
        let own = "upload refused: the mission's altitudes must be within this relay's geofence, ";
        relays[0].line(&format!("{own}{range}"));
        assert!(
            relays
                .iter_mut()
                .all(|relay| !relay.has_printed("adopted: "))
        );
    }
}

/// Wrong options of the ground station. `SITED` stands for the options of [`SITED`].
const WRONG: &[&str] = &[
    "--version 0",
    "--version 65536",
    "--end up",
    "--timeout 0",
    "--baud 1199",
    "--of 0",
    "--web 127.0.0.1:65536",
    "--web 127.0.0.1:0",
    "--new-interferer 80,500",
    "--new-altitude 0",
    "--min-separation 501",
    "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431",
    "--new-site-rx 47.41,8.56,431",
    "SITED --new-site-rx 47.41",
    "--key-file nowhere",
];

const SITED: &str = "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431 --distance 1343.795";

/// Wrong options that the ground station can refuse only after it has received the relays' mission.
const UNFIT: &[&str] = &[
    "--new-band 30,300",
    "--new-min-separation 1001",
    "SITED --new-distance 1343.8",
    "SITED --new-site-rx 47.4,8.54,420",
    "SITED --new-site-rx 47.39,8.55,431",
    // Both sites remain valid with latitude and longitude swapped.
    "SITED --new-site-tx 8.54,47.4,420 --new-site-rx 8.55,47.41,431",
    "SITED --new-site-tx 48.9,8.54,420",
    "SITED --new-site-rx 47.41,8.56,431 --new-distance 1000",
];

/// Returns the error line of a ground station with wrong options.
fn refusal(options: &str) -> String {
    Relay::ground(&options.replace("SITED", SITED)).refused(2)
}

#[test]
fn an_upload_that_does_not_fit_the_flown_mission_is_named() {
    // Relays 1 of 2 over 1000 m, and over the distance of the sites.
    let chains = ["", "--distance 1343.795"].map(|distance| {
        let (mut chain, spare) = (Chain::with_ground(1, QUIET), Pty::new());
        let own = format!("--downstream {} --of 2 {distance}", spare.path().display());
        let signed = chain.files.signed("key", "epoch1");
        let upstream = chain.tx.as_ref().unwrap().tty(1);
        let mut relay = Relay::start(&format!(
            "--index 1 --upstream {upstream} {QUICK} {signed} {own}"
        ));
        relay.line("started: ");
        chain.relays.push(relay);
        (chain, spare)
    });
    let mut all = String::new();
    for case in UNFIT {
        let (chain, _) = &chains[usize::from(case.contains("SITED"))];
        let tty = chain.tx.as_ref().unwrap().tty(0);
        let signed = chain.files.signed("key", "ground");
        let good = format!("--of 2 --version 1 --yes --end tx --tty {tty} --timeout 20 {signed}");
        writeln!(all, "{case}\n    {}", refusal(&format!("{good} {case}"))).unwrap();
    }
    insta::assert_snapshot!(all);
}

#[test]
fn wrong_options_of_the_ground_are_named() {
    let files = Files::new();
    let mut all = String::new();
    for case in WRONG {
        let good = "--tty a --end tx --of 3 --version 1 --yes ".to_owned();
        let mut good = good + &files.signed("key", "ground");
        // A duplicate option would be another mistake.
        let option = case.split(' ').next().unwrap();
        if let Some((before, after)) = good.split_once(&format!("{option} ")) {
            let after = after.split_once(' ').unwrap_or_default().1;
            good = format!("{before}{after}");
        }
        writeln!(all, "{case}\n    {}", refusal(&format!("{good} {case}"))).unwrap();
    }
    insta::assert_snapshot!(all);
    let ended = Relay::ground("").end();
    assert_eq!(ended.status, Some(2));
    for option in "--tty --end --of --version --key-file --epoch-file".split(' ') {
        assert!(ended.stderr[0].contains(option), "{ended:?}");
    }
}
