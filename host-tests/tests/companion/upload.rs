//! Upload of a mission from a ground station to relays that store it, and fly it after a restart.

use std::fmt::Write as _;

use rustix::process::Signal;
use uav_relay::Upload;
use uav_relay_scenario::mission;
use uav_relay_scenario::{Interference, Scenario, Source};

use crate::medium::{Medium, Noise, QUIET};
use crate::positions::{fifo, write};
use crate::process::{Ended, Relay};
use crate::pty::{Pty, make_raw};
use crate::signed::Files;
use crate::simulated;

/// Uploaded change as options of the ground station.
const NEW: [&str; 2] = ["--new-interferer", "80,700,-300"];

fn new() -> Scenario {
    Scenario {
        interference: Interference::Sources(vec![Source {
            power_w: 80.0,
            x_m: 700.0,
            y_m: -300.0,
        }]),
        ..Scenario::default()
    }
}

/// Starts relay `index` of two, with an upload file; `ttys` are its own options.
fn relay(files: &Files, index: usize, ttys: &[&str]) -> Relay {
    let mut options = files.options("key", &format!("epoch{index}"));
    options.push("--upload-file".to_owned());
    let file = files.path(&format!("upload{index}"));
    options.push(file.to_str().unwrap().to_owned());
    let number = index.to_string();
    let mut arguments = vec!["--index", &number, "--of", "2"];
    arguments.extend(["--probe-after-ms", "500", "--dead-after-ms", "1500"]);
    arguments.extend(ttys);
    arguments.extend(options.iter().map(String::as_str));
    Relay::start(&arguments)
}

/// Starts the ground station of two relays, which uploads [`NEW`] as `version`.
fn ground(files: &Files, version: &str, more: &[&str]) -> Relay {
    let options = files.options("key", "ground");
    let mut arguments = vec!["--of", "2", "--yes", "--version", version];
    arguments.extend(NEW);
    arguments.extend(more);
    arguments.extend(options.iter().map(String::as_str));
    Relay::ground(&arguments)
}

/// Uploads from the transmitter over quiet and noisy wires.
#[test]
fn an_upload_reaches_two_relays_and_outlives_their_processes() {
    let (loaded, uploaded) = (simulated(&Scenario::default(), 2), simulated(&new(), 2));
    assert_ne!(loaded, uploaded);
    for noise in [QUIET, Noise::bad(11)] {
        let files = Files::new();
        let (tx, wire) = (Medium::new(2, noise), Medium::new(2, noise));
        let start = || {
            let first = ["--upstream", tx.tty(1), "--downstream", wire.tty(0)];
            [
                relay(&files, 1, &first),
                relay(&files, 2, &["--upstream", wire.tty(1)]),
            ]
        };
        let mut relays = start();
        for (relay, place) in relays.iter_mut().zip(&loaded) {
            relay.settles_at(*place);
        }
        assert!(!files.path("upload1").exists());
        let ends = ["--end", "tx", "--tty", tx.tty(0)];
        let ended = ground(&files, "3", &ends).end();
        assert_eq!(ended.status, Some(0), "{ended:?}");
        let last = ended.stdout.last().unwrap();
        assert!(
            last.contains("flown: 2 of 2 relays fly version 3, as relay 1 says, view "),
            "{last}"
        );
        for (relay, place) in relays.iter_mut().zip(&uploaded) {
            // Both log lines come before the ground station's.
            relay.line("uploaded: stored version 3");
            relay.line("adopted: flies version 3");
            relay.settles_at(*place);
        }
        // Both are killed at a random moment.
        drop(relays);
        let mut relays = start();
        for (relay, place) in relays.iter_mut().zip(&uploaded) {
            relay.line("resumed: flies version 3");
            relay.settles_at(*place);
            assert!(!relay.has_said("uploaded: ") && !relay.has_said("adopted: "));
        }
        let Ended { status, stderr, .. } = ground(&files, "2", &ends).end();
        assert_eq!(
            (status, &stderr[..]),
            (
                Some(1),
                &["--version 2: must be within 4 to 65535, the relays hold version 3".to_owned()][..]
            )
        );
    }
}

