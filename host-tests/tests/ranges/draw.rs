//! Random numbers, missions and settings from their whole ranges, with frequent limits.

use host_tests::make;
use rand::{Rng, RngExt};

use uav_relay::channel::AirGround;
use uav_relay::guard::config::{Geofence, GuardConfig};
use uav_relay::{
    Adjust, Band, Channel, Duration, Field, FieldPoint, Interference, Listen, Local, Measure,
    Method, Mission, MissionConfig, Schedule, Settings, Wiring, WithoutQuorum,
};

/// Draws a positive number: `usual`, `least`, `most`, or a log-uniform number from `least` to `most`.
pub(crate) fn scaled(rng: &mut impl Rng, usual: f32, least: f32, most: f32) -> f32 {
    match rng.random_range(0..8) {
        0..4 => usual.clamp(least, most),
        4 => least,
        5 => most,
        _ => {
            let (low, high) = (f64::from(least).ln(), f64::from(most).ln());
            (rng.random_range(low..=high).exp() as f32).clamp(least, most)
        }
    }
}

/// Draws a number of either sign, up to `most`: 0, `usual`, the limit, or a random number.
pub(crate) fn signed(rng: &mut impl Rng, usual: f32, most: f32) -> f32 {
    let size = scaled(rng, usual.abs(), 1e-3, most);
    match rng.random_range(0..8) {
        0 => 0.0,
        1..4 => -size,
        _ => size,
    }
}

const fn point(x_m: f32, upsilon_per_w: f32) -> FieldPoint {
    FieldPoint { x_m, upsilon_per_w }
}

const FIELDS: [Field; 6] = [
    Field::new(&[
        point(0.0, 4.2e5),
        point(600.0, 3.75e5),
        point(1000.0, 4.4e5),
    ]),
    Field::new(&[point(0.0, 1e32)]),
    Field::new(&[point(0.0, 1e-9)]),
    Field::new(&[point(0.0, 1e32), point(1000.0, 1e-9)]),
    Field::new(&[point(-1e7, 1e-9), point(1e7, 1e32)]),
    Field::new(&[
        point(-1e7, 1e32),
        point(300.0, 1e-9),
        point(300.000_1, 1e32),
    ]),
];

/// Draws a mission of at most `most` relays; `None` if its numbers contradict each other.
pub(crate) fn mission(rng: &mut impl Rng, most: u16) -> Option<Mission> {
    let distance_m = scaled(rng, 1_000.0, 1.0, 1e6);
    let relays = rng.random_range(1..=most);
    let (one, other) = (scaled(rng, 20.0, 0.1, 1e5), scaled(rng, 120.0, 0.1, 1e5));
    let band = make::band(one.min(other), one.max(other));
    let altitude_m = match rng.random_range(0..3) {
        0 => band.least_m,
        1 => band.most_m,
        _ => rng.random_range(band.least_m..=band.most_m),
    };
    let lateral = if rng.random() {
        Band::NONE
    } else {
        make::band(
            -scaled(rng, 100.0, 1e-3, 1e5),
            scaled(rng, 100.0, 1e-3, 1e5),
        )
    };
    let room = distance_m / f32::from(relays);
    let config = MissionConfig {
        relays,
        distance_m,
        min_separation_m: match rng.random_range(0..4) {
            0 => 0.0,
            1 => room.min(1e5),
            _ => scaled(rng, 4.0, 1e-3, 1e5).min(0.9 * room),
        },
        tx_power_w: scaled(rng, 80.0, 1e-6, 1e6),
        common: make::profile(altitude_m, scaled(rng, 1.0, 1e-6, 1e6)),
        band,
        lateral,
        channel: channel(rng)?,
        interference: match rng.random_range(0..8) {
            0 => Interference::Unknown,
            1 => Interference::Field(FIELDS[rng.random_range(0..FIELDS.len())]),
            _ => Interference::Source(make::interferer(
                scaled(rng, 80.0, 1e-6, 1e9),
                signed(rng, 0.5 * distance_m, 1e7),
                signed(rng, 0.4 * distance_m, 1e7),
            )),
        },
        noise_w: match rng.random_range(0..3) {
            0 => 0.0,
            1 => scaled(rng, 1e-13, 1e-30, 1.0),
            _ => scaled(rng, 1e-13, f32::from_bits(1), 1e-9),
        },
        reverse: 0.0,
        rx_power_w: scaled(rng, 80.0, 1e-6, 1e6),
        fitted_gap: 0.0,
        tolerance: scaled(rng, 1e-4, 1e-6, 0.1),
    };
    let is_known = matches!(config.interference, Interference::Source(_));
    let reverse = match rng.random_range(0..4) {
        0 if is_known => 1.0,
        1 if is_known => scaled(rng, 0.3, f32::from_bits(1), 1.0),
        _ => 0.0,
    };
    Mission::try_new(MissionConfig { reverse, ..config }).ok()
}

fn channel(rng: &mut impl Rng) -> Option<Channel> {
    let carrier_hz = f64::from(scaled(rng, 2e9, 1e6, 1e12));
    let factor = |rng: &mut _, usual| f64::from(scaled(rng, usual, 1.0, 1e20)).clamp(1.0, 1e20);
    let (one, other) = (factor(rng, 1.02), factor(rng, 125.9));
    let air_ground = match rng.random_range(0..3) {
        0 => AirGround::Los,
        1 => AirGround::Nlos,
        _ => AirGround::Weighted(rng.random_range(0.0..=1.0)),
    };
    Channel::new(carrier_hz, one.min(other), one.max(other), air_ground).ok()
}

