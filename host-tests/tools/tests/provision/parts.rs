//! Key and epoch in a block, and their sources.

use std::path::Path;

use uav_relay::flight::axis::AxisError;
use uav_relay::flight::course::{Course, CourseError};
use uav_relay::{Duration, Geodetic, Interference, Listen, Mission};
use uav_relay_scenario::{Scenario, key};
use uav_relay_tools::provision::block::{BlockError, Flight};
use uav_relay_tools::provision::config::{
    Block, ConfigError, Secret, Sites, autopilot_key, secret,
};

use super::{changed, field, of_paper, paper, provision, reads, refusal, with};

const SECRET: Secret = Secret {
    key: *b"32 random bytes, known to nobody",
    epoch: 0x0102_0304,
};

fn plain_flight() -> Flight {
    Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap()
}

#[test]
fn key_and_epoch_are_at_the_tables_offsets() {
    let block = plain_flight().signed(Some(SECRET)).block(3).unwrap();
    let mut bytes = [4, 3, 2, 1].to_vec();
    bytes.extend(SECRET.key);
    assert_eq!(block, with(252, &bytes));
    assert_eq!(secret(&block), Ok(Some(SECRET)));
    assert_eq!(reads(&block), reads(&paper()), "nothing else changes");
    assert_eq!(secret(&paper()), Ok(None));
    assert_eq!(format!("{SECRET:?}"), "Secret(..)", "keys are not for logs");
}

#[test]
fn a_key_without_an_epoch_is_refused_and_the_other_way_round() {
    let key = SECRET.key;
    for (key, epoch) in [([0; 32], 1), (key, 0), (key, u32::MAX), ([0; 32], u32::MAX)] {
        let block = plain_flight().signed(Some(Secret { key, epoch })).block(3);
        assert_eq!(block, Err(BlockError::Config(ConfigError::Secret)));
        let mut bytes = epoch.to_le_bytes().to_vec();
        bytes.extend(key);
        assert_eq!(secret(&with(252, &bytes)), Err(ConfigError::Secret));
    }
    let epoch = 0xFFFF_FFFE;
    let most = Some(Secret { key, epoch });
    assert!(plain_flight().signed(most).block(3).is_ok());
}

#[test]
fn brief_takes_the_key_from_a_file_and_the_epoch_from_the_clock() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file) = (path("block.bin"), path("key"));
    super::write_key(&file, &format!("\n  {}\r\n", "0aF1".repeat(16)));
    let plain = of_paper(&out);
    let block = || <Block>::try_from(&std::fs::read(&out).unwrap()[..]).unwrap();
    let clock = || {
        let since = std::time::UNIX_EPOCH.elapsed().unwrap();
        u32::try_from(since.as_secs()).unwrap()
    };

    let output = provision(&plain);
    assert!(output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        said,
        "no --key-file: frames are not signed, so anybody in range can forge them\n"
    );
    assert_eq!(block(), paper());

    let signed = format!("{plain} --key-file {file}");
    let before = clock();
    let output = provision(&signed);
    assert!(output.status.success() && output.stderr.is_empty());
    let Secret { key, epoch } = secret(&block()).unwrap().unwrap();
    assert_eq!(key, [[0x0A, 0xF1]; 16].concat()[..]);
    assert!((before..=clock()).contains(&epoch), "{epoch}");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!said.to_lowercase().contains("0af1"), "{said}");

    let output = provision(&format!("{signed} --epoch 9"));
    assert!(output.status.success());
    assert_eq!(secret(&block()).unwrap().unwrap().epoch, 9);
}

#[test]
fn a_bad_key_is_reported_without_its_value() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file) = (path("block.bin"), path("key"));
    let plain = format!("--uavs 5 --index 3 --out {out}");
    let keyed = format!("{plain} --key-file {file}");
    let text = refusal(&keyed);
    assert!(text.contains("--key-file"), "{text}");
    assert!(text.contains("cannot be read"), "{text}");
    let good = "0123456789abcdef".repeat(4);
    assert!(key::parse(&good).is_ok());
    let length = "64 hexadecimal digits";
    let digits = "must contain only hexadecimal digits";
    for (content, words) in [
        ("", length),
        (&good[1..], length),
        (&format!("{good}0"), length),
        (&format!("0x{}", &good[2..]), digits),
        (&format!("{} {}", &good[..32], &good[33..]), digits),
        (&good.replace('9', "é"), digits),
        (&"0".repeat(64), "must not be all 0"),
    ] {
        super::write_key(&file, content);
        let text = refusal(&keyed);
        assert!(text.contains("--key-file"), "{text}");
        assert!(text.contains(words), "{content}: {text}");
        assert!(!text.contains("cdef"), "{text}");
    }
    super::write_key(&file, &good);
    for epoch in ["--epoch=0", "--epoch=4294967295", "--epoch=-1"] {
        let text = refusal(&format!("{keyed} {epoch}"));
        assert!(text.contains("--epoch"), "{text}");
    }
    let text = refusal(&format!("{plain} --epoch 9"));
    assert!(text.contains("--key-file"), "{text}");
    assert!(!Path::new(&out).exists());
}

