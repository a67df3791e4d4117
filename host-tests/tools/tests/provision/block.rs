//! Bytes of a block, compared with the table of `examples/block/src/lib.rs`.
//!
//! The tests also check the block as a drone reads it.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::channel::ChannelError;
use uav_relay::field::FieldError;
use uav_relay::flight::course::Course;
use uav_relay::mission::MissionError;
use uav_relay::{Adjust, ChannelLoad, Instant, Local, Measure, Method, Relay, Settings, Wiring};
use uav_relay_scenario::fleet::FleetSize;
use uav_relay_scenario::link::{Access, Link, RateModel};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::{ListenSpec, Scenario};
use uav_relay_tools::provision::block::{BlockError, Flight};
use uav_relay_tools::provision::config::{Config, ConfigError, LEN, MAX_POINTS};

use super::{changed, example, field, in_a_field, paper, reads, with};

/// Returns the expected bytes of a block of the paper's scenario with some changes.
///
/// `method` has the number of the method, a flag (true for a fixed altitude), and the parameters of `adjust`. `band`
/// has the lowest and the highest altitude. `noise` has the interferer, and the bytes that begin with the number of
/// field points.
fn by_hand(method: (u8, bool, f32, u16), band: [f32; 2], noise: ([f32; 3], &[u8])) -> Vec<u8> {
    let (method, hold, explore_m, rounds) = method;
    let (interferer, rest) = noise;
    let mut bytes: Vec<u8> = b"UAVR\x0c\0\x8c\x01\x03\0\x07\0\x05\0".to_vec();
    bytes.extend([method, u8::from(hold)]);
    for number in [1000.0_f32, 4.0, 80.0, 20.0, 1.0, 20.0, 1.0] {
        bytes.extend(number.to_le_bytes());
    }
    for number in interferer.into_iter().chain([1e-4]) {
        bytes.extend(number.to_le_bytes());
    }
    for number in [2e9_f64, libm::pow(10.0, 0.01), libm::pow(10.0, 2.1), 1.0] {
        bytes.extend(number.to_le_bytes());
    }
    for number in band.into_iter().chain([0.0, 0.0, explore_m]) {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(rounds.to_le_bytes());
    bytes.extend(rest);
    bytes.resize(376, 0);
    bytes.extend(0_f32.to_le_bytes());
    bytes.extend(80_f32.to_le_bytes());
    bytes.extend(0_f32.to_le_bytes());
    bytes.extend([0; 4]);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

const PAPER: ([f32; 3], &[u8]) = ([80.0, 500.0, 400.0], &[]);

#[test]
fn a_block_follows_the_table() {
    assert_eq!(by_hand((0, false, 0.0, 0), [20.0; 2], PAPER), paper());

    let mut scenario = Scenario {
        altitude_max_m: 300.0,
        ..Scenario::default()
    };
    let own = scenario.relays.entry(3).or_default();
    own.altitude_m = Some(20.0);
    let flight = Flight::new(&scenario, 5, 1e-4, 7).unwrap();
    let block = flight.clone().by(Method::Joint).block(3).unwrap();
    assert_eq!(by_hand((1, true, 0.0, 0), [20.0, 300.0], PAPER), block);
    let adjust = Method::Adjust(Adjust {
        rounds: 0x1234,
        explore_m: 2.5,
        local: Local::Fine,
    });
    let block = flight.by(adjust).block(3).unwrap();
    assert_eq!(by_hand((2, true, 2.5, 0x1234), [20.0, 300.0], PAPER), block);

    // Upsilon = (alpha + beta - 1) / ((alpha - 1) I_max). For alpha = 2 this is (1 + beta) / I_max.
    let mut rest = b"\x03\0".to_vec();
    rest.extend(2e-10_f32.to_le_bytes());
    rest.extend(100_000_u32.to_le_bytes());
    for (x, upsilon) in [(0.0_f32, 1e10_f32), (100.0, 1.5e10), (200.0, 2e10)] {
        rest.extend(x.to_le_bytes());
        rest.extend(upsilon.to_le_bytes());
    }
    let measure = Measure {
        i_max_w: 2e-10,
        samples: 100_000,
    };
    let flight = Flight::new(&in_a_field(3), 5, 1e-4, 7).unwrap();
    let block = flight.measuring(Some(measure)).block(3).unwrap();
    assert_eq!(
        by_hand((0, false, 0.0, 0), [20.0; 2], ([0.0; 3], &rest)),
        block
    );
}

#[test]
fn the_silence_limit_is_in_the_block_and_the_settings() {
    let flight = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    let usual = flight.block(3).unwrap();
    let block = flight.with_probe_after(0x0102).block(3).unwrap();
    assert_eq!(block[..372], usual[..372]);
    assert_eq!(block[372..376], [2, 1, 0, 0]);
    let ms = |block, wiring| {
        let settings = reads(&block).unwrap().settings(wiring);
        [settings.probe_after, settings.dead_after].map(|time| time.as_micros() / 1_000)
    };
    for wiring in [Wiring::Pair, Wiring::Shared] {
        assert_eq!(ms(block, wiring), [258, 774]);
        assert_eq!(ms(usual, wiring), [5_000, 15_000]);
    }
    let settings = reads(&usual).unwrap().settings(Wiring::Shared);
    assert_eq!(
        settings,
        Settings::radio(115_200, ChannelLoad::of_radios(5))
    );
}

#[test]
fn a_fleet_is_in_every_block() {
    let flight = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    let usual = flight.block(4).unwrap();
    let size = FleetSize {
        relays: 5,
        flying: 3,
    };
    let flight = flight.with_fleet(Some(size));
    for (index, spare) in [(1, false), (2, false), (3, true), (4, false), (5, true)] {
        let config = reads(&flight.block(index).unwrap()).unwrap();
        assert_eq!((config.flying, config.spare), (3, spare), "{index}");
    }
    let block = flight.block(4).unwrap();
    assert_eq!(block[8..388], usual[8..388]);
    assert_eq!(block[388..392], [3, 0, 0, 0]);
    assert_eq!(flight.block(5).unwrap()[388..392], [3, 0, 1, 0]);
    let config = reads(&usual).unwrap();
    assert_eq!((config.flying, config.spare), (0, false));
}

#[test]
fn a_drone_reads_its_task_from_the_block() {
    let scenario = Scenario {
        altitude_max_m: 120.0,
        ..Scenario::load(&example()).unwrap()
    };
    let adjust = Method::Adjust(Adjust {
        rounds: 1,
        explore_m: 0.0,
        local: Local::Fine,
    });
    for method in [Method::Align, Method::Joint, adjust] {
        let flight = Flight::new(&scenario, 6, 1e-4, 9).unwrap().by(method);
        for index in 1..=6 {
            let config = reads(&flight.block(index).unwrap()).unwrap();
            assert_eq!(config.method, method);
            assert_eq!(config.measure, None);
            // Relay 2 has its own altitude, and relay 5 only its own power.
            assert_eq!(config.hold_altitude, index == 2);
            let band = config.mission.config().band;
            assert_eq!((band.least_m, band.most_m), (40.0, 120.0));
        }
    }
    for points in [1, 2, MAX_POINTS] {
        let flight = Flight::new(&in_a_field(points), 6, 1e-4, 9).unwrap();
        let config = reads(&flight.block(1).unwrap()).unwrap();
        assert_eq!(config.mission, *flight.mission());
    }
}

#[test]
fn a_block_that_cannot_hold_the_values_is_not_written() {
    let too_many = Flight::new(&in_a_field(17), 5, 1e-4, 7);
    assert_eq!(too_many.err(), Some(BlockError::Points(17)));
    let grid = Adjust {
        local: Local::Grid {
            columns: 9,
            rows: 9,
        },
        ..Adjust::default()
    };
    let measure = Measure {
        i_max_w: 2e-10,
        samples: 99,
    };
    let of = |scenario: &Scenario| Flight::new(scenario, 5, 1e-4, 7).unwrap();
    for (flight, error) in [
        (
            of(&Scenario::default()).by(Method::Adjust(grid)),
            BlockError::Changed,
        ),
        (
            of(&in_a_field(3)).by(Method::Joint),
            BlockError::Config(ConfigError::Method),
        ),
        (
            of(&in_a_field(3)).by(Method::Adjust(Adjust::default())),
            BlockError::Config(ConfigError::Method),
        ),
        (
            of(&in_a_field(3)).measuring(Some(measure)),
            BlockError::Config(ConfigError::Measure),
        ),
    ] {
        assert_eq!(flight.block(3), Err(error));
    }
}

#[test]
fn a_drone_reads_the_scenarios_exact_mission() {
    let scenario = Scenario::load(&example()).unwrap();
    let flight = Flight::new(&scenario, 6, 1e-3, 9).unwrap();
    for index in 1..=6 {
        let config = reads(&flight.block(index).unwrap()).unwrap();
        assert_eq!(config.mission, *flight.mission());
        assert_eq!((config.identity.index, config.identity.network), (index, 9));
        let altitude = if index == 2 { 55.0 } else { 40.0 };
        let power = if index == 5 { 1.0 } else { 2.0 };
        assert_eq!(
            (config.profile.altitude_m, config.profile.power_w),
            (altitude, power)
        );
    }
    for index in [0, 7] {
        assert_eq!(
            flight.block(index),
            Err(BlockError::Config(ConfigError::Index))
        );
    }
}

#[test]
fn every_flipped_bit_of_a_block_is_noticed() {
    for (at, of) in (0..LEN).zip([paper(), field(4)].iter().cycle()) {
        for bit in 0..8 {
            let mut block = *of;
            block[at] ^= 1 << bit;
            let expected = match at {
                0..4 => ConfigError::Magic,
                4..8 => ConfigError::Version,
                _ => ConfigError::Crc,
            };
            assert_eq!(reads(&block), Err(expected), "bit {bit} of byte {at}");
        }
    }
}

#[test]
fn a_number_out_of_range_is_named() {
    use ConfigError::{Channel, Mission};

    let nan = f32::NAN.to_le_bytes();
    for (at, bytes, error) in [
        (8, &[0, 0][..], ConfigError::Index),
        (8, &[6, 0], ConfigError::Index),
        (12, &[0, 0], Mission(MissionError::Relays)),
        (14, &[3], ConfigError::Method),
        (14, &[0xFF], ConfigError::Method),
        (15, &[2], ConfigError::Hold),
        (16, &nan, Mission(MissionError::Distance)),
        (20, &nan, Mission(MissionError::Separation)),
        (24, &nan, Mission(MissionError::TxPower)),
        (28, &nan, Mission(MissionError::Common)),
        (32, &nan, Mission(MissionError::Common)),
        (36, &nan, ConfigError::Profile),
        (40, &nan, ConfigError::Profile),
        (44, &nan, Mission(MissionError::InterfererPower)),
        (48, &nan, Mission(MissionError::InterfererPlace)),
        (52, &nan, Mission(MissionError::InterfererPlace)),
        (56, &nan, Mission(MissionError::Tolerance)),
        (60, &[0; 8], Channel(ChannelError::Carrier)),
        (68, &[0; 8], Channel(ChannelError::ExcessLoss)),
        (76, &[0; 8], Channel(ChannelError::ExcessLoss)),
        (84, &[0xFF; 8], Channel(ChannelError::Weight)),
        (92, &nan, Mission(MissionError::Band)),
        (92, &20.5_f32.to_le_bytes(), Mission(MissionError::Band)),
        (96, &nan, Mission(MissionError::Band)),
        (96, &19.5_f32.to_le_bytes(), Mission(MissionError::Band)),
        (100, &nan, Mission(MissionError::Lateral)),
        (100, &0.5_f32.to_le_bytes(), Mission(MissionError::Lateral)),
        (104, &nan, Mission(MissionError::Lateral)),
        (
            104,
            &(-0.5_f32).to_le_bytes(),
            Mission(MissionError::Lateral),
        ),
        // Values of a block without adjust, measurements and field.
        (108, &1.0_f32.to_le_bytes(), ConfigError::Adjust),
        (108, &(-0.0_f32).to_le_bytes(), ConfigError::Adjust),
        (112, &[1, 0], ConfigError::Adjust),
        (114, &[17, 0], ConfigError::Points),
        (114, &[0xFF; 2], ConfigError::Points),
        (114, &[1, 0], ConfigError::Interferer),
        (116, &1.0_f32.to_le_bytes(), ConfigError::Measure),
        (120, &[100, 0], ConfigError::Measure),
        (124, &[1], ConfigError::Unused),
        (251, &[0x80], ConfigError::Unused),
        // Values of a block that does not locate an interferer.
        (352, &[1], ConfigError::Listen),
        (360, &[1], ConfigError::Listen),
        (368, &0.1_f32.to_le_bytes(), ConfigError::Listen),
        (390, &[2, 0], ConfigError::Spare),
        // Values of a block without sites.
        (312, &1.0_f32.to_le_bytes(), ConfigError::Speed),
        (312, &(-0.0_f32).to_le_bytes(), ConfigError::Speed),
    ] {
        assert_eq!(reads(&with(at, bytes)), Err(error), "byte {at}");
    }
    assert_eq!(reads(&[0xFF; LEN]), Err(ConfigError::Blank));
    assert_eq!(reads(&[0; LEN]), Err(ConfigError::Blank));
}

/// Checks the ranges of `explore`, `rounds`, `i_max_w` and `samples`.
///
/// Values just outside must be rejected, and values just inside accepted.
#[test]
fn the_ranges_of_adjust_and_measure_are_those_of_a_relay() {
    for (explore_m, rounds, good) in [
        (0.0_f32, 1_u16, true),
        (1e5, u16::MAX, true),
        (10.0, 0, false),
        (f32::NAN, 100, false),
        (-0.1, 100, false),
        (1e5_f32.next_up(), 100, false),
    ] {
        let block = with(14, &[2]);
        let block = changed(block, 108, &explore_m.to_le_bytes());
        let block = changed(block, 112, &rounds.to_le_bytes());
        let adjust = Adjust {
            rounds,
            explore_m,
            local: Local::Fine,
        };
        let expected = if good {
            Ok(Method::Adjust(adjust))
        } else {
            Err(ConfigError::Adjust)
        };
        assert_eq!(reads(&block).map(|config| config.method), expected);
    }
    for (i_max_w, samples, good) in [
        (1e-30_f32, 100_u32, true),
        (1e6, 1_000_000, true),
        (1.0, 99, false),
        (1.0, 1_000_001, false),
        (1.0, 0, false),
        (0.0, 100, false),
        (f32::NAN, 100, false),
        (1e-30_f32.next_down(), 100, false),
        (1e6_f32.next_up(), 100, false),
    ] {
        let block = changed(field(2), 116, &i_max_w.to_le_bytes());
        let block = changed(block, 120, &samples.to_le_bytes());
        let expected = if good {
            Ok(Some(Measure { i_max_w, samples }))
        } else {
            Err(ConfigError::Measure)
        };
        assert_eq!(reads(&block).map(|config| config.measure), expected);
    }
}

#[test]
fn a_field_out_of_range_is_named() {
    let one = 1.0_f32.to_le_bytes();
    let nan = f32::NAN.to_le_bytes();
    for (at, bytes, error) in [
        (14, &[1][..], ConfigError::Method),
        (44, &one, ConfigError::Interferer),
        (48, &one, ConfigError::Interferer),
        (52, &one, ConfigError::Interferer),
        (114, &[2, 0], ConfigError::Unused),
        (114, &[4, 0], ConfigError::Field(FieldError::Order)),
        // Without points the block has an interferer, so the bytes of the points must be 0.
        (114, &[0, 0], ConfigError::Unused),
        (114, &[17, 0], ConfigError::Points),
        (124, &nan, ConfigError::Field(FieldError::Place)),
        (
            124,
            &2e7_f32.to_le_bytes(),
            ConfigError::Field(FieldError::Place),
        ),
        (132, &[0; 4], ConfigError::Field(FieldError::Order)),
        (136, &nan, ConfigError::Field(FieldError::Upsilon)),
        (144, &[0; 4], ConfigError::Field(FieldError::Upsilon)),
        (148, &one, ConfigError::Unused),
        (248, &one, ConfigError::Unused),
        (372, &1_200_001_u32.to_le_bytes(), ConfigError::Silence),
        (
            376,
            &2.0_f32.to_le_bytes(),
            ConfigError::Mission(MissionError::Reverse),
        ),
        (376, &nan, ConfigError::Mission(MissionError::Reverse)),
        (380, &[0; 4], ConfigError::Mission(MissionError::RxPower)),
    ] {
        assert_eq!(
            reads(&changed(field(3), at, bytes)),
            Err(error),
            "byte {at}"
        );
    }
}

#[test]
fn fitted_slots_are_stored_for_joint_only() {
    let link = |model| {
        let access = Access::Fitted;
        Some(Link {
            access,
            bandwidth_hz: None,
            model,
        })
    };
    let scenario = Scenario {
        link: link(RateModel::Shannon { gap_db: 3.0 }),
        ..Scenario::default()
    };
    let flight = |scenario: &Scenario, method| {
        let flight = Flight::new(scenario, 5, 1e-4, 7).unwrap().by(method);
        flight.with_access(scenario)
    };
    let block = flight(&scenario, Method::Joint).unwrap().block(3).unwrap();
    let gap = narrow(10_f64.powf(0.3));
    assert_eq!(block[384..388], gap.to_le_bytes());
    flies(&reads(&block).unwrap());
    let equal = flight(&scenario, Method::Align).unwrap().block(3).unwrap();
    assert_eq!(equal[384..388], [0; 4]);
    let by_align = reads(&changed(block, 14, &[0]));
    assert_eq!(by_align, Err(ConfigError::Fitted));
    // Fitted slots need a known interferer.
    let sensing = [5_000_000_u64.to_le_bytes(), 60_000_000_u64.to_le_bytes()].concat();
    let sensing = [sensing, 0.03_f32.to_le_bytes().to_vec()].concat();
    let listening = changed(block, 352, &sensing);
    assert_eq!(reads(&listening), Err(ConfigError::Fitted));
    let unknown = changed(listening, 44, &[0; 12]);
    assert_eq!(reads(&unknown), Err(ConfigError::Fitted));
    let below = reads(&changed(block, 384, &0.5_f32.to_le_bytes()));
    assert_eq!(below, Err(ConfigError::Mission(MissionError::FittedGap)));
    let steps = Scenario {
        link: link(RateModel::Steps(Vec::new())),
        ..scenario
    };
    let error = flight(&steps, Method::Joint).err().unwrap().to_string();
    assert!(
        error.contains("link.steps") && error.contains("joint"),
        "{error}"
    );
    assert!(flight(&steps, Method::Align).is_ok());
}

#[test]
fn a_way_back_is_stored_and_is_refused_for_joint_with_sensing() {
    let scenario = Scenario {
        reverse: 0.25,
        rx_w: 5.0,
        ..Scenario::default()
    };
    let flight = Flight::new(&scenario, 5, 1e-4, 7).unwrap();
    let block = flight.block(3).unwrap();
    assert_eq!(block[376..380], 0.25_f32.to_le_bytes());
    assert_eq!(block[380..384], 5.0_f32.to_le_bytes());
    let config = reads(&block).unwrap();
    let mission = config.mission.config();
    assert!((mission.reverse, mission.rx_power_w) == (0.25, 5.0));
    flies(&config);
    assert_eq!(
        reads(&changed(block, 14, &[1])).map(|config| config.method),
        Ok(Method::Joint)
    );
    for method in [Method::Joint, Method::Adjust(Adjust::default())] {
        let flight = Flight::new(&scenario, 5, 1e-4, 7).unwrap().by(method);
        let block = flight.block(3).unwrap();
        flies(&reads(&block).unwrap());
    }
    let listening = Scenario {
        listen: Some(ListenSpec::default()),
        ..scenario
    };
    let flight = Flight::new(&listening, 5, 1e-4, 7).unwrap();
    let error = flight.by(Method::Joint).block(3).unwrap_err();
    assert_eq!(error, BlockError::Config(ConfigError::Reverse));
    assert!(error.to_string().contains("link.reverse"), "{error}");
    let higher = 1.0_f32.next_up().to_le_bytes();
    let error = ConfigError::Mission(MissionError::Reverse);
    assert_eq!(reads(&changed(block, 376, &higher)), Err(error));
}

fn flies(config: &Config) {
    let settings = Settings {
        profile: Some(config.profile),
        hold_altitude: config.hold_altitude,
        method: config.method,
        measure: config.measure,
        listen: config.listen,
        ..Settings::default()
    };
    Relay::new(config.mission, config.identity, settings, 1, Instant::ZERO).unwrap();
    if let Some(Ok(course)) = config
        .sites
        .map(|sites| Course::try_new(sites.on_earth(), sites.speed_m_s, &config.mission))
    {
        assert!(course.pace.is_valid());
    }
}

#[test]
fn any_bytes_are_a_configuration_or_an_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(uav_relay_oracle::random::seed(41));
    let adjust = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    let adjust = adjust.by(Method::Adjust(Adjust::default()));
    let field_of_four = Flight::new(&in_a_field(4), 5, 1e-4, 7).unwrap();
    let measure = Measure {
        i_max_w: 1e-9,
        samples: 1_000,
    };
    let field_of_four = field_of_four.measuring(Some(measure));
    let sited = super::parts::flight();
    for flight in [adjust, field_of_four, sited] {
        let block = flight.block(3).unwrap();
        let mut good = 0;
        for _ in 0..20_000 {
            let at = rng.random_range(8..LEN - 8);
            let bytes: [u8; 4] = rng.random();
            // Four random bytes or one; one random byte is valid more often.
            let cut = if rng.random() { 1 } else { 4 };
            if let Ok(config) = reads(&changed(block, at, &bytes[..cut])) {
                flies(&config);
                good += 1;
            }
            let noise: [u8; LEN] = rng.random();
            assert!(reads(&noise).is_err());
        }
        assert!((100..19_000).contains(&good), "{good} of 20000 were good");
    }
}
