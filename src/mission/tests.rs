//! The paper's scenario, and the checks of a mission's parameters.

use super::{Band, Interference, Interferer, Mission, MissionConfig, MissionError, Profile};
use crate::channel::{AirGround, Channel};
use crate::features::{ALTITUDE, NOISE, REVERSE};

/// Interferer of the paper's multi-hop scenario, which the tests use.
pub(crate) const fn interferer() -> Interferer {
    Interferer {
        power_w: 80.0,
        x_m: 500.0,
        y_m: 400.0,
    }
}

pub(crate) fn paper(relays: u16) -> MissionConfig {
    MissionConfig {
        relays,
        distance_m: 1000.0,
        min_separation_m: 4.0,
        tx_power_w: 80.0,
        common: Profile {
            altitude_m: 20.0,
            power_w: 1.0,
        },
        band: Band::at(20.0),
        lateral: Band::NONE,
        channel: Channel::from_db(2e9, 0.1, 21.0, AirGround::Los).unwrap(),
        interference: Interference::Source(interferer()),
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: 80.0,
        fitted_gap: 0.0,
        tolerance: 1e-4,
    }
}

fn with_source(config: &mut MissionConfig, change: impl FnOnce(&mut Interferer)) {
    let mut source = interferer();
    change(&mut source);
    config.interference = Interference::Source(source);
}

#[test]
fn every_parameter_is_checked_at_both_ends_and_for_nan() {
    type Set = fn(&mut MissionConfig, f32);
    let table: [(Set, f32, f32, MissionError); 14] = [
        (|c, v| c.distance_m = v, 1.0, 1e6, MissionError::Distance),
        (
            |c, v| c.min_separation_m = v,
            0.0,
            1e5,
            MissionError::Separation,
        ),
        (|c, v| c.tx_power_w = v, 1e-6, 1e6, MissionError::TxPower),
        (
            |c, v| {
                c.common.altitude_m = v;
                c.band = Band::at(v.clamp(0.1, 1e5));
            },
            0.1,
            1e5,
            MissionError::Common,
        ),
        (|c, v| c.band.least_m = v, 0.1, 20.0, MissionError::Band),
        (|c, v| c.band.most_m = v, 20.0, 1e5, MissionError::Band),
        (|c, v| c.common.power_w = v, 1e-6, 1e6, MissionError::Common),
        (
            |c, v| with_source(c, |source| source.power_w = v),
            1e-6,
            1e9,
            MissionError::InterfererPower,
        ),
        (
            |c, v| with_source(c, |source| source.x_m = v),
            -1e7,
            1e7,
            MissionError::InterfererPlace,
        ),
        (
            |c, v| with_source(c, |source| source.y_m = v),
            -1e7,
            1e7,
            MissionError::InterfererPlace,
        ),
        (
            |c, v| {
                // Interference strong enough that 1 W of noise is a fraction of it.
                with_source(c, |source| source.power_w = 1e9);
                c.noise_w = v;
            },
            0.0,
            1.0,
            MissionError::Noise,
        ),
        (|c, v| c.reverse = v, 0.0, 1.0, MissionError::Reverse),
        (|c, v| c.rx_power_w = v, 1e-6, 1e6, MissionError::RxPower),
        (|c, v| c.tolerance = v, 1e-6, 0.1, MissionError::Tolerance),
    ];
    for (set, least, most, error) in table {
        let with = |value| {
            let mut config = paper(1);
            set(&mut config, value);
            Mission::try_new(config).map(|_| ())
        };
        assert_eq!(with(least), Ok(()), "{error}");
        let at_most = match error {
            MissionError::Noise if !NOISE => Err(MissionError::NoiseFeature),
            MissionError::Reverse if !REVERSE => Err(MissionError::ReverseFeature),
            _ => Ok(()),
        };
        assert_eq!(with(most), at_most, "{error}");
        for bad in [
            least.next_down(),
            most.next_up(),
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
        ] {
            assert_eq!(with(bad), Err(error), "{bad}");
        }
    }
    assert_eq!(Mission::try_new(paper(0)), Err(MissionError::Relays));
    assert_eq!(Mission::try_new(paper(1001)), Err(MissionError::Relays));
    assert_eq!(
        Mission::try_new(paper(251)),
        Err(MissionError::TooManyForDistance)
    );
    assert!(Mission::try_new(paper(250)).is_ok());
}

#[test]
fn a_gap_of_fitted_slots_is_0_or_within_1_to_1000() {
    let with = |fitted_gap: f32| {
        let config = MissionConfig {
            fitted_gap,
            ..paper(1)
        };
        Mission::try_new(config).map(|_| ())
    };
    let (met, refused) = if ALTITUDE {
        (Ok(()), Err(MissionError::FittedGap))
    } else {
        [Err(MissionError::FittedFeature); 2].into()
    };
    assert_eq!([0.0, 1.0, 1e3].map(with), [Ok(()), met, met]);
    let low = 1.0_f32.next_down();
    for bad in [-0.0, -1.0, low, 1e3_f32.next_up(), f32::NAN] {
        assert_eq!(with(bad), refused, "{bad}");
    }
}

#[cfg(feature = "noise")]
#[test]
fn noise_that_leaves_nothing_of_the_interferer_is_refused() {
    let with = |noise_w: f32| {
        let mut config = paper(1);
        with_source(&mut config, |source| source.power_w = 1e-6);
        let channel = Channel::from_db(2e9, 100.0, 121.0, AirGround::Los).unwrap();
        Mission::try_new(MissionConfig {
            channel,
            noise_w,
            ..config
        })
        .map(|_| ())
    };
    // eta is 7e13: 1e12 times the power received at 1 m from a microwatt is 1.4e-8 W.
    assert_eq!(with(1e-8), Ok(()));
    assert_eq!(with(2e-8), Err(MissionError::Noise));
}
