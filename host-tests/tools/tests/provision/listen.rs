//! Settings for locating the interferer in a block, and their source in the scenario.

use uav_relay::{Duration, Interference, Listen};
use uav_relay_scenario::Scenario;
use uav_relay_tools::provision::block::{BlockError, Flight};
use uav_relay_tools::provision::config::{ConfigError, LEN};

use super::{changed, field, provision, reads, with};

const TOML: &str = "[geometry]\ndistance_m = 1000\naltitude_m = 20\nmin_separation_m = 4\n\
    [power]\ntx_w = 80\nuav_w = 1\n";
const SOURCE: &str = "[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";

fn flight(toml: &str) -> Flight {
    let scenario = Scenario::parse("listen.toml", &format!("{TOML}{toml}")).unwrap();
    Flight::new(&scenario, 5, 1e-4, 7).unwrap()
}

#[test]
fn what_the_relays_do_not_know_stands_as_nothing() {
    let block = flight("[listen]\n").block(3).unwrap();
    assert_eq!(block[44..56], [0; 12]);
    let config = reads(&block).unwrap();
    assert_eq!(config.mission.config().interference, Interference::Unknown);
    assert_eq!(config.listen, Some(Listen::default()));
    // Relays that do not measure need a known interferer.
    let deaf = changed(block, 352, &[0; 20]);
    assert!(matches!(reads(&deaf), Err(ConfigError::Mission(_))));
}

#[test]
fn listening_stands_where_the_table_says() {
    let toml = "[listen]\nevery_s = 0.25\nhalf_life_s = 1e12\nrelative_error = 0.5\n";
    let block = flight(&format!("{SOURCE}{toml}")).block(3).unwrap();
    let mut bytes = Vec::new();
    bytes.extend(250_000_u64.to_le_bytes());
    bytes.extend(1_000_000_000_000_000_000_u64.to_le_bytes());
    bytes.extend(0.5_f32.to_le_bytes());
    assert_eq!(block[352..LEN - 8], bytes);
    let without = flight(SOURCE).block(3).unwrap();
    assert_eq!(changed(without, 352, &bytes), block, "nothing else changes");
    assert_eq!(reads(&without).unwrap().listen, None);
    let config = reads(&block).unwrap();
    let guess = flight(SOURCE).mission().config().interference;
    assert_eq!(config.mission.config().interference, guess);
    let following = flight("[listen]\nfollowing = true\n").block(3).unwrap();
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
        // Not allowed in a field.
        let block = changed(field(2), 352, &block[352..372]);
        assert_eq!(reads(&block), Err(ConfigError::Listen));
    }
}

/// A mission with a field cannot locate an interferer, even if a program asks for it.
#[test]
fn a_field_has_nothing_to_find() {
    let mut scenario = super::in_a_field(3);
    scenario.listen = Some(uav_relay_scenario::ListenSpec::default());
    let flight = Flight::new(&scenario, 5, 1e-4, 7).unwrap();
    assert_eq!(
        flight.block(3),
        Err(BlockError::Config(ConfigError::Listen))
    );
}

#[test]
fn the_command_takes_it_from_the_scenario() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (toml, out) = (path("listen.toml"), path("relay.bin"));
    let of = |text: &str| {
        std::fs::write(&toml, format!("{TOML}{text}")).unwrap();
        let arguments = format!("--scenario {toml} --uavs 5 --index 3");
        provision(&format!("{arguments} --network 7 --out {out}"))
    };
    assert!(of("[listen]\nfollowing = true\n").status.success());
    let block = std::fs::read(&out).unwrap();
    let expected = flight("[listen]\nfollowing = true\n").block(3).unwrap();
    assert_eq!(block, expected);
    for (text, parts) in [
        (
            "[listen]\nevery_s = 0\n",
            ["listen.every_s", "0.01 to 1e5 s"],
        ),
        (
            "[listen]\nhalf_life_s = 1e13\n",
            ["listen.half_life_s = 10000000000000", "0.01 to 1e12 s"],
        ),
        (
            "[listen]\nrelative_error = 2\n",
            ["listen.relative_error = 2", "0.001 to 1"],
        ),
        (
            "[listen]\nfollowing = 1\n",
            ["listen.following = 1", "true or false"],
        ),
        (
            "[listen]\nevery = 1\n",
            [
                "listen.every = 1",
                "following, every_s, half_life_s, relative_error",
            ],
        ),
        ("", ["interferer", "[field]"]),
    ] {
        let output = of(text);
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(!output.status.success(), "{text}");
        for part in parts {
            assert!(said.contains(part), "{part} not in {said}");
        }
    }
}