#[test]
fn a_key_file_that_others_can_read_is_refused() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file) = (path("block.bin"), path("key"));
    std::fs::write(&file, "0123456789abcdef".repeat(4)).unwrap();
    let plain = format!("--uavs 5 --index 3 --out {out}");
    let keyed = format!("{plain} --key-file {file}");
    for (mode, is_taken) in [
        (0o644, false),
        (0o604, false),
        (0o602, false),
        (0o666, false),
        (0o600, true),
        (0o400, true),
        // A service reads the file through its group.
        (0o640, true),
    ] {
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(mode)).unwrap();
        if is_taken {
            assert!(provision(&keyed).status.success(), "{mode:o}");
            continue;
        }
        let text = refusal(&keyed);
        let words =
            format!("--key-file {file}: has the mode {mode:04o}, so other users of this computer");
        assert!(text.contains(&words), "{text}");
        assert!(text.contains(&format!("type: chmod 600 {file}")), "{text}");
    }
}

const TOML: &str = "[geometry]\naltitude_m = 20.0\n[power]\ntx_w = 80.0\nuav_w = 1.0\n\
    [[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n\
    [site]\ntx = { lat_deg = 47.40, lon_deg = 8.54, amsl_m = 420.0 }\n\
    rx = { lat_deg = -47.41, lon_deg = 8.55, amsl_m = 431.0 }\n";

fn course(sites: &Sites, mission: &Mission) -> Result<Course, CourseError> {
    Course::try_new(sites.on_earth(), sites.speed_m_s, mission)
}

fn scenario() -> Scenario {
    Scenario::parse("flight.toml", &TOML.replace("-47", "47")).unwrap()
}

pub(super) fn flight() -> Flight {
    Flight::new(&scenario(), 5, 1e-4, 7).unwrap()
}

/// Positions of Tx and Rx as in a block: latitude and longitude, 1e-7 degrees, and height, mm.
const ENDS: [[i32; 3]; 2] = [
    [474_000_000, 85_400_000, 420_000],
    [474_100_000, 85_500_000, 431_000],
];

