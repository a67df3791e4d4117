//! Sites in a block, the line that a drone computes from them, and their source in the scenario.

use uav_relay::flight::axis::AxisError;
use uav_relay::flight::course::{Course, CourseError};
use uav_relay::{Geodetic, Mission};
use uav_relay_scenario::Scenario;
use uav_relay_tools::provision::block::{BlockError, Flight};
use uav_relay_tools::provision::config::{Block, ConfigError, Sites, autopilot_key};

use super::{changed, of_paper, provision, reads, refusal};

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

/// Latitude, longitude and height of both sites, as the table encodes them.
const ENDS: [[i32; 3]; 2] = [
    [474_000_000, 85_400_000, 420_000],
    [474_100_000, 85_500_000, 431_000],
];

#[test]
fn sites_stand_where_the_table_says() {
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
fn what_is_wrong_with_sites_is_named() {
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
    // The error occurs when the block is written, before the drone would report it.
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
fn the_command_has_them_from_the_scenario() {
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
        ("--speed 7.5", "--speed: is for a scenario with a [site]"),
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
fn the_key_of_an_autopilot_stands_behind_the_sites_and_is_none_without_them() {
    let block = flight().signed_to_autopilots(Some(KEY)).block(3).unwrap();
    assert_eq!(block[316..348], KEY);
    assert_eq!(autopilot_key(&block), Some(KEY));
    let without = flight().block(3).unwrap();
    assert_eq!(autopilot_key(&without), None);
    assert_eq!(changed(without, 316, &KEY), block, "nothing else changes");
    let plain = changed(super::paper(), 316, &KEY);
    assert_eq!(reads(&plain), Err(ConfigError::AutopilotKey));
}

#[test]
fn provision_has_the_key_of_the_autopilot_from_a_file() {
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
