//! Robustness of reading. Any flash content is a valid configuration, or an error that names the number.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::channel::ChannelError;
use uav_relay::field::FieldError;
use uav_relay::flight::course::Course;
use uav_relay::mission::MissionError;
use uav_relay::{Adjust, Instant, Local, Measure, Method, Relay, Settings};
use uav_relay_scenario::Scenario;
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::{Config, ConfigError, LEN};

use super::{changed, field, in_a_field, reads, with};

#[test]
fn a_number_out_of_range_is_named() {
    let nan = f32::NAN.to_le_bytes();
    for (at, bytes, error) in [
        (8, &[0, 0][..], ConfigError::Index),
        (8, &[6, 0], ConfigError::Index),
        (12, &[0, 0], ConfigError::Mission(MissionError::Relays)),
        (14, &[3], ConfigError::Method),
        (14, &[0xFF], ConfigError::Method),
        (15, &[2], ConfigError::Hold),
        (16, &nan, ConfigError::Mission(MissionError::Distance)),
        (20, &nan, ConfigError::Mission(MissionError::Separation)),
        (24, &nan, ConfigError::Mission(MissionError::TxPower)),
        (28, &nan, ConfigError::Mission(MissionError::Common)),
        (32, &nan, ConfigError::Mission(MissionError::Common)),
        (36, &nan, ConfigError::Profile),
        (40, &nan, ConfigError::Profile),
        (
            44,
            &nan,
            ConfigError::Mission(MissionError::InterfererPower),
        ),
        (
            48,
            &nan,
            ConfigError::Mission(MissionError::InterfererPlace),
        ),
        (
            52,
            &nan,
            ConfigError::Mission(MissionError::InterfererPlace),
        ),
        (56, &nan, ConfigError::Mission(MissionError::Tolerance)),
        (60, &[0; 8], ConfigError::Channel(ChannelError::Carrier)),
        (68, &[0; 8], ConfigError::Channel(ChannelError::ExcessLoss)),
        (76, &[0; 8], ConfigError::Channel(ChannelError::ExcessLoss)),
        (84, &[0xFF; 8], ConfigError::Channel(ChannelError::Weight)),
        (92, &nan, ConfigError::Mission(MissionError::Band)),
        (
            92,
            &20.5_f32.to_le_bytes(),
            ConfigError::Mission(MissionError::Band),
        ),
        (96, &nan, ConfigError::Mission(MissionError::Band)),
        (
            96,
            &19.5_f32.to_le_bytes(),
            ConfigError::Mission(MissionError::Band),
        ),
        (100, &nan, ConfigError::Mission(MissionError::Lateral)),
        (
            100,
            &0.5_f32.to_le_bytes(),
            ConfigError::Mission(MissionError::Lateral),
        ),
        (104, &nan, ConfigError::Mission(MissionError::Lateral)),
        (
            104,
            &(-0.5_f32).to_le_bytes(),
            ConfigError::Mission(MissionError::Lateral),
        ),
        // Without adjust, without measurements and without a field.
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
        // Without locating the interferer.
        (352, &[1], ConfigError::Listen),
        (360, &[1], ConfigError::Listen),
        (368, &0.1_f32.to_le_bytes(), ConfigError::Listen),
        // Without sites.
        (312, &1.0_f32.to_le_bytes(), ConfigError::Speed),
        (312, &(-0.0_f32).to_le_bytes(), ConfigError::Speed),
    ] {
        assert_eq!(reads(&with(at, bytes)), Err(error), "byte {at}");
    }
    assert_eq!(reads(&[0xFF; LEN]), Err(ConfigError::Blank));
    assert_eq!(reads(&[0; LEN]), Err(ConfigError::Blank));
}

/// Checks the limits of `explore`, `rounds`, `i_max_w` and `samples`, from just inside and outside.
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
        // Zero points mean an interferer, so the points' bytes must be 0.
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
    ] {
        assert_eq!(
            reads(&changed(field(3), at, bytes)),
            Err(error),
            "byte {at}"
        );
    }
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
    let sited = super::sites::flight();
    for flight in [adjust, field_of_four, sited] {
        let block = flight.block(3).unwrap();
        let mut good = 0;
        for _ in 0..20_000 {
            let at = rng.random_range(8..LEN - 8);
            let bytes: [u8; 4] = rng.random();
            // Four random bytes, or one, which is valid more often.
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