#[test]
fn sites_are_at_the_tables_offsets() {
    let block = flight().no_faster_than(7.5).block(3).unwrap();
    let mut bytes = Vec::new();
    for number in ENDS.as_flattened() {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(7.5_f32.to_le_bytes());
    assert_eq!(block[288..316], bytes);
    let without = Scenario {
        line: None,
        ..scenario()
    };
    let without = Flight::new(&without, 5, 1e-4, 7).unwrap();
    let nothing = without.clone().no_faster_than(7.5).block(3).unwrap();
    assert_eq!(nothing, without.block(3).unwrap(), "no sites, no speed");
    assert_eq!(changed(nothing, 288, &bytes), block, "nothing else changes");
    assert_eq!(reads(&nothing).unwrap().sites, None);
}

#[test]
fn the_line_is_that_of_the_scenario() {
    let config = reads(&flight().block(3).unwrap()).unwrap();
    let sites = config.sites.unwrap();
    assert_eq!(sites.ends, ENDS);
    let found = course(&sites, &config.mission).unwrap();
    assert_eq!(found.axis, scenario().line.unwrap().axis);
    assert_eq!(found.pace.speed_m_s, 5.0, "unless told otherwise");
    for speed_m_s in [0.1, 7.5, 20.0] {
        let found = course(&Sites { speed_m_s, ..sites }, &config.mission).unwrap();
        assert_eq!(found.pace.speed_m_s, speed_m_s);
    }
}

#[test]
fn errors_of_sites_are_named() {
    let block = flight().block(3).unwrap();
    for speed in [f32::NAN, -1.0, 0.099, 20.1, -0.0] {
        let block = changed(block, 312, &speed.to_le_bytes());
        assert_eq!(reads(&block), Err(ConfigError::Speed), "{speed}");
    }
    let wrong = |at: usize, number: i32| {
        let config = reads(&changed(block, at, &number.to_le_bytes())).unwrap();
        course(&config.sites.unwrap(), &config.mission).unwrap_err()
    };
    let [tx, rx] = ENDS.map(|[lat_e7, lon_e7, amsl_mm]| Geodetic {
        lat_e7,
        lon_e7,
        amsl_mm,
    });
    assert_eq!(
        wrong(288, 900_000_001),
        CourseError::Axis(AxisError::Tx(Geodetic {
            lat_e7: 900_000_001,
            ..tx
        }))
    );
    assert_eq!(
        wrong(304, i32::MIN),
        CourseError::Axis(AxisError::Rx(Geodetic {
            lon_e7: i32::MIN,
            ..rx
        }))
    );
    let far = wrong(300, -474_100_000);
    assert!(matches!(far, CourseError::Axis(AxisError::TooLong { .. })));
    // A hundredth of a second of arc is 30 cm.
    let off = wrong(300, 474_100_028);
    assert!(matches!(off, CourseError::Distance(along) if (1_343.8..1_344.2).contains(&along)));
    let near = Sites {
        ends: [ENDS[0]; 2],
        speed_m_s: 0.0,
    };
    assert!(matches!(
        course(&near, flight().mission()),
        Err(CourseError::Axis(AxisError::TooShort { .. }))
    ));
    // The error occurs when the block is written, and not only when a drone reads it.
    let moved = Scenario {
        distance_m: 1_340.0,
        ..scenario()
    };
    let error = Flight::new(&moved, 5, 1e-4, 7)
        .unwrap()
        .block(3)
        .unwrap_err();
    assert!(matches!(
        error,
        BlockError::Course(CourseError::Distance(_))
    ));
    assert!(error.to_string().contains("1343.795 m apart"), "{error}");
}

#[test]
fn the_command_takes_the_sites_from_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file, off) = (path("block.bin"), path("site.toml"), path("off.toml"));
    std::fs::write(&file, TOML.replace("-47", "47")).unwrap();
    std::fs::write(&off, TOML).unwrap();
    let plain = of_paper(&out);
    let sited = format!("{plain} --scenario {file}");
    let written = |more: &str| {
        let output = provision(&format!("{sited} {more}"));
        assert!(output.status.success(), "{output:?}");
        <Block>::try_from(&std::fs::read(&out).unwrap()[..]).unwrap()
    };
    assert_eq!(written(""), flight().block(3).unwrap());
    let fast = flight().no_faster_than(7.5).block(3).unwrap();
    assert_eq!(written("--speed 7.5"), fast);
    for (arguments, words) in [
        (
            "--speed 7.5",
            "--speed: is only for a scenario with a [site]",
        ),
        ("--speed 20.1", "must be a number within 0.1 to 20.0"),
        ("--speed NaN", "must be a number within 0.1 to 20.0"),
        (&format!("--scenario {off}"), "m from tx to rx"),
    ] {
        let text = refusal(&format!("{plain} {arguments}"));
        assert!(text.contains(words), "{text}");
    }
}

const KEY: [u8; 32] = [0x4B; 32];

#[test]
fn an_autopilots_key_follows_the_sites() {
    let block = flight().signed_to_autopilots(Some(KEY)).block(3).unwrap();
    assert_eq!(block[316..348], KEY);
    assert_eq!(autopilot_key(&block), Some(KEY));
    let without = flight().block(3).unwrap();
    assert_eq!(autopilot_key(&without), None);
    assert_eq!(changed(without, 316, &KEY), block, "nothing else changes");
    let plain = changed(paper(), 316, &KEY);
    assert_eq!(reads(&plain), Err(ConfigError::AutopilotKey));
}

#[test]
fn provision_reads_the_autopilots_key_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, file, sites) = (path("block.bin"), path("key"), path("sites.toml"));
    std::fs::write(&sites, TOML.replace("-47", "47")).unwrap();
    super::write_key(&file, &"4b".repeat(32));
    let plain = format!("--uavs 5 --index 3 --out {out}");
    let keyed = format!("{plain} --autopilot-key-file {file}");
    let text = refusal(&keyed);
    assert!(text.contains("--autopilot-key-file"), "{text}");
    assert!(text.contains("[site]"), "{text}");
    let sited = format!("{keyed} --scenario {sites}");
    assert!(provision(&sited).status.success());
    let block: Block = std::fs::read(&out).unwrap().try_into().unwrap();
    assert_eq!(autopilot_key(&block), Some(KEY));
    std::fs::write(&file, "4b".repeat(31)).unwrap();
    let text = refusal(&sited);
    assert!(text.contains("--autopilot-key-file"), "{text}");
    assert!(!text.contains("4b4b"), "{text}");
}

const LISTEN_TOML: &str = "[geometry]\ndistance_m = 1000\naltitude_m = 20\nmin_separation_m = 4\n\
    [power]\ntx_w = 80\nuav_w = 1\n";
const SOURCE: &str = "[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";

fn listening_flight(toml: &str) -> Flight {
    let scenario = Scenario::parse("listen.toml", &format!("{LISTEN_TOML}{toml}")).unwrap();
    Flight::new(&scenario, 5, 1e-4, 7).unwrap()
}