/// Uploads from the receiver on one channel; a relay without a file receives the mission again.
#[test]
fn on_a_shared_channel_a_relay_that_forgets_is_handed_it_again() {
    let uploaded = simulated(&new(), 2);
    let files = Files::new();
    let channel = Medium::new(3, QUIET);
    make_raw(channel.tty(0));
    let start = |index: usize| relay(&files, index, &["--shared", channel.tty(index)]);
    let mut relays = [start(1), start(2)];
    for relay in &mut relays {
        relay.line("converged: ");
    }
    let ended = ground(
        &files,
        "1",
        &["--shared", "--end", "rx", "--tty", channel.tty(0)],
    )
    .end();
    assert_eq!(ended.status, Some(0), "{ended:?}");
    let last = ended.stdout.last().unwrap();
    assert!(
        last.contains("flown: 2 of 2 relays fly version 1, as relay 2 says"),
        "{last}"
    );
    for (relay, place) in relays.iter_mut().zip(&uploaded) {
        relay.settles_at(*place);
    }
    std::fs::remove_file(files.path("upload2")).unwrap();
    drop(relays);
    let mut relays = [start(1), start(2)];
    relays[0].line("resumed: flies version 1");
    relays[1].line("uploaded: stored version 1");
    relays[1].line("adopted: flies version 1");
    for (relay, place) in relays.iter_mut().zip(&uploaded) {
        relay.settles_at(*place);
    }
    // A separate thread writes the file.
    let is_kept = || files.path("upload2").exists();
    let begun = std::time::Instant::now();
    while !is_kept() && begun.elapsed() < std::time::Duration::from_secs(20) {
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    assert!(is_kept());
}

/// Returns a relay's upload file of `config` as version 5, based on the loaded `base`.
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
fn a_file_that_is_of_no_use_is_named_and_not_used() {
    let files = Files::new();
    let file = files.path("upload");
    let mut options = files.options("key", "epoch");
    options.extend([
        "--upload-file".to_owned(),
        file.to_str().unwrap().to_owned(),
    ]);
    let mut arguments = vec!["--index", "1", "--of", "1"];
    arguments.extend(options.iter().map(String::as_str));
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
    for (bytes, words) in [
        (good.clone(), None),
        (damaged, Some("is damaged, or no upload; not used")),
        (
            good[..Upload::LENGTH].to_vec(),
            Some("is damaged, or no upload; not used"),
        ),
        (Vec::new(), Some("is damaged, or no upload; not used")),
        (
            stored(&high, &new()),
            Some("is for relays that were loaded with mission 0x"),
        ),
    ] {
        std::fs::write(&file, &bytes).unwrap();
        let mut relay = Relay::start(&arguments);
        let place = if words.is_none() { &uploaded } else { &loaded };
        relay.settles_at(place[0]);
        assert_eq!(relay.has_said("resumed: flies version 5"), words.is_none());
        relay.signal(Signal::TERM);
        let Ended {
            status,
            stdout,
            stderr,
        } = relay.end();
        assert_eq!((status, stderr), (Some(0), Vec::new()));
        let said: Vec<&String> = stdout.iter().filter(|it| it.contains("  file: ")).collect();
        assert_eq!(said.len(), words.iter().count(), "{said:?}");
        for (line, words) in said.iter().zip(words) {
            assert!(
                line.contains(&format!("{}: {words}", file.display())),
                "{line}"
            );
        }
        assert_eq!(std::fs::read(&file).unwrap(), bytes);
    }
}

#[test]
fn the_ground_gives_up_in_time_where_nobody_answers() {
    let files = Files::new();
    let wire = Medium::new(1, QUIET);
    let more = ["--end", "tx", "--tty", wire.tty(0), "--timeout", "2"];
    let Ended { status, stderr, .. } = ground(&files, "7", &more).end();
    assert_eq!((status, stderr.len()), (Some(1), 1), "{stderr:?}");
    let line = "--timeout 2: no relay has reported the mission that it flies: ";
    assert!(stderr[0].starts_with(line), "{stderr:?}");
    assert!(stderr[0].ends_with("; 0 frames refused"), "{stderr:?}");
}

/// Checks guarded relays at 20 m: an altitude outside their geofence is refused by name.
#[test]
fn an_altitude_outside_the_geofence_is_refused_at_the_ground_with_its_range() {
    for (band, altitude, range) in [
        (None, "30", Some("20 to 20 m")),
        (Some("15,60"), "5000", Some("15 to 60 m")),
        (Some("15,60"), "30", None),
    ] {
        let files = Files::new();
        let folder = tempfile::tempdir().unwrap();
        let (tx, wire) = (Medium::new(2, QUIET), Medium::new(2, QUIET));
        let places = [1, 2].map(|index: usize| fifo(folder.path(), &index.to_string()));
        let band = band.map(|band| ["--band", band]);
        let band = band.as_ref().map_or(&[][..], |band| &band[..]);
        let mut relays = [1, 2].map(|index: usize| {
            let mut ttys = if index == 1 {
                vec!["--upstream", tx.tty(1), "--downstream", wire.tty(0)]
            } else {
                vec!["--upstream", wire.tty(1)]
            };
            ttys.extend(["--positions", places[index - 1].to_str().unwrap()]);
            ttys.extend(band);
            relay(&files, index, &ttys)
        });
        let told = [("300 0 20\n", 0), ("700 0 20\n", 1)];
        let tell = || {
            for (line, at) in told {
                write(&places[at], line);
            }
        };
        tell();
        for relay in &mut relays {
            relay.line("converged: ");
        }
        let mut more = vec![
            "--end",
            "tx",
            "--tty",
            tx.tty(0),
            "--new-altitude",
            altitude,
        ];
        more.extend(band);
        let own = format!("{altitude},{altitude}");
        if range.is_some() {
            more.extend(["--new-band", &own]);
        }
        if let Some(range) = range {
            let ended = ground(&files, "5", &more).end();
            let line = format!(
                "--version 5: altitude {altitude} m: must be within {range}, the geofence of relays that were loaded with this --altitude and --band; farthest outside is relay 1, at altitude {altitude}.0 m"
            );
            assert_eq!((ended.status, &ended.stderr[..]), (Some(1), &[line][..]));
            assert!(!relays[0].has_said("upload refused: "), "nothing was sent");
            more.push("--no-fence");
        }
        let ended = ground(&files, "5", &more).end();
        let Some(range) = range else {
            assert_eq!(ended.status, Some(0), "{ended:?}");
            for relay in &mut relays {
                relay.line("adopted: flies version 5");
            }
            continue;
        };
        assert_eq!(ended.status, Some(1), "{ended:?}");
        let line = format!(
            "--version 5: relay 1, or one beyond it, refuses it: altitude {altitude} m: must be within {range}, the geofence of relays that were loaded with this --altitude and --band"
        );
        assert_eq!(ended.stderr, [line]);
        let own = "upload refused: the altitudes must be within the relay's own geofence, ";
        relays[0].line(&format!("{own}{range}"));
        assert!(!relays[0].has_said("adopted: ") && !relays[1].has_said("adopted: "));
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
    "--new-interferer 80,500",
    "--new-altitude 0",
    "--min-separation 501",
    "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431",
    "--new-site-rx 47.41,8.56,431",
    "SITED --new-site-rx 47.41",
    "--key-file nowhere",
];

const SITED: &str = "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431 --distance 1343.795";

/// Wrong options that depend on the mission in flight, which the ground station requests first.
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
    let options = options.replace("SITED", SITED);
    let options: Vec<&str> = options.split_whitespace().collect();
    let Ended {
        status, mut stderr, ..
    } = Relay::ground(&options).end();
    assert_eq!(
        (status, stderr.len()),
        (Some(2), 1),
        "{options:?}: {stderr:?}"
    );
    stderr.remove(0)
}

#[test]
fn an_upload_that_does_not_fit_what_is_flown_is_named() {
    let files = [Files::new(), Files::new()];
    let wires = [Medium::new(2, QUIET), Medium::new(2, QUIET)];
    // Relays 1 of 2 over 1000 m, and over the distance of the sites.
    let _relays = [0, 1].map(|at: usize| {
        let mut ttys = vec!["--upstream", wires[at].tty(1), "--downstream", "/dev/null"];
        let spare = Pty::new();
        let path = spare.path().to_str().unwrap().to_owned();
        ttys[3] = &path;
        if at == 1 {
            ttys.extend(["--distance", "1343.795"]);
        }
        let mut relay = relay(&files[at], 1, &ttys);
        relay.line("started: ");
        (relay, spare)
    });
    let mut all = String::new();
    for case in UNFIT {
        let at = usize::from(case.contains("SITED"));
        let tty = wires[at].tty(0);
        let own = files[at].options("key", "ground").join(" ");
        let good = format!("--of 2 --version 1 --yes --end tx --tty {tty} --timeout 20 {own}");
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
        let mut good = good + &files.options("key", "ground").join(" ");
        // A duplicate option would be another mistake.
        let option = case.split(' ').next().unwrap();
        if let Some((before, after)) = good.split_once(&format!("{option} ")) {
            let after = after.split_once(' ').unwrap_or_default().1;
            good = format!("{before}{after}");
        }
        writeln!(all, "{case}\n    {}", refusal(&format!("{good} {case}"))).unwrap();
    }
    insta::assert_snapshot!(all);
    let Ended { status, stderr, .. } = Relay::ground(&[]).end();
    assert_eq!(status, Some(2));
    for option in [
        "--tty",
        "--end",
        "--of",
        "--version",
        "--key-file",
        "--epoch-file",
    ] {
        assert!(stderr[0].contains(option), "{}", stderr[0]);
    }
}