/// Draws the settings that all relays of a chain share.
pub(crate) fn settings(rng: &mut impl Rng, mission: &Mission) -> Settings {
    let one_way = mission.config().reverse == 0.0;
    let sourced = mission.field().is_none();
    let method = match rng.random_range(0..3) {
        0 if sourced && one_way => Method::Joint,
        1 if sourced && one_way => Method::Adjust(Adjust {
            rounds: rng.random_range(0..4),
            explore_m: match rng.random_range(0..4) {
                0 => 0.0,
                _ => scaled(rng, 10.0, 1e-3, 1e5),
            },
            local: match rng.random_range(0..3) {
                0 => Local::Grid {
                    columns: 2,
                    rows: 2,
                },
                1 => Local::Grid {
                    columns: 40,
                    rows: 40,
                },
                _ => Local::Fine,
            },
        }),
        _ => Method::Align,
    };
    let micros = |rng: &mut _, usual: f32, least: f32| {
        Duration::from_micros(f64::from(scaled(rng, usual, least, 1e13)) as u64)
    };
    let probe_after = micros(rng, 5e6, 1e6);
    Settings {
        method,
        listen: (sourced && one_way && rng.random()).then(|| Listen {
            every: micros(rng, 5e6, 1e5),
            half_life: micros(rng, 6e7, 1.0),
            relative_error: scaled(rng, 0.03, 1e-3, 1.0),
        }),
        measure: (!sourced && rng.random()).then(|| Measure {
            i_max_w: scaled(rng, 1e-6, 1e-30, 1e6),
            samples: 100,
        }),
        schedule: Schedule::Bracketed,
        predict: rng.random(),
        wiring: if rng.random() {
            Wiring::Pair
        } else {
            Wiring::Shared
        },
        hop_time: micros(rng, 3e4, 1e3).min(Duration::from_millis(60_000)),
        probe_after,
        dead_after: probe_after.times(3),
        without_quorum: if rng.random() {
            WithoutQuorum::Hold
        } else {
            WithoutQuorum::Leave {
                y_m: signed(rng, 10.0, 1e4),
                up_m: scaled(rng, 10.0, 1e-3, 1e4),
            }
        },
        ..Settings::default()
    }
}

/// Draws settings that all relays of a chain share. With these settings an agreement can take arbitrarily long.
pub(crate) fn slow_settings(rng: &mut impl Rng, mission: &Mission) -> Settings {
    let usual = settings(rng, mission);
    let micros = |most: f64, rng: &mut _| f64::from(scaled(rng, 3e4, 1e3, 1e13)).min(most) as u64;
    let method = match usual.method {
        Method::Adjust(adjust) => Method::Adjust(Adjust {
            rounds: [20, u16::MAX][rng.random_range(0..2)],
            ..adjust
        }),
        method => method,
    };
    let schedule = if rng.random() {
        let step = f64::from(scaled(rng, 0.1, f32::from_bits(1), f32::MAX));
        Schedule::FixedStep { step }
    } else {
        Schedule::Bracketed
    };
    Settings {
        method,
        measure: usual.measure.map(|measure| Measure {
            samples: [100, 1_000, 1_000_000][rng.random_range(0..3)],
            ..measure
        }),
        schedule,
        hop_time: Duration::from_micros(micros(1e13, rng)),
        dead_after: match rng.random_range(0..3) {
            0 => Duration::from_micros(usual.probe_after.as_micros() + 1),
            1 => usual.probe_after.times(100),
            _ => Duration::from_micros(usual.probe_after.as_micros() + micros(1e13, rng)),
        },
        ..usual
    }
}

/// Draws the settings of one relay: the settings that all relays share, and a random profile. `guarded` adds a motion guard.
pub(crate) fn own(
    rng: &mut impl Rng,
    mission: &Mission,
    common: Settings,
    guarded: bool,
) -> Settings {
    let profile = rng
        .random_ratio(1, 4)
        .then(|| make::profile(scaled(rng, 20.0, 0.1, 1e5), scaled(rng, 1.0, 1e-6, 1e6)));
    let held = profile.unwrap_or(mission.config().common);
    Settings {
        profile,
        hold_altitude: rng.random_ratio(1, 4),
        guard: guarded.then(|| GuardConfig {
            hover_m: match rng.random_range(0..2) {
                0 => 0.0,
                _ => scaled(rng, 1.0, 1e-3, 1e3),
            },
            separation_m: match rng.random_range(0..4) {
                0 => 0.0,
                1 => scaled(rng, 4.0, 1e-3, 1e5),
                _ => mission.config().min_separation_m,
            },
            geofence: if rng.random_ratio(1, 4) {
                fence(rng)
            } else {
                let guard = GuardConfig::of(mission, held);
                guard.with_room_for(common.without_quorum).geofence
            },
            ..GuardConfig::of(mission, held)
        }),
        ..common
    }
}

/// Draws a geofence anywhere; its ranges may be single points.
fn fence(rng: &mut impl Rng) -> Geofence {
    let mut range = |usual| {
        let (one, other) = (signed(rng, usual, 1e7), signed(rng, usual, 1e7));
        let other = if rng.random_ratio(1, 4) { one } else { other };
        [one.min(other), one.max(other)]
    };
    let [least_x_m, most_x_m] = range(1_000.0);
    let [least_y_m, most_y_m] = range(100.0);
    let [least_altitude_m, most_altitude_m] = range(20.0);
    Geofence {
        least_x_m,
        most_x_m,
        least_y_m,
        most_y_m,
        least_altitude_m,
        most_altitude_m,
    }
}