#[test]
fn an_unknown_interferer_is_stored_as_none() {
    let block = listening_flight("[listen]\n").block(3).unwrap();
    assert_eq!(block[44..56], [0; 12]);
    let config = reads(&block).unwrap();
    assert_eq!(config.mission.config().interference, Interference::Unknown);
    assert_eq!(config.listen, Some(Listen::default()));
    // Relays that do not measure need a known interferer.
    let deaf = changed(block, 352, &[0; 20]);
    assert!(matches!(reads(&deaf), Err(ConfigError::Mission(_))));
}

#[test]
fn listening_is_at_the_tables_offsets() {
    let toml = "[listen]\nevery_s = 0.25\nhalf_life_s = 1e12\nrelative_error = 0.5\n";
    let block = listening_flight(&format!("{SOURCE}{toml}"))
        .block(3)
        .unwrap();
    let mut bytes = Vec::new();
    bytes.extend(250_000_u64.to_le_bytes());
    bytes.extend(1_000_000_000_000_000_000_u64.to_le_bytes());
    bytes.extend(0.5_f32.to_le_bytes());
    assert_eq!(block[352..372], bytes);
    let without = listening_flight(SOURCE).block(3).unwrap();
    assert_eq!(changed(without, 352, &bytes), block, "nothing else changes");
    assert_eq!(reads(&without).unwrap().listen, None);
    let config = reads(&block).unwrap();
    let guess = listening_flight(SOURCE).mission().config().interference;
    assert_eq!(config.mission.config().interference, guess);
    let following = listening_flight("[listen]\nfollowing = true\n")
        .block(3)
        .unwrap();
    assert_eq!(
        reads(&following).unwrap().listen,
        Some(Listen::following(5))
    );
}

#[test]
fn the_ranges_are_those_of_a_relay() {
    for (every, half_life, relative_error, good) in [
        (1_u64, 1_u64, 1e-3_f32, true),
        (u64::MAX, u64::MAX, 1.0, true),
        (0, 1, 0.1, false),
        (1, 0, 0.1, false),
        (1, 1, 1e-3_f32.next_down(), false),
        (1, 1, 1.0_f32.next_up(), false),
        (1, 1, f32::NAN, false),
    ] {
        let block = with(352, &every.to_le_bytes());
        let block = changed(block, 360, &half_life.to_le_bytes());
        let block = changed(block, 368, &relative_error.to_le_bytes());
        let listen = Listen {
            every: Duration::from_micros(every),
            half_life: Duration::from_micros(half_life),
            relative_error,
        };
        let expected = if good {
            Ok(Some(listen))
        } else {
            Err(ConfigError::Listen)
        };
        assert_eq!(reads(&block).map(|config| config.listen), expected);
        // This is not allowed in a field.
        let block = changed(field(2), 352, &block[352..372]);
        assert_eq!(reads(&block), Err(ConfigError::Listen));
    }
}

/// Checks that `[listen]` is refused if the scenario gives the interference along the line Tx-Rx.
#[test]
fn a_field_is_refused_with_listening() {
    let mut scenario = super::in_a_field(3);
    scenario.listen = Some(uav_relay_scenario::ListenSpec::default());
    let flight = Flight::new(&scenario, 5, 1e-4, 7).unwrap();
    assert_eq!(
        flight.block(3),
        Err(BlockError::Config(ConfigError::Listen))
    );
}

#[test]
fn the_command_takes_listening_from_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (toml, out) = (path("listen.toml"), path("relay.bin"));
    let of = |text: &str| {
        std::fs::write(&toml, format!("{LISTEN_TOML}{text}")).unwrap();
        let arguments = format!("--scenario {toml} --uavs 5 --index 3");
        provision(&format!("{arguments} --network 7 --out {out}"))
    };
    assert!(of("[listen]\nfollowing = true\n").status.success());
    let block = std::fs::read(&out).unwrap();
    let expected = listening_flight("[listen]\nfollowing = true\n")
        .block(3)
        .unwrap();
    assert_eq!(block, expected);
    // The section, and two parts of the error line.
    for row in [
        "[listen]\nevery_s = 0\n | listen.every_s | 0.01 to 1e5 s",
        "[listen]\nhalf_life_s = 1e13\n | listen.half_life_s = 10000000000000 | 0.01 to 1e12 s",
        "[listen]\nrelative_error = 2\n | listen.relative_error = 2 | 0.001 to 1",
        "[listen]\nfollowing = 1\n | listen.following = 1 | true or false",
        "[listen]\nevery = 1\n | listen.every = 1 | following, every_s, half_life_s, relative_error",
        " | interferer | [field]",
    ] {
        let (text, parts) = row.split_once(" | ").unwrap();
        let output = of(text);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success(), "{text}");
        for part in parts.split(" | ") {
            assert!(said.contains(part), "{part} not in {said}");
        }
    }
}
